"""The pose of the IMU from TF: looked up once, never per message."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from slosh_ros.engine.kinematics import Pose
from slosh_ros.errors import InputError

BASE = 'base_link'
_UNIT_TOLERANCE = 1e-3  # of the norm of a quaternion, more than rounding to floats


class TfMounting:
    """
    Listens to TF until it has told the pose of a sensor.

    Parameters
    ----------
    node : Node
        Which listens.

    Raises
    ------
    InputError
        If there is no tf2_ros.
    """

    def __init__(self, node: Any) -> None:
        try:
            import tf2_ros
        except ImportError as error:
            raise InputError(
                f'imu.from_tf is true, but tf2_ros cannot be imported ({error}); install it (on '
                'Ubuntu: apt install ros-jazzy-tf2-ros-py), or set it to false and give imu.xyz '
                'and imu.rpy'
            ) from error
        self._missing = tf2_ros.TransformException
        self._buffer = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._buffer, node)

    def find(self, frame: str) -> Pose | None:
        """
        Pose in base_link of a frame, or None as long as TF does not tell it.

        Raises
        ------
        InputError
            If TF tells something that is no pose.
        """
        from rclpy.time import Time

        try:
            found = self._buffer.lookup_transform(BASE, frame, Time()).transform
        except self._missing:
            return None
        self._listener.unregister()
        t, q = found.translation, found.rotation
        return pose_of((t.x, t.y, t.z), (q.x, q.y, q.z, q.w))


def pose_of(translation: tuple[float, ...], quaternion: tuple[float, ...]) -> Pose:
    """
    Pose of a geometry_msgs/Transform.

    Parameters
    ----------
    translation : tuple of 3 floats
        Origin of the child in the parent [m].
    quaternion : tuple of 4 floats
        x, y, z, w of the rotation that takes vectors from child axes to parent axes.

    Raises
    ------
    InputError
        If a number is not finite or the quaternion is not of unit length.
    """
    x, y, z, w = quaternion
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    if not all(map(math.isfinite, translation)) or not abs(norm - 1.0) < _UNIT_TOLERANCE:
        raise InputError(
            f'TF tells a pose with the translation {translation} and the quaternion {quaternion}, '
            'which is none; mend it, or give imu.xyz and imu.rpy'
        )
    x, y, z, w = (part / norm for part in quaternion)
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    return Pose(rotation, np.array(translation, dtype=float))
