"""
Modes of a liquid of any shape among products of splines.

In weak form, K psi = kappa S psi with the stiffness K and the free surface's S. A liquid that is
symmetric about x = 0 or y = 0 is folded onto one side of it, its surface with it: even functions
take all splines there, odd ones those that vanish in the plane.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cholesky, eigh, solve_triangular
from scipy.spatial import cKDTree

from slosh_ros.errors import InputError
from slosh_ros.hydro.coefficients import Array
from slosh_ros.hydro.volume_pieces import cut
from slosh_ros.hydro.volume_splines import Axis, Forms
from slosh_ros.hydro.volume_surface import outline
from slosh_ros.tank.surface import LiquidSurface

# Splines that barely reach into the liquid are all but undetermined. All of the box is therefore
# filled with a medium of so small a share of the liquid's stiffness, of which only the square is
# left in kappa. The larger shares are for surfaces whose extrapolation leaves holes.
_MEDIUM = (1e-8, 1e-7, 1e-6, 1e-5)
_TIED = 0.1  # share of a mode's energy in the medium that tells that nothing else holds it
_OUTSIDE = 1e-12  # share of its energy that a spline has at least in the liquid, to take part
_SMOOTH = 1e-12  # [of the largest 1/kappa] below which the free surface does not know a mode
_CONSTANT = 1e3  # [1/m, over the height] where the constant is put among the kappa

# whether the couplings 1..6 are of potentials odd in x, and odd in y
_ODD = np.array([[1, 0], [0, 1], [2, 2], [0, 1], [1, 0], [1, 1]])

Parity = tuple[bool, bool]


@dataclass(frozen=True, eq=False)
class Family:
    """
    Modes of one parity, for unit density and an integral of f^2 over the free surface of 1.

    Attributes
    ----------
    odd : tuple of bool
        Whether they are odd in x and in y.
    kappa : array, shape (m,)
        omega^2/g, rising [1/m].
    psi : array, shape (n, m)
        Their potentials among all splines.
    coupling : array, shape (m, 6)
        lambda_1, lambda_2, 0, lambda_4, lambda_5, lambda_6.
    rotation : array, shape (n, 3)
        The potentials Omega_4, Omega_5, Omega_6 among all splines, those of this parity.
    inertia : array, shape (3, 3)
        Their share of the Stokes-Joukowski inertia [m^5].
    """

    odd: Parity
    kappa: Array
    psi: Array
    coupling: Array
    rotation: Array
    inertia: Array


def families(forms: Forms, symmetric: Parity) -> list[Family]:
    """
    Solve for the modes of every parity that couples with a motion of the tank.

    Parameters
    ----------
    forms : Forms
        Integrals over the liquid, folded where it is symmetric.
    symmetric : tuple of bool
        Whether it is, about x = 0 and about y = 0.
    """
    x_planes, y_planes = ((False, True) if plane else (False,) for plane in symmetric)
    found = []
    for odd in itertools.product(x_planes, y_planes):
        couples = np.all((odd == _ODD) | ~np.array(symmetric), axis=1) & (_ODD[:, 0] != 2)
        if couples.any():
            found.append(_family(forms, odd, couples))
    return found


def _family(forms: Forms, odd: Parity, couples: NDArray[np.bool_]) -> Family:
    shape = tuple(axis.functions for axis in forms.axes)
    wanted = (np.diag(forms.stiffness) > _OUTSIDE * forms.scale).reshape(shape)
    wanted[: int(odd[0])] = False
    wanted[:, : int(odd[1])] = False
    top = np.zeros(shape, dtype=bool)
    top[..., -1] = True
    below, above = (np.flatnonzero((wanted & part).ravel()) for part in (~top, top))
    among = np.concatenate([below, above])
    on_top = np.flatnonzero(wanted[..., -1])
    inner = len(below)
    if not len(among):
        raise InputError('the surface of the liquid is not turned outwards')

    # all splines to the same energy in the whole box
    size = 1.0 / np.sqrt(forms.scale[among])
    stiffness = forms.stiffness[np.ix_(among, among)] * size[:, np.newaxis] * size
    surface = forms.surface[np.ix_(on_top, on_top)] * size[inner:, np.newaxis] * size[inner:]
    level = forms.surface_one[on_top] * size[inner:]
    area, height = float(forms.surface_one.sum()), float(np.ptp(forms.axes[2].breaks))
    if not any(odd) and area > 0.0:
        # modes have no mean over the free surface and do not feel this; the constant does
        stiffness[inner:, inner:] += _CONSTANT / (height * area) * np.outer(level, level)
    lower, medium = _cholesky(stiffness)

    kappa, found = np.zeros(0), np.zeros((len(among), 0))
    if area > 0.0:
        kappa, found = _steklov(lower, surface)
        if np.sum(found[:, 0] ** 2) * medium > _TIED * kappa[0]:
            raise InputError('the liquid is not one pool, but several that do not touch')
        kappa = _without(medium * np.sum(found**2, axis=0), kappa)
    psi = np.zeros((forms.stiffness.shape[0], len(kappa)))
    psi[among] = found * size[:, np.newaxis]

    pushes = np.where(couples[:, np.newaxis], forms.pushes[:, among], 0.0)
    turning = solve_triangular(lower, (pushes[3:] * size).T, lower=True, check_finite=False)
    turned = solve_triangular(lower.T, turning, check_finite=False)
    rotation = np.zeros((len(psi), 3))
    rotation[among] = turned * size[:, np.newaxis]
    return Family(
        odd=odd,
        kappa=kappa,
        psi=psi,
        coupling=(pushes @ psi[among] / kappa).T,
        rotation=rotation,
        inertia=turning.T @ turning + medium * turned.T @ turned,  # the medium bears its share
    )


def closed_families(forms: Forms, symmetric: Parity) -> list[Family]:
    """
    Solve for the rotation of a liquid without a free surface; see :func:`families`.

    Parameters
    ----------
    forms : Forms
        Integrals over the liquid, folded where it is symmetric.
    symmetric : tuple of bool
        Whether it is, about x = 0 and about y = 0.
    """
    shape = tuple(axis.functions for axis in forms.axes)
    inside = np.diag(forms.stiffness) > _OUTSIDE * forms.scale
    found = []
    x_planes, y_planes = ((False, True) if plane else (False,) for plane in symmetric)
    for odd in itertools.product(x_planes, y_planes):
        couples = np.all((odd == _ODD) | ~np.array(symmetric), axis=1)[3:]
        if not couples.any():
            continue
        wanted = inside.reshape(shape).copy()
        wanted[: int(odd[0])] = False
        wanted[:, : int(odd[1])] = False
        among = np.flatnonzero(wanted)
        size = 1.0 / np.sqrt(forms.scale[among])
        stiffness = forms.stiffness[np.ix_(among, among)] * size[:, np.newaxis] * size
        if not any(odd):
            # the constant, whose splines are all 1, is held; nothing pushes it
            constant = 1.0 / (size * np.linalg.norm(1.0 / size))
            stiffness += np.trace(stiffness) / len(among) * np.outer(constant, constant)
        lower, _ = _cholesky(stiffness)
        pushes = np.where(couples[:, np.newaxis], forms.pushes[3:, among], 0.0)
        turning = solve_triangular(lower, (pushes * size).T, lower=True, check_finite=False)
        rotation = np.zeros((len(inside), 3))
        rotation[among] = solve_triangular(lower.T, turning, check_finite=False)
        rotation[among] *= size[:, np.newaxis]
        none = np.zeros(0)
        found.append(
            Family(
                odd=odd,
                kappa=none,
                psi=np.zeros((len(inside), 0)),
                coupling=np.zeros((0, 6)),
                rotation=rotation,
                inertia=turning.T @ turning,
            )
        )
    return found


def _without(medium: Array, kappa: Array) -> Array:
    """
    Take the medium's part out of kappa: what is left, Rayleigh's quotient, errs by its square.

    In a film it is the larger part of the error. Modes that hang on the medium stay high.
    """
    return np.asarray(np.where(medium < _TIED * kappa, kappa - medium, kappa))


def _steklov(lower: Array, surface: Array) -> tuple[Array, Array]:
    """
    Solve L L^T psi = kappa S psi, of which only the last splines know the free surface.

    Returns kappa, rising, and psi by columns, with psi^T S psi = 1.
    """
    inner = len(lower) - len(surface)
    top_lower = lower[inner:, inner:]
    half = solve_triangular(top_lower, surface, lower=True, check_finite=False)
    response = solve_triangular(top_lower, half.T, lower=True, check_finite=False)
    values, vectors = eigh((response + response.T) / 2.0)
    good = np.flatnonzero(values > _SMOOTH * values[-1])[::-1]
    kappa = 1.0 / values[good]
    crest = solve_triangular(top_lower.T, vectors[:, good], check_finite=False) * np.sqrt(kappa)
    depth = solve_triangular(
        lower[:inner, :inner].T, -lower[inner:, :inner].T @ crest, check_finite=False
    )
    return kappa, np.concatenate([depth, crest])


def _cholesky(stiffness: Array) -> tuple[Array, float]:
    """Lower factor of the stiffness with as little as possible of the medium, and how much."""
    for share in _MEDIUM:
        filled = stiffness.copy()
        filled[np.diag_indices_from(filled)] += share
        try:
            lower = cholesky(filled, lower=True, overwrite_a=True, check_finite=False)
        except LinAlgError:
            continue
        return np.asarray(lower), share
    raise InputError(
        'the surface of the liquid is not closed, or its triangles are not all turned outwards'
    )


@dataclass(frozen=True, eq=False)
class SplinePotentials:
    """
    The potentials of modes, and of rotation about O under a closed lid.

    Attributes
    ----------
    axes : tuple of three Axis
        Of the splines.
    symmetric : tuple of bool
        Whether x and y are folded.
    odd : array of bool, shape (n, 2)
        Parity of the modes in x and y.
    rank : array of int, shape (n,)
        Number of slower modes of their parity.
    psi : array, shape (splines, n)
        The modes.
    rotation_odd : array of bool, shape (m, 2)
        Parity of parts of the potentials of rotation.
    rotation : array, shape (splines, m, 3)
        These parts, which add up to Omega_4, Omega_5, Omega_6.
    """

    axes: tuple[Axis, Axis, Axis]
    symmetric: Parity
    odd: NDArray[np.bool_]
    rank: NDArray[np.intp]
    psi: Array
    rotation_odd: NDArray[np.bool_]
    rotation: Array

    def modes(self, points: Array) -> Array:
        """Potentials phi_j of the modes, shape (p, n) [-]."""
        return self._values(points, self.psi) * self._signs(points, self.odd)

    def stokes_joukowski(self, points: Array) -> Array:
        """Potentials Omega_4, Omega_5, Omega_6 of rotation, shape (p, 3) [m^2]."""
        parts = self._values(points, self.rotation.reshape(len(self.rotation), -1))
        parts = parts.reshape(len(points), -1, 3)
        signs = self._signs(points, self.rotation_odd)
        return np.asarray(np.einsum('pm,pmk->pk', signs, parts))

    def speeds(self, points: Array, normals: Array) -> Array:
        """
        Squared velocity of each mode along the wall [1/m^2], at one side of folded planes.

        Parameters
        ----------
        points, normals : array, shape (p, 3)
            Of the wall, in the folded liquid.

        Returns
        -------
        array, shape (p, n)
            The squares.
        """
        gradient = np.stack([self._values(points, self.psi, axis) for axis in range(3)], axis=-1)
        through = np.einsum('pnk,pk->pn', gradient, normals)
        return np.asarray(np.sum(gradient**2, axis=-1) - through**2)

    def _values(self, points: Array, columns: Array, slope: int | None = None) -> Array:
        """Values, or slopes along an axis, of combinations of the splines, shape (p, columns)."""
        where = points.copy()
        for k in np.flatnonzero(self.symmetric):
            where[:, k] = np.abs(where[:, k])
        at = [axis.at(where[:, k], int(k == slope)) for k, axis in enumerate(self.axes)]
        counts = tuple(axis.cells for axis in self.axes)
        cells = tuple(axis.cell(where[:, k]) for k, axis in enumerate(self.axes))
        number = np.ravel_multi_index(cells, counts)
        order = np.argsort(number, kind='stable')
        starts = np.flatnonzero(np.diff(number[order], prepend=-1))
        weights = columns.reshape(*(axis.functions for axis in self.axes), -1)
        values = np.empty((len(points), columns.shape[1]))
        for some in np.split(order, starts[1:]) if len(order) else []:
            # the splines that live on the cell of these points
            own = tuple(
                np.s_[cell[some[0]] : cell[some[0]] + axis.degree + 1]
                for cell, axis in zip(cells, self.axes, strict=True)
            )
            of_x, of_y, of_z = (part[some, live] for part, live in zip(at, own, strict=True))
            across = (of_x[:, :, np.newaxis] * of_y[:, np.newaxis]).reshape(len(some), -1)
            products = (across[:, :, np.newaxis] * of_z[:, np.newaxis]).reshape(len(some), -1)
            values[some] = products @ weights[own].reshape(products.shape[1], -1)
        return values

    def _signs(self, points: Array, odd: NDArray[np.bool_]) -> Array:
        sides = np.where(points[:, np.newaxis, :2] < 0.0, -1.0, 1.0)
        return np.asarray(np.prod(np.where(odd, sides, 1.0), axis=2))


def symmetries(surface: LiquidSurface, tolerance: float = 1e-6) -> Parity:
    """
    Tell whether a liquid is its own mirror image about x = 0, and about y = 0.

    All corners must have theirs, within a share of the liquid's size; those of the contact line
    may have it anywhere on that. What is left then are diagonals of quadrangles, drawn the one way
    here and the other way there; folding takes the mean of both.
    """
    corners = surface.wall.reshape(-1, 3) if surface.corners is None else surface.corners
    size = tolerance * float(np.ptp(corners, axis=0).max())
    tree, (begin, end) = cKDTree(corners), outline(surface.free).transpose(1, 0, 2)
    on_line = corners[:, 2] > -size
    found = []
    for mirror in ([-1.0, 1.0, 1.0], [1.0, -1.0, 1.0]):
        image = corners * mirror
        lone = tree.query(image)[0] >= size
        twin = image[lone & on_line, np.newaxis, :2]
        way = np.sum((twin - begin) * (end - begin), axis=2) / np.sum((end - begin) ** 2, axis=1)
        foot = begin + np.clip(way, 0.0, 1.0)[..., np.newaxis] * (end - begin)
        away = np.linalg.norm(twin - foot, axis=2).min(axis=1, initial=np.inf)
        found.append(not np.any(lone & ~on_line) and bool(np.all(away < size)))
    return found[0], found[1]


def folded(surface: LiquidSurface, symmetric: Parity) -> LiquidSurface:
    """Fold a surface onto the positive side of x = 0 and of y = 0; sheets lie on each other."""

    def fold(triangles: Array) -> Array:
        for k in (k for k in range(2) if symmetric[k]):
            triangles = cut(triangles, k, np.zeros(1))
            behind = triangles.mean(axis=1)[:, k] < 0.0
            triangles[behind, :, k] *= -1.0
            triangles[behind] = triangles[behind][:, ::-1]
        return triangles

    return LiquidSurface(fold(surface.wall), fold(surface.free))
