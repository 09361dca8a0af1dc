"""General truck and liquid as one system: the ground truth for every exchange of wrenches."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.vehicle.cargo import SloshingCargo
from slosh_ros.vehicle.dynamics import (
    DEVIATIONS,
    DISTANCE_AT,
    GAMMA_AT,
    HEADING_AT,
    MAX_STEP,
    STATES,
    TILT,
    Drive,
    TruckDynamics,
)
from slosh_ros.vehicle.general_truck import GAMMA, PLANAR, VELOCITIES, U, V
from slosh_ros.vehicle.history import History
from slosh_ros.vehicle.journey import Contact

Array = NDArray[np.float64]


def simulate_general(
    drive: Drive,
    cargo: SloshingCargo,
    duration: float,
    step: float = 0.01,
    max_step: float = MAX_STEP,
    initial: Array | None = None,
    progress: Callable[[float], None] | None = None,
) -> History:
    """
    Drive a general truck with its liquid.

    Parameters
    ----------
    drive : Drive
        Truck, driver and road.
    cargo : SloshingCargo
        The liquid; `SloshingCargo.none()` for a solid cargo.
    duration : float
        Length of the run [s]; rounded to whole steps.
    step : float
        Spacing of the result [s].
    max_step : float
        Longest step of the solution [s]; see `slosh_ros.vehicle.dynamics`.
    initial : array, shape (19 + 2 n,), optional
        State of `TruckDynamics` at time zero; by default equilibrium at the initial speed.
    progress : callable, optional
        Told the present time after each step of the result [s].

    Returns
    -------
    History
    """
    if not 0.0 < step <= duration < np.inf:
        raise InputError(f'need 0 < step <= duration, got step {step} s, duration {duration} s')
    dynamics = TruckDynamics(drive, cargo.modes, cargo.feed_through, max_step)
    if initial is not None:
        dynamics.x = np.array(initial, dtype=float)
    time = np.arange(round(duration / step) + 1, dtype=np.float64) * step
    count = len(time)
    x, slope = np.empty((2, count, dynamics.system.size))
    turning, steer = np.empty((2, count))
    position, under = np.empty((count, 2)), np.empty((2, count, 4, 2))
    for i, t in enumerate(time.tolist()):
        dynamics.advance(t)
        x[i] = dynamics.x
        slope[i], inputs = dynamics.present()
        turning[i], steer[i] = inputs[-1], dynamics.steer
        position[i], under[:, i] = dynamics.position, dynamics.under_wheels()
        if progress is not None:
            progress(t)
    return _collect(drive, cargo, time, x, slope, turning, steer, position, under)


def _collect(
    drive: Drive,
    cargo: SloshingCargo,
    time: Array,
    x: Array,
    slope: Array,
    turning: Array,
    steer: Array,
    position: Array,
    under: Array,
) -> History:
    """Derive the loads from the states."""
    truck, n = drive.truck, len(cargo.modes.omega)
    q, beta, beta_rate = x[:, :DEVIATIONS], x[:, STATES : STATES + n], x[:, STATES + n :]
    y = x[:, STATES - VELOCITIES : STATES]
    acceleration = slope[:, STATES - VELOCITIES : STATES].copy()
    acceleration[:, V] += turning
    felt = acceleration @ truck.base_motion.T
    beta_acceleration = slope[:, STATES + n :]
    slosh = beta @ cargo.modes.tilt - beta_acceleration @ cargo.modes.coupling
    slosh[:, 3:] -= np.cross(cargo.reference, slosh[:, :3])
    speed, lateral = y[:, U], y[:, V : GAMMA + 1]
    side = truck.side_forces(speed, steer, lateral, x[:, GAMMA_AT])
    height, rate = under[0], under[1] * speed[:, np.newaxis, np.newaxis]
    return History(
        time=time,
        planar_rate=y[:, :PLANAR],
        acceleration=np.column_stack([acceleration[:, U], felt[:, 1]]),
        distance=x[:, DISTANCE_AT],
        heading=x[:, HEADING_AT],
        articulation=x[:, GAMMA_AT],
        steer=steer,
        position=position,
        q=q,
        q_rate=y[:, PLANAR:],
        q_acceleration=acceleration[:, PLANAR:],
        beta=beta,
        beta_rate=beta_rate,
        beta_acceleration=beta_acceleration,
        slosh=slosh,
        wheel_loads=truck.wheel_loads(q, y[:, PLANAR:], height, rate, side),
        side_forces=side,
        road=height,
        contacts=_contacts(drive, time, x[:, DISTANCE_AT]),
        specific_force=felt[:, :3] + q @ TILT[:3].T + [0.0, 0.0, GRAVITY],
        cargo=cargo,
    )


def _contacts(drive: Drive, time: Array, distance: Array) -> tuple[Contact, ...]:
    """Find when the axles pass the edges of the road, between two instants linearly."""
    edges = drive.road.edges
    if not edges:
        return ()
    marks = np.add.outer(drive.truck.parameters.wheel_offsets, [edges[0], edges[-1]])
    reached = np.interp(marks, distance, time, right=np.inf).tolist()
    return tuple(Contact(i, *ends) for i, ends in enumerate(reached, start=1))
