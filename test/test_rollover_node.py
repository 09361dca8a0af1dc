"""rollover_node beside a real slosh_node, over DDS."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs the ROS 2 wheels (make venv)')

from conftest import REPOSITORY
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import InertiaStamped, WrenchStamped
from ros_rig import QOS, Driver, NodeProcess, imu
from sensor_msgs.msg import Imu
from std_msgs.msg import Float64

from slosh_ros.bag import MotionBag
from slosh_ros.engine import SloshConfig, SloshEngine, feed_message
from slosh_ros.engine.convert import IMU
from slosh_ros.monitor import RolloverMonitor
from slosh_ros.ros.latched import LATCHED
from slosh_ros.vehicle.rollover import FIGURES, Rollover, RollVehicle

pytestmark = [pytest.mark.ros, pytest.mark.timeout(120)]

SECOND = 1_000_000_000
START = 100 * SECOND
STEP = 10_000_000
BAG = REPOSITORY / 'bags/highway_drive'
TANKS = REPOSITORY / 'config/highway_drive.yaml'
VEHICLE = REPOSITORY / 'config/rollover.yaml'


class Listener:
    """Hears rollover_node and /diagnostics for a driver."""

    def __init__(self, driver: Driver) -> None:
        self.driver = driver
        self.figures: dict[str, list[float]] = {}
        for name in FIGURES:
            heard = self.figures[name] = []
            driver.node.create_subscription(
                Float64, f'rollover_node/{name}', lambda m, to=heard: to.append(m.data), QOS
            )
        self.reports: list[DiagnosticStatus] = []
        driver.node.create_subscription(DiagnosticArray, '/diagnostics', self._on_report, 10)

    @property
    def count(self) -> int:
        return min(map(len, self.figures.values()))

    def connect(self, subscribers: int) -> None:
        """Wait until the nodes hear the Imu and the driver hears rollover_node."""
        node = self.driver.node
        self.driver.spin_until(
            lambda: (
                self.driver.publisher.get_subscription_count() >= subscribers
                and all(node.count_publishers(f'rollover_node/{name}') for name in FIGURES)
            )
        )

    def next_report(self, text: str, meanwhile: Callable[[], object] = int) -> DiagnosticStatus:
        """Wait for a report of rollover_node that holds a text; meanwhile, 50 times a second."""
        self.reports.clear()

        def told() -> bool:
            meanwhile()
            self.driver.spin_for(0.02)
            return any(text in report.message for report in self.reports)

        self.driver.spin_until(told)
        return next(report for report in self.reports if text in report.message)

    def _on_report(self, message: DiagnosticArray) -> None:
        self.reports += [s for s in message.status if s.name.startswith('rollover_node')]


@contextmanager
def running(module: str, log: Path, *files: Path, parameters: tuple[str, ...] = ()) -> Iterator:
    arguments = [word for file in files for word in ('--params-file', str(file))]
    topics = ['/imu/data', '/slosh_node/wrench'] if module == 'rollover_node' else ['/imu/data']
    for word in (
        *(f'qos_overrides.{topic}.subscription.reliability:=reliable' for topic in topics),
        *parameters,
    ):
        arguments += ['-p', word]
    with NodeProcess(module, log, *arguments) as node:
        node.wait_for('ready')
        yield node


@pytest.fixture
def rollover_node(tmp_path: Path) -> Iterator[NodeProcess]:
    with running('rollover_node', tmp_path / 'rollover.log', TANKS, VEHICLE) as node:
        yield node


@pytest.fixture
def driver() -> Iterator[Driver]:
    with Driver() as driver:
        yield driver


@pytest.fixture
def listener(driver: Driver) -> Listener:
    return Listener(driver)


def recorded(count: int) -> list[Imu]:
    """First samples of the highway drive, as rclpy's messages."""
    found = []
    with MotionBag(BAG, IMU, duration=count / 90.0) as source:
        for message, _ in source.messages():
            a, w = message.linear_acceleration, message.angular_velocity
            stamp = message.header.stamp.sec * SECOND + message.header.stamp.nanosec
            found.append(imu(stamp, (a.x, a.y, a.z), (w.x, w.y, w.z)))
    return found[:count]


def warm_up(driver: Driver, listener: Listener, first: int) -> list[Imu]:
    """Stand still until all are connected: some of the first samples may get lost."""
    sent: list[Imu] = []
    before = listener.count

    def judged() -> bool:
        sent.append(imu(first + len(sent) * STEP))
        driver.publisher.publish(sent[-1])
        return listener.count > before

    driver.spin_until(judged)
    count = -1
    while count != listener.count:  # what is still on its way
        count = listener.count
        driver.spin_for(0.5)
    return sent


def by_hand(messages: list[Imu]) -> list[Rollover | None]:
    """Judge in this process what slosh_node and rollover_node are given."""
    engine = SloshEngine(SloshConfig.from_file(TANKS))
    monitor = RolloverMonitor(engine, RollVehicle.from_file(VEHICLE))
    answers = [feed_message(engine, message, 0)[1] for message in messages]
    return [None if a is None else monitor.take(a.sample, a.wrench) for a in answers]


