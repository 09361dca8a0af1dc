"""Replaying a recorded drive through the engine."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from slosh_ros.bag.reader import Block, MotionBag
from slosh_ros.bag.writer import LoadsWriter
from slosh_ros.engine import Loads, SloshEngine, feed_message
from slosh_ros.engine.convert import feed_readings
from slosh_ros.errors import InputError
from slosh_ros.modal.validity import Criterion, Trust
from slosh_ros.monitor import RolloverMonitor
from slosh_ros.vehicle.rollover import Rollover

Array = NDArray[np.float64]

_CHUNK = 256  # samples whose maxima are taken at once


class Peaks:
    """
    Largest magnitudes, in constant memory.

    Parameters
    ----------
    engine : SloshEngine
        Whose loads they are.
    """

    def __init__(self, engine: SloshEngine) -> None:
        self._chunk: list[Loads] = []
        self._largest: Array = np.zeros(12 + len(engine.config.pressure_points))
        self.elevation_max = 0.0
        self.beyond: dict[Criterion, tuple[int, Trust]] = {}  # how often, and the worst
        self.load_transfer_ratio = (np.inf, -np.inf)  # least and largest
        self.least_margin = np.inf  # [g]
        self.span = 0.0
        self._first: int | None = None

    def write(self, loads: Loads, rollover: Rollover | None = None) -> None:
        """Take the numbers of one sample."""
        self._chunk.append(loads)
        if len(self._chunk) == _CHUNK:
            self._take_chunk()
        if rollover is not None:
            ratio, (least, largest) = float(rollover.load_transfer_ratio), self.load_transfer_ratio
            self.load_transfer_ratio = min(least, ratio), max(largest, ratio)
            self.least_margin = min(self.least_margin, float(rollover.margin))

    def finish(self) -> None:
        """Take what is left of the last chunk."""
        self._take_chunk()

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

    def _take_chunk(self) -> None:
        chunk, self._chunk = self._chunk, []
        if not chunk:
            return
        wrenches = np.array([loads.wrenches for loads in chunk])
        rows = np.hstack([wrenches[:, 6:], np.array([loads.pressure for loads in chunk])])
        self._largest = np.maximum(self._largest, np.abs(rows).max(axis=0))
        for loads in chunk:
            if loads.rises_above(self.elevation_max):
                self.elevation_max = loads.elevation_max
            if not loads.valid:
                count, worst = self.beyond.get(loads.trust.criterion, (0, loads.trust))
                worst = max(worst, loads.trust, key=Trust.use)
                self.beyond[loads.trust.criterion] = count + 1, worst
        self._first = chunk[0].stamp if self._first is None else self._first
        self.span = max(self.span, *((loads.stamp - self._first) * 1e-9 for loads in chunk))


class Recording:
    """
    Loads kept in memory, for plots and tables.

    Parameters
    ----------
    engine : SloshEngine
        Whose loads they are.
    """

    def __init__(self, engine: SloshEngine) -> None:
        self._to_base = engine.config.sensor.rotation
        self.source = engine.config.source
        self.frame = engine.config.output_frame
        self._loads: list[Loads] = []
        self._rollover: list[Rollover] = []

    def write(self, loads: Loads, rollover: Rollover | None = None) -> None:
        """Append the numbers of the sample that the engine has just taken."""
        self._loads.append(loads)
        if rollover is not None:
            self._rollover.append(rollover)

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
        The engine; its gate counts what was rejected and why.
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
        for block in bag.blocks(_CHUNK):
            for loads in _fed(engine, block):
                written += 1
                rollover = monitor.take(loads.sample, loads.wrench) if monitor else None
                for writer in writers:
                    writer.write(loads, rollover)
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


def _fed(engine: SloshEngine, block: Block) -> Iterator[Loads]:
    """Feed messages, all at once if there is nothing about them to decide on."""
    if (all_of_them := block.readings) is not None and not all_of_them.absent:
        answers = feed_readings(engine, *all_of_them[:3])
        if answers is not None:
            yield from answers
            return
    for message, received in zip(block.messages, block.received, strict=True):
        _, loads = feed_message(engine, message, received)
        if loads is not None:
            yield loads
