"""slosh_node's outputs over DDS: two tanks, one node, every topic at once."""

from __future__ import annotations

import itertools
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs the ROS 2 wheels (make venv)')

import rclpy
from geometry_msgs.msg import PointStamped, WrenchStamped
from rclpy.publisher import Publisher
from rclpy.serialization import serialize_message
from rclpy.signals import SignalHandlerOptions
from ros_rig import NANOSECONDS, QOS, TIMEOUT, Driver, NodeProcess, imu, stamp_of, wrench_of
from sensor_msgs.msg import FluidPressure, JointState
from visualization_msgs.msg import Marker, MarkerArray

from slosh_ros.engine import Loads, MotionSample, SloshConfig, SloshEngine, Verdict
from slosh_ros.engine.stamped import StampedDoubles
from slosh_ros.ros.slosh_node import SloshNode

pytestmark = [pytest.mark.ros, pytest.mark.timeout(120)]

START = 100 * NANOSECONDS
STEP = 10_000_000
SAMPLES = 60

TANKS = """/**:
  ros__parameters:
    tanks: [front, rear]
    front:
      {xyz: [3.0, 0.0, 1.0], rpy: [0.0, 0.0, 0.3], shape: rectangular, length: 3.0, width: 2.0,
       height: 1.5, fill_ratio: 0.5, modes: 4, damping_ratio: 0.02,
       pressure: {nose: [1.5, 0.0, -0.5]}}
    rear:
      {xyz: [-3.0, 0.0, 1.0], shape: cylinder_x, radius: 0.9, length: 4.0, fill_ratio: 0.6,
       modes: 3, damping_ratio: 0.02}
    outputs.surface_rate: 20.0
"""
OUTPUTS: dict[str, type] = {
    'wrench': WrenchStamped,
    'wrench_total': WrenchStamped,
    'wrench_state': WrenchStamped,
    'front/wrench': WrenchStamped,
    'rear/wrench': WrenchStamped,
    'modes': JointState,
    'centre_of_mass': PointStamped,
    'pressure/nose': FluidPressure,
    'surface': MarkerArray,
}