def test_two_nodes_over_dds_are_the_core_bit_for_bit(tmp_path, rollover_node, driver, listener):
    """The highway drive in lock-step, with samples between that slosh_node rejects."""
    drive = recorded(600)
    with running('slosh_node', tmp_path / 'slosh.log', TANKS):
        listener.connect(2)
        # so long before that the liquid starts from rest with the drive, however long this takes
        first = drive[0].header.stamp.sec * SECOND - 1000 * SECOND
        sent = warm_up(driver, listener, first)
        begin = len(sent)
        for k, message in enumerate(drive):
            count = listener.count
            driver.publisher.publish(message)
            sent.append(message)
            driver.spin_until(lambda count=count: listener.count > count)
            if k % 100 == 50:
                stamp = message.header.stamp.sec * SECOND + message.header.stamp.nanosec
                for bad in (imu(stamp + 1, (float('nan'), 0.0, 9.81)), imu(0), message):
                    driver.publisher.publish(bad)
                    sent.append(bad)
        driver.spin_for(0.5)
    expected = [rollover for rollover in by_hand(sent)[begin:] if rollover is not None]
    assert len(expected) == len(drive)
    for k, name in enumerate(FIGURES):
        live = listener.figures[name][-len(expected) :]
        assert live == [float(rollover[k]) for rollover in expected], name
    values = {v.key: v.value for v in listener.next_report('').values}
    assert int(values['samples without a wrench']) >= 3 * 6
    assert 'Traceback' not in rollover_node.output


def test_silent_slosh_node_is_said_and_leaves_no_stale_number(
    tmp_path, rollover_node, driver, listener
):
    with running('slosh_node', tmp_path / 'slosh.log', TANKS) as slosh_node:
        listener.connect(2)
        sent = warm_up(driver, listener, START)
        assert listener.next_report('').values
        slosh_node.stop()
    count, stamps = listener.count, itertools.count(START + len(sent) * STEP, STEP)
    turn = lambda: driver.publisher.publish(imu(next(stamps), (0.0, 3.0, 9.81)))  # noqa: E731
    report = listener.next_report('no wrench on /slosh_node/wrench', turn)
    assert report.level == DiagnosticStatus.ERROR
    assert listener.count == count
    rollover_node.wait_for('nothing is published')
    with running('slosh_node', tmp_path / 'again.log', TANKS):
        listener.connect(2)
        warm_up(driver, listener, next(stamps))
    assert listener.count > count


def exchange(driver: Driver, wrenches, stamp: int, wrench: list[float], frame: str) -> None:
    """Play slosh_node: an Imu and its answer."""
    message = WrenchStamped()
    message.header.frame_id = frame
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, SECOND)
    force, torque = message.wrench.force, message.wrench.torque
    force.x, force.y, force.z, torque.x, torque.y, torque.z = wrench
    driver.publisher.publish(imu(stamp))
    wrenches.publish(message)


def test_what_is_wrong_is_said(rollover_node, driver, listener):
    """No data, wrench in another frame or not finite, another fill, small margin, silence."""
    listener.connect(1)
    assert listener.next_report('waiting for data on /imu/data').level == DiagnosticStatus.WARN
    wrenches = driver.node.create_publisher(WrenchStamped, 'slosh_node/wrench', QOS)
    driver.spin_until(lambda: wrenches.get_subscription_count() > 0)

    stamp = START

    def play(wrench: list[float], frame: str, text: str) -> DiagnosticStatus:
        def meanwhile() -> None:
            nonlocal stamp
            stamp += STEP
            exchange(driver, wrenches, stamp, wrench, frame)

        return listener.next_report(text, meanwhile)

    nothing, tipping = [0.0] * 6, [0.0, 0.0, 0.0, 3.4e5, 0.0, 0.0]
    assert play(nothing, 'tank_link', 'is not in base_link').level == DiagnosticStatus.ERROR
    assert play([float('nan')] * 6, 'base_link', 'no wrench').level == DiagnosticStatus.ERROR
    assert listener.count == 0
    assert play(nothing, 'base_link', 'running').level == DiagnosticStatus.OK
    liquids = driver.node.create_publisher(InertiaStamped, 'slosh_node/liquid', LATCHED)
    liquid, mass = InertiaStamped(), SloshEngine(SloshConfig.from_file(TANKS)).mass
    for told, text in ((1.2 * mass, f'holds {1.2 * mass:.0f} kg of liquid'), (mass, 'running')):
        liquid.inertia.m = told
        liquids.publish(liquid)
        level = play(nothing, 'base_link', text).level
        assert level == (DiagnosticStatus.OK if text == 'running' else DiagnosticStatus.ERROR)
    warned = play(tipping, 'base_link', 'the rollover margin is below 0.1 g')
    assert warned.level == DiagnosticStatus.WARN
    values = {v.key: float(v.value) for v in warned.values}
    assert values['least margin of the last second [g]'] < 0.1
    assert listener.next_report('no sample on /imu/data').level == DiagnosticStatus.STALE
    assert all(np.isfinite(heard).all() for heard in listener.figures.values())
    assert listener.figures['load_transfer_ratio'][-1] > 0.8
    count = listener.count
    driver.spin_for(0.3)
    assert listener.count == count
    assert rollover_node.stop() == 0
    assert 'Traceback' not in rollover_node.output


@pytest.mark.parametrize(
    ('files', 'parameter', 'says'),
    [
        ([TANKS], 'vehicle.track:=1.8', 'vehicle.mass, vehicle.mass_centre'),
        ([VEHICLE], 'vehicle.track:=1.8', 'tank.shape is missing'),
        ([TANKS, VEHICLE], 'vehicle.trak:=1.8', 'did you mean vehicle.track?'),
    ],
)
def test_bad_configuration_ends_in_one_clear_message(tmp_path, files, parameter, says):
    arguments = [word for file in files for word in ('--params-file', str(file))]
    with NodeProcess('rollover_node', tmp_path / 'node.log', *arguments, '-p', parameter) as node:
        assert node.exit_code() == 1
        ours = [line for line in node.output.splitlines() if '[rcl]' not in line]
        assert len(ours) == 1
        assert ours[0].startswith('error: ')
        assert says in ours[0]
