"""
The same modes of a tank of any shape at every fill.

A mode has a name at the fill that the sweep starts from. At others it is the one whose surface
looks most like it: shapes are compared on rings of points that every free surface has, from one
fill to the next. So a mode stays itself where it is no longer among the lowest.

Where two modes of one parity come close, they do not cross but turn into each other, unless the
shape of the tank keeps them apart. Over a long step they would seem to have crossed. So where a
mode would change its place among those of its parity, or is not alike enough, a fill between is
solved for first, until steps are short: then a mode turns as it does, and what crosses all the
same are modes that hardly know each other.

How fine a grid has to be is tried out at a few fills; those between take as many cells as their
neighbours have needed. That is several times as fast, and what is left of an error goes on
smoothly from fill to fill.
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from slosh_ros.errors import InputError
from slosh_ros.hydro.coefficients import ModalCoefficients, mode_name, mode_numbers
from slosh_ros.hydro.corner_levels import corner_levels
from slosh_ros.hydro.fill_table import FILL_RANGE, Start, angle_at, depth_at
from slosh_ros.hydro.volume import DEFAULT, VolumeResolution, fits, volume_coefficients
from slosh_ros.hydro.volume_modes import SplinePotentials
from slosh_ros.hydro.volume_surface import likeness
from slosh_ros.tank import Capsule, MeshTank

_SURE = 0.8  # likeness of a mode to itself that asks for no fill between
_LEAST = 0.5  # and what it must have
_STEP = 0.03  # [rad] between fills that are no farther apart there is none
_TRY = 0.5  # [rad] between fills at which grids are tried out, at most
_MORE = 6  # modes beyond those wanted, among which the lowest of each kind are looked for
_KINDS = (0, 1, 5)  # couplings with surge, sway and yaw
_COUPLES = 1e-3  # [of the largest] coupling that is one


class VolumeSweep:
    """
    Follows modes over the fill; solutions are kept.

    Parameters
    ----------
    tank : Capsule or MeshTank
        The tank.
    start : Start
        Its modes.
    resolution : VolumeResolution
        Size of the discrete problems.
    first : ModalCoefficients, optional
        The modes at the start, if they are known.
    many : bool
        Whether so many fills will be asked for that grids are tried out at some only.
    """

    def __init__(
        self,
        tank: Capsule | MeshTank,
        start: Start,
        resolution: VolumeResolution = DEFAULT,
        first: ModalCoefficients | None = None,
        many: bool = False,
    ) -> None:
        self._tank, self._start = tank, start
        self._resolution, self._many = resolution, many and resolution.grids > 0
        self._known: dict[float, ModalCoefficients] = {}  # by depth
        if first is not None:
            self._known[start.depth] = first.weighing(1.0)
        self._tried: list[float] = []  # depths at which grids were tried out, rising

    def at(self, depth: float) -> ModalCoefficients:
        """
        Coefficients of the modes for unit density.

        Parameters
        ----------
        depth : float
            Of the liquid [m].

        Raises
        ------
        InputError
            If a mode cannot be followed there.
        """
        if not self._known:
            self._known[self._start.depth] = self._first()
        if self._many and not self._tried:
            self._tried = self._try_grids()
        return self._found(depth)

    def _try_grids(self) -> list[float]:
        """Solve at a few depths as finely as it takes; tells which, rising."""
        low, high = (self._angle(self._tank.depth(ratio)) for ratio in FILL_RANGE)
        corners = [self._angle(corner.depth) for corner in corner_levels(self._tank)]
        angles = {low, high}
        for angle in np.linspace(low, high, int(np.ceil((high - low) / _TRY)) + 1)[1:-1].tolist():
            # at a kink the step to another grid does no harm
            corner = min(corners, key=lambda corner: abs(corner - angle), default=angle)
            angles.add(corner if abs(corner - angle) < _TRY / 4.0 else angle)
        depths = [self._depth(angle) for angle in sorted(angles)]
        for depth in sorted(depths, key=lambda depth: self._apart(depth, self._start.depth)):
            self._found(depth)
        return depths

    def _found(self, depth: float) -> ModalCoefficients:
        while depth not in self._known:
            nearest = min(self._known, key=lambda known: self._apart(known, depth))
            self._go(nearest, depth)
        return self._known[depth]

    def _go(self, begin: float, end: float) -> None:
        """Follow the modes from a known depth, half of the way if the whole is too far."""
        known = self._known[begin]
        resolution, error = self._grid(end)
        # whether they can be followed so far shows on any grid
        quick = resolution if resolution.along else replace(resolution, grids=0)
        found = volume_coefficients(self._tank, end, 1.0, known, quick)
        alike = np.diag(likeness(known.surface_shapes, found.surface_shapes))
        worst = int(alike.argmin())
        sure = alike[worst] >= _SURE and np.array_equal(_ranks(known), _ranks(found))
        if not sure and self._apart(begin, end) > _STEP:
            self._go(begin, self._depth((self._angle(begin) + self._angle(end)) / 2.0))
            return
        if alike[worst] < _LEAST:
            raise InputError(
                f'the mode {known.names[worst]} cannot be followed from a depth of {begin:.4g} m '
                f'to {end:.4g} m; ask for fewer modes'
            )
        if resolution != quick:
            found = volume_coefficients(self._tank, end, 1.0, found, resolution)
        self._known[end] = found if error is None else replace(found, error=error)

    def _grid(self, depth: float) -> tuple[VolumeResolution, float | None]:
        """Size of the discrete problem at a depth, and its error where that is known before."""
        if not self._tried:
            return self._resolution, None
        above = min(max(bisect_left(self._tried, depth), 1), len(self._tried) - 1)
        sides = sorted(self._tried[above - 1 : above + 1], key=lambda d: self._apart(d, depth))
        known = [self._known[side] for side in sides]
        both = np.array([_cells(c) for c in known])
        x, y, z = both.max(axis=0).tolist()
        if not fits((x, y, z), self._resolution.degree):
            x, y, z = both[0].tolist()
        error = max(c.error or 0.0 for c in known)
        return replace(self._resolution, along=(x, y, z)), error

    def _first(self) -> ModalCoefficients:
        """Solve for the modes where they have their names."""
        start = self._start

        def lowest(count: int) -> ModalCoefficients:
            return volume_coefficients(self._tank, start.depth, 1.0, count, self._resolution)

        def of_kind(c: ModalCoefficients, kind: int) -> list[int]:
            push = np.abs(c.coupling[:, kind]) / np.sqrt(c.mu)
            return np.flatnonzero(push > _COUPLES * push.max()).tolist() if push.any() else []

        first = lowest(start.modes)
        if not start.all_kinds:
            return first
        more = lowest(start.modes + _MORE)
        own = np.abs(likeness(first.surface_shapes, more.surface_shapes)).argmax(axis=1).tolist()
        wanted = {kind[0] for kind in (of_kind(more, k) for k in _KINDS) if kind}
        extra = sorted(wanted - set(own))
        if not extra:
            return first
        names = list(first.names)
        for j in extra:
            a, b = mode_numbers(more.names[j])
            while mode_name(a, b) in names:
                a, b = (a + 2, b) if a else (a, b + 2)
            names.append(mode_name(a, b))
        shapes = np.hstack([first.surface_shapes, more.surface_shapes[:, extra]])
        both = replace(first, names=tuple(names), surface_shapes=shapes)
        return volume_coefficients(self._tank, start.depth, 1.0, both, self._resolution)

    def _angle(self, depth: float) -> float:
        return angle_at(depth, self._tank.height)

    def _depth(self, angle: float) -> float:
        return depth_at(angle, self._tank.height)

    def _apart(self, a: float, b: float) -> float:
        return abs(self._angle(a) - self._angle(b))


def _cells(c: ModalCoefficients) -> tuple[int, ...]:
    """Cells of a grid along x, y and z."""
    assert isinstance(c.potentials, SplinePotentials)
    return tuple(axis.cells for axis in c.potentials.axes)


def _ranks(c: ModalCoefficients) -> NDArray[np.intp]:
    """How many modes of its parity are slower than each mode."""
    assert isinstance(c.potentials, SplinePotentials)
    return c.potentials.rank
