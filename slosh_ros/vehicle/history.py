"""The one result of a simulated drive, whatever the truck: histories, table, figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from slosh_ros.modal.validity import Trust
from slosh_ros.vehicle.cargo import SloshingCargo
from slosh_ros.vehicle.closed_loop import ClosedLoopResult
from slosh_ros.vehicle.journey import Contact
from slosh_ros.vehicle.stability import (
    WHEELS,
    LoadTransfer,
    StabilityFigures,
    Warn,
    load_transfer_ratio,
    warnings_of,
)

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class History:
    """
    History of a drive on N instants; deviations are from static equilibrium.

    At an instant where an input jumps the values are those just after it.

    Attributes
    ----------
    time : array, shape (N,)
        Instants [s].
    planar_rate : array, shape (N, 4)
        u, v, r of the tractor and rate of articulation [m/s, rad/s].
    acceleration : array, shape (N, 2)
        Forward u' and sideways of the semitrailer, `base_link`, gravity excluded [m/s^2].
    distance, heading, articulation, steer : array, shape (N,)
        Travelled distance [m], heading of the tractor [rad], `psi_s - psi_t` [rad], steering
        angle of axle 1 [rad].
    position : array, shape (N, 2)
        Of the tractor's mass centre on the ground, from its place at time zero [m].
    q, q_rate, q_acceleration : array, shape (N, 6)
        z_t, theta_t, phi_t, z_s, theta_s, phi_s and their derivatives [m, rad, s].
    beta, beta_rate, beta_acceleration : array, shape (N, n)
        Modal coordinates and their derivatives [m, s].
    slosh : array, shape (N, 6)
        Sloshing wrench on the tank about O, axes of `base_link`, eqs (15)-(20): zero for a frozen
        liquid [N, N m].
    wheel_loads : array, shape (N, 4, 2)
        Vertical loads of left and right wheels [N].
    side_forces : array, shape (N, 4)
        Of the axles, positive to the left [N].
    road : array, shape (N, 4, 2)
        Height of the road under the wheels [m].
    contacts : tuple of Contact
        When each axle is on the bump; empty without one.
    specific_force : array, shape (N, 3)
        Of `base_link`, in its axes: +g on z at rest [m/s^2].
    cargo : SloshingCargo
        The liquid.
    """

    time: Array
    planar_rate: Array
    acceleration: Array
    distance: Array
    heading: Array
    articulation: Array
    steer: Array
    position: Array
    q: Array
    q_rate: Array
    q_acceleration: Array
    beta: Array
    beta_rate: Array
    beta_acceleration: Array
    slosh: Array
    wheel_loads: Array
    side_forces: Array
    road: Array
    contacts: tuple[Contact, ...]
    specific_force: Array
    cargo: SloshingCargo

    @classmethod
    def of_paper(cls, result: ClosedLoopResult, cargo: SloshingCargo, road: Array) -> History:
        """
        Present a result of the 4-dof truck: nothing leans, both sides are equal.

        Parameters
        ----------
        result : ClosedLoopResult
            Of `slosh_ros.vehicle.simulate` with `cargo.modes`, whose origin is `base_link`: zero.
        cargo : SloshingCargo
            The liquid.
        road : array, shape (N, 4)
            Height of the road under the axles [m].
        """
        n = len(result.time)
        none = np.zeros(n)
        slosh = result.slosh.copy()
        slosh[:, 3:] -= np.cross(cargo.reference, slosh[:, :3])

        def spread(q: Array) -> Array:
            return np.insert(q, [2, 4], 0.0, axis=1)

        return cls(
            time=result.time,
            planar_rate=np.column_stack([result.speed, none, none, none]),
            acceleration=np.column_stack([result.acceleration, none]),
            distance=result.distance,
            heading=none,
            articulation=none,
            steer=none,
            position=np.column_stack([result.distance, none]),
            q=spread(result.q),
            q_rate=spread(result.q_rate),
            q_acceleration=spread(result.q_acceleration),
            beta=result.beta,
            beta_rate=result.beta_rate,
            beta_acceleration=result.beta_acceleration,
            slosh=slosh,
            wheel_loads=np.repeat(result.axle_loads[:, :, np.newaxis] / 2.0, 2, axis=2),
            side_forces=np.zeros((n, 4)),
            road=np.repeat(road[:, :, np.newaxis], 2, axis=2),
            contacts=result.contacts if np.any(road) else (),
            specific_force=result.specific_force,
            cargo=cargo,
        )

    @property
    def speed(self) -> Array:
        """Speed u, shape (N,) [m/s]."""
        return self.planar_rate[:, 0]

    @property
    def yaw_rate(self) -> Array:
        """Yaw rate of the semitrailer, shape (N,) [rad/s]."""
        return np.asarray(self.planar_rate[:, 2] + self.planar_rate[:, 3])

    @property
    def names(self) -> tuple[str, ...]:
        """One for each mode."""
        return self.cargo.names

    @cached_property
    def elevation_max(self) -> Array:
        """Greatest height or depth of the waves, shape (N,); NaN if it is not known [m]."""
        return self.cargo.elevation_max(self.beta)

    @cached_property
    def trust(self) -> tuple[Trust, ...]:
        """How far linear theory of the liquid is used up, at each instant."""
        rate = np.column_stack([self.q_rate[:, 5], self.q_rate[:, 4], self.yaw_rate])
        return self.cargo.trust(self.time, self.beta, self.beta_rate, self.specific_force, rate)

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Whether the liquid's motion is mild enough for linear theory, shape (N,)."""
        return np.array([trust.valid for trust in self.trust])

    @cached_property
    def transfer(self) -> LoadTransfer:
        """Load transfer ratios of vehicle, units and axles."""
        return LoadTransfer.of(self.wheel_loads)

    @property
    def lift_off(self) -> NDArray[np.bool_]:
        """Which wheels have lifted off, shape (N, 4, 2)."""
        return self.wheel_loads < 0.0

    @cached_property
    def warnings(self) -> tuple[Warn, ...]:
        """What takes the result out of its theory."""
        return warnings_of(self.time, self.wheel_loads, self.trust, self.articulation)

    @property
    def figures(self) -> StabilityFigures:
        """Stability of the whole drive on one line."""
        return StabilityFigures.of(self.time, self.wheel_loads, self.q, self.acceleration[:, 1])

    @property
    def columns(self) -> dict[str, Array]:
        """Columns (N,) of `slosh simulate`, by name, SI."""
        return columns_of(
            self.time,
            self.speed,
            self.acceleration,
            self.yaw_rate,
            self.q,
            self.slosh,
            self.wheel_loads,
            {'elevation_max': self.elevation_max},
            {f'beta_{name}': b for name, b in zip(self.names, self.beta.T, strict=True)},
        )


