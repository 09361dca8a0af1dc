"""vehicle_node and slosh_node as two processes over DDS, against the one-process solution."""

from __future__ import annotations

import signal
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs the ROS 2 wheels (make venv)')

from conftest import REPOSITORY
from geometry_msgs.msg import TwistStamped
from ros_rig import Driver, NodeProcess, stamp_of
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu

from slosh_ros.study.demo import closed_loop_reference

pytestmark = [pytest.mark.ros, pytest.mark.timeout(180)]

SCENARIOS = REPOSITORY / 'config' / 'scenarios'
SECOND = 1_000_000_000


def drive(folder: Path, scenario: Path, *parameters: str) -> np.ndarray:
    """Run both nodes to the end of the manoeuvre and return the history."""
    folder.mkdir(exist_ok=True)
    log = folder / 'history.csv'
    common = ('--params-file', str(scenario))
    with (
        NodeProcess('slosh_node', folder / 'slosh.log', *common) as slosh,
        NodeProcess(
            'vehicle_node', folder / 'vehicle.log', *common, '-p', f'log_file:={log}', *parameters
        ) as vehicle,
    ):
        vehicle.wait_for('the manoeuvre is over', timeout=90.0)
        assert vehicle.exit_code() == 0, vehicle.output
        assert slosh.stop() == 0, slosh.output
    return np.genfromtxt(log, delimiter=',', names=True)


def relative(error: np.ndarray, reference: np.ndarray) -> float:
    """Root mean square of an error over that of the reference."""
    return float(np.sqrt(np.mean(error**2) / np.mean(reference**2)))


@pytest.mark.parametrize('name', ['brake', 'brake_bump', 'brake_pit', 'accelerate'])
def test_two_nodes_agree_with_one_process(tmp_path, name):
    scenario = SCENARIOS / f'{name}.yaml'
    history = drive(tmp_path, scenario)
    truth = closed_loop_reference(scenario)
    np.testing.assert_allclose(history['t'], truth.time, atol=1e-9)
    assert relative(history['theta_s'] - truth.q[:, 3], truth.q[:, 3]) < 1e-4
    assert relative(history['fx'] - truth.f1, truth.f1) < 1e-4
    assert relative(history['my'] - truth.m5, truth.m5) < 1e-4
    assert relative(history['fz_3'] - truth.axle_loads[:, 2], truth.axle_loads[:, 2]) < 1e-3


def test_every_run_gives_the_same_bytes(tmp_path):
    scenario = SCENARIOS / 'brake_bump.yaml'
    for name in ('one', 'two'):
        drive(tmp_path / name, scenario, '-p', 'duration:=3.0')
    one, two = ((tmp_path / name / 'history.csv').read_bytes() for name in ('one', 'two'))
    assert one == two


def test_the_bump_pushes_the_sloshing_force_up_as_in_figure_12(tmp_path):
    """Bump and pit raise the peak of F1 over the flat road; no braking alone reaches it."""
    peaks = {name: closed_loop_reference(SCENARIOS / f'{name}.yaml').f1.max() for name in (
        'brake', 'brake_bump', 'brake_pit')}  # fmt: skip
    assert peaks['brake_bump'] > 1.05 * peaks['brake']
    assert peaks['brake_pit'] > 1.05 * peaks['brake']


