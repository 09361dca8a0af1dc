"""Road profile: one parabolic bump or pit on an otherwise flat road, eq (39)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slosh_ros.errors import InputError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Bump:
    """
    Parabolic arch; outside `[start, start + span]` the road is flat, which eq (39) omits.

    Attributes
    ----------
    height : float
        Height of the crown [m]; negative is a pit, zero a flat road.
    span : float
        Length along the road [m].
    start : float
        Distance of the near edge ahead of axle 1 at time zero [m]; `x_0` of the paper.
    """

    height: float
    span: float = 3.7
    start: float = 10.0

    def __post_init__(self) -> None:
        """Refuse a bump that the truck would stand on at the start, and an empty one."""
        if not (np.isfinite(self.height) and 0.0 < self.span < np.inf):
            raise InputError(f'bump needs a finite height and span > 0, got {self}')
        if not 0.0 <= self.start < np.inf:
            raise InputError(f'bump must lie ahead of axle 1: start >= 0, got {self.start} m')

    @property
    def end(self) -> float:
        """Distance of the far edge ahead of axle 1 at time zero [m]."""
        return self.start + self.span

    @property
    def coefficients(self) -> tuple[float, float]:
        """Slope at the near edge [-] and half the curvature [1/m] of the arch."""
        return 4.0 * self.height / self.span, -4.0 * self.height / self.span**2

    def elevation(self, position: Array) -> Array:
        """Height of the road [m] at positions (...) along it [m]."""
        inside, along = self._along(position)
        slope, half_curvature = self.coefficients
        return np.where(inside, along * (slope + half_curvature * along), 0.0)

    def slope(self, position: Array) -> Array:
        """Slope of the road [-] at positions (...); it jumps by 4 h / s at both edges."""
        inside, along = self._along(position)
        slope, half_curvature = self.coefficients
        return np.where(inside, slope + 2.0 * half_curvature * along, 0.0)

    def _along(self, position: Array) -> tuple[NDArray[np.bool_], Array]:
        along = np.asarray(position, dtype=float) - self.start
        return (along >= 0.0) & (along < self.span), along
