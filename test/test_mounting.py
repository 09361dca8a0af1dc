"""The IMU's pose from TF: the mathematics of it, and what is said where there is no TF."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from slosh_ros.engine.kinematics import Pose
from slosh_ros.errors import InputError
from slosh_ros.ros.mounting import pose_of


def test_quaternion_is_the_rotation_that_scipy_makes_of_it():
    for quaternion in np.random.default_rng(1).normal(size=(50, 4)):
        quaternion /= np.linalg.norm(quaternion)
        pose = pose_of((1.0, 2.0, 3.0), tuple(quaternion))
        expected = Rotation.from_quat(quaternion).as_matrix()
        np.testing.assert_allclose(pose.rotation, expected, atol=1e-14)
        assert pose.origin.tolist() == [1.0, 2.0, 3.0]


def test_pose_is_that_of_the_same_urdf_origin():
    """Roll, pitch, yaw about fixed axes: what robot_state_publisher makes of rpy."""
    rpy = np.array([0.1, -0.7, 2.0])
    quaternion = Rotation.from_euler('xyz', rpy).as_quat()
    ours, urdf = pose_of((0.3, 0.0, -1.0), tuple(quaternion)), Pose.from_xyz_rpy(np.zeros(3), rpy)
    np.testing.assert_allclose(ours.rotation, urdf.rotation, atol=1e-14)


def test_a_quarter_turn_to_the_left_takes_forward_to_left():
    half = math.sqrt(0.5)
    pose = pose_of((0.0, 0.0, 0.0), (0.0, 0.0, half, half))
    np.testing.assert_allclose(pose.rotation @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-15)


@pytest.mark.parametrize(
    ('translation', 'quaternion'),
    [
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)),
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 2.0)),
        ((0.0, math.nan, 0.0), (0.0, 0.0, 0.0, 1.0)),
        ((0.0, 0.0, 0.0), (0.0, 0.0, math.nan, 1.0)),
    ],
)
def test_what_is_no_pose_is_refused(translation, quaternion):
    with pytest.raises(InputError, match=r'which is none; mend it, or give imu\.xyz'):
        pose_of(translation, quaternion)
