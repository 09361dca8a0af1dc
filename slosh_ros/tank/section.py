"""
Cross-sections of uniform tanks, in the plane y (left), z (up).

Every section is symmetric about the z axis. Its own origin is the centre of its bounding box; what
is said of a liquid in it refers to the centre O of the mean free surface, z up from the surface.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_WALL_POINTS = 4001  # of a wall that is taken for a polygon: 1e-7 of a circle's radius off


@dataclass(frozen=True)
class SectionMoments:
    """
    Area moments of the liquid in a section, about the centre O of its mean free surface.

    Attributes
    ----------
    area : float
        Area of the liquid, integral of dA [m^2].
    half_width : float
        Half the width of the mean free surface [m].
    z : float
        Integral of z dA, negative [m^3].
    yy, zz : float
        Integrals of y^2 dA and z^2 dA [m^4].
    """

    area: float
    half_width: float
    z: float
    yy: float
    zz: float


class Section(ABC):
    """A cross-section symmetric about its vertical axis, filled to some depth."""

    @property
    @abstractmethod
    def bounding_box(self) -> tuple[float, float]:
        """Width and height of the smallest upright box around the section [m]."""

    @property
    @abstractmethod
    def area(self) -> float:
        """Area of the whole section [m^2]."""

    @abstractmethod
    def moments(self, depth: float) -> SectionMoments:
        """Area moments of the liquid that stands `depth` metres deep, within the section."""

    @abstractmethod
    def wall(self, depth: float, s: Array) -> Array:
        """
        Points of the wetted wall, right (y > 0) half.

        Parameters
        ----------
        depth : float
            Depth of the liquid [m].
        s : array, shape (n,)
            Fraction of the way from the contact line (0) to the lowest point of the symmetry plane
            (1), by arc length.

        Returns
        -------
        array, shape (2, n)
            y and z about O [m].
        """

    def corners(self, depth: float) -> tuple[float, ...]:
        """Values of `s` in (0, 1), rising, at which the wall has a corner; none by default."""
        del depth
        return ()

    def nearest(self, depth: float, point: Array) -> Array:
        """
        Find the point of the liquid at rest that is nearest to a point of the plane.

        Parameters
        ----------
        depth : float
            Depth of the liquid [m].
        point : array, shape (2,)
            y and z about O [m].
        """
        here = np.array([abs(point[0]), point[1]])
        s = np.union1d(np.linspace(0.0, 1.0, _WALL_POINTS), self.corners(depth))
        wall = self.wall(depth, s).T
        edge = np.vstack([[0.0, 0.0], wall])  # the free surface, then the wall
        start, way = edge[:-1], np.diff(edge, axis=0)
        # inside the half section, the ray along +y leaves it an odd number of times
        across = (start[:, 1] > here[1]) != (edge[1:, 1] > here[1])
        rise = np.where(across, way[:, 1], 1.0)
        crossing = start[:, 0] + way[:, 0] * (here[1] - start[:, 1]) / rise
        if np.count_nonzero(across & (crossing > here[0])) % 2:
            return point
        along = np.sum((here - start) * way, axis=1) / np.sum(way**2, axis=1)
        feet = start + np.clip(along, 0.0, 1.0)[:, np.newaxis] * way
        foot = feet[np.argmin(np.sum((feet - here) ** 2, axis=1))]
        return np.array([np.copysign(foot[0], point[0]), foot[1]])

    def outline(self, points: int = 129) -> Array:
        """
        Outline of the whole section, for pictures.

        Parameters
        ----------
        points : int
            Number of points on either half, besides the corners.

        Returns
        -------
        array, shape (n, 2)
            y and z about the centre of the bounding box [m], once around.
        """
        height = self.bounding_box[1]
        s = np.union1d(np.linspace(0.0, 1.0, points), self.corners(height))
        y, z = self.wall(height, s) + np.array([[0.0], [height / 2.0]])
        return np.column_stack([np.append(y, -y[::-1]), np.append(z, z[::-1])])


@dataclass(frozen=True)
class Circle(Section):
    """A circle of the given radius [m]."""

    radius: float

    @property
    def bounding_box(self) -> tuple[float, float]:
        """Width and height of the smallest upright box around the section [m]."""
        return 2.0 * self.radius, 2.0 * self.radius

    @property
    def area(self) -> float:
        """Area of the whole section [m^2]."""
        return float(np.pi) * self.radius**2

    def _half_angle(self, depth: float) -> float:
        """Angle at the axis from the lowest point to the contact line, in (0, pi)."""
        # The half-angle form keeps its digits for a film and for a nearly full circle.
        return 2.0 * float(np.arctan2(np.sqrt(depth), np.sqrt(2.0 * self.radius - depth)))

    def moments(self, depth: float) -> SectionMoments:
        """Area moments of a circular segment of height `depth`, closed form."""
        r, angle = self.radius, self._half_angle(depth)
        sin, cos = float(np.sin(angle)), float(np.cos(angle))
        area = r**2 * (angle - sin * cos)
        axis_z = -2.0 / 3.0 * r**3 * sin**3  # about the axis of the cylinder
        axis_zz = r**4 / 4.0 * (angle - sin * cos + 2.0 * sin**3 * cos)
        yy = r**4 / 12.0 * (3.0 * (angle - sin * cos) - 2.0 * sin**3 * cos)
        surface = depth - r  # of O above the axis
        return SectionMoments(
            area=area,
            half_width=r * sin,
            z=axis_z - surface * area,
            yy=yy,
            zz=axis_zz - 2.0 * surface * axis_z + surface**2 * area,
        )

    def wall(self, depth: float, s: Array) -> Array:
        """Points of the arc from the contact line to the lowest point."""
        angle = self._half_angle(depth) * (1.0 - s)
        # 2 sin^2(angle/2) rather than 1 - cos(angle): exact at the bottom of a film
        height = 2.0 * self.radius * np.sin(0.5 * angle) ** 2
        return np.stack([self.radius * np.sin(angle), height - depth])


@dataclass(frozen=True)
class Rectangle(Section):
    """A rectangle of the given width and height [m]."""

    width: float
    height: float

    @property
    def bounding_box(self) -> tuple[float, float]:
        """Width and height of the smallest upright box around the section [m]."""
        return self.width, self.height

    @property
    def area(self) -> float:
        """Area of the whole section [m^2]."""
        return self.width * self.height

    def moments(self, depth: float) -> SectionMoments:
        """Area moments of a rectangle of height `depth`."""
        area = self.width * depth
        return SectionMoments(
            area=area,
            half_width=self.width / 2.0,
            z=-area * depth / 2.0,
            yy=area * self.width**2 / 12.0,
            zz=area * depth**2 / 3.0,
        )

    def wall(self, depth: float, s: Array) -> Array:
        """Points down the side wall and along the bottom."""
        half = self.width / 2.0
        way = s * (depth + half)
        down = np.minimum(way, depth)
        return np.stack([half - (way - down), -down])

    def corners(self, depth: float) -> tuple[float, ...]:
        """Return the place of the bottom edge."""
        return (depth / (depth + self.width / 2.0),)
