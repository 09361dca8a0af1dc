"""Dimensions that are taken for those of a tank; others are in other units, or slips."""

from __future__ import annotations

import math

from slosh_ros.errors import InputError

SMALLEST, LARGEST = 0.01, 200.0  # [m] sides of a bounding box


def require_lengths(**lengths: float) -> None:
    """
    Check that lengths [m], by name, are positive.

    Raises
    ------
    InputError
        If one is not; the message begins with its name.
    """
    for name, length in lengths.items():
        if not 0.0 < length < math.inf:
            raise InputError(f'{name} is {length:g} m; it must be greater than 0')
