"""slosh_node as its users meet it: a process that is spoken to over DDS."""

from __future__ import annotations

import signal
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs the ROS 2 wheels (make venv)')

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import InertiaStamped, PointStamped, Twist, TwistStamped
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from ros_rig import QOS, Driver, NodeProcess, call, diagnostics, imu, stamp_of, wrench_of
from sensor_msgs.msg import FluidPressure
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import Trigger

from slosh_ros.engine import SloshConfig, SloshEngine

pytestmark = [pytest.mark.ros, pytest.mark.timeout(120)]

SECOND = 1_000_000_000
START = 100 * SECOND
STEP = 10_000_000

RECTANGLE = """/**:
  ros__parameters:
    tank:
      shape: rectangular
      length: 8.0
      width: 2.0
      height: 1.6
      fill_depth: 0.8
      damping_ratio: 0.02
"""


@pytest.fixture
def config(tmp_path: Path) -> Path:
    file = tmp_path / 'rectangle.yaml'
    file.write_text(RECTANGLE)
    return file


@pytest.fixture
def node(tmp_path: Path, config: Path):
    with NodeProcess('slosh_node', tmp_path / 'node.log', '--params-file', str(config)) as node:
        node.wait_for('ready')
        yield node


@pytest.fixture
def driver():
    with Driver() as driver:
        yield driver


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize('busy', [False, True])
def test_ends_cleanly_on_a_signal(node, driver, number, busy):
    if busy:
        driver.wait_for_node()
        driver.exchange(imu(START))
    assert node.stop(number) == 0
    assert 'Traceback' not in node.output


def test_second_interrupt_does_not_spoil_the_exit(node):
    node._process.send_signal(signal.SIGINT)
    assert node.stop(signal.SIGINT) == 0
    assert 'Traceback' not in node.output


def test_one_wrench_per_accepted_sample_with_its_stamp(node, driver):
    driver.wait_for_node()
    stamps = [START + k * STEP + (k % 3) for k in range(50)]
    for stamp in stamps:
        driver.exchange(imu(stamp, (0.3, 0.1, 9.81)))
    for messages in driver.received.values():
        assert [stamp_of(m) for m in messages] == stamps
        assert {m.header.frame_id for m in messages} == {'base_link'}


def test_resting_liquid_weighs_and_does_not_slosh(node, driver):
    driver.wait_for_node()
    for k in range(3):
        slosh, total = driver.exchange(imu(START + k * STEP))
    assert wrench_of(slosh) == [0.0] * 6
    assert wrench_of(total) == pytest.approx([0, 0, -8 * 2 * 0.8 * 1000 * 9.81, 0, 0, 0])


def test_braking_pushes_the_tank_forward(node, driver):
    driver.wait_for_node()
    for k in range(3):
        slosh, total = driver.exchange(imu(START + k * STEP, (-1.0, 0.0, 9.81)))
    assert wrench_of(total)[0] > 0
    assert wrench_of(slosh)[0] < 0  # at first the liquid stays behind: less than the frozen load


def test_rejected_samples_are_counted_and_unanswered(node, driver):
    driver.wait_for_node()
    good = [imu(START), imu(START + 5 * STEP), imu(START + 6 * STEP)]
    nan, inf, huge = (
        imu(START + 5 * STEP + k, (v, 0.0, 9.81))
        for k, v in ((1, float('nan')), (2, float('inf')), (3, 1e308))
    )
    absent = imu(START + 5 * STEP + 4)
    absent.linear_acceleration_covariance[0] = -1.0
    driver.exchange(good[0])
    driver.exchange(good[1])
    for bad in (imu(0), good[1], imu(START + STEP), nan, inf, huge, absent):
        driver.publisher.publish(bad)
    driver.exchange(good[2])
    assert [stamp_of(m) for m in driver.received['wrench']] == [
        START, START + 5 * STEP, START + 6 * STEP
    ]  # fmt: skip
    seen = diagnostics(driver)
    assert {key: seen.get(key) for key in seen if key.startswith('rejected')} == {
        'rejected: zero stamp': '1',
        'rejected: duplicate stamp': '1',
        'rejected: late': '1',
        'rejected: not finite': '2',
        'rejected: magnitude out of range': '1',
        'rejected: accelerometer marked absent by its covariance': '1',
    }


