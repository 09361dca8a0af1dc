"""Writing loads: a table as CSV, or a bag of what the nodes publish."""

from __future__ import annotations

import itertools
import shutil
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO, NamedTuple, Protocol

import numpy as np
from rosbags.interfaces import Connection
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from slosh_ros.engine import LoadsBlock, SloshConfig
from slosh_ros.engine.stamped import StampedDoubles
from slosh_ros.errors import InputError
from slosh_ros.vehicle.rollover import FIGURES, Rollover

COLUMNS = (
    'stamp_ns,fx,fy,fz,mx,my,mz,'
    'total_fx,total_fy,total_fz,total_mx,total_my,total_mz,elevation_max,valid'
)
ROLLOVER_COLUMNS = 'ltr,ltr_settled,rollover_margin'


class LoadsWriter(Protocol):
    """Takes loads block by block; what it writes appears at its place only when complete."""

    def write(self, loads: LoadsBlock, rollover: Sequence[Rollover | None] = ()) -> None:
        """Append the loads of some samples, and how close the vehicle is to rolling over."""

    def finish(self) -> None:
        """Complete the file and put it in place."""

    def abandon(self) -> None:
        """Leave no trace."""


class CsvWriter:
    """
    One row a sample, doubles in full.

    With columns for points of pressure and for rollover figures, if there are any.
    """

    def __init__(self, path: Path, config: SloshConfig, rollover: bool = False) -> None:
        self._path = path
        self._part = path.with_name(path.name + '.part')
        self._file: IO[str] = self._part.open('w', encoding='ascii')
        columns = [COLUMNS, *(f'p_{point}' for point in config.pressure_points)]
        self._file.write(','.join(columns + [ROLLOVER_COLUMNS] * rollover) + '\n')

    def write(self, loads: LoadsBlock, rollover: Sequence[Rollover | None] = ()) -> None:
        """Append the rows of some samples."""
        numbers = np.hstack([loads.wrench, loads.total, loads.elevation_max[:, np.newaxis]])
        # a vehicle that could not be judged at a sample has its fields there, but empty
        judged = [map(float, one) if one else [''] * len(FIGURES) for one in rollover]
        for stamp, row, valid, pressure, figures in zip(
            loads.stamps,
            numbers.tolist(),
            loads.valid.tolist(),
            loads.pressure.tolist(),
            judged or itertools.repeat(()),
            strict=False,
        ):
            fields = stamp, *row, int(valid), *pressure, *figures
            self._file.write(','.join(map(str, fields)) + '\n')

    def finish(self) -> None:
        """Complete the file and put it in place."""
        self._file.close()
        self._part.replace(self._path)

    def abandon(self) -> None:
        """Leave no trace."""
        with suppress(OSError):  # a full disk must not keep the rest from going
            self._file.close()
        self._part.unlink(missing_ok=True)


class BagWriter:
    """The topics of slosh_node and rollover_node, as they publish them."""

    def __init__(self, path: Path, config: SloshConfig, rollover: bool = False) -> None:
        self._path = path
        self._folder = Path(tempfile.mkdtemp(prefix='.slosh_replay_', dir=path.parent))
        self._types = get_typestore(Stores.ROS2_JAZZY)
        self._writer = Writer(self._folder / 'bag', version=9, storage_plugin=StoragePlugin.MCAP)
        self._writer.open()
        frame, stamped = config.output_frame, StampedDoubles
        self._topics = [
            self._topic('slosh_node/wrench', 'geometry_msgs/msg/WrenchStamped', stamped(frame, 6)),
            self._topic(
                'slosh_node/wrench_total', 'geometry_msgs/msg/WrenchStamped', stamped(frame, 6)
            ),
        ]
        self._topics += [
            self._topic(
                f'slosh_node/pressure/{point}',
                'sensor_msgs/msg/FluidPressure',
                stamped(of_tank, 2),
            )
            for point, of_tank in config.pressure_points.items()
        ]
        self._rollover = [
            self._connection(f'rollover_node/{name}', 'std_msgs/msg/Float64')
            for name in (FIGURES if rollover else ())
        ]

    def write(self, loads: LoadsBlock, rollover: Sequence[Rollover | None] = ()) -> None:
        """Append the messages of some samples."""
        pressures = np.stack([loads.pressure, np.zeros_like(loads.pressure)], axis=2)  # variance
        columns = [loads.wrench, loads.total, *np.moveaxis(pressures, 1, 0)]
        rows = zip(loads.stamps, *(column.tolist() for column in columns), strict=True)
        for (stamp, *values), figures in zip(rows, rollover or itertools.repeat(()), strict=False):
            for (connection, layout), numbers in zip(self._topics, values, strict=True):
                self._writer.write(connection, stamp, layout.write(stamp, numbers))
            for connection, number in zip(self._rollover, figures or (), strict=False):
                message = self._types.types['std_msgs/msg/Float64'](data=float(number))
                raw = self._types.serialize_cdr(message, connection.msgtype)
                self._writer.write(connection, stamp, raw)

    def finish(self) -> None:
        """Complete the bag and put it in place."""
        self._writer.close()
        (written,) = (self._folder / 'bag').glob('*.mcap')
        written.replace(self._path)
        shutil.rmtree(self._folder)

    def abandon(self) -> None:
        """Leave no trace."""
        with suppress(OSError):  # a full disk must not keep the rest from going
            self._writer.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _connection(self, topic: str, kind: str) -> Connection:
        return self._writer.add_connection(f'/{topic}', kind, typestore=self._types)

    def _topic(self, topic: str, kind: str, layout: StampedDoubles) -> _Topic:
        return _Topic(self._connection(topic, kind), layout)


class _Topic(NamedTuple):
    connection: Connection
    layout: StampedDoubles


def writer_for(path: Path, config: SloshConfig, rollover: bool = False) -> LoadsWriter:
    """
    Choose the writer by the ending of the path.

    Parameters
    ----------
    path : Path
        The file.
    config : SloshConfig
        Frames and points of pressure.
    rollover : bool
        Whether rollover figures come with the loads.

    Raises
    ------
    InputError
        If the ending is neither `.csv` nor `.mcap`, or the place cannot be written to.
    """
    if path.is_dir():
        raise InputError(f'{path}: is a folder; name a file')
    try:
        if path.suffix == '.csv':
            return CsvWriter(path, config, rollover)
        if path.suffix == '.mcap':
            return BagWriter(path, config, rollover)
    except OSError as error:
        raise InputError(f'{path}: cannot be written: {error.strerror}') from error
    raise InputError(f"{path}: its ending must be .csv or .mcap, not '{path.suffix}'")
