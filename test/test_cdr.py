"""The fixed layout of a serialized Imu, against rosbags' own deserialiser."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from rosbags.typesys import Stores, get_typestore

from slosh_ros.engine.cdr import imu_reading
from slosh_ros.engine.convert import ImuReading

STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES = STORE.types
KIND = 'sensor_msgs/msg/Imu'
DOUBLES = some.lists(some.floats(allow_nan=False), min_size=37, max_size=37)
FRAMES = some.text(
    some.characters(blacklist_categories=('Cs',), blacklist_characters='\0'), max_size=20
)


def message(stamp: tuple[int, int], frame: str, numbers: list[float]) -> object:
    vector = TYPES['geometry_msgs/msg/Vector3']
    n = numbers
    return TYPES[KIND](
        header=TYPES['std_msgs/msg/Header'](
            stamp=TYPES['builtin_interfaces/msg/Time'](*stamp), frame_id=frame
        ),
        orientation=TYPES['geometry_msgs/msg/Quaternion'](*n[:4]),
        orientation_covariance=np.array(n[4:13]),
        angular_velocity=vector(*n[13:16]),
        angular_velocity_covariance=np.array(n[16:25]),
        linear_acceleration=vector(*n[25:28]),
        linear_acceleration_covariance=np.array(n[28:]),
    )


STAMPS = some.tuples(some.integers(-(2**31), 2**31 - 1), some.integers(0, 2**32 - 1))


@settings(max_examples=200, deadline=None)
@given(STAMPS, FRAMES, DOUBLES, some.integers(0, 3))
def test_what_is_read_is_what_rosbags_reads(stamp, frame, numbers, spare):
    raw = bytes(STORE.serialize_cdr(message(stamp, frame, numbers), KIND)) + bytes(spare)
    assert imu_reading(raw) == ImuReading.of(STORE.deserialize_cdr(raw, KIND))
    assert imu_reading(memoryview(raw)) == imu_reading(raw)


@pytest.mark.parametrize('length', range(21))
def test_a_frame_of_any_length_shifts_the_numbers(length):
    numbers = np.arange(37.0).tolist()
    raw = bytes(STORE.serialize_cdr(message((3, 4), 'f' * length, numbers), KIND))
    reading = imu_reading(raw)
    assert reading == (3_000_000_004, 'f' * length, (25, 26, 27), (13, 14, 15), 28, 16)


def test_numbers_that_are_none_are_read_as_they_are():
    raw = bytes(STORE.serialize_cdr(message((1, 0), 'imu', [np.nan] * 37), KIND))
    reading = imu_reading(raw)
    assert np.isnan([*reading.force, *reading.rate, reading.force_covariance]).all()


@settings(max_examples=200, deadline=None)
@given(some.data())
def test_damaged_messages_are_left_to_rosbags(data):
    """Cut short, grown, bytes changed: both read the same, or rosbags says what is wrong."""
    raw = bytearray(STORE.serialize_cdr(message((1, 2), 'imu_link', [1.0] * 37), KIND))
    for place in data.draw(some.lists(some.integers(0, 23), max_size=3)):
        raw[place] = data.draw(some.integers(0, 255))
    if data.draw(some.booleans()):
        raw = raw[: data.draw(some.integers(0, len(raw)))]
    raw += bytes(data.draw(some.integers(0, 6)))
    try:
        expected = ImuReading.of(STORE.deserialize_cdr(bytes(raw), KIND))
    except Exception:  # whatever damage provokes in a deserialiser
        assert imu_reading(bytes(raw)) is None
    else:
        assert imu_reading(bytes(raw)) in (None, expected)


def test_a_frame_that_does_not_end_in_a_zero_is_left_to_rosbags():
    raw = bytearray(STORE.serialize_cdr(message((1, 2), 'imu_link', [1.0] * 37), KIND))
    raw[12] = 5  # "imu_", then an "l" for the zero; the numbers stay where they are
    assert imu_reading(bytes(raw)) is None


def test_big_endian_is_left_to_rosbags():
    raw = bytes(STORE.serialize_cdr(message((1, 2), 'imu', [1.0] * 37), KIND, little_endian=False))
    assert imu_reading(raw) is None
    assert ImuReading.of(STORE.deserialize_cdr(raw, KIND)).force == (1.0, 1.0, 1.0)
