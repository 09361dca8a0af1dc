"""
From a message's fields to the engine, for live and recorded messages alike.

rclpy and rosbags give different classes with the same fields; nothing here imports either.
"""

from __future__ import annotations

from typing import Any

from slosh_ros.constants import NANOSECONDS
from slosh_ros.engine.engine import Loads, SloshEngine
from slosh_ros.engine.gate import Verdict
from slosh_ros.engine.sample import MotionSample

IMU, TWIST, TWIST_STAMPED = 'sensor_msgs/Imu', 'geometry_msgs/Twist', 'geometry_msgs/TwistStamped'

_ABSENT = -1.0  # covariance[0] of a quantity that the sensor does not measure (sensor_msgs/Imu)

FRAME_CHANGES = (
    'frame_id changes in mid-drive: more than one IMU on the topic? imu.xyz and imu.rpy are those '
    'of one; name its frame in input.imu_frame'
)


def input_type(engine: SloshEngine) -> str:
    """Message type that the engine's configuration asks for."""
    config = engine.config
    if config.source == 'imu':
        return IMU
    return TWIST_STAMPED if config.twist_stamped else TWIST


def stamp_of(header: Any) -> int:
    """Time stamp of a std_msgs/Header [ns]."""
    return int(header.stamp.sec) * NANOSECONDS + int(header.stamp.nanosec)


def feed_message(engine: SloshEngine, message: Any, received: int) -> tuple[Verdict, Loads | None]:
    """
    Feed a message of the engine's :func:`input_type`.

    Parameters
    ----------
    engine : SloshEngine
        The engine.
    message : object
        With the fields of the message type, from rclpy or rosbags.
    received : int
        Time of arrival [ns]; stamps a message that has no stamp of its own.
    """
    kind = input_type(engine)
    if kind == IMU:
        return _feed_imu(engine, message)
    twist = message if kind == TWIST else message.twist
    stamp = received if kind == TWIST else stamp_of(message.header)
    return engine.feed(MotionSample.from_twist(stamp, _xyz(twist.linear), _xyz(twist.angular)))


def _feed_imu(engine: SloshEngine, message: Any) -> tuple[Verdict, Loads | None]:
    wanted, frame = engine.config.imu_frame, message.header.frame_id
    if wanted and frame != wanted:
        return engine.gate.refuse(Verdict.WRONG_FRAME), None
    if engine.gate.changes_frame(frame):
        engine.warnings[FRAME_CHANGES] += 1
    if message.linear_acceleration_covariance[0] == _ABSENT:
        return engine.gate.refuse(Verdict.NO_DATA), None
    if _no_gyro(message):
        engine.warnings['gyro marked absent by its covariance: rate taken as zero'] += 1
    return engine.feed(imu_sample(message))


def imu_sample(message: Any) -> MotionSample:
    """Take a sensor_msgs/Imu; a rate that is marked absent by its covariance is zero."""
    rate = [0.0, 0.0, 0.0] if _no_gyro(message) else _xyz(message.angular_velocity)
    return MotionSample.from_imu(stamp_of(message.header), _xyz(message.linear_acceleration), rate)


def _no_gyro(message: Any) -> bool:
    return bool(message.angular_velocity_covariance[0] == _ABSENT)


def _xyz(vector: Any) -> list[float]:
    return [vector.x, vector.y, vector.z]
