"""Upright circular cylinder with a flat bottom, and the liquid at rest in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from slosh_ros.tank.sizes import require_lengths
from slosh_ros.tank.uniform import LiquidAtRest, box_outline

Array = NDArray[np.float64]


@dataclass(frozen=True)
class UprightCylinder:
    """
    A circular cylinder about the z axis, closed by flat ends.

    The tank frame has x forward, y left, z up and its origin at the centre of the inner bounding
    box, whatever the fill.

    Parameters
    ----------
    radius : float
        Inner radius [m].
    height : float
        Inner height along z [m].
    """

    radius: float
    height: float

    @property
    def shape(self) -> str:
        """Name of the shape, as in the configuration."""
        return 'cylinder_z'

    repairs: ClassVar[tuple[str, ...]] = ()  # of what is given in a file

    @property
    def volume(self) -> float:
        """Volume of the whole tank [m^3]."""
        return float(np.pi) * self.radius**2 * self.height

    def fill_ratio(self, depth: float) -> float:
        """Fraction of the volume that a liquid of the given depth [m] takes."""
        return depth / self.height

    def depth(self, fill_ratio: float) -> float:
        """Depth [m] at which the liquid takes this fraction (0..1) of the volume."""
        return fill_ratio * self.height

    def filled(self, depth: float) -> LiquidAtRest:
        """
        Describe the liquid at rest.

        Parameters
        ----------
        depth : float
            Depth [m], between 0 and the inner height.
        """
        if depth == 0.0:
            return LiquidAtRest.none(self.height)
        surface = float(np.pi) * self.radius**2
        second_moment = surface * self.radius**2 / 4.0  # of the disc, about a diameter
        across = second_moment * depth + surface * depth**3 / 3.0
        liquid = LiquidAtRest(
            depth=depth,
            fill_ratio=self.fill_ratio(depth),
            volume=surface * depth,
            surface_centre=np.array([0.0, 0.0, depth - self.height / 2.0]),
            freeboard=self.height - depth,
            centroid=np.array([0.0, 0.0, -depth / 2.0]),
            inertia=np.diag([across, across, 2.0 * second_moment * depth]),
            surface_inertia=second_moment * np.eye(2),
        )
        return liquid.enclosed() if depth == self.height else liquid

    def outlines(self) -> tuple[Array, Array]:
        """Return the outlines in the planes x, z and y, z of the tank frame, each (k, 2) [m]."""
        outline = box_outline(2.0 * self.radius, self.height)
        return outline, outline

    def nearest(self, depth: float, point: Array) -> Array:
        """
        Find the point of the liquid at rest that is nearest to a given one.

        Parameters
        ----------
        depth : float
            Depth [m], between 0 and the inner height.
        point : array, shape (3,)
            In the tank frame [m].

        Returns
        -------
        array, shape (3,)
            In the tank frame [m]; the given point itself if it is in the liquid.
        """
        bottom = -self.height / 2.0
        inwards = self.radius / max(self.radius, float(np.hypot(*point[:2])))
        return np.array([*(inwards * point[:2]), np.clip(point[2], bottom, bottom + depth)])


def cylinder_z(radius: float, height: float) -> UprightCylinder:
    """Upright circular cylinder of the given inner radius and height (z) [m], flat ends."""
    require_lengths(radius=radius, height=height)
    return UprightCylinder(radius, height)
