"""
The truck in small steps, with the sloshing wrench coming from outside.

The liquid's side sends the state wrench W_s: its sloshing wrench without the part that the present
acceleration of the tank feeds through. That part is known here as the matrix A = sum of
lambda lambda^T / mu at `base_link`, and the motion is solved for both together:

    W = W_s + A (s, alpha),    s = (a - g theta_s, 0, g + z_s''),    alpha = (0, theta_s'', 0),
    (M - Gamma^T A Gamma) q'' = P r + B_a a - C q' - K q + Gamma^T (W_s + A (a - g theta_s, 0 ..)).

No wrench is ever computed from an old acceleration, so no step size makes the exchange unstable.
"""

from __future__ import annotations

from itertools import pairwise
from math import cos, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.vehicle.journey import DEGREE, Journey
from slosh_ros.vehicle.lti import Propagator
from slosh_ros.vehicle.truck import BASE_MOTION, THETA_S, Z_S

Array = NDArray[np.float64]

NANOSECOND = 1e-9  # [s]
TIME_DECIMALS = 12  # lengths of steps are rounded to these decimals of a second

_Q, _RATE, _INTEGRAL = slice(0, 4), slice(4, 8), 8  # the last is the time integral of theta_s


class Inertial(NamedTuple):
    """
    What an IMU at `base_link` measures.

    Attributes
    ----------
    specific_force : array, shape (3,)
        Acceleration less gravity, +g on z at rest (REP-145) [m/s^2].
    angular_rate : array, shape (3,)
        Angular velocity [rad/s].
    """

    specific_force: Array
    angular_rate: Array


class Twist(NamedTuple):
    """
    Velocity of `base_link`, in its own axes.

    Attributes
    ----------
    linear : array, shape (3,)
        Velocity of the origin [m/s].
    angular : array, shape (3,)
        Angular velocity [rad/s].
    """

    linear: Array
    angular: Array


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


