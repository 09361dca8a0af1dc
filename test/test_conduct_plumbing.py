"""slosh_node over DDS: names, QoS, parameters, publishers that come and go, signals."""

from __future__ import annotations

import itertools
import re
import signal
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path

import pytest

pytest.importorskip('rclpy', reason='needs the ROS 2 wheels (make venv)')

from conduct_rig import SECOND, START, STEP, TANK, conversation, drive, lively
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import WrenchStamped
from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParameters
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.qos import QoSReliabilityPolicy, qos_profile_sensor_data
from ros_rig import QOS, Driver, NodeProcess, imu, stamp_of, wrench_of
from sensor_msgs.msg import Imu
from std_srvs.srv import SetBool, Trigger

from slosh_ros.engine import SloshConfig, SloshEngine, Verdict, feed_message
from slosh_ros.engine.parameters import resolved
from slosh_ros.parameters import read_parameter_file, without_ros_own

pytestmark = [pytest.mark.ros, pytest.mark.timeout(120)]


@pytest.fixture
def config(tmp_path):
    file = tmp_path / 'tank.yaml'
    file.write_text(TANK)
    return file


def test_namespace_names_and_topics_are_the_users(tmp_path, config):
    """One file serves under any name: /** matches, and the resolved names are spoken of."""
    with (
        NodeProcess(
            'slosh_node', tmp_path / 'node.log', '--params-file', str(config),
            '-r', '__ns:=/truck', '-r', '__node:=front', '-r', 'imu/data:=chassis/imu',
            '-r', '~/wrench:=/loads',
            '-p', 'qos_overrides./truck/chassis/imu.subscription.reliability:=reliable',
        ) as node,
        Driver(topic='truck/chassis/imu') as driver,
    ):  # fmt: skip
        node.wait_for('listening on /truck/chassis/imu')
        node.wait_for('waiting for data on /truck/chassis/imu')
        received: dict[str, list[WrenchStamped]] = {}
        reports: list[DiagnosticArray] = []
        for name in ('/loads', '/truck/front/wrench_total'):
            messages = received.setdefault(name, [])
            driver.node.create_subscription(WrenchStamped, name, messages.append, QOS)
        driver.node.create_subscription(DiagnosticArray, '/diagnostics', reports.append, 10)
        driver.received = received
        driver.spin_until(lambda: driver.publisher.get_subscription_count() > 0)
        driver.spin_until(lambda: all(map(driver.node.count_publishers, received)))
        driver.spin_until(
            lambda: ('front', '/truck') in driver.node.get_node_names_and_namespaces()
        )
        (listener,) = driver.node.get_subscriptions_info_by_topic('/truck/chassis/imu')
        # the override of the resolved name, not of imu/data
        assert listener.qos_profile.reliability == QoSReliabilityPolicy.RELIABLE
        count = len(received['/loads'])
        driver.publisher.publish(imu(START))
        driver.spin_until(lambda: len(received['/loads']) > count)
        driver.spin_until(lambda: any(r.status[0].name.startswith('front') for r in reports))


def test_a_publisher_that_dies_and_returns_finds_its_liquid_still_moving(tmp_path, config):
    """The silence is told of; after it the liquid has moved freely for as long as stamps say."""
    engine = SloshEngine(SloshConfig.from_file(config))
    before = [lively(START + k * STEP, 0.01 * k) for k in range(20)]
    after = [lively(START + 3 * SECOND + k * STEP, 0.2) for k in range(3)]
    expected = [feed_message(engine, message, 0)[1].wrench.tolist() for message in before + after]
    with NodeProcess('slosh_node', tmp_path / 'node.log', '--params-file', str(config)) as node:
        node.wait_for('ready')
        with Driver() as driver:
            driver.wait_for_node()
            answers = [wrench_of(driver.exchange(message)[0]) for message in before]
        with Driver() as driver:
            driver.wait_for_node()
            reports: list[DiagnosticStatus] = []
            driver.node.create_subscription(
                DiagnosticArray, '/diagnostics', lambda m: reports.extend(m.status), 10
            )
            silent = 'no sample on /imu/data'
            driver.spin_until(lambda: any(silent in report.message for report in reports))
            assert reports[-1].level == DiagnosticStatus.STALE
            answers += [wrench_of(driver.exchange(message)[0]) for message in after]
            heard = len(reports)
            driver.spin_until(lambda: len(reports) > heard)
            assert 'freely' in reports[heard].message
    assert answers == expected


