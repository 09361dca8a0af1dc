"""Reading motion from ROS 2 and ROS 1 bags with rosbags."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any

from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection
from rosbags.typesys import Stores, get_typestore

from slosh_ros.constants import NANOSECONDS
from slosh_ros.engine.cdr import ImuReadings, imu_reading, imu_readings
from slosh_ros.engine.convert import IMU
from slosh_ros.errors import InputError


@dataclass
class Block:
    """
    Some messages in a row.

    Attributes
    ----------
    received : list of ints
        Receive time of each [ns].
    raws : list of bytes
        The messages as they are stored.
    readings : ImuReadings or None
        All of them at once, where that is possible.
    decoded : list
        The messages, where it is not.
    """

    received: list[int] = field(default_factory=list)
    raws: list[bytes] = field(default_factory=list)
    readings: ImuReadings | None = None
    decoded: list[Any] = field(default_factory=list)

    @property
    def messages(self) -> list[Any]:
        """Each of them, as its message or as an :class:`ImuReading`."""
        return self.decoded or [imu_reading(raw) for raw in self.raws]


class MotionBag:
    """
    One topic of a bag: ROS 2 (MCAP, sqlite3, compressed or not) or ROS 1.

    Parameters
    ----------
    path : Path
        Directory of a ROS 2 bag, or a file `.mcap`, `.db3` or `.bag`.
    kind : str
        Message type, as `sensor_msgs/Imu`.
    topic : str or None
        Topic; None takes the only one of that type, or `default` where there are several.
    default : str
        Preferred topic.
    start, duration : float or None
        Part of the bag, counted from its beginning [s].

    Raises
    ------
    InputError
        If the bag cannot be read or has no such topic.
    """

    def __init__(
        self,
        path: Path,
        kind: str,
        topic: str | None = None,
        default: str = '',
        start: float = 0.0,
        duration: float | None = None,
    ) -> None:
        self._path = path
        if not (math.isfinite(start) and math.isfinite(duration or 0.0)):
            raise InputError('start and duration must be finite numbers of seconds')
        if not path.exists():
            raise InputError(f'{path}: there is no such bag')
        try:
            self._reader = AnyReader([path], default_typestore=get_typestore(Stores.ROS2_JAZZY))
            self._reader.open()
        except Exception as error:  # rosbags lets out whatever a damaged file provokes
            raise InputError(f'{path}: cannot be read as a bag: {_short(error)}') from error
        try:
            self._connections = self._select(kind, topic, default)
        except InputError:
            self._reader.close()
            raise
        length = (self._reader.end_time - self._reader.start_time) / NANOSECONDS
        if start > length:
            self._reader.close()
            raise InputError(
                f'{path}: lasts {length:.2f} s; a start of {start:g} s leaves nothing of it'
            )
        self._is_imu = kind == IMU and self._reader.is2  # in CDR
        self._whole = start == 0.0 and duration is None
        self._start = self._reader.start_time + round(start * NANOSECONDS)
        self._stop = None if duration is None else self._start + round(duration * NANOSECONDS)

    @property
    def topic(self) -> str:
        """Name of the topic."""
        return self._connections[0].topic

    @property
    def count(self) -> int:
        """Tell how many messages of the topic the bag has, by its index."""
        return sum(connection.msgcount for connection in self._connections)

    @property
    def span(self) -> tuple[int, int]:
        """Receive times between which messages are read [ns]."""
        return self._start, self._reader.end_time if self._stop is None else self._stop

    def __enter__(self) -> MotionBag:
        """Enter the context; the bag is open already."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the bag."""
        self._reader.close()

    def messages(self) -> Iterator[tuple[Any, int]]:
        """
        Yield every message with its receive time [ns].

        Raises
        ------
        InputError
            If the bag is damaged, also where that only shows in a missing message.
        """
        for block in self.blocks(1, readings=False):
            yield block.decoded[0], block.received[0]

    def blocks(self, size: int, readings: bool = True) -> Iterator[Block]:
        """
        Yield all messages, so many at once; of an Imu no more than its readings, if wanted.

        Raises
        ------
        InputError
            As of `messages`.
        """
        read = 0
        block = Block()
        try:
            for _, received, raw in self._reader.messages(
                self._connections, start=self._start, stop=self._stop
            ):
                block.received.append(received)
                block.raws.append(raw)
                if len(block.raws) == size:
                    yield self._decoded(block, readings)
                    read += size
                    block = Block()
            if block.raws:
                yield self._decoded(block, readings)
                read += len(block.raws)
        except Exception as error:  # as above
            read += len(block.raws)
            raise InputError(
                f'{self._path}: is damaged after {read} messages of {self.topic}: {_short(error)}'
            ) from error
        if self._whole and read != self.count:
            raise InputError(
                f'{self._path}: is damaged: {read} messages of {self.topic} could be read, '
                f'its index counts {self.count}'
            )

    def _decoded(self, block: Block, readings: bool) -> Block:
        """Decode a block; of one that cannot be, what was good before remains."""
        if readings and self._is_imu:
            block.readings = imu_readings(block.raws)
        if block.readings is None:
            kind = self._connections[0].msgtype
            for k, raw in enumerate(block.raws):
                try:
                    block.decoded.append(self._reader.deserialize(raw, kind))
                except Exception:
                    del block.raws[k:]
                    raise
        return block

    def _select(self, kind: str, topic: str | None, default: str) -> list[Connection]:
        package, name = kind.split('/')
        of_kind = [c for c in self._reader.connections if c.msgtype == f'{package}/msg/{name}']
        topics = sorted({c.topic for c in of_kind})
        offer = f'; {kind} is on {", ".join(topics)}' if topics else f'; it has no {kind} at all'
        if topic is None:
            wanted = topics if len(topics) == 1 else [t for t in topics if t == default]
            if not wanted and topics:
                raise InputError(
                    f'{self._path}: has {kind} on {", ".join(topics)}; say which one to replay'
                )
            topic = wanted[0] if wanted else default
        chosen = [c for c in of_kind if c.topic in (topic, f'/{topic}')]
        if chosen:
            return chosen
        others = sorted({c.msgtype for c in self._reader.connections if c.topic == topic})
        problem = f'has {", ".join(others)} on {topic}' if others else f'has no topic {topic}'
        raise InputError(f'{self._path}: {problem}{offer}')


def _short(error: BaseException) -> str:
    text = ' '.join(str(error).split())
    return text or type(error).__name__
