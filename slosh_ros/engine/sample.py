"""The engine's one input, whatever sensor it came from."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slosh_ros.constants import GRAVITY

Array = NDArray[np.float64]


class MotionSample:
    """
    Motion of one point of the vehicle at one instant, in axes fixed to the vehicle.

    The specific force of the point is `force` plus the time derivative of `velocity`: an
    accelerometer gives all of it as `force`; where velocity is measured, it is never
    differentiated on its way to the liquid's state.

    Parameters
    ----------
    stamp : int
        Time of measurement [ns].
    force : array_like, shape (3,)
        Specific force, at rest +g upwards [m/s^2].
    velocity : array_like, shape (3,)
        Velocity of the point [m/s].
    rate : array_like, shape (3,)
        Angular rate [rad/s].

    Attributes
    ----------
    values : tuple of 9 floats
        Force, velocity and rate; plain numbers, of which arrays of three would cost ten times
        more.
    """

    __slots__ = ('stamp', 'values')

    def __init__(self, stamp: int, force: ArrayLike, velocity: ArrayLike, rate: ArrayLike) -> None:
        self.stamp = stamp
        parts = (np.asarray(part, dtype=float).tolist() for part in (force, velocity, rate))
        self.values: tuple[float, ...] = tuple(value for part in parts for value in part)

    @property
    def force(self) -> Array:
        """Specific force, shape (3,) [m/s^2]."""
        return np.array(self.values[:3])

    @property
    def velocity(self) -> Array:
        """Velocity of the point, shape (3,) [m/s]."""
        return np.array(self.values[3:6])

    @property
    def rate(self) -> Array:
        """Angular rate, shape (3,) [rad/s]."""
        return np.array(self.values[6:])

    @classmethod
    def of(cls, stamp: int, values: tuple[float, ...]) -> MotionSample:
        """Take stamp [ns] and values as they are."""
        sample = cls.__new__(cls)
        sample.stamp, sample.values = stamp, values
        return sample

    @classmethod
    def from_imu(
        cls, stamp: int, linear_acceleration: Sequence[float], angular_velocity: Sequence[float]
    ) -> MotionSample:
        """
        Take the fields of a sensor_msgs/Imu (REP-145: gravity included), in sensor axes.

        Parameters
        ----------
        stamp : int
            Time of measurement [ns].
        linear_acceleration : sequence of 3 floats
            Specific force [m/s^2].
        angular_velocity : sequence of 3 floats
            Angular rate [rad/s].
        """
        return cls.of(stamp, (*linear_acceleration, 0.0, 0.0, 0.0, *angular_velocity))

    @classmethod
    def from_twist(
        cls, stamp: int, linear: Sequence[float], angular: Sequence[float]
    ) -> MotionSample:
        """
        Take the fields of a geometry_msgs/Twist of base_link, moving on a level road.

        Surge, sway and yaw count. A twist does not tell how the vehicle pitches, rolls or heaves
        against gravity: hills, the camber of the road, bumps, and the lean of the body on its
        springs in a bend or under the brakes are not seen, and these are left out.

        On a level road it tells what an IMU tells. Of a motion with frequencies up to Omega,
        sampled every h, the waves and the wrench without feed-through are those of an IMU within
        (Omega h)^2 / 6 of their peak, for velocity runs linearly between samples here and
        acceleration there. The acceleration in the loads is the mean over the last interval, late
        by h / 2: the feed-through errs by that much of its rate of change.

        Parameters
        ----------
        stamp : int
            Time of measurement [ns].
        linear : sequence of 3 floats
            Velocity in base_link [m/s].
        angular : sequence of 3 floats
            Angular rate in base_link [rad/s].
        """
        surge, sway, _ = linear
        _, _, yaw = angular
        # omega x v, and gravity
        force = (-yaw * sway, yaw * surge, GRAVITY)
        return cls.of(stamp, (*force, surge, sway, 0.0, 0.0, 0.0, yaw))
