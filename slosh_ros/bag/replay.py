"""Replaying a recorded drive through the engine."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from slosh_ros.bag.reader import Block, MotionBag
from slosh_ros.bag.writer import LoadsWriter
from slosh_ros.engine import Loads, LoadsBlock, SloshEngine, feed_message
from slosh_ros.engine.convert import feed_readings
from slosh_ros.errors import InputError
from slosh_ros.modal.validity import Criterion, Trust
from slosh_ros.monitor import RolloverMonitor
from slosh_ros.vehicle.rollover import Rollover

Array = NDArray[np.float64]

_BLOCK = 256  # samples that are fed at once


class Peaks:
    """
    Largest magnitudes, in constant memory.

    Parameters
    ----------
    engine : SloshEngine
        Whose loads they are.
    """

    def __init__(self, engine: SloshEngine) -> None:
        self._largest: Array = np.zeros(12 + len(engine.config.pressure_points))
        self.elevation_max = 0.0
        self.beyond: dict[Criterion, tuple[int, Trust]] = {}  # how often, and the worst
        self.load_transfer_ratio = (np.inf, -np.inf)  # least and largest
        self.least_margin = np.inf  # [g]
        self.span = 0.0
        self._first: int | None = None

    def write(self, loads: LoadsBlock, rollover: Sequence[Rollover | None] = ()) -> None:
        """Take the numbers of some samples."""
        rows = np.hstack([loads.wrench, loads.total, loads.pressure])
        self._largest = np.maximum(self._largest, np.abs(rows).max(axis=0))
        self.elevation_max = loads.highest_above(self.elevation_max)
        for place in np.flatnonzero(~loads.valid).tolist():
            trust = loads[place].trust
            count, worst = self.beyond.get(trust.criterion, (0, trust))
            self.beyond[trust.criterion] = count + 1, max(worst, trust, key=Trust.use)
        self._first = loads.stamps[0] if self._first is None else self._first
        self.span = max(self.span, (max(loads.stamps) - self._first) * 1e-9)
        for figures in filter(None, rollover):
            ratio, (least, largest) = float(figures.load_transfer_ratio), self.load_transfer_ratio
            self.load_transfer_ratio = min(least, ratio), max(largest, ratio)
            self.least_margin = min(self.least_margin, float(figures.margin))

    def finish(self) -> None:
        """Nothing is left to do."""

    def abandon(self) -> None:
        """Nothing is left behind."""

    @property
    def wrench(self) -> Array:
        """Largest magnitudes of the sloshing wrench, shape (6,) [N], [N m]."""
        return self._largest[:6]

    @property
    def total(self) -> Array:
        """Largest magnitudes of the total wrench, shape (6,) [N], [N m]."""
        return self._largest[6:12]

    @property
    def pressure(self) -> Array:
        """Largest magnitudes of the pressures, shape (p,) [Pa]."""
        return self._largest[12:]


class Recording:
    """
    Loads kept in memory, for plots and tables.

    Parameters
    ----------
    engine : SloshEngine
        Whose loads they are.

    Attributes
    ----------
    liquids : int
        One more than how often the fill of a tank has changed.
    """

    def __init__(self, engine: SloshEngine) -> None:
        self._engine, self._tanks = engine, engine.tanks
        self.liquids = 1
        self._to_base = engine.config.sensor.rotation
        self.source = engine.config.source
        self.frame = engine.config.output_frame
        self._loads: list[Loads] = []
        self._rollover: list[Rollover] = []

    def write(self, loads: Iterable[Loads], rollover: Sequence[Rollover | None] = ()) -> None:
        """Append the numbers of some samples that the engine has just taken."""
        if self._engine.tanks is not self._tanks:
            self._tanks = self._engine.tanks
            self.liquids += bool(self._loads)
        self._loads += loads
        self._rollover += filter(None, rollover)

    def finish(self) -> None:
        """Nothing is left to do."""

    def abandon(self) -> None:
        """Nothing is left behind."""

    @property
    def time(self) -> Array:
        """Time since the first sample [s], shape (n,)."""
        first = self._loads[0].stamp
        return np.array([(loads.stamp - first) * 1e-9 for loads in self._loads])

    @property
    def force(self) -> Array:
        """Measured specific force, base axes [m/s^2], shape (n, 3)."""
        return np.array([loads.sample.force for loads in self._loads]) @ self._to_base.T

    @property
    def velocity(self) -> Array:
        """Measured velocity, base axes [m/s], shape (n, 3)."""
        return np.array([loads.sample.velocity for loads in self._loads]) @ self._to_base.T

    @property
    def rate(self) -> Array:
        """Measured angular rate, base axes [rad/s], shape (n, 3)."""
        return np.array([loads.sample.rate for loads in self._loads]) @ self._to_base.T

    @property
    def wrench(self) -> Array:
        """Sloshing wrench [N], [N m], shape (n, 6)."""
        return np.array([loads.wrench for loads in self._loads])

    @property
    def total(self) -> Array:
        """Total wrench [N], [N m], shape (n, 6)."""
        return np.array([loads.total for loads in self._loads])

    @property
    def beta(self) -> Array:
        """Modal coordinates of all tanks [m], shape (n, modes)."""
        return np.array([loads.beta for loads in self._loads])

    @property
    def elevation_max(self) -> Array:
        """Largest wave height [m], shape (n,)."""
        return np.array([loads.elevation_max for loads in self._loads])

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Whether the wave was mild enough for linear theory, shape (n,)."""
        return np.array([loads.valid for loads in self._loads])

    @property
    def rollover(self) -> Rollover | None:
        """Rollover figures, shape (n,) each, if the vehicle was judged."""
        return Rollover(*np.array(self._rollover).T) if self._rollover else None