def columns_of(
    time: Array,
    speed: Array,
    acceleration: Array,
    yaw_rate: Array,
    q: Array,
    slosh: Array,
    wheel_loads: Array,
    waves: Mapping[str, Array] = MappingProxyType({}),
    modes: Mapping[str, Array] = MappingProxyType({}),
) -> dict[str, Array]:
    """
    Name the columns of a history, or the fields of one instant, as in the contract.

    Parameters
    ----------
    time, speed, yaw_rate : array, shape (...)
        [s, m/s, rad/s].
    acceleration, q, slosh, wheel_loads : array, shape (..., 2), (..., 6), (..., 6), (..., 4, 2)
        As in `History`.
    waves, modes : mapping of str to array, shape (...), optional
        What is known of the liquid's surface, by name; left out if nothing is.

    Returns
    -------
    dict of str to array, shape (...)
    """
    wrench = ('fx', 'fy', 'fz', 'mx', 'my', 'mz')
    body = ('z_t', 'theta_t', 'phi_t', 'z_s', 'theta_s', 'phi_s')
    loads = wheel_loads.reshape(*wheel_loads.shape[:-2], -1)
    return {
        't': time,
        'u': speed,
        'ax': acceleration[..., 0],
        'ay': acceleration[..., 1],
        'r': yaw_rate,
        **dict(zip(body, q.T, strict=True)),
        **dict(zip(wrench, slosh.T, strict=True)),
        **waves,
        'ltr': load_transfer_ratio(wheel_loads),
        **modes,
        **{f'fz_{wheel}': load for wheel, load in zip(WHEELS, loads.T, strict=True)},
    }
