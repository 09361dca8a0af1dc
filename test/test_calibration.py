"""What an IMU at rest tells: its biases, or the tilt of its mount."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from drives import G, engine_of, feed, stamps, totals, wrenches

from slosh_ros.engine import MotionSample
from slosh_ros.engine.calibration import Assumption, Calibration
from slosh_ros.engine.kinematics import Pose
from slosh_ros.engine.parameters import resolved
from slosh_ros.errors import InputError
from slosh_ros.parameters import read_parameter_file

MOUNT = [0.03, -0.4, 2.1]
FORCE_BIAS, RATE_BIAS = np.array([0.2, -0.1, 0.15]), np.array([0.01, -0.02, 0.005])
NOWHERE = np.zeros(3)


def taken(
    mount: list[float],
    force: object,
    rate: object = (0.0, 0.0, 0.0),
    duration: float = 20.0,
    noise: float = 0.02,
) -> Calibration:
    """Take noisy samples; force and rate in axes of the IMU, or functions of time [s]."""
    rng = np.random.default_rng(1)
    calibration = Calibration(Pose.from_xyz_rpy(NOWHERE, np.array(mount)))
    for stamp in stamps(duration, 0.01):
        t = (stamp - stamps(0.0, 1.0)[0]) * 1e-9
        f, w = (np.asarray(v(t) if callable(v) else v) for v in (force, rate))
        shaken = f + noise * rng.normal(size=3), w + 0.1 * noise * rng.normal(size=3)
        calibration.take(MotionSample.from_imu(stamp, *(v.tolist() for v in shaken)))
    return calibration


def at_rest(mount: list[float]) -> np.ndarray:
    return Pose.from_xyz_rpy(NOWHERE, np.array(mount)).rotation.T @ [0.0, 0.0, G]


def test_biases_are_found_whatever_the_mount():
    result = taken(MOUNT, at_rest(MOUNT) + FORCE_BIAS, RATE_BIAS).result()
    # the mean of n samples errs by their deviation over sqrt(n)
    error = 4 * 0.02 / np.sqrt(result.samples)
    assert result.parameters['imu.bias.specific_force'] == pytest.approx(FORCE_BIAS, abs=error)
    assert result.parameters['imu.bias.angular_rate'] == pytest.approx(RATE_BIAS, abs=error)
    assert result.force_deviation == pytest.approx([0.02] * 3, rel=0.1)
    assert 'imu.rpy' not in result.parameters


def test_biases_that_were_found_are_taken_from_the_motion():
    """A biased IMU, calibrated, gives what one without bias gives."""
    drive = lambda t: np.array([np.sin(t), 0.5 * np.sin(2 * t), G])  # noqa: E731
    rate = lambda t: np.array([0.0, 0.0, 0.1 * np.sin(t)])  # noqa: E731
    times = stamps(5.0, 0.01)
    good = feed(engine_of(), times, drive, rate)
    engine = engine_of(
        imu__bias__specific_force=FORCE_BIAS.tolist(), imu__bias__angular_rate=RATE_BIAS.tolist()
    )
    biased = feed(engine, times, lambda t: drive(t) + FORCE_BIAS, lambda t: rate(t) + RATE_BIAS)
    for part in (wrenches, totals):
        scale = np.abs(part(good)).max()
        np.testing.assert_allclose(part(biased) / scale, part(good) / scale, atol=1e-12)
    assert biased[-1].sample.force == pytest.approx(drive(5.0) + FORCE_BIAS)  # as given


@pytest.mark.parametrize('tilt', [[0.1, -0.05, 0.0], [0.0, 0.7, 0.0], [-0.5, 0.3, 0.0]])
@pytest.mark.parametrize('mount', [MOUNT, [np.pi, 0.0, 0.3], [0.0, np.pi / 2, 0.0]])
def test_the_mount_is_tilted_until_gravity_is_upright(tilt, mount):
    """Upside down and on edge too; by the least turn, so that the heading is kept."""
    configured = Pose.from_xyz_rpy(NOWHERE, np.array(mount))
    true = Pose.from_xyz_rpy(NOWHERE, np.array(tilt)).rotation @ configured.rotation
    result = taken(mount, true.T @ [0.0, 0.0, G], RATE_BIAS, noise=0.0).result(Assumption.MOUNT)
    found = Pose.from_xyz_rpy(NOWHERE, np.array(result.parameters['imu.rpy'])).rotation
    assert found @ result.force == pytest.approx([0.0, 0.0, G], abs=1e-12)
    turn = found @ configured.rotation.T
    assert turn[0, 1] == pytest.approx(turn[1, 0], abs=1e-12)  # no turn about the vertical
    # the angle between configured and true vertical, no more
    lean = np.arccos((configured.rotation @ true.T)[2, 2])
    assert np.arccos((np.trace(turn) - 1.0) / 2.0) == pytest.approx(lean, abs=1e-7)


@pytest.mark.parametrize('rpy', [[0.4, -1.1, 2.3], [3.0, 1.5, -3.0], [0.3, -np.pi / 2, 0.0]])
def test_roll_pitch_yaw_are_those_of_urdf(rpy):
    pose = Pose.from_xyz_rpy(NOWHERE, np.array(rpy))
    assert pose.rpy == pytest.approx(rpy, abs=1e-9)


def test_what_was_found_is_a_parameter_file(tmp_path: Path):
    """Read back by the reader of parameter files, to the last digit written."""
    for assumption, key in (
        (Assumption.BIAS, 'imu.bias.specific_force'),
        (Assumption.MOUNT, 'imu.rpy'),
    ):
        result = taken(MOUNT, at_rest(MOUNT) + FORCE_BIAS, 1e-7 * RATE_BIAS).result(assumption)
        file = tmp_path / 'found.yaml'
        file.write_text(result.yaml())
        _, values = resolved(read_parameter_file(file, 'slosh_node'))
        for name in (key, 'imu.bias.angular_rate'):
            assert values.vector(name) == pytest.approx(result.parameters[name], abs=1e-9)


@pytest.mark.parametrize(
    ('given', 'says'),
    [
        ({'duration': 3.0}, r'has 301 samples over 3\.0 s; it needs 50 over 5 s'),
        ({'force': lambda t: (2.0 * np.sin(9.0 * t), 0.0, G)},
         r'specific force varied by 1\.41 m/s\^2 \(standard deviation\), at most 1'),
        ({'rate': lambda t: (0.0, 0.2 * np.sin(9.0 * t), 0.0)}, r'angular rate varied by 0\.14'),
        ({'force': lambda t: (0.01 * t, 0.0, G)},
         r'specific force drifted by 0\.2\d* m/s\^2, at most 0\.05'),
        ({'rate': lambda t: (0.0, 0.0, 0.001 * t)}, r'angular rate drifted by 0\.02'),
        ({'rate': (0.0, 0.0, 0.2)}, 'an angular rate of 0.2 rad/s, more than a bias'),
        ({'force': (0.0, 0.0, 0.0)}, r'of 0\.0\d+ m/s\^2, not 9\.81: the IMU must include grav'),
        ({'force': (0.0, 0.0, 1.0)}, r'of 0.999 m/s\^2, not 9\.81'),
        ({'force': (2.0, 0.0, 9.6)}, r'a bias of 2 m/s\^2, at most 1: .* calibrate the mount'),
        ({'force': (0.0, 0.0, -G), 'assumption': Assumption.MOUNT}, 'upside down against imu.rpy'),
    ],
)  # fmt: skip
def test_what_is_not_to_be_believed_is_refused(given, says):
    given = {'mount': [0.0] * 3, 'force': (0.0, 0.0, G)} | given
    assumption = given.pop('assumption', Assumption.BIAS)
    with pytest.raises(InputError, match=says):
        taken(**given).result(assumption)