def test_backward_jump_restarts_from_rest(node, driver):
    driver.wait_for_node()
    for k in range(20):
        slosh, _ = driver.exchange(imu(START + k * STEP, (1.0, 0.0, 9.81)))
    assert wrench_of(slosh)[4] != 0
    first = wrench_of(driver.received['wrench'][0])
    slosh, _ = driver.exchange(imu(START - 50 * SECOND, (1.0, 0.0, 9.81)))
    assert wrench_of(slosh) == first
    assert diagnostics(driver)['restarted from rest after a backward jump of the stamps'] == '1'


def test_reset_service_puts_the_liquid_to_rest(node, driver):
    driver.wait_for_node()
    for k in range(20):
        driver.exchange(imu(START + k * STEP, (1.0, 0.0, 9.81)))
    assert call(driver, Trigger, 'slosh_node/reset', Trigger.Request()).success
    slosh, _ = driver.exchange(imu(START + 20 * STEP, (1.0, 0.0, 9.81)))
    assert wrench_of(slosh) == wrench_of(driver.received['wrench'][0])


def test_a_long_gap_never_becomes_one_step(node, driver):
    """Free motion over 3 s: bounded by the energy that was there, not driven by 3 s of input."""
    driver.wait_for_node()
    for k in range(20):
        driver.exchange(imu(START + k * STEP, (1.0, 0.0, 9.81)))
    slosh, _ = driver.exchange(imu(START + 3 * SECOND))
    assert abs(wrench_of(slosh)[0]) < 2e3  # driven through, it would be tens of kN
    assert diagnostics(driver)['accepted after a gap in which the liquid moved freely'] == '1'


def test_parameters_are_described_and_read_only(node, driver):
    name = 'tank.fill_depth'
    described = call(
        driver, DescribeParameters, 'slosh_node/describe_parameters',
        DescribeParameters.Request(names=[name]),
    ).descriptors[0]  # fmt: skip
    assert '[m]' in described.description
    assert described.read_only
    assert described.floating_point_range[0].from_value == 0.0
    value = call(
        driver, GetParameters, 'slosh_node/get_parameters', GetParameters.Request(names=[name])
    ).values[0]
    assert value.double_value == 0.8
    change = SetParameters.Request(parameters=[Parameter(name, value=0.5).to_parameter_msg()])
    result = call(driver, SetParameters, 'slosh_node/set_parameters', change).results[0]
    assert not result.successful
    assert 'read-only' in result.reason


def test_best_effort_publishers_are_heard_too(node):
    with Driver(qos=qos_profile_sensor_data) as driver:
        driver.wait_for_node()
        driver.exchange(imu(START))


def test_what_a_simulator_has_to_know_is_latched(node, driver, config):
    """Late subscribers get the matrices of the engine, labelled; and the frozen liquid."""
    engine = SloshEngine(SloshConfig.from_file(config))
    received: dict[str, list] = {}
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    kinds = dict.fromkeys(('coupling', 'coupling_exact', 'softening'), Float64MultiArray)
    kinds |= {'liquid': InertiaStamped, 'surface_centre': PointStamped}
    for topic, kind in kinds.items():
        heard = received.setdefault(topic, [])
        driver.node.create_subscription(kind, f'slosh_node/{topic}', heard.append, latched)
    driver.spin_until(lambda: all(received.values()))
    for topic in ('coupling', 'coupling_exact', 'softening'):
        (message,) = received[topic]
        rows, columns = message.layout.dim
        assert (rows.size, columns.size, rows.stride, columns.stride) == (6, 6, 36, 6)
        assert 'wrench in base_link' in rows.label
        expected = getattr(engine if topic == 'softening' else engine.carried, topic)
        np.testing.assert_array_equal(np.reshape(message.data, (6, 6)), expected)
    matrix = engine.carried.coupling
    assert np.allclose(matrix, matrix.T, rtol=1e-12, atol=1e-9)
    assert np.linalg.eigvalsh(matrix).min() > -1e-6 * matrix.max()
    assert 0 < matrix[0, 0] < 8 * 2 * 0.8 * 1000
    liquid = received['liquid'][0]
    assert liquid.header.frame_id == 'base_link'
    told = liquid.inertia
    assert told.m == pytest.approx(8 * 2 * 0.8 * 1000)
    assert (told.com.x, told.com.y, told.com.z) == pytest.approx((0.0, 0.0, -0.4))
    sides = told.m / 12.0 * np.array([2**2 + 0.8**2, 8**2 + 0.8**2, 8**2 + 2**2])
    assert (told.ixx, told.iyy, told.izz) == pytest.approx(sides)
    assert (told.ixy, told.ixz, told.iyz) == pytest.approx((0.0, 0.0, 0.0))
    centre = received['surface_centre'][0].point
    assert (centre.x, centre.y, centre.z) == pytest.approx((0.0, 0.0, 0.0))


