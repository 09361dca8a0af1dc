"""
How far to trust linear theory: what of its room is used up, by which effect.

Each criterion is a number over its limit. Beyond one of them the loads go on, marked as not valid.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import Enum
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.hydro import ModalCoefficients
from slosh_ros.hydro.fill_table import FADING, FILL_RANGE
from slosh_ros.tank import Tank

Array = NDArray[np.float64]

# Wave height over the smaller of depth and freeboard. Two-phase CFD (shared/data/cfd): a shallow
# rectangle, depth a tenth of its length, is off linear theory by 2.6 % rms at 0.18 and by 23 % at
# 0.91; a half-full cylinder, depth a fifth of its length, by 4 % at 0.36.
WAVE_LIMIT, WAVE_LIMIT_SHALLOW = 0.4, 0.3
# Depth over the length of the surface. Faltinsen & Timokha (2009), Sloshing, ch. 8: below 0.15 or
# so a long train of modes is excited nonlinearly, and hydraulic jumps come with small motions.
SHALLOW = 0.15
# Below this even gentle motions make bores: the CFD at 0.1 is the shallowest seen to agree.
SHALLOW_LIMIT = 0.03
# Slope of the wave, k times its height. The CFD cylinder reaches 0.24; in the tank of Faltinsen et
# al. (2000), J. Fluid Mech. 407, fig. 7, linear theory reaches 0.34 and is 40 % rms off the wave.
SLOPE_LIMIT = 0.25
# By how much the surface may grow or shrink where walls are not upright; theory keeps its edge.
SURFACE_CHANGE = 0.25
# (k height)^2 times the amplification over the quasi-static height. At resonance a third-order
# effect limits what linear theory lets grow: the amplification is (k height)^-2 by the order of
# magnitude (Moiseev's detuning; Faltinsen & Timokha 2009, ch. 8).
RESONANCE_LIMIT = 1.0
RESONANCE_MEMORY = 5.0  # [periods] of the slowest mode: how long a forcing is remembered
AMPLIFICATION_MAX = 30.0  # an ideal liquid rings on for ever: no more than this is held against it
# Centripetal acceleration at the tank's end over g: theory has it only at O (THEORY 2.1).
SPIN_LIMIT = 0.1
_EDGE = 1e-9  # by which the fill may be off the edge of the range for rounding
_TINY = float(np.finfo(float).tiny)
_NEVER = math.log(_TINY)  # logarithm of a height that is none
_CLEARLY = 1.0 - 1e-9  # below a limit, whatever rounds


class Criterion(Enum):
    """What linear theory needs to be small; the value says it to people."""

    WAVE = 'wave height over depth or freeboard'
    SLOPE = 'slope of the wave'
    WALL = 'wave height over what the sloping walls allow'
    RESONANCE = 'wave near resonance (steepness squared times amplification)'
    SHALLOW = 'shallow liquid: least depth over depth'
    FILM = 'film or bubble: least share of liquid or air over the share that is there'
    SPIN = 'rotation: centripetal acceleration at the end of the tank over g'


class Trust(NamedTuple):
    """
    The criterion of which the most is used up.

    Attributes
    ----------
    criterion : Criterion
        Which one.
    value, limit : float
        Where it stands, and where linear theory ends [-].
    """

    criterion: Criterion
    value: float
    limit: float

    def use(self) -> float:
        """Value over limit; beyond 1 linear theory is left."""
        return self.value / self.limit

    @property
    def valid(self) -> bool:
        """Whether the motion is mild enough for linear theory."""
        return self.value <= self.limit

    def __str__(self) -> str:
        """Tell criterion, value and limit."""
        return f'{self.criterion.value} is {self.value:.2g}, limit {self.limit:.2g}'


class TrustWatch:
    """
    Follows the motion in the tanks of a vehicle.

    Parameters
    ----------
    liquids : sequence of (Tank, ModalCoefficients)
        Tanks and the liquid in each.
    """

    def __init__(self, liquids: Sequence[tuple[Tank, ModalCoefficients]]) -> None:
        lengths, self._waves, shallowest = [0.0], [], 0.0
        for tank, c in liquids:
            length = float(np.ptp(c.surface_points, axis=0).max()) if len(c.omega) else 0.0
            lengths.append(length)
            self._waves.append(_wave_criterion(tank, c, length))
            if length:
                shallowest = max(shallowest, SHALLOW_LIMIT * length / c.liquid.depth)
        films = [_film(c) for _, c in liquids]
        self._shallow = max(
            Trust(Criterion.SHALLOW, shallowest, 1.0),
            Trust(Criterion.FILM, max(films, default=0.0), 1.0),
            key=Trust.use,
        )
        self._least = self._shallow.use()
        self._reach = max(lengths) / 2.0 / GRAVITY
        # modes of all tanks
        self._over_square = np.concatenate([1.0 / c.omega**2 for _, c in liquids])
        self._wave_number = np.concatenate(
            [wave_numbers(c.omega, c.liquid.depth) for _, c in liquids]
        )
        slowest = [np.full(len(c.omega), c.omega.min(initial=np.inf)) for _, c in liquids]
        self._forget = np.concatenate(slowest) / (-2.0 * math.pi * RESONANCE_MEMORY)
        # Quasi-static heights fade as exp(fading), fading = forget * time. The largest so faded is
        # that of the logarithms of largest log(height) - fading, whose order time does not change.
        self._driven: Array = np.full(len(self._over_square), _NEVER)
        self._time = 0.0  # [s]

    def resume(self, other: TrustWatch) -> None:
        """Take over what has driven the same modes at another fill."""
        if other._driven.shape == self._driven.shape:
            self._driven[:], self._time = other._driven + other._forget * other._time, 0.0

    def start(self) -> None:
        """Forget what has driven the liquid."""
        self._driven[:], self._time = _NEVER, 0.0

    def judge(
        self,
        heights: Sequence[float],
        envelope: Array,
        driving: Array,
        interval: float,
        rate_square: float,
    ) -> Trust:
        """
        Look at one instant.

        Parameters
        ----------
        heights : sequence of floats
            Greatest wave height in each tank [m].
        envelope : array, shape (n,)
            Amplitudes of the modes of all tanks, motion and rate together [m].
        driving : array, shape (n,)
            Modal forcing per modal mass [m/s^2].
        interval : float
            Time since the last look [s].
        rate_square : float
            Square of the angular rate [rad^2/s^2].
        """
        rest = self.follow(envelope, driving, interval, rate_square)
        return max(self.of_wave(heights), rest, key=Trust.use)

    def of_wave(self, heights: Sequence[float]) -> Trust:
        """Judge the greatest wave height in each tank [m]."""
        waves = (
            Trust(criterion, height * scale, limit)
            for height, (criterion, scale, limit) in zip(heights, self._waves, strict=True)
        )
        return max(waves, key=Trust.use)

    def mild(self, heights: Sequence[float]) -> bool:
        """Tell whether `of_wave` of such heights is valid."""
        pairs = zip(heights, self._waves, strict=True)
        return all(height * scale <= limit for height, (_, scale, limit) in pairs)

    def all_mild(self, heights: Array) -> NDArray[np.bool_]:
        """Tell for each row of heights, shape (k, tanks) [m], whether it is `mild`."""
        scales, limits = np.array([wave[1:] for wave in self._waves]).T
        return np.asarray(np.all(heights * scales <= limits, axis=1))

    def mild_rest(
        self,
        steepness: Array,
        envelope: Array,
        driven: Array,
        fading: Array,
        rate_squares: Array,
    ) -> NDArray[np.bool_]:
        """Tell for each of k rows whether `worst` is clearly valid; False decides nothing."""
        slope = steepness.max(axis=1, initial=0.0)
        spin = rate_squares * self._reach
        mild = (slope < _CLEARLY * SLOPE_LIMIT) & (spin < _CLEARLY * SPIN_LIMIT)
        mild &= self._shallow.valid
        doubtful = mild & (slope**2 * AMPLIFICATION_MAX >= _CLEARLY * RESONANCE_LIMIT)
        if doubtful.any():
            floor = np.maximum(np.exp(driven[doubtful] + fading[doubtful]), _TINY)
            amplified = np.minimum(envelope[doubtful], AMPLIFICATION_MAX * floor) / floor
            near = np.max(steepness[doubtful] ** 2 * amplified, axis=1, initial=0.0)
            mild[doubtful] = near < _CLEARLY * RESONANCE_LIMIT
        return np.asarray(mild)

    def follow(
        self, envelope: Array, driving: Array, interval: float, rate_square: float
    ) -> Trust:
        """Look at one instant, as `judge` does, for all but the height of the waves."""
        self._time += interval
        fading = self._forget * self._time
        np.maximum(self._driven, self._logarithm(driving) - fading, out=self._driven)
        steepness: list[float] = (envelope * self._wave_number).tolist()
        return self.worst(steepness, envelope, self._driven, fading, rate_square)

    def follow_all(
        self, envelope: Array, driving: Array, intervals: Sequence[float], rate_squares: Array
    ) -> Instants:
        """Look at k instants, one after the other, as `follow` does; arrays of shape (k, n)."""
        times = np.cumsum([self._time, *intervals])[1:]
        fading = self._forget * times[:, np.newaxis]
        driven = self._logarithm(driving) - fading
        np.maximum(driven[0], self._driven, out=driven[0])
        np.maximum.accumulate(driven, axis=0, out=driven)
        self._time, self._driven = float(times[-1]), driven[-1].copy()
        return Instants(self, envelope * self._wave_number, envelope, driven, fading, rate_squares)

    def _logarithm(self, driving: Array) -> Array:
        """Logarithm of the quasi-static height under a forcing."""
        static = np.abs(driving)
        static *= self._over_square
        static += _TINY
        return np.asarray(np.log(static, out=static))

    def worst(
        self,
        steepness: list[float],
        envelope: Array,
        driven: Array,
        fading: Array,
        rate_square: float,
    ) -> Trust:
        """Judge an instant by steepness and envelope of the modes, what drove them, the spin."""
        worst, use = self._shallow, self._least
        slope = max(steepness, default=0.0)
        if slope / SLOPE_LIMIT > use:
            worst, use = Trust(Criterion.SLOPE, slope, SLOPE_LIMIT), slope / SLOPE_LIMIT
        # near resonance few modes matter: those that would if amplified as much as may be
        if slope**2 * AMPLIFICATION_MAX / RESONANCE_LIMIT > use:
            for mode, steep in enumerate(steepness):
                if steep**2 * AMPLIFICATION_MAX / RESONANCE_LIMIT > use:
                    floor = max(math.exp(driven[mode] + fading[mode]), _TINY)
                    amplified = min(float(envelope[mode]), AMPLIFICATION_MAX * floor) / floor
                    near = steep**2 * amplified
                    if near / RESONANCE_LIMIT > use:
                        worst = Trust(Criterion.RESONANCE, near, RESONANCE_LIMIT)
                        use = near / RESONANCE_LIMIT
        spin = rate_square * self._reach
        if spin / SPIN_LIMIT > use:
            worst = Trust(Criterion.SPIN, spin, SPIN_LIMIT)
        return worst


class Instants:
    """
    What a watch sees of instants in a row; each is judged when it is asked for.

    Parameters
    ----------
    watch : TrustWatch
        The watch.
    steepness, envelope, driven, fading : array, shape (k, n)
        As `TrustWatch.worst` takes them.
    rate_squares : array, shape (k,)
        Square of the angular rate [rad^2/s^2].
    """

    def __init__(
        self,
        watch: TrustWatch,
        steepness: Array,
        envelope: Array,
        driven: Array,
        fading: Array,
        rate_squares: Array,
    ) -> None:
        self._watch = watch
        self._seen = steepness, envelope, driven, fading, rate_squares
        self.mild = watch.mild_rest(*self._seen)
        """Where the judgement is clearly valid, shape (k,); elsewhere it may be or not."""

    def __getitem__(self, place: int) -> Trust:
        """Return the judgement of one instant."""
        steepness, envelope, driven, fading, rate_squares = self._seen
        return self._watch.worst(
            steepness[place].tolist(),
            envelope[place],
            driven[place],
            fading[place],
            float(rate_squares[place]),
        )


def _film(coefficients: ModalCoefficients) -> float:
    """Least share of liquid or air that the solver holds over the share that is there."""
    ratio = coefficients.liquid.fill_ratio
    if coefficients.route != FADING or not 0.0 < ratio < 1.0:
        return 0.0
    return max(FILL_RANGE[0] / ratio, (1.0 - FILL_RANGE[1]) / (1.0 - ratio)) - _EDGE


def _wave_criterion(
    tank: Tank, coefficients: ModalCoefficients, length: float
) -> tuple[Criterion, float, float]:
    """Which criterion holds a wave, its value per wave height, and the limit."""
    if not length:
        return Criterion.WAVE, 0.0, WAVE_LIMIT  # empty or full: nothing sloshes
    liquid = coefficients.liquid
    room = min(liquid.depth, liquid.freeboard)
    limit = WAVE_LIMIT if liquid.depth / length > SHALLOW else WAVE_LIMIT_SHALLOW
    walls = surface_room(tank, liquid.depth)
    # both are wave heights: the smaller one decides
    if walls < limit * room:
        return Criterion.WALL, 1.0 / walls, 1.0
    return Criterion.WAVE, 1.0 / room, limit


UNMOVED = Trust(Criterion.WAVE, 0.0, WAVE_LIMIT)


def wave_numbers(omega: Array, depth: float) -> Array:
    """Wave numbers k of plane waves of these frequencies, omega^2 = g k tanh(k d) [1/m]."""
    target = omega**2 * depth / GRAVITY
    x = np.sqrt(target) * np.maximum(1.0, np.sqrt(target))
    for _ in range(30):  # Newton on x tanh x = target; x is never far below the root
        t = np.tanh(x)
        x -= (x * t - target) / (t + x * (1.0 - t**2))
    return np.asarray(x / depth)


def surface_room(tank: Tank, depth: float) -> float:
    """
    Wave height that makes the surface larger or smaller by `SURFACE_CHANGE` [m].

    Infinite if no wave within the tank does: between upright walls.
    """
    step = 1e-4 * tank.height

    def surface(level: float) -> float:
        top, bottom = min(level + step, tank.height), max(level - step, 0.0)
        return (tank.fill_ratio(top) - tank.fill_ratio(bottom)) / (top - bottom)

    at_rest = surface(depth)
    rooms = [math.inf]
    for way, end in ((1.0, tank.height - depth), (-1.0, depth)):

        def change(wave: float, way: float = way) -> float:
            return abs(surface(depth + way * wave) / at_rest - 1.0) - SURFACE_CHANGE

        if change(end) > 0.0:
            rooms.append(float(scipy.optimize.brentq(change, 0.0, end, xtol=1e-3 * end)))
    return min(rooms)