def replay(
    bag: MotionBag,
    engine: SloshEngine,
    writers: Iterable[LoadsWriter],
    progress: Callable[[int], None] = lambda _: None,
    monitor: RolloverMonitor | None = None,
) -> int:
    """
    Feed a bag to the engine, message by message, as the node would.

    Parameters
    ----------
    bag : MotionBag
        The drive.
    engine : SloshEngine
        The engine; its gate counts what was rejected and why, its warnings what fills were.
    writers : iterable of LoadsWriter
        Where the loads go. They are completed here, or abandoned if the bag is damaged.
    progress : callable
        Told the receive time [ns] of every message.
    monitor : RolloverMonitor, optional
        Judges the vehicle, as rollover_node would; the writers get its figures as well.

    Returns
    -------
    int
        Number of loads written.

    Raises
    ------
    InputError
        If the bag is damaged or none of its samples could be used.
    """
    writers = list(writers)
    written = 0
    try:
        liquid = engine.tanks
        for block in bag.blocks(_BLOCK):
            for tank, ratio in block.fills:
                _fill(engine, tank, ratio)
            for loads in _fed(engine, block):
                written += len(loads)
                if monitor and engine.tanks is not liquid:
                    liquid = engine.tanks
                    monitor.refill(engine)
                judged = [monitor.take(one.sample, one.wrench) for one in loads if monitor]
                for writer in writers:
                    writer.write(loads, judged)
            if block.received:
                progress(block.received[-1])
        if not written:
            reasons = ', '.join(f'{n} {v.value}' for v, n in engine.gate.counts.items())
            raise InputError(
                f'{bag.topic} has no sample that could be used ({reasons or "it is empty"})'
            )
        for writer in writers:
            writer.finish()
    except OSError as error:
        for writer in writers:
            writer.abandon()
        raise InputError(f'the loads cannot be written: {error}') from error
    except BaseException:
        for writer in writers:
            writer.abandon()
        raise
    return written


def _fill(engine: SloshEngine, tank: str, ratio: float) -> None:
    """Fill a tank; a fill that is refused is counted, with why the first of them was."""
    try:
        engine.set_fill(tank, ratio)
    except InputError as error:
        said = f'{tank} not filled as told; first because '
        known = (warning for warning in engine.warnings if warning.startswith(said))
        engine.warnings[next(known, f'{said}{error}')] += 1


def _fed(engine: SloshEngine, block: Block) -> Iterator[LoadsBlock]:
    """Feed messages, all at once if there is nothing about them to decide on."""
    if (all_of_them := block.readings) is not None and not all_of_them.absent:
        answers = feed_readings(engine, *all_of_them[:3])
        if answers is not None:
            yield answers
            return
    pairs = zip(block.messages, block.received, strict=True)
    answered = (feed_message(engine, message, received)[1] for message, received in pairs)
    yield from LoadsBlock.gather([loads for loads in answered if loads is not None])
