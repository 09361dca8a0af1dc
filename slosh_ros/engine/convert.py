"""
From a message's fields to the engine, for live and recorded messages alike.

rclpy and rosbags give different classes with the same fields; nothing here imports either.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import NANOSECONDS
from slosh_ros.engine.engine import SloshEngine
from slosh_ros.engine.gate import Verdict
from slosh_ros.engine.loads import Loads, LoadsBlock
from slosh_ros.engine.sample import MotionSample

Array = NDArray[np.float64]

IMU, TWIST, TWIST_STAMPED = 'sensor_msgs/Imu', 'geometry_msgs/Twist', 'geometry_msgs/TwistStamped'
FILL = 'std_msgs/Float64'

ABSENT = -1.0  # covariance[0] of a quantity that the sensor does not measure (sensor_msgs/Imu)

FRAME_CHANGES = (
    'frame_id changes in mid-drive: more than one IMU on the topic? imu.xyz and imu.rpy are those '
    'of one; name its frame in input.imu_frame'
)


class ImuReading(NamedTuple):
    """
    What the engine takes of a sensor_msgs/Imu.

    Attributes
    ----------
    stamp : int
        Time of measurement [ns].
    frame : str
        The frame_id.
    force, rate : tuple of 3 floats
        Specific force [m/s^2] and angular rate [rad/s].
    force_covariance, rate_covariance : float
        First elements of their covariances; -1 marks a quantity that is not measured.
    """

    stamp: int
    frame: str
    force: tuple[float, float, float]
    rate: tuple[float, float, float]
    force_covariance: float
    rate_covariance: float

    @classmethod
    def of(cls, message: Any) -> ImuReading:
        """Take a message from rclpy or rosbags."""
        return cls(
            stamp_of(message.header),
            message.header.frame_id,
            _xyz(message.linear_acceleration),
            _xyz(message.angular_velocity),
            message.linear_acceleration_covariance[0],
            message.angular_velocity_covariance[0],
        )

    def sample(self) -> MotionSample:
        """Return the motion; a rate that is marked absent is zero."""
        rate = (0.0, 0.0, 0.0) if self.rate_covariance == ABSENT else self.rate
        return MotionSample.from_imu(self.stamp, self.force, rate)


def input_type(engine: SloshEngine) -> str:
    """Message type that the engine's configuration asks for."""
    config = engine.config
    if config.source == 'imu':
        return IMU
    return TWIST_STAMPED if config.twist_stamped else TWIST


def fill_topics(engine: SloshEngine) -> dict[str, str]:
    """Topic of each tank's fill, a std_msgs/Float64, under the name of the node."""
    names = [tank.config.name for tank in engine.tanks]
    return {name: f'{name}/fill' if len(names) > 1 else 'fill' for name in names}


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
        With the fields of the message type, from rclpy or rosbags, or an :class:`ImuReading`.
    received : int
        Time of arrival [ns]; stamps a message that has no stamp of its own.
    """
    kind = input_type(engine)
    if kind == IMU:
        reading = message if isinstance(message, ImuReading) else ImuReading.of(message)
        return _feed_imu(engine, reading)
    twist = message if kind == TWIST else message.twist
    stamp = received if kind == TWIST else stamp_of(message.header)
    return engine.feed(MotionSample.from_twist(stamp, _xyz(twist.linear), _xyz(twist.angular)))


def feed_readings(
    engine: SloshEngine, stamps: Sequence[int], frame: str, values: Array
) -> LoadsBlock | None:
    """
    Feed many Imu messages of one frame in which nothing is absent.

    Parameters
    ----------
    engine : SloshEngine
        The engine.
    stamps : sequence of k ints
        Times of measurement [ns].
    frame : str
        The frame_id of all of them.
    values : array, shape (k, 9)
        As of :class:`MotionSample`.

    Returns
    -------
    LoadsBlock or None
        Of k samples; None, with nothing done, if they have to be fed one by one; see
        `SloshEngine.feed_all`.
    """
    wanted = engine.config.imu_frame
    if (wanted and frame != wanted) or not engine.gate.of_frame(frame):
        return None
    return engine.feed_all(stamps, values)


def _feed_imu(engine: SloshEngine, reading: ImuReading) -> tuple[Verdict, Loads | None]:
    wanted, frame = engine.config.imu_frame, reading.frame
    if wanted and frame != wanted:
        return engine.gate.refuse(Verdict.WRONG_FRAME), None
    if engine.gate.changes_frame(frame):
        engine.warnings[FRAME_CHANGES] += 1
    if reading.force_covariance == ABSENT:
        return engine.gate.refuse(Verdict.NO_DATA), None
    if reading.rate_covariance == ABSENT:
        engine.warnings['gyro marked absent by its covariance: rate taken as zero'] += 1
    return engine.feed(reading.sample())


def imu_sample(message: Any) -> MotionSample:
    """Take a sensor_msgs/Imu; a rate that is marked absent by its covariance is zero."""
    return ImuReading.of(message).sample()


def _xyz(vector: Any) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z