class TruckSimulator:
    """
    A truck on its journey, advanced step by step under the liquid's state wrench.

    It starts in static equilibrium at time zero.

    Parameters
    ----------
    journey : Journey
        The truck's way along the road.
    coupling : array, shape (6, 6), optional
        A at `base_link`; without it nothing sloshes.

    Attributes
    ----------
    time_ns : int
        Present time [ns].
    """

    def __init__(self, journey: Journey, coupling: Array | None = None) -> None:
        self.truck = journey.truck
        self.journey = journey
        self.time_ns = 0
        self._x: Array = np.zeros(9)
        self._previous: tuple[float, Array] = (0.0, self._x)
        self.set_coupling(np.zeros((6, 6)) if coupling is None else coupling)

    def set_coupling(self, coupling: Array) -> None:
        """
        Take a new feed-through matrix, for instance after a change of fill.

        Parameters
        ----------
        coupling : array, shape (6, 6)
            A at `base_link` [kg, kg m, kg m^2].

        Raises
        ------
        InputError
            If `check_coupling` refuses it; the simulator then stays as it is.
        """
        self.check_coupling(coupling)
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

    def check_coupling(self, coupling: Array, pitch_softening: float = 0.0) -> None:
        """
        Refuse a liquid that this truck cannot carry or that was told twice.

        Parameters
        ----------
        coupling : array, shape (6, 6)
            A at `base_link` [kg, kg m, kg m^2].
        pitch_softening : float
            Pitch stiffness that the free surface takes away, which A alone does not tell:
            `LiquidModes.pitch_softening` [N m/rad].

        Raises
        ------
        InputError
            If A is no sum of lambda lambda^T / mu, if the coupled kinetic energy would not be
            positive, or if the coupled truck would not stand up.
        """
        check_form(coupling)
        truck, liquid_mass = self.truck, self.truck.parameters.liquid_mass
        if coupling[0, 0] > liquid_mass:
            raise InputError(
                f'coupling: the sloshing mass A[0, 0] = {coupling[0, 0]:.6g} kg exceeds the '
                f"truck's liquid mass of {liquid_mass:.6g} kg; tank and truck must carry the same "
                'liquid, and A must not contain its rigid inertia'
            )
        sloshing = BASE_MOTION.T @ coupling @ BASE_MOTION
        gain = float(eigh(sloshing, truck.mass, eigvals_only=True)[-1])
        if gain >= 1.0:
            raise InputError(
                'coupling: M - Gamma^T A Gamma is not positive definite, the spectral radius of '
                f'M^-1 Gamma^T A Gamma is {gain:.4g} and must be below 1; the truck must hold the '
                'frozen liquid, and A must not contain its rigid inertia'
            )
        stiffness = truck.stiffness.copy()
        stiffness[THETA_S, THETA_S] -= pitch_softening
        lowest = float(np.min(np.linalg.eigvals(stiffness).real))
        if lowest <= 0.0:
            raise InputError(
                f'coupling: the truck cannot stand up, its stiffness with the liquid has the '
                f'eigenvalue {lowest:.4g}; the liquid takes {pitch_softening:.4g} N m/rad of '
                'pitch stiffness: less liquid, or a stiffer hitch'
            )

    def advance(self, duration_ns: int, wrench_start: Array, wrench_rate: Array) -> None:
        """
        Move on, the state wrench being linear in time.

        The step is exact, whatever its length: it is split where a wheel meets or leaves the
        bump and where the acceleration has a kink.

        Parameters
        ----------
        duration_ns : int
            Length of the step, above 0 [ns].
        wrench_start : array, shape (6,)
            State wrench at `base_link` at the start of the step [N, N m].
        wrench_rate : array, shape (6,)
            Its rate [N/s, N m/s].
        """
        if duration_ns <= 0:
            raise InputError(f'a step must be longer than 0, got {duration_ns} ns')
        start, stop = self.time_ns * NANOSECOND, (self.time_ns + duration_ns) * NANOSECOND
        load, load_rate = wrench_start @ BASE_MOTION, wrench_rate @ BASE_MOTION
        self._previous = (start, self._x)
        for left, right in pairwise(self.journey.edges(start, stop)):
            inputs = self.journey.inputs(np.array([left]), (left + right) / 2.0)[0]
            force = inputs @ self._forcing.T
            force[0] += load + (left - start) * load_rate
            force[1] += load_rate
            # rounded, so that equal steps find their matrices ready
            length = round(right - left, TIME_DECIMALS)
            self._x = self._propagator.step(self._x, force, length)
        self.time_ns += duration_ns

    def acceleration(self, wrench: Array) -> Array:
        """
        Second derivatives of the degrees of freedom at present.

        Parameters
        ----------
        wrench : array, shape (6,)
            State wrench at `base_link` at present [N, N m].

        Returns
        -------
        array, shape (4,)
            [m/s^2, rad/s^2].
        """
        return self._acceleration(self._inputs(), wrench)

    def imu(self, wrench: Array) -> Inertial:
        """
        Measure at `base_link` at present, to first order in the motion, as the paper's eq (9).

        Parameters
        ----------
        wrench : array, shape (6,)
            State wrench at `base_link` at present [N, N m].
        """
        inputs = self._inputs()
        heave = self._acceleration(inputs, wrench)[Z_S]
        force = np.array([inputs[4] - GRAVITY * self._x[THETA_S], 0.0, GRAVITY + heave])
        return Inertial(force, self._angular_rate)

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
        pitch, heave_rate = float(self._x[THETA_S]), float(self.rate[Z_S])
        c, s, u = cos(pitch), sin(pitch), self.speed
        return Twist(
            np.array([c * u - s * heave_rate, 0.0, s * u + c * heave_rate]), self._angular_rate
        )

    def pose(self) -> Pose:
        """Pose at present."""
        position = self.truck.parameters.base_position
        position[0] += self.distance
        position[2] += self._x[Z_S]
        return Pose(position, float(self._x[THETA_S]))

    def axle_loads(self) -> Array:
        """Give the loads of the axles on the road at present, shape (4,) [N]."""
        return self.truck.axle_loads(self._inputs()[:4], self.q, self.rate)

    @property
    def q(self) -> Array:
        """Deviations z_t, theta_t, z_s, theta_s from static equilibrium, shape (4,) [m, rad]."""
        return self._x[_Q].copy()

    @property
    def rate(self) -> Array:
        """Rates of `q`, shape (4,) [m/s, rad/s]."""
        return self._x[_RATE].copy()

    @property
    def speed(self) -> float:
        """Speed along the road [m/s]."""
        return self.journey.manoeuvre.motion(self.time_ns * NANOSECOND)[1]

    @property
    def distance(self) -> float:
        """Travelled distance [m]."""
        return self.journey.manoeuvre.motion(self.time_ns * NANOSECOND)[0]

    @property
    def _angular_rate(self) -> Array:
        return np.array([0.0, self.rate[THETA_S], 0.0])

    def _inputs(self) -> Array:
        """Find the inputs, shape (5,), at present; at an event, those just after it."""
        now = self.time_ns * NANOSECOND
        inputs: Array = self.journey.inputs(np.array([now]), now)[0, 0]
        return inputs

    def _acceleration(self, inputs: Array, wrench: Array) -> Array:
        force = self._forcing @ inputs + wrench @ BASE_MOTION
        p = self._propagator
        return np.asarray((p.a @ self._x + p.b @ force)[_RATE])


def check_form(coupling: Array) -> None:
    """Refuse what cannot be a sum of lambda lambda^T / mu with lambda_3 = 0."""
    if coupling.shape != (6, 6) or not np.all(np.isfinite(coupling)):
        raise InputError(f'coupling: need 6 x 6 finite numbers, got shape {coupling.shape}')
    tolerance = 1e-9 * float(np.max(np.abs(coupling)))
    if np.max(np.abs(coupling - coupling.T)) > tolerance:
        raise InputError('coupling: the matrix is not symmetric')
    if np.min(np.linalg.eigvalsh(coupling)) < -tolerance:
        raise InputError('coupling: the matrix has a negative eigenvalue; is its sign right?')
    if np.any(np.abs(coupling[2]) > tolerance):
        raise InputError('coupling: heave moves no mode, row 3 must be zero; is it at base_link?')
