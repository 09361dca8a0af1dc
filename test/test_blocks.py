"""Many samples at once are many samples one by one, to the last bit."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from drives import SECOND, START, G, engine_of, feed, totals, wrenches, write_bag

from slosh_ros.bag import MotionBag, Peaks, Recording, replay
from slosh_ros.engine import MotionSample, SloshEngine
from slosh_ros.engine.cdr import imu_reading, imu_readings
from slosh_ros.engine.convert import IMU, ImuReading
from slosh_ros.engine.engine import AT_ONCE

PARTS = ('wrench', 'total', 'state', 'pressure', 'beta', 'elevation_max', 'valid', 'trust')


def motion(count: int, jitter: int = 400_000, seed: int = 2) -> tuple[list[int], np.ndarray]:
    """Stamps that jitter as those of a recording, and a wild drive."""
    rng = np.random.default_rng(seed)
    stamps = START + np.arange(count) * 10_000_000 + rng.integers(-jitter, jitter + 1, count)
    values = np.zeros((count, 9))
    values[:, :3] = np.cumsum(rng.normal(size=(count, 3)), axis=0) * 0.1 + [0.0, 0.0, G]
    values[:, 6:] = np.cumsum(rng.normal(size=(count, 3)), axis=0) * 0.003
    return stamps.tolist(), values


def same(one: SloshEngine, other: SloshEngine, stamps: list[int], values: np.ndarray) -> None:
    """Feed to both, at once and one by one, and hold the answers against each other."""
    answers = one.feed_all(stamps, values)
    assert answers is not None
    for stamp, row, got in zip(stamps, values, answers, strict=True):
        sample = MotionSample(stamp, row[:3], row[3:6], row[6:])
        expected = other.feed(sample)[1]
        assert got.sample.values == sample.values
        for part in PARTS:
            assert np.array_equal(getattr(got, part), getattr(expected, part)), part


@pytest.mark.skipif(not AT_ONCE, reason='NumPy 1 is fed one by one')
@pytest.mark.parametrize('modes', [1, 3, 8, 17])
@pytest.mark.parametrize(
    'changes',
    [
        {},
        {'loads__cutoff': 5.0, 'imu__rpy': [0.1, -0.2, 0.7], 'imu__xyz': [1.0, 0.2, 0.5]},
        {
            'pressure__a': [3.0, 0.5, -0.5],
            'tank__damping_ratio': 0.03,
            'imu__bias__specific_force': [0.1, 0.2, 0.3],
            'imu__bias__angular_rate': [0.01, 0.0, 0.0],
        },
    ],
)
def test_at_once_or_one_by_one_is_the_same_to_the_last_bit(modes, changes):
    one, other = (engine_of(tank__modes=modes, **changes) for _ in range(2))
    stamps, values = motion(700)
    for engine in (one, other):
        engine.feed(MotionSample(stamps[0], values[0, :3], values[0, 3:6], values[0, 6:]))
    cuts = [1, 2, 3, 259, 260, 515, 700]
    for a, b in itertools.pairwise(cuts):
        same(one, other, stamps[a:b], values[a:b])
    np.testing.assert_array_equal(one.tanks[0].beta_rate, other.tanks[0].beta_rate)
    np.testing.assert_array_equal(one.tanks[0].wrench, other.tanks[0].wrench)
    assert one.gate.counts == other.gate.counts
    assert one.warnings == other.warnings
    # and on they go one by one
    last = MotionSample(stamps[-1] + 9_999_999, [0.3, 0.1, G], [0.0] * 3, [0.01] * 3)
    assert np.array_equal(one.feed(last)[1].wrench, other.feed(last)[1].wrench)


@pytest.mark.parametrize('place', [0, 5, 9])
@pytest.mark.parametrize(
    'fault', ['gap', 'late', 'duplicate', 'nan', 'large', 'spin', 'before the first', 'slow']
)
def test_what_asks_for_a_decision_is_left_to_the_gate(fault, place):
    """Nothing is done then: neither state nor counts change."""
    engine = engine_of(gate__max_gap=1.0, tank__modes=8)
    stamps, values = motion(11)
    if fault != 'before the first':
        engine.feed(MotionSample(stamps[0], values[0, :3], values[0, 3:6], values[0, 6:]))
    stamps, values = stamps[1:], values[1:]
    if fault in ('gap', 'slow'):
        later = 2 * SECOND if fault == 'gap' else 900_000_000  # omega dt > 2 of the highest mode
        stamps = [stamp + later * (k >= place) for k, stamp in enumerate(stamps)]
    elif fault == 'late':
        stamps[place] = START - 1
    elif fault == 'duplicate':
        stamps[place] = START if place == 0 else stamps[place - 1]
        stamps[place] = stamps[place - 1] if place else engine.gate._last or START
    elif fault == 'nan':
        values[place, 7] = np.nan
    elif fault == 'large':
        values[place, 1] = 1e308
    elif fault == 'spin':
        values[place, 8] = 41.0
    before = engine.tanks[0].beta, engine.gate.counts.copy()
    assert engine.feed_all(stamps, values) is None
    assert np.array_equal(engine.tanks[0].beta, before[0])
    assert engine.gate.counts == before[1]


def test_many_imu_messages_are_read_as_one_by_one():
    from test_cdr import KIND, STORE, message

    rng = np.random.default_rng(1)
    numbers = rng.normal(size=(20, 37))
    raws = [
        bytes(STORE.serialize_cdr(message((k - 5, 7 * k), 'imü', row.tolist()), KIND))
        for k, row in enumerate(numbers)
    ]
    stamps, frame, values, absent = imu_readings(raws)
    expected = [imu_reading(raw) for raw in raws]
    assert stamps == [one.stamp for one in expected]
    assert frame == 'imü'
    assert not absent
    assert [tuple(row) for row in values] == [one.sample().values for one in expected]
    numbers[3, 16] = -1.0
    marked = bytes(STORE.serialize_cdr(message((1, 1), 'imü', numbers[3].tolist()), KIND))
    assert imu_readings([*raws[:3], marked]).absent
    other = bytes(STORE.serialize_cdr(message((1, 1), 'imo_', numbers[3].tolist()), KIND))
    assert len(other) == len(raws[0])
    for odd in (other, raws[0][:-1], b'\0\0' + raws[0][2:], b''):
        assert imu_readings([*raws, odd]) is None
        assert imu_readings([odd, *raws]) is None
    assert isinstance(expected[0], ImuReading)


def test_a_replayed_bag_is_fed_as_the_node_is_fed(tmp_path):
    """Blocks with gaps and duplicates among them; and the peaks of all of it."""
    stamps, _ = motion(900)
    for k, later in ((300, SECOND), (301, 20 * SECOND), (700, SECOND // 2)):
        stamps[k:] = [stamp + later for stamp in stamps[k:]]
    stamps[100] = stamps[99]
    stamps[800] = stamps[600]
    push = lambda t: (3.0 * np.sin(1.1 * t), 0.2 * np.cos(t), G)  # noqa: E731
    engine, other = engine_of(), engine_of()
    expected = feed(other, sorted(stamps), push)  # bags are read in the order of time
    peaks, recording = Peaks(engine), Recording(engine)
    with MotionBag(write_bag(tmp_path / 'bag', stamps, push), IMU) as bag:
        assert replay(bag, engine, [peaks, recording]) == len(expected)
    assert engine.gate.counts == other.gate.counts
    assert np.array_equal(recording.wrench, wrenches(expected))
    assert np.array_equal(recording.total, totals(expected))
    assert np.array_equal(peaks.wrench, np.abs(wrenches(expected)).max(axis=0))
    assert np.array_equal(peaks.total, np.abs(totals(expected)).max(axis=0))
    heights = [loads.elevation_max for loads in expected]
    assert peaks.elevation_max == max(heights)
    assert recording.elevation_max.tolist() == heights
    valid = [loads.valid for loads in expected]
    assert recording.valid.tolist() == valid
    assert 0 < sum(count for count, _ in peaks.beyond.values()) == valid.count(False)
    assert peaks.span == pytest.approx((expected[-1].stamp - expected[0].stamp) * 1e-9)
