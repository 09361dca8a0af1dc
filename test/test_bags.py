"""The shipped bags hold the original recordings, and README.md describes them truly."""

from __future__ import annotations

import hashlib
import itertools
import re
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from rosbags.highlevel import AnyReader
from rosbags.interfaces import ConnectionExtRosbag2, QosReliability
from scipy.spatial.transform import Rotation

BAGS = Path(__file__).resolve().parents[1] / 'bags'
sys.path.insert(0, str(BAGS))  # the scripts are no package

import make_bags  # noqa: E402
import mounting  # noqa: E402

NAMES = ('highway_drive', 'husky')
SOURCE = make_bags.SOURCE
needs_source = pytest.mark.skipif(
    not (SOURCE / 'comma2k19').is_dir() or not (SOURCE / 'husky').is_dir(),
    reason=f'the original recordings are not in {SOURCE}',
)

COUNTS = {
    'highway_drive': {'/imu/data': 6256, '/twist': 4974},
    'husky': {'/imu/data': 11865, '/twist': 3952},
}
RATES = {  # [Hz]
    'highway_drive': {'/imu/data': 104.26, '/twist': 82.90},
    'husky': {'/imu/data': 30.01, '/twist': 9.99},
}
TYPES = {'/imu/data': 'sensor_msgs/msg/Imu', '/twist': 'geometry_msgs/msg/TwistStamped'}
FRAMES = {'/imu/data': 'imu_link', '/twist': 'base_link'}
DIGESTS = {
    'highway_drive': '8ca9a04a3acb07c7516c64d8412cb2a14bf99773fdae72e839aa856f3cf465c8',
    'husky': 'd962e2dc946bfcd42f0b339ec427ef3b9642d20d97767ac2bac64861ec4adf25',
}
SMOOTHING = 101  # samples of a moving mean that takes the vibration out


@dataclass(frozen=True)
class Topic:
    """All messages of one topic; components as arrays with a row per message."""

    messages: list[Any]
    receive_ns: list[int]
    raw: list[bytes]

    @property
    def stamp_ns(self) -> list[int]:
        """Header stamps."""
        stamps = (m.header.stamp for m in self.messages)
        return [s.sec * 1_000_000_000 + s.nanosec for s in stamps]

    def vectors(self, *path: str) -> NDArray[np.float64]:
        """Collect the x, y, z below the given attributes."""
        rows = []
        for value in self.messages:
            for name in path:
                value = getattr(value, name)
            rows.append((value.x, value.y, value.z))
        return np.array(rows)


@cache
def read(bag: Path) -> dict[str, Topic]:
    """Read a whole bag."""
    topics: dict[str, Topic] = {}
    with AnyReader([bag], default_typestore=make_bags.TYPES) as reader:
        for connection, receive_ns, raw in reader.messages():
            topic = topics.setdefault(connection.topic, Topic([], [], []))
            topic.messages.append(reader.deserialize(raw, connection.msgtype))
            topic.receive_ns.append(receive_ns)
            topic.raw.append(bytes(raw))
    return topics


def digest(bag: Path) -> str:
    """Hash topic, receive time and bytes of every message in order."""
    sha = hashlib.sha256()
    with AnyReader([bag], default_typestore=make_bags.TYPES) as reader:
        for connection, receive_ns, raw in reader.messages():
            sha.update(f'{connection.topic} {receive_ns} {len(raw)}\n'.encode())
            sha.update(raw)
    return sha.hexdigest()


def readme_rpy() -> dict[str, NDArray[np.float64]]:
    """Read the two `imu.rpy` lines of README.md, which the configuration files copy."""
    lines = re.findall(r'^imu\.rpy: \[(.*)\]$', (BAGS / 'README.md').read_text(), re.MULTILINE)
    rpy = [np.array([float(number) for number in line.split(',')]) for line in lines]
    return dict(zip(NAMES, rpy, strict=True))


def levelled(name: str, field: str) -> NDArray[np.float64]:
    """Turn an Imu vector into base_link with the mounting of README.md."""
    rotation = Rotation.from_euler('xyz', readme_rpy()[name])
    return np.asarray(rotation.apply(read(BAGS / name)['/imu/data'].vectors(field)))


