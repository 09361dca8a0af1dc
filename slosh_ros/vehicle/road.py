"""Roads: a parabolic bump or pit, eq (39), measured and random profiles, left and right track."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
import scipy
from numpy.typing import NDArray

from slosh_ros.errors import InputError

Array = NDArray[np.float64]


class Track(Protocol):
    """What one wheel track is: heights and slopes along the road."""

    @property
    def edges(self) -> tuple[float, ...]:
        """Positions at which the slope jumps [m]."""
        ...

    @property
    def grain(self) -> float:
        """Longest step along the road that sees all of it [m]."""
        ...

    def under(self, position: Array, about: Array | None = None) -> tuple[Array, Array]:
        """Height [m] and slope [-] at positions; on that side of an edge where `about` is."""
        ...


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

    @property
    def edges(self) -> tuple[float, ...]:
        """Positions at which the slope jumps [m]."""
        return (self.start, self.end) if self.height else ()

    @property
    def grain(self) -> float:
        """Longest step along the road that sees all of it [m]: any, between the edges."""
        return np.inf

    def under(self, position: Array, about: Array | None = None) -> tuple[Array, Array]:
        """
        Height and slope of the road.

        Parameters
        ----------
        position : array, shape (...)
            Positions along the road [m].
        about : array, shape (...), optional
            Positions that decide whether this is on the bump [m]; by default those themselves.

        Returns
        -------
        height, slope : array, shape (...)
            [m, -]. The slope jumps by 4 h / s at both edges.
        """
        along = np.asarray(position, dtype=float) - self.start
        place = along if about is None else about - self.start
        inside = (place >= 0.0) & (place < self.span)
        if not inside.any():
            return np.zeros(along.shape), np.zeros(along.shape)
        slope, half_curvature = self.coefficients
        height = np.where(inside, along * (slope + half_curvature * along), 0.0)
        return height, np.where(inside, slope + 2.0 * half_curvature * along, 0.0)

    def elevation(self, position: Array) -> Array:
        """Height of the road [m] at positions (...) along it [m]."""
        return self.under(position)[0]

    def slope(self, position: Array) -> Array:
        """Slope of the road [-] at positions (...); it jumps by 4 h / s at both edges."""
        return self.under(position)[1]


@dataclass(frozen=True, eq=False)
class Profile:
    """
    Measured heights along the road, joined by a cubic spline; level before and after.

    Attributes
    ----------
    position : array, shape (n,)
        Rising positions [m].
    height : array, shape (n,)
        Heights there [m]. They should begin and end at zero slope, and at zero height where the
        truck starts: it starts in equilibrium.
    """

    position: Array
    height: Array

    def __post_init__(self) -> None:
        """Refuse what is no profile."""
        x, z = self.position, self.height
        if x.ndim != 1 or x.shape != z.shape or len(x) < 2:
            raise InputError(
                f'a profile needs as many heights as positions, at least 2; got {len(z)} for '
                f'{len(x)}'
            )
        if not (np.all(np.isfinite([x, z])) and np.all(np.diff(x) > 0.0)):
            raise InputError('a profile needs finite heights at positions that rise')

    @property
    def edges(self) -> tuple[float, ...]:
        """None: the spline is smooth."""
        return ()

    @cached_property
    def grain(self) -> float:
        """Longest step along the road that sees all of it [m]: the closest points' distance."""
        return float(np.min(np.diff(self.position)))

    @cached_property
    def _spline(self) -> scipy.interpolate.CubicSpline:
        return scipy.interpolate.CubicSpline(self.position, self.height, bc_type='clamped')

    @cached_property
    def _inclination(self) -> scipy.interpolate.CubicSpline:
        return self._spline.derivative()

    def under(self, position: Array, about: Array | None = None) -> tuple[Array, Array]:
        """
        Height and slope of the road.

        Parameters
        ----------
        position : array, shape (...)
            Positions along the road [m].
        about : array, optional
            Not used: there are no edges.

        Returns
        -------
        height, slope : array, shape (...)
            [m, -].
        """
        del about
        first, last = self.position[0], self.position[-1]
        inside = (position > first) & (position < last)
        place = np.clip(position, first, last)
        return self._spline(place), np.where(inside, self._inclination(place), 0.0)


