"""`slosh replay`: the paper's braking case from a bag, formats, outputs, live equals offline."""

from __future__ import annotations

import csv
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import REPOSITORY
from drives import SECOND, START, G, feed, stamps, wrenches, write_bag
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from slosh_ros.bag import MotionBag, Recording, replay
from slosh_ros.cli import _fill_topics
from slosh_ros.engine import SloshConfig, SloshEngine
from slosh_ros.engine.convert import IMU
from slosh_ros.errors import InputError
from slosh_ros.study.animation import animate_replay

BRAKED = """/**:
  ros__parameters:
    tank:
      shape: cylinder_x
      radius: 1.2
      length: 5.75
      fill_depth: 1.2
      modes: {modes}
      damping_ratio: 0.0
"""
HEAD = (
    'stamp_ns,fx,fy,fz,mx,my,mz,total_fx,total_fy,total_fz,total_mx,total_my,total_mz,'
    'elevation_max,valid'
)


def slosh(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, '-m', 'slosh_ros.cli', *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def table(path: Path) -> np.ndarray:
    return np.genfromtxt(path, delimiter=',', names=True)


def brake(t: float) -> tuple[float, float, float]:
    """Section 4.3: 0.1 g, reached in 2 s."""
    return (-0.981 * min(t / 2.0, 1.0), 0.0, G)


@pytest.fixture
def config(tmp_path: Path) -> Path:
    file = tmp_path / 'braked.yaml'
    file.write_text(BRAKED.format(modes=1))
    return file


@pytest.mark.parametrize(
    ('modes', 'published'),
    [(1, 1.4657), pytest.param(60, 1.4751, id='24 longitudinal modes')],
)
def test_section_4_3_peak_braking_force(tmp_path, modes, published):
    """Peak of the total force over m a_0, half full, THEORY 8."""
    config = tmp_path / 'braked.yaml'
    config.write_text(BRAKED.format(modes=modes))
    period = 2 * np.pi / 1.65
    bag = write_bag(tmp_path / 'bag', stamps(3.5 * period, 0.01), brake)
    result = slosh('replay', bag, '--config', config, '--out', tmp_path / 'loads.csv')
    assert result.returncode == 0, result.stderr
    loads = table(tmp_path / 'loads.csv')
    mass = 1000 * np.pi * 1.2**2 / 2 * 5.75
    assert loads['total_fx'].max() / (mass * 0.981) == pytest.approx(published, rel=1e-3)


@pytest.mark.parametrize('kind', ['mcap', 'mcap_zstd', 'sqlite3', 'sqlite3_zstd', 'ros1'])
def test_every_bag_format_gives_the_same_bits(tmp_path, config, kind):
    times = stamps(2.0, 0.01)
    bag = write_bag(tmp_path / ('drive.bag' if kind == 'ros1' else 'drive'), times, brake, kind)
    result = slosh('replay', bag, '--config', config, '--out', tmp_path / 'loads.csv')
    assert result.returncode == 0, result.stderr
    with (tmp_path / 'loads.csv').open() as file:
        rows = list(csv.DictReader(file))
    assert ','.join(rows[0]) == HEAD
    expected = feed(SloshEngine(SloshConfig.from_file(config)), times, brake)
    assert [int(row['stamp_ns']) for row in rows] == times
    assert [float(row['fx']) for row in rows] == wrenches(expected)[:, 0].tolist()


def test_bare_mcap_file_is_read_too(tmp_path, config):
    bag = write_bag(tmp_path / 'drive', stamps(1.0, 0.01), brake)
    (file,) = bag.glob('*.mcap')
    assert slosh('replay', file, '--config', config).returncode == 0


def test_bag_of_wrenches_holds_the_same_doubles(tmp_path, config):
    bag = write_bag(tmp_path / 'drive', stamps(1.0, 0.01), brake)
    for name in ('loads.csv', 'loads.mcap'):
        result = slosh('replay', bag, '--config', config, '--out', tmp_path / name)
        assert result.returncode == 0, result.stderr
    loads = table(tmp_path / 'loads.csv')
    read: dict[str, list[tuple[int, float, float]]] = {}
    with AnyReader(
        [tmp_path / 'loads.mcap'], default_typestore=get_typestore(Stores.ROS2_JAZZY)
    ) as reader:
        for connection, received, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            stamp = message.header.stamp.sec * SECOND + message.header.stamp.nanosec
            assert stamp == received
            assert message.header.frame_id == 'base_link'
            entry = (stamp, message.wrench.force.x, message.wrench.torque.y)
            read.setdefault(connection.topic, []).append(entry)
    with (tmp_path / 'loads.csv').open() as file:
        rows = list(csv.DictReader(file))
    for topic, prefix in (('/slosh_node/wrench', ''), ('/slosh_node/wrench_total', 'total_')):
        assert read[topic] == [
            (int(r['stamp_ns']), float(r[f'{prefix}fx']), float(r[f'{prefix}my'])) for r in rows
        ]
    assert len(rows) == len(loads)
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        'braked.yaml', 'drive', 'loads.csv', 'loads.mcap'
    ]  # fmt: skip


