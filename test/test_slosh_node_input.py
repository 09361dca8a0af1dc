"""What slosh_node tells of its input when it is silent, unfit or of two minds."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip('rclpy', reason='needs the ROS 2 wheels (make venv)')

from geometry_msgs.msg import TwistStamped
from rclpy.qos import qos_profile_sensor_data
from ros_rig import NANOSECONDS, QOS, Driver, NodeProcess, diagnostics, imu
from sensor_msgs.msg import Imu

pytestmark = [pytest.mark.ros, pytest.mark.timeout(120)]

START = 100 * NANOSECONDS
STEP = 10_000_000

TANK = """/**:
  ros__parameters:
    tank: {shape: rectangular, length: 8.0, width: 2.0, height: 1.6, fill_ratio: 0.5}
"""


@pytest.fixture
def config(tmp_path: Path) -> Path:
    file = tmp_path / 'tank.yaml'
    file.write_text(TANK)
    return file


def test_an_imu_under_another_name_is_found_and_the_remedy_told(tmp_path, config):
    with (
        Driver(topic='/chassis/imu'),
        NodeProcess('slosh_node', tmp_path / 'node.log', '--params-file', str(config)) as node,
    ):
        node.wait_for(
            'waiting for data on /imu/data (sensor_msgs/msg/Imu); there is one on /chassis/imu: '
            'remap with -r imu/data:=/chassis/imu'
        )


def test_a_publisher_of_another_type_is_named(tmp_path, config):
    with (
        Driver(TwistStamped),
        NodeProcess('slosh_node', tmp_path / 'node.log', '--params-file', str(config)) as node,
    ):
        node.wait_for('/driver publishes geometry_msgs/msg/TwistStamped there')


def test_quality_of_service_that_does_not_fit_is_told_with_the_remedy(tmp_path, config):
    reliable = 'qos_overrides./imu/data.subscription.reliability'
    with (
        NodeProcess(
            'slosh_node', tmp_path / 'node.log', '--params-file', str(config),
            '-p', f'{reliable}:=reliable',
        ) as node,
        Driver(qos=qos_profile_sensor_data) as driver,
    ):  # fmt: skip
        remedy = f'less RELIABILITY than is asked for; set {reliable} to best_effort'
        node.wait_for(remedy)
        seen = diagnostics(driver)
        assert remedy in seen['message']
        assert remedy in seen['QoS']
        assert seen['publishers on /imu/data'] == '0'
        assert node.output.count(remedy) <= 2  # of itself, and as why nothing comes


def test_publishers_are_counted_and_a_second_one_is_named(tmp_path, config):
    with (
        NodeProcess('slosh_node', tmp_path / 'node.log', '--params-file', str(config)) as node,
        Driver() as driver,
    ):
        node.wait_for('ready')
        driver.wait_for_node()
        driver.exchange(imu(START))
        rival = driver.node.create_publisher(Imu, 'imu/data', QOS)
        driver.spin_until(lambda: rival.get_subscription_count() > 0)
        k = 0

        def goes_on() -> bool:
            nonlocal k
            k += 1
            driver.publisher.publish(imu(START + k * STEP))
            driver.spin_for(0.1)
            return '2 publishers on /imu/data: /driver and /driver; only one may' in node.output

        driver.spin_until(goes_on)
        driver.node.destroy_publisher(rival)
        driver.node.destroy_publisher(driver.publisher)
        node.wait_for('no sample on /imu/data for a second; its publisher is gone')
        assert diagnostics(driver)['publishers on /imu/data'] == '0'
        driver.publisher = driver.node.create_publisher(Imu, 'imu/data', QOS)
        driver.spin_until(lambda: driver.publisher.get_subscription_count() > 0)
        driver.exchange(imu(START + (k + 1) * STEP))