POINTS = ('-p', 'pressure.front:=[4.0, 0.0, -0.7]', '-p', 'pressure.left:=[1.0, 1.0, -0.3]')


def test_pressure_of_each_sample_equals_offline_bit_for_bit(tmp_path, config, driver):
    """In tank_link, with the sample's stamp; the numbers of p_<point> of a replay."""
    from slosh_ros.engine import MotionSample, SloshConfig, SloshEngine
    from slosh_ros.parameters import read_parameter_file

    given = read_parameter_file(config, 'slosh_node')
    points = {'pressure.front': [4.0, 0.0, -0.7], 'pressure.left': [1.0, 1.0, -0.3]}
    offline = SloshEngine(SloshConfig.from_parameters(given | points))
    received: dict[str, list[FluidPressure]] = {}
    for name in ('front', 'left'):
        topic, messages = f'slosh_node/pressure/{name}', received.setdefault(name, [])
        driver.node.create_subscription(FluidPressure, topic, messages.append, QOS)
    with NodeProcess(
        'slosh_node', tmp_path / 'node.log', '--params-file', str(config), *POINTS
    ) as node:
        node.wait_for('ready')
        driver.wait_for_node()
        warm_up = 0  # until the node knows of all who listen
        while not all(received.values()):
            driver.exchange(imu(START - SECOND + warm_up))
            driver.spin_for(0.05)
            warm_up += STEP
            assert warm_up < SECOND
        call(driver, Trigger, 'slosh_node/reset', Trigger.Request())
        for messages in received.values():
            messages.clear()
        expected = []
        for k in range(200):
            force, rate = (-0.01 * k, 0.3, 9.7 + 0.001 * k), (0.0, 0.001 * k, 0.02)
            driver.exchange(imu(START + k * STEP, force, rate))
            _, loads = offline.feed(
                MotionSample.from_imu(START + k * STEP, list(force), list(rate))
            )
            expected.append(loads.pressure.tolist())
        driver.spin_until(lambda: all(len(messages) == 200 for messages in received.values()))
    for place, messages in enumerate(received.values()):
        assert [m.fluid_pressure for m in messages] == [row[place] for row in expected]
        assert [stamp_of(m) for m in messages] == [START + k * STEP for k in range(200)]
        assert {(m.header.frame_id, m.variance) for m in messages} == {('tank_link', 0.0)}


def test_a_point_of_pressure_is_a_parameter_like_any_other(tmp_path, config, driver):
    with NodeProcess(
        'slosh_node', tmp_path / 'node.log', '--params-file', str(config), *POINTS
    ) as node:
        node.wait_for('ready')
        name = 'pressure.front'
        described = call(
            driver, DescribeParameters, 'slosh_node/describe_parameters',
            DescribeParameters.Request(names=[name]),
        ).descriptors[0]  # fmt: skip
        assert '[m]' in described.description
        assert described.read_only
        value = call(
            driver, GetParameters, 'slosh_node/get_parameters', GetParameters.Request(names=[name])
        ).values[0]
        assert list(value.double_array_value) == [4.0, 0.0, -0.7]


def test_waiting_for_data_is_said_with_the_resolved_topic(tmp_path, config, driver):
    with NodeProcess(
        'slosh_node', tmp_path / 'node.log',
        '--params-file', str(config), '-r', 'imu/data:=/truck/chassis/imu',
    ) as node:  # fmt: skip
        node.wait_for('waiting for data on /truck/chassis/imu')
        told = 'damping ratio of the lowest mode 0.02: damping_ratio of the configuration'
        assert f'tank: {told}' in node.output


