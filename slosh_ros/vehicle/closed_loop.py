"""
The truck and its liquid as one system: the ground truth for every exchange of wrenches.

The modes join the four degrees of freedom of the truck, (q, beta), and the coupled equations are
solved exactly from event to event. This is eq (38), mended, for any number of modes.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.vehicle.journey import DEGREE, TIME_TOLERANCE, Contact, Journey
from slosh_ros.vehicle.liquid import LiquidModes
from slosh_ros.vehicle.lti import Propagator
from slosh_ros.vehicle.truck import BASE_MOTION, THETA_S, Z_S, Truck

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CoupledSystem:
    """
    Matrices of `M y'' + C y' + K y = B v`, y = (q, beta), v = (r_1 .. r_4, a).

    Attributes
    ----------
    mass, damping, stiffness : array, shape (4 + n, 4 + n)
        M, C and K; symmetric for a truck without misprints.
    forcing : array, shape (4 + n, 5)
        B, for the inputs of a `Journey`.
    """

    mass: Array
    damping: Array
    stiffness: Array
    forcing: Array

    @classmethod
    def of(cls, truck: Truck, modes: LiquidModes, origin: Array) -> CoupledSystem:
        """
        Couple a truck with the modes of its tank.

        Parameters
        ----------
        truck : Truck
            The vehicle, its liquid frozen.
        modes : LiquidModes
            Coefficients about O.
        origin : array, shape (3,)
            Position of O in `base_link` [m].
        """
        inertia = BASE_MOTION.T @ modes.coupling_at(origin).T
        weight = BASE_MOTION.T @ modes.tilt.T
        rigidity = modes.omega**2 * modes.mu
        resistance = 2.0 * modes.damping_ratio * modes.omega * modes.mu
        return cls(
            mass=np.block([[truck.mass, inertia], [inertia.T, np.diag(modes.mu)]]),
            damping=scipy.linalg.block_diag(truck.damping, np.diag(resistance)),
            stiffness=np.block([[truck.stiffness, -weight], [-weight.T, np.diag(rigidity)]]),
            forcing=np.block(
                [
                    [truck.forcing],
                    [np.zeros((len(modes.omega), 4)), -modes.coupling[:, :1]],
                ]
            ),
        )

    def state_matrices(self) -> tuple[Array, Array]:
        """Matrices (2 m, 2 m) and (2 m, 5) of `x' = A x + B v`, x = (y, y'), m = 4 + n."""
        m = len(self.mass)
        a = np.zeros((2 * m, 2 * m))
        a[:m, m:] = np.eye(m)
        a[m:, :m] = -np.linalg.solve(self.mass, self.stiffness)
        a[m:, m:] = -np.linalg.solve(self.mass, self.damping)
        b = np.zeros((2 * m, 5))
        b[m:] = np.linalg.solve(self.mass, self.forcing)
        return a, b

    def poles(self) -> Array:
        """Natural frequencies [rad/s] and damping ratios of the oscillations, shape (k, 2)."""
        roots = np.linalg.eigvals(self.state_matrices()[0])
        roots = roots[roots.imag > 0.0]
        pairs = np.column_stack([np.abs(roots), -roots.real / np.abs(roots)])
        return np.asarray(pairs[np.argsort(pairs[:, 0])])


@dataclass(frozen=True, eq=False)
class ClosedLoopResult:
    """
    History of a journey on N instants; deviations are from static equilibrium.

    Attributes
    ----------
    time : array, shape (N,)
        Instants [s].
    distance, speed, acceleration : array, shape (N,)
        Prescribed motion along the road [m, m/s, m/s^2].
    q, q_rate, q_acceleration : array, shape (N, 4)
        z_t, theta_t, z_s, theta_s and their derivatives [m, rad, s].
    beta, beta_rate, beta_acceleration : array, shape (N, n)
        Modal coordinates and their derivatives [m, s].
    slosh : array, shape (N, 6)
        Sloshing wrench on the tank about O, axes of `base_link`, eqs (15)-(20) [N, N m].
    total : array, shape (N, 6)
        The same with weight and inertia of the frozen liquid; of its moments only that about y.
    specific_force : array, shape (N, 3)
        At `base_link` [m/s^2].
    axle_loads : array, shape (N, 4)
        Vertical loads on the road [N].
    contacts : tuple of Contact
        When each axle is on the bump.
    """

    time: Array
    distance: Array
    speed: Array
    acceleration: Array
    q: Array
    q_rate: Array
    q_acceleration: Array
    beta: Array
    beta_rate: Array
    beta_acceleration: Array
    slosh: Array
    total: Array
    specific_force: Array
    axle_loads: Array
    contacts: tuple[Contact, ...]

    @property
    def f1(self) -> Array:
        """Longitudinal sloshing force, eq (15), shape (N,) [N]."""
        return self.slosh[:, 0]

    @property
    def m5(self) -> Array:
        """Sloshing moment about the y axis through O, eq (19), shape (N,) [N m]."""
        return self.slosh[:, 4]


def simulate(
    journey: Journey,
    modes: LiquidModes,
    duration: float,
    step: float = 1e-3,
    origin: Array | None = None,
    initial: Array | None = None,
) -> ClosedLoopResult:
    """
    Drive a truck with its liquid along a journey.

    Parameters
    ----------
    journey : Journey
        The truck's way along the road.
    modes : LiquidModes
        Coefficients about O; `LiquidModes.none()` for a solid cargo.
    duration : float
        Length of the run [s]; rounded to whole steps.
    step : float
        Spacing of the result [s]; it does not affect the accuracy.
    origin : array, shape (3,), optional
        Position of O in `base_link` [m]; by default the truck's.
    initial : array, shape (8 + 2 n,), optional
        (q, beta, q', beta') at time zero; by default static equilibrium.

    Returns
    -------
    ClosedLoopResult
        Everything on the instants 0, step, 2 step ..; at an event, as just after it.
    """
    if not 0.0 < step <= duration < np.inf:
        raise InputError(f'need 0 < step <= duration, got step {step} s, duration {duration} s')
    if origin is None:
        origin = journey.truck.parameters.liquid_origin
    system = CoupledSystem.of(journey.truck, modes, origin)
    time = np.arange(round(duration / step) + 1, dtype=np.float64) * step
    a, b = system.state_matrices()
    start = np.zeros(len(a)) if initial is None else np.array(initial, dtype=float)
    states, inputs = _integrate(Propagator(a, b, DEGREE), journey, time, start)
    m = len(system.mass)
    acceleration = (states @ a.T + inputs @ b.T)[:, m:]
    return _collect(journey, modes, time, states[:, :m], states[:, m:], acceleration, inputs)


def _integrate(
    propagator: Propagator, journey: Journey, time: Array, start: Array
) -> tuple[Array, Array]:
    """Find states (N, 2 m) and inputs (N, 5) on an even grid, restarting at every event."""
    stop = float(time[-1])
    states = np.empty((len(time), len(start)))
    inputs = np.empty((len(time), propagator.b.shape[1]))
    free, forced = propagator.transition(float(time[1]))
    edges = journey.edges(0.0, stop)
    firsts = np.searchsorted(time, np.array(edges) - TIME_TOLERANCE)  # just after an event
    firsts[-1] = len(time)
    x, now = start, 0.0
    for k, (left, right) in enumerate(pairwise(edges)):
        inside = (left + right) / 2.0
        points = slice(firsts[k], firsts[k + 1])
        grid = time[points]
        if grid.size:
            x = _hop(propagator, journey, x, now, float(grid[0]), inside)
            polynomials = journey.inputs(grid, inside)
            inputs[points] = polynomials[:, 0]
            pushes = polynomials.reshape(len(grid), -1) @ forced.T
            for i, push in enumerate(pushes, start=int(firsts[k])):
                states[i] = x
                x = free @ x + push
            x, now = states[firsts[k + 1] - 1], float(grid[-1])
        x, now = _hop(propagator, journey, x, now, right, inside), right
    return states, inputs


def _hop(
    propagator: Propagator, journey: Journey, x: Array, now: float, then: float, inside: float
) -> Array:
    """Move a state to an event, or from it back to the grid."""
    if then - now <= TIME_TOLERANCE:
        return x
    return propagator.step(x, journey.inputs(np.array([now]), inside)[0], then - now)


def _collect(
    journey: Journey,
    modes: LiquidModes,
    time: Array,
    y: Array,
    rate: Array,
    acceleration: Array,
    inputs: Array,
) -> ClosedLoopResult:
    """Derive the loads from the states."""
    truck, p = journey.truck, journey.truck.parameters
    q, q_acceleration, beta_acceleration = y[:, :4], acceleration[:, :4], acceleration[:, 4:]
    slosh = y[:, 4:] @ modes.tilt - beta_acceleration @ modes.coupling
    surge, pitch_acceleration = inputs[:, 4], q_acceleration[:, THETA_S]
    specific = np.zeros((len(time), 3))
    specific[:, 0] = surge - GRAVITY * q[:, THETA_S]
    specific[:, 2] = GRAVITY + q_acceleration[:, Z_S]
    # the frozen liquid: its centroid is surface_height below O, liquid_centroid from base_link
    push = -p.liquid_mass * (specific[:, 0] + p.liquid_height * pitch_acceleration)
    total = slosh.copy()
    total[:, 0] += push
    total[:, 2] -= p.liquid_mass * (specific[:, 2] - p.liquid_offset * pitch_acceleration)
    total[:, 4] -= p.surface_height * push + p.liquid_pitch_inertia * pitch_acceleration
    motion = journey.manoeuvre.taylor(time)
    return ClosedLoopResult(
        time=time,
        distance=motion[:, 0],
        speed=motion[:, 1],
        acceleration=surge,
        q=q,
        q_rate=rate[:, :4],
        q_acceleration=q_acceleration,
        beta=y[:, 4:],
        beta_rate=rate[:, 4:],
        beta_acceleration=beta_acceleration,
        slosh=slosh,
        total=total,
        specific_force=specific,
        axle_loads=truck.axle_loads(inputs[:, :4], q, rate[:, :4]),
        contacts=journey.contacts,
    )