def test_a_node_that_is_killed_in_mid_drive_can_be_started_again(tmp_path, config):
    """The driver goes on; the new node starts from rest with the first sample it hears."""
    messages = [lively(START + k * STEP, 0.01 * k) for k in range(20)]
    with Driver() as driver, ExitStack() as nodes:
        for life in range(2):
            node = nodes.enter_context(
                NodeProcess('slosh_node', tmp_path / f'{life}.log', '--params-file', str(config))
            )
            node.wait_for('ready')
            driver.wait_for_node()
            engine = SloshEngine(SloshConfig.from_file(config))
            for message in messages[10 * life : 10 * life + 10]:
                answer = driver.exchange(message)[0]
                _, loads = feed_message(engine, message, 0)
                assert stamp_of(answer) == stamp_of(message)
                assert wrench_of(answer) == loads.wrench.tolist()
            if life == 0:
                assert node.stop(signal.SIGKILL) == -signal.SIGKILL


@pytest.mark.parametrize('numbers', [(signal.SIGTERM,), (signal.SIGINT,) * 2])
def test_signals_end_a_node_that_is_in_full_flow(tmp_path, config, numbers):
    """Samples pour in while it ends: exit code 0, nothing but its greeting is printed."""
    with (
        NodeProcess('slosh_node', tmp_path / 'node.log', '--params-file', str(config)) as node,
        Driver() as driver,
    ):
        node.wait_for('ready')
        driver.wait_for_node()
        driver.exchange(imu(START))
        for k in range(1, 200):
            driver.publisher.publish(imu(START + k * STEP))
            if k in (100, 101)[: len(numbers)]:
                node._process.send_signal(numbers[k - 100])
            driver.spin_for(0.001)
        assert node.exit_code() == 0
        assert 'Traceback' not in node.output
        assert 'rror' not in node.output


START_UP = 'from slosh_ros.ros.start import {0}; {0}()'


@pytest.mark.skipif(sys.platform != 'linux', reason='asks /proc for what is caught')
@pytest.mark.parametrize('name', ['slosh_node', 'vehicle_node', 'rollover_node'])
def test_ctrl_c_while_it_starts_is_no_error(name):
    """At any moment from the first on, before ROS and SciPy are imported, too."""
    for delay in (0.0, 0.1, 0.3, 0.6, 1.0):
        process = subprocess.Popen(
            [sys.executable, '-c', START_UP.format(name)],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip
        while not catches(process.pid, signal.SIGTERM):
            assert process.poll() is None
        time.sleep(delay)
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=20.0)[0]
        # without a tank the last ones may have ended by themselves
        assert process.returncode == 0 or said.startswith('error: '), said
        assert 'Traceback' not in said


def catches(pid: int, number: int) -> bool:
    """Tell whether a process has a handler for a signal, which Python has for few."""
    (caught,) = re.findall(r'SigCgt:\s*(\w+)', Path(f'/proc/{pid}/status').read_text())
    return bool(int(caught, 16) >> (number - 1) & 1)


WRONG_FILES = {
    'of another node': (TANK.replace('/**:', 'other_node:'), 'tank.shape is missing'),
    'empty': ('', 'error: '),
    'no mapping': ('- 1\n- 2\n', 'error: '),
    'binary': ('\x00\x01\x7f\x1b[2J' * 50, 'error: '),
    'broken YAML': (TANK + '   : [', 'error: '),
    'an alias': (TANK.replace('8.0', '&a 8.0').replace('2.0', '*a'), 'error: '),
    'tabs': (TANK.replace('      ', '\t'), 'error: '),
    'a value out of its range': (TANK.replace('8.0', '1.0e+300'), 'tank.length is 1e+300 [m]'),
    'not a number': (TANK.replace('8.0', '.nan'), 'tank.length is nan [m]'),
    'too large for a double': (TANK.replace('8.0', '1.0e+999'), 'error: '),
    'nested too deep': (
        TANK.replace('8.0', '{a: {b: 1.0}}'),
        'tank.length.a.b is not a parameter',
    ),
}


