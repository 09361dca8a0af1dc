"""
Messages that are a header and doubles, written in CDR without building them.

WrenchStamped, PointStamped and FluidPressure are such. rclpy takes ten times longer to build and
convert one than all the rest of publishing it takes.
"""

from __future__ import annotations

from collections.abc import Iterable
from struct import Struct

from slosh_ros.constants import NANOSECONDS

_LITTLE_ENDIAN = b'\x00\x01\x00\x00'  # encapsulation: plain CDR, no options


class StampedDoubles:
    """
    A writer of such messages of one frame.

    Parameters
    ----------
    frame : str
        The frame_id.
    count : int
        Number of doubles.
    """

    def __init__(self, frame: str, count: int) -> None:
        self._text = frame.encode() + b'\0'
        # doubles are aligned to eight bytes, counted from behind the encapsulation
        padding = -(12 + len(self._text)) % 8
        self._layout = Struct(f'<4siII{len(self._text)}s{padding}x{count}d')

    def write(self, stamp: int, values: Iterable[float]) -> bytes:
        """Serialize a message with its stamp [ns] and values."""
        text = self._text
        seconds, nanoseconds = divmod(stamp, NANOSECONDS)
        return self._layout.pack(_LITTLE_ENDIAN, seconds, nanoseconds, len(text), text, *values)
