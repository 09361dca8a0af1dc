"""slosh_node over DDS: what it makes of values that no sensor should send."""

from __future__ import annotations

import itertools
import math
import random
import re
from contextlib import suppress

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs the ROS 2 wheels (make venv)')

from conduct_rig import START, STEP, TANK, Conversation, conversation, drive, lively
from conftest import REPOSITORY
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import Twist, TwistStamped, WrenchStamped
from rclpy.serialization import serialize_message
from ros_rig import QOS, Driver, NodeProcess, call, diagnostics, imu, wrench_of
from sensor_msgs.msg import Imu
from std_msgs.msg import Float64
from std_srvs.srv import Trigger
from test_conduct_fuzz import Adversary

from slosh_ros.engine import SloshEngine, Verdict, feed_message
from slosh_ros.ros.runtime import RCLError

pytestmark = [pytest.mark.ros, pytest.mark.timeout(120)]

NOT_FINITE = (math.nan, math.inf, -math.inf)
USED = [
    f'{vector}.{axis}' for vector in ('linear_acceleration', 'angular_velocity') for axis in 'xyz'
]
UNUSED = [
    *(f'orientation.{axis}' for axis in 'xyzw'),
    *(
        f'{quantity}_covariance.{k}'
        for quantity in ('orientation', 'angular_velocity', 'linear_acceleration')
        for k in range(9)
    ),
]
FRAMED = TANK + '    input:\n      imu_frame: imu_link\n'
BEGIN = drive([START + k * STEP for k in range(5)])
NEXT = START + 5 * STEP
AFTER = (lively(NEXT, 0.05), Verdict.ACCEPTED)


@pytest.fixture(scope='module')
def talk(tmp_path_factory):
    with conversation(tmp_path_factory.mktemp('data'), tank=FRAMED) as talk:
        yield talk