MANY = """import sys
from slosh_ros.ros.runtime import run
from slosh_ros.ros.slosh_node import SloshNode
for file in sys.argv[1:]:
    code = run(SloshNode, ['--ros-args', '--params-file', file])
    print(f'ended with {code}', file=sys.stderr, flush=True)
"""


def test_a_wrong_parameter_file_ends_the_node_in_one_message(tmp_path):
    """One process runs the node with one file after the other: each start costs a second."""
    files = []
    for name, (text, _) in WRONG_FILES.items():
        files.append(tmp_path / f'{name}.yaml')
        files[-1].write_text(text)
    result = subprocess.run(
        [sys.executable, '-c', MANY, *files],
        capture_output=True, text=True, timeout=100, check=True,
    )  # fmt: skip
    *said, rest = result.stderr.split('ended with 1\n')
    assert rest == ''
    for name, text in zip(WRONG_FILES, said, strict=True):
        ours = [line for line in text.splitlines() if line.startswith('error: ')]
        assert (name, len(ours)) == (name, 1), text
        assert WRONG_FILES[name][1] in ours[0]
        assert 'Traceback' not in text, name


# The tests below share a node of their own, which the others must not meet: they come last.
@pytest.fixture(scope='module')
def talk(tmp_path_factory):
    with conversation(tmp_path_factory.mktemp('plumbing')) as talk:
        yield talk


def ask(driver: Driver, kind: type, service: str, **fields: object) -> object:
    client = driver.node.create_client(kind, f'slosh_node/{service}')
    driver.spin_until(client.service_is_ready)
    future = client.call_async(kind.Request(**fields))
    driver.spin_until(future.done)
    driver.node.destroy_client(client)
    return future.result()


def test_a_frame_that_changes_in_mid_drive_is_told_of(talk):
    """Two sensors on one topic would shake the liquid between their poses."""
    talk.next_report()  # what was before has been told
    begin = drive([START + k * STEP for k in range(5)])
    other = lively(START + 5 * STEP, 0.05)
    other.header.frame_id = 'other_imu'
    last = lively(START + 6 * STEP, 0.06)
    talk.tell([*begin, (other, Verdict.ACCEPTED), (last, Verdict.ACCEPTED)])
    report = talk.report_of('frame_id')
    assert report.level == DiagnosticStatus.WARN
    assert 'input.imu_frame' in report.message


def test_diagnostics_come_once_a_second_with_every_counter(talk):
    times = []
    watch = talk.driver.node.create_subscription(
        DiagnosticArray, '/diagnostics', lambda _: times.append(time.monotonic()), 10
    )
    talk.driver.spin_until(lambda: len(times) > 4)
    talk.driver.node.destroy_subscription(watch)
    assert (times[-1] - times[0]) / (len(times) - 1) == pytest.approx(1.0, abs=0.2)


def test_every_parameter_is_told_with_its_meaning_range_and_value(talk, tmp_path):
    names = ask(talk.driver, ListParameters, 'list_parameters', depth=0).result.names
    own = list(without_ros_own(dict.fromkeys(names)))
    (tmp_path / 'tank.yaml').write_text(TANK)
    rows, values = resolved(read_parameter_file(tmp_path / 'tank.yaml', 'slosh_node'))
    assert sorted(own) == sorted(values.by_name)
    described = ask(talk.driver, DescribeParameters, 'describe_parameters', names=own).descriptors
    told = ask(talk.driver, GetParameters, 'get_parameters', names=own).values
    for name, descriptor, value in zip(own, described, told, strict=True):
        row = rows[name]
        assert row.meaning in descriptor.description
        assert f'[{row.unit}]' in descriptor.description or not row.unit
        assert descriptor.additional_constraints == row.constraints
        for span in (*descriptor.floating_point_range, *descriptor.integer_range):
            assert (span.from_value, span.to_value) == (row.lower, row.upper)
        python = parameter_value_to_python(value)
        assert (list(python) if hasattr(python, '__len__') and not isinstance(python, str)
                else python) == values.by_name[name]  # fmt: skip


