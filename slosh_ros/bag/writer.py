"""Writing loads: a table as CSV, or a bag of what the nodes publish."""

from __future__ import annotations

import shutil
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import IO, Any, Protocol

from rosbags.interfaces import Connection
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from slosh_ros.constants import NANOSECONDS
from slosh_ros.engine import Loads, SloshConfig
from slosh_ros.errors import InputError
from slosh_ros.vehicle.rollover import FIGURES, Rollover

COLUMNS = (
    'stamp_ns,fx,fy,fz,mx,my,mz,'
    'total_fx,total_fy,total_fz,total_mx,total_my,total_mz,elevation_max,valid'
)
ROLLOVER_COLUMNS = 'ltr,ltr_settled,rollover_margin'


class LoadsWriter(Protocol):
    """Takes loads one by one; what it writes appears at its place only when complete."""

    def write(self, loads: Loads, rollover: Rollover | None = None) -> None:
        """Append the loads of one sample, and how close the vehicle is to rolling over."""

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

    def write(self, loads: Loads, rollover: Rollover | None = None) -> None:
        """Append the row of one sample."""
        numbers = [*loads.wrench.tolist(), *loads.total.tolist(), loads.elevation_max]
        numbers += [int(loads.valid), *loads.pressure.tolist(), *map(float, rollover or ())]
        self._file.write(f'{loads.stamp},{",".join(map(repr, numbers))}\n')

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
        self._frame = config.output_frame
        self._folder = Path(tempfile.mkdtemp(prefix='.slosh_replay_', dir=path.parent))
        self._types = get_typestore(Stores.ROS2_JAZZY)
        self._writer = Writer(self._folder / 'bag', version=9, storage_plugin=StoragePlugin.MCAP)
        self._writer.open()
        self._wrench, self._total = (
            self._connection(f'/slosh_node/{name}', 'geometry_msgs/msg/WrenchStamped')
            for name in ('wrench', 'wrench_total')
        )
        self._pressures = [
            (
                self._connection(f'/slosh_node/pressure/{point}', 'sensor_msgs/msg/FluidPressure'),
                frame,
            )
            for point, frame in config.pressure_points.items()
        ]
        self._rollover = [
            self._connection(f'/rollover_node/{name}', 'std_msgs/msg/Float64')
            for name in (FIGURES if rollover else ())
        ]

    def write(self, loads: Loads, rollover: Rollover | None = None) -> None:
        """Append the messages of one sample."""
        self._append(self._wrench, loads.stamp, loads.wrench.tolist())
        self._append(self._total, loads.stamp, loads.total.tolist())
        pressures = zip(self._pressures, loads.pressure.tolist(), strict=True)
        for (connection, frame), pressure in pressures:
            message = self._types.types['sensor_msgs/msg/FluidPressure'](
                header=self._header(loads.stamp, frame), fluid_pressure=pressure, variance=0.0
            )
            self._write(connection, loads.stamp, message)
        for connection, number in zip(self._rollover, rollover or (), strict=True):
            message = self._types.types['std_msgs/msg/Float64'](data=float(number))
            self._write(connection, loads.stamp, message)

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
        return self._writer.add_connection(topic, kind, typestore=self._types)

    def _header(self, stamp: int, frame: str) -> Any:
        kind: dict[str, Any] = self._types.types
        seconds, nanoseconds = divmod(stamp, NANOSECONDS)
        time = kind['builtin_interfaces/msg/Time'](sec=seconds, nanosec=nanoseconds)
        return kind['std_msgs/msg/Header'](stamp=time, frame_id=frame)

    def _append(self, connection: Connection, stamp: int, wrench: list[float]) -> None:
        kind: dict[str, Any] = self._types.types
        vector = kind['geometry_msgs/msg/Vector3']
        message = kind['geometry_msgs/msg/WrenchStamped'](
            header=self._header(stamp, self._frame),
            wrench=kind['geometry_msgs/msg/Wrench'](
                force=vector(*wrench[:3]), torque=vector(*wrench[3:])
            ),
        )
        self._write(connection, stamp, message)

    def _write(self, connection: Connection, stamp: int, message: object) -> None:
        raw = self._types.serialize_cdr(message, connection.msgtype)
        self._writer.write(connection, stamp, raw)


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