def test_pressures_follow_the_verdict_and_fill_topics_of_their_own(tmp_path, config):
    """Columns by name, and the same doubles as FluidPressure, with the sample's stamp."""
    points = {'left': [0.5, 0.983, -0.688], 'front': [2.875, 0.0, -0.4]}
    lines = ''.join(f'      {name}: {point}\n' for name, point in points.items())
    config.write_text(config.read_text() + f'    pressure:\n{lines}')
    times = stamps(1.0, 0.01)
    bag = write_bag(tmp_path / 'drive', times, brake)
    for name in ('loads.csv', 'loads.mcap'):
        result = slosh('replay', bag, '--config', config, '--out', tmp_path / name)
        assert result.returncode == 0, result.stderr
        assert 'pressure front' in result.stdout
    with (tmp_path / 'loads.csv').open() as file:
        rows = list(csv.DictReader(file))
    assert ','.join(rows[0]) == HEAD + ',p_front,p_left'
    engine = SloshEngine(SloshConfig.from_file(config))
    offline = [loads.pressure.tolist() for loads in feed(engine, times, brake)]
    assert [[float(row['p_front']), float(row['p_left'])] for row in rows] == offline
    assert offline[0] == [0.0, 0.0]
    assert offline[-1][0] > 100.0  # the brakes push the liquid forward
    with AnyReader(
        [tmp_path / 'loads.mcap'], default_typestore=get_typestore(Stores.ROS2_JAZZY)
    ) as reader:
        for place, name in enumerate(('front', 'left')):
            (connection,) = (
                c for c in reader.connections if c.topic == f'/slosh_node/pressure/{name}'
            )
            assert connection.msgtype == 'sensor_msgs/msg/FluidPressure'
            messages = [
                (received, reader.deserialize(raw, connection.msgtype))
                for _, received, raw in reader.messages([connection])
            ]
            assert [received for received, _ in messages] == times
            assert [m.fluid_pressure for _, m in messages] == [row[place] for row in offline]
            assert {(m.header.frame_id, m.variance) for _, m in messages} == {('tank_link', 0.0)}


def test_a_part_of_a_bag_is_replayed(tmp_path, config):
    bag = write_bag(tmp_path / 'drive', stamps(3.0, 0.01), brake)
    out = tmp_path / 'loads.csv'
    result = slosh(
        'replay', bag, '--config', config, '--out', out, '--start', 1.0, '--duration', 0.5
    )
    assert result.returncode == 0, result.stderr
    rows = out.read_text().splitlines()[1:]
    assert [int(rows[0].split(',')[0]), len(rows)] == [START + SECOND, 50]