def test_what_the_vehicle_publishes(tmp_path):
    """REP-145 specific force with +g at rest, a falling speed, and a clock that only rises."""
    scenario = str(SCENARIOS / 'brake_bump.yaml')
    log = tmp_path / 'log'
    with Driver() as driver:
        heard: dict[str, list] = {}
        for kind, topic in ((Imu, 'imu/data'), (TwistStamped, 'twist'), (Clock, '/clock')):
            driver.node.create_subscription(kind, topic, heard.setdefault(topic, []).append, 2000)
        with (
            NodeProcess('slosh_node', log, '--params-file', scenario),
            NodeProcess('vehicle_node', tmp_path / 'v', '--params-file', scenario) as vehicle,
        ):
            driver.spin_until(
                lambda: 'is over' in vehicle.output and len(heard['imu/data']) > 900, 60.0
            )
            driver.spin_for(0.5)
    # a driver that is discovered late misses the first messages
    time = {
        topic: [stamp_of(m) / SECOND - 1.0 for m in heard[topic]]
        for topic in ('imu/data', 'twist')
    }
    assert {m.header.frame_id for m in heard['imu/data']} == {'base_link'}
    assert {m.orientation_covariance[0] for m in heard['imu/data']} == {-1.0}
    before_the_bump = [
        m.linear_acceleration.z
        for t, m in zip(time['imu/data'], heard['imu/data'], strict=True)
        if t < 1.0
    ]
    np.testing.assert_allclose(before_the_bump, 9.81, atol=0.1)
    plateau = [m for m in heard['imu/data'] if 4.0 < stamp_of(m) / SECOND - 1.0 < 5.0]
    force = np.mean([m.linear_acceleration.x for m in plateau])
    assert force < -0.98  # braking, and gravity of the nose-down pitch on top
    speeds = [m.twist.linear.x for m in heard['twist']]
    truth = closed_loop_reference(SCENARIOS / 'brake_bump.yaml')
    pitch, heave_rate = truth.q[:, 3], truth.q_rate[:, 2]
    ahead = np.cos(pitch) * truth.speed - np.sin(pitch) * heave_rate  # in pitching axes
    expected = np.interp(time['twist'], truth.time, ahead)
    np.testing.assert_allclose(speeds, expected, atol=1e-3)
    clock = [m.clock.sec * SECOND + m.clock.nanosec for m in heard['/clock']]
    assert len(clock) > 900
    assert np.all(np.diff(clock) == SECOND // 100)


def test_a_solid_cargo_drives_alone(tmp_path):
    log = tmp_path / 'history.csv'
    scenario = SCENARIOS / 'brake_bump.yaml'
    with NodeProcess(
        'vehicle_node', tmp_path / 'v', '--params-file', str(scenario),
        '-p', 'cargo:=solid', '-p', f'log_file:={log}',
    ) as vehicle:  # fmt: skip
        assert vehicle.exit_code() == 0, vehicle.output
        assert 'WARN' not in vehicle.output  # nobody misses a liquid
    history = np.genfromtxt(log, delimiter=',', names=True)
    truth = closed_loop_reference(scenario, solid=True)
    np.testing.assert_allclose(history['theta_s'], truth.q[:, 3], atol=1e-9)
    assert np.all(history['fx'] == 0.0)


def test_a_coupling_in_another_frame_is_refused(tmp_path):
    scenario = str(SCENARIOS / 'brake.yaml')
    with (
        NodeProcess(
            'slosh_node', tmp_path / 's', '--params-file', scenario,
            '-p', 'frames.output:=tank_link',
        ),
        NodeProcess('vehicle_node', tmp_path / 'v', '--params-file', scenario) as vehicle,
    ):  # fmt: skip
        assert vehicle.exit_code() == 1
        assert 'set its frames.output to base_link' in vehicle.output
        assert 'Traceback' not in vehicle.output


def test_a_liquid_the_truck_does_not_carry_is_refused(tmp_path):
    scenario = str(SCENARIOS / 'brake.yaml')
    with (
        NodeProcess(
            'slosh_node', tmp_path / 's', '--params-file', scenario, '-p', 'tank.density:=3000.0'
        ),
        NodeProcess('vehicle_node', tmp_path / 'v', '--params-file', scenario) as vehicle,
    ):
        assert vehicle.exit_code() == 1
        assert 'exceeds the truck' in vehicle.output


@pytest.mark.parametrize(
    ('arguments', 'says'),
    [
        (['-p', 'vehicle:=general'], 'run it with slosh simulate'),
        (['-p', 'bump.hight:=0.1'], 'bump.hight is not a parameter; did you mean bump.height?'),
        (['-p', 'speed:=10'], 'speed has the integer 10 where ROS 2 wants a double; write 10.0'),
        (['-p', 'speed:=0.5'], 'shorten the ramp'),
        (['-p', 'log_file:=/no/such/folder/x.csv'], 'x.csv cannot be written'),
    ],
)  # fmt: skip
def test_bad_scenarios_end_in_one_clear_message(tmp_path, arguments, says):
    with NodeProcess('vehicle_node', tmp_path / 'v', *arguments) as vehicle:
        assert vehicle.exit_code() == 1
        assert vehicle.output.startswith('error: ')
        assert says in vehicle.output
        assert vehicle.output.count('\n') == 1, vehicle.output


def test_slosh_node_killed_and_restarted(tmp_path):
    """The vehicle drives on, says that its cargo is frozen, and frees it again."""
    scenario = str(SCENARIOS / 'brake_bump.yaml')
    common = ('--params-file', scenario)
    log = tmp_path / 'history.csv'
    with NodeProcess(
        'vehicle_node', tmp_path / 'v', *common, '-p', 'patience:=0.2', '-p', 'duration:=60.0',
        '-p', f'log_file:={log}',
    ) as vehicle:  # fmt: skip
        with NodeProcess('slosh_node', tmp_path / 's1', *common) as first:
            vehicle.wait_for('driving')
            first.stop(signal.SIGKILL)
        vehicle.wait_for('no liquid: the cargo is frozen')
        with NodeProcess('slosh_node', tmp_path / 's2', *common):
            vehicle.wait_for('the liquid answers again')
            vehicle.wait_for('s: the liquid answers\n')
            vehicle.wait_for('the manoeuvre is over', timeout=90.0)
            assert vehicle.exit_code() == 0, vehicle.output
    history = np.genfromtxt(log, delimiter=',', names=True)
    assert len(history) == 6001
    assert all(np.isfinite(history[name]).all() for name in history.dtype.names)
    assert np.abs(history['theta_s']).max() < 0.5


def test_free_running_in_wall_time(tmp_path):
    history = drive(tmp_path, SCENARIOS / 'brake.yaml', '-p', 'pace:=wall', '-p', 'duration:=3.0')
    truth = closed_loop_reference(SCENARIOS / 'brake.yaml')
    n = len(history)
    assert n == 301
    # a busy machine delays messages; the exchange bears it
    assert relative(history['theta_s'] - truth.q[:n, 3], truth.q[:n, 3]) < 0.2


def test_a_second_run_with_the_same_slosh_node(tmp_path):
    """Its stamps begin anew; the vehicle resets the liquid first, and both runs are the same."""
    scenario = ('--params-file', str(SCENARIOS / 'brake.yaml'), '-p', 'duration:=0.5')
    with NodeProcess('slosh_node', tmp_path / 's', *scenario[:2]) as slosh:
        slosh.wait_for('ready')
        for run in ('one', 'two'):
            log = tmp_path / f'{run}.csv'
            with NodeProcess(
                'vehicle_node', tmp_path / run, *scenario, '-p', f'log_file:={log}'
            ) as vehicle:
                assert vehicle.exit_code() == 0, vehicle.output
    assert (tmp_path / 'one.csv').read_bytes() == (tmp_path / 'two.csv').read_bytes()
