"""Synthetic drives for the tests: motions known in closed form, as samples and as bags."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from slosh_ros.engine import Loads, MotionSample, SloshConfig, SloshEngine

SECOND = 1_000_000_000
START = 100 * SECOND
G = 9.81

RECTANGLE: dict[str, object] = {
    'tank.shape': 'rectangular',
    'tank.length': 8.0,
    'tank.width': 2.0,
    'tank.height': 1.6,
    'tank.fill_depth': 0.8,
    'tank.density': 850.0,
}


def engine_of(**changes: object) -> SloshEngine:
    """Engine of Table 1's tank, with changes; `__` stands for the dot of a name."""
    given = RECTANGLE | {name.replace('__', '.'): value for name, value in changes.items()}
    return SloshEngine(SloshConfig.from_parameters(given))


def stamps(duration: float, step: float) -> list[int]:
    """Stamps of a drive, ends included [ns]."""
    return [START + round(k * step * SECOND) for k in range(round(duration / step) + 1)]


def feed(
    engine: SloshEngine, times: Iterable[int], force: object, rate: object = (0.0, 0.0, 0.0)
) -> list[Loads]:
    """Feed Imu samples; force and rate are vectors or functions of time since START [s]."""
    answers = []
    for stamp in times:
        t = (stamp - START) / SECOND
        at = [list(v(t) if callable(v) else v) for v in (force, rate)]
        _, loads = engine.feed(MotionSample.from_imu(stamp, *at))
        if loads is not None:
            answers.append(loads)
    return answers


def wrenches(loads: list[Loads]) -> np.ndarray:
    """Sloshing wrenches, shape (n, 6)."""
    return np.array([answer.wrench for answer in loads])


def totals(loads: list[Loads]) -> np.ndarray:
    """Total wrenches, shape (n, 6)."""
    return np.array([answer.total for answer in loads])


def imu_message(store: object, stamp: int, force: object, rate: object, frame: str = 'imu_link'):
    """Build a sensor_msgs/Imu of a rosbags typestore; ROS 1 stores have a seq in the header."""
    types = store.types
    vector = types['geometry_msgs/msg/Vector3']
    time = types['builtin_interfaces/msg/Time'](*divmod(stamp, SECOND))
    header = types['std_msgs/msg/Header']
    head = {'stamp': time, 'frame_id': frame} | (
        {'seq': 0} if 'seq' in header.__dataclass_fields__ else {}
    )
    unknown = np.zeros(9)
    return types['sensor_msgs/msg/Imu'](
        header=header(**head),
        orientation=types['geometry_msgs/msg/Quaternion'](0.0, 0.0, 0.0, 1.0),
        orientation_covariance=np.array([-1.0, *unknown[1:]]),
        angular_velocity=vector(*map(float, rate)),
        angular_velocity_covariance=unknown,
        linear_acceleration=vector(*map(float, force)),
        linear_acceleration_covariance=unknown,
    )


def write_bag(
    path: Path,
    times: Iterable[int],
    force: object,
    kind: str = 'mcap',
    topic: str = '/imu/data',
    fills: Iterable[tuple[int, str, float]] = (),
) -> Path:
    """
    Write a bag of Imu messages: `mcap`, `mcap_zstd`, `sqlite3`, `sqlite3_zstd` or `ros1`.

    Fills, each with its time and topic, come before an Imu message of the same time.
    """
    filled = sorted(fills)
    if kind == 'ros1':
        store = get_typestore(Stores.ROS1_NOETIC)
        with Writer1(path) as writer:
            connection = writer.add_connection(topic, 'sensor_msgs/msg/Imu', typestore=store)
            for stamp in times:
                message = imu_message(store, stamp, force((stamp - START) / SECOND), (0, 0, 0))
                writer.write(connection, stamp, store.serialize_ros1(message, connection.msgtype))
        return path
    store = get_typestore(Stores.ROS2_JAZZY)
    plugin = StoragePlugin.MCAP if kind.startswith('mcap') else StoragePlugin.SQLITE3
    writer = Writer(path, version=9, storage_plugin=plugin)
    if kind == 'mcap_zstd':
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    if kind == 'sqlite3_zstd':
        writer.set_compression(CompressionMode.FILE, CompressionFormat.ZSTD)
    with writer:
        levels = {
            name: writer.add_connection(name, 'std_msgs/msg/Float64', typestore=store)
            for name in sorted({name for _, name, _ in filled})
        }
        connection = writer.add_connection(topic, 'sensor_msgs/msg/Imu', typestore=store)
        for stamp in times:
            while filled and filled[0][0] <= stamp:
                at, name, ratio = filled.pop(0)
                level = store.types['std_msgs/msg/Float64'](ratio)
                writer.write(levels[name], at, store.serialize_cdr(level, level.__msgtype__))
            message = imu_message(store, stamp, force((stamp - START) / SECOND), (0, 0, 0))
            writer.write(connection, stamp, store.serialize_cdr(message, connection.msgtype))
    return path