def test_a_parameter_that_cannot_change_says_so_and_stays(talk):
    names = ask(talk.driver, ListParameters, 'list_parameters', depth=0).result.names
    own = list(without_ros_own(dict.fromkeys(names)))
    described = ask(talk.driver, DescribeParameters, 'describe_parameters', names=own).descriptors
    fixed = [d.name for d in described if d.read_only]
    assert {'tank.length', 'tank.shape', 'imu.rpy', 'gate.max_gap', 'tanks'} <= set(fixed)
    before = ask(talk.driver, GetParameters, 'get_parameters', names=fixed).values
    other = {
        ParameterType.PARAMETER_DOUBLE: 0.123,
        ParameterType.PARAMETER_STRING: 'other',
        ParameterType.PARAMETER_BOOL: True,
        ParameterType.PARAMETER_INTEGER: 5,
        ParameterType.PARAMETER_DOUBLE_ARRAY: [0.1, 0.2, 0.3],
        ParameterType.PARAMETER_STRING_ARRAY: ['one', 'two'],
    }
    changes = [
        Parameter(name, value=other[value.type]).to_parameter_msg()
        for name, value in zip(fixed, before, strict=True)
    ]
    for change in changes:
        (result,) = ask(talk.driver, SetParameters, 'set_parameters', parameters=[change]).results
        assert not result.successful
        assert 'read-only' in result.reason
    assert ask(talk.driver, GetParameters, 'get_parameters', names=fixed).values == before


def test_a_disabled_node_answers_nothing_and_starts_from_rest_when_enabled(talk):
    talk.next_report()  # what was before has been told
    begin = drive([START + k * STEP for k in range(5)])
    before = talk.tell(begin)
    assert ask(talk.driver, SetBool, 'set_enabled', data=False).success
    for message, _ in begin:
        talk.driver.publisher.publish(message)
    report = talk.report_of('disabled by ~/set_enabled')
    assert report.level == DiagnosticStatus.WARN
    assert talk.counts()['not used: disabled by ~/set_enabled'] == 5
    assert len(talk.driver.received['wrench']) == 5
    assert ask(talk.driver, SetBool, 'set_enabled', data=True).success
    assert talk.tell(begin) == before


def test_many_calls_are_few_lines_of_log(talk):
    before = len(talk.node.output.splitlines())
    for _ in range(10):
        ask(talk.driver, SetBool, 'set_enabled', data=True)
        ask(talk.driver, Trigger, 'reset')
    # what has been said just before is not said again for a while
    talk.driver.spin_until(lambda: len(talk.node.output.splitlines()) > before)
    talk.driver.spin_for(2.5)
    said = talk.node.output.splitlines()[before:]
    times = [float(re.search(r'\[(\d+\.\d+)\]', line)[1]) for line in said]
    assert 0 < len(times) <= 4
    assert all(later - earlier > 0.9 for earlier, later in itertools.pairwise(times))


def test_a_publisher_that_offers_too_little_is_told_with_the_remedy(talk):
    """The node was made to ask for reliable samples; a best-effort sensor would go unheard."""
    sensor = talk.driver.node.create_publisher(Imu, 'imu/data', qos_profile_sensor_data)
    remedy = 'set qos_overrides./imu/data.subscription.reliability to best_effort'
    talk.node.wait_for(remedy)
    talk.driver.spin_until(lambda: 'QoS' in {v.key for v in talk.reports[-1].values})
    assert remedy in {v.key: v.value for v in talk.reports[-1].values}['QoS']
    talk.driver.node.destroy_publisher(sensor)


def test_two_publishers_on_one_topic_are_told_by_name(talk):
    stamps = itertools.count(START + 10 * SECOND, STEP)
    with Driver() as second:
        second.wait_for_node()

        def told() -> bool:
            for driver in (talk.driver, second):
                driver.publisher.publish(imu(next(stamps)))
            return any('publishers on /imu/data' in r.message for r in talk.reports[-1:])

        heard = len(talk.reports)
        talk.driver.spin_until(lambda: told() and len(talk.reports) > heard)
        assert '/driver and /driver' in talk.reports[-1].message
        assert talk.reports[-1].level == DiagnosticStatus.WARN
    talk.driver.spin_until(lambda: talk.counts()['publishers on /imu/data'] == 1)
