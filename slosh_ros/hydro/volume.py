"""
Tank of any shape, by splines on a box around the liquid (an immersed Galerkin method).

The potentials are sought among products of splines on a box that the wall of the tank cuts as it
likes. Only integrals over the liquid are needed, and these come from the triangles of its surface,
exactly: no mesh of the inside, and no demand on the shape of the triangles. Flat triangles on a
smooth wall err by the square of their size; the integrals of two sizes, so weighed that the volume
is right, leave the fourth power of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import numpy as np

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.hydro.coefficients import Array, ModalCoefficients, still_coefficients
from slosh_ros.hydro.section import half_waves
from slosh_ros.hydro.volume_grid import grid_around
from slosh_ros.hydro.volume_modes import (
    Family,
    Parity,
    SplinePotentials,
    closed_families,
    families,
    folded,
    symmetries,
)
from slosh_ros.hydro.volume_pieces import cut, points_on
from slosh_ros.hydro.volume_splines import Axis, forms
from slosh_ros.hydro.volume_surface import FreeSurface
from slosh_ros.tank.surface import LiquidSurface, area_vectors, solid_moments
from slosh_ros.tank.uniform import LiquidAtRest

# A mode couples if its share lambda^2/mu of the mass, or of a moment of inertia, of the frozen
# liquid exceeds this; below, a coupling cannot be told from the error of its mode.
COUPLING_SHARE = 1e-7

_TARGET = 5e-4  # error that calls for no finer grid
_FINER = 1.4  # by which one grid is finer than the one before
_GRIDS = 4  # most that are tried
_FULL = 300  # cells of the grid in a full tank
_LARGEST = 4500  # functions of a grid; the cost goes with the third power

_MIXING = 0.01  # difference of kappa below which modes may mix in one grid and not in another
_DEGENERATE = 1e-3  # difference of kappa below which modes are a pair of a body of revolution
_LEFT = 0.1  # share of the error of flat triangles that may be left when it is extrapolated
_CLOSED = 1e-6  # sum of area vectors, over that of areas
_EQUAL = 2e-5  # difference that is none, with surge first
_SMALL = 0.01  # share of the liquid that is the scale for the errors of smaller couplings


class FillableTank(Protocol):
    """A tank whose liquid can be had as a closed surface."""

    def filled(self, depth: float) -> LiquidAtRest:
        """Describe the liquid at rest."""

    def liquid_surface(self, depth: float, size: float) -> LiquidSurface:
        """Surround the liquid with triangles of about that edge length [m]."""


@dataclass(frozen=True)
class VolumeResolution:
    """
    Size of the discrete problem.

    Attributes
    ----------
    cells : float
        Of the grid, per half-wave of the shortest mode.
    degree : int
        Of the splines.
    triangles : int
        Of a smooth tank's surface, about.
    """

    cells: float = 2.2
    degree: int = 4
    triangles: int = 16000


DEFAULT = VolumeResolution()


@dataclass(frozen=True, eq=False)
class _Mode:
    """A mode for unit density and an integral of f^2 over the free surface of 1."""

    kappa: float
    coupling: Array
    psi: Array
    odd: tuple[bool, bool]


class _Solved(NamedTuple):
    """What came of one grid."""

    axes: tuple[Axis, Axis, Axis]
    families: Sequence[Family]
    modes: Sequence[_Mode]
    inertia: Array


def volume_coefficients(
    tank: FillableTank,
    depth: float,
    density: float,
    modes: int,
    resolution: VolumeResolution = DEFAULT,
) -> ModalCoefficients:
    """
    Coefficients of the coupling modes of lowest natural frequency.

    The grid is refined until two in a row agree to three digits, or it is as large as time
    allows; `error` tells by how much the last two differ.

    Parameters
    ----------
    tank : FillableTank
        The tank.
    depth : float
        Depth of the liquid [m]; of a full tank see :func:`full_volume_coefficients`.
    density : float
        Density of the liquid [kg/m^3].
    modes : int
        Number of modes.
    resolution : VolumeResolution
        Size of the discrete problem.

    Raises
    ------
    InputError
        If the liquid is not one pool, its surface not closed, or the modes too many.
    """
    liquid = tank.filled(depth)
    problem = _Problem.of(tank, depth, liquid, resolution)
    free = FreeSurface.of(problem.outside.free)
    length, width = free.extent
    cell = problem.fitting(width / half_waves(modes, length, width) / resolution.cells)
    last = problem.solved(_FINER * cell, modes)
    flat = problem.flat(last, _FINER * cell, modes)
    if last.modes:
        highest = last.modes[-1].kappa
        wave = max(highest, np.sqrt(highest / liquid.depth))  # deep, shallow
        cell = problem.fitting(min(cell, np.pi / wave / resolution.cells))
    last, error = problem.refined(last, cell, modes)
    if len(last.modes) < modes:
        raise InputError(
            f'only {len(last.modes)} modes of this liquid can be resolved, not {modes}; '
            'ask for fewer'
        )
    potentials = problem.potentials(last)
    friction = _wall_friction(problem.parts[-1][1].wall, potentials)
    shapes = potentials.modes(np.pad(free.points, ((0, 0), (0, 1))))
    scale = 1.0 / np.abs(shapes).max(axis=0)
    scale *= free.signs(shapes * scale)
    kappa = np.array([mode.kappa for mode in last.modes])
    coupling = np.array([mode.coupling for mode in last.modes])
    share = (coupling**2 / problem.whole)[:, [0, 1, 5]]
    alike = np.stack([share.argmax(axis=1) != k for k in (1, 0)], axis=-1)
    odd = np.where(problem.symmetric, potentials.odd, alike)
    return ModalCoefficients(
        route='volume',
        density=density,
        liquid=liquid,
        names=free.names(shapes, odd, problem.symmetric),
        omega=np.sqrt(GRAVITY * kappa),
        mu=density * scale**2 / kappa,  # eq (10)
        coupling=density * scale[:, np.newaxis] * coupling,
        inertia_stokes_joukowski=density * last.inertia,
        wall_friction=friction / (2.0 * kappa),
        surface_points=free.points[free.sparse],
        surface_shapes=(shapes * scale)[free.sparse],
        potentials=replace(potentials, psi=potentials.psi * scale),
        error=error + flat,
    )


@dataclass(frozen=True, eq=False)
class _Problem:
    """
    A liquid to be solved for on grids of any fineness.

    Attributes
    ----------
    parts : sequence of (float, LiquidSurface)
        Surfaces and their weights, folded where they are symmetric.
    outside : LiquidSurface
        The first of them as it is.
    symmetric : tuple of bool
        Whether it is folded at x = 0, and at y = 0.
    whole : array, shape (6,)
        Volume [m^3] and inertia [m^5] of which the couplings are shares.
    degree : int
        Of the splines.
    """

    parts: Sequence[tuple[float, LiquidSurface]]
    outside: LiquidSurface
    symmetric: Parity
    whole: Array
    degree: int

    @classmethod
    def of(
        cls, tank: FillableTank, depth: float, liquid: LiquidAtRest, resolution: VolumeResolution
    ) -> _Problem:
        parts = _surfaces(tank, depth, liquid, resolution.triangles)
        outside = parts[0][1]
        areas = area_vectors(outside.triangles)
        if np.abs(areas.sum(axis=0)).max() > _CLOSED * np.linalg.norm(areas, axis=1).sum():
            raise InputError('the surface of the liquid is not closed, or not all turned outwards')
        symmetric = symmetries(outside)
        whole = np.array([liquid.volume, liquid.volume, np.inf, *np.diag(liquid.inertia)])
        return cls(
            parts=[(weight, folded(surface, symmetric)) for weight, surface in parts],
            outside=outside,
            symmetric=symmetric,
            whole=whole,
            degree=resolution.degree,
        )

    def grid(self, cell: float) -> tuple[Axis, Axis, Axis]:
        """Grid for waves that need cells of a size [m]."""
        return grid_around(self.parts[0][1], self.symmetric, cell, self.degree)

    def fitting(self, cell: float) -> float:
        """Size of cells [m], or of larger ones, of which there are not too many."""
        while np.prod([axis.functions for axis in self.grid(cell)]) > _LARGEST:
            cell *= 1.1
        return cell

    def solved(self, cell: float, modes: int) -> _Solved:
        """Solve for the lowest modes on a grid."""
        axes = self.grid(cell)
        found = families(forms(self.parts, axes), self.symmetric)
        inertia = sum((family.inertia for family in found), np.zeros((3, 3)))
        return _Solved(axes, found, _coupling(found, self.whole, modes), inertia)

    def flat(self, solved: _Solved, cell: float, modes: int) -> float:
        """Error that extrapolation may leave of that of flat triangles on a smooth wall."""
        if len(self.parts) == 1:
            return 0.0
        finer_alone = replace(self, parts=[(1.0, self.parts[0][1])])
        return _LEFT * _difference(finer_alone.solved(cell, modes), solved, self.whole)

    def refined(self, last: _Solved, cell: float, modes: int) -> tuple[_Solved, float]:
        """Solve on finer grids until two of them agree, and tell by how much they do."""
        for _ in range(_GRIDS - 1):
            before, last = last, self.solved(cell, modes)
            error = _difference(before, last, self.whole)
            cell /= _FINER
            if error < _TARGET or self.fitting(cell) > cell:
                break
        return last, error

    def potentials(self, solved: _Solved) -> SplinePotentials:
        """Potentials of the modes, not yet scaled, and of rotation."""
        count = int(np.prod([axis.functions for axis in solved.axes]))
        return SplinePotentials(
            axes=solved.axes,
            symmetric=self.symmetric,
            odd=np.array([mode.odd for mode in solved.modes], dtype=bool).reshape(-1, 2),
            psi=np.array([mode.psi for mode in solved.modes]).reshape(-1, count).T,
            rotation_odd=np.array([family.odd for family in solved.families]),
            rotation=np.stack([family.rotation for family in solved.families], axis=1),
        )


def full_volume_coefficients(
    tank: FillableTank, depth: float, density: float, resolution: VolumeResolution = DEFAULT
) -> ModalCoefficients:
    """
    Coefficients of a tank that is full: without modes, about O, its top.

    Parameters
    ----------
    tank : FillableTank
        The tank.
    depth : float
        Its height [m].
    density : float
        Density of the liquid [kg/m^3].
    resolution : VolumeResolution
        Size of the discrete problem; `error` tells by how much a coarser grid differs.
    """
    liquid = tank.filled(depth)
    parts = _surfaces(tank, depth, liquid, resolution.triangles)
    symmetric = symmetries(parts[0][1])
    parts = [(weight, folded(surface, symmetric)) for weight, surface in parts]
    corners = parts[0][1].wall.reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    low[:2][np.array(symmetric)] = 0.0
    high[2] = 0.0

    def solved(functions: float) -> tuple[tuple[Axis, Axis, Axis], list[Family]]:
        cell = np.cbrt(np.prod(high - low) / functions)
        x, y, z = (
            Axis(np.linspace(a, b, 2 + int((b - a) / cell)), resolution.degree)
            for a, b in zip(low, high, strict=True)
        )
        return (x, y, z), closed_families(forms(parts, (x, y, z)), symmetric)

    inertias = []
    for cells in (_FULL / _FINER**3, _FULL):
        axes, found = solved(cells)
        inertias.append(sum((f.inertia for f in found), np.zeros((3, 3))))
    potentials = SplinePotentials(
        axes=axes,
        symmetric=symmetric,
        odd=np.zeros((0, 2), dtype=bool),
        psi=np.zeros((len(found[0].rotation), 0)),
        rotation_odd=np.array([family.odd for family in found]),
        rotation=np.stack([family.rotation for family in found], axis=1),
    )
    # zero at O, where it is vented; the splines add up to 1
    even = ~np.any(potentials.rotation_odd, axis=1)
    potentials.rotation[:, even] -= potentials.stokes_joukowski(np.zeros((1, 3)))
    still = still_coefficients('volume', density, liquid, density * inertias[1], potentials)
    error = float(np.abs(inertias[1] - inertias[0]).max() / np.abs(inertias[1]).max())
    return replace(still, error=error)


def _wall_friction(wall: Array, potentials: SplinePotentials) -> Array:
    """Integral over the wall of the squared velocity of each mode along it."""
    for k, axis in enumerate(potentials.axes):
        wall = cut(wall, k, axis.breaks[1:-1])
    points = points_on(wall, 2)
    areas = np.linalg.norm(points.weights, axis=2)
    normals = points.weights / np.maximum(areas, np.finfo(float).tiny)[..., np.newaxis]
    speeds = potentials.speeds(points.places.reshape(-1, 3), normals.reshape(-1, 3))
    return np.asarray(areas.ravel() @ speeds)


def _surfaces(
    tank: FillableTank, depth: float, liquid: LiquidAtRest, triangles: int
) -> list[tuple[float, LiquidSurface]]:
    """Surfaces of the liquid and their weights: of a smooth tank two sizes, the finer first."""
    rough = tank.liquid_surface(depth, liquid.volume ** (1.0 / 3.0) / 8.0)
    area = float(np.linalg.norm(area_vectors(rough.triangles), axis=1).sum())
    size = np.sqrt(2.0 * area / triangles)
    fine, coarse = (tank.liquid_surface(depth, s) for s in (size, 2.0 * size))
    own, other = (solid_moments(surface.wall).whole for surface in (fine, coarse))
    if abs(own - other) <= 1e-9 * abs(own):  # flat walls
        return [(1.0, fine)]
    beyond = float(np.clip((liquid.volume - own) / (own - other), 0.0, 0.5))
    return [(1.0 + beyond, fine), (-beyond, coarse)]


def _coupling(found: Sequence[Family], whole: Array, count: int) -> list[_Mode]:
    """Select the lowest modes that couple, pairs of a body of revolution turned to x and y."""
    modes = []
    for family in found:
        share = family.coupling**2 / whole * family.kappa[:, np.newaxis]
        kept = np.flatnonzero(share.max(axis=1) > COUPLING_SHARE)[: count + 1]
        modes += [
            _Mode(family.kappa[j], family.coupling[j], family.psi[:, j], family.odd) for j in kept
        ]
    modes.sort(key=lambda mode: mode.kappa)
    for j in range(min(count, len(modes) - 1)):
        a, b = modes[j : j + 2]
        if a.odd == b.odd and b.kappa - a.kappa < _DEGENERATE * a.kappa:
            modes[j : j + 2] = _turned(a, b)
        elif b.kappa - a.kappa < _EQUAL * a.kappa and _surges(b) and not _surges(a):
            kappa = (a.kappa + b.kappa) / 2.0
            modes[j : j + 2] = replace(b, kappa=kappa), replace(a, kappa=kappa)
    return modes[:count]


def _surges(mode: _Mode) -> bool:
    return bool(abs(mode.coupling[0]) > abs(mode.coupling[1]))


def _turned(a: _Mode, b: _Mode) -> tuple[_Mode, _Mode]:
    """Combine two modes of one frequency so that the first does not couple with sway."""
    push = np.hypot(a.coupling[1], b.coupling[1])
    if push == 0.0:
        return a, b
    cosine, sine = b.coupling[1] / push, -a.coupling[1] / push

    def combined(p: float, q: float) -> _Mode:
        return _Mode(
            p**2 * a.kappa + q**2 * b.kappa,
            p * a.coupling + q * b.coupling,
            p * a.psi + q * b.psi,
            a.odd,
        )

    return combined(cosine, sine), combined(-sine, cosine)


def _difference(coarse: _Solved, fine: _Solved, whole: Array) -> float:
    """Largest relative difference of frequencies, couplings and inertia."""
    if len(coarse.modes) < len(fine.modes):
        return np.inf
    error = np.abs(coarse.inertia - fine.inertia).max() / np.abs(fine.inertia).max()
    left, twins = list(coarse.modes), []
    for mode in fine.modes:
        alike = [m for m in left if m.odd == mode.odd]
        if not alike:
            return np.inf
        twins.append(min(alike, key=lambda m: abs(m.kappa - mode.kappa)))
        left.remove(twins[-1])
    for mode in fine.modes:
        # modes of almost one frequency mix: only their sum is sure
        group = [
            (ours, theirs)
            for ours, theirs in zip(fine.modes, twins, strict=True)
            if ours.odd == mode.odd and abs(ours.kappa / mode.kappa - 1.0) < _MIXING
        ]
        share, other = (
            sum(m.coupling**2 * m.kappa for m in side) / whole for side in zip(*group, strict=True)
        )
        kappa, twin = (np.mean([m.kappa for m in side]) for side in zip(*group, strict=True))
        error = max(
            error,
            abs(twin / kappa - 1.0) / 2.0,
            float(np.max(np.abs(share - other) / np.maximum(share, _SMALL))) / 2.0,
        )
    return float(error)
