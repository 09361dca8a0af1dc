"""Spheres and horizontal cylinders with ellipsoidal heads, and the liquid at rest in them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, overload

import numpy as np
import scipy

from slosh_ros.errors import InputError
from slosh_ros.tank.cap import Cap, CapTriangles, mirrored
from slosh_ros.tank.level import depth_for
from slosh_ros.tank.section import Circle
from slosh_ros.tank.sizes import require_lengths
from slosh_ros.tank.surface import Array, LiquidSurface, Moments, liquid_at_rest
from slosh_ros.tank.uniform import LiquidAtRest, UniformTank, uniform_cylinder_x


@dataclass(frozen=True)
class Capsule:
    """
    A horizontal circular cylinder with half an ellipsoid of revolution at each end.

    The tank frame has x forward, y left, z up and its origin at the centre of the inner bounding
    box, whatever the fill.

    Parameters
    ----------
    shape : str
        Name of the shape, as in the configuration.
    radius : float
        Inner radius [m].
    length : float
        Inner length of the straight part [m]; 0 in a sphere.
    head_depth : float
        Inner depth of each head [m].
    """

    shape: str
    radius: float
    length: float
    head_depth: float

    @property
    def is_sphere(self) -> bool:
        """Whether it is a sphere."""
        return self.length == 0.0 and self.head_depth == self.radius

    repairs: ClassVar[tuple[str, ...]] = ()  # of what is given in a file

    @property
    def volume(self) -> float:
        """Volume of the whole tank [m^3]."""
        straight_and_heads = self.length + 4.0 / 3.0 * self.head_depth
        return float(np.pi) * self.radius**2 * straight_and_heads

    @property
    def height(self) -> float:
        """Inner height [m]."""
        return 2.0 * self.radius

    def fill_ratio(self, depth: float) -> float:
        """Fraction of the volume that a liquid of the given greatest depth [m] takes."""
        return self._volume(depth) / self.volume

    def depth(self, fill_ratio: float) -> float:
        """Greatest depth [m] at which the liquid takes this fraction (0..1) of the volume."""
        return depth_for(self.fill_ratio, self.height, fill_ratio)

    @property
    def _stretch(self) -> float:
        """How much a head is longer than half a sphere."""
        return self.head_depth / self.radius

    def _volume(self, depth: float) -> float:
        straight = Circle(self.radius).moments(depth).area * self.length
        return straight + self._stretch * Cap.of(self.radius, depth).volume

    def filled(self, depth: float) -> LiquidAtRest:
        """
        Describe the liquid at rest.

        Parameters
        ----------
        depth : float
            Greatest depth [m], between 0 and the inner height.
        """
        if depth == 0.0:
            return LiquidAtRest.none(self.height)
        liquid = self._at_rest(depth)
        return liquid.enclosed() if depth == self.height else liquid

    def _at_rest(self, depth: float) -> LiquidAtRest:
        section, cap = Circle(self.radius).moments(depth), Cap.of(self.radius, depth)
        length, stretch = self.length, self._stretch

        def far(whole: float, first: float, second: float) -> float:
            """Of (length/2 + stretch |x|)^2, from the integrals of 1, |x| and x^2."""
            return length**2 / 4.0 * whole + stretch * (length * first + stretch * second)

        volume = section.area * length + stretch * cap.volume
        xx = section.area * length**3 / 12.0 + stretch * far(cap.volume, cap.abs_x, cap.xx)
        surface = np.pi * cap.radius**2
        surface_xx = section.width * length**3 / 12.0
        surface_xx += stretch * far(surface, cap.surface_abs_x, cap.surface_xx)
        solid = Moments(
            volume,
            np.array([0.0, 0.0, section.z * length + stretch * cap.z]),
            np.diag(
                [
                    xx,
                    section.yy * length + stretch * cap.xx,
                    section.zz * length + stretch * cap.zz,
                ]
            ),
        )
        return liquid_at_rest(
            solid,
            np.diag([surface_xx, section.surface_yy * length + stretch * cap.surface_xx]),
            depth=depth,
            fill_ratio=volume / self.volume,
            surface_centre=np.array([0.0, 0.0, depth - self.radius]),
            freeboard=self.height - depth,
        )

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
        in_tank = self._nearest_in_tank(point)
        surface = depth - self.radius
        if in_tank[2] <= surface:
            return in_tank
        x, y = self._nearest_at(np.abs(point[:2]), self._half_width(surface))
        return np.array([np.copysign(x, point[0]), np.copysign(y, point[1]), surface])

    def _half_width(self, z: float) -> float:
        """Half the width of the straight part at a height in the tank frame [m]."""
        return float(np.sqrt(max(self.radius**2 - z**2, 0.0)))

    def _nearest_in_tank(self, point: Array) -> Array:
        away = float(np.hypot(*point[1:]))  # from the axis
        x, r = self._nearest_at(np.array([abs(point[0]), away]), self.radius)
        inwards = r / away if away else 1.0
        return np.array([np.copysign(x, point[0]), *(inwards * point[1:])])

    def _nearest_at(self, point: Array, half_width: float) -> Array:
        """In a plane through the tank, or level: of x, y >= 0, the nearest point within."""
        half, (x, y) = self.length / 2.0, point
        if x <= half or half_width == 0.0:
            return np.minimum(point, [half, half_width])
        return np.array([half, 0.0]) + _nearest_in_ellipse(
            np.array([x - half, y]), np.array([self._stretch * half_width, half_width])
        )

    def outlines(self) -> tuple[Array, Array]:
        """Return the outlines in the planes x, z and y, z of the tank frame, each (k, 2) [m]."""
        across = Circle(self.radius).outline()
        way = np.sign(across[:, 0]) * self.length / 2.0
        return np.column_stack([self._stretch * across[:, 0] + way, across[:, 1]]), across

    def liquid_surface(self, depth: float, size: float) -> LiquidSurface:
        """
        Cover the liquid with triangles, their corners on the wall; symmetric in x and y.

        Parameters
        ----------
        depth : float
            Greatest depth [m], between 0 and the inner height.
        size : float
            Length of their edges, more or less [m].
        """
        cap = CapTriangles.of(self.radius, depth, size)
        wall, free = (
            triangles * [self._stretch, 1.0, 1.0] + [self.length / 2.0, 0.0, 0.0]
            for triangles in (cap.wall, cap.free)
        )
        if self.length > 0.0:
            x = np.linspace(0.0, self.length / 2.0, 1 + int(np.ceil(self.length / 2.0 / size)))
            wall = np.concatenate([wall, _extruded(cap.wall_line, x)[:, ::-1]])
            free = np.concatenate([free, _extruded(cap.free_line, x)])
        return LiquidSurface(*(mirrored(mirrored(half, 1), 0) for half in (wall, free)))


def sphere(radius: float) -> Capsule:
    """Sphere of the given inner radius [m]."""
    require_lengths(radius=radius)
    return Capsule('sphere', radius, 0.0, radius)


@overload
def cylinder_x(radius: float, length: float) -> UniformTank: ...


@overload
def cylinder_x(radius: float, length: float, head_depth: float) -> UniformTank | Capsule: ...


def cylinder_x(radius: float, length: float, head_depth: float = 0.0) -> UniformTank | Capsule:
    """
    Horizontal circular cylinder, with flat ends or ellipsoidal heads.

    Parameters
    ----------
    radius : float
        Inner radius [m].
    length : float
        Inner length (x) of the straight part [m].
    head_depth : float
        Inner depth of each head, half an ellipsoid: `radius` for half a sphere, 0 for a flat end
        [m].

    Raises
    ------
    InputError
        If a dimension of flat ends is not positive, or a head is deeper than half a sphere.
    """
    if head_depth == 0.0:
        return uniform_cylinder_x(radius, length)
    if not 0.0 < head_depth <= radius:
        raise InputError(
            f'head_depth is {head_depth:g} m; it must lie between 0, flat ends, and the radius of '
            f'{radius:g} m, half spheres'
        )
    return Capsule('cylinder_x', radius, length, head_depth)


def _nearest_in_ellipse(point: Array, half_axes: Array) -> Array:
    """Nearest point of an ellipse about the origin, from one with x, y >= 0."""
    if np.sum((point / half_axes) ** 2) <= 1.0:
        return point

    # the foot is (a^2 x/(t + a^2), b^2 y/(t + b^2)), with t > 0 outside
    def foot(t: float) -> Array:
        return np.asarray(half_axes**2 * point / (t + half_axes**2))

    def outside(t: float) -> float:
        return float(np.sum((foot(t) / half_axes) ** 2)) - 1.0

    far = float(np.max(half_axes) * np.hypot(*point))
    return foot(float(scipy.optimize.brentq(outside, 0.0, far, xtol=1e-15 * far)))


def _extruded(line: Array, x: Array) -> Array:
    """Triangles between copies of a line at places x; from above of a rising y, upwards."""
    grid = line + x[:, np.newaxis, np.newaxis] * [1.0, 0.0, 0.0]
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    first, second = np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)
    return np.concatenate([first, second]).reshape(-1, 3, 3)
