"""The liquid's section by scikit-fem: triangles of degree 4, graded to its corners."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import pytest
import skfem
from numpy.typing import NDArray
from scipy.linalg import cholesky, eigh
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree
from skfem.helpers import dot, grad

from slosh_ros.constants import GRAVITY
from slosh_ros.hydro.coefficients import ModalCoefficients
from slosh_ros.tank.triangulation import triangulate

Array = NDArray[np.float64]
STILL = 1e-4  # k in place of 0 [1/m], for which K + k^2 M is singular
SERIES = np.arange(1, 26, 2)  # a, in the sum for the inertia; its terms fall as a^-5
REST = float(np.sum((SERIES[-1] / np.arange(SERIES[-1], 999.0, 2)) ** 5))  # last and all beyond


@skfem.BilinearForm
def stiffness(u, v, _):
    return dot(grad(u), grad(v))


@skfem.BilinearForm
def mass(u, v, _):
    return u * v


@skfem.LinearForm
def d_dy(v, _):
    return v.grad[0]


@skfem.LinearForm
def d_dz(v, _):
    return v.grad[1]


@skfem.LinearForm
def turning(v, w):
    return w.x[0] * v.grad[1] - w.x[1] * v.grad[0]


@skfem.LinearForm
def one(v, _):
    return 1.0 * v


@skfem.LinearForm
def times_y(v, w):
    return w.x[0] * v


@skfem.LinearForm
def times_z(v, w):
    return w.x[1] * v


class Modes(NamedTuple):
    """Modes with `a` half-waves along a tank, unit density: couplings (n, 6) over sqrt(mu)."""

    kappa: Array
    coupling: Array


class Elements:
    """
    Triangles of degree 4 on the liquid.

    Parameters
    ----------
    outline : array, shape (n, 2)
        y and z about O, counter-clockwise, z = 0 on the free surface.
    size : float
        Of the largest triangles.
    graded : sequence of points
        Corners around which the triangles are refined `levels` times.
    levels : int
        How often.
    curve : callable, optional
        Moves points (2, p) of straight wall sides to the curved wall.
    """

    def __init__(
        self,
        outline: Array,
        size: float,
        graded: Sequence[Sequence[float]] = (),
        levels: int = 14,
        curve: Callable[[Array], Array] | None = None,
    ) -> None:
        points, triangles = triangulate(outline, lambda p: np.full(len(p), size))
        mesh = skfem.MeshTri(points.T.copy(), triangles.T.copy())
        for _ in range(levels):
            at = [np.hypot(*(mesh.p.T - corner).T).argmin() for corner in graded]
            mesh = mesh.refined(np.flatnonzero(np.isin(mesh.t, at).any(axis=0)))
            if curve is not None:
                wall = np.unique(mesh.facets[:, self._wall(mesh)])
                mesh = skfem.MeshTri(self._moved(mesh.p, wall, curve(mesh.p[:, wall])), mesh.t)
        if curve is not None:
            middles = mesh.p[:, mesh.facets[:, self._wall(mesh)]].mean(axis=1)
            curved = skfem.MeshTri2.from_mesh(mesh)
            which = cKDTree(curved.doflocs.T).query(middles.T)[1]
            mesh = skfem.MeshTri2(self._moved(curved.doflocs, which, curve(middles)), curved.t)
        element = skfem.ElementTriP4()
        self.basis = skfem.Basis(mesh, element, intorder=10)
        surface = mesh.facets_satisfying(lambda x: x[1] > -1e-12, boundaries_only=True)
        self.surface = skfem.FacetBasis(mesh, element, facets=surface, intorder=10)
        self.k, self.m = stiffness.assemble(self.basis), mass.assemble(self.basis)
        self.s = mass.assemble(self.surface)
        self.wet = self.basis.get_dofs(surface).all()
        self.roll, self.y, self.z, self.dy, self.dz = (
            form.assemble(self.basis) for form in (turning, times_y, times_z, d_dy, d_dz)
        )
        self.one, self.at_y = (form.assemble(self.surface) for form in (one, times_y))

    @staticmethod
    def _wall(mesh: skfem.MeshTri) -> NDArray[np.intp]:
        sides = mesh.boundary_facets()
        return sides[mesh.p[1, mesh.facets[:, sides]].min(axis=0) < -1e-12]

    @staticmethod
    def _moved(places: Array, which: NDArray[np.intp], to: Array) -> Array:
        moved = places.copy()
        moved[:, which] = to
        return moved

    def _over_area(self, f: Callable[[Array, Array], Array]) -> float:
        return float(skfem.Functional(lambda w: f(*w.x)).assemble(self.basis))

    def _inverse(self, k: float):
        return splu((self.k + k**2 * self.m).tocsc())

    def modes(self, a: int, length: float, count: int = 20) -> Modes:
        """Lowest modes of a tank of this length; the constant is left out."""
        k = a * np.pi / length or STILL
        root = np.zeros((self.k.shape[0], len(self.wet)))
        root[self.wet] = cholesky(self.s[self.wet][:, self.wet].toarray(), lower=True)
        solved = self._inverse(k).solve(root)
        response, shapes = eigh(root.T @ solved)
        skip = 0 if a else 1
        chosen = slice(-1 - skip, -1 - skip - count, -1)
        kappa = 1.0 / response[chosen]
        psi = solved @ shapes[:, chosen] * kappa
        coupling = np.zeros((len(kappa), 6))
        if a == 0:
            along = length
            coupling[:, 1] = length * self.at_y @ psi
            coupling[:, 3] = length / kappa * (self.roll @ psi)
        else:
            along = length / 2.0
            coupling[:, 0] = -2.0 / k**2 * self.one @ psi
            coupling[:, 4] = 2.0 / kappa * ((self.dz / k**2 - self.z) @ psi)
            coupling[:, 5] = 2.0 / kappa * ((self.y - self.dy / k**2) @ psi)
        return Modes(kappa, coupling / np.sqrt(along / kappa)[:, np.newaxis])

    def inertia(self, length: float) -> Array:
        """
        Stokes-Joukowski inertia about O, unit density.

        Of pitch and yaw by waves along the tank, not by the Neumann pairs of the section: with
        Omega = x u + sum over odd a of 8/(L k^2) cos k(x + L/2) g, where lap g = k^2 g and
        dg/dn = du/dn all round, for u = z and u = -y.
        """
        area, yy, zz, yz = (
            self._over_area(f)
            for f in (
                lambda y, z: 1.0 + 0.0 * y,
                lambda y, z: y**2,
                lambda y, z: z**2,
                np.multiply,
            )
        )
        inertia = np.zeros((3, 3))
        inertia[0, 0] = length * self.roll @ self._inverse(STILL / 10.0).solve(self.roll)
        inertia[1:, 1:] = length * np.array([[zz, -yz], [-yz, yy]])
        inertia[1:, 1:] -= area * length**3 / 4.0 * np.eye(2)
        slopes = np.stack([self.dz, -self.dy], axis=1)
        for a in SERIES:
            k = a * np.pi / length
            share = REST if a == SERIES[-1] else 1.0
            term = slopes.T @ self._inverse(k).solve(slopes) / k**4
            inertia[1:, 1:] += 32.0 / length * share * term
        return inertia


def assert_same(c: ModalCoefficients, elements: Elements, length: float) -> None:
    """Compare frequencies, couplings and inertia, whatever scale and sign the modes have."""
    found = c.coupling / np.sqrt(c.density * c.mu)[:, np.newaxis]
    along = [int(name[1:].partition('y')[0]) if name[0] == 'x' else 0 for name in c.names]
    modes = {a: elements.modes(a, length) for a in set(along)}
    for j, a in enumerate(along):
        i = np.abs(modes[a].kappa - c.omega[j] ** 2 / GRAVITY).argmin()
        assert c.omega[j] ** 2 / GRAVITY == pytest.approx(modes[a].kappa[i], rel=2e-6)
        exact = np.outer(modes[a].coupling[i], modes[a].coupling[i])
        error = np.abs(np.outer(found[j], found[j]) - exact).max()
        assert error < 2e-5 * np.abs(exact).max(), c.names[j]
    inertia = elements.inertia(length)
    assert c.inertia_stokes_joukowski / c.density == pytest.approx(
        inertia, abs=2e-6 * np.diag(inertia).min()
    )
