"""Reading motion from ROS 2 and ROS 1 bags with rosbags."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any

from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection
from rosbags.typesys import Stores, get_typestore

from slosh_ros.constants import NANOSECONDS
from slosh_ros.engine.cdr import ImuReadings, imu_reading, imu_readings
from slosh_ros.engine.convert import FILL, IMU
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
    fills : list of (str, float)
        Tanks and their fills that came before.
    """

    received: list[int] = field(default_factory=list)
    raws: list[bytes] = field(default_factory=list)
    readings: ImuReadings | None = None
    decoded: list[Any] = field(default_factory=list)
    fills: list[tuple[str, float]] = field(default_factory=list)

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
    fills : mapping of str to (str or None, str)
        Topic of each tank's fill; with None, the only one that ends as the second says, if any.

    Raises
    ------
    InputError
        If the bag cannot be read or has no such topic.

    Attributes
    ----------
    fill_topics : dict of str to str
        Topics of the fills that were found, by the tanks.
    """

    def __init__(
        self,
        path: Path,
        kind: str,
        topic: str | None = None,
        default: str = '',
        start: float = 0.0,
        duration: float | None = None,
        fills: Mapping[str, tuple[str | None, str]] | None = None,
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
            found = {name: self._fill_topic(*wanted) for name, wanted in (fills or {}).items()}
        except InputError:
            self._reader.close()
            raise
        self.fill_topics = {name: topic for name, topic in found.items() if topic is not None}
        self._tanks: dict[str, list[str]] = {}  # by the topics of their fills
        for name, topic in self.fill_topics.items():
            self._tanks.setdefault(topic, []).append(name)
        self._fills = [c for c in self._of(FILL) if c.topic in self._tanks]
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
            yield from zip(block.decoded, block.received, strict=True)

    def blocks(self, size: int, readings: bool = True) -> Iterator[Block]:
        """
        Yield all messages, so many at once; of an Imu no more than its readings, if wanted.

        A block ends where a fill comes. With a `start`, the first one has the fills from before.

        Raises
        ------
        InputError
            As of `messages`.
        """
        read = heard = 0
        block = Block()
        try:
            block.fills += self._earlier_fills()
            for connection, received, raw in self._reader.messages(
                [*self._connections, *self._fills], start=self._start, stop=self._stop
            ):
                if connection.topic in self._tanks:
                    if block.raws:
                        yield self._decoded(block, readings)
                        read += len(block.raws)
                        block = Block()
                    block.fills += self._fills_of(connection, raw)
                    heard += 1
                    continue
                block.received.append(received)
                block.raws.append(raw)
                # the first to find another liquid is fed alone, those after it at once
                if len(block.raws) == (1 if block.fills else size):
                    yield self._decoded(block, readings)
                    read += len(block.raws)
                    block = Block()
            if block.raws or block.fills:
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
        fills = sum(connection.msgcount for connection in self._fills)
        if self._whole and heard != fills:
            raise InputError(
                f'{self._path}: is damaged: {heard} messages of '
                f'{", ".join(self.fill_topics.values())} could be read, its index counts {fills}'
            )

    def _earlier_fills(self) -> list[tuple[str, float]]:
        """Last fills before the part that is read."""
        last: dict[str, float] = {}
        if self._tanks and not self._whole:
            for connection, _, raw in self._reader.messages(self._fills, stop=self._start):
                last |= self._fills_of(connection, raw)
        return list(last.items())

    def _fills_of(self, connection: Connection, raw: bytes) -> list[tuple[str, float]]:
        message: Any = self._reader.deserialize(raw, connection.msgtype)
        return [(name, message.data) for name in self._tanks[connection.topic]]

    def _decoded(self, block: Block, readings: bool) -> Block:
        """Decode a block; of one that cannot be, what was good before remains."""
        if readings and self._is_imu and block.raws:
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
        of_kind = self._of(kind)
        topics = sorted({c.topic for c in of_kind})
        if topic is None:
            wanted = topics if len(topics) == 1 else [t for t in topics if t == default]
            if not wanted and topics:
                raise InputError(
                    f'{self._path}: has {kind} on {", ".join(topics)}; say which one to replay'
                )
            topic = wanted[0] if wanted else default
        return self._named(kind, topic)

    def _fill_topic(self, topic: str | None, ending: str) -> str | None:
        """Find the topic of a tank's fill, if there is one."""
        if topic is not None:
            return self._named(FILL, topic)[0].topic
        topics = sorted({c.topic for c in self._of(FILL) if f'/{c.topic}'.endswith(f'/{ending}')})
        if len(topics) > 1:
            raise InputError(
                f'{self._path}: has fills on {", ".join(topics)}; say which one is of the tank'
            )
        return topics[0] if topics else None

    def _named(self, kind: str, topic: str) -> list[Connection]:
        of_kind = self._of(kind)
        topics = sorted({c.topic for c in of_kind})
        offer = f'; {kind} is on {", ".join(topics)}' if topics else f'; it has no {kind} at all'
        chosen = [c for c in of_kind if c.topic in (topic, f'/{topic}')]
        if chosen:
            return chosen
        others = sorted({c.msgtype for c in self._reader.connections if c.topic == topic})
        problem = f'has {", ".join(others)} on {topic}' if others else f'has no topic {topic}'
        raise InputError(f'{self._path}: {problem}{offer}')

    def _of(self, kind: str) -> list[Connection]:
        package, name = kind.split('/')
        return [c for c in self._reader.connections if c.msgtype == f'{package}/msg/{name}']


def _short(error: BaseException) -> str:
    text = ' '.join(str(error).split())
    return text or type(error).__name__
