"""
Cross-sections of uniform tanks, in the plane y (left), z (up).

A section's own origin is the centre of its bounding box; what is said of a liquid in it refers to
the centre O of the mean free surface, z up from the surface.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slosh_ros.errors import InputError

Array = NDArray[np.float64]

_WALL_POINTS = 4001  # of a wall that is taken for a polygon: 1e-7 of a circle's radius off
_SAME_PLACE = 1e-6  # [-] corners of a wall that are closer than this are one
_GAUSS = np.polynomial.legendre.leggauss(24)


@dataclass(frozen=True)
class SectionMoments:
    """
    Area moments of the liquid in a section, about the centre O of its mean free surface.

    Attributes
    ----------
    area : float
        Area of the liquid, integral of dA [m^2].
    z : float
        Integral of z dA, negative [m^3].
    yy, zz : float
        Integrals of y^2 dA and z^2 dA [m^4].
    surface : tuple of (float, float)
        From which y to which y the pieces of the free surface reach, rising [m].
    surface_y : float
        O, to the left of the centre of the section's bounding box [m].
    y : float
        Integral of y dA [m^3].
    yz : float
        Integral of y z dA [m^4].
    """

    area: float
    z: float
    yy: float
    zz: float
    surface: tuple[tuple[float, float], ...]
    surface_y: float = 0.0
    y: float = 0.0
    yz: float = 0.0

    @property
    def width(self) -> float:
        """Width of the mean free surface, all pieces together [m]."""
        return sum(right - left for left, right in self.surface)

    @property
    def half_width(self) -> float:
        """Half the width of the mean free surface [m]."""
        return self.width / 2.0

    @property
    def surface_yy(self) -> float:
        """Integral of y^2 dy over the mean free surface [m^3]."""
        return sum(right**3 - left**3 for left, right in self.surface) / 3.0


class Section(ABC):
    """A cross-section, filled to some depth above its lowest point."""

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
    def outline(self, points: int = 129) -> Array:
        """
        Outline of the whole section, for pictures.

        Parameters
        ----------
        points : int
            Number of points on either half of a curved wall.

        Returns
        -------
        array, shape (n, 2)
            y and z about the centre of the bounding box [m], once around.
        """

    def check(self, depth: float) -> None:
        """
        Check that the liquid is one body with a free surface.

        Raises
        ------
        InputError
            If it is not; none by default.
        """
        del depth

    @abstractmethod
    def liquid_outline(self, depth: float) -> Array:
        """
        Outline of the liquid; on a curved wall the points are so dense that it is almost it.

        Parameters
        ----------
        depth : float
            Depth of the liquid [m].

        Returns
        -------
        array, shape (n, 2)
            y and z about O, counter-clockwise [m].
        """

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
        start = self.liquid_outline(depth)
        end = np.roll(start, -1, axis=0)
        way = end - start
        # from inside, the ray along +y leaves an odd number of times
        across = (start[:, 1] > point[1]) != (end[:, 1] > point[1])
        rise = np.where(across, way[:, 1], 1.0)
        crossing = start[:, 0] + way[:, 0] * (point[1] - start[:, 1]) / rise
        if np.count_nonzero(across & (crossing > point[0])) % 2:
            return point
        along = np.sum((point - start) * way, axis=1) / np.sum(way**2, axis=1)
        feet = start + np.clip(along, 0.0, 1.0)[:, np.newaxis] * way
        return np.asarray(feet[np.argmin(np.sum((feet - point) ** 2, axis=1))])


class SymmetricSection(Section):
    """A section symmetric about its vertical axis, convex or nearly so, told by half its wall."""

    @abstractmethod
    def wall(self, depth: float, s: Array) -> Array:
        """
        Points of the wetted wall, right (y > 0) half.

        Parameters
        ----------
        depth : float
            Depth of the liquid [m].
        s : array, shape (n,)
            The way from the contact line (0) to the lowest point of the symmetry plane (1), in
            some smooth measure such as the arc length.

        Returns
        -------
        array, shape (2, n)
            y and z about O [m].
        """

    def corners(self, depth: float) -> tuple[float, ...]:
        """Values of `s` in (0, 1), rising, where the wall is not smooth; none by default."""
        del depth
        return ()

    def liquid_outline(self, depth: float) -> Array:
        """Outline of the liquid, so dense that it is almost the wall."""
        s = np.union1d(np.linspace(0.0, 1.0, _WALL_POINTS), self.corners(depth))
        right = self.wall(depth, s).T
        return np.concatenate([right[::-1], right[:-1] * [-1.0, 1.0]])

    def outline(self, points: int = 129) -> Array:
        """Outline of the whole section, with so many points on either half and its corners."""
        height = self.bounding_box[1]
        s = np.union1d(np.linspace(0.0, 1.0, points), self.corners(height))
        y, z = self.wall(height, s) + np.array([[0.0], [height / 2.0]])
        return np.column_stack([np.append(y, -y[::-1]), np.append(z, z[::-1])])


@dataclass(frozen=True)
class Circle(SymmetricSection):
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

    def half_angle(self, depth: float) -> float:
        """Angle at the axis from the lowest point to the contact line, in (0, pi)."""
        # The half-angle form keeps its digits for a film and for a nearly full circle.
        return 2.0 * float(np.arctan2(np.sqrt(depth), np.sqrt(2.0 * self.radius - depth)))

    def moments(self, depth: float) -> SectionMoments:
        """Area moments of a circular segment of height `depth`, closed form."""
        r, angle = self.radius, self.half_angle(depth)
        sin, cos = float(np.sin(angle)), float(np.cos(angle))
        area = r**2 * (angle - sin * cos)
        axis_z = -2.0 / 3.0 * r**3 * sin**3  # about the axis of the cylinder
        axis_zz = r**4 / 4.0 * (angle - sin * cos + 2.0 * sin**3 * cos)
        yy = r**4 / 12.0 * (3.0 * (angle - sin * cos) - 2.0 * sin**3 * cos)
        surface = depth - r  # of O above the axis
        return SectionMoments(
            area=area,
            z=axis_z - surface * area,
            yy=yy,
            zz=axis_zz - 2.0 * surface * axis_z + surface**2 * area,
            surface=((-r * sin, r * sin),),
        )

    def wall(self, depth: float, s: Array) -> Array:
        """Points of the arc from the contact line to the lowest point."""
        angle = self.half_angle(depth) * (1.0 - s)
        # 2 sin^2(angle/2) rather than 1 - cos(angle): exact at the bottom of a film
        height = 2.0 * self.radius * np.sin(0.5 * angle) ** 2
        return np.stack([self.radius * np.sin(angle), height - depth])


@dataclass(frozen=True)
class Ellipse(SymmetricSection):
    """An ellipse of the given width and height [m]: a circle stretched sideways."""

    width: float
    height: float

    @property
    def bounding_box(self) -> tuple[float, float]:
        """Width and height of the smallest upright box around the section [m]."""
        return self.width, self.height

    @property
    def area(self) -> float:
        """Area of the whole section [m^2]."""
        return float(np.pi) * self.width * self.height / 4.0

    @property
    def _circle(self) -> Circle:
        return Circle(self.height / 2.0)

    def moments(self, depth: float) -> SectionMoments:
        """Area moments of an elliptical segment of height `depth`, closed form."""
        stretch, m = self.width / self.height, self._circle.moments(depth)
        half_width = stretch * m.half_width
        return SectionMoments(
            area=stretch * m.area,
            z=stretch * m.z,
            yy=stretch**3 * m.yy,
            zz=stretch * m.zz,
            surface=((-half_width, half_width),),
        )

    def wall(self, depth: float, s: Array) -> Array:
        """Points from the contact line to the lowest point, by the angle in the circle."""
        y, z = self._circle.wall(depth, s)
        return np.stack([self.width / self.height * y, z])


@dataclass(frozen=True)
class Rectangle(SymmetricSection):
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
            z=-area * depth / 2.0,
            yy=area * self.width**2 / 12.0,
            zz=area * depth**2 / 3.0,
            surface=((-self.width / 2.0, self.width / 2.0),),
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


@dataclass(frozen=True)
class RoundedRectangle(SymmetricSection):
    """
    A rectangle with a quarter of a circle at each corner.

    Parameters
    ----------
    width, height : float
        Of the rectangle around it [m].
    corner_radius : float
        Of the corners [m].

    Raises
    ------
    InputError
        If the corners do not fit.
    """

    width: float
    height: float
    corner_radius: float

    def __post_init__(self) -> None:
        largest = min(self.width, self.height) / 2.0
        if not 0.0 <= self.corner_radius <= largest:
            raise InputError(
                f'corner_radius is {self.corner_radius:g} m; a section {self.width:g} m wide and '
                f'{self.height:g} m high has room for 0 to {largest:g} m'
            )

    @property
    def bounding_box(self) -> tuple[float, float]:
        """Width and height of the smallest upright box around the section [m]."""
        return self.width, self.height

    @property
    def area(self) -> float:
        """Area of the whole section [m^2]."""
        return self.width * self.height - (4.0 - float(np.pi)) * self.corner_radius**2

    def _angles(self, depth: float) -> tuple[float, float]:
        """Angles at which the lower and the upper arc end, from the lowest direction [rad]."""
        r = self.corner_radius
        if r == 0.0:
            return np.pi / 2.0, np.pi / 2.0
        above, below = max(depth - (self.height - r), 0.0), min(depth, r)
        # as in a circle; of the upper arc from its height above the middle of the corner
        lower = 2.0 * float(np.arcsin(np.sqrt(0.5 * below / r)))
        return lower, np.pi / 2.0 + float(np.arcsin(min(above / r, 1.0)))

    def moments(self, depth: float) -> SectionMoments:
        """Area moments by horizontal strips; Gauss points by the angle are exact to rounding."""
        r, flat = self.corner_radius, self.width / 2.0 - self.corner_radius
        lower, upper = self._angles(depth)
        side = max(min(depth, self.height - r) - r, 0.0)
        node, weight = _GAUSS
        half_width, height, rise = [], [], []
        for begin, end in ((0.0, lower), (np.pi / 2.0, upper)):
            angle = (begin + end) / 2.0 + (end - begin) / 2.0 * node
            half_width.append(flat + r * np.sin(angle))
            # above the bottom; an upper arc lies higher by the straight side
            lift = 0.0 if begin == 0.0 else self.height - 2.0 * r
            height.append(lift + 2.0 * r * np.sin(angle / 2.0) ** 2)
            rise.append((end - begin) / 2.0 * weight * r * np.sin(angle))
        half_width.append(np.full_like(node, flat + r))
        height.append(r + side / 2.0 * (1.0 + node))
        rise.append(side / 2.0 * weight)
        b, z, dz = np.concatenate(half_width), np.concatenate(height) - depth, np.concatenate(rise)
        at_surface = flat + r * float(np.sin(lower if depth < r else upper))
        return SectionMoments(
            area=float(2.0 * b @ dz),
            z=float(2.0 * (b * z) @ dz),
            yy=float(2.0 / 3.0 * b**3 @ dz),
            zz=float(2.0 * (b * z**2) @ dz),
            surface=((-at_surface, at_surface),),
        )

    def _lengths(self, depth: float) -> Array:
        """Lengths of bottom, lower arc, side and upper arc that are wetted, from below [m]."""
        r = self.corner_radius
        lower, upper = self._angles(depth)
        side = max(min(depth, self.height - r) - r, 0.0)
        return np.array([self.width / 2.0 - r, r * lower, side, r * (upper - np.pi / 2.0)])

    def wall(self, depth: float, s: Array) -> Array:
        """Points from the contact line down the corners and side and along the bottom."""
        r, lengths = self.corner_radius, self._lengths(depth)
        ends = np.cumsum(lengths)
        way = ends[-1] * (1.0 - np.asarray(s))  # from the lowest point
        along = [
            np.clip(way - end + length, 0.0, length)
            for end, length in zip(ends, lengths, strict=True)
        ]
        bottom, side = along[0], along[2]
        lower, upper = (arc / max(r, np.finfo(float).tiny) for arc in (along[1], along[3]))
        y = bottom + r * (np.sin(lower) - 2.0 * np.sin(upper / 2.0) ** 2)
        z = r * (2.0 * np.sin(lower / 2.0) ** 2 + np.sin(upper)) + side
        return np.stack([y, z - depth])

    def corners(self, depth: float) -> tuple[float, ...]:
        """Return the places where arcs meet straight walls: the curvature jumps there."""
        ends = np.cumsum(self._lengths(depth))
        places = np.sort(1.0 - ends[:-1] / ends[-1])
        inner = places[(places > _SAME_PLACE) & (places < 1.0 - _SAME_PLACE)]
        return tuple(inner[np.diff(inner, prepend=0.0) > _SAME_PLACE].tolist())
