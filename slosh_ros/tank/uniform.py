"""Tanks of uniform section along x with flat ends, and the liquid at rest in them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import scipy

from slosh_ros.tank.polygon import Polygon
from slosh_ros.tank.section import (
    Array,
    Circle,
    Ellipse,
    Rectangle,
    RoundedRectangle,
    Section,
    SectionMoments,
)
from slosh_ros.tank.sizes import require_lengths


@dataclass(frozen=True, eq=False)
class LiquidAtRest:
    """
    The liquid in a tank at rest, for unit density.

    Attributes
    ----------
    depth : float
        Greatest depth [m].
    fill_ratio : float
        Fraction of the tank's volume.
    volume : float
        Volume of the liquid [m^3].
    surface_centre : array, shape (3,)
        O, the centre of the mean free surface, in the tank frame [m].
    freeboard : float
        Height of the roof above the mean free surface [m].
    centroid : array, shape (3,)
        Centroid about O, tank axes [m].
    inertia : array, shape (3, 3)
        Inertia of the frozen liquid about O over its density, tank axes [m^5].
    surface_inertia : array, shape (2, 2)
        Integrals of x^2 dS, x y dS and y^2 dS over the mean free surface, about O [m^4].
    """

    depth: float
    fill_ratio: float
    volume: float
    surface_centre: Array
    freeboard: float
    centroid: Array
    inertia: Array
    surface_inertia: Array

    @property
    def surface_height(self) -> float:
        """Height of the mean free surface in the tank frame [m]."""
        return float(self.surface_centre[2])

    @classmethod
    def none(cls, height: float) -> LiquidAtRest:
        """Describe what is in an empty tank of the given height [m]; O is at its bottom."""
        return cls(
            depth=0.0,
            fill_ratio=0.0,
            volume=0.0,
            surface_centre=np.array([0.0, 0.0, -height / 2.0]),
            freeboard=height,
            centroid=np.zeros(3),
            inertia=np.zeros((3, 3)),
            surface_inertia=np.zeros((2, 2)),
        )

    def enclosed(self) -> LiquidAtRest:
        """Describe the same liquid in a tank that is full: the roof leaves no free surface."""
        return replace(self, fill_ratio=1.0, freeboard=0.0, surface_inertia=np.zeros((2, 2)))


@dataclass(frozen=True)
class UniformTank:
    """
    A tank of uniform section along x with flat ends.

    The tank frame has x forward, y left, z up and its origin at the centre of the inner bounding
    box, whatever the fill.

    Parameters
    ----------
    shape : str
        Name of the shape, as in the configuration.
    section : Section
        Cross-section.
    length : float
        Inner length [m].
    """

    shape: str
    section: Section
    length: float

    repairs: ClassVar[tuple[str, ...]] = ()  # of what is given in a file

    @property
    def volume(self) -> float:
        """Volume of the whole tank [m^3]."""
        return self.section.area * self.length

    @property
    def height(self) -> float:
        """Inner height [m]."""
        return self.section.bounding_box[1]

    def fill_ratio(self, depth: float) -> float:
        """Fraction of the volume that a liquid of the given greatest depth [m] takes."""
        return self.section.moments(depth).area / self.section.area

    def depth(self, fill_ratio: float) -> float:
        """Greatest depth [m] at which the liquid takes this fraction (0..1) of the volume."""
        if fill_ratio in (0.0, 1.0) or isinstance(self.section, Rectangle):
            return fill_ratio * self.height
        edge = 1e-12 * self.height
        return float(
            scipy.optimize.brentq(
                lambda depth: self.fill_ratio(depth) - fill_ratio,
                edge,
                self.height - edge,
                xtol=1e-15 * self.height,
                rtol=4 * float(np.finfo(float).eps),
            )
        )

    def filled(self, depth: float) -> LiquidAtRest:
        """
        Describe the liquid at rest.

        Parameters
        ----------
        depth : float
            Greatest depth [m], between 0 and the inner height.

        Raises
        ------
        InputError
            If the liquid is neither one body with a free surface nor fills the tank.
        """
        if depth == 0.0:
            return LiquidAtRest.none(self.height)
        if depth == self.height:
            return self._at_rest(depth).enclosed()
        self.section.check(depth)
        return self._at_rest(depth)

    def _at_rest(self, depth: float) -> LiquidAtRest:
        length = self.length
        m: SectionMoments = self.section.moments(depth)
        xx = m.area * length**3 / 12.0
        yy, zz, yz = m.yy * length, m.zz * length, m.yz * length
        return LiquidAtRest(
            depth=depth,
            fill_ratio=m.area / self.section.area,
            volume=m.area * length,
            surface_centre=np.array([0.0, m.surface_y, depth - self.height / 2.0]),
            freeboard=self.height - depth,
            centroid=np.array([0.0, m.y / m.area, m.z / m.area]),
            inertia=np.array([[yy + zz, 0.0, 0.0], [0.0, xx + zz, -yz], [0.0, -yz, xx + yy]]),
            surface_inertia=np.diag([m.width * length**3 / 12.0, length * m.surface_yy]),
        )

    def outlines(self) -> tuple[Array, Array]:
        """Return the outlines in the planes x, z and y, z of the tank frame, each (k, 2) [m]."""
        return box_outline(self.length, self.height), self.section.outline()

    def nearest(self, depth: float, point: Array) -> Array:
        """
        Find the point of the liquid at rest that is nearest to a given one.

        Parameters
        ----------
        depth : float
            Greatest depth [m], between 0 and the inner height.
        point : array, shape (3,)
            In the tank frame [m].

        Returns
        -------
        array, shape (3,)
            In the tank frame [m]; the given point itself if it is in the liquid.
        """
        if depth < self.height:
            self.section.check(depth)
        surface = np.array([self.section.moments(depth).surface_y, depth - self.height / 2.0])
        x = np.clip(point[0], -self.length / 2.0, self.length / 2.0)
        return np.array([x, *(surface + self.section.nearest(depth, point[1:] - surface))])


def box_outline(width: float, height: float) -> Array:
    """Corners of an upright rectangle about the origin, shape (4, 2) [m]."""
    return np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [width / 2.0, height / 2.0]


def rectangular(length: float, width: float, height: float) -> UniformTank:
    """Box of the given inner length (x), width (y) and height (z) [m]."""
    require_lengths(length=length, width=width, height=height)
    return UniformTank('rectangular', Rectangle(width, height), length)


def uniform_cylinder_x(radius: float, length: float) -> UniformTank:
    """Horizontal circular cylinder of the given inner radius and length (x) [m], flat ends."""
    require_lengths(radius=radius, length=length)
    return UniformTank('cylinder_x', Circle(radius), length)


def ellipse_x(width: float, height: float, length: float) -> UniformTank:
    """Elliptical cylinder of the given inner width, height and length (x) [m], flat ends."""
    require_lengths(width=width, height=height, length=length)
    return UniformTank('ellipse_x', Ellipse(width, height), length)


def rounded_rectangle_x(
    width: float, height: float, corner_radius: float, length: float
) -> UniformTank:
    """Box with its four edges along x rounded, flat ends; inner dimensions [m]."""
    require_lengths(width=width, height=height, length=length)
    section = RoundedRectangle(width, height, corner_radius)
    return UniformTank('rounded_rectangle_x', section, length)


def section_x(points: Sequence[float], length: float) -> UniformTank:
    """
    Tank of any polygonal section, flat ends.

    Parameters
    ----------
    points : sequence of float
        Corners y1, z1, y2, z2, ... of the section in order, either way round, from any origin [m].
    length : float
        Inner length (x) [m].

    Raises
    ------
    InputError
        If the corners are not those of a simple polygon, or the length is not positive.
    """
    require_lengths(length=length)
    return UniformTank('section_x', Polygon.of(points), length)
