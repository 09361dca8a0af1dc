"""The general truck in small steps, with the sloshing wrench coming from outside."""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.vehicle.dynamics import DISTANCE_AT, GAMMA_AT, HEADING_AT, Drive, TruckDynamics
from slosh_ros.vehicle.general_truck import LATERAL, PHI_S, PLANAR, THETA_S, U
from slosh_ros.vehicle.liquid import LiquidModes
from slosh_ros.vehicle.simulator import NANOSECOND, Inertial, Twist, check_form
from slosh_ros.vehicle.stability import load_transfer_ratio

Array = NDArray[np.float64]


class SpatialPose(NamedTuple):
    """
    Pose of `base_link`, from the point of the road under the tractor's mass centre at time zero.

    Attributes
    ----------
    position : array, shape (3,)
        Position of the origin [m].
    roll, pitch, yaw : float
        From the static attitude; left side up, nose down, to the left [rad].
    """

    position: Array
    roll: float
    pitch: float
    yaw: float


class GeneralSimulator:
    """
    A general truck on its drive, advanced step by step under the liquid's state wrench.

    It is used as a `TruckSimulator`, in three dimensions: the acceleration is solved for together
    with what it feeds through to the wrench, so no step size makes the exchange unstable.

    Parameters
    ----------
    drive : Drive
        Truck, driver and road.
    coupling : array, shape (6, 6), optional
        A at `base_link`; without it nothing sloshes.

    Attributes
    ----------
    drive : Drive
        Truck, driver and road.
    time_ns : int
        Present time [ns].
    """

    def __init__(self, drive: Drive, coupling: Array | None = None) -> None:
        self.drive = drive
        self.time_ns = 0
        self._dynamics = TruckDynamics(drive, LiquidModes.none(), np.zeros((6, 6)))
        if coupling is not None:
            self.set_coupling(coupling)

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
        self._dynamics.couple(coupling)

    def check_coupling(
        self, coupling: Array, pitch_softening: float = 0.0, roll_softening: float = 0.0
    ) -> None:
        """
        Refuse a liquid that this truck cannot carry or that was told twice.

        Parameters
        ----------
        coupling : array, shape (6, 6)
            A at `base_link` [kg, kg m, kg m^2].
        pitch_softening, roll_softening : float
            Stiffness that the free surface takes away, which A alone does not tell: gravity
            times `SloshingCargo.surface_moment` [N m/rad].

        Raises
        ------
        InputError
            If A is no sum of lambda lambda^T / mu, if the coupled kinetic energy would not be
            positive, or if the coupled truck would not stand up.
        """
        check_form(coupling)
        truck = self.drive.truck
        sloshing, carried = float(np.max(np.diag(coupling)[:2])), truck.cargo.mass
        if sloshing > carried:
            raise InputError(
                f'coupling: the sloshing mass of {sloshing:.6g} kg exceeds the '
                f"truck's liquid mass of {carried:.6g} kg; tank and truck must carry the same "
                'liquid, and A must not contain its rigid inertia'
            )
        gamma = truck.base_motion
        gain = float(eigh(gamma.T @ coupling @ gamma, truck.mass, eigvals_only=True)[-1])
        if gain >= 1.0:
            raise InputError(
                'coupling: M - Gamma^T A Gamma is not positive definite, the spectral radius of '
                f'M^-1 Gamma^T A Gamma is {gain:.4g} and must be below 1; the truck must hold the '
                'frozen liquid, and A must not contain its rigid inertia'
            )
        stiffness = truck.stiffness.copy()
        stiffness[THETA_S - PLANAR, THETA_S - PLANAR] -= pitch_softening
        stiffness[PHI_S - PLANAR, PHI_S - PLANAR] -= roll_softening
        lowest = float(np.min(np.linalg.eigvalsh(stiffness)))
        if lowest <= 0.0:
            raise InputError(
                'coupling: the truck cannot stand up, its stiffness with the liquid has the '
                f'eigenvalue {lowest:.4g}; the liquid takes {pitch_softening:.4g} N m/rad of '
                f'pitch and {roll_softening:.4g} N m/rad of roll stiffness: less liquid, or '
                'stiffer springs'
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
        self._dynamics.press(wrench_start, wrench_rate)
        self.time_ns += duration_ns
        self._dynamics.advance(self.time_ns * NANOSECOND)

    def acceleration(self, wrench: Array) -> Array:
        """
        Accelerations at present.

        Parameters
        ----------
        wrench : array, shape (6,)
            State wrench at `base_link` at present [N, N m].

        Returns
        -------
        array, shape (6,)
            Of `base_link`, along and about its axes [m/s^2, rad/s^2].
        """
        self._dynamics.press(wrench, np.zeros(6))
        return np.asarray(self.drive.truck.base_motion @ self._dynamics.acceleration())

    def imu(self, wrench: Array) -> Inertial:
        """
        Measure at `base_link` at present, to first order in the angles.

        Parameters
        ----------
        wrench : array, shape (6,)
            State wrench at `base_link` at present [N, N m].
        """
        q = self.q
        lean = GRAVITY * np.array([-q[THETA_S - PLANAR], q[PHI_S - PLANAR], 1.0])
        return Inertial(self.acceleration(wrench)[:3] + lean, self._angular_rate)

    def twist(self) -> Twist:
        """Velocity at present in the axes of `base_link`, to first order in roll and pitch."""
        linear = self.drive.truck.base_motion[:3] @ self._dynamics.y
        gamma = float(self._dynamics.x[GAMMA_AT])
        c, s = cos(gamma), sin(gamma)
        ahead, aside, up = (float(x) for x in linear)
        roll, pitch = float(self.q[PHI_S - PLANAR]), float(self.q[THETA_S - PLANAR])
        ahead, aside = c * ahead + s * aside, c * aside - s * ahead
        body = [ahead - pitch * up, aside + roll * up, up + pitch * ahead - roll * aside]
        return Twist(np.array(body), self._angular_rate)

    def pose(self) -> SpatialPose:
        """Pose at present."""
        p, x = self.drive.truck.parameters, self._dynamics.x
        ahead, behind = float(x[HEADING_AT]), float(x[HEADING_AT] + x[GAMMA_AT])
        east, north = self._dynamics.position
        position = np.array(
            [
                east - p.l_bt * cos(ahead) - p.l_bs * cos(behind),
                north - p.l_bt * sin(ahead) - p.l_bs * sin(behind),
                p.semitrailer_height + self.q[3],
            ]
        )
        q = self.q
        return SpatialPose(position, float(q[PHI_S - PLANAR]), float(q[THETA_S - PLANAR]), behind)

    def wheel_loads(self) -> Array:
        """Give the loads of left and right wheels at present, shape (4, 2) [N]."""
        dynamics, truck = self._dynamics, self.drive.truck
        y, gamma = dynamics.y, np.asarray(dynamics.x[GAMMA_AT])
        height, slope = dynamics.under_wheels()
        steer, speed = np.asarray(dynamics.steer), np.asarray(y[U])
        side = truck.side_forces(speed, steer, y[LATERAL], gamma)
        return truck.wheel_loads(self.q, self.rate, height, y[U] * slope, side)

    def axle_loads(self) -> Array:
        """Give the loads of the axles at present, shape (4,) [N]."""
        return np.asarray(self.wheel_loads().sum(axis=1))

    @property
    def load_transfer(self) -> float:
        """Load transfer ratio of the vehicle at present [-]."""
        return float(load_transfer_ratio(self.wheel_loads()))

    @property
    def q(self) -> Array:
        """Deviations z_t, theta_t, phi_t, z_s, theta_s, phi_s, shape (6,) [m, rad]."""
        return self._dynamics.q

    @property
    def rate(self) -> Array:
        """Rates of `q`, shape (6,) [m/s, rad/s]."""
        return self._dynamics.y[PLANAR:]

    @property
    def speed(self) -> float:
        """Speed along the road [m/s]."""
        return float(self._dynamics.y[U])

    @property
    def distance(self) -> float:
        """Travelled distance [m]."""
        return float(self._dynamics.x[DISTANCE_AT])

    @property
    def _angular_rate(self) -> Array:
        return np.asarray(self.drive.truck.base_motion[3:] @ self._dynamics.y)
