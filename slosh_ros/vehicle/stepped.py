"""
A truck in small steps, with the sloshing wrench coming from outside; what all trucks share.

The liquid's side sends the state wrench W_s: its sloshing wrench without the part that the present
acceleration of the tank feeds through. That part is known here as the matrix A, the sum of
lambda lambda^T / mu at `base_link`, and the motion is solved for both together:

    W = W_s + A (s, alpha),    (M - Gamma^T A Gamma) q'' = f + Gamma^T (W_s + A g_tilt).

No wrench is ever computed from an old acceleration, so no step size makes the exchange unstable.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple, Protocol

import numpy as np
import scipy
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.vehicle.cargo import RigidCargo

Array = NDArray[np.float64]

NANOSECOND = 1e-9  # [s]
_PITCH, _ROLL = 4, 5  # of the semitrailer, in the deviations of any truck


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


class LadenTruck(Protocol):
    """The linear matrices of a truck whose liquid is frozen, velocities `y`, deviations `q`."""

    @property
    def mass(self) -> Array:
        """M (n, n), symmetric."""

    @property
    def stiffness(self) -> Array:
        """K (k, k); the deviations are the last k of the n coordinates."""

    @property
    def base_motion(self) -> Array:
        """Gamma (6, n): motion of `base_link` per unit of `y`."""

    @property
    def cargo(self) -> RigidCargo:
        """The frozen liquid."""


class SteppedTruck(ABC):
    """
    A truck that drives as planned, advanced step by step under the liquid's state wrench.

    It starts in static equilibrium at time zero, its cargo frozen: without a coupling nothing
    sloshes.

    Parameters
    ----------
    truck : LadenTruck
        The truck.

    Attributes
    ----------
    truck : LadenTruck
        The truck.
    time_ns : int
        Present time [ns].
    """

    truck: LadenTruck

    def __init__(self, truck: LadenTruck) -> None:
        self.truck = truck
        self.time_ns = 0

    def set_coupling(self, coupling: Array) -> None:
        """
        Take a new feed-through matrix, for instance after a change of fill.

        Parameters
        ----------
        coupling : array, shape (6, 6)
            A at `base_link` [kg, kg m, kg m^2]; with `I_f - J0` in it (`SloshingCargo.coupling`)
            the liquid turns with its Stokes-Joukowski inertia.

        Raises
        ------
        InputError
            If `check_coupling` refuses it; the simulator then stays as it is.
        """
        self.check_coupling(coupling)
        self._couple(coupling)

    def check_coupling(self, coupling: Array, softening: Array | None = None) -> None:
        """
        Refuse a liquid that this truck cannot carry or that was told twice.

        Parameters
        ----------
        coupling : array, shape (6, 6)
            A at `base_link` [kg, kg m, kg m^2].
        softening : array, shape (6, 6), optional
            Stiffness that the free surface takes away, which A alone does not tell:
            `SloshingCargo.softening` [N m/rad].

        Raises
        ------
        InputError
            If A is no sum of lambda lambda^T / mu, if the coupled kinetic energy would not be
            positive, or if the coupled truck would not stand up.
        """
        check_form(coupling)
        truck = self.truck
        sloshing, carried = float(np.linalg.eigvalsh(coupling[:2, :2])[-1]), truck.cargo.mass
        if sloshing > carried:
            raise InputError(
                f'coupling: the sloshing mass of {sloshing:.6g} kg exceeds the '
                f"truck's liquid mass of {carried:.6g} kg; tank and truck must carry the same "
                'liquid, and A must not contain its rigid inertia'
            )
        gamma = truck.base_motion
        gain = float(
            scipy.linalg.eigh(gamma.T @ coupling @ gamma, truck.mass, eigvals_only=True)[-1]
        )
        if gain >= 1.0:
            raise InputError(
                'coupling: M - Gamma^T A Gamma is not positive definite, the spectral radius of '
                f'M^-1 Gamma^T A Gamma is {gain:.4g} and must be below 1; the truck must hold the '
                'frozen liquid, the same in the same place, and A must not contain its rigid '
                'inertia'
            )
        if softening is not None:
            self._check_standing(softening)

    def _check_standing(self, softening: Array) -> None:
        """Refuse a truck that would tip over: K - Gamma^T H Gamma must be positive definite."""
        stiffness = self.truck.stiffness
        lowest = float(np.linalg.eigvals(stiffness).real.min())
        if lowest <= 0.0:
            raise InputError(
                'the truck cannot stand up, even with its cargo frozen: its stiffness has the '
                f'eigenvalue {lowest:.4g}; stiffer springs, or a lower cargo'
            )
        leaning = self.truck.base_motion[:, -len(stiffness) :]
        taken = np.linalg.solve(stiffness, leaning.T @ softening @ leaning)
        share = float(np.linalg.eigvals(taken).real.max())
        if share >= 1.0:
            raise InputError(
                'coupling: the truck cannot stand up, the free surface takes '
                f'{share:.4g} times the stiffness that the truck has, and must take less than '
                f'all of it ({softening[4, 4]:.4g} N m/rad of pitch, {softening[3, 3]:.4g} '
                'N m/rad of roll): less or lower liquid, more tanks, or stiffer springs'
            )

    def advance(self, duration_ns: int, wrench_start: Array, wrench_rate: Array) -> None:
        """
        Move on, the state wrench being linear in time.

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
        start = self.time_ns * NANOSECOND
        self.time_ns += duration_ns
        self._move(start, self.time_ns * NANOSECOND, wrench_start, wrench_rate)

    def imu(self, wrench: Array) -> Inertial:
        """
        Measure at `base_link` at present, to first order in the angles.

        Parameters
        ----------
        wrench : array, shape (6,)
            State wrench at `base_link` at present [N, N m].
        """
        q = self.q
        lean = GRAVITY * np.array([-q[_PITCH], q[_ROLL], 1.0])
        return Inertial(self.acceleration(wrench)[:3] + lean, self.angular_rate)

    @abstractmethod
    def acceleration(self, wrench: Array) -> Array:
        """
        Accelerations at present; at an event, just after it.

        Parameters
        ----------
        wrench : array, shape (6,)
            State wrench at `base_link` at present [N, N m].

        Returns
        -------
        array, shape (6,)
            Of `base_link`, along and about its axes, gravity excluded [m/s^2, rad/s^2].
        """

    @abstractmethod
    def forward_acceleration(self, wrench: Array) -> float:
        """Give the rate of `speed` under a state wrench (6,) [N, N m] at present [m/s^2]."""

    @abstractmethod
    def twist(self) -> Twist:
        """Velocity at present."""

    @abstractmethod
    def wheel_loads(self) -> Array:
        """Give the loads of left and right wheels on the road at present, shape (4, 2) [N]."""

    @property
    @abstractmethod
    def q(self) -> Array:
        """Deviations z_t, theta_t, phi_t, z_s, theta_s, phi_s from equilibrium (6,) [m, rad]."""

    @property
    @abstractmethod
    def angular_rate(self) -> Array:
        """Angular velocity (3,) of `base_link` [rad/s]."""

    @property
    @abstractmethod
    def articulation(self) -> float:
        """Heading of the semitrailer less that of the tractor [rad]."""

    @property
    @abstractmethod
    def speed(self) -> float:
        """Speed along the road [m/s]."""

    @abstractmethod
    def _couple(self, coupling: Array) -> None:
        """Take a coupling that has been checked."""

    @abstractmethod
    def _move(self, start: float, stop: float, wrench: Array, wrench_rate: Array) -> None:
        """Move on from a time to a later one [s]."""


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
        raise InputError(
            'coupling: heave moves no mode, row 3 must be zero; give the tanks no roll and no '
            'pitch in base_link'
        )
