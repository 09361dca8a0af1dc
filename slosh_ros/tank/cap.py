"""
The liquid in the lower part of a sphere: its moments, and its surface in triangles.

Spheres are made of one, cylinders with ellipsoidal heads of two stretched halves.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from slosh_ros.tank.section import Circle
from slosh_ros.tank.surface import Array

_GAUSS_HEIGHT = np.polynomial.legendre.leggauss(3)  # exact: polynomials of degree 4 at most
_GAUSS_ANGLE = np.polynomial.legendre.leggauss(24)
_FEWEST = 2  # rows of triangles, of wall and of free surface


@dataclass(frozen=True)
class Cap:
    """
    Moments of the liquid in a sphere, about the centre O of its free surface.

    Attributes
    ----------
    volume : float
        [m^3].
    z : float
        Integral of z dV [m^4].
    xx, zz : float
        Integrals of x^2 dV, as of y^2 dV, and of z^2 dV [m^5].
    abs_x : float
        Integral of the distance from x = 0 [m^4].
    radius : float
        Of the free surface [m].
    """

    volume: float
    z: float
    xx: float
    zz: float
    abs_x: float
    radius: float

    @property
    def surface_abs_x(self) -> float:
        """Integral of the distance from x = 0 over the free surface [m^3]."""
        return 4.0 / 3.0 * self.radius**3

    @property
    def surface_xx(self) -> float:
        """Integral of x^2 dS over the free surface [m^4]."""
        return float(np.pi) / 4.0 * self.radius**4

    @classmethod
    def of(cls, radius: float, depth: float) -> Cap:
        """Integrate over horizontal slices of a sphere of the given radius [m]."""
        node, weight = _GAUSS_HEIGHT
        above = depth / 2.0 * (1.0 + node)
        z, dz = above - depth, depth / 2.0 * weight
        square = above * (2.0 * radius - above)  # of the radius of the slice
        # |x| goes with its cube, smooth over the angle from the lowest point alone
        angle = Circle(radius).half_angle(depth)
        sine = np.sin(angle / 2.0 * (1.0 + _GAUSS_ANGLE[0]))
        return cls(
            volume=float(np.pi * square @ dz),
            z=float(np.pi * (square * z) @ dz),
            xx=float(np.pi / 4.0 * square**2 @ dz),
            zz=float(np.pi * (square * z**2) @ dz),
            abs_x=float(4.0 / 3.0 * radius**4 * angle / 2.0 * sine**4 @ _GAUSS_ANGLE[1]),
            radius=float(np.sqrt(depth * (2.0 * radius - depth))),
        )


@dataclass(frozen=True, eq=False)
class CapTriangles:
    """
    A quarter, x > 0 and y > 0, of the surface of the liquid in a sphere, about O.

    Attributes
    ----------
    wall, free : array, shape (n, 3, 3)
        Triangles with normals out of the liquid [m].
    wall_line : array, shape (k, 3)
        Corners on x = 0 of the wall, from the lowest point to the contact line [m].
    free_line : array, shape (l, 3)
        Corners on x = 0 of the free surface, from O to the contact line [m].
    """

    wall: Array
    free: Array
    wall_line: Array
    free_line: Array

    @classmethod
    def of(cls, radius: float, depth: float, size: float) -> CapTriangles:
        """
        Cover it with rows of triangles around the vertical axis.

        Parameters
        ----------
        radius : float
            Of the sphere [m].
        depth : float
            Of the liquid [m].
        size : float
            Length of the edges, more or less [m].
        """
        wall = _rows(Circle(radius).wall(depth, 1.0 - _steps(radius, depth, size)), size)
        if depth == 2.0 * radius:
            wall[-1] = top = np.zeros((1, 3))
            return cls(_between(wall)[:, ::-1], np.zeros((0, 3, 3)), _line(wall), top)
        contact = wall[-1][0, 0]
        count = max(_FEWEST, int(np.ceil(contact / size)))
        level = contact * np.linspace(0.0, 1.0, count + 1)
        free = _rows(np.stack([level, np.zeros_like(level)]), size)
        free[-1] = wall[-1] = wall[-1] * [1.0, 1.0, 0.0]  # one contact line
        return cls(
            wall=_between(wall)[:, ::-1],
            free=_between(free),
            wall_line=_line(wall),
            free_line=_line(free),
        )


def mirrored(triangles: Array, axis: int) -> Array:
    """Triangles and their mirror images, still with normals outwards."""
    sign = np.ones(3)
    sign[axis] = -1.0
    return np.concatenate([triangles, (triangles * sign)[:, ::-1]])


def _steps(radius: float, depth: float, size: float) -> Array:
    """Shares of the way along the wall at which its rows stand."""
    count = max(_FEWEST, int(np.ceil(radius * Circle(radius).half_angle(depth) / size)))
    return np.linspace(0.0, 1.0, count + 1)


def _rows(profile: Array, size: float) -> list[Array]:
    """Points on quarters of the circles that a profile r, z, shape (2, k), turns through."""
    rows = []
    for i, (r, z) in enumerate(profile.T):
        count = max(1, round(np.pi / 2.0 * r / size)) if i else 0
        angle = np.pi / 2.0 * np.linspace(0.0, 1.0, count + 1)
        x, y = r * np.cos(angle), r * np.sin(angle)
        x[1:][-1:] = 0.0  # exactly on the plane of symmetry
        rows.append(np.stack([x, y, np.full_like(x, z)], axis=-1))
    return rows


def _line(rows: list[Array]) -> Array:
    """Return the ends of rows, on x = 0."""
    return np.array([row[-1] for row in rows])


def _between(rows: list[Array]) -> Array:
    """Fill the gaps between rows, each from the same side; counter-clockwise from above."""
    triangles = []
    for inner, outer in itertools.pairwise(rows):
        i = j = 0
        last_i, last_j = len(inner) - 1, len(outer) - 1
        while i < last_i or j < last_j:
            # forward on the row whose next edge ends first
            if i == last_i or (j < last_j and (j + 1) * last_i <= (i + 1) * last_j):
                triangles.append([inner[i], outer[j], outer[j + 1]])
                j += 1
            else:
                triangles.append([inner[i], outer[j], inner[i + 1]])
                i += 1
    return np.array(triangles)
