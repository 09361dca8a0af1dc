"""
The fixed layout of a sensor_msgs/Imu in CDR, read without building the message.

After the four bytes of the encapsulation come the stamp, the frame_id with its length and a final
zero, and, from the next multiple of eight, 37 doubles: orientation and its covariance, angular
velocity and its, linear acceleration and its.
"""

from __future__ import annotations

from struct import Struct

from slosh_ros.constants import NANOSECONDS
from slosh_ros.engine.convert import ImuReading

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
        None if it is not as long as it says, not little-endian, or its frame_id is no text: then
        a deserialiser has to say what is wrong with it.
    """
    if len(raw) < _TEXT or raw[:2] != _LITTLE_ENDIAN:
        return None
    seconds, nanoseconds, length = _HEADER.unpack_from(raw)
    doubles = 4 + (_TEXT - 4 + length + 7) // 8 * 8
    if not length or not 0 <= len(raw) - doubles - _MOTION.size <= _SPARE:
        return None
    try:
        frame = str(raw[_TEXT : _TEXT + length - 1], 'utf-8')
    except UnicodeDecodeError:
        return None
    wx, wy, wz, rate_known, ax, ay, az, force_known = _MOTION.unpack_from(raw, doubles)
    stamp = seconds * NANOSECONDS + nanoseconds
    return ImuReading(stamp, frame, (ax, ay, az), (wx, wy, wz), force_known, rate_known)
