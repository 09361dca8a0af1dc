"""Where things sit on the vehicle, and what one measured point means for another."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slosh_ros.modal.loads import cross_matrix

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Pose:
    """
    Pose of a child frame in a parent frame.

    Attributes
    ----------
    rotation : array, shape (3, 3)
        Takes vectors from child axes to parent axes.
    origin : array, shape (3,)
        Origin of the child in the parent [m].
    """

    rotation: Array
    origin: Array

    @classmethod
    def identity(cls) -> Pose:
        """Child and parent coincide."""
        return cls(np.eye(3), np.zeros(3))

    @classmethod
    def from_xyz_rpy(cls, xyz: Array, rpy: Array) -> Pose:
        """Build from a URDF origin: position [m]; roll, pitch, yaw about fixed axes [rad]."""
        (sr, sp, sy), (cr, cp, cy) = np.sin(rpy), np.cos(rpy)
        rotation = np.array(
            [
                [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                [-sp, cp * sr, cp * cr],
            ]
        )
        return cls(rotation, np.asarray(xyz, dtype=float))

    @property
    def rpy(self) -> Array:
        """Roll, pitch, yaw about fixed axes [rad], shape (3,); without yaw if x is vertical."""
        r = self.rotation
        flat = math.hypot(r[0, 0], r[1, 0])
        pitch = math.atan2(-r[2, 0], flat)
        if flat < 1e-9:
            return np.array([math.atan2(-r[1, 2], r[1, 1]), pitch, 0.0])
        return np.array([math.atan2(r[2, 1], r[2, 2]), pitch, math.atan2(r[1, 0], r[0, 0])])

    def seen_from(self, other: Pose) -> Pose:
        """Return this pose in the axes of another child of the same parent."""
        to_other = other.rotation.T
        return Pose(to_other @ self.rotation, to_other @ (self.origin - other.origin))

    def offset(self, step: Array) -> Pose:
        """Return a pose whose origin is moved by `step`, in child axes [m]."""
        return Pose(self.rotation, self.origin + self.rotation @ step)


class Lever:
    """
    What a sensor means for the origin of another frame on the same body.

    Parameters
    ----------
    sensor : Pose
        Of the sensor in that frame.

    Attributes
    ----------
    rotation : array, shape (3, 3)
        Takes vectors from sensor axes to the axes of the frame.
    arm : array, shape (3,)
        Position of the sensor in the frame [m].
    cross : array, shape (3, 3)
        The matrix [arm x].
    """

    def __init__(self, sensor: Pose) -> None:
        self.rotation = sensor.rotation
        self.arm = sensor.origin
        self.cross = cross_matrix(sensor.origin)

    def carried(self, rate: Array, acceleration: Array) -> Array:
        """
        Carry an acceleration from the sensor to the origin of the frame.

        Parameters
        ----------
        rate : array, shape (3,)
            Angular rate, in sensor axes [rad/s].
        acceleration : array, shape (2, 3)
            Specific force of the sensor's point [m/s^2] and angular acceleration [rad/s^2], in
            sensor axes.

        Returns
        -------
        array, shape (6,)
            Specific force of the origin and angular acceleration, in the axes of the frame.
        """
        at_sensor, alpha = acceleration @ self.rotation.T
        turning = centripetal(self.rotation @ rate, self.arm)
        # the origin lies at -arm from the sensor's point
        return np.concatenate([at_sensor + self.cross @ alpha - turning, alpha])


def centripetal(rate: Array, arm: Array) -> Array:
    """Centripetal acceleration omega x (omega x r); np.cross would cost ten times more."""
    return (rate @ arm) * rate - (rate @ rate) * arm


def centripetal_matrix(arm: Array) -> Array:
    """
    Matrix of omega x (omega x r) on the squares and products of the rate.

    Returns
    -------
    array, shape (3, 6)
        Per xx, yy, zz, xy, xz, yz of omega; the products of :func:`products`.
    """
    x, y, z = arm
    return np.array(
        [
            [0.0, -x, -x, y, z, 0.0],
            [-y, 0.0, -y, x, 0.0, z],
            [-z, -z, 0.0, 0.0, x, y],
        ]
    )


def products(x: float, y: float, z: float) -> tuple[float, float, float, float, float, float]:
    """Squares and products xx, yy, zz, xy, xz, yz."""
    return x * x, y * y, z * z, x * y, x * z, y * z


class HighPass:
    """
    Takes what hardly changes from the motion of a sensor: a lean of its mount, biases, drift.

    All inputs but velocity and the vertical specific force pass a first-order high-pass, y' = x' -
    corner y, exactly for input that runs linearly from sample to sample. It is one filter for
    forces, rates and their products, and so commutes with turning and moving the sensor: force
    and rate tell of one motion as before. Gravity, and what is slow along it, stays.

    The price: of a constant horizontal acceleration, exp(-corner t) is left after the time t.

    Parameters
    ----------
    corner : float
        Corner frequency [Hz].
    up : array, shape (3,)
        The vertical of the vehicle, in axes of the sensor.
    """

    def __init__(self, corner: float, up: Array) -> None:
        self._corner = 2.0 * math.pi * corner
        self._kept = np.zeros((15, 15))  # of the slow part: the vertical force and the velocity
        self._kept[:3, :3] = np.outer(up, up)
        self._kept[3:6, 3:6] = np.eye(3)
        self._last: Array = np.zeros(15)
        self._fast: Array = np.zeros(15)

    def follow(self, motion: Sequence[float], interval: float) -> list[float]:
        """
        Take force, velocity, rate and products (15 numbers) after an interval [s].

        An interval of 0 starts anew: what is measured then is taken for what hardly changes.
        """
        now = np.array(motion)
        if interval == 0.0:
            self._fast = np.zeros(15)
        else:
            x = self._corner * interval
            self._fast = math.exp(-x) * self._fast - math.expm1(-x) / x * (now - self._last)
        self._last = now
        passed: list[float] = (self._fast + self._kept @ (now - self._fast)).tolist()
        return passed


class AccelerationFilter:
    """
    Specific force and angular acceleration of the sensor's point, for the loads only.

    Rates are differentiated backwards over the last interval; both quantities pass a first-order
    low-pass if the cutoff [Hz] is not zero.
    """

    def __init__(self, cutoff: float) -> None:
        self._corner = 2.0 * math.pi * cutoff
        self._last: tuple[float, ...] = (0.0,) * 6
        self._followed: tuple[float, ...] = self._last

    def follow(self, motion: Sequence[float], interval: float) -> tuple[float, ...]:
        """
        Take force, velocity and rate (3 numbers each) after an interval [s]; 0 starts anew.

        Returns
        -------
        tuple of 6 floats
            Specific force [m/s^2] and angular acceleration [rad/s^2].
        """
        fx, fy, fz, vx, vy, vz, wx, wy, wz = motion
        followed: tuple[float, ...]
        if interval == 0.0:
            followed = (fx, fy, fz, 0.0, 0.0, 0.0)
        else:
            ux, uy, uz, ox, oy, oz = self._last
            followed = (
                fx + (vx - ux) / interval,
                fy + (vy - uy) / interval,
                fz + (vz - uz) / interval,
                (wx - ox) / interval,
                (wy - oy) / interval,
                (wz - oz) / interval,
            )
            if self._corner:
                keep = math.exp(-self._corner * interval)
                pairs = zip(followed, self._followed, strict=True)
                followed = tuple(now + keep * (before - now) for now, before in pairs)
        self._last, self._followed = (vx, vy, vz, wx, wy, wz), followed
        return followed

    def follow_all(self, motion: Array, intervals: Sequence[float]) -> Array:
        """Take k motions, shape (k, 9), as `follow` does one by one; shape (k, 6)."""
        if self._corner:
            rows = zip(motion.tolist(), intervals, strict=True)
            return np.array([self.follow(*row) for row in rows])
        carried = np.vstack([[self._last], motion[:, 3:]])
        followed = np.diff(carried, axis=0) / np.array(intervals)[:, np.newaxis]
        followed[:, :3] += motion[:, :3]
        self._last, self._followed = tuple(carried[-1].tolist()), tuple(followed[-1].tolist())
        return np.asarray(followed)
