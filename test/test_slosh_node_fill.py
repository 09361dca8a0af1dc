"""Filling and draining a running slosh_node over DDS."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import psutil
import pytest

pytest.importorskip('rclpy', reason='needs the ROS 2 wheels (make venv)')

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from drives import write_bag
from geometry_msgs.msg import InertiaStamped
from rcl_interfaces.srv import GetParameters, SetParameters, SetParametersAtomically
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from ros_rig import (
    NANOSECONDS,
    QOS,
    TIMEOUT,
    Driver,
    NodeProcess,
    call,
    diagnostics,
    imu,
    stamp_of,
    wrench_of,
)
from std_msgs.msg import Float64, Float64MultiArray

from slosh_ros.bag import MotionBag, Recording, replay
from slosh_ros.engine import MotionSample, SloshConfig, SloshEngine
from slosh_ros.engine import fill as engine_fill
from slosh_ros.engine.convert import IMU
from slosh_ros.hydro import volume, volume_sweep
from slosh_ros.hydro.volume import VolumeResolution, volume_coefficients
from slosh_ros.hydro.volume_sweep import VolumeSweep
from slosh_ros.ros import fill as node_fill
from slosh_ros.ros.fill import REFUSED
from slosh_ros.ros.slosh_node import SloshNode

pytestmark = [pytest.mark.ros, pytest.mark.timeout(120)]

START = 100 * NANOSECONDS
STEP = 10_000_000
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

TANK = """/**:
  ros__parameters:
    tank: {shape: rectangular, length: 4.0, width: 2.0, height: 1.5, fill_ratio: 0.5, modes: 4}
"""
TANKS = """/**:
  ros__parameters:
    tanks: [front, rear]
    front: {xyz: [3.0, 0.0, 1.0], shape: cylinder_z, radius: 0.8, height: 1.5, fill_ratio: 0.5}
    rear: {xyz: [-3.0, 0.0, 1.0], shape: cylinder_x, radius: 0.8, length: 3.0, fill_ratio: 0.5,
           modes: 2}
"""
MESH = """/**:
  ros__parameters:
    tank: {shape: mesh, mesh_file: box.ply, fill_ratio: 0.5, modes: 2, damping_ratio: [0.05, 0.05],
           density: 850.0}
"""
RELIABLE = 'qos_overrides./imu/data.subscription.reliability:=reliable'
SPHERE = """/**:
  ros__parameters:
    tank: {shape: sphere, radius: 0.9, fill_ratio: 0.5, modes: 8}
"""


def sample(k: int) -> tuple[int, tuple[float, ...]]:
    return START + k * STEP, (0.5 * np.sin(0.07 * k), 0.3, 9.81)


class Fills:
    """Publishes fills and waits until a wrench shows that they have come."""

    def __init__(self, driver: Driver, topic: str) -> None:
        self.driver = driver
        self.publisher = driver.node.create_publisher(Float64, topic, QOS)
        driver.spin_until(lambda: self.publisher.get_subscription_count() > 0)

    def fill(self, ratio: float) -> None:
        self.publisher.publish(Float64(data=ratio))


class Stream:
    """Sends samples at their times, whatever comes, and notes how long answers take."""

    def __init__(self, driver: Driver) -> None:
        self.driver = driver
        self.answers = driver.received['wrench_total']
        self.waits: list[float] = []
        self.ahead = 0  # most samples that had no answer when another one was sent
        self.count = 0
        self._sent: dict[int, float] = {}
        self._due = time.monotonic()

    def one(self) -> float:
        """Send a sample of a tank at rest; return the last weight that was heard of."""
        self.count += 1
        message = imu(START + self.count * STEP)
        self._sent[START + self.count * STEP] = time.monotonic()
        self.driver.publisher.publish(message)
        self._due = max(self._due + STEP / NANOSECONDS, time.monotonic())
        self.listen(0.001)
        while (left := self._due - time.monotonic()) > 0.0:
            self.listen(min(left, 0.005))
        self.ahead = max(self.ahead, len(self._sent))
        return -wrench_of(self.answers[-1])[2]

    def listen(self, seconds: float) -> None:
        seen = len(self.answers)
        self.driver.spin_for(seconds)
        for answer in self.answers[seen:]:
            self.waits.append(time.monotonic() - self._sent.pop(stamp_of(answer)))

    def until(self, done: Callable[[], bool]) -> None:
        """Go on until something is so."""
        while not done():
            assert self.count < 20_000
            self.one()


def test_fill_by_topic_and_parameter_equals_the_engine_told_the_same_and_the_bag(tmp_path: Path):
    """Draining to empty and filling to the brim on the way; bit for bit what set_fill gives."""
    live, sent = [], []
    file = tmp_path / 'tank.yaml'
    file.write_text(TANK)
    engine = SloshEngine(SloshConfig.from_file(file))
    with (
        NodeProcess('slosh_node', tmp_path / 'node.log', '--params-file', str(file)) as node,
        Driver() as driver,
    ):
        node.wait_for('ready')
        driver.wait_for_node()
        fills = Fills(driver, 'slosh_node/fill')
        liquids: list[InertiaStamped] = []
        couplings: list[Float64MultiArray] = []
        for kind, topic, heard in (
            (InertiaStamped, 'liquid', liquids),
            (Float64MultiArray, 'coupling', couplings),
        ):
            driver.node.create_subscription(kind, f'slosh_node/{topic}', heard.append, LATCHED)
        driver.spin_until(lambda: liquids and couplings)
        k = 0
        for ratio, by_topic in (
            (0.5, True), (0.7, True), (0.4, False), (0.0, True), (1.0, False), (0.6, True),
        ):  # fmt: skip
            if by_topic:
                fills.fill(ratio)
                driver.spin_for(0.3)
            else:
                parameter = Parameter('tank.fill_ratio', value=ratio).to_parameter_msg()
                (result,) = call(
                    driver, SetParameters, 'slosh_node/set_parameters',
                    SetParameters.Request(parameters=[parameter]),
                ).results  # fmt: skip
                assert result.successful, result.reason
            engine.set_fill('tank', ratio)
            sent.append((sample(k)[0], '/slosh_node/fill', ratio))
            for _ in range(15):
                stamp, force = sample(k)
                k += 1
                slosh, total = driver.exchange(imu(stamp, force))
                _, loads = engine.feed(MotionSample.from_imu(stamp, list(force), [0.0] * 3))
                assert wrench_of(slosh) == loads.wrench.tolist()
                assert wrench_of(total) == loads.total.tolist()
                live.append(wrench_of(total))
            mass = 12000.0 * ratio
            assert engine.carried.mass == pytest.approx(mass)
            driver.spin_until(lambda mass=mass: abs(liquids[-1].inertia.m - mass) < 1e-6)
            np.testing.assert_array_equal(
                np.reshape(couplings[-1].data, (6, 6)), engine.carried.coupling
            )
        assert len(liquids) == 6  # what does not change is not told again
        driver.spin_until(lambda: diagnostics(driver)['tank.fill_ratio'] == '0.6000')
        seen = diagnostics(driver)  # 12000 kg when full; what came less what went is what is there
        assert seen['tank.mass [kg]'] == '7200.000'
        assert float(seen['tank.received so far [kg]']) == pytest.approx(2400.0 + 12000.0)
        assert float(seen['tank.released so far [kg]']) == pytest.approx(3600.0 + 2 * 4800.0)
        value = call(
            driver, GetParameters, 'slosh_node/get_parameters',
            GetParameters.Request(names=['tank.fill_ratio']),
        ).values[0]  # fmt: skip
        assert value.double_value == 0.6  # the parameter has followed the topic
        assert 'tank is filled to 0.' in node.output  # the news may have waited for the next
    bag = write_bag(
        tmp_path / 'drive', [sample(j)[0] for j in range(k)],
        lambda t: sample(round(t * NANOSECONDS) // STEP)[1], fills=sent,
    )  # fmt: skip
    offline = SloshEngine(SloshConfig.from_file(file))
    recording = Recording(offline)
    with MotionBag(bag, IMU, fills={'tank': (None, 'slosh_node/fill')}) as source:
        replay(source, offline, [recording])
    assert recording.total.tolist() == live
    assert recording.liquids == 6


def test_bad_fills_are_refused_in_words_and_change_nothing(tmp_path: Path):
    file = tmp_path / 'tank.yaml'
    file.write_text(TANK)
    with (
        NodeProcess('slosh_node', tmp_path / 'node.log', '--params-file', str(file)) as node,
        Driver() as driver,
    ):
        node.wait_for('ready')
        driver.wait_for_node()
        for k in range(10):
            _, total = driver.exchange(imu(START + k * STEP))
        fills = Fills(driver, 'slosh_node/fill')
        for ratio in (float('nan'), float('inf'), -0.1, 1.5, 1e308):
            fills.fill(ratio)
        node.wait_for('it must be a ratio from 0 to 1')
        driver.spin_until(lambda: diagnostics(driver).get('fill refused') == '5')
        for value in (1.5, float('nan'), 1, '0.5'):
            parameter = Parameter('tank.fill_ratio', value=value).to_parameter_msg()
            (result,) = call(
                driver, SetParameters, 'slosh_node/set_parameters',
                SetParameters.Request(parameters=[parameter]),
            ).results  # fmt: skip
            assert not result.successful
            assert result.reason
        changes = [Parameter('tank.fill_ratio', value=0.7), Parameter('tank.length', value=5.0)]
        answer = call(
            driver, SetParametersAtomically, 'slosh_node/set_parameters_atomically',
            SetParametersAtomically.Request(parameters=[p.to_parameter_msg() for p in changes]),
        )  # fmt: skip
        assert not answer.result.successful
        _, again = driver.exchange(imu(START + 10 * STEP))
        assert wrench_of(again) == wrench_of(total)
        assert diagnostics(driver)['tank.fill_ratio'] == '0.5000'


def test_each_tank_has_its_own_fill_and_samples_go_on_while_one_is_computed(tmp_path: Path):
    file = tmp_path / 'tanks.yaml'
    file.write_text(TANKS)
    with (
        NodeProcess('slosh_node', tmp_path / 'node.log', '--params-file', str(file)) as node,
        Driver() as driver,
    ):
        node.wait_for('ready')
        driver.wait_for_node()
        driver.exchange(imu(START))
        front, rear = (Fills(driver, f'slosh_node/{name}/fill') for name in ('front', 'rear'))
        k, weight = 0, 0.0
        expected = 1000.0 * np.pi * 0.8**2 * (1.5 * 0.8 + 3.0 * 0.25) * 9.81
        until = time.monotonic() + 100.0
        while abs(weight - expected) > 1e-6 * expected:
            assert time.monotonic() < until
            if k % 200 == 0:  # as sensors do
                rear.fill(0.25)
                front.fill(0.8)
            k += 1
            driver.spin_for(0.003)  # the process that computes is at low priority
            _, total = driver.exchange(imu(START + k * STEP))
            weight = -wrench_of(total)[2]
        seen = diagnostics(driver)
        assert (seen['front.fill_ratio'], seen['rear.fill_ratio']) == ('0.8000', '0.2500')


def test_samples_do_not_wait_while_the_liquid_at_other_fills_is_computed(tmp_path: Path):
    """The first fill of a sphere takes seconds of computing, a sensor of 100 Hz goes on."""
    file = tmp_path / 'tank.yaml'
    file.write_text(SPHERE)
    with (
        NodeProcess(
            'slosh_node', tmp_path / 'node.log', '--params-file', str(file), '-p', RELIABLE
        ) as node,
        Driver() as driver,
    ):
        node.wait_for('ready')
        driver.wait_for_node()
        driver.exchange(imu(START))
        fills = Fills(driver, 'slosh_node/fill')
        stream = Stream(driver)
        for _ in range(100):
            full = stream.one()
        assert 'is being computed' not in node.output
        stream.waits.clear()
        fills.fill(0.25)
        stream.until(lambda: bool(node.children))
        workers = node.children
        stream.until(lambda: abs(stream.one() / full - 0.5) < 1e-6)
        assert 'is being computed' in node.output
        assert len(stream.waits) > 30
        assert np.median(stream.waits) < 0.05
        assert not psutil.wait_procs(workers, TIMEOUT)[1]
        node.wait_for('the liquid of tank is interpolated over the fill to ')


def weight_of(ratio: float) -> float:
    """Of the box in MESH [N]."""
    return ratio * 3.0 * 1.2 * 1.0 * 850.0 * 9.81


@pytest.fixture
def mesh_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Parameters of a tank of twelve triangles; no table of it is on the disk."""
    trimesh = pytest.importorskip('trimesh')
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'cache'))
    trimesh.creation.box((3.0, 1.2, 1.0)).export(tmp_path / 'box.ply')
    file = tmp_path / 'tank.yaml'
    file.write_text(MESH)
    return file


def test_a_fill_of_a_mesh_comes_before_its_table_and_samples_go_on(
    tmp_path: Path, mesh_file: Path
):
    """
    What is wanted is solved for by itself, while all fills are being tabulated.

    Not one sample of a stream waits or is lost; the wrench is that of a node that starts so.
    """
    with (
        NodeProcess(
            'slosh_node', tmp_path / 'node.log', '--params-file', str(mesh_file), '-p', RELIABLE
        ) as node,
        Driver() as driver,
    ):
        node.wait_for('ready', 60.0)
        driver.wait_for_node()
        driver.exchange(imu(START))
        fills = Fills(driver, 'slosh_node/fill')
        reports: list[DiagnosticArray] = []
        driver.node.create_subscription(DiagnosticArray, '/diagnostics', reports.append, 10)
        stream = Stream(driver)
        for _ in range(100):
            assert stream.one() == pytest.approx(weight_of(0.5))
        for ratio in (0.3, 0.7):
            fills.fill(ratio)
            stream.until(lambda r=ratio: stream.one() == pytest.approx(weight_of(r)))
        assert 'is interpolated over' not in node.output
        (worker,) = node.children  # which still tabulates
        driver.spin_until(lambda: len(stream.answers) > stream.count)
        heard = [stamp_of(answer) for answer in stream.answers]
        assert heard == [START + k * STEP for k in range(stream.count + 1)]
        assert stream.ahead < 100
        assert np.median(stream.waits) < 0.05
        told = [{v.key: v.value for v in report.status[0].values} for report in reports]
        waiting = [values.get('tank.fill_ratio wanted') for values in told]
        assert {'0.3000, is being computed', '0.7000, is being computed'} & set(waiting)
        seen = diagnostics(driver)
        assert 'tank.fill_ratio wanted' not in seen
        kept = weight_of(1.0) / 9.81
        assert float(seen['tank.mass [kg]']) == pytest.approx(0.7 * kept, abs=1e-2)
        assert float(seen['tank.received so far [kg]']) == pytest.approx(0.4 * kept, abs=1e-2)
        assert float(seen['tank.released so far [kg]']) == pytest.approx(0.2 * kept, abs=1e-2)

        mesh_file.write_text(MESH.replace('0.5,', '0.7,'))
        there = SloshEngine(SloshConfig.from_file(mesh_file))
        (error,) = (tank.coefficients.error for tank in there.tanks)
        assert error is not None
        live, expected = [], []
        there.feed(MotionSample.from_imu(START, [0.0, 0.0, 9.81], [0.0] * 3))
        for k in range(stream.count + 1, stream.count + 60):
            stamp, force = START + k * STEP, sample(k)[1]
            live.append(wrench_of(driver.exchange(imu(stamp, force))[0]))
            _, loads = there.feed(
                MotionSample.from_imu(stamp - stream.count * STEP, list(force), [0.0] * 3)
            )
            expected.append(loads.wrench)
        size = np.abs(expected).max()
        assert np.abs(np.array(live) - expected).max() < (10.0 * error + 1e-5) * size
        assert node.stop() == 0
        assert not psutil.wait_procs([worker], TIMEOUT)[1]


def test_a_mesh_whose_table_is_on_the_disk_is_filled_as_the_bag_tells(
    tmp_path: Path, mesh_file: Path, monkeypatch: pytest.MonkeyPatch
):
    """Bit for bit, at every sample from the first; the table is a coarse one that this builds."""
    with monkeypatch.context() as coarse:
        few = VolumeResolution(cells=1.4, degree=3, triangles=800, grids=0)
        coarse.setattr(volume_sweep, 'VolumeSweep', partial(VolumeSweep, resolution=few))
        coarse.setattr(engine_fill, 'apart', engine_fill._here)
        SloshEngine(SloshConfig.from_file(mesh_file)).prepare_fills()
    live, sent, k = [], [], 0
    with (
        NodeProcess('slosh_node', tmp_path / 'node.log', '--params-file', str(mesh_file)) as node,
        Driver() as driver,
    ):
        node.wait_for('ready', 60.0)
        driver.wait_for_node()
        driver.exchange(imu(START, (0.0, 0.0, 9.81)))
        fills = Fills(driver, 'slosh_node/fill')
        fills.fill(0.5)
        node.wait_for('the liquid of tank is interpolated over the fill to ', 60.0)
        for ratio in (0.2, 0.85, 0.995, 1.0, 0.6):
            fills.fill(ratio)
            sent.append((START + (k + 1) * STEP, '/slosh_node/fill', ratio))
            driver.spin_for(0.3)
            for _ in range(12):
                k += 1
                _, total = driver.exchange(imu(*sample(k)))
                live.append(wrench_of(total))
            assert -live[-1][2] == pytest.approx(weight_of(ratio))
    bag = write_bag(
        tmp_path / 'drive', [START + j * STEP for j in range(k + 1)],
        lambda t: sample(round(t * NANOSECONDS) // STEP)[1] if t else (0.0, 0.0, 9.81),
        fills=sent,
    )  # fmt: skip
    offline = SloshEngine(SloshConfig.from_file(mesh_file))
    recording = Recording(offline)
    with MotionBag(bag, IMU, fills={'tank': (None, 'slosh_node/fill')}) as source:
        replay(source, offline, [recording])
    assert recording.total[1:].tolist() == live
    assert offline.books['tank'].mass == pytest.approx(weight_of(0.6) / 9.81)


def test_a_mesh_that_has_no_table_is_filled_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """Fill by fill, after a warning; a fill in two pools is refused, and nothing waits for it."""
    trimesh = pytest.importorskip('trimesh')
    pytest.importorskip('manifold3d')
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'cache'))
    few = VolumeResolution(cells=1.4, degree=3, triangles=800, grids=0)
    monkeypatch.setattr(volume_sweep, 'VolumeSweep', partial(VolumeSweep, resolution=few))
    monkeypatch.setattr(
        volume, 'volume_coefficients', partial(volume_coefficients, resolution=few)
    )
    monkeypatch.setattr(engine_fill, 'apart', engine_fill._here)
    monkeypatch.setattr(node_fill, '_FROM_DISK', 0.0)
    gap = trimesh.creation.box((2.0, 0.5, 0.5)).apply_translation((0.0, 0.0, -0.5))
    trimesh.creation.box((1.0, 1.25, 1.5)).difference(gap).export(tmp_path / 'box.ply')
    file = tmp_path / 'tank.yaml'
    file.write_text(MESH.replace('box.ply', str(tmp_path / 'box.ply')))
    whole = (1.25 * 1.5 - 0.25) * 850.0 * 9.81
    rclpy.init(
        args=['--ros-args', '--params-file', str(file)],
        signal_handler_options=SignalHandlerOptions.NO,
    )
    try:
        node = SloshNode()
        refused, k = node._watch._refused, 0

        def until(done: Callable[[], bool]) -> float:
            nonlocal k
            for _ in range(3000):
                if done():
                    return node.engine.tanks[0].coefficients.mass * 9.81
                k += 1
                node._on_motion(imu(START + k * STEP))
                time.sleep(0.01)
            raise AssertionError(node._watch.extra)

        until(lambda: k > 3)
        for ratio in (0.45, 0.6):
            node._fills._on_fill('tank', Float64(data=ratio))
            until(lambda r=ratio: node.engine.fill_ratio('tank') == r)
            assert until(lambda: not node._fills._wanted) == pytest.approx(ratio * whole, rel=0.2)
        until(lambda: node._fills._told)
        assert 'the mesh has 2 pools' in node._fills._impossible
        assert refused[REFUSED] == 0
        node._fills._on_fill('tank', Float64(data=0.1))
        until(lambda: refused[REFUSED] == 1)
        node._fills._on_fill('tank', Float64(data=0.4))
        until(lambda: node.engine.fill_ratio('tank') == 0.4)
        last = k
        assert until(lambda: k > last + 1) == pytest.approx(0.4 * whole)
        assert not node._fills._wanted
        assert not node._watch.extra
        until(lambda: not node._fills._busy)
        node.destroy_node()
    finally:
        rclpy.shutdown()


def test_a_node_that_ends_while_it_computes_leaves_no_process(tmp_path: Path):
    """Ctrl-C and a crash of a caller are in test_apart."""
    file = tmp_path / 'tank.yaml'
    file.write_text(SPHERE.replace('0.9', '0.95'))  # which is on no disk
    with (
        NodeProcess('slosh_node', tmp_path / 'node.log', '--params-file', str(file)) as node,
        Driver() as driver,
    ):
        node.wait_for('ready')
        fills = Fills(driver, 'slosh_node/fill')
        driver.spin_for(0.3)
        fills.fill(0.25)
        node.wait_for('is being computed')
        workers = node.children
        assert len(workers) == 1
        assert node.stop(signal.SIGTERM) == 0
        assert not psutil.wait_procs(workers, TIMEOUT)[1]
        assert 'Traceback' not in node.output
        assert 'Fatal' not in node.output