@dataclass(frozen=True, eq=False)
class Road:
    """
    Left and right wheel track.

    Attributes
    ----------
    left, right : Track
        What the wheels of each side roll over; the same object for a road without camber.
    """

    left: Track
    right: Track

    @classmethod
    def even(cls, track: Track) -> Road:
        """Lay the same track left and right."""
        return cls(track, track)

    @classmethod
    def flat(cls) -> Road:
        """Give a flat road."""
        return cls.even(Bump(0.0))

    @cached_property
    def is_flat(self) -> bool:
        """Tell whether it is flat."""
        return all(isinstance(t, Bump) and t.height == 0.0 for t in (self.left, self.right))

    @cached_property
    def edges(self) -> tuple[float, ...]:
        """Positions at which a slope jumps, rising [m]."""
        return tuple(sorted({*self.left.edges, *self.right.edges}))

    @cached_property
    def grain(self) -> float:
        """Longest step along the road that sees all of it [m]."""
        return min(self.left.grain, self.right.grain)

    def under(self, position: Array, about: Array | None = None) -> tuple[Array, Array]:
        """
        Height and slope of the road under wheels.

        Parameters
        ----------
        position : array, shape (...)
            Positions of axles [m].
        about : array, shape (...), optional
            Positions that decide on which side of an edge they are [m].

        Returns
        -------
        height, slope : array, shape (..., 2)
            Left and right [m, -].
        """
        left = self.left.under(position, about)
        right = left if self.right is self.left else self.right.under(position, about)
        return np.stack([left[0], right[0]], axis=-1), np.stack([left[1], right[1]], axis=-1)


ROUGHNESS = {name: 16e-6 * 4.0**k for k, name in enumerate('ABCDEFGH')}
"""Displacement PSD at 0.1 cycles/m of the road classes [m^3], geometric means: ISO 8608."""

_REFERENCE = 0.1  # [cycles/m]
_LEAD = 5.0  # [m] over which a random road rises out of the flat one


def random_road(
    grade: str,
    length: float,
    seed: int = 0,
    start: float = 0.0,
    track: float = 1.86,
    band: Sequence[float] = (0.011, 1.0),
    spacing: float = 0.1,
) -> Road:
    """
    Draw a random road of a class of ISO 8608.

    The PSD of the height is `G(n) = G(n0) (n / n0)**-2`, the coherence of left and right that of
    an isotropic surface, `2 pi T n K_1(2 pi T n)`. Amplitudes are exact, phases drawn.

    Parameters
    ----------
    grade : str
        `A` (very good) to `H`.
    length : float
        Length of the road [m].
    seed : int
        Of the phases: the same seed, the same road.
    start : float
        Where it begins ahead of axle 1 at time zero [m]; over 5 m it rises from the flat.
    track : float
        Distance of the wheel tracks [m].
    band : sequence of float, length 2
        Lowest and highest spatial frequency [cycles/m].
    spacing : float
        Distance of the points [m].

    Returns
    -------
    Road
    """
    if grade not in ROUGHNESS:
        raise InputError(f"road class '{grade}'; it must be one of {', '.join(ROUGHNESS)}")
    low, high = band
    if not (0.0 < low < high <= 0.5 / spacing and length > 2.0 * _LEAD):
        raise InputError(
            f'random road: need 0 < {low} < {high} <= 0.5 / {spacing} and more than 10 m'
        )
    x = start + spacing * np.arange(round(length / spacing) + 1, dtype=np.float64)
    # one period of the waves holds the road and the longest wave
    count = 2 ** int(np.ceil(np.log2(max(len(x), 1.0 / (low * spacing)))))
    n = np.fft.rfftfreq(count, spacing)
    inside = (n >= low) & (n <= high)
    n = n[inside]
    amplitude = np.sqrt(2.0 * ROUGHNESS[grade] * (n / _REFERENCE) ** -2.0 / (count * spacing))
    phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, (2, len(n)))
    waves = amplitude * np.exp(1j * phases)
    argument = 2.0 * np.pi * track * n
    coherence = argument * scipy.special.k1(argument)
    lines = np.zeros((2, len(inside)), dtype=complex)
    lines[0, inside] = waves[0]
    lines[1, inside] = coherence * waves[0] + np.sqrt(1.0 - coherence**2) * waves[1]
    heights = np.fft.irfft(lines * count / 2.0, count)[:, : len(x)]
    # a smooth door at both ends, so that the truck starts on the flat
    way = np.clip(np.minimum(x - x[0], x[-1] - x) / _LEAD, 0.0, 1.0)
    door = way**2 * (3.0 - 2.0 * way)
    left, right = (np.array(door * line, dtype=np.float64) for line in heights)
    return Road(Profile(x, left), Profile(x, right))
