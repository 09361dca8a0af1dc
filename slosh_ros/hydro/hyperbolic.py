"""Ratios of hyperbolic functions that do not overflow."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from slosh_ros.hydro.coefficients import Array


def cosh_ratio(k: Array, z: Array, depth: float) -> Array:
    """Return cosh k(z + depth)/cosh(k depth), for -depth <= z <= 0."""
    rise = 1.0 + np.exp(-2.0 * k * (z + depth))
    return np.asarray(np.exp(k * z) * rise / (1.0 + np.exp(-2.0 * k * depth)))


def sinh_ratio(k: Array, x: ArrayLike, half: float) -> Array:
    """Return sinh(k x)/(k cosh(k half)), for -half <= x <= half; of k -> 0 the limit is x."""
    far = np.abs(x)
    rise = -np.expm1(-2.0 * k * far) / (k * (1.0 + np.exp(-2.0 * k * half)))
    return np.asarray(np.sign(x) * np.exp(k * (far - half)) * rise)
