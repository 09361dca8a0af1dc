"""Prescribed longitudinal motion: piecewise linear acceleration, the rest in closed form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
import scipy
from numpy.typing import NDArray

from slosh_ros.errors import InputError

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Manoeuvre:
    """
    Acceleration linear between knots and constant after the last; the truck never reverses.

    Build it with `braking`, `accelerating` or `from_knots`. The fields hold, for each piece, the
    knot where it starts and the Taylor coefficients there.

    Attributes
    ----------
    knots : array, shape (n,)
        Times at which the pieces start [s]; the first is 0. The later ones are the kinks.
    distance, speed, acceleration, jerk : array, shape (n,)
        Travelled distance [m] and its derivatives at the start of each piece; SI.
    """

    knots: Array
    distance: Array
    speed: Array
    acceleration: Array
    jerk: Array

    @classmethod
    def from_knots(
        cls, initial_speed: float, knots: Sequence[float], accelerations: Sequence[float]
    ) -> Manoeuvre:
        """
        Join given accelerations by straight lines.

        Parameters
        ----------
        initial_speed : float
            Speed at time zero [m/s].
        knots : sequence of float, length n
            Rising times, the first 0 [s].
        accelerations : sequence of float, length n
            Accelerations at the knots [m/s^2]; the last one holds for ever.

        Returns
        -------
        Manoeuvre

        Raises
        ------
        InputError
            If the knots do not rise from 0, or the truck would come to drive backwards.
        """
        t = np.array(knots, dtype=float)
        a = np.array(accelerations, dtype=float)
        if t.ndim != 1 or t.shape != a.shape or t.size == 0:
            raise InputError(
                f'need as many accelerations as knots, got {a.size} for {t.size} knots'
            )
        values = np.concatenate([t, a, [initial_speed]])
        if not np.all(np.isfinite(values)) or t[0] != 0.0 or np.any(np.diff(t) <= 0.0):
            raise InputError(f'knots must be finite and rise from 0 s, got {t.tolist()}')
        dt = np.diff(t)
        jerk = np.append(np.diff(a) / dt, 0.0)
        gained = dt * (a[:-1] + a[1:]) / 2.0
        speed = initial_speed + np.append(0.0, np.cumsum(gained))
        rounding = 1e-12 * float(np.max(np.abs(speed)))
        speed[np.abs(speed) < rounding] = 0.0  # a stop is a stop
        metres = dt * (speed[:-1] + dt * (a[:-1] / 2.0 + jerk[:-1] * dt / 6.0))
        distance = np.append(0.0, np.cumsum(metres))
        # a piece is slowest at an end or where its acceleration passes zero
        turn = np.divide(-a, jerk, out=np.zeros_like(a), where=jerk != 0.0)
        turn = np.where((turn > 0.0) & (turn < np.append(dt, 0.0)), turn, 0.0)
        slowest = np.minimum(speed, speed + turn * (a + jerk * turn / 2.0))
        if np.any(slowest < -rounding) or a[-1] < 0.0:
            raise InputError('the manoeuvre would drive the truck backwards')
        return cls(t, distance, speed, a, jerk)

    @classmethod
    def braking(cls, speed: float, deceleration: float, ramp: float = 1.0) -> Manoeuvre:
        """
        Brake to a halt, the deceleration rising and falling over a linear ramp, Fig. 11.

        Parameters
        ----------
        speed : float
            Initial speed [m/s].
        deceleration : float
            Plateau of the deceleration, positive [m/s^2].
        ramp : float
            Duration of the rise, and of the fall [s].

        Returns
        -------
        Manoeuvre
            Stops at `speed / deceleration + ramp`, for good.
        """
        if not (speed > 0.0 and deceleration > 0.0 and ramp > 0.0):
            raise InputError(
                'braking needs speed, deceleration and ramp > 0, '
                f'got {speed} m/s, {deceleration} m/s^2, {ramp} s'
            )
        stop = speed / deceleration + ramp
        if stop <= 2.0 * ramp:
            raise InputError(
                f'at {speed} m/s the truck halts before a deceleration of {deceleration} m/s^2 '
                f'is built up and released over {ramp} s each; shorten the ramp'
            )
        plateau = -deceleration
        return cls.from_knots(speed, (0.0, ramp, stop - ramp, stop), (0.0, plateau, plateau, 0.0))

    @classmethod
    def accelerating(cls, acceleration: float, speed: float = 0.0) -> Manoeuvre:
        """Accelerate at a constant rate [m/s^2] from a given speed [m/s], from rest by default."""
        return cls.from_knots(speed, (0.0,), (acceleration,))

    def taylor(self, times: Array, inside: float | None = None) -> Array:
        """
        Expand the travelled distance about given times.

        Parameters
        ----------
        times : array, shape (n,)
            Times, not negative [s].
        inside : float, optional
            A time inside the piece to use for all of them, so that a kink may be approached from
            either side [s]; by default the piece that starts at or before each time.

        Returns
        -------
        array, shape (n, 4)
            Coefficients of distance(t + tau) in rising powers of tau.
        """
        start = np.searchsorted(self.knots, times if inside is None else inside, side='right') - 1
        tau = times - self.knots[start]
        d, u, a, j = (x[start] for x in (self.distance, self.speed, self.acceleration, self.jerk))
        coefficients = np.empty((len(tau), 4))
        coefficients[:, 0] = d + tau * (u + tau * (a / 2.0 + tau * j / 6.0))
        coefficients[:, 1] = u + tau * (a + tau * j / 2.0)
        coefficients[:, 2] = (a + tau * j) / 2.0
        coefficients[:, 3] = j / 6.0
        return coefficients

    def motion(self, time: float) -> tuple[float, float, float]:
        """Travelled distance [m], speed [m/s] and acceleration [m/s^2] at a time [s]."""
        d, u, half_a, _ = self.taylor(np.array([time]))[0]
        return float(d), float(u), float(2.0 * half_a)

    def time_at(self, distance: float) -> float:
        """
        Time at which a distance is reached [s]; infinite if the truck stops before.

        Parameters
        ----------
        distance : float
            Travelled distance, not negative [m].
        """
        piece = int(np.searchsorted(self.distance, distance, side='right')) - 1
        start = float(self.knots[piece])
        if self.distance[piece] == distance:
            return start
        if piece + 1 < len(self.knots):
            stop = float(self.knots[piece + 1])
        elif self.speed[piece] == 0.0 and self.acceleration[piece] == 0.0:
            return inf
        else:
            stop = start + 1.0
            while self.motion(stop)[0] < distance:
                stop = start + 2.0 * (stop - start)
        return float(
            scipy.optimize.brentq(
                lambda t: self.motion(t)[0] - distance, start, stop, xtol=1e-14, rtol=1e-15
            )
        )
