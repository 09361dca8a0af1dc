"""The general truck in small steps, with the sloshing wrench coming from outside."""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slosh_ros.vehicle.dynamics import DISTANCE_AT, GAMMA_AT, HEADING_AT, Drive, TruckDynamics
from slosh_ros.vehicle.general_truck import LATERAL, PHI_S, PLANAR, THETA_S, GeneralTruck, U
from slosh_ros.vehicle.liquid import LiquidModes
from slosh_ros.vehicle.stepped import SteppedTruck, Twist

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


class GeneralSimulator(SteppedTruck):
    """
    A general truck on its drive, advanced step by step under the liquid's state wrench.

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
    """

    truck: GeneralTruck

    def __init__(self, drive: Drive, coupling: Array | None = None) -> None:
        super().__init__(drive.truck)
        self.drive = drive
        self._dynamics = TruckDynamics(drive, LiquidModes.none(), np.zeros((6, 6)))
        if coupling is not None:
            self.set_coupling(coupling)

    def _couple(self, coupling: Array) -> None:
        self._dynamics.couple(coupling)

    def _move(self, start: float, stop: float, wrench: Array, wrench_rate: Array) -> None:
        self._dynamics.press(wrench, wrench_rate)
        self._dynamics.advance(stop)

    def acceleration(self, wrench: Array) -> Array:
        """Find the accelerations (6,) of `base_link` at present under a state wrench (6,)."""
        return np.asarray(self.truck.base_motion @ self._rate_of_change(wrench))

    def forward_acceleration(self, wrench: Array) -> float:
        """Give the rate of `speed` at present under a state wrench (6,) [m/s^2]."""
        return float(self._rate_of_change(wrench)[U])

    def twist(self) -> Twist:
        """Velocity at present in the axes of `base_link`, to first order in roll and pitch."""
        linear = self.truck.base_motion[:3] @ self._dynamics.y
        gamma = float(self._dynamics.x[GAMMA_AT])
        c, s = cos(gamma), sin(gamma)
        ahead, aside, up = (float(x) for x in linear)
        roll, pitch = float(self.q[PHI_S - PLANAR]), float(self.q[THETA_S - PLANAR])
        ahead, aside = c * ahead + s * aside, c * aside - s * ahead
        body = [ahead - pitch * up, aside + roll * up, up + pitch * ahead - roll * aside]
        return Twist(np.array(body), self.angular_rate)

    def pose(self) -> SpatialPose:
        """Pose at present."""
        p, x = self.truck.parameters, self._dynamics.x
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
        dynamics, truck = self._dynamics, self.truck
        y, gamma = dynamics.y, np.asarray(dynamics.x[GAMMA_AT])
        height, slope = dynamics.under_wheels()
        steer, speed = np.asarray(dynamics.steer), np.asarray(y[U])
        side = truck.side_forces(speed, steer, y[LATERAL], gamma)
        return truck.wheel_loads(self.q, y[PLANAR:], height, y[U] * slope, side)

    @property
    def q(self) -> Array:
        """Deviations z_t, theta_t, phi_t, z_s, theta_s, phi_s, shape (6,) [m, rad]."""
        return self._dynamics.q

    @property
    def angular_rate(self) -> Array:
        """Angular velocity (3,) of `base_link` [rad/s]."""
        return np.asarray(self.truck.base_motion[3:] @ self._dynamics.y)

    @property
    def articulation(self) -> float:
        """Heading of the semitrailer less that of the tractor [rad]."""
        return float(self._dynamics.x[GAMMA_AT])

    @property
    def speed(self) -> float:
        """Speed along the road [m/s]."""
        return float(self._dynamics.y[U])

    @property
    def distance(self) -> float:
        """Travelled distance [m]."""
        return float(self._dynamics.x[DISTANCE_AT])

    def _rate_of_change(self, wrench: Array) -> Array:
        """Find the generalised accelerations (10,) at present under a state wrench (6,)."""
        self._dynamics.press(wrench, np.zeros(6))
        return self._dynamics.acceleration()
