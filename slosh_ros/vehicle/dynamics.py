"""
The general truck in motion: linear system and time stepping.

Suspension, gravity and liquid are linear with constant matrices, so they are stepped exactly
(`Propagator`). Tyres, `u r` and the road under a moving truck are not; they enter as generalised
forces, which the exponential Runge-Kutta scheme of Krogstad (2005) takes as polynomials of time
over a step: it is of fourth order in them, and exact where they are parabolas. Steps end where a
wheel meets an edge of the road, at kinks of acceleration and steering, and where the truck stops.

The liquid is in one of two ways. Its modes may be part of the system: exact elimination of beta''.
Or its state wrench W_s comes from outside and the acceleration is solved for with what it feeds
through, as in `slosh_ros.vehicle.simulator`:

    W = W_s + A (s, alpha),    s = a + g (-theta_s, phi_s, 1).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.vehicle.general_truck import (
    LATERAL,
    PHI_S,
    PLANAR,
    THETA_S,
    VELOCITIES,
    GeneralTruck,
    R,
    U,
    V,
)
from slosh_ros.vehicle.liquid import LiquidModes
from slosh_ros.vehicle.lti import Propagator
from slosh_ros.vehicle.manoeuvre import Manoeuvre
from slosh_ros.vehicle.road import Road
from slosh_ros.vehicle.steering import Steering, SteeringKnots

Array = NDArray[np.float64]
Control = Literal['acceleration', 'force']

DEVIATIONS = VELOCITIES - PLANAR
GAMMA_AT, HEADING_AT, DISTANCE_AT = range(DEVIATIONS, DEVIATIONS + 3)
_Q = slice(0, DEVIATIONS)
_Y = slice(DEVIATIONS + 3, DEVIATIONS + 3 + VELOCITIES)
_U = _Y.start + U
_LATERAL = slice(_Y.start + V, _Y.start + PLANAR)
_R = _Y.start + R
STATES = _Y.stop
"""States of the truck alone: q (6), gamma, psi, distance, y (10); then beta and beta'."""

_PUSH, _TURN = VELOCITIES, VELOCITIES + 1  # inputs after the 10 generalised forces
_FORCES = slice(0, VELOCITIES)
_INPUTS = VELOCITIES + 2

MAX_STEP = 0.01
"""Longest step [s]: relative errors of 5e-7 in a lane change."""
_TYRE_STEP = 1.0  # longest step in units of the tyres' fastest decay; the scheme bears 2.8
_TIME_TOLERANCE = 1e-11  # [s]
_EDGE_TOLERANCE = 1e-9  # [m]

TILT: Array = np.zeros((6, DEVIATIONS))
"""(6, 6): specific force (and no angular acceleration) at `base_link` per unit of `q`."""
TILT[0, THETA_S - PLANAR] = -GRAVITY
TILT[1, PHI_S - PLANAR] = GRAVITY
TILT.setflags(write=False)


@dataclass(frozen=True, eq=False)
class Drive:
    """
    A truck and what its driver does with it, where.

    Attributes
    ----------
    truck : GeneralTruck
        The truck.
    manoeuvre : Manoeuvre
        Initial speed and acceleration over time.
    steering : Steering
        Angle of axle 1 over time.
    road : Road
        Where it drives, by distance travelled.
    control : str
        `acceleration`: the driver (or ABS) holds the manoeuvre's acceleration, whatever the
        liquid does. `force`: the wheels give the force that would accelerate the rigid truck so;
        the liquid adds its own. A truck that stops does not roll back.
    """

    truck: GeneralTruck
    manoeuvre: Manoeuvre
    steering: Steering = field(default_factory=SteeringKnots.straight)
    road: Road = field(default_factory=Road.flat)
    control: Control = 'acceleration'

    @cached_property
    def events(self) -> Array:
        """Rising times at which the driver's inputs have a kink or a jump [s]."""
        return np.unique([*self.steering.events, *self.manoeuvre.knots])


