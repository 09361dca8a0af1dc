"""
What an IMU tells while the vehicle stands still: the biases, or how it is mounted.

The rate of a vehicle that stands is zero, so what the gyro says is its bias (the Earth's own
7e-5 rad/s is part of it). The specific force is gravity, upwards; on level ground it is upwards
in base_link too. What it is beside that may be a bias of the accelerometer or a tilt of the
mount: one measurement cannot tell them apart, so the caller does.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY, NANOSECONDS
from slosh_ros.engine.kinematics import Pose
from slosh_ros.engine.sample import MotionSample
from slosh_ros.errors import InputError

Array = NDArray[np.float64]

MIN_DURATION = 5.0  # [s] several periods of a body on its springs
MIN_SAMPLES = 50
# What a running engine shakes, and what somebody who boards does not stay below, per axis
FORCE_NOISE, RATE_NOISE = 1.0, 0.05  # [m/s^2], [rad/s] standard deviation
FORCE_DRIFT, RATE_DRIFT = 0.05, 0.005  # [m/s^2], [rad/s] over the stretch, along its trend
MAX_RATE_BIAS = 0.1  # [rad/s] more is no bias of a gyro that works
MAX_FORCE_BIAS = 1.0  # [m/s^2] more is rather a tilt
GRAVITY_TOLERANCE = 0.5  # [m/s^2] by which the magnitude at rest may differ from 9.81


class Assumption(Enum):
    """What explains a horizontal specific force on level ground."""

    BIAS = 'bias of the accelerometer'
    MOUNT = 'roll and pitch of the mount'


@dataclass(frozen=True, eq=False)
class CalibrationResult:
    """
    What was found.

    Attributes
    ----------
    duration : float
        Length of the stretch [s].
    samples : int
        Samples in it.
    force, rate : array, shape (3,)
        Means in sensor axes [m/s^2], [rad/s].
    force_deviation, rate_deviation : array, shape (3,)
        Standard deviations [m/s^2], [rad/s].
    parameters : dict
        What to set, by dotted name: `imu.bias.angular_rate` and either
        `imu.bias.specific_force` or `imu.rpy`.
    """

    duration: float
    samples: int
    force: Array
    rate: Array
    force_deviation: Array
    rate_deviation: Array
    parameters: dict[str, list[float]]

    def yaml(self) -> str:
        """Return the parameters as the text of a ROS 2 parameter file."""
        lines = [
            f'# found at rest, from {self.samples} samples over {self.duration:.1f} s',
            '/**:',
            '  ros__parameters:',
        ]
        # full names are keys as good as nested ones
        for name, values in self.parameters.items():
            numbers = ', '.join(f'{value:.9f}' for value in values)
            lines.append(f'    {name}: [{numbers}]')
        return '\n'.join(lines) + '\n'


class Calibration:
    """
    Takes the raw samples of an IMU on a vehicle that stands on level ground, in constant memory.

    Raw: before any bias is subtracted. Samples that the gate rejects are no samples.

    Parameters
    ----------
    mount : Pose
        Of the IMU in base_link, as configured.

    Attributes
    ----------
    samples : int
        How many it has taken.
    """

    def __init__(self, mount: Pose) -> None:
        self._mount = mount
        self.samples = 0
        self._first = self._last = 0  # [ns]
        self._origin: Array = np.zeros(6)  # sums of small differences lose no digits
        self._sum: Array = np.zeros(6)
        self._square: Array = np.zeros(6)
        self._time = self._time_square = 0.0
        self._with_time: Array = np.zeros(6)

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return (self._last - self._first) / NANOSECONDS

    def take(self, sample: MotionSample) -> None:
        """Take the next sample, in order of stamps."""
        values = np.concatenate([sample.force, sample.rate])
        if not self.samples:
            self._first, self._origin = sample.stamp, values
        self._last = sample.stamp
        self.samples += 1
        time, values = self.duration, values - self._origin
        self._sum += values
        self._square += values**2
        self._time += time
        self._time_square += time**2
        self._with_time += time * values

    def result(self, assumption: Assumption = Assumption.BIAS) -> CalibrationResult:
        """
        Conclude.

        Parameters
        ----------
        assumption : Assumption
            What explains a horizontal specific force.

        Raises
        ------
        InputError
            If the stretch is too short, the vehicle moved, or the result is not to be believed.
        """
        n, duration = self.samples, self.duration
        if duration < MIN_DURATION or n < MIN_SAMPLES:
            raise InputError(
                f'calibration has {n} samples over {duration:.1f} s; it needs {MIN_SAMPLES} over '
                f'{MIN_DURATION:g} s at rest'
            )
        mean = self._origin + self._sum / n
        variance = np.maximum(self._square / n - (self._sum / n) ** 2, 0.0)
        deviation = np.sqrt(variance)
        trend = self._with_time / n - self._sum / n * (self._time / n)
        drift = trend / (self._time_square / n - (self._time / n) ** 2) * duration
        for what, part, unit, noise, most in (
            ('specific force', slice(0, 3), 'm/s^2', FORCE_NOISE, FORCE_DRIFT),
            ('angular rate', slice(3, 6), 'rad/s', RATE_NOISE, RATE_DRIFT),
        ):
            shakes, drifts = float(deviation[part].max()), float(np.abs(drift[part]).max())
            if shakes > noise:
                raise InputError(
                    f'calibration needs a vehicle at rest; its {what} varied by {shakes:.3g} '
                    f'{unit} (standard deviation), at most {noise:g}'
                )
            if drifts > most:
                raise InputError(
                    f'calibration needs a vehicle at rest; its {what} drifted by {drifts:.3g} '
                    f'{unit}, at most {most:g}'
                )
        force, rate = mean[:3], mean[3:]
        if (turn := float(np.abs(rate).max())) > MAX_RATE_BIAS:
            raise InputError(
                f'calibration found an angular rate of {turn:.3g} rad/s, more than a bias '
                f'({MAX_RATE_BIAS:g}): let the vehicle stand still; check the unit of the gyro'
            )
        if abs((weight := float(np.linalg.norm(force))) - GRAVITY) > GRAVITY_TOLERANCE:
            raise InputError(
                f'calibration found a specific force of {weight:.3g} m/s^2, not {GRAVITY}: the '
                'IMU must include gravity (REP-145), in m/s^2'
            )
        found = {'imu.bias.angular_rate': rate.tolist()}
        if assumption is Assumption.BIAS:
            found['imu.bias.specific_force'] = self._force_bias(force).tolist()
        else:
            found['imu.rpy'] = upright(self._mount, force).rpy.tolist()
        return CalibrationResult(duration, n, force, rate, deviation[:3], deviation[3:], found)

    def _force_bias(self, force: Array) -> Array:
        bias = force - self._mount.rotation.T @ [0.0, 0.0, GRAVITY]
        if (most := float(np.abs(bias).max())) > MAX_FORCE_BIAS:
            raise InputError(
                f'calibration found a bias of {most:.3g} m/s^2, at most {MAX_FORCE_BIAS:g}: '
                'on level ground this is a tilted mount; calibrate the mount, or check imu.rpy'
            )
        return bias


def upright(mount: Pose, force: Array) -> Pose:
    """
    Tilt a mount as little as possible so that a force at rest is upwards in the parent frame.

    Parameters
    ----------
    mount : Pose
        Of the IMU; its heading stays, for a vehicle at rest does not tell it.
    force : array, shape (3,)
        Specific force, in axes of the IMU.

    Raises
    ------
    InputError
        If the force points downwards in the parent frame as configured: there is no least tilt.
    """
    up = mount.rotation @ (force / np.linalg.norm(force))
    if up[2] < 0.0:
        raise InputError(
            'calibration finds the IMU upside down against imu.rpy; write imu.rpy as it is '
            'mounted, to within 90 degrees'
        )
    # Rodrigues' rotation about up x z, whose sine and cosine are its length and up_z
    x, y, z = up
    axis = np.array([[0.0, 0.0, -x], [0.0, 0.0, -y], [x, y, 0.0]])
    turn = np.eye(3) + axis + axis @ axis / (1.0 + z)
    return Pose(turn @ mount.rotation, mount.origin)
