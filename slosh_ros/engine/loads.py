"""What the liquid does to the tanks: at one instant, and at many in a row."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from slosh_ros.engine.sample import MotionSample
from slosh_ros.modal.heights import WaveHeights
from slosh_ros.modal.validity import Trust, TrustWatch

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


class Loads:
    """
    What the liquid does to the tanks at one instant.

    Wrenches are force [N] and moment [N m] stacked, in the axes and about the origin of the
    output frame. What is known of the wave is worked out when it is first asked for.

    Attributes
    ----------
    sample : MotionSample
        The sample that led to them, as given; the loads bear its stamp.
    wrenches : array, shape (18,)
        `state`, `wrench` and `total` in a row.
    pressure : array, shape (p,)
        Pressure at the points of `SloshConfig.pressure_points`, less the hydrostatic pressure of
        the level tank at rest [Pa].
    beta : array, shape (n,)
        Modal coordinates of all tanks, tank by tank [m].
    heights, watch : WaveHeights, TrustWatch
        They judge the wave.
    rest : Trust
        The judgement of all but the height of the wave.
    """

    __slots__ = (
        '_at_most', '_elevation', '_trust',
        'beta', 'heights', 'pressure', 'rest', 'sample', 'watch', 'wrenches',
    )  # fmt: skip

    def __init__(
        self,
        sample: MotionSample,
        wrenches: Array,
        pressure: Array,
        beta: Array,
        heights: WaveHeights,
        watch: TrustWatch,
        rest: Trust,
    ) -> None:
        self.sample = sample
        self.wrenches = wrenches
        self.pressure = pressure
        self.beta = beta
        self.heights, self.watch, self.rest = heights, watch, rest
        self._at_most: list[float] | None = None
        self._elevation: float | None = None
        self._trust: Trust | None = None

    @property
    def stamp(self) -> int:
        """Time of the sample [ns]."""
        return self.sample.stamp

    @property
    def state(self) -> Array:
        """Sloshing part without feed-through of acceleration, shape (6,)."""
        return self.wrenches[:6]

    @property
    def wrench(self) -> Array:
        """Sloshing part, eqs (15)-(20), shape (6,): zero for a frozen liquid."""
        return self.wrenches[6:12]

    @property
    def total(self) -> Array:
        """Weight, rigid part with the Stokes-Joukowski inertia, sloshing; shape (6,)."""
        return self.wrenches[12:]

    @property
    def elevation_max(self) -> float:
        """Largest height or depth of the wave against the mean level [m]."""
        if self._elevation is None:
            self._look()
        return self._elevation  # type: ignore[return-value]

    @property
    def trust(self) -> Trust:
        """What takes most of the room of linear theory."""
        if self._trust is None:
            self._look()
        return self._trust  # type: ignore[return-value]

    @property
    def valid(self) -> bool:
        """Whether the motion is mild enough for linear theory."""
        if not self.rest.valid:
            return False
        if self._trust is None and self.watch.mild(self._bounds()):
            return True
        return self.trust.valid

    def rises_above(self, height: float) -> bool:
        """Tell whether the wave is higher or deeper than this [m]; cheap if it is far from it."""
        if self._elevation is None and max(self._bounds()) <= height:
            return False
        return self.elevation_max > height

    def _bounds(self) -> list[float]:
        """Return what the wave in each tank cannot be higher than [m]."""
        if self._at_most is None:
            self._at_most = self.heights.at_most(self.beta).tolist()
        return self._at_most

    def _look(self) -> None:
        heights = self.heights.highest(self.beta)
        self._elevation = max(heights)
        self._trust = max(self.watch.of_wave(heights), self.rest, key=Trust.use)


class Judgements(Protocol):
    """The judgements of instants in a row, of all but the height of the wave."""

    def __getitem__(self, place: int, /) -> Trust: ...


class LoadsBlock:
    """
    The :class:`Loads` of samples in a row, judged by the same watch; arrays have a row a sample.

    Attributes
    ----------
    stamps : list of k ints
        Times of the samples [ns].
    motion : array, shape (k, 9)
        Their :attr:`MotionSample.values`.
    wrenches, pressure, beta : array, shape (k, 18), (k, p), (k, n)
        As of :class:`Loads`.
    """

    def __init__(
        self,
        stamps: Sequence[int],
        motion: Array,
        wrenches: Array,
        pressure: Array,
        beta: Array,
        heights: WaveHeights,
        watch: TrustWatch,
        rest: Judgements,
        mild: BoolArray,
    ) -> None:
        self.stamps = stamps
        self.motion = motion
        self.wrenches = wrenches
        self.pressure = pressure
        self.beta = beta
        self._heights, self._watch = heights, watch
        self._rest, self._mild = rest, mild  # where it holds, `rest` is valid

    @classmethod
    def gather(cls, loads: Sequence[Loads]) -> Iterator[LoadsBlock]:
        """Put loads of one sample each into blocks, a new one wherever the liquid changes."""
        for _, same in itertools.groupby(loads, key=lambda one: id(one.watch)):
            rows = list(same)
            yield cls(
                [one.stamp for one in rows],
                np.array([one.sample.values for one in rows]),
                np.array([one.wrenches for one in rows]),
                np.array([one.pressure for one in rows]),
                np.array([one.beta for one in rows]),
                rows[0].heights,
                rows[0].watch,
                [one.rest for one in rows],
                np.array([one.rest.valid for one in rows]),
            )

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.stamps)

    def __getitem__(self, place: int) -> Loads:
        """Return the loads of one sample."""
        return Loads(
            MotionSample.of(self.stamps[place], tuple(self.motion[place].tolist())),
            self.wrenches[place],
            self.pressure[place],
            self.beta[place],
            self._heights,
            self._watch,
            self._rest[place],
        )

    def __iter__(self) -> Iterator[Loads]:
        """Iterate over the loads of one sample after the other."""
        return (self[place] for place in range(len(self)))

    @property
    def wrench(self) -> Array:
        """Sloshing part, eqs (15)-(20), shape (k, 6)."""
        return self.wrenches[:, 6:12]

    @property
    def total(self) -> Array:
        """Weight, rigid part with the Stokes-Joukowski inertia, sloshing; shape (k, 6)."""
        return self.wrenches[:, 12:]

    @property
    def elevation_max(self) -> Array:
        """Largest height or depth of the wave against the mean level, shape (k,) [m]."""
        return self._heights.highest_of_all(self.beta)

    @cached_property
    def valid(self) -> BoolArray:
        """Whether the motion is mild enough for linear theory, shape (k,)."""
        valid = self._mild & self._watch.all_mild(self._at_most)
        for place in np.flatnonzero(~valid).tolist():
            valid[place] = self[place].valid
        return valid

    def highest_above(self, height: float) -> float:
        """Return the height of the highest wave if it is above this, else this [m]."""
        doubtful = self.beta[self._at_most.max(axis=1) > height]
        if not len(doubtful):
            return height
        return max(height, float(self._heights.highest_of_all(doubtful).max()))

    @cached_property
    def _at_most(self) -> Array:
        """What the wave in each tank cannot be higher than, shape (k, tanks) [m]."""
        return self._heights.at_most(self.beta)
