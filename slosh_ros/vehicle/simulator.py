"""The truck of section 5 in small, exact steps, with the sloshing wrench coming from outside."""

from __future__ import annotations

from itertools import pairwise
from math import cos, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.vehicle.journey import DEGREE, Journey
from slosh_ros.vehicle.lti import Propagator
from slosh_ros.vehicle.stepped import NANOSECOND, SteppedTruck, Twist
from slosh_ros.vehicle.truck import BASE_MOTION, THETA_S, Z_S, Truck

Array = NDArray[np.float64]

TIME_DECIMALS = 12  # lengths of steps are rounded to these decimals of a second

_Q, _RATE, _INTEGRAL = slice(0, 4), slice(4, 8), 8  # the last is the time integral of theta_s


class Pose(NamedTuple):
    """
    Pose of `base_link`, from the point of the road that is under axle 1 at time zero.

    Attributes
    ----------
    position : array, shape (3,)
        Position of the origin [m].
    pitch : float
        Nose-down angle from the static attitude [rad].
    """

    position: Array
    pitch: float


class TruckSimulator(SteppedTruck):
    """
    A truck on its journey, advanced step by step under the liquid's state wrench.

    A step is exact, whatever its length: it is split where a wheel meets or leaves the bump and
    where the acceleration has a kink. The liquid's tilt is on the truck's side:

        (M - Gamma^T A Gamma) q'' = P r + B_a a - C q' - K q + Gamma^T (W_s + A (a - g theta_s, 0))

    Parameters
    ----------
    journey : Journey
        The truck's way along the road.
    coupling : array, shape (6, 6), optional
        A at `base_link`; without it nothing sloshes.

    Attributes
    ----------
    journey : Journey
        The truck's way along the road.
    """

    truck: Truck

    def __init__(self, journey: Journey, coupling: Array | None = None) -> None:
        super().__init__(journey.truck)
        self.journey = journey
        self._x: Array = np.zeros(9)
        self._previous: tuple[float, Array] = (0.0, self._x)
        self.set_coupling(np.zeros((6, 6)) if coupling is None else coupling)

    def _couple(self, coupling: Array) -> None:
        truck = self.truck
        mass = truck.mass - BASE_MOTION.T @ coupling @ BASE_MOTION
        surge = BASE_MOTION.T @ coupling[:, 0]  # generalised force per s_x
        stiffness = truck.stiffness.copy()
        stiffness[:, THETA_S] += GRAVITY * surge
        forcing = truck.forcing.copy()
        forcing[:, 4] += surge
        a = np.zeros((9, 9))
        a[_Q, _RATE] = np.eye(4)
        a[_RATE, _Q] = -np.linalg.solve(mass, stiffness)
        a[_RATE, _RATE] = -np.linalg.solve(mass, truck.damping)
        a[_INTEGRAL, THETA_S] = 1.0
        b = np.zeros((9, 4))
        b[_RATE] = np.linalg.inv(mass)
        self._forcing: Array = forcing
        self._propagator = Propagator(a, b, DEGREE)

    def _move(self, start: float, stop: float, wrench: Array, wrench_rate: Array) -> None:
        load, load_rate = wrench @ BASE_MOTION, wrench_rate @ BASE_MOTION
        self._previous = (start, self._x)
        for left, right in pairwise(self.journey.edges(start, stop)):
            inputs = self.journey.inputs(np.array([left]), (left + right) / 2.0)[0]
            force = inputs @ self._forcing.T
            force[0] += load + (left - start) * load_rate
            force[1] += load_rate
            # rounded, so that equal steps find their matrices ready
            length = round(right - left, TIME_DECIMALS)
            self._x = self._propagator.step(self._x, force, length)

    def acceleration(self, wrench: Array) -> Array:
        """Find the accelerations (6,) of `base_link` at present under a state wrench (6,)."""
        inputs = self._inputs()
        p = self._propagator
        force = self._forcing @ inputs + wrench @ BASE_MOTION
        felt = BASE_MOTION @ (p.a @ self._x + p.b @ force)[_RATE]
        felt[0] = inputs[4]
        return np.asarray(felt)

    def forward_acceleration(self, wrench: Array) -> float:
        """Give the prescribed acceleration at present [m/s^2]; the state wrench has no say."""
        return float(self._inputs()[4])

    @property
    def mean_specific_force(self) -> Array:
        """
        Mean over the last step of the specific force at `base_link`, shape (3,) [m/s^2].

        Exact, as from the velocity increments of a strapdown IMU; it does not miss what happens
        between two samples, as a wheel's meeting the bump.
        """
        if self.time_ns == 0:
            raise RuntimeError('there is no mean before the first step')
        start, before = self._previous
        stop = self.time_ns * NANOSECOND
        gained = self._x - before
        motion = self.journey.manoeuvre.motion
        surge = motion(stop)[1] - motion(start)[1] - GRAVITY * gained[_INTEGRAL]
        heave = gained[_RATE][Z_S]
        return np.array([0.0, 0.0, GRAVITY]) + np.array([surge, 0.0, heave]) / (stop - start)

    def twist(self) -> Twist:
        """Velocity at present; a nose-down truck on the move drifts along its own +z."""
        pitch, heave_rate = float(self._x[THETA_S]), float(self._x[_RATE][Z_S])
        c, s, u = cos(pitch), sin(pitch), self.speed
        return Twist(
            np.array([c * u - s * heave_rate, 0.0, s * u + c * heave_rate]), self.angular_rate
        )

    def pose(self) -> Pose:
        """Pose at present."""
        position = self.truck.parameters.base_position
        position[0] += self.distance
        position[2] += self._x[Z_S]
        return Pose(position, float(self._x[THETA_S]))

    def wheel_loads(self) -> Array:
        """Give the loads of left and right wheels at present, (4, 2) [N]: halves of the axles'."""
        axles = self.truck.axle_loads(self._inputs()[:4], self._x[_Q], self._x[_RATE])
        return np.repeat(axles[:, np.newaxis] / 2.0, 2, axis=1)

    @property
    def q(self) -> Array:
        """Deviations z_t, theta_t, phi_t, z_s, theta_s, phi_s (6,) [m, rad]; nothing leans."""
        return np.insert(self._x[_Q], [2, 4], 0.0)

    @property
    def angular_rate(self) -> Array:
        """Angular velocity (3,) of `base_link` [rad/s]."""
        return np.array([0.0, self._x[_RATE][THETA_S], 0.0])

    @property
    def articulation(self) -> float:
        """Zero: it drives straight."""
        return 0.0

    @property
    def speed(self) -> float:
        """Speed along the road [m/s]."""
        return self.journey.manoeuvre.motion(self.time_ns * NANOSECOND)[1]

    @property
    def distance(self) -> float:
        """Travelled distance [m]."""
        return self.journey.manoeuvre.motion(self.time_ns * NANOSECOND)[0]

    def _inputs(self) -> Array:
        """Find the inputs, shape (5,), at present; at an event, those just after it."""
        now = self.time_ns * NANOSECOND
        inputs: Array = self.journey.inputs(np.array([now]), now)[0, 0]
        return inputs
