"""The depth at which a liquid fills a given part of a tank."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy


def depth_for(fill_ratio: Callable[[float], float], height: float, wanted: float) -> float:
    """
    Find the depth at which a rising fill ratio, 0 in the empty tank, has the wanted value.

    Parameters
    ----------
    fill_ratio : callable
        Fraction of the volume by depth [m].
    height : float
        Inner height [m], where it is 1.
    wanted : float
        Between 0 and 1.
    """
    if wanted in (0.0, 1.0):
        return wanted * height
    return float(
        scipy.optimize.brentq(
            lambda depth: fill_ratio(depth) - wanted,
            0.0,
            height,
            xtol=1e-15 * height,
            rtol=4 * float(np.finfo(float).eps),
        )
    )
