"""Steering of the front axle over time."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sin
from typing import Protocol

import numpy as np

from slosh_ros.errors import InputError


class Steering(Protocol):
    """Steering angle of axle 1, smooth between events."""

    @property
    def events(self) -> tuple[float, ...]:
        """Rising times at which the angle or its rate jumps [s]."""
        ...

    def angle(self, time: float, inside: float) -> float:
        """Angle [rad], positive to the left, on the side of `inside` of an event [s]."""
        ...


@dataclass(frozen=True)
class SteeringKnots:
    """
    Angle linear between knots, constant before the first and after the last.

    Build it with `straight`, `step`, `turn` or `roundabout`.

    Attributes
    ----------
    times : tuple of float
        Times of the knots, not falling; two equal ones are a jump [s].
    angles : tuple of float
        Angles there [rad].
    """

    times: tuple[float, ...]
    angles: tuple[float, ...]

    def __post_init__(self) -> None:
        """Refuse knots that are out of order."""
        if len(self.times) != len(self.angles) or not self.times:
            raise InputError(
                f'steering needs an angle for each knot, got {len(self.angles)} for '
                f'{len(self.times)}'
            )
        if not np.all(np.isfinite([self.times, self.angles])) or np.any(np.diff(self.times) < 0):
            raise InputError(f'steering needs knots that do not fall, got {self.times} s')

    @classmethod
    def straight(cls) -> SteeringKnots:
        """Steer straight ahead."""
        return cls((0.0,), (0.0,))

    @classmethod
    def step(cls, angle: float, start: float = 0.0, rise: float = 0.0) -> SteeringKnots:
        """Steer to an angle [rad] from `start` within `rise` [s], and hold it: J-turn."""
        return cls((start, start + rise), (0.0, angle))

    @classmethod
    def turn(cls, angle: float, start: float, rise: float, hold: float) -> SteeringKnots:
        """Steer into a bend and out of it, each within `rise`, holding it for `hold` [s]."""
        a = start + rise
        return cls((start, a, a + hold, a + hold + rise), (0.0, angle, angle, 0.0))

    @classmethod
    def roundabout(cls, angle: float, start: float, rise: float, hold: float) -> SteeringKnots:
        """
        Swerve into a roundabout, circulate, swerve out.

        Parameters
        ----------
        angle : float
            Angle on the circle [rad]; positive: counter-clockwise traffic. On the way in and
            out the truck steers against it.
        start : float
            Begin of the way in [s].
        rise : float
            Time for each full swing of the wheel [s].
        hold : float
            Time on the circle, longer than `rise` [s]. On the way in and on the way out the truck
            turns half as far back, so that it leaves in the direction it came.
        """
        if hold <= rise:
            raise InputError(f'a roundabout needs hold > rise, got {hold} s and {rise} s')
        aside = (hold - rise) / 2.0
        times, angles, now = [start], [0.0], start
        for target, stay in ((-angle, aside), (angle, hold), (-angle, aside)):
            now += rise
            times += [now, now + stay]
            angles += [target, target]
            now += stay
        return cls((*times, now + rise), (*angles, 0.0))

    @property
    def events(self) -> tuple[float, ...]:
        """Rising times at which the angle or its rate jumps [s]."""
        return tuple(dict.fromkeys(self.times))

    def angle(self, time: float, inside: float) -> float:
        """Angle [rad], positive to the left, on the side of `inside` of an event [s]."""
        times, angles = self.times, self.angles
        k = sum(t <= inside for t in times) - 1
        if k < 0:
            return angles[0]
        if k + 1 == len(times):
            return angles[-1]
        way = (time - times[k]) / (times[k + 1] - times[k])
        return angles[k] + way * (angles[k + 1] - angles[k])


@dataclass(frozen=True)
class SineSteering:
    """
    One period of a sine: the single lane change of ISO 14791.

    Attributes
    ----------
    amplitude : float
        Angle [rad]; positive: to the left lane.
    frequency : float
        [Hz]; 0.4 is the standard's.
    start : float
        Begin [s].
    """

    amplitude: float
    frequency: float = 0.4
    start: float = 1.0

    def __post_init__(self) -> None:
        """Refuse an endless lane change."""
        if not (self.frequency > 0.0 and self.start >= 0.0 and np.isfinite(self.amplitude)):
            raise InputError(f'a lane change needs frequency > 0 and start >= 0, got {self}')

    @property
    def events(self) -> tuple[float, ...]:
        """Begin and end [s]."""
        return self.start, self.start + 1.0 / self.frequency

    def angle(self, time: float, inside: float) -> float:
        """Angle [rad], positive to the left, on the side of `inside` of an event [s]."""
        begin, end = self.events
        if not begin <= inside < end:
            return 0.0
        return self.amplitude * sin(2.0 * pi * self.frequency * (time - begin))
