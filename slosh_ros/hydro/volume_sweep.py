"""
The same modes of a tank of any shape at every fill.

A mode has a name at the fill that the sweep starts from. At others it is the one whose surface
looks most like it: shapes are compared on rings of points that every free surface has, from one
fill to the next. Where they are not alike enough, a fill between is solved for first. So a mode
stays itself where its frequency crosses that of another one, and where it is no longer among the
lowest.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from slosh_ros.errors import InputError
from slosh_ros.hydro.coefficients import ModalCoefficients, mode_name, mode_numbers
from slosh_ros.hydro.fill_table import Start
from slosh_ros.hydro.volume import DEFAULT, FillableTank, VolumeResolution, volume_coefficients
from slosh_ros.hydro.volume_surface import likeness

_SURE = 0.8  # likeness of a mode to itself that asks for no fill between
_LEAST = 0.5  # and what it must have
_STEP = 0.03  # [rad] between fills that are no farther apart there is none
_MORE = 6  # modes beyond those wanted, among which the lowest of each kind are looked for
_KINDS = (0, 1, 5)  # couplings with surge, sway and yaw
_COUPLES = 1e-3  # [of the largest] coupling that is one


class VolumeSweep:
    """
    Follows modes over the fill; solutions are kept.

    Parameters
    ----------
    tank : FillableTank
        The tank.
    height : float
        Of the tank [m].
    start : Start
        Its modes.
    resolution : VolumeResolution
        Size of the discrete problems.
    first : ModalCoefficients, optional
        The modes at the start, if they are known.
    """

    def __init__(
        self,
        tank: FillableTank,
        height: float,
        start: Start,
        resolution: VolumeResolution = DEFAULT,
        first: ModalCoefficients | None = None,
    ) -> None:
        self._tank, self._height, self._start = tank, height, start
        self._resolution = resolution
        self._known = {} if first is None else {start.depth: first.weighing(1.0)}  # by depth

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
        while depth not in self._known:
            nearest = min(self._known, key=lambda known: self._apart(known, depth))
            self._go(nearest, depth)
        return self._known[depth]

    def _go(self, begin: float, end: float) -> None:
        """Follow the modes from a known depth, half of the way if the whole is too far."""
        known = self._known[begin]
        found = volume_coefficients(self._tank, end, 1.0, known, self._resolution)
        alike = np.diag(likeness(known.surface_shapes, found.surface_shapes))
        worst = int(alike.argmin())
        if alike[worst] < _SURE and self._apart(begin, end) > _STEP:
            middle = self._height * np.sin((self._angle(begin) + self._angle(end)) / 4.0) ** 2
            self._go(begin, float(middle))
        elif alike[worst] < _LEAST:
            raise InputError(
                f'the mode {known.names[worst]} cannot be followed from a depth of {begin:.4g} m '
                f'to {end:.4g} m; ask for fewer modes'
            )
        else:
            self._known[end] = found

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
        return float(2.0 * np.arcsin(np.sqrt(depth / self._height)))

    def _apart(self, a: float, b: float) -> float:
        return abs(self._angle(a) - self._angle(b))
