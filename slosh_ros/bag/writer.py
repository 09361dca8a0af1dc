"""Writing loads: a table as CSV, or a bag of WrenchStamped."""

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
from slosh_ros.engine import Loads
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
    """One row a sample, doubles in full; with columns for rollover figures if there are any."""

    def __init__(self, path: Path, rollover: bool = False) -> None:
        self._path = path
        self._part = path.with_name(path.name + '.part')
        self._file: IO[str] = self._part.open('w', encoding='ascii')
        self._file.write(f'{COLUMNS},{ROLLOVER_COLUMNS}\n' if rollover else f'{COLUMNS}\n')

    def write(self, loads: Loads, rollover: Rollover | None = None) -> None:
        """Append the row of one sample."""
        numbers = [*loads.wrench.tolist(), *loads.total.tolist(), loads.elevation_max]
        numbers += [int(loads.valid), *map(float, rollover or ())]
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

    def __init__(self, path: Path, frame: str, rollover: bool = False) -> None:
        self._path = path
        self._frame = frame
        self._folder = Path(tempfile.mkdtemp(prefix='.slosh_replay_', dir=path.parent))
        self._types = get_typestore(Stores.ROS2_JAZZY)
        self._writer = Writer(self._folder / 'bag', version=9, storage_plugin=StoragePlugin.MCAP)
        self._writer.open()
        self._wrench, self._total = (
            self._writer.add_connection(
                f'/slosh_node/{name}', 'geometry_msgs/msg/WrenchStamped', typestore=self._types
            )
            for name in ('wrench', 'wrench_total')
        )
        self._rollover = [
            self._writer.add_connection(
                f'/rollover_node/{name}', 'std_msgs/msg/Float64', typestore=self._types
            )
            for name in (FIGURES if rollover else ())
        ]

    def write(self, loads: Loads, rollover: Rollover | None = None) -> None:
        """Append the messages of one sample."""
        self._append(self._wrench, loads.stamp, loads.wrench.tolist())
        self._append(self._total, loads.stamp, loads.total.tolist())
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

    def _append(self, connection: Connection, stamp: int, wrench: list[float]) -> None:
        kind: dict[str, Any] = self._types.types
        vector = kind['geometry_msgs/msg/Vector3']
        seconds, nanoseconds = divmod(stamp, NANOSECONDS)
        message = kind['geometry_msgs/msg/WrenchStamped'](
            header=kind['std_msgs/msg/Header'](
                stamp=kind['builtin_interfaces/msg/Time'](sec=seconds, nanosec=nanoseconds),
                frame_id=self._frame,
            ),
            wrench=kind['geometry_msgs/msg/Wrench'](
                force=vector(*wrench[:3]), torque=vector(*wrench[3:])
            ),
        )
        self._write(connection, stamp, message)

    def _write(self, connection: Connection, stamp: int, message: object) -> None:
        raw = self._types.serialize_cdr(message, connection.msgtype)
        self._writer.write(connection, stamp, raw)


def writer_for(path: Path, frame: str, rollover: bool = False) -> LoadsWriter:
    """
    Choose the writer by the ending of the path.

    Parameters
    ----------
    path : Path
        The file.
    frame : str
        Of the wrenches.
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
            return CsvWriter(path, rollover)
        if path.suffix == '.mcap':
            return BagWriter(path, frame, rollover)
    except OSError as error:
        raise InputError(f'{path}: cannot be written: {error.strerror}') from error
    raise InputError(f"{path}: its ending must be .csv or .mcap, not '{path.suffix}'")
