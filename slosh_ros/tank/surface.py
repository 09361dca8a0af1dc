"""
The liquid as a closed surface of triangles, and its moments by the divergence theorem.

Each triangle and the origin span a tetrahedron of signed volume; the integrals of polynomials
over these add up to those over the liquid, exactly (Mirtich 1996, J. Graphics Tools 1, asks the
same of faces). The origin O lies in the plane of the free surface, whose triangles thus add
nothing: the wetted wall alone tells the moments of the liquid.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slosh_ros.tank.uniform import LiquidAtRest

Array = NDArray[np.float64]


class Moments(NamedTuple):
    """
    Integrals over a body or a surface, about the origin.

    Attributes
    ----------
    whole : float
        Of 1: volume [m^3] or area [m^2].
    first : array, shape (3,)
        Of the position r.
    second : array, shape (3, 3)
        Of r r^T.
    """

    whole: float
    first: Array
    second: Array

    def about(self, point: Array) -> Moments:
        """Return the integrals about another point, shape (3,) [m]."""
        first = self.first - self.whole * point
        shifted = np.outer(first, point)
        second = self.second - shifted - shifted.T - self.whole * np.outer(point, point)
        return Moments(self.whole, first, second)


@dataclass(frozen=True, eq=False)
class LiquidSurface:
    """
    The liquid at rest as a closed surface of triangles, about O in tank axes.

    Corners are ordered so that normals point out of the liquid.

    Attributes
    ----------
    wall : array, shape (n, 3, 3)
        Corners of the triangles of the wetted wall [m].
    free : array, shape (m, 3, 3)
        Corners of those of the mean free surface, z = 0 [m].
    corners : array, shape (k, 3), or None
        Of the wall, those alone that its shape needs [m]; None: all of them.
    """

    wall: Array
    free: Array
    corners: Array | None = None

    @property
    def triangles(self) -> Array:
        """All of them, those of the wall first, shape (n + m, 3, 3) [m]."""
        return np.concatenate([self.wall, self.free])

    def liquid(
        self, depth: float, fill_ratio: float, surface_centre: Array, freeboard: float
    ) -> LiquidAtRest:
        """
        Describe the liquid within, exactly but for rounding.

        Parameters
        ----------
        depth : float
            Greatest depth [m].
        fill_ratio : float
            Fraction of the tank's volume.
        surface_centre : array, shape (3,)
            O in the tank frame [m].
        freeboard : float
            Height of the roof above the mean free surface [m].
        """
        return liquid_at_rest(
            solid_moments(self.wall),
            surface_moments(self.free).second[:2, :2],
            depth,
            fill_ratio,
            surface_centre,
            freeboard,
        )


def liquid_at_rest(
    solid: Moments,
    surface_inertia: Array,
    depth: float,
    fill_ratio: float,
    surface_centre: Array,
    freeboard: float,
) -> LiquidAtRest:
    """Describe a liquid of the given moments about O; see :class:`LiquidAtRest`."""
    return LiquidAtRest(
        depth=depth,
        fill_ratio=fill_ratio,
        volume=solid.whole,
        surface_centre=surface_centre,
        freeboard=freeboard,
        centroid=solid.first / solid.whole,
        inertia=np.trace(solid.second) * np.eye(3) - solid.second,
        surface_inertia=surface_inertia,
    )


def solid_moments(triangles: Array) -> Moments:
    """
    Integrals over the body within a closed surface.

    Parameters
    ----------
    triangles : array, shape (n, 3, 3)
        Their corners, so ordered that normals point outwards [m]. Triangles in planes through the
        origin may be left out.
    """
    a, b, c = triangles.transpose(1, 0, 2)
    volumes = np.sum(a * np.cross(b, c), axis=1) / 6.0
    total = a + b + c
    second = _spread(volumes, (a, b, c, total))
    return Moments(float(volumes.sum()), volumes @ total / 4.0, second / 20.0)


def surface_moments(triangles: Array) -> Moments:
    """Integrals over the triangles themselves, of the given corners, shape (n, 3, 3) [m]."""
    areas = np.linalg.norm(area_vectors(triangles), axis=1)
    a, b, c = triangles.transpose(1, 0, 2)
    total = a + b + c
    second = _spread(areas, (a, b, c, total))
    return Moments(float(areas.sum()), areas @ total / 3.0, second / 12.0)


def _spread(weights: Array, points: Sequence[Array]) -> Array:
    """Sum of r r^T with weights, over n points of each kind."""
    return np.asarray(sum((weights[:, np.newaxis] * r).T @ r for r in points))


def area_vectors(triangles: Array) -> Array:
    """Return the normals of triangles with the length of their areas, shape (n, 3) [m^2]."""
    a, b, c = triangles.transpose(1, 0, 2)
    return np.cross(b - a, c - a) / 2.0