class LinearSystem:
    """
    `N w' + C w + K p = Q + push F`, `w = (y + u r e_v, beta')`, `p = (q, beta)`.

    Parameters
    ----------
    truck : GeneralTruck
        The truck.
    modes : LiquidModes
        Sloshing modes at `base_link` that are part of the system.
    feed_through : array, shape (6, 6)
        A at `base_link` of the wrench that is not.

    Attributes
    ----------
    mass : array, shape (10 + n, 10 + n)
        N; symmetric.
    damping : array, shape (10 + n, 10 + n)
        C; symmetric.
    stiffness : array, shape (10 + n, 6 + n)
        K; symmetric in its rows from 4 on, but for A.
    """

    def __init__(self, truck: GeneralTruck, modes: LiquidModes, feed_through: Array) -> None:
        n, gamma = len(modes.omega), truck.base_motion
        inertia, weight = modes.coupling @ gamma, modes.tilt @ gamma
        felt = gamma.T @ feed_through
        size = VELOCITIES + n
        self.truck = truck
        self.modes = modes
        self.mass: Array = np.zeros((size, size))
        self.mass[:VELOCITIES, :VELOCITIES] = truck.mass - felt @ gamma
        self.mass[VELOCITIES:, :VELOCITIES] = inertia
        self.mass[:VELOCITIES, VELOCITIES:] = inertia.T
        self.mass[VELOCITIES:, VELOCITIES:] = np.diag(modes.mu)
        self.damping: Array = np.zeros((size, size))
        self.damping[PLANAR:VELOCITIES, PLANAR:VELOCITIES] = truck.damping
        self.damping[VELOCITIES:, VELOCITIES:] = np.diag(
            2.0 * modes.damping_ratio * modes.omega * modes.mu
        )
        self.stiffness: Array = np.zeros((size, DEVIATIONS + n))
        self.stiffness[PLANAR:VELOCITIES, :DEVIATIONS] = truck.stiffness
        self.stiffness[:VELOCITIES, :DEVIATIONS] -= felt @ TILT
        self.stiffness[VELOCITIES:, :DEVIATIONS] = modes.coupling @ TILT
        self.stiffness[:VELOCITIES, DEVIATIONS:] = -weight.T
        self.stiffness[VELOCITIES:, DEVIATIONS:] = np.diag(modes.omega**2 * modes.mu)
        self._plants: dict[tuple[bool, float], Propagator] = {}

    @property
    def size(self) -> int:
        """Number of states."""
        return STATES + 2 * len(self.modes.omega)

    def plant(self, held: bool, tractor_share: float) -> Propagator:
        """
        State equations `x' = A x + B v`; v = (Q (10), a or F, u r).

        Parameters
        ----------
        held : bool
            The acceleration `u' = a` is given, otherwise the force F at the wheels.
        tractor_share : float
            Share of the tractor in F.
        """
        key = held, tractor_share
        if key not in self._plants:
            self._plants[key] = self._plant(held, tractor_share)
        return self._plants[key]

    def _plant(self, held: bool, tractor_share: float) -> Propagator:
        n, size = len(self.modes.omega), len(self.mass)
        mass, forces = self.mass, np.eye(size, VELOCITIES)
        push = np.zeros(size)
        push[:VELOCITIES] = self.truck.wheel_force(tractor_share)
        rows = np.hstack([forces, self.damping, self.stiffness])
        if held:
            # the force is the unknown: take its share out of the other rows, then drop its own
            mass, rows = (m - np.outer(push, m[U]) for m in (mass, rows))
            mass[U], push = np.eye(size)[U], np.eye(size)[U]
        solved = np.linalg.solve(mass, np.column_stack([rows, push]))
        given, damping, stiffness, pushed = np.split(
            solved, [VELOCITIES, VELOCITIES + size, solved.shape[1] - 1], axis=1
        )
        rates = np.r_[_Y, STATES + n : STATES + 2 * n]
        places = np.r_[_Q, STATES : STATES + n]
        a = np.zeros((self.size, self.size))
        b = np.zeros((self.size, _INPUTS))
        a[_Q, _Y.start + PLANAR : _Y.stop] = np.eye(DEVIATIONS)
        a[[GAMMA_AT, HEADING_AT, DISTANCE_AT], [_R + 1, _R, _U]] = 1.0
        a[STATES : STATES + n, STATES + n :] = np.eye(n)
        a[np.ix_(rates, rates)] = -damping
        a[np.ix_(rates, places)] = -stiffness
        b[rates, :VELOCITIES] = given
        b[rates, _PUSH] = pushed[:, 0]
        b[_Y.start + V, _TURN] = -1.0
        return Propagator(a, b, 2)

    def pull(self, x: Array, acceleration: Array, forces: Array) -> float:
        """Force at the wheels that goes with an acceleration (10 + n,) [N]."""
        n = len(self.modes.omega)
        places = np.r_[_Q, STATES : STATES + n]
        inertia = self.mass[U] @ acceleration + self.stiffness[U] @ x[places]
        return float(inertia - forces[U])