@pytest.mark.parametrize(('kind', 'stamped'), [(TwistStamped, 'true'), (Twist, 'false')])
def test_twist_drives_the_liquid_too(tmp_path, config, kind, stamped):
    with (
        NodeProcess(
            'slosh_node', tmp_path / 'node.log', '--params-file', str(config),
            '-p', 'input.source:=twist', '-p', f'input.twist_stamped:={stamped}',
        ) as node,
        Driver(kind, 'twist') as driver,
    ):  # fmt: skip
        node.wait_for('ready')
        driver.wait_for_node()
        for k in range(30):
            message = kind()
            if kind is TwistStamped:
                message.header.stamp.sec, message.header.stamp.nanosec = divmod(
                    START + k * STEP, SECOND
                )
            (message if kind is Twist else message.twist).linear.x = 10.0 - 0.01 * k
            driver.exchange(message)
        # braking; a Twist is stamped on arrival, so that a single difference may be of any size
        assert max(wrench_of(total)[0] for total in driver.received['wrench_total']) > 100.0


@pytest.mark.parametrize(
    ('arguments', 'says'),
    [
        (['-p', 'tank.length:=8'], 'tank.length has the integer 8 where ROS 2 wants a double'),
        (['-p', 'tank.lenght:=8.0'], 'tank.lenght is not a parameter; did you mean tank.length?'),
        (['-p', 'tank.width:=-2.0'], 'tank.width is -2 [m]; it must be from'),
        (['-p', 'tank.fill_ratio:=0.5'], 'tank.fill_ratio and tank.fill_depth are both given'),
        (['-p', 'pressure.front:=[4.5, 0.0, -0.7]'], 'pressure.front is (4.5, 0, -0.7) m'),
        (['--params-file', '/no/such/file.yaml'], '/no/such/file.yaml'),
        (['--no-such-flag'], '--no-such-flag'),
    ],
)  # fmt: skip
def test_bad_configuration_ends_in_one_clear_message(tmp_path, config, arguments, says):
    with NodeProcess(
        'slosh_node', tmp_path / 'node.log', '--params-file', str(config), *arguments
    ) as node:
        assert node.exit_code() == 1
        ours = [line for line in node.output.splitlines() if '[rcl]' not in line]
        assert len(ours) == 1
        assert ours[0].startswith('error: ')
        assert says in ours[0]


def test_two_sources_on_one_topic_are_not_taken_for_good(node, driver):
    """Clocks 100 s apart: every sample restarts the liquid, and diagnostics say so."""
    driver.wait_for_node()
    for k in range(30):
        driver.exchange(imu(START + k * STEP + (100 * SECOND if k % 2 else 0)))
    seen: list[DiagnosticArray] = []
    driver.node.create_subscription(DiagnosticArray, '/diagnostics', seen.append, 10)
    driver.spin_until(lambda: any('not ordinary' in a.status[0].message for a in seen))


def test_data_that_is_all_rejected_is_not_called_missing(tmp_path, config, driver):
    with NodeProcess(
        'slosh_node', tmp_path / 'node.log',
        '--params-file', str(config), '-p', 'input.imu_frame:=chassis',
    ) as node:  # fmt: skip
        node.wait_for('ready')
        driver.wait_for_node()
        for k in range(40):
            driver.publisher.publish(imu(START + k * STEP))
            driver.spin_for(0.05)
        node.wait_for('rejected: frame_id is not input.imu_frame')


@pytest.mark.parametrize(
    'parameter',
    ['tanks:=[]', 'qos_overrides./imu/data.subscription.reliability:=bogus'],
)
def test_what_rclpy_objects_to_is_one_clear_message_too(tmp_path, config, parameter):
    with NodeProcess(
        'slosh_node', tmp_path / 'node.log', '--params-file', str(config), '-p', parameter
    ) as node:
        assert node.exit_code() == 1
        assert 'error: ' in node.output
        assert 'Traceback' not in node.output
