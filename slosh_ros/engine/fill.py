"""
The liquid of a tank whose fill changes while the vehicle drives.

What a change does to the motion. In the tank, the surface height beta and the momentum mu beta'
of a mode are canonical: rho times the integral of the surface potential times f dS is mu beta'.
Liquid that leaves or arrives at the speed of the liquid around it changes neither the surface nor
the potential. So both stay: beta' changes as 1/mu does, and going back undoes it exactly. Under
slow changes a free mode then keeps its action, energy over frequency (Hamilton's equations with a
parameter that varies slowly): with E = mu omega^2 beta^2/2 its amplitude goes as
(mu omega)^(-1/2), which is Green's law where the liquid is shallow. Keeping beta' instead would
let amplitudes grow as a tank drains.

The force jumps by what the liquid's own change explains, in proportion to it: mass, centroid and
stiffness are others.

Where the modes fade, beyond `FILL_RANGE`, liquid and momentum fade together, and beta' stays. An
empty or full tank has no waves; what comes after that starts at rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from slosh_ros.apart import apart
from slosh_ros.engine.config import TankConfig
from slosh_ros.engine.model import TankModel
from slosh_ros.errors import InputError
from slosh_ros.hydro import ModalCoefficients, coefficients_of
from slosh_ros.hydro.fill_table import FILL_RANGE, FillTable, Start, still
from slosh_ros.hydro.routes import by_volume
from slosh_ros.hydro.table_cache import known_sweep, known_table
from slosh_ros.tank import (
    Capsule,
    KnownLiquid,
    MeshTank,
    Rectangle,
    Tank,
    UniformTank,
    UprightCylinder,
)

if TYPE_CHECKING:
    from slosh_ros.hydro.volume_sweep import VolumeSweep

Array = NDArray[np.float64]
Solved = tuple[tuple[str, ...], FillTable]
P = ParamSpec('P')
T = TypeVar('T')

HALF = 0.5  # fill of which the modes are taken where the tank itself has none
_COUPLINGS = (0, 1, 5)  # surge, sway, yaw: the lowest mode of each is always among the modes


@dataclass
class Books:
    """
    Liquid that came and went.

    Attributes
    ----------
    first : float
        Mass at first [kg].
    received, released : float
        Mass that came in and that went out since [kg].
    """

    first: float
    received: float = 0.0
    released: float = 0.0

    @property
    def mass(self) -> float:
        """Mass that must be there [kg]."""
        return self.first + self.received - self.released

    def enter(self, change: float) -> None:
        """Write down a change of the mass [kg]."""
        if change > 0.0:
            self.received += change
        else:
            self.released -= change


class LiveFill:
    """
    Coefficients of the liquid in a tank at any fill, for the same modes.

    Parameters
    ----------
    config : TankConfig
        The tank, as configured.
    start : ModalCoefficients
        Of the liquid in it at first.
    """

    def __init__(self, config: TankConfig, start: ModalCoefficients) -> None:
        self.config, self._start = config, start
        self._names: tuple[str, ...] = start.names
        self._table: FillTable | None = None
        self._no_table: InputError | None = None
        self._sign: Array = np.ones(len(start.names))
        self._followed: VolumeSweep | None = None
        self._alone: tuple[float, ModalCoefficients] | None = None
        self._gave_alone = False

    @property
    def changeable(self) -> bool:
        """Whether the fill can be changed: of all but files of added mass."""
        return not isinstance(self.config.tank, KnownLiquid)

    @property
    def ready(self) -> bool:
        """Whether another fill takes no more than some milliseconds."""
        return _upright(self.config.tank) or self._table is not None

    def knows(self, fill_ratio: float) -> bool:
        """Whether a fill takes no more than some milliseconds."""
        alone = self._alone is not None and self._alone[0] == fill_ratio
        return self.ready or alone or fill_ratio == 0.0

    @property
    def outdated(self) -> bool:
        """Whether the coefficients given last were solved for alone, and are now tabulated."""
        return self._gave_alone and self._table is not None

    @property
    def error(self) -> float:
        """Largest relative error of what is interpolated, against solutions; 0 of closed forms."""
        return self._table.error if self._table is not None else 0.0

    @property
    def solution_error(self) -> float:
        """Largest relative error that these solutions tell of; 0 where they tell of none."""
        return self._table.solution_error if self._table is not None else 0.0

    def prepare(self, elsewhere: bool = False) -> None:
        """
        Solve for the fills between which is interpolated; takes seconds, in any thread.

        Parameters
        ----------
        elsewhere : bool
            Whether a process of its own does it, so that other threads go on meanwhile.

        Raises
        ------
        InputError
            If the liquid cannot be computed at some fill.
        """
        config = self.config
        if not self.changeable:
            raise InputError(
                f'the fill of {config.name} cannot change while it runs: the added mass of '
                f'{config.name}.added_mass_file is that of one fill; start again with the file '
                'of another'
            )
        if _upright(config.tank):
            self.at(HALF)  # imports what an empty tank did not need
        if self.ready:
            return
        if self._no_table is not None:
            raise self._no_table
        try:
            self._names, table = _tried(
                config.name, apart if elsewhere else _here,
                _solved_for, config, self._start.names, self._first,
            )  # fmt: skip
        except InputError as error:
            self._no_table = error
            raise
        n = len(self._start.names)
        self._sign = np.ones(len(self._names))
        # to have read once imports what later readings need
        same = table.at(self._start.liquid.fill_ratio if n else HALF, config.density)
        if n:
            alike = np.sum(same.surface_shapes[:, :n] * self._start.surface_shapes, axis=0)
            self._sign[:n] = np.sign(alike)
        self._table = table

    def solve_alone(self, fill_ratio: float) -> None:
        """
        Solve for one fill, which :meth:`at` takes until all are known; in any thread.

        It is done by a process of its own, from the last fill that was solved for. Of tanks by
        other routes than the 3-D one, all fills together do not take much longer: they are solved
        for one by one, in this thread, only where there is no table.

        Parameters
        ----------
        fill_ratio : float
            Fraction of the volume, 0 to 1.

        Raises
        ------
        InputError
            If the liquid cannot be computed there, or only together with other fills.
        """
        if self.knows(fill_ratio):
            return
        in_space = by_volume(self.config.tank)
        if not in_space and self._no_table is None:
            raise InputError(
                f'the liquid of {self.config.name} is solved for at all fills together'
            )
        low, high = FILL_RANGE
        if not (low <= fill_ratio <= high or fill_ratio in (0.0, 1.0)):
            raise InputError(
                f'the liquid of {self.config.name} at a fill of {fill_ratio:g} is not solved for: '
                f'a fill must be 0, 1, or between {low:g} and {high:g}'
            )
        known = self._start
        if self._alone is not None and self._alone[1].names:
            known = self._alone[1]
        do = apart if in_space else _here  # solutions of sections cannot be sent
        found = _tried(self.config.name, do, _solved_alone, self.config, known, fill_ratio)
        self._alone = fill_ratio, found

    def at(self, fill_ratio: float) -> tuple[ModalCoefficients, float]:
        """
        Coefficients at a fill, and which share of them has not faded towards an end.

        They are interpolated; solved for where fills cannot be tabulated, or not yet are.

        Parameters
        ----------
        fill_ratio : float
            Fraction of the volume, 0 to 1.
        """
        config = self.config
        if not self.changeable:
            self.prepare()
        self._gave_alone = False
        if fill_ratio == 0.0 or (fill_ratio == 1.0 and _upright(config.tank)):
            return still(config.tank, fill_ratio, config.density), 1.0
        if _upright(config.tank):
            depth = config.tank.depth(fill_ratio)
            return coefficients_of(config.tank, depth, config.density, config.modes), 1.0
        alone = self._alone
        if self._table is None and alone is not None and alone[0] == fill_ratio:
            self._gave_alone = True
            return alone[1], 1.0
        try:
            self.prepare()
        except InputError:
            low, high = FILL_RANGE
            if low <= fill_ratio <= high or fill_ratio == 1.0:
                return self.solved(fill_ratio), 1.0
            raise
        assert self._table is not None
        if fill_ratio == 1.0:
            return self._table.at(fill_ratio, config.density), 1.0
        low, high = FILL_RANGE
        share = min(1.0, fill_ratio / low, (1.0 - fill_ratio) / (1.0 - high))
        return self._table.at(fill_ratio, config.density).turned(self._sign), share

    def solved(self, fill_ratio: float) -> ModalCoefficients:
        """Coefficients at a fill as :meth:`at` gives them, but solved for where it can be."""
        low, high = FILL_RANGE
        if fill_ratio in (0.0, 1.0):
            return still(self.config.tank, fill_ratio, self.config.density)
        if not low <= fill_ratio <= high:
            return self.at(fill_ratio)[0]
        config, names = self.config, self._start.names
        depth = config.tank.depth(fill_ratio)
        if by_volume(config.tank):
            if self._followed is None:
                from slosh_ros.hydro.volume_sweep import VolumeSweep

                self._followed = VolumeSweep(
                    config.tank,
                    replace(self._first, all_kinds=False),
                    first=self._start if names else None,
                )
            return self._followed.at(depth).weighing(config.density)
        if not names:
            half = config.tank.depth(HALF)
            names = coefficients_of(config.tank, half, config.density, config.modes).names
        return coefficients_of(config.tank, depth, config.density, names)

    @property
    def _first(self) -> Start:
        """Where the modes of a tank of any shape have their names."""
        config, start = self.config, self._start
        one_by_one = config.damping is not None and config.damping.size > 1
        if start.names:
            return Start(len(start.names), start.liquid.depth, not one_by_one)
        return Start(config.modes, config.tank.depth(HALF), not one_by_one)


def carried_over(old: TankModel, new: TankModel, settled: Array) -> Array:
    """
    Motion of the modes after a change of the fill.

    Parameters
    ----------
    old, new : TankModel
        Before and after; modes of one name are the same.
    settled : array, shape (n,)
        beta of the settled liquid after [m]: where modes start that were not there before.

    Returns
    -------
    array, shape (2, n)
        beta [m] and beta' [m/s].
    """
    before, after = old.coefficients, new.coefficients
    motion = np.zeros((2, len(after.names)))
    if not before.names:
        return motion
    beta, beta_rate = old.beta, old.beta_rate
    place = {name: j for j, name in enumerate(before.names)}
    for j, name in enumerate(after.names):
        i = place.get(name)
        if i is None:
            motion[0, j] = settled[j]
        else:
            inertia = (before.mu[i] / old.share_left) / (after.mu[j] / new.share_left)
            motion[:, j] = beta[i], beta_rate[i] * inertia
    return motion


def checked_ratio(name: str, ratio: object, tanks: Sequence[str]) -> float:
    """
    Return a fill ratio that may be set.

    Raises
    ------
    InputError
        If there is no such tank, or the ratio is none.
    """
    if name not in tanks:
        raise InputError(f'there is no tank {name}; there is {", ".join(tanks)}')
    if isinstance(ratio, bool) or not isinstance(ratio, (int, float)):
        raise InputError(f'the fill of {name} is {ratio!r}; it must be a ratio from 0 to 1')
    if not (math.isfinite(ratio) and 0.0 <= ratio <= 1.0):
        raise InputError(f'the fill of {name} is {ratio:g}; it must be a ratio from 0 to 1')
    return float(ratio)


def _upright(tank: Tank) -> bool:
    """Whether the closed forms give every fill at once."""
    return isinstance(tank, UprightCylinder) or (
        isinstance(tank, UniformTank) and isinstance(tank.section, Rectangle)
    )


def _here(function: Callable[P, T], *arguments: P.args, **keywords: P.kwargs) -> T:
    """Call a function in this process."""
    return function(*arguments, **keywords)


def _tried(
    name: str,
    do: Callable[..., T],
    function: Callable[P, T],
    *arguments: P.args,
    **keywords: P.kwargs,
) -> T:
    """Compute something of the liquid in a tank; whatever goes wrong is an InputError."""
    try:
        return do(function, *arguments, **keywords)
    except InputError:
        raise
    except (ArithmeticError, MemoryError, RuntimeError, ValueError) as error:
        raise InputError(
            f'the liquid of {name} at other fills could not be computed: {error}'
        ) from error


def _solved_alone(
    config: TankConfig, known: ModalCoefficients, fill_ratio: float
) -> ModalCoefficients:
    """Solve for one fill by itself."""
    return LiveFill(config, known).solved(fill_ratio)


def _solved_for(config: TankConfig, names: tuple[str, ...], first: Start) -> Solved:
    """Find modes, those a tank has at first among them, and their table over the fill."""
    points = np.array(list(config.pressure_points.values())).reshape(-1, 3)
    about = tuple(map(tuple, points.tolist()))
    if by_volume(config.tank):
        table = _sweep(config.tank, first, about)
        return table.names, table
    names = _all_names(config, names)
    return names, _table(config.tank, names, about)


def _all_names(config: TankConfig, names: tuple[str, ...]) -> tuple[str, ...]:
    """Names of the modes at first and the half-full tank's first of each kind."""
    half = coefficients_of(config.tank, config.tank.depth(HALF), config.density, config.modes)
    if not names:
        return half.names
    if config.damping is not None and config.damping.size > 1:
        return names  # one number a mode: there are none for more
    first = [
        half.names[int(np.flatnonzero(half.coupling[:, k])[0])]
        for k in _COUPLINGS
        if half.coupling[:, k].any()
    ]
    return names + tuple(name for name in dict.fromkeys(first) if name not in names)


@lru_cache(maxsize=16)
def _table(tank: Tank, names: tuple[str, ...], points: tuple[tuple[float, ...], ...]) -> FillTable:
    """Find the table of a tank once in a process; it is the same for any density."""
    return known_table(tank, names, np.array(points).reshape(-1, 3))


@lru_cache(maxsize=16)
def _sweep(
    tank: Capsule | MeshTank, start: Start, points: tuple[tuple[float, ...], ...]
) -> FillTable:
    """Find the same where modes are followed from a fill."""
    return known_sweep(tank, start, np.array(points).reshape(-1, 3))
