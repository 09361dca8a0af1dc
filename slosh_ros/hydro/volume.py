"""
Tank of any shape, by splines on a box around the liquid (an immersed Galerkin method).

The potentials are sought among products of splines on a box that the wall of the tank cuts as it
likes. Only integrals over the liquid are needed, and these come from the triangles of its surface,
exactly: no mesh of the inside, and no demand on the shape of the triangles. Flat triangles on a
smooth wall err by the square of their size; the integrals of two sizes, so weighed that the volume
is right, leave the fourth power of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import numpy as np
from scipy.optimize import linear_sum_assignment

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
from slosh_ros.hydro.volume_surface import FreeSurface, likeness
from slosh_ros.tank.surface import LiquidSurface, area_vectors, solid_moments
from slosh_ros.tank.uniform import LiquidAtRest

# A mode couples if its share lambda^2/mu of the mass, or of a moment of inertia, of the frozen
# liquid exceeds this; below, a coupling cannot be told from the error of its mode.
COUPLING_SHARE = 1e-7

_TARGET = 5e-5  # change by finer cells along one axis that calls for no finer ones
_FINER = 1.6  # by which cells are smaller than the ones before
_FULL = 300  # cells of the grid in a full tank
_LARGEST = 4500  # functions of a grid; the cost goes with the third power

_MIXING = 0.01  # difference of kappa below which modes may mix in one grid and not in another
_DEGENERATE = 1e-3  # difference of kappa below which modes are a pair of a body of revolution
_LEFT = 0.1  # share of the error of flat triangles that may be left when it is extrapolated
_CLOSED = 1e-6  # sum of area vectors, over that of areas
_EQUAL = 2e-5  # difference that is none, with surge first
_PAIR = 0.3  # [of the other's] coupling that a pair has in its own direction, and not across
_SPARE = 2  # modes beyond those wanted
_AMONG = 24  # modes of a parity among which the likes of others are looked for
_MUCH = 0.9  # of the size of cells: a smaller one is worth another grid
_LEAST_PUSH = 0.1  # root of the liquid's share that is the scale for errors of smaller couplings


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
    grids : int
        Finer grids that are tried at most; without any, the error is not told.
    along : tuple of int, optional
        Cells of the only grid along x, y and z, where another fill has told how many are needed.
    """

    cells: float = 2.2
    degree: int = 4
    triangles: int = 20000
    grids: int = 10
    along: tuple[int, int, int] | None = None


DEFAULT = VolumeResolution()


Finer = tuple[float, float, float]
ONCE: Finer = (1.0, 1.0, 1.0)


def _along(finer: Finer, axis: int, by: float = _FINER) -> Finer:
    """Cells that are smaller along one axis."""
    x, y, z = (n * by if k == axis else n for k, n in enumerate(finer))
    return x, y, z


_ALONG = [_along(ONCE, axis) for axis in range(3)]


def fits(cells: Sequence[int], degree: int) -> bool:
    """Whether a grid of so many cells along x, y and z is no larger than time allows."""
    return bool(np.prod(np.add(cells, degree)) <= _LARGEST)


@dataclass(frozen=True, eq=False)
class _Mode:
    """
    A mode for unit density and an integral of f^2 over the free surface of 1.

    Its rank is the number of slower ones of its parity.
    """

    kappa: float
    coupling: Array
    psi: Array
    odd: tuple[bool, bool]
    rank: int


class _Found(NamedTuple):
    """All that one grid tells."""

    axes: tuple[Axis, Axis, Axis]
    families: Sequence[Family]


class _Solved(NamedTuple):
    """The modes that are wanted, on one grid."""

    found: _Found
    modes: Sequence[_Mode]
    inertia: Array


Pick = Callable[[_Found], Sequence[_Mode]]