@pytest.mark.parametrize('drive', ['highway_drive', 'husky'])
def test_recorded_drives_replay_with_a_picture(tmp_path, drive):
    picture = tmp_path / 'drive.png'
    result = slosh(
        'replay', REPOSITORY / 'bags' / drive, '--config', REPOSITORY / 'config' / f'{drive}.yaml',
        '--plot', picture, '--out', tmp_path / 'loads.csv', '--duration', 30.0,
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    assert picture.read_bytes().startswith(b'\x89PNG')
    assert picture.stat().st_size > 50_000
    loads = table(tmp_path / 'loads.csv')
    assert all(np.isfinite(loads[name]).all() for name in loads.dtype.names)
    assert np.all(np.diff(loads['stamp_ns']) > 0)


def test_the_highway_drive_sloshes_as_much_as_its_accelerations_allow(tmp_path):
    """Order of magnitude by hand: 0.1 g of braking and grade on 27.8 t is 27 kN."""
    out = tmp_path / 'loads.csv'
    result = slosh(
        'replay', REPOSITORY / 'bags/highway_drive',
        '--config', REPOSITORY / 'config/highway_drive.yaml', '--out', out,
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    assert '6256 samples' in result.stdout
    loads = table(out)
    assert len(loads) == 6256
    mass = 1000 * np.pi * 1.125**2 / 2 * 14
    assert -loads['total_fz'].mean() == pytest.approx(
        mass * 9.70, rel=0.01
    )  # the phone reads 9.70
    assert 5e3 < np.abs(loads['fx']).max() < 0.5 * mass * G


def test_the_grade_of_the_road_is_felt_by_the_imu_only(tmp_path):
    """The twist of the same drive knows braking but not the hills."""
    peaks = {}
    for source in ('--imu', '--twist'):
        out = tmp_path / 'loads.csv'
        topic = '/imu/data' if source == '--imu' else '/twist'
        result = slosh(
            'replay', REPOSITORY / 'bags/highway_drive', '--out', out, source, topic,
            '--config', REPOSITORY / 'config/highway_drive.yaml',
        )  # fmt: skip
        assert result.returncode == 0, result.stderr
        loads = table(out)
        peaks[source] = (np.abs(loads['my']).max(), loads['total_fx'].std())
    ratio = peaks['--imu'][0] / peaks['--twist'][0]
    assert 0.3 < ratio < 3.0
    assert ratio != pytest.approx(1.0, abs=0.02)


@pytest.mark.ros
@pytest.mark.timeout(300)
def test_live_equals_offline_bit_for_bit(tmp_path):
    """Every sample of the highway drive over DDS, reliable and in lock-step, as exact doubles."""
    pytest.importorskip('rclpy', reason='needs the ROS 2 wheels (make venv)')
    from ros_rig import Driver, NodeProcess, imu, stamp_of, wrench_of

    config = REPOSITORY / 'config/highway_drive.yaml'
    out = tmp_path / 'loads.csv'
    assert (
        slosh('replay', REPOSITORY / 'bags/highway_drive', '--config', config, '--out', out)
    ).returncode == 0
    with out.open() as file:
        offline = list(csv.reader(file))[1:]
    live = []
    with (
        NodeProcess(
            'slosh_node', tmp_path / 'node.log', '--params-file', str(config),
            '-p', 'qos_overrides./imu/data.subscription.reliability:=reliable',
        ) as node,
        Driver() as driver,
        AnyReader(
            [REPOSITORY / 'bags/highway_drive'], default_typestore=get_typestore(Stores.ROS2_JAZZY)
        ) as reader,
    ):  # fmt: skip
        node.wait_for('ready')
        driver.wait_for_node()
        connections = [c for c in reader.connections if c.topic == '/imu/data']
        for connection, _, raw in reader.messages(connections):
            recorded = reader.deserialize(raw, connection.msgtype)
            a, w = recorded.linear_acceleration, recorded.angular_velocity
            stamp = recorded.header.stamp.sec * SECOND + recorded.header.stamp.nanosec
            wrench, total = driver.exchange(imu(stamp, (a.x, a.y, a.z), (w.x, w.y, w.z)))
            live.append([stamp_of(wrench), *wrench_of(wrench), *wrench_of(total)])
    assert len(live) == len(offline) == 6256
    assert live == [[int(row[0]), *map(float, row[1:13])] for row in offline]


TANKS = """/**:
  ros__parameters:
    tanks: [front, rear]
    front: {xyz: [2.0, 0.0, 1.0], shape: rectangular, length: 3.0, width: 2.0, height: 1.5,
            fill_ratio: 0.5}
    rear: {xyz: [-2.0, 0.0, 1.0], shape: cylinder_z, radius: 0.9, height: 1.5, fill_ratio: 0.5}
"""
LEVELS = (  # time [s], tank, ratio
    (0.2, 'front', 0.52), (0.5, 'rear', 0.3), (0.5, 'front', 0.0), (1.25, 'front', 0.7),
    (1.3, 'rear', float('nan')), (1.3, 'rear', 1.7), (2.1, 'rear', 1.0),
)  # fmt: skip


def filled_as_told(tanks: Path, times: list[int], since: int = START) -> np.ndarray:
    """Total wrenches of an engine that is told of the levels between the samples."""
    engine = SloshEngine(SloshConfig.from_file(tanks))
    levels = [(START + round(t * SECOND), name, ratio) for t, name, ratio in LEVELS]
    answers = []
    for stamp in times:
        while levels and levels[0][0] <= stamp:
            _, name, ratio = levels.pop(0)
            if ratio in (0.52, 0.3, 0.0, 0.7, 1.0):
                engine.set_fill(name, ratio)
        if stamp >= since:
            answers += [loads.total for loads in feed(engine, [stamp], brake)]
    return np.array(answers)


def test_a_bag_that_holds_fills_is_replayed_with_them(tmp_path):
    """Each in its place; with a start, the last ones from before; what is none is told."""
    tanks = tmp_path / 'tanks.yaml'
    tanks.write_text(TANKS)
    times = stamps(3.0, 0.01)
    levels = [
        (START + round(t * SECOND), f'/truck/slosh_node/{name}/fill', ratio)
        for t, name, ratio in LEVELS
    ]
    bag = write_bag(tmp_path / 'drive', times, brake, fills=levels)
    out = tmp_path / 'loads.csv'
    result = slosh('replay', bag, '--config', tanks, '--out', out)
    assert result.returncode == 0, result.stderr
    assert 'rear is filled as /truck/slosh_node/rear/fill tells, in the end to 100.0%' in (
        result.stdout
    )
    assert '2 x rear not filled as told; first because the fill of rear is nan' in result.stdout
    expected = filled_as_told(tanks, times)
    rows = table(out)
    for k, column in enumerate(('fx', 'fy', 'fz', 'mx', 'my', 'mz')):
        assert np.array_equal(rows[f'total_{column}'], expected[:, k])
    usual = {name: (None, f'slosh_node/{name}/fill') for name in ('front', 'rear')}
    for kind, start in (('sqlite3', 0.0), ('sqlite3_zstd', 1.0)):
        bag = write_bag(tmp_path / kind, times, brake, kind, fills=levels)
        engine = SloshEngine(SloshConfig.from_file(tanks))
        recording = Recording(engine)
        with MotionBag(bag, IMU, start=start, fills=usual) as source:
            replay(source, engine, [recording])
        since = START + round(start * SECOND)
        assert np.array_equal(recording.total, filled_as_told(tanks, times, since))
    assert recording.liquids == 3
    with pytest.raises(InputError, match='cannot show a fill that changes'):
        animate_replay(recording, engine, 'drive', tmp_path / 'drive.gif', print)


def test_fills_of_other_names_are_chosen_or_refused_in_words(tmp_path, config):
    engine = SloshEngine(SloshConfig.from_file(config))
    times = stamps(0.1, 0.01)
    levels = [(START, name, 0.6) for name in ('/level', '/a/slosh_node/fill', '/slosh_node/fill')]
    bag = write_bag(tmp_path / 'drive', times, brake, fills=levels)
    for topic in ('level', '/level'):
        with MotionBag(bag, IMU, fills={'tank': (topic, 'slosh_node/fill')}) as source:
            assert source.fill_topics == {'tank': '/level'}
            # the sample that finds it, and all that follow
            assert [block.fills for block in source.blocks(100)] == [[('tank', 0.6)], []]
    with MotionBag(bag, IMU) as source:  # nobody wants them
        assert [block.fills for block in source.blocks(100)] == [[]]
    with MotionBag(bag, IMU, fills={'tank': (None, 'other_node/fill')}) as source:
        assert not source.fill_topics
    for topic, says in (
        (None, 'has fills on /a/slosh_node/fill, /slosh_node/fill; say which one'),
        ('/imu/data', 'has sensor_msgs/msg/Imu on /imu/data; std_msgs/Float64 is on'),
        ('/levels', 'has no topic /levels; std_msgs/Float64 is on /a/slosh_node/fill, /level'),
    ):
        with pytest.raises(InputError, match=re.escape(says)):
            MotionBag(bag, IMU, fills={'tank': (topic, 'slosh_node/fill')})
    assert _fill_topics(engine, ['/level']) == {'tank': ('/level', 'slosh_node/fill')}
    assert _fill_topics(engine, ['tank=/level']) == {'tank': ('/level', 'slosh_node/fill')}
    tanks = tmp_path / 'tanks.yaml'
    tanks.write_text(TANKS)
    two = SloshEngine(SloshConfig.from_file(tanks))
    assert _fill_topics(two, ['rear=/level']) == {
        'front': (None, 'slosh_node/front/fill'), 'rear': ('/level', 'slosh_node/rear/fill')
    }  # fmt: skip
    for several, given in (
        (two, ['/level']), (two, ['middle=/level']), (two, ['rear=']), (two, ['rear=/a'] * 2),
        (engine, ['']), (engine, ['/a', '/b']),
    ):  # fmt: skip
        with pytest.raises(InputError, match='it must be the topic of the fill'):
            _fill_topics(several, given)
