"""The engine's one input, whatever sensor it came from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MotionSample:
    """
    Motion of one point of the vehicle at one instant, in axes fixed to the vehicle.

    The specific force of the point is `force` plus the time derivative of `velocity`: an
    accelerometer gives all of it as `force`; where velocity is measured, it is never
    differentiated on its way to the liquid's state.

    Attributes
    ----------
    stamp : int
        Time of measurement [ns].
    force : array, shape (3,)
        Specific force, at rest +g upwards [m/s^2].
    velocity : array, shape (3,)
        Velocity of the point [m/s].
    rate : array, shape (3,)
        Angular rate [rad/s].
    """

    stamp: int
    force: Array
    velocity: Array
    rate: Array

    @classmethod
    def from_imu(
        cls, stamp: int, linear_acceleration: list[float], angular_velocity: list[float]
    ) -> MotionSample:
        """
        Take the fields of a sensor_msgs/Imu (REP-145: gravity included), in sensor axes.

        Parameters
        ----------
        stamp : int
            Time of measurement [ns].
        linear_acceleration : list of 3 floats
            Specific force [m/s^2].
        angular_velocity : list of 3 floats
            Angular rate [rad/s].
        """
        return cls(stamp, np.array(linear_acceleration), np.zeros(3), np.array(angular_velocity))

    @classmethod
    def from_twist(cls, stamp: int, linear: list[float], angular: list[float]) -> MotionSample:
        """
        Take the fields of a geometry_msgs/Twist of base_link, moving on a level road.

        Surge, sway and yaw count; a Twist does not tell how the vehicle pitches, rolls or heaves
        against gravity, so these are left out.

        Parameters
        ----------
        stamp : int
            Time of measurement [ns].
        linear : list of 3 floats
            Velocity in base_link [m/s].
        angular : list of 3 floats
            Angular rate in base_link [rad/s].
        """
        surge, sway, _ = linear
        _, _, yaw = angular
        return cls(
            stamp,
            np.array([-yaw * sway, yaw * surge, GRAVITY]),  # omega x v, and gravity
            np.array([surge, sway, 0.0]),
            np.array([0.0, 0.0, yaw]),
        )