def volume_coefficients(
    tank: FillableTank,
    depth: float,
    density: float,
    modes: int | ModalCoefficients,
    resolution: VolumeResolution = DEFAULT,
) -> ModalCoefficients:
    """
    Coefficients of the coupling modes of lowest natural frequency.

    Along each axis the grid is refined until that changes nothing in four digits, or it is as
    large as time allows; `error` tells by how much the last steps of all three have changed
    frequencies, inertia, and couplings over the largest of their kind.

    Parameters
    ----------
    tank : FillableTank
        The tank.
    depth : float
        Depth of the liquid [m]; of a full tank see :func:`full_volume_coefficients`.
    density : float
        Density of the liquid [kg/m^3].
    modes : int or ModalCoefficients
        Number of modes; or those of another fill, found by this route, whose likes are wanted.
    resolution : VolumeResolution
        Size of the discrete problem.

    Raises
    ------
    InputError
        If the liquid is not one pool, its surface not closed, or the modes too many.
    """
    liquid = tank.filled(depth)
    count = modes if isinstance(modes, int) else len(modes.names)
    problem = _Problem.of(tank, depth, liquid, resolution, count)
    free = FreeSurface.of(problem.outside.free)
    on_top = np.pad(free.points, ((0, 0), (0, 1)))
    length, width = free.extent

    def lowest(found: _Found) -> list[_Mode]:
        assert isinstance(modes, int)
        # some more, so that the last ones have theirs on another grid, which swaps them
        return _coupling(found.families, problem.whole, modes + _SPARE)

    def likes(found: _Found) -> list[_Mode]:
        assert isinstance(modes, ModalCoefficients)
        among = _lowest(found.families)
        shapes = problem.potentials(found, among).modes(on_top)
        return _likes(among, likeness(modes.surface_shapes, shapes))

    pick = lowest if isinstance(modes, int) else likes
    shortest = half_waves(modes if isinstance(modes, int) else modes.names, length, width)
    cell, error = width / shortest / resolution.cells, None
    if resolution.along is None:
        last, estimate = problem.settled(cell, pick)
        error = estimate if resolution.grids else None
    else:
        assert isinstance(modes, ModalCoefficients)
        last = problem.solved(
            min(cell, problem.cell(float(modes.omega.max()) ** 2 / GRAVITY)), pick
        )
    last = last._replace(modes=last.modes[:count])
    if len(last.modes) < count:
        raise InputError(
            f'only {len(last.modes)} modes of this liquid can be resolved, not {count}; '
            'ask for fewer'
        )
    potentials = problem.potentials(last.found, last.modes)
    friction = _wall_friction(problem.parts[-1][1].wall, potentials)
    shapes = potentials.modes(on_top)
    on_rim = potentials.modes(np.pad(free.rim, ((0, 0), (0, 1))))
    scale = 1.0 / free.highest(shapes, on_rim)
    kappa = np.array([mode.kappa for mode in last.modes])
    coupling = np.array([mode.coupling for mode in last.modes])
    if isinstance(modes, int):
        scale *= free.signs(shapes * scale)
        share = (coupling**2 / problem.whole)[:, [0, 1, 5]]
        alike = np.stack([share.argmax(axis=1) != k for k in (1, 0)], axis=-1)
        odd = np.where(problem.symmetric, potentials.odd, alike)
        lattice = potentials.modes(np.pad(free.lattice[free.inside], ((0, 0), (0, 1))))
        names = free.names(lattice, odd, problem.symmetric)
    else:
        scale *= np.sign(np.diag(likeness(modes.surface_shapes, shapes)))
        names = modes.names
    return ModalCoefficients(
        route='volume',
        density=density,
        liquid=liquid,
        names=names,
        omega=np.sqrt(GRAVITY * kappa),
        mu=density * scale**2 / kappa,  # eq (10)
        coupling=density * scale[:, np.newaxis] * coupling,
        inertia_stokes_joukowski=density * last.inertia,
        wall_friction=friction / (2.0 * kappa),
        surface_points=free.points,
        surface_shapes=shapes * scale,
        surface_gaps=free.gaps,
        crests=np.ones((1, 1, count)),
        potentials=replace(potentials, psi=potentials.psi * scale),
        error=error,
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
    depth : float
        Of the liquid [m].
    resolution : VolumeResolution
        Size of the discrete problem.
    count : int
        Number of modes that errors are told of.
    """

    parts: Sequence[tuple[float, LiquidSurface]]
    outside: LiquidSurface
    symmetric: Parity
    whole: Array
    depth: float
    resolution: VolumeResolution
    count: int

    @classmethod
    def of(
        cls,
        tank: FillableTank,
        depth: float,
        liquid: LiquidAtRest,
        resolution: VolumeResolution,
        count: int,
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
            depth=depth,
            resolution=resolution,
            count=count,
        )

    def grid(self, cell: float, finer: Finer = ONCE) -> tuple[Axis, Axis, Axis]:
        """Grid for waves that need cells of a size [m]."""
        chosen = self.resolution
        return grid_around(
            self.parts[0][1], self.symmetric, cell, chosen.degree, finer, chosen.along
        )

    def cell(self, kappa: float) -> float:
        """Size of the cells that waves need [m]."""
        wave = max(kappa, np.sqrt(kappa / self.depth))  # deep, shallow
        return float(np.pi / wave / self.resolution.cells)

    def fits(self, cell: float, finer: Finer = ONCE) -> bool:
        """Whether a grid has not too many cells."""
        return fits([axis.cells for axis in self.grid(cell, finer)], self.resolution.degree)

    def fitting(self, cell: float) -> float:
        """Size of cells [m], or of larger ones, that can all be refined along one axis."""
        while not all(self.fits(cell, finer) for finer in _ALONG):
            cell *= 1.1
        return cell

    def solved(self, cell: float, pick: Pick, finer: Finer = ONCE) -> _Solved:
        """Solve on a grid."""
        axes = self.grid(cell, finer)
        found = _Found(axes, families(forms(self.parts, axes), self.symmetric))
        inertia = sum((family.inertia for family in found.families), np.zeros((3, 3)))
        return _Solved(found, pick(found), inertia)

    def settled(self, cell: float, pick: Pick) -> tuple[_Solved, float]:
        """Solve on as fine a grid as it takes, from cells of a size [m] on; tells the error."""
        cell = self.fitting(cell)
        last = self.solved(cell, pick)
        flat = self.flat(last, cell, pick)
        if last.modes:
            highest = max(mode.kappa for mode in last.modes[: self.count])
            finer = self.fitting(self.cell(highest))
            if finer < _MUCH * cell:
                cell, last = finer, self.solved(finer, pick)
        last, error = self.refined(last, cell, pick)
        return last, error + flat

    def flat(self, solved: _Solved, cell: float, pick: Pick) -> float:
        """Error that extrapolation may leave of that of flat triangles on a smooth wall."""
        if len(self.parts) == 1:
            return 0.0
        finer_alone = replace(self, parts=[(1.0, self.parts[0][1])])
        return _LEFT * _difference(finer_alone.solved(cell, pick), solved, self.whole, self.count)

    def refined(self, last: _Solved, cell: float, pick: Pick) -> tuple[_Solved, float]:
        """
        Refine along one axis after the other as long as that changes something.

        Tells by how much the last steps, one along each axis, have changed it. Where there was
        no room for one, it is the step that a coarser grid was away.
        """
        finer, changes, left = ONCE, [np.inf] * 3, [0, 1, 2]
        for _ in range(self.resolution.grids):
            if not left:
                break
            k = left.pop(0)
            more = _along(finer, k)
            if not self.fits(cell, more):
                continue
            found = self.solved(cell, pick, more)
            changes[k] = _difference(last, found, self.whole, self.count)
            if changes[k] > _TARGET:
                last, finer = found, more
                left.append(k)
        for k in np.flatnonzero(np.isinf(changes)).tolist() if self.resolution.grids else ():
            coarse = self.solved(cell, pick, _along(finer, k, 1.0 / _FINER))
            changes[k] = _difference(coarse, last, self.whole, self.count)
        return last, sum(changes)

    def potentials(self, found: _Found, modes: Sequence[_Mode]) -> SplinePotentials:
        """Potentials of modes, not yet scaled, and of rotation."""
        count = int(np.prod([axis.functions for axis in found.axes]))
        return SplinePotentials(
            axes=found.axes,
            symmetric=self.symmetric,
            odd=np.array([mode.odd for mode in modes], dtype=bool).reshape(-1, 2),
            rank=np.array([mode.rank for mode in modes], dtype=np.intp),
            psi=np.array([mode.psi for mode in modes]).reshape(-1, count).T,
            rotation_odd=np.array([family.odd for family in found.families]),
            rotation=np.stack([family.rotation for family in found.families], axis=1),
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
        rank=np.zeros(0, dtype=np.intp),
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
    rough = tank.liquid_surface(depth, liquid.volume ** (1.0 / 3.0) / 4.0)
    own = solid_moments(rough.wall).whole
    if abs(own - liquid.volume) <= 1e-9 * abs(own):  # flat walls: as exact as smaller triangles
        return [(1.0, rough)]
    area = float(np.linalg.norm(area_vectors(rough.triangles), axis=1).sum())
    size = np.sqrt(2.0 * area / triangles)
    fine, coarse = (tank.liquid_surface(depth, k * size) for k in (1.0, 2.0))
    own, other = (solid_moments(surface.wall).whole for surface in (fine, coarse))
    if abs(own - other) <= 1e-9 * abs(own):
        return [(1.0, fine)]
    beyond = float(np.clip((liquid.volume - own) / (own - other), 0.0, 0.5))
    return [(1.0 + beyond, fine), (-beyond, coarse)]


def _modes(family: Family, which: Iterable[int]) -> list[_Mode]:
    return [
        _Mode(family.kappa[j], family.coupling[j], family.psi[:, j], family.odd, j) for j in which
    ]


def _coupling(found: Sequence[Family], whole: Array, count: int) -> list[_Mode]:
    """Select the lowest modes that couple, pairs of a body of revolution turned to x and y."""
    modes = []
    for family in found:
        share = family.coupling**2 / whole * family.kappa[:, np.newaxis]
        modes += _modes(family, np.flatnonzero(share.max(axis=1) > COUPLING_SHARE)[: count + 1])
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
    """Combine a pair of one frequency so that one is of surge and one of sway; or leave it."""
    push = np.hypot(a.coupling[1], b.coupling[1])
    if push == 0.0:
        return a, b
    turn = np.array([[b.coupling[1], -a.coupling[1]], [a.coupling[1], b.coupling[1]]]) / push
    surge, sway = _mixed([a, b], turn)
    if not abs(sway.coupling[0]) < _PAIR * push < abs(surge.coupling[0]):
        return a, b  # two modes that happen to be close
    kappa = (a.kappa + b.kappa) / 2.0
    return replace(surge, kappa=kappa), replace(sway, kappa=kappa)


def _mixed(modes: Sequence[_Mode], shares: Array) -> list[_Mode]:
    """Orthogonal combinations of modes of about one frequency, by rows of shares."""
    kappa, coupling, psi = (
        np.array([getattr(mode, part) for mode in modes]) for part in ('kappa', 'coupling', 'psi')
    )
    rows = zip(shares**2 @ kappa, shares @ coupling, shares @ psi, strict=True)
    rank = min(mode.rank for mode in modes)
    return [_Mode(float(k), c, p, modes[0].odd, rank) for k, c, p in rows]


def _lowest(found: Sequence[Family]) -> list[_Mode]:
    """All modes among which the likes of some are looked for."""
    return [
        mode for family in found for mode in _modes(family, range(min(_AMONG, len(family.kappa))))
    ]


def _likes(among: Sequence[_Mode], alike: Array) -> list[_Mode]:
    """
    Select modes that are like given ones.

    Parameters
    ----------
    among : sequence of _Mode
        Of these.
    alike : array, shape (n, k)
        How much each of them is like each given one, -1 to 1.
    """
    rows, columns = linear_sum_assignment(-(alike**2))
    chosen = [among[j] for j in columns]
    alike = alike[np.ix_(rows, columns)]
    done: set[int] = set()
    for i, mode in enumerate(list(chosen)):
        # modes of almost one frequency come out in any mixture
        group = [
            j
            for j, other in enumerate(chosen)
            if j not in done
            and other.odd == mode.odd
            and abs(other.kappa - mode.kappa) < _DEGENERATE * mode.kappa
        ]
        if i in done or len(group) < 2:
            continue
        done.update(group)
        left, _, right = np.linalg.svd(alike[np.ix_(group, group)])
        for j, mixed in zip(group, _mixed([chosen[j] for j in group], left @ right), strict=True):
            chosen[j] = mixed
    return chosen


def _difference(coarse: _Solved, fine: _Solved, whole: Array, count: int) -> float:
    """
    Largest relative difference of frequencies and inertia, and of couplings over the largest.

    These are compared where they do not depend on scale: lambda over the root of mu.
    """
    ours = fine.modes[:count]
    if len(coarse.modes) < len(ours):
        return np.inf
    error = np.abs(coarse.inertia - fine.inertia).max() / np.abs(fine.inertia).max()
    left, twins = list(coarse.modes), []
    for mode in ours:
        alike = [m for m in left if m.odd == mode.odd]
        if not alike:
            return np.inf
        twins.append(min(alike, key=lambda m: abs(m.kappa - mode.kappa)))
        left.remove(twins[-1])
    push = [np.sqrt(mode.coupling**2 * mode.kappa / whole) for mode in ours]
    largest = np.maximum(np.max(push, axis=0, initial=0.0), _LEAST_PUSH)
    for mode in ours:
        # modes of almost one frequency mix: only their sum is sure
        group = [
            (own, other)
            for own, other in zip(ours, twins, strict=True)
            if own.odd == mode.odd and abs(own.kappa / mode.kappa - 1.0) < _MIXING
        ]
        own, other = (
            np.sqrt(sum(m.coupling**2 * m.kappa for m in side) / whole)
            for side in zip(*group, strict=True)
        )
        kappa, twin = (np.mean([m.kappa for m in side]) for side in zip(*group, strict=True))
        error = max(
            error,
            abs(twin / kappa - 1.0) / 2.0,
            float(np.max(np.abs(own - other) / largest)),
        )
    return float(error)