@dataclass
class _Stretch:
    """What holds during one step: the pieces of the inputs."""

    begin: float
    plant: Propagator
    push: float
    push_rate: float
    steer_inside: float
    about: Array


class TruckDynamics:
    """
    A truck on its drive, moved from event to event.

    Parameters
    ----------
    drive : Drive
        Truck, driver and road.
    modes : LiquidModes
        Sloshing modes at `base_link` that are part of the system.
    feed_through : array, shape (6, 6)
        A at `base_link` of the wrench that is not.
    max_step : float
        Longest step [s].

    Attributes
    ----------
    time : float
        Present time [s].
    x : array, shape (19 + 2 n,)
        State: q, gamma, psi, distance, y, beta, beta'.
    position : array, shape (2,)
        Of the tractor's mass centre on the ground, from its place at time zero [m].
    """

    def __init__(
        self, drive: Drive, modes: LiquidModes, feed_through: Array, max_step: float = MAX_STEP
    ) -> None:
        self.drive = drive
        self.system = LinearSystem(drive.truck, modes, feed_through)
        self.max_step = max_step
        self.time = 0.0
        self.x: Array = np.zeros(self.system.size)
        self.x[_U] = drive.manoeuvre.speed[0]
        self.position: Array = np.zeros(2)
        truck, p = drive.truck, drive.truck.parameters
        slip, stiffness = truck.wheel_slip, np.array(p.cornering_stiffness)
        self._steered: Array = slip.T @ (stiffness * [1.0, 0.0, 0.0, 0.0])
        self._articulated: Array = slip.T @ (stiffness * [0.0, 0.0, 1.0, 1.0])
        self._resistance: Array = slip.T @ (stiffness[:, np.newaxis] * slip)
        self._offsets = p.wheel_offsets
        self._edges = np.array(drive.road.edges)
        self._standing = False
        self._external: tuple[float, Array, Array] = (
            0.0,
            np.zeros(VELOCITIES),
            np.zeros(VELOCITIES),
        )

    def couple(self, feed_through: Array) -> None:
        """Take a new A (6, 6), for instance after a change of fill."""
        self.system = LinearSystem(self.drive.truck, self.system.modes, feed_through)

    def press(self, wrench: Array, wrench_rate: Array) -> None:
        """Take a state wrench (6,) at `base_link`, linear in time from now on [N, N m, s]."""
        gamma = self.drive.truck.base_motion
        self._external = self.time, wrench @ gamma, wrench_rate @ gamma

    def advance(self, stop: float) -> None:
        """Move on to a time [s]."""
        while stop - self.time > _TIME_TOLERANCE:
            self._step(stop)
        self.time = stop

    def present(self) -> tuple[Array, Array]:
        """Find state derivative (19 + 2 n,) and inputs (12,) at present, after any event."""
        stretch = self._stretch(1e-6)
        inputs = self._inputs(0.0, self.x, stretch)
        return stretch.plant.a @ self.x + stretch.plant.b @ inputs, inputs

    def under_wheels(self) -> tuple[Array, Array]:
        """Height [m] and slope of the road under the wheels at present, each (4, 2)."""
        position = self.x[DISTANCE_AT] - self._offsets
        return self.drive.road.under(position, self._about(1e-6))

    @property
    def steer(self) -> float:
        """Steering angle at present [rad]."""
        return self.drive.steering.angle(self.time, self.time + _TIME_TOLERANCE)

    @property
    def q(self) -> Array:
        """Deviations (6,) from static equilibrium at present [m, rad]."""
        return self.x[_Q].copy()

    @property
    def y(self) -> Array:
        """Generalised velocities (10,) at present [m/s, rad/s]."""
        return self.x[_Y].copy()

    def acceleration(self) -> Array:
        """Find the accelerations (10,), `y' + u r e_v`, at present [m/s^2, rad/s^2]."""
        slope, inputs = self.present()
        acceleration = slope[_Y].copy()
        acceleration[V] += inputs[_TURN]
        return acceleration

    def _step(self, stop: float) -> None:
        """Take one step, not beyond the next event."""
        events = self.drive.events
        later = events[events > self.time + _TIME_TOLERANCE]
        end = min(stop, float(later[0])) if later.size else stop
        speed = max(float(self.x[_U]), 0.0)
        slip_speed = max(speed, self.drive.truck.parameters.slip_speed)
        longest = self.max_step
        if longest * self.drive.truck.tyre_rate > _TYRE_STEP * slip_speed:
            longest = _TYRE_STEP * slip_speed / self.drive.truck.tyre_rate
        if speed * longest > self.drive.road.grain:
            longest = self.drive.road.grain / speed
        # rounded, so that equal steps find their matrices ready
        span = end - self.time
        h = round(span / max(1, int(np.ceil(span / longest - 1e-6))), 12)
        stretch = self._stretch(h)
        after = self._krogstad(stretch, h)
        cut = self._crossing(after[0], h)
        if cut is not None:
            h = cut
            stretch = self._stretch(h)
            after = self._krogstad(stretch, h)
        new, middle = after
        begin, halfway, finish = (_ground_velocity(x) for x in (self.x, middle, new))
        self.position = self.position + h / 6.0 * (begin + 4.0 * halfway + finish)
        self.x = new
        self.time = end if cut is None and abs(self.time + h - end) < 1e-9 else self.time + h
        if self.drive.control == 'force' and new[_U] <= 1e-9:
            new[_U] = 0.0
            self._standing = True

    def _krogstad(self, stretch: _Stretch, h: float) -> tuple[Array, Array]:
        """Step of the exponential Runge-Kutta scheme; return the state after it and halfway."""
        x, move, half = self.x, stretch.plant.step, h / 2.0
        v = np.zeros((3, _INPUTS))
        first = v[0] = self._inputs(0.0, x, stretch)
        guess = move(x, v, half)
        second = self._inputs(half, guess, stretch)
        # twice the slope: the errors of this guess and the last cancel in their mean
        v[1] = (second - first) / (half / 2.0)
        better = move(x, v, half)
        third = self._inputs(half, better, stretch)
        v[1] = (third - first) / half
        fourth = self._inputs(h, move(x, v, h), stretch)
        mean = (second + third) / 2.0
        v[1] = (4.0 * mean - 3.0 * first - fourth) / h
        v[2] = (2.0 * first - 4.0 * mean + 2.0 * fourth) / h**2
        return move(x, v, h), (guess + better) / 2.0

    def _stretch(self, h: float) -> _Stretch:
        """Choose the pieces of the inputs for a step of a length [s]."""
        drive, p = self.drive, self.drive.truck.parameters
        inside = self.time + h / 2.0
        taylor = drive.manoeuvre.taylor(np.array([self.time]), inside)[0]
        push, rate = 2.0 * float(taylor[2]), 6.0 * float(taylor[3])
        share = p.brake_share if push + rate * h / 2.0 < 0.0 else 1.0
        stretch = _Stretch(
            self.time, self.system.plant(True, share), push, rate, inside, self._about(h)
        )
        if drive.control == 'force':
            mass = drive.truck.total_mass
            if self._standing:
                stretch.push = stretch.push_rate = 0.0
                held = self._pull(stretch)
                self._standing = mass * push <= held  # else the push overcomes what holds it
            if not self._standing:
                stretch.push, stretch.push_rate = mass * push, mass * rate
                stretch.plant = self.system.plant(False, share)
        return stretch

    def _pull(self, stretch: _Stretch) -> float:
        """Force at the wheels that holds the acceleration of a stretch at its beginning [N]."""
        inputs = self._inputs(0.0, self.x, stretch)
        slope = stretch.plant.a @ self.x + stretch.plant.b @ inputs
        rates = np.r_[_Y, STATES + len(self.system.modes.omega) : self.system.size]
        acceleration = slope[rates]
        acceleration[V] += inputs[_TURN]
        return self.system.pull(self.x, acceleration, inputs[_FORCES])

    def _about(self, h: float) -> Array:
        """Positions (4,) of the axles in the middle of a step: they choose the piece of road."""
        ahead = max(float(self.x[_U]) * h / 2.0, _EDGE_TOLERANCE)
        return np.asarray(self.x[DISTANCE_AT] + ahead - self._offsets)

    def _inputs(self, tau: float, x: Array, stretch: _Stretch) -> Array:
        """Find generalised forces, push and `u r` (12,) at a time since the step began [s]."""
        drive, p = self.drive, self.drive.truck.parameters
        u = float(x[_U])
        steer = drive.steering.angle(stretch.begin + tau, stretch.steer_inside)
        since, load, load_rate = self._external
        v = np.empty(_INPUTS)
        v[_FORCES] = load + (stretch.begin - since + tau) * load_rate
        grip = u * (steer * self._steered + float(x[GAMMA_AT]) * self._articulated)
        v[LATERAL] += (grip - self._resistance @ x[_LATERAL]) / max(u, p.slip_speed)
        if not drive.road.is_flat:
            height, slope = drive.road.under(x[DISTANCE_AT] - self._offsets, stretch.about)
            v[PLANAR:VELOCITIES] += drive.truck.road_force(height, u * slope)
        v[_PUSH] = stretch.push + tau * stretch.push_rate
        v[_TURN] = u * float(x[_R])
        return v

    def _crossing(self, after: Array, h: float) -> float | None:
        """Find when, before the end of a step, a wheel first meets an edge or the truck stops."""
        s0, u0, s1, u1 = (float(x[k]) for x in (self.x, after) for k in (DISTANCE_AT, _U))
        found = []
        if self.drive.control == 'force' and not self._standing and u1 < 0.0 < u0:
            found.append(_root(lambda t: -_hermite(s0, u0, s1, u1, h, t)[1], h))
        if self._edges.size:
            marks = (self._edges[:, np.newaxis] + self._offsets).ravel()
            inside = marks[(marks > s0 + _EDGE_TOLERANCE) & (marks < s1 - _EDGE_TOLERANCE)]
            if inside.size:
                mark = float(inside.min())
                found.append(_root(lambda t: _hermite(s0, u0, s1, u1, h, t)[0] - mark, h))
        return min(found) if found else None


def _ground_velocity(x: Array) -> Array:
    """Velocity (2,) of the tractor's mass centre over the ground [m/s]."""
    u, v, heading = x[_U], x[_LATERAL.start], x[HEADING_AT]
    c, s = np.cos(heading), np.sin(heading)
    return np.array([u * c - v * s, u * s + v * c])


def _hermite(
    s0: float, u0: float, s1: float, u1: float, h: float, t: float
) -> tuple[float, float]:
    """Distance and speed within a step; exact for an acceleration linear in time."""
    mean = (s1 - s0) / h
    square, cube = (3.0 * mean - 2.0 * u0 - u1) / h, (u0 + u1 - 2.0 * mean) / h**2
    distance = s0 + t * (u0 + t * (square + t * cube))
    return distance, u0 + t * (2.0 * square + 3.0 * t * cube)


def _root(function: Callable[[float], float], h: float) -> float:
    return float(scipy.optimize.brentq(function, 0.0, h, xtol=1e-15, rtol=1e-14))
