"""Triangles cut along planes into pieces, each within one cell of a grid, and points on them."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.special import roots_jacobi

from slosh_ros.hydro.coefficients import Array
from slosh_ros.tank.surface import area_vectors


class Points(NamedTuple):
    """
    Quadrature on triangles.

    Attributes
    ----------
    places : array, shape (n, q, 3)
        Points of each of n triangles [m].
    weights : array, shape (n, q, 3)
        Their shares of the triangle's area vector, that is of its normal times its area [m^2].
    """

    places: Array
    weights: Array


def cut(triangles: Array, axis: int, planes: Array) -> Array:
    """
    Cut triangles along planes across an axis.

    Parameters
    ----------
    triangles : array, shape (n, 3, 3)
        Corners [m].
    axis : int
        0, 1 or 2.
    planes : array, shape (k,)
        Where the planes stand on the axis, rising [m].

    Returns
    -------
    array, shape (m, 3, 3)
        Pieces of the same sense of rotation, none of which reaches across a plane.
    """
    within = []
    while len(triangles):
        reach = triangles[:, :, axis]
        first = np.searchsorted(planes, reach.min(axis=1), side='right')
        last = np.searchsorted(planes, reach.max(axis=1), side='left')
        across = last > first
        within.append(triangles[~across])
        middle = planes[((first + last) // 2)[across]]
        triangles = _halved(triangles[across], axis, middle)
    return np.concatenate(within) if within else triangles


def _halved(triangles: Array, axis: int, place: Array) -> Array:
    """Cut each triangle at its place: a triangle on one side, a quadrangle in two on the other."""
    height = triangles[:, :, axis] - place[:, np.newaxis]
    above = height > 0.0
    lone = np.argmax(above == (above.sum(axis=1) == 1)[:, np.newaxis], axis=1)
    order = (lone[:, np.newaxis] + np.arange(3)) % 3
    height = np.take_along_axis(height, order, axis=1)
    corners = np.take_along_axis(triangles, order[:, :, np.newaxis], axis=1)
    a, b, c = corners.transpose(1, 0, 2)
    share = height[:, :1] / (height[:, :1] - height[:, 1:])
    p, q = a + share[:, :1] * (b - a), a + share[:, 1:] * (c - a)
    p[:, axis] = q[:, axis] = place
    pieces = np.concatenate([np.stack(t, axis=1) for t in ((a, p, q), (p, b, c), (p, c, q))])
    return pieces[np.any(area_vectors(pieces) != 0.0, axis=1)]


def points_on(triangles: Array, order: int) -> Points:
    """
    Gauss points on triangles, `order` squared on each, exact to the degree 2 order - 1.

    Parameters
    ----------
    triangles : array, shape (n, 3, 3)
        Corners [m].
    order : int
        Points along each of the two directions: from the first corner, and across.
    """
    corners, shares = _rule(order)
    weights = area_vectors(triangles)[:, np.newaxis] * shares[:, np.newaxis]
    return Points(corners @ triangles, weights)


@cache
def _rule(order: int) -> tuple[Array, Array]:
    """Points as weights of the three corners, shape (q, 3), and their shares of the area."""
    # away from the first corner the width grows: Jacobi's weight 1 + x
    out, out_weight = roots_jacobi(order, 0.0, 1.0)
    across, across_weight = np.polynomial.legendre.leggauss(order)
    u, v = np.meshgrid((1.0 + out) / 2.0, (1.0 + across) / 2.0, indexing='ij')
    corners = np.stack([1.0 - u, u * (1.0 - v), u * v], axis=-1).reshape(-1, 3)
    return corners, np.outer(out_weight, across_weight).ravel() / 4.0
