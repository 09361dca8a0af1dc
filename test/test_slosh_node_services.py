"""slosh_node's services over DDS: enabling, resetting and calibrating."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs the ROS 2 wheels (make venv)')

from ros_rig import NANOSECONDS, Driver, NodeProcess, call, diagnostics, imu, stamp_of, wrench_of
from std_srvs.srv import SetBool, Trigger

from slosh_ros.engine import SloshConfig
from slosh_ros.parameters import read_parameter_file

pytestmark = [pytest.mark.ros, pytest.mark.timeout(120)]

START = 100 * NANOSECONDS
STEP = 10_000_000

TANK = """/**:
  ros__parameters:
    tank: {shape: rectangular, length: 8.0, width: 2.0, height: 1.6, fill_ratio: 0.5}
    calibration.duration: 5.0
"""


@pytest.fixture
def config(tmp_path: Path) -> Path:
    file = tmp_path / 'tank.yaml'
    file.write_text(TANK)
    return file


def test_disabled_node_is_silent_and_starts_from_rest_when_enabled(tmp_path, config):
    with (
        NodeProcess('slosh_node', tmp_path / 'node.log', '--params-file', str(config)) as node,
        Driver() as driver,
    ):
        node.wait_for('ready')
        driver.wait_for_node()
        for k in range(20):
            driver.exchange(imu(START + k * STEP, (1.0, 0.0, 9.81)))
        first, moving = driver.received['wrench'][0], driver.received['wrench'][-1]
        assert wrench_of(moving) != wrench_of(first)

        answer = call(driver, SetBool, 'slosh_node/set_enabled', SetBool.Request(data=False))
        assert answer.success
        for k in range(20, 25):
            driver.publisher.publish(imu(START + k * STEP, (1.0, 0.0, 9.81)))
        seen = diagnostics(driver)
        assert seen['message'].startswith('disabled by ~/set_enabled')
        assert seen['not used: disabled by ~/set_enabled'] == '5'
        assert seen['accepted'] == '19'
        assert len(driver.received['wrench']) == 20

        assert call(driver, SetBool, 'slosh_node/set_enabled', SetBool.Request(data=True)).success
        slosh, _ = driver.exchange(imu(START + 25 * STEP, (1.0, 0.0, 9.81)))
        assert stamp_of(slosh) == START + 25 * STEP
        assert wrench_of(slosh) == wrench_of(first)
        assert diagnostics(driver)['started from rest'] == '2'


@pytest.mark.parametrize('finds', ['bias', 'mount'])
def test_calibration_answers_when_it_is_done_and_its_file_is_taken(tmp_path, config, finds):
    """A call that waits does not hold up the node: every sample meanwhile gets its wrench."""
    file = tmp_path / 'found.yaml'
    noise = np.random.default_rng(3)
    with (
        NodeProcess(
            'slosh_node', tmp_path / 'node.log', '--params-file', str(config),
            '-p', f'calibration.file:={file}', '-p', f'calibration.finds:={finds}',
        ) as node,
        Driver() as driver,
    ):  # fmt: skip
        node.wait_for('ready')
        driver.wait_for_node()
        driver.exchange(imu(START))
        client = driver.node.create_client(Trigger, 'slosh_node/calibrate')
        driver.spin_until(client.service_is_ready)
        future = client.call_async(Trigger.Request())
        k = 0
        while not future.done():
            k += 1
            force = np.array([0.30, -0.20, 9.80]) + noise.normal(0.0, 0.02, 3)
            rate = np.array([0.010, -0.004, 0.002]) + noise.normal(0.0, 0.002, 3)
            driver.exchange(imu(START + k * 4 * STEP, tuple(force), tuple(rate)))
            assert k < 1000
        answer = future.result()
        assert answer.success, answer.message
        assert str(file) in answer.message
        assert len(driver.received['wrench']) >= 125
    found = read_parameter_file(file, 'slosh_node')
    assert found['imu.bias.angular_rate'] == pytest.approx([0.010, -0.004, 0.002], abs=1e-3)
    if finds == 'bias':
        assert found['imu.bias.specific_force'] == pytest.approx([0.3, -0.2, -0.01], abs=0.01)
    else:
        assert found['imu.rpy'] == pytest.approx([-0.0204, -0.0306, 0.0], abs=2e-3)
    given = read_parameter_file(config, 'slosh_node') | found
    SloshConfig.from_parameters(given)


def test_calibration_of_a_moving_vehicle_is_refused_with_the_reason(tmp_path, config):
    file = tmp_path / 'found.yaml'
    with (
        NodeProcess(
            'slosh_node', tmp_path / 'node.log', '--params-file', str(config),
            '-p', f'calibration.file:={file}',
        ) as node,
        Driver() as driver,
    ):  # fmt: skip
        node.wait_for('ready')
        driver.wait_for_node()
        driver.exchange(imu(START))
        client = driver.node.create_client(Trigger, 'slosh_node/calibrate')
        driver.spin_until(client.service_is_ready)
        future = client.call_async(Trigger.Request())
        k = 0
        while not future.done():
            k += 1
            driver.exchange(imu(START + k * 10 * STEP, (2.0 * np.sin(0.3 * k), 0.0, 9.81)))
            assert k < 1000
        assert not future.result().success
        assert 'at rest' in future.result().message
        assert not file.exists()
        # a call in the middle of which the node is told to end does not keep it
        client.call_async(Trigger.Request())
        driver.spin_for(0.2)
        assert node.stop() == 0
        assert 'Traceback' not in node.output
