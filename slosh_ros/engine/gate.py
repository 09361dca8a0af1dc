"""The policy for stamps and values: which samples the engine takes, and how."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import NANOSECONDS
from slosh_ros.engine.sample import MotionSample

_END_OF_TIME = 2**31 * NANOSECONDS  # a builtin_interfaces/Time holds no later stamp

Array = NDArray[np.float64]


class Verdict(Enum):
    """What the gate decided on a sample; the value says it to people."""

    STARTED = 'started from rest'
    ACCEPTED = 'accepted'
    COASTED = 'accepted after a gap in which the liquid moved freely'
    RESTARTED_GAP = 'restarted from rest after a very long gap'
    RESTARTED_BACKWARD = 'restarted from rest after a backward jump of the stamps'
    ZERO_STAMP = 'rejected: zero stamp'
    DUPLICATE = 'rejected: duplicate stamp'
    LATE = 'rejected: late'
    NON_FINITE = 'rejected: not finite'
    OUT_OF_RANGE = 'rejected: magnitude out of range'
    WRONG_FRAME = 'rejected: frame_id is not input.imu_frame'
    NO_DATA = 'rejected: accelerometer marked absent by its covariance'

    def __init__(self, said: str) -> None:
        self.accepted = not said.startswith('rejected')
        """Whether the sample was used."""
        self.from_rest = 'from rest' in said
        """Whether the liquid was put to rest with this sample."""


@dataclass(frozen=True)
class GatePolicy:
    """
    Limits of the gate; see the parameters `gate.*`.

    Attributes
    ----------
    max_gap : float
        Longest interval between samples that the motion is interpolated over [s].
    reset_gap : float
        Interval beyond which the liquid starts from rest [s].
    backward_jump : float
        A stamp older than the last by more than this starts anew; by less, it is late [s].
    max_specific_force, max_angular_rate, max_speed : float
        Largest believable magnitudes [m/s^2], [rad/s], [m/s].
    """

    max_gap: float
    reset_gap: float
    backward_jump: float
    max_specific_force: float
    max_angular_rate: float
    max_speed: float


class SampleGate:
    """
    Judges samples in the order of arrival and counts the verdicts.

    Parameters
    ----------
    policy : GatePolicy
        The limits.
    """

    def __init__(self, policy: GatePolicy) -> None:
        self._policy = policy
        self._last: int | None = None
        self._frame: str | None = None
        self.counts: Counter[Verdict] = Counter()

    def reset(self) -> None:
        """Forget the last stamp: the next good sample starts anew. The counts stay."""
        self._last = self._frame = None

    def changes_frame(self, frame: str) -> bool:
        """Tell whether the message before this one was of another frame."""
        before, self._frame = self._frame, frame
        return before is not None and before != frame

    def of_frame(self, frame: str) -> bool:
        """Tell whether the last message was of this frame."""
        return self._frame == frame

    def judge(self, sample: MotionSample) -> tuple[Verdict, float]:
        """
        Decide on a sample.

        Returns
        -------
        verdict : Verdict
            What to do with it.
        interval : float
            Time since the last accepted sample [s]; 0 where the liquid starts from rest.
        """
        last = self._last
        verdict = self._verdict(sample, last)
        self.counts[verdict] += 1
        if not verdict.accepted:
            return verdict, 0.0
        self._last = sample.stamp
        if last is None or verdict.from_rest:
            return verdict, 0.0
        return verdict, (sample.stamp - last) / NANOSECONDS

    def judge_all(
        self, stamps: Sequence[int], values: Array, longest: float
    ) -> list[float] | None:
        """
        Decide on many samples at once, if there is nothing to decide on.

        Parameters
        ----------
        stamps : sequence of k ints
            Times of the samples [ns].
        values : array, shape (k, 9)
            Their values.
        longest : float
            Longest interval that is wanted [s].

        Returns
        -------
        list of k floats, or None
            Time since the sample before each [s] if all are accepted and continuous; else None,
            with nothing done: let them be judged one by one.
        """
        if self._last is None or stamps[-1] >= _END_OF_TIME:
            return None
        policy, last = self._policy, self._last
        intervals = []
        for stamp in stamps:
            intervals.append((stamp - last) / NANOSECONDS)
            last = stamp
        if not (min(intervals) > 0.0 and max(intervals) <= min(policy.max_gap, longest)):
            return None
        most = np.repeat([policy.max_specific_force, policy.max_speed, policy.max_angular_rate], 3)
        if not np.all(np.abs(values) <= most):  # false for NaN too
            return None
        self._last = last
        self.counts[Verdict.ACCEPTED] += len(intervals)
        return intervals

    def refuse(self, verdict: Verdict) -> Verdict:
        """Count a message that cannot even become a sample."""
        self.counts[verdict] += 1
        return verdict

    def _verdict(self, sample: MotionSample, last: int | None) -> Verdict:
        policy = self._policy
        if sample.stamp <= 0:
            return Verdict.ZERO_STAMP
        if sample.stamp >= _END_OF_TIME:
            return Verdict.OUT_OF_RANGE
        fx, fy, fz, vx, vy, vz, wx, wy, wz = values = sample.values
        # a sum is finite only if all are; one of large numbers need not be
        if not math.isfinite(sum(values)) and not all(map(math.isfinite, values)):
            return Verdict.NON_FINITE
        most = policy.max_specific_force
        if not (-most <= fx <= most and -most <= fy <= most and -most <= fz <= most):
            return Verdict.OUT_OF_RANGE
        most = policy.max_angular_rate
        if not (-most <= wx <= most and -most <= wy <= most and -most <= wz <= most):
            return Verdict.OUT_OF_RANGE
        most = policy.max_speed
        if not (-most <= vx <= most and -most <= vy <= most and -most <= vz <= most):
            return Verdict.OUT_OF_RANGE
        if last is None:
            return Verdict.STARTED
        if sample.stamp == last:
            return Verdict.DUPLICATE
        interval = (sample.stamp - last) / NANOSECONDS
        if interval < -policy.backward_jump:
            return Verdict.RESTARTED_BACKWARD
        if interval < 0.0:
            return Verdict.LATE
        if interval > policy.reset_gap:
            return Verdict.RESTARTED_GAP
        if interval > policy.max_gap:
            return Verdict.COASTED
        return Verdict.ACCEPTED
