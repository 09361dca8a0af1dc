"""
The fixed layout of a sensor_msgs/Imu in CDR, read without building the message.

After the four bytes of the encapsulation come the stamp, the frame_id with its length and a final
zero, and, from the next multiple of eight, 37 doubles: orientation and its covariance, angular
velocity and its, linear acceleration and its.
"""

from __future__ import annotations

from collections.abc import Sequence
from struct import Struct
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import NANOSECONDS
from slosh_ros.engine.convert import ABSENT, ImuReading

Array = NDArray[np.float64]

_LITTLE_ENDIAN = b'\x00\x01'
_HEADER = Struct('<4xiII')  # seconds, nanoseconds, length of the frame_id
# angular velocity and linear acceleration, each with the first element of its covariance
_MOTION = Struct('<104x4d64x4d64x')
_TEXT = _HEADER.size
_SPARE = 3  # bytes that may follow, to a multiple of four


def imu_reading(raw: bytes | memoryview) -> ImuReading | None:
    """
    Read a serialized sensor_msgs/Imu.

    Parameters
    ----------
    raw : bytes or memoryview
        The message in CDR.

    Returns
    -------
    ImuReading or None
        None if it is not as long as it says, not little-endian, or its frame_id is no text or does
        not end in a zero: then a deserialiser has to say what is wrong with it.
    """
    if len(raw) < _TEXT or raw[:2] != _LITTLE_ENDIAN:
        return None
    seconds, nanoseconds, length = _HEADER.unpack_from(raw)
    doubles = 4 + (_TEXT - 4 + length + 7) // 8 * 8
    if not length or not 0 <= len(raw) - doubles - _MOTION.size <= _SPARE:
        return None
    if raw[_TEXT + length - 1]:  # the zero behind the text
        return None
    try:
        frame = str(raw[_TEXT : _TEXT + length - 1], 'utf-8')
    except UnicodeDecodeError:
        return None
    wx, wy, wz, rate_known, ax, ay, az, force_known = _MOTION.unpack_from(raw, doubles)
    stamp = seconds * NANOSECONDS + nanoseconds
    return ImuReading(stamp, frame, (ax, ay, az), (wx, wy, wz), force_known, rate_known)


class ImuReadings(NamedTuple):
    """
    Many readings of one frame, an :class:`ImuReading` each.

    Attributes
    ----------
    stamps : list of k ints
        Times of measurement [ns].
    frame : str
        The frame_id.
    values : array, shape (k, 9)
        As of :class:`MotionSample`.
    absent : bool
        Whether a covariance marks a quantity of any of them as not measured.
    """

    stamps: list[int]
    frame: str
    values: Array
    absent: bool


def imu_readings(raws: Sequence[bytes]) -> ImuReadings | None:
    """
    Read many serialized sensor_msgs/Imu at once.

    Parameters
    ----------
    raws : sequence of bytes
        The messages in CDR.

    Returns
    -------
    ImuReadings or None
        None if they are not of one frame, or one of them is for :func:`imu_reading` to judge.
    """
    first, size = imu_reading(raws[0]), len(raws[0])
    if first is None or any(len(raw) != size for raw in raws):
        return None
    table = np.frombuffer(b''.join(raws), np.uint8).reshape(len(raws), size)
    end = _TEXT + len(first.frame.encode()) + 1  # of the frame_id, with its zero
    if np.any(table[:, :2] != table[0, :2]) or np.any(table[:, 12:end] != table[0, 12:end]):
        return None
    start = 4 + (end - 4 + 7) // 8 * 8
    seconds = table[:, 4:8].copy().view('<i4')[:, 0].astype(np.int64)
    nanoseconds = table[:, 8:12].copy().view('<u4')[:, 0]
    doubles = table[:, start : start + _MOTION.size].copy().view('<f8').astype(float)
    values = np.zeros((len(raws), 9))
    values[:, :3], values[:, 6:] = doubles[:, 25:28], doubles[:, 13:16]
    absent = bool(np.any(doubles[:, [16, 28]] == ABSENT))
    stamps = (seconds * NANOSECONDS + nanoseconds).tolist()
    return ImuReadings(stamps, first.frame, values, absent)