@pytest.fixture(scope='module')
def config(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp('outputs') / 'tanks.yaml'
    file.write_text(TANKS)
    return file


class Drive:
    """What the node said to a drive, and what an engine in this process says to it."""

    def __init__(self, config: Path, log: Path) -> None:
        self.received: dict[str, list] = {name: [] for name in OUTPUTS}
        self.engine = SloshEngine(SloshConfig.from_file(config))
        self.answers: list[tuple[Loads, list[np.ndarray], list[np.ndarray], np.ndarray]] = []
        with (
            NodeProcess('slosh_node', log, '--params-file', str(config)) as node,
            Driver() as driver,
        ):
            node.wait_for('ready')
            driver.received = {name: self.received[name] for name in OUTPUTS if name != 'surface'}
            for name, kind in OUTPUTS.items():
                driver.node.create_subscription(
                    kind, f'slosh_node/{name}', self.received[name].append, QOS
                )
            driver.wait_for_node()
            warm_up = 0  # until the node knows of all who listen
            while not all(self.received.values()):
                driver.publisher.publish(imu(START - 20 * NANOSECONDS + warm_up))
                driver.spin_for(0.05)
                warm_up += 5 * STEP
                assert warm_up < 19 * NANOSECONDS
            for k in range(SAMPLES):  # after a gap long enough to start from rest
                force = (0.8 * np.sin(0.1 * k), 0.5, 9.81)
                driver.exchange(imu(START + k * STEP, force))
                sample = MotionSample.from_imu(START + k * STEP, list(force), [0.0] * 3)
                _, loads = self.engine.feed(sample)
                tanks = self.engine.tanks
                self.answers.append(
                    (
                        loads,
                        [tank.wrench for tank in tanks],
                        [np.stack([tank.beta, tank.beta_rate]) for tank in tanks],
                        self.engine.centre_of_mass,
                    )
                )
            last = START + (SAMPLES - 1) * STEP
            slots = dict.fromkeys(('surface',), last // (5 * STEP) * 5 * STEP)
            driver.spin_until(
                lambda: all(
                    _stamp(messages[-1]) >= slots.get(name, last)
                    for name, messages in self.received.items()
                )
            )
        for messages in self.received.values():
            messages[:] = [message for message in messages if _stamp(message) >= START]


def _stamp(message: object) -> int:
    return stamp_of(message.markers[0] if isinstance(message, MarkerArray) else message)


@pytest.fixture(scope='module')
def drive(config: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Drive]:
    return Drive(config, tmp_path_factory.mktemp('drive') / 'node.log')


@pytest.mark.parametrize('name', [name for name in OUTPUTS if name != 'surface'])
def test_every_output_follows_every_sample(drive, name):
    stamps = [stamp_of(message) for message in drive.received[name]]
    assert stamps == [START + k * STEP for k in range(SAMPLES)]


def test_wrenches_of_the_tanks_add_up_and_equal_offline(drive):
    total = drive.received['wrench']
    shares = [drive.received[f'{name}/wrench'] for name in ('front', 'rear')]
    for k, (loads, of_tanks, _, _) in enumerate(drive.answers):
        assert wrench_of(total[k]) == loads.wrench.tolist()
        for share, expected in zip(shares, of_tanks, strict=True):
            assert wrench_of(share[k]) == expected.tolist()
            assert share[k].header.frame_id == 'base_link'
        np.testing.assert_allclose(np.sum(of_tanks, axis=0), loads.wrench, atol=1e-6)
    assert min(abs(share[-1].wrench.force.x) for share in shares) > 10.0


def test_modes_are_joints_named_by_tank(drive):
    names = [
        f'{tank.config.name}/{mode}'
        for tank in drive.engine.tanks
        for mode in tank.coefficients.names
    ]
    assert len(names) == 7
    for message, (_, _, modes, _) in zip(drive.received['modes'], drive.answers, strict=True):
        assert list(message.name) == names
        beta, rate = np.concatenate(modes, axis=1)
        assert list(message.position) == beta.tolist()
        assert list(message.velocity) == rate.tolist()
    assert np.abs(beta).max() > 1e-3


def test_mass_centre_is_that_of_all_tanks(drive):
    for message, (*_, centre) in zip(drive.received['centre_of_mass'], drive.answers, strict=True):
        assert message.header.frame_id == 'base_link'
        assert [message.point.x, message.point.y, message.point.z] == centre.tolist()
    assert np.ptp([centre[0] for *_, centre in drive.answers]) > 1e-3


def test_pressure_is_in_the_frame_of_its_tank(drive):
    for message, (loads, *_) in zip(drive.received['pressure/nose'], drive.answers, strict=True):
        assert message.header.frame_id == 'front_link'
        assert message.fluid_pressure == float(loads.pressure[0])


def test_surface_comes_at_its_own_rate_with_the_wave_on_it(drive):
    """20 Hz of the stamps, from samples at 100 Hz; heights are those of the modes."""
    pictures = drive.received['surface']
    stamps = [stamp_of(picture.markers[0]) for picture in pictures]
    assert np.diff(stamps).tolist() == [5 * STEP] * (len(stamps) - 1)
    assert len(stamps) == SAMPLES // 5
    _, _, modes, _ = drive.answers[(stamps[-1] - START) // STEP]
    for place, tank in enumerate(drive.engine.tanks):
        surface, outline = pictures[-1].markers[2 * place : 2 * place + 2]
        assert (surface.type, outline.type) == (Marker.TRIANGLE_LIST, Marker.LINE_LIST)
        assert {surface.header.frame_id, outline.header.frame_id} == {f'{tank.config.name}_link'}
        assert {surface.ns, outline.ns} == {tank.config.name}
        assert len(surface.points) % 3 == 0
        assert len(surface.colors) == len(surface.points)
        assert len(outline.points) % 2 == 0
        c = tank.coefficients
        points = np.array([(p.x, p.y, p.z) for p in surface.points]) - c.liquid.surface_centre
        wave = c.potentials.modes(points * [1, 1, 0]) @ modes[place][0]
        np.testing.assert_allclose(points[:, 2], wave, atol=1e-3 * np.abs(wave).max())
        brightness = np.array([c.r + c.g + c.b for c in surface.colors])
        assert np.corrcoef(wave, brightness)[0, 1] > 0.95  # crests are bright
        assert {c.a for c in surface.colors} == {1.0}
    assert np.ptp(points[:, 2]) > 1e-3


def test_outputs_that_are_switched_off_do_not_exist(config, tmp_path):
    off = [('-p', f'outputs.{name}:=false') for name in (
        'wrench_total', 'wrench_state', 'tank_wrenches', 'modes', 'centre_of_mass', 'surface',
        'pressure',
    )]  # fmt: skip
    with (
        NodeProcess(
            'slosh_node', tmp_path / 'node.log', '--params-file', str(config), *sum(off, ())
        ) as node,
        Driver() as driver,
    ):
        node.wait_for('ready')
        del driver.received['wrench_total']
        driver.wait_for_node()
        driver.spin_until(lambda: driver.node.count_publishers('slosh_node/coupling') > 0)
        offered = {
            name
            for name, _ in driver.node.get_publisher_names_and_types_by_node('slosh_node', '/')
        }
        assert {name.removeprefix('/slosh_node/') for name in offered} & set(OUTPUTS) == {'wrench'}
        driver.publisher.publish(imu(START))
        driver.spin_until(lambda: len(driver.received['wrench']) == 1)


def test_what_nobody_listens_to_costs_no_message(config, monkeypatch):
    """Neither made nor handed to DDS: of nine outputs, only the one that is heard."""
    published, written = Counter(), Counter()
    publish, write = Publisher.publish, StampedDoubles.write

    def counted(self: Publisher, message: object) -> None:
        published[self.topic_name.removeprefix('/slosh_node/')] += 1
        publish(self, message)

    def seen(self: StampedDoubles, stamp: int, values: list[float]) -> object:
        written[len(values)] += 1
        return write(self, stamp, values)

    monkeypatch.setattr(Publisher, 'publish', counted)
    monkeypatch.setattr(StampedDoubles, 'write', seen)
    rclpy.init(
        args=['--ros-args', '--params-file', str(config)],
        signal_handler_options=SignalHandlerOptions.NO,
    )
    try:
        node = SloshNode()
        stamps = itertools.count(START, STEP)

        def drive() -> dict[str, int]:
            """Drive for thirty samples and tell what was published of them."""
            rclpy.spin_once(node, timeout_sec=0.0)  # by which it hears of listeners
            published.clear()
            written.clear()
            for _ in range(30):
                node._on_imu(serialize_message(imu(next(stamps), (1.0, 0.5, 9.81))))
            return {name: count for name, count in published.items() if name in OUTPUTS}

        assert drive() == {}
        assert not written
        assert node.engine.gate.counts[Verdict.ACCEPTED] == 29
        for name, doubles in (('modes', 0), ('front/wrench', 30)):
            listener = node.create_subscription(OUTPUTS[name], f'~/{name}', print, 10)
            until = time.monotonic() + TIMEOUT
            while not node.count_subscribers(f'~/{name}') or drive() != {name: 30}:
                assert time.monotonic() < until
                time.sleep(0.05)
            assert sum(written.values()) == doubles
            node.destroy_subscription(listener)
            while drive():
                assert time.monotonic() < until
                time.sleep(0.05)
        node.destroy_node()
    finally:
        rclpy.shutdown()