def smooth(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Take a moving mean."""
    return np.convolve(values, np.full(SMOOTHING, 1.0 / SMOOTHING), mode='valid')


@pytest.mark.parametrize('name', NAMES)
def test_bag_opens_and_holds_every_message_its_metadata_counts(name: str) -> None:
    with AnyReader([BAGS / name]) as reader:
        counted = {topic: info.msgcount for topic, info in reader.topics.items()}
        types = {topic: info.msgtype for topic, info in reader.topics.items()}
    assert counted == COUNTS[name]
    assert types == TYPES
    assert {topic: len(t.messages) for topic, t in read(BAGS / name).items()} == COUNTS[name]


@pytest.mark.parametrize('name', NAMES)
def test_bag_is_the_one_that_was_checked_against_the_originals(name: str) -> None:
    assert digest(BAGS / name) == DIGESTS[name]


@pytest.mark.parametrize('name', NAMES)
def test_bag_offers_reliable_qos_so_that_any_subscriber_gets_it(name: str) -> None:
    with AnyReader([BAGS / name]) as reader:
        for connection in reader.connections:
            assert isinstance(connection.ext, ConnectionExtRosbag2)
            (qos,) = connection.ext.offered_qos_profiles
            assert qos.reliability is QosReliability.RELIABLE


@pytest.mark.parametrize('name', NAMES)
def test_bag_says_where_it_comes_from(name: str) -> None:
    metadata = (BAGS / name / 'metadata.yaml').read_text()
    assert make_bags.ORIGINS[name] in ' '.join(metadata.split())  # YAML folds long lines


@pytest.mark.parametrize('topic', TYPES)
@pytest.mark.parametrize('name', NAMES)
def test_rate_and_frame_are_the_documented_ones(name: str, topic: str) -> None:
    content = read(BAGS / name)[topic]
    stamps = content.stamp_ns
    rate = (len(stamps) - 1) * 1e9 / (stamps[-1] - stamps[0])
    assert rate == pytest.approx(RATES[name][topic], abs=0.01)
    assert {m.header.frame_id for m in content.messages} == {FRAMES[topic]}


@pytest.mark.parametrize('topic', TYPES)
@pytest.mark.parametrize('name', NAMES)
def test_stamps_are_never_zero_repeated_or_backward(name: str, topic: str) -> None:
    content = read(BAGS / name)[topic]
    assert content.stamp_ns[0] > 0
    assert all(a < b for a, b in itertools.pairwise(content.stamp_ns))
    assert all(a < b for a, b in itertools.pairwise(content.receive_ns))


@pytest.mark.parametrize('topic', TYPES)
@pytest.mark.parametrize('name', NAMES)
def test_all_values_are_finite(name: str, topic: str) -> None:
    content = read(BAGS / name)[topic]
    paths = {
        '/imu/data': ('linear_acceleration', 'angular_velocity'),
        '/twist': ('twist.linear', 'twist.angular'),
    }
    assert all(np.isfinite(content.vectors(*p.split('.'))).all() for p in paths[topic])


@pytest.mark.parametrize('topic', TYPES)
def test_highway_is_received_when_stamped(topic: str) -> None:
    content = read(BAGS / 'highway_drive')[topic]
    assert content.receive_ns == content.stamp_ns


def test_husky_is_received_after_it_was_stamped() -> None:
    for topic, latest in (('/imu/data', 0.037), ('/twist', 0.001)):
        content = read(BAGS / 'husky')[topic]
        delay = np.array(content.receive_ns) - np.array(content.stamp_ns)
        assert delay.min() > 0
        assert delay.max() < latest * 1e9


def test_highway_imu_claims_no_orientation_and_no_covariance() -> None:
    for message in read(BAGS / 'highway_drive')['/imu/data'].messages:
        assert message.orientation_covariance[0] == -1.0  # REP-145
        assert not message.orientation_covariance[1:].any()
        assert not message.angular_velocity_covariance.any()
        assert not message.linear_acceleration_covariance.any()


def test_highway_yaw_rate_of_the_twist_is_the_one_of_the_imu() -> None:
    imu, twist = (read(BAGS / 'highway_drive')[topic] for topic in TYPES)
    expected = np.interp(
        np.array(twist.stamp_ns) - imu.stamp_ns[0],
        np.array(imu.stamp_ns) - imu.stamp_ns[0],
        imu.vectors('angular_velocity')[:, 2],
    )
    # The script interpolates between unrounded stamps: up to 1 ns apart at up to 5 rad/s2.
    np.testing.assert_allclose(twist.vectors('twist', 'angular')[:, 2], expected, atol=5e-9)


@needs_source
def test_every_highway_imu_sample_is_the_original_up_to_the_signs() -> None:
    content = read(BAGS / 'highway_drive')['/imu/data']
    log = SOURCE / 'comma2k19' / 'processed_log' / 'IMU'
    for field, sensor in (('linear_acceleration', 'accelerometer'), ('angular_velocity', 'gyro')):
        with (log / sensor / 'value').open('rb') as file:
            forward_right_down = np.load(file)
        with (log / sensor / 't').open('rb') as file:
            seconds = np.load(file)
        x, y, z = forward_right_down.T
        np.testing.assert_array_equal(content.vectors(field), np.column_stack([x, -y, -z]))
        np.testing.assert_array_equal(np.array(content.stamp_ns) / 1e9, seconds)


@needs_source
def test_every_highway_speed_is_the_original() -> None:
    content = read(BAGS / 'highway_drive')['/twist']
    log = SOURCE / 'comma2k19' / 'processed_log' / 'CAN' / 'speed'
    with (log / 'value').open('rb') as file:
        speed = np.load(file)[:, 0]
    with (log / 't').open('rb') as file:
        seconds = np.load(file)
    linear, angular = content.vectors('twist', 'linear'), content.vectors('twist', 'angular')
    np.testing.assert_array_equal(linear[:, 0], speed)
    np.testing.assert_allclose(np.array(content.stamp_ns) / 1e9, seconds, rtol=0, atol=0.6e-9)
    assert not linear[:, 1:].any()
    assert not angular[:, :2].any()


@needs_source
def test_every_husky_message_is_the_original() -> None:
    shipped = read(BAGS / 'husky')
    original: dict[str, list[tuple[int, Any]]] = {'imu': [], 'odom': []}
    with AnyReader([SOURCE / 'husky' / 'husky_test1.bag']) as reader:
        for connection, receive_ns, raw in reader.messages():
            kind = {'/imu/data': 'imu', make_bags.HUSKY_ODOM_TOPIC: 'odom'}.get(connection.topic)
            if kind:
                message = reader.deserialize(raw, connection.msgtype)
                original[kind].append((receive_ns, message))

    def plain(value: Any) -> Any:
        """Compare by value, whatever class the type store made, without the ROS 1 `seq`."""
        if isinstance(value, np.ndarray):
            return value.tolist()
        if hasattr(value, '__dict__'):
            members = vars(value).items()
            return {k: plain(v) for k, v in members if k not in ('seq', '__msgtype__')}
        return value

    imu = shipped['/imu/data']
    for (receive_ns, old), got_ns, new in zip(
        original['imu'], imu.receive_ns, imu.messages, strict=True
    ):
        assert got_ns == receive_ns
        assert plain(new) == plain(old)
    twist = shipped['/twist']
    for (receive_ns, old), got_ns, new in zip(
        original['odom'], twist.receive_ns, twist.messages, strict=True
    ):
        assert got_ns == receive_ns
        assert plain(new.header.stamp) == plain(old.header.stamp)
        assert new.header.frame_id == old.child_frame_id
        assert plain(new.twist) == plain(old.twist.twist)


@pytest.mark.parametrize(('name', 'magnitude'), [('highway_drive', 9.68), ('husky', 9.79)])
def test_levelled_specific_force_is_gravity_on_average(name: str, magnitude: float) -> None:
    mean = levelled(name, 'linear_acceleration').mean(axis=0)
    assert np.linalg.norm(mean) == pytest.approx(magnitude, abs=0.01)
    assert np.linalg.norm(mean) == pytest.approx(9.80, rel=0.013)
    assert np.linalg.norm(mean[:2]) < 0.02 * mean[2]


@pytest.mark.parametrize(('name', 'least'), [('highway_drive', 0.8), ('husky', 0.3)])
def test_levelled_axes_feel_acceleration_forward_and_turns_to_the_left(
    name: str, least: float
) -> None:
    imu, twist = (read(BAGS / name)[topic] for topic in TYPES)
    t = (np.array(imu.stamp_ns) - imu.stamp_ns[0]) / 1e9
    twist_t = (np.array(twist.stamp_ns) - imu.stamp_ns[0]) / 1e9
    speed = np.interp(t, twist_t, twist.vectors('twist', 'linear')[:, 0])
    force, rate = levelled(name, 'linear_acceleration'), levelled(name, 'angular_velocity')
    dv_dt = smooth(np.gradient(speed, t))
    centripetal = smooth(speed) * smooth(rate[:, 2])
    assert np.corrcoef(dv_dt, smooth(force[:, 0]))[0, 1] > least
    assert np.corrcoef(centripetal, smooth(force[:, 1]))[0, 1] > least


def test_husky_levelled_gyro_turns_like_the_odometry() -> None:
    result = mounting.husky(BAGS / 'husky')
    assert result.yaw_rate.r > 0.99
    assert result.yaw_rate.slope == pytest.approx(1.0, abs=0.1)
    assert result.odom_lag == pytest.approx(0.39, abs=0.011)


def test_husky_at_rest_feels_gravity_and_the_slope_of_the_ground() -> None:
    result = mounting.husky(BAGS / 'husky')
    assert np.linalg.norm(result.rest_force) == pytest.approx(9.80, abs=0.01)
    assert np.hypot(*result.rest_force[:2]) / 9.80 == pytest.approx(0.017, abs=0.001)
    assert np.abs(result.gyro_bias).max() < 5e-4


def test_husky_mounting_of_the_readme_is_the_fitted_one() -> None:
    np.testing.assert_allclose(
        readme_rpy()['husky'], mounting.husky(BAGS / 'husky').rpy, atol=1e-4
    )


@needs_source
def test_highway_mounting_of_the_readme_is_the_fitted_one() -> None:
    result = mounting.highway(SOURCE)
    np.testing.assert_allclose(readme_rpy()['highway_drive'], result.rpy, atol=1e-4)
    np.testing.assert_allclose(result.level_force, [0.0, 0.0, 9.70], atol=0.01)


@needs_source
def test_highway_longitudinal_force_is_acceleration_plus_grade() -> None:
    result = mounting.highway(SOURCE)
    assert result.a_x.r > 0.998
    assert result.a_x.rms < 0.1 * result.a_x_no_grade.rms


@pytest.mark.dear
@needs_source
def test_making_the_bags_again_gives_the_same_messages(tmp_path: Path) -> None:
    assert make_bags.make_bags(SOURCE, tmp_path / 'first') == COUNTS
    make_bags.make_bags(SOURCE, tmp_path / 'second')
    for name in NAMES:
        assert digest(tmp_path / 'first' / name) == digest(BAGS / name)
        for file in sorted((tmp_path / 'first' / name).iterdir()):
            assert file.read_bytes() == (tmp_path / 'second' / name / file.name).read_bytes()


def test_missing_originals_give_one_clear_message_and_leave_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / 'out'
    code = make_bags.main(['--source', str(tmp_path / 'nowhere'), '--out', str(out)])
    assert code == 1
    message = capsys.readouterr().err
    assert message.count('\n') == 1
    assert 'nowhere' in message
    assert not list(out.iterdir())


def test_bags_in_place_are_not_replaced_without_force(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kept = tmp_path / 'husky' / 'metadata.yaml'
    kept.parent.mkdir()
    kept.write_text('precious')
    assert make_bags.main(['--source', str(tmp_path), '--out', str(tmp_path)]) == 1
    assert '--force' in capsys.readouterr().err
    assert kept.read_text() == 'precious'


def test_seconds_become_the_nearest_nanosecond() -> None:
    assert make_bags.to_ns(46408.580034294) == 46_408_580_034_294
    assert make_bags.to_ns(0.1) == 100_000_000


def test_interpolation_is_linear_and_holds_its_ends() -> None:
    times, values = np.array([1.0, 2.0, 4.0]), np.array([10.0, 20.0, 0.0])
    at = np.array([0.0, 1.0, 1.25, 2.0, 3.0, 4.0, 9.0])
    np.testing.assert_allclose(
        make_bags.interpolate(at, times, values), [10.0, 10.0, 12.5, 20.0, 10.0, 0.0, 0.0]
    )


@needs_source
@pytest.mark.parametrize(
    ('copy', 'original'),
    [('LICENSE.comma2k19', 'comma2k19'), ('LICENSE.robot_localization', 'husky')],
)
def test_licence_texts_are_verbatim(copy: str, original: str) -> None:
    assert (BAGS / copy).read_bytes() == (SOURCE / original / 'LICENSE').read_bytes()
