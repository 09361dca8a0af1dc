"""
Products of B-splines on a box, and their integrals over a liquid of any shape in it.

The liquid is given by the triangles of its surface. With F_z = f and F = 0 at z = 0, the integral
of f over the liquid is that of F n_z over its wetted wall alone: the free surface, z = 0, adds
nothing. Within one cell of the box, F is a polynomial in x, y and z; thus all that is to be known
of the liquid are the moments of the wall in each cell,

    M_ijm = int P_i(x) P_j(y) P_m(z) n_z dS,   P Legendre's polynomials on the cell,

and all integrals are sums of these with numbers that splines alone determine. The triangles are
cut along the cells' faces, and Gauss's rule on the pieces is exact but for rounding. How well
shaped the triangles are does not matter.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from slosh_ros.hydro.coefficients import Array
from slosh_ros.hydro.volume_pieces import cut, points_on
from slosh_ros.tank.surface import LiquidSurface, area_vectors

# Gauss points by the size of a piece, in half cells
_SIZES, _ORDERS = (0.3, 0.8, 1.3), (3, 5, 7, 13)
_LEVEL = 9  # enough of a level piece of any size: exact to the degree 17, of 16
_AT_ONCE = 40_000  # Gauss points
VALUE, SLOPE, MOMENT = 0, 1, 2  # of a spline v along its axis: v, dv/ds, s v


@dataclass(frozen=True, eq=False)
class Axis:
    """
    B-splines along one axis of the box, clamped at its ends.

    Attributes
    ----------
    breaks : array, shape (c + 1,)
        Ends of the c cells [m].
    degree : int
        Degree p of the splines, of which there are c + p.
    """

    breaks: Array
    degree: int

    @property
    def cells(self) -> int:
        """Number of cells."""
        return len(self.breaks) - 1

    @property
    def functions(self) -> int:
        """Number of splines."""
        return self.cells + self.degree

    @cached_property
    def splines(self) -> BSpline:
        """All splines at once."""
        ends = np.repeat(self.breaks[[0, -1]], self.degree)
        knots = np.sort(np.concatenate([self.breaks, ends]))
        return BSpline(knots, np.eye(self.functions), self.degree)

    def at(self, places: Array, derivative: int = 0) -> Array:
        """Values or slopes of all splines at places within the box, shape (p, functions)."""
        inside = np.clip(places, self.breaks[0], self.breaks[-1])
        return np.asarray(self.splines(inside, derivative))

    def cell(self, places: Array) -> NDArray[np.intp]:
        """Which cell holds each place."""
        found = np.searchsorted(self.breaks, places, side='right') - 1
        return np.asarray(np.clip(found, 0, self.cells - 1))

    def local(self, places: Array, cell: NDArray[np.intp]) -> Array:
        """Map places to [-1, 1] of their cells."""
        return np.asarray(
            (2.0 * places - self.breaks[cell] - self.breaks[cell + 1])
            / (self.breaks[cell + 1] - self.breaks[cell])
        )

    @cached_property
    def _gauss(self) -> tuple[Array, Array]:
        """Gauss points and weights of all cells, enough for products of two splines, (c, q)."""
        x, weight = legendre.leggauss(2 * self.degree + 2)
        half = np.diff(self.breaks)[:, np.newaxis] / 2.0
        return self.breaks[:-1, np.newaxis] + half * (1.0 + x), half * weight

    def _sampled(self, kind: int) -> Array:
        """Splines of a kind at the Gauss points, shape (c, q, functions)."""
        place, _ = self._gauss
        values = self.at(place.ravel(), 1 if kind == SLOPE else 0)
        values = values.reshape(*place.shape, -1)
        return values * place[..., np.newaxis] if kind == MOMENT else values

    def _expanded(self, samples: Array) -> Array:
        """Legendre coefficients on each cell of what is given at the Gauss points, degree 2p."""
        x, weight = legendre.leggauss(2 * self.degree + 2)
        degrees = np.arange(2 * self.degree + 1)
        project = legendre.legvander(x, degrees[-1]) * weight[:, np.newaxis] * (degrees + 0.5)
        return np.asarray(np.einsum('qi,cq...->ci...', project, samples, optimize=True))

    def singles(self, kind: int) -> Array:
        """Legendre coefficients of the p + 1 splines on each cell, shape (c, 2p + 1, p + 1)."""
        return self._own(self._expanded(self._sampled(kind)))

    def products(self, kind: int) -> Array:
        """
        Legendre coefficients of products of two splines of a kind on each cell.

        Shape (c, 2p + 1, (p + 1)^2).
        """
        own = self._own(self._sampled(kind))
        pairs = np.einsum('cqa,cqb->cqab', own, own).reshape(*own.shape[:2], -1)
        return self._expanded(pairs)

    def _own(self, values: Array) -> Array:
        """Of all splines, the p + 1 that live on each cell."""
        return np.stack([values[c, :, c : c + self.degree + 1] for c in range(self.cells)])

    def squares(self, kind: int) -> Array:
        """Integral over the box of the square of each spline."""
        _, weight = self._gauss
        return np.asarray(np.einsum('cq,cqa->a', weight, self._sampled(kind) ** 2))

    def single_rest(self, kind: int) -> Array:
        """
        Legendre coefficients of the integral of a spline from a place up to the upper end.

        Shape (c, 2p + 2, functions), by the cell of the place.
        """
        return self._rest(self._sampled(kind))

    def product_rest(self, kind: int) -> Array:
        """Return the same for products of two splines, shape (c, 2p + 2, functions^2)."""
        values = self._sampled(kind)
        pairs = np.einsum('cqa,cqb->cqab', values, values)
        return self._rest(pairs.reshape(*values.shape[:2], -1))

    def _rest(self, samples: Array) -> Array:
        _, weight = self._gauss
        whole = np.einsum('cq,cqa->ca', weight, samples)
        above = np.cumsum(whole[::-1], axis=0)[::-1] - whole
        half = np.diff(self.breaks) / 2.0
        within = legendre.legint(self._expanded(samples), axis=1) * half[:, np.newaxis, np.newaxis]
        rest = -within
        rest[:, 0] += within.sum(axis=1) + above  # all P(1) = 1
        return rest


@dataclass(frozen=True, eq=False)
class Forms:
    """
    Integrals of products v of three splines over a liquid, about O.

    Functions are numbered with z fastest.

    Attributes
    ----------
    axes : tuple of three Axis
        Of x, y and z.
    stiffness : array, shape (n, n)
        Integrals over the liquid of grad v_i . grad v_j [m].
    pushes : array, shape (6, n)
        Integrals over the liquid of dv/dx, dv/dy, 0 [m^2] and of (r x grad v)_k [m^3].
    surface : array, shape (m, m)
        Integrals over the free surface of v_i v_j [m^2], the m functions that are not zero there.
    surface_one : array, shape (m,)
        Integrals over the free surface of v [m^2].
    scale : array, shape (n,)
        Integrals over the whole box of |grad v|^2 [m].
    """

    axes: tuple[Axis, Axis, Axis]
    stiffness: Array
    pushes: Array
    surface: Array
    surface_one: Array
    scale: Array


def forms(parts: Sequence[tuple[float, LiquidSurface]], axes: tuple[Axis, Axis, Axis]) -> Forms:
    """
    Integrate over a liquid.

    Parameters
    ----------
    parts : sequence of (float, LiquidSurface)
        Surfaces and their weights: the integrals over the liquids within them are so added.
    axes : tuple of three Axis
        Of x, y and z, a box with all of the liquid in it; z = 0 is the upper end.
    """
    x, y, z = axes
    walls: Array = np.sum([w * _moments(part.wall, axes) for w, part in parts], axis=0)
    lids: Array = np.sum([w * _moments(part.free, (x, y)) for w, part in parts], axis=0)
    shape = x.functions, y.functions, z.functions
    here = [
        (i, j, np.s_[i : i + x.degree + 1, j : j + y.degree + 1])
        for i, j in itertools.product(range(x.cells), range(y.cells))
        if walls[i, j].any() or lids[i, j].any()
    ]

    stiffness, surface = np.zeros(shape * 2), np.zeros(shape[:2] * 2)
    x0, x1, y0, y1 = (axis.products(kind) for axis in (x, y) for kind in (VALUE, SLOPE))
    z0, z1 = (z.product_rest(kind) for kind in (VALUE, SLOPE))
    for i, j, own in here:
        surface[own * 2] += _block(x0[i], lids[i, j, :, :, np.newaxis], y0[j])[..., 0, 0]
        column = np.moveaxis(walls[i, j], 0, 2).reshape(*walls.shape[3:5], -1)
        level, upright = (column @ rest.reshape(-1, z.functions**2) for rest in (z0, z1))
        stiffness[(*own, np.s_[:], *own, np.s_[:])] += (
            _block(x1[i], level, y0[j]) + _block(x0[i], level, y1[j])
            + _block(x0[i], upright, y0[j])
        ).transpose(0, 1, 4, 2, 3, 5)  # fmt: skip

    along, across = ([axis.singles(kind) for kind in range(3)] for axis in (x, y))
    up = [np.einsum('xyzijm,zmk->xyijk', walls, z.single_rest(kind), optimize=True)
          for kind in range(3)]  # fmt: skip

    def integral(of_x: int, of_y: int, of_z: int) -> Array:
        total = np.zeros(shape)
        for i, j, own in here:
            part = up[of_z][i, j]
            half = (along[of_x][i].T @ part.reshape(len(part), -1)).reshape(-1, *part.shape[1:])
            total[own] += across[of_y][j].T @ half
        return total.ravel()

    n, m = int(np.prod(shape)), int(np.prod(shape[:2]))
    pushes = np.stack(
        [
            integral(SLOPE, VALUE, VALUE),
            integral(VALUE, SLOPE, VALUE),
            np.zeros(n),
            integral(VALUE, MOMENT, SLOPE) - integral(VALUE, SLOPE, MOMENT),
            integral(SLOPE, VALUE, MOMENT) - integral(MOMENT, VALUE, SLOPE),
            integral(MOMENT, SLOPE, VALUE) - integral(SLOPE, MOMENT, VALUE),
        ]
    )
    squares = [[axis.squares(kind) for kind in (VALUE, SLOPE)] for axis in axes]
    scale = sum(
        np.einsum('a,b,k->abk', *(squares[axis][int(axis == steep)] for axis in range(3)))
        for steep in range(3)
    )
    surface = surface.reshape(m, m)
    return Forms(
        axes=axes,
        stiffness=stiffness.reshape(n, n),
        pushes=pushes,
        surface=surface,
        surface_one=surface.sum(axis=1),  # splines add up to 1
        scale=np.asarray(scale).ravel(),
    )


def _block(of_x: Array, column: Array, of_y: Array) -> Array:
    """
    Sum Legendre coefficients of products along x and y with the moments of a column of cells.

    Shape (p + 1, p + 1, p + 1, p + 1, k, k): splines of x and y, twice, and those of z.
    """
    half = np.tensordot(of_x, column, axes=([0], [0]))
    block = np.tensordot(half, of_y, axes=([1], [0])).transpose(0, 2, 1)
    splines, k = round(np.sqrt(len(block))), round(np.sqrt(block.shape[2]))
    return block.reshape((splines,) * 4 + (k, k)).transpose(0, 2, 1, 3, 4, 5)


def _moments(triangles: Array, axes: tuple[Axis, ...]) -> Array:
    """
    Moments of a surface in each cell, weighed with -n_z, or with n_z if there is no z axis.

    Shape (cells of each axis ..., coefficients of each axis ...).
    """
    triangles = triangles[area_vectors(triangles)[:, 2] != 0.0]
    if not len(triangles):  # no free surface
        return np.zeros((*(a.cells for a in axes), *(2 * a.degree + 1 for a in axes)))
    for k, axis in enumerate(axes):
        triangles = cut(triangles, k, axis.breaks[1:-1])
    middle = triangles.mean(axis=1)
    cells = tuple(axis.cell(middle[:, k]) for k, axis in enumerate(axes))
    counts = tuple(axis.cells for axis in axes)
    degrees = [2 * axis.degree + (k == 2) for k, axis in enumerate(axes)]
    size = np.max(
        [np.ptp(axis.local(triangles[:, :, k], cells[k][:, np.newaxis]), axis=1)
         for k, axis in enumerate(axes)], axis=0,
    )  # fmt: skip
    order = np.array(_ORDERS)[np.searchsorted(_SIZES, size)]
    level = np.ptp(triangles[:, :, 2], axis=1) == 0.0
    order[level] = np.minimum(order[level], _LEVEL)
    number = np.ravel_multi_index(cells, counts)

    total = np.zeros((*counts, *(degree + 1 for degree in degrees)))
    for each in (*_ORDERS, _LEVEL):
        same = np.flatnonzero(order == each)
        same = same[np.argsort(number[same], kind='stable')]
        for some in np.array_split(same, 1 + len(same) * each**2 // _AT_ONCE):
            _add(total, triangles[some], number[some], each, axes, degrees)
    return total


def _add(
    total: Array,
    triangles: Array,
    number: NDArray[np.intp],
    order: int,
    axes: tuple[Axis, ...],
    degrees: list[int],
) -> None:
    """Add the moments of triangles, sorted by the number of their cell."""
    cells = np.unravel_index(number, total.shape[: len(axes)])
    places, weights = points_on(triangles, order)
    weight = weights[..., 2].ravel()
    values = [
        _legendre(axis.local(places[..., k], cells[k][:, np.newaxis]).ravel(), degrees[k])
        for k, axis in enumerate(axes)
    ]
    values[0] *= weight if len(axes) == 2 else -weight
    ends = np.append(np.flatnonzero(np.diff(number)) + 1, len(number))
    begin = 0
    for end in ends.tolist() if len(number) else []:
        of_x, of_y, *up = (v[:, begin * order**2 : end * order**2] for v in values)
        cell = tuple(int(place[begin]) for place in cells)
        if up:
            plane = (of_x[:, np.newaxis] * of_y).reshape(-1, of_x.shape[1])
            total[cell] += (plane @ up[0].T).reshape(total.shape[3:])
        else:
            total[cell] += of_x @ of_y.T
        begin = end


def _legendre(place: Array, degree: int) -> Array:
    """Legendre's polynomials up to a degree at places, shape (degree + 1, p)."""
    values = np.ones((degree + 1, len(place)))
    values[1] = place
    for n in range(1, degree):
        values[n + 1] = ((2 * n + 1) * place * values[n] - n * values[n - 1]) / (n + 1)
    return values