def changed(field: str, value: float, stamp: int = NEXT - STEP // 2) -> Imu:
    """Build a good sample in the middle of the drive, but for one field."""
    message = lively(stamp, 0.045)
    holder, _, part = field.partition('.')
    if part.isdigit():
        getattr(message, holder)[int(part)] = value
    else:
        setattr(getattr(message, holder), part, value)
    return message


def leaves_no_trace(talk: Conversation, bad: list[Imu], verdict: Verdict) -> None:
    """Unanswered, and the next good sample finds the liquid as if they had never been."""
    case = [*BEGIN, *((message, verdict) for message in bad), AFTER]
    assert talk.tell(case) == talk.as_if([message for message, _ in (*BEGIN, AFTER)])


@pytest.mark.parametrize('field', USED)
def test_a_motion_that_is_not_finite_leaves_no_trace(talk, field):
    bad = [changed(field, value) for value in NOT_FINITE]
    leaves_no_trace(talk, bad, Verdict.NON_FINITE)


@pytest.mark.parametrize('field', USED)
def test_an_absurd_magnitude_leaves_no_trace(talk, field):
    """1e308 overflows when squared; a saturated sensor sends its largest integer."""
    largest = 200.0 if field.startswith('linear') else 40.0
    sizes = (1e308, 1.7976931348623157e308, 1e9, 32767.0, math.nextafter(largest, math.inf))
    bad = [changed(field, sign * size) for size in sizes for sign in (1.0, -1.0)]
    leaves_no_trace(talk, bad, Verdict.OUT_OF_RANGE)


@pytest.mark.parametrize('field', USED)
def test_believable_extremes_are_taken_as_they_are(talk, field):
    largest = 200.0 if field.startswith('linear') else 40.0
    values = (largest, -largest, 5e-324, -0.0)
    case = [*BEGIN]
    case += [(changed(field, v, NEXT + k), Verdict.ACCEPTED) for k, v in enumerate(values)]
    answers = talk.tell(case)
    assert np.isfinite(answers).all()
    assert answers == talk.as_if([message for message, _ in case])


def test_what_the_liquid_does_not_feel_may_be_anything(talk):
    """Orientation and covariances that are not finite change no bit of any wrench."""
    odd, plain = [*BEGIN], [*BEGIN]
    for field in UNUSED:
        for value in NOT_FINITE:
            stamp = START + len(odd) * STEP
            odd.append((changed(field, value, stamp), Verdict.ACCEPTED))
            plain.append((lively(stamp, 0.045), Verdict.ACCEPTED))
    assert talk.tell(odd) == talk.as_if([message for message, _ in plain])


def test_an_absent_accelerometer_leaves_no_trace_and_is_an_error(talk):
    talk.next_report()  # what was before has been told
    bad = [changed('linear_acceleration_covariance.0', -1.0, NEXT - 5 + k) for k in range(5)]
    leaves_no_trace(talk, bad, Verdict.NO_DATA)
    report = talk.report_of('accelerometer marked absent')
    assert report.level == DiagnosticStatus.ERROR


def test_an_absent_gyro_means_no_rotation_and_a_warning(talk):
    """Whatever stands in its fields: a driver without one fills in anything."""
    talk.next_report()  # what was before has been told
    case, plain = [], []
    for k, rate in enumerate([(0.3, 0.2, 0.1), (math.nan,) * 3, (1e308, -math.inf, 0.0)]):
        message = imu(START + k * STEP, (0.5, 0.2, 9.8), rate)
        message.angular_velocity_covariance[0] = -1.0
        case.append((message, Verdict.ACCEPTED if k else Verdict.STARTED))
        plain.append(imu(START + k * STEP, (0.5, 0.2, 9.8)))
    assert talk.tell(case) == talk.as_if(plain)
    report = talk.report_of('gyro marked absent')
    assert report.level == DiagnosticStatus.WARN
    assert 'taken as zero' in report.message


@pytest.mark.parametrize(
    'force',
    [(0.0, 0.0, 0.0), (0.0, 0.0, -9.81), (0.0, 0.0, 1.0), (9.81, 0.0, 0.0)],
    ids=['gravity removed', 'upside down', 'in units of g', 'on its side'],
)
def test_an_imu_without_gravity_upwards_is_told_with_the_remedy(talk, force):
    talk.next_report()  # what was before has been told
    case = [(imu(START + k * STEP * 10, force), Verdict.ACCEPTED) for k in range(25)]
    case[0] = case[0][0], Verdict.STARTED
    talk.tell(case)
    report = talk.report_of('specific force')
    assert report.level == DiagnosticStatus.WARN
    assert 'must include gravity' in report.message
    assert 'imu.rpy' in report.message


def in_frame(message: Imu, frame: str) -> Imu:
    message.header.frame_id = frame
    return message


@pytest.mark.parametrize('frame', ['', 'chassis', 'imu_link ', '/imu_link', 'Imu_link', 'ïmu☃'])
def test_a_sample_in_another_frame_than_the_configured_leaves_no_trace(talk, frame):
    bad = [in_frame(imu(NEXT - 5 + k, (9.0, 9.0, 9.0)), frame) for k in range(3)]
    leaves_no_trace(talk, bad, Verdict.WRONG_FRAME)


def test_many_bad_samples_a_second_are_few_lines_of_log(talk):
    """200 a second for 3 s, of three kinds: the log gets no more than one line a second."""
    talk.restart()
    before = len(talk.node.output.splitlines())
    kinds = (
        (in_frame(imu(NEXT), 'chassis'), Verdict.WRONG_FRAME),
        (changed('angular_velocity.z', math.nan), Verdict.NON_FINITE),
        (imu(0), Verdict.ZERO_STAMP),
    )
    for k in range(600):
        message, verdict = kinds[k // 100 % 3]
        talk.driver.publisher.publish(message)
        talk.expected[verdict] += 1
        talk.driver.spin_for(0.005)
    talk.tell(BEGIN)
    assert talk.counted() == {v.value: n for v, n in talk.expected.items()}
    said = talk.node.output.splitlines()[before:]
    times = [float(re.search(r'\[(\d+\.\d+)\]', line)[1]) for line in said]
    assert 0 < len(times) <= 6
    assert all(later - earlier > 0.9 for earlier, later in itertools.pairwise(times))


def test_ten_thousand_messages_of_an_adversary(talk):
    """Every good one is answered, with the numbers of the same engine offline; none is another."""
    adversary, engine = Adversary(7), SloshEngine(talk.config)
    case, expected = [], []
    for _ in range(10_000):
        message = adversary.fill(Imu())
        verdict, loads = feed_message(engine, message, 0)
        case.append((message, verdict))
        if loads is not None:
            expected.append([*loads.wrench.tolist(), *loads.total.tolist()])
    answers = talk.tell(case)
    assert np.isfinite(answers).all()
    assert answers == expected
    assert talk.tell(BEGIN) == talk.as_if([message for message, _ in BEGIN])  # alive and well
    assert talk.counted() == {v.value: n for v, n in talk.expected.items()}


def test_bytes_that_are_no_message_leave_no_trace(talk):
    """A publisher may send what it likes: cut short, lengths that lie, any bytes."""
    whole = serialize_message(lively(NEXT - STEP // 2, 0.045))
    dice = random.Random(3)
    bad = [whole[:n] for n in range(4, len(whole), 7)]  # DDS itself needs four bytes
    bad += [whole[:12] + dice.randbytes(4) + whole[16:] for _ in range(20)]  # length of frame_id
    bad += [whole[:4] + dice.randbytes(n) for n in range(0, 400, 20)]
    bad.append(whole.replace(b'imu_link', b'\xff' * 8))  # no text
    talk.tell(BEGIN)
    for number in range(0, len(bad), 20):
        for content in bad[number : number + 20]:
            talk.driver.publisher.publish(content)
        talk.driver.spin_for(0.05)
    case = [*BEGIN, AFTER]
    assert talk.tell(case) == talk.as_if([message for message, _ in case])
    report = talk.next_report()
    counts = {v.key: v.value for v in report.values}
    assert int(counts['rejected: bytes that are no sensor_msgs/msg/Imu']) > len(bad) / 2
    assert 'Traceback' not in talk.node.output


FILL = {'slosh_node/fill': Float64}
TYPED = {
    'twist': ('slosh_node', {'twist': Twist} | FILL, 'input.twist_stamped:=false'),
    'stamped twist': ('slosh_node', {'twist': TwistStamped}, 'input.twist_stamped:=true'),
    'rollover': ('rollover_node', {'imu/data': Imu, 'slosh_node/wrench': WrenchStamped}, ''),
}


@pytest.mark.parametrize('name', TYPED)
def test_bytes_that_are_no_message_do_not_end_a_node(tmp_path, name):
    """Where rclpy makes the messages itself; whatever it makes of them, good ones are taken."""
    module, topics, option = TYPED[name]
    file = tmp_path / 'tank.yaml'
    file.write_text(TANK)
    arguments = ['--params-file', str(file)]
    if option:
        arguments += ['-p', 'input.source:=twist', '-p', option]
    else:
        arguments += ['--params-file', str(REPOSITORY / 'config' / 'rollover.yaml')]
    with NodeProcess(module, tmp_path / 'node.log', *arguments) as node, Driver() as driver:
        node.wait_for('ready')
        for topic, kind in topics.items():
            publisher = driver.node.create_publisher(kind, topic, QOS)
            driver.spin_until(lambda p=publisher: p.get_subscription_count() > 0)
            for content in spoilt(kind()):
                with suppress(RCLError):  # more than DDS itself takes for such a message
                    publisher.publish(content)
            driver.spin_for(0.3)
            if topic == 'twist':
                call(driver, Trigger, 'slosh_node/reset', Trigger.Request())
                good = kind()
                if kind is TwistStamped:
                    good.header.stamp.sec = 100
                driver.publisher = publisher
                _, total = driver.exchange(good)
                weight = 8.0 * 2.0 * 0.8 * 1000.0 * 9.81
                assert wrench_of(total) == pytest.approx([0, 0, -weight, 0, 0, 0], abs=1e-6)
        assert diagnostics(driver)['message']
        assert node.stop() == 0
        assert 'Traceback' not in node.output


def spoilt(message: object) -> list[bytes]:
    """Cut a message short, let its lengths lie, fill it with any bytes and no text."""
    whole, dice = serialize_message(message), random.Random(5)
    bad = [whole[:n] for n in range(4, len(whole), 5)]
    bad += [whole[:12] + dice.randbytes(4) + whole[16:] for _ in range(10)]
    bad += [whole[:4] + dice.randbytes(n) for n in range(0, 400, 20)]
    if hasattr(message, 'header'):
        message.header.frame_id = 'no text!'
        bad.append(serialize_message(message).replace(b'no text!', b'\xff' * 8))
    return bad
