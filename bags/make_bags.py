#!/usr/bin/env python3
"""
Make the two shipped ROS 2 bags from the original recordings.

`highway_drive` comes from one minute of comma2k19, `husky` from a ROS 1 bag of robot_localization.
Nothing is filtered, resampled or repaired on the way, except that the yaw rate of the highway
twist is interpolated to the stamps of the CAN speed. Two runs give the same bytes.

    python bags/make_bags.py --force
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray
from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.stores import ros1_noetic as ros1
from rosbags.typesys.stores import ros2_jazzy as ros2

Floats = NDArray[np.float64]

HERE = Path(__file__).resolve().parent
SOURCE = HERE.parent.parent / 'shared' / 'data'
ORIGINS = {
    'highway_drive': 'commaai/comma2k19 4c7f1a6e1957745beadc1def0e7225f559b09a2a, MIT',
    'husky': (
        'cra-ros-pkg/robot_localization 1cb953379378d13b3e0935ed73d0c7407bd80543, BSD-3-Clause'
    ),
}

IMU_TOPIC = '/imu/data'
IMU_TYPE = 'sensor_msgs/msg/Imu'
TWIST_TOPIC = '/twist'
TWIST_TYPE = 'geometry_msgs/msg/TwistStamped'
HUSKY_ODOM_TOPIC = '/husky_velocity_controller/odom'

TYPES = get_typestore(Stores.ROS2_JAZZY)
NS_PER_S = 1_000_000_000

# comma2k19 records [forward, right, down]; REP-103 wants [forward, left, up].
FRD_TO_FLU = np.array([1.0, -1.0, -1.0])

# Reliable, so that `ros2 bag play` serves reliable and best-effort subscribers alike; infinite
# deadline, lifespan and lease are what a live publisher with default QoS gets recorded with.
INFINITE = QosTime(9_223_372_036, 854_775_807)
QOS = Qos(
    history=QosHistory.KEEP_LAST,
    depth=10,
    reliability=QosReliability.RELIABLE,
    durability=QosDurability.VOLATILE,
    deadline=INFINITE,
    lifespan=INFINITE,
    liveliness=QosLiveliness.AUTOMATIC,
    liveliness_lease_duration=INFINITE,
    avoid_ros_namespace_conventions=False,
)


class SourceError(Exception):
    """An original recording is missing or is not what this script knows."""


class Record(NamedTuple):
    """One message of a bag, serialised."""

    topic: str
    receive_ns: int
    cdr: bytes


@dataclass(frozen=True)
class Highway:
    """The comma2k19 minute, in FLU axes of the device."""

    imu_t: Floats  # [s], boot time
    specific_force: Floats  # [m/s2], n x 3
    angular_rate: Floats  # [rad/s], n x 3
    speed_t: Floats  # [s], boot time
    speed: Floats  # [m/s], CAN


def read_array(path: Path) -> Floats:
    """Read one comma2k19 array: .npy content in a file without extension."""
    try:
        with path.open('rb') as file:
            array = np.load(file, allow_pickle=False)
    except (OSError, ValueError) as error:
        msg = f'{path}: cannot read this array ({error})'
        raise SourceError(msg) from error
    return np.asarray(array, dtype=np.float64)


def read_highway(source: Path) -> Highway:
    """Read the comma2k19 minute and turn it to FLU."""
    log = source / 'comma2k19' / 'processed_log'
    imu_t = read_array(log / 'IMU' / 'accelerometer' / 't')
    # One Imu message holds both sensors, which is only right if they share their stamps.
    if not np.array_equal(imu_t, read_array(log / 'IMU' / 'gyro' / 't')):
        msg = f'{log / "IMU"}: accelerometer and gyro stamps differ'
        raise SourceError(msg)
    return Highway(
        imu_t=imu_t,
        specific_force=read_array(log / 'IMU' / 'accelerometer' / 'value') * FRD_TO_FLU,
        angular_rate=read_array(log / 'IMU' / 'gyro' / 'value') * FRD_TO_FLU,
        speed_t=read_array(log / 'CAN' / 'speed' / 't'),
        speed=read_array(log / 'CAN' / 'speed' / 'value')[:, 0],
    )


def to_ns(seconds: float) -> int:
    """Nanoseconds of a stamp in seconds, rounded once: the product is exact before it."""
    return round(Fraction(seconds) * NS_PER_S)


def interpolate(at: Floats, times: Floats, values: Floats) -> Floats:
    """
    Linear interpolation that holds the end values.

    `numpy.interp` does the same, but its compiled loop may fuse multiply and add on some machines;
    single array operations give the same bits everywhere.
    """
    at = np.clip(at, times[0], times[-1])
    left = np.clip(np.searchsorted(times, at, side='right') - 1, 0, len(times) - 2)
    part = (at - times[left]) / (times[left + 1] - times[left])
    return np.asarray(values[left] * (1.0 - part) + values[left + 1] * part)


def header(stamp_ns: int, frame_id: str) -> ros2.std_msgs__msg__Header:
    """Make a message header from integer nanoseconds."""
    stamp = ros2.builtin_interfaces__msg__Time(*divmod(stamp_ns, NS_PER_S))
    return ros2.std_msgs__msg__Header(stamp, frame_id)


def vector(xyz: Iterable[float]) -> ros2.geometry_msgs__msg__Vector3:
    """Make a Vector3 from three numbers."""
    x, y, z = (float(value) for value in xyz)
    return ros2.geometry_msgs__msg__Vector3(x, y, z)


def imu_cdr(stamp_ns: int, force: Floats, rate: Floats) -> bytes:
    """Make a serialised Imu message without orientation and with unknown covariances."""
    no_orientation = np.zeros(9)
    no_orientation[0] = -1.0  # REP-145: this IMU gives no orientation
    message = ros2.sensor_msgs__msg__Imu(
        header=header(stamp_ns, 'imu_link'),
        orientation=ros2.geometry_msgs__msg__Quaternion(0.0, 0.0, 0.0, 1.0),
        orientation_covariance=no_orientation,
        angular_velocity=vector(rate),
        angular_velocity_covariance=np.zeros(9),
        linear_acceleration=vector(force),
        linear_acceleration_covariance=np.zeros(9),
    )
    return bytes(TYPES.serialize_cdr(message, IMU_TYPE))


def twist_cdr(stamp_ns: int, linear: Iterable[float], angular: Iterable[float]) -> bytes:
    """Make a serialised TwistStamped message of the vehicle in `base_link`."""
    twist = ros2.geometry_msgs__msg__Twist(vector(linear), vector(angular))
    message = ros2.geometry_msgs__msg__TwistStamped(header(stamp_ns, 'base_link'), twist)
    return bytes(TYPES.serialize_cdr(message, TWIST_TYPE))


def highway_records(source: Path) -> Iterator[Record]:
    """Messages of the highway bag; receive time = header stamp."""
    drive = read_highway(source)
    for t, force, rate in zip(drive.imu_t, drive.specific_force, drive.angular_rate, strict=True):
        stamp = to_ns(t)
        yield Record(IMU_TOPIC, stamp, imu_cdr(stamp, force, rate))

    # The gyro already has the phone's constant bias estimate taken off. What is left (README) is
    # not touched, so that both topics tell the same yaw rate.
    yaw_rate = interpolate(drive.speed_t, drive.imu_t, drive.angular_rate[:, 2])
    for t, speed, rate_z in zip(drive.speed_t, drive.speed, yaw_rate, strict=True):
        stamp = to_ns(t)
        yield Record(TWIST_TOPIC, stamp, twist_cdr(stamp, (speed, 0.0, 0.0), (0.0, 0.0, rate_z)))


def husky_records(source: Path) -> Iterator[Record]:
    """Messages of the Husky bag; receive times as recorded."""
    path = source / 'husky' / 'husky_test1.bag'
    try:
        with AnyReader([path]) as reader:
            yield from read_husky(reader)
    except (AnyReaderError, FileNotFoundError) as error:
        msg = f'{path}: cannot read this bag ({error})'
        raise SourceError(msg) from error


def read_husky(reader: AnyReader) -> Iterator[Record]:
    """Turn the two wanted topics of the open ROS 1 bag into ROS 2 messages."""
    wanted = [c for c in reader.connections if c.topic in (IMU_TOPIC, HUSKY_ODOM_TOPIC)]
    if len(wanted) != 2:
        msg = f'husky_test1.bag: expected one {IMU_TOPIC} and one {HUSKY_ODOM_TOPIC}'
        raise SourceError(msg)
    for connection, receive_ns, raw in reader.messages(wanted):
        if connection.topic == IMU_TOPIC:
            # Straight from the ROS 1 bytes: only the sequence number of the header goes.
            yield Record(IMU_TOPIC, receive_ns, bytes(TYPES.ros1_to_cdr(raw, IMU_TYPE)))
            continue
        odom = cast('ros1.nav_msgs__msg__Odometry', reader.deserialize(raw, connection.msgtype))
        # An odometry gives its twist in the child frame.
        if odom.child_frame_id != 'base_link':
            msg = f"{HUSKY_ODOM_TOPIC}: twist of {odom.child_frame_id!r}, expected 'base_link'"
            raise SourceError(msg)
        stamp = odom.header.stamp.sec * NS_PER_S + odom.header.stamp.nanosec
        linear, angular = odom.twist.twist.linear, odom.twist.twist.angular
        cdr = twist_cdr(
            stamp,
            (linear.x, linear.y, linear.z),
            (angular.x, angular.y, angular.z),
        )
        yield Record(TWIST_TOPIC, receive_ns, cdr)


def write_bag(path: Path, records: Iterator[Record]) -> dict[str, int]:
    """Write records in order of their receive time and return the count per topic."""
    counts = {IMU_TOPIC: 0, TWIST_TOPIC: 0}
    writer = Writer(path, version=9, storage_plugin=StoragePlugin.MCAP)
    # Chunks inside the MCAP file are compressed: ros2 bag and every MCAP tool read that directly.
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    writer.set_custom_data('origin', ORIGINS[path.name])
    with writer:
        connections = {
            topic: writer.add_connection(
                topic, msgtype, typestore=TYPES, offered_qos_profiles=[QOS]
            )
            for topic, msgtype in ((IMU_TOPIC, IMU_TYPE), (TWIST_TOPIC, TWIST_TYPE))
        }
        for record in sorted(records, key=lambda r: (r.receive_ns, r.topic)):
            writer.write(connections[record.topic], record.receive_ns, record.cdr)
            counts[record.topic] += 1
    return counts


def make_bags(source: Path, out: Path, *, force: bool = False) -> dict[str, dict[str, int]]:
    """
    Make both bags in `out`.

    Parameters
    ----------
    source
        Folder with `comma2k19/` and `husky/`.
    out
        Folder that receives `highway_drive/` and `husky/`.
    force
        Replace bags that are there already.

    Returns
    -------
    dict
        Message count per bag and topic.

    Raises
    ------
    SourceError
        A recording is missing or not what is expected.
    FileExistsError
        A bag is there already and `force` is not given.
    """
    present = [str(out / name) for name in ORIGINS if (out / name).exists()]
    if present and not force:
        msg = f'{", ".join(present)}: exists already, use --force to replace'
        raise FileExistsError(msg)

    out.mkdir(parents=True, exist_ok=True)
    # Made aside and moved when both are whole, so that a failure leaves the old bags in place.
    with tempfile.TemporaryDirectory(dir=out, prefix='.making-') as aside:
        counts = {
            'highway_drive': write_bag(Path(aside) / 'highway_drive', highway_records(source)),
            'husky': write_bag(Path(aside) / 'husky', husky_records(source)),
        }
        for name in ORIGINS:
            if (out / name).exists():
                shutil.rmtree(out / name)
            (Path(aside) / name).rename(out / name)
    return counts


def main(argv: Sequence[str] | None = None) -> int:
    """Run the script and return its exit code."""
    parser = argparse.ArgumentParser(
        description='Make the two shipped ROS 2 bags from the original recordings.'
    )
    parser.add_argument(
        '--source', type=Path, default=SOURCE, help='folder of the originals (%(default)s)'
    )
    parser.add_argument(
        '--out', type=Path, default=HERE, help='folder that receives the bags (%(default)s)'
    )
    parser.add_argument('--force', action='store_true', help='replace bags that are there already')
    args = parser.parse_args(argv)
    try:
        counts = make_bags(args.source, args.out, force=args.force)
    except (SourceError, OSError) as error:
        print(f'make_bags: {error}', file=sys.stderr)
        return 1
    for name, topics in counts.items():
        size = sum(file.stat().st_size for file in (args.out / name).iterdir())
        listing = ', '.join(f'{topic} {count}' for topic, count in topics.items())
        print(f'{args.out / name}: {listing}; {size / 1e6:.2f} MB')
    return 0


if __name__ == '__main__':
    sys.exit(main())
