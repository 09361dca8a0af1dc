"""The IMU's pose from TF: the mathematics of it, and what is said where there is no TF."""

from __future__ import annotations

import math
from importlib.util import find_spec

import numpy as np
import pytest
from drives import RECTANGLE, G, engine_of, feed, stamps
from scipy.spatial.transform import Rotation

from slosh_ros.engine import MotionSample, SloshConfig, SloshEngine
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


@pytest.mark.parametrize('high_pass', [0.0, 0.05])
def test_engine_that_is_mounted_later_equals_one_that_always_was(high_pass):
    turned = {'imu.xyz': [1.0, 0.2, 0.5], 'imu.rpy': [0.02, -0.1, 0.4]}
    config = SloshConfig.from_parameters(RECTANGLE | turned | {'imu.high_pass': high_pass})
    at_once, later = SloshEngine(config), engine_of(imu__high_pass=high_pass)
    feed(later, stamps(0.5, 0.01), (0.4, 0.0, G))
    later.mount(config.imu)
    for k, stamp in enumerate(stamps(1.0, 0.01)):
        force, rate = [0.1 * k, -0.5, G], [0.01, 0.02, 0.001 * k]
        sample = MotionSample.from_imu(stamp, force, rate)
        one, other = at_once.feed(sample), later.feed(sample)
        assert one[0] is other[0]
        assert one[1].total.tolist() == other[1].total.tolist()
        assert one[1].wrench.tolist() == other[1].wrench.tolist()


@pytest.mark.ros
def test_without_tf2_the_node_says_what_to_do(tmp_path):
    """On the wheels there is no tf2_ros: the import really fails."""
    pytest.importorskip('rclpy', reason='needs the ROS 2 wheels (make venv)')
    if find_spec('tf2_ros'):
        pytest.skip('there is a tf2_ros here')
    from ros_rig import NodeProcess

    file = tmp_path / 'tank.yaml'
    file.write_text(
        '/**: {ros__parameters: {tank: {shape: sphere, radius: 1.0, fill_ratio: 0.5}}}\n'
    )
    with NodeProcess(
        'slosh_node', tmp_path / 'node.log', '--params-file', str(file), '-p', 'imu.from_tf:=true'
    ) as node:
        assert node.exit_code() == 1
        (line,) = node.output.splitlines()
        assert line.startswith('error: imu.from_tf is true, but tf2_ros cannot be imported')
        assert 'give imu.xyz and imu.rpy' in line
