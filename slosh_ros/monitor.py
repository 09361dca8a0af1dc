"""Live rollover figures from the samples of an IMU and the sloshing wrenches that answer them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from slosh_ros.engine import MotionSample, SloshEngine
from slosh_ros.engine.gate import SampleGate, Verdict
from slosh_ros.engine.kinematics import AccelerationFilter, Lever
from slosh_ros.errors import InputError
from slosh_ros.vehicle.rollover import RollBalance, Rollover, RollVehicle

Array = NDArray[np.float64]


class RolloverMonitor:
    """
    Judges one sample after the other. The acceleration is filtered as that in the wrench.

    Parameters
    ----------
    engine : SloshEngine
        Tells the liquid's mass and place, the IMU's pose and the filter; it is not fed.
    vehicle : RollVehicle
        The vehicle with empty tanks.

    Raises
    ------
    InputError
        If the engine is not configured for an IMU and wrenches in `base_link`, or the laden
        vehicle cannot stand.

    Attributes
    ----------
    balance : RollBalance
        The moments of the laden vehicle.
    """

    def __init__(self, engine: SloshEngine, vehicle: RollVehicle) -> None:
        config = self._config = engine.config
        if config.source != 'imu':
            raise InputError(
                'input.source is twist, which does not feel the vehicle lean; rollover figures '
                'need an IMU'
            )
        if config.output_frame != 'base_link':
            raise InputError(
                f'frames.output is {config.output_frame}; rollover figures need base_link'
            )
        self.balance = RollBalance(vehicle, engine.rigid, engine.settled)
        self._gate = SampleGate(config.gate)
        self._acceleration = AccelerationFilter(config.loads_cutoff)
        self._lever = Lever(config.imu)

    def refill(self, engine: SloshEngine) -> None:
        """
        Take another liquid from the engine.

        Raises
        ------
        InputError
            If the laden vehicle cannot stand with it.
        """
        self.balance = RollBalance(self.balance.vehicle, engine.rigid, engine.settled)

    def take(self, sample: MotionSample, wrench: Array) -> Rollover | None:
        """
        Take a sample that slosh_node has accepted, in order.

        Parameters
        ----------
        sample : MotionSample
            Of the IMU, in its own axes.
        wrench : array, shape (6,)
            The sloshing wrench at `base_link` that answers it [N, N m].

        Returns
        -------
        Rollover or None
            None if one of the two cannot be used.
        """
        verdict, interval = self._gate.judge(sample)
        if not verdict.accepted:
            return None
        sample = self._config.unbiased(sample)
        continuous = verdict is Verdict.ACCEPTED
        followed = self._acceleration.follow(sample.values, interval if continuous else 0.0)
        at_sensor = np.reshape(followed, (2, 3))
        with np.errstate(over='ignore', invalid='ignore'):
            rollover = self.balance.judge(self._lever.carried(sample.rate, at_sensor), wrench)
        return rollover if np.isfinite(rollover).all() else None


class Pairs:
    """
    Brings samples and their answers together by equal stamps, whichever comes first.

    Both come in one order. So what came before a pair has lost its partner, and what has waited
    for too many others is too old to be judged: it is dropped.

    Parameters
    ----------
    lag : int
        How many samples an answer may be behind.

    Attributes
    ----------
    unanswered : int
        Samples that were dropped.
    """

    def __init__(self, lag: int = 20) -> None:
        self._lag = lag
        self._samples: dict[int, MotionSample] = {}  # in the order of arrival
        self._answers: dict[int, Array] = {}
        self.unanswered = 0

    def sample(self, sample: MotionSample) -> tuple[MotionSample, Array] | None:
        """Take a sample, of duplicates the first; return it with its answer if that is here."""
        self._samples.setdefault(sample.stamp, sample)
        return self._meet(sample.stamp)

    def answer(self, stamp: int, wrench: Array) -> tuple[MotionSample, Array] | None:
        """Take an answer; return it with its sample if that is here."""
        self._answers[stamp] = wrench
        return self._meet(stamp)

    def _meet(self, stamp: int) -> tuple[MotionSample, Array] | None:
        pair = None
        if stamp in self._samples and stamp in self._answers:
            self.unanswered += _drop_before(self._samples, stamp)
            _drop_before(self._answers, stamp)
            pair = self._samples.pop(stamp), self._answers.pop(stamp)
        while len(self._samples) > self._lag:
            del self._samples[next(iter(self._samples))]
            self.unanswered += 1
        while len(self._answers) > self._lag:
            del self._answers[next(iter(self._answers))]
        return pair


def _drop_before(waiting: dict[int, Any], stamp: int) -> int:
    """Drop what arrived before a stamp, and tell how many."""
    before = list(waiting).index(stamp)
    for key in list(waiting)[:before]:
        del waiting[key]
    return before
