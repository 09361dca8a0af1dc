"""
Tractor-semitrailer in space: parameters, matrices, tyres, wheel loads.

Ten generalised velocities, u, v, r, gamma', z_t', theta_t', phi_t', z_s', theta_s', phi_s': surge
(at the height of the fifth wheel) and sway (at the tractor's roll axis) of the tractor, its yaw
rate, the rate of articulation gamma = psi_s - psi_t, and heave, pitch and roll of both units as
deviations from equilibrium. Axes are REP-103 (x forward, y left, z up): positive pitch is nose
down, positive roll left side up. Angles are small, the articulation among them; what depends on
articulation and braking together (`u' gamma`, the onset of jack-knifing) is left out.

In straight driving, with all heights equal and no lever of the wheel forces (`GeneralParameters
.paper`), it is the 4-dof truck of `slosh_ros.vehicle.truck`, to the last digit.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, NamedTuple, get_type_hints

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.vehicle.cargo import RigidCargo

Array = NDArray[np.float64]
Four = tuple[float, float, float, float]
Three = tuple[float, float, float]

VELOCITIES = 10
U, V, R, GAMMA, Z_T, THETA_T, PHI_T, Z_S, THETA_S, PHI_S = range(VELOCITIES)
"""Positions in `y`."""
PLANAR = 4
"""The first velocities move over the ground; those after them are rates of the deviations `q`."""
LATERAL = [V, R, GAMMA]


class Told(NamedTuple):
    """
    What there is to know about a parameter.

    Attributes
    ----------
    unit : str
        Empty for none.
    meaning : str
        In words.
    source : str
        Where the default comes from.
    """

    unit: str
    meaning: str
    source: str


TABLE_3 = 'Table 3'
PITCH_ONLY = 'about y Table 3; about x ASSUMED; about z ASSUMED as about y'
ASSUMED = 'ASSUMED'
NUMERICAL = 'numerical'


@dataclass(frozen=True)
class GeneralParameters:
    """
    Masses, springs and lengths of the tractor-semitrailer in space.

    Each stands with its unit, its meaning and the source of its default (`told` lists them, the
    table of scenario parameters shows them): Table 3 of the paper, or ASSUMED, which is plausible
    for a vehicle of this size and to be replaced by your own. Drive forces are all the tractor's.

    `S` is the mass centre of the unladen semitrailer and the origin of `base_link`.
    """

    tractor_mass: Annotated[float, Told('kg', 'M_t, mass of the tractor', TABLE_3)] = 4819.0
    semitrailer_mass: Annotated[
        float, Told('kg', 'M_s, mass of the unladen semitrailer', TABLE_3)
    ] = 6400.0
    tractor_inertia: Annotated[
        Three,
        Told('kg m^2', 'of the tractor about x, y, z through its own mass centre', PITCH_ONLY),
    ] = (2500.0, 10220.0, 10220.0)
    semitrailer_inertia: Annotated[
        Three, Told('kg m^2', 'of the unladen semitrailer about x, y, z through S', PITCH_ONLY)
    ] = (7500.0, 36854.0, 36854.0)
    axle_stiffness: Annotated[float, Told('N/m', 'k_w of each axle, both sides', TABLE_3)] = 5e5
    axle_damping: Annotated[float, Told('N s/m', 'c_w of each axle, both sides', TABLE_3)] = 1e4
    hitch_stiffness: Annotated[
        float, Told('N/m', 'k_bt of the fifth wheel, vertical', TABLE_3)
    ] = 1e5
    hitch_damping: Annotated[
        float, Told('N s/m', 'c_bt of the fifth wheel, vertical', TABLE_3)
    ] = 1e3
    hitch_roll_stiffness: Annotated[float, Told('N m/rad', 'of the fifth wheel', ASSUMED)] = 3e5
    hitch_roll_damping: Annotated[float, Told('N m s/rad', 'of the fifth wheel', ASSUMED)] = 3e3
    l_w1: Annotated[
        float, Told('m', 'axle 1 ahead of the mass centre of the tractor', TABLE_3)
    ] = 2.3
    l_w2: Annotated[float, Told('m', 'axle 2 behind the mass centre of the tractor', TABLE_3)] = (
        2.9
    )
    l_w3: Annotated[float, Told('m', 'axle 3 behind S', TABLE_3)] = 2.206
    l_w4: Annotated[float, Told('m', 'axle 4 behind S', TABLE_3)] = 3.516
    l_bt: Annotated[
        float, Told('m', 'fifth wheel behind the mass centre of the tractor', TABLE_3)
    ] = 2.3
    l_bs: Annotated[float, Told('m', 'fifth wheel ahead of S', TABLE_3)] = 8.494
    tractor_height: Annotated[
        float, Told('m', 'h_t, mass centre of the tractor above the road', ASSUMED)
    ] = 1.0
    semitrailer_height: Annotated[float, Told('m', 'h_s, S above the road', ASSUMED)] = 1.25
    hitch_height: Annotated[float, Told('m', 'h_5, fifth wheel above the road', ASSUMED)] = 1.2
    tractor_roll_axis: Annotated[float, Told('m', 'h_rt, above the road', ASSUMED)] = 0.5
    semitrailer_roll_axis: Annotated[float, Told('m', 'h_rs, above the road', ASSUMED)] = 0.6
    spring_base: Annotated[
        Four, Told('m', 'b, half the distance of left and right springs, per axle', ASSUMED)
    ] = (0.93, 0.93, 0.93, 0.93)
    track: Annotated[Four, Told('m', 'T, distance of left and right tyres, per axle', ASSUMED)] = (
        2.05,
        1.86,
        1.86,
        1.86,
    )
    anti_roll_stiffness: Annotated[Four, Told('N m/rad', 'k_arb, per axle', ASSUMED)] = (
        0.0,
        3e5,
        3e5,
        3e5,
    )
    anti_roll_damping: Annotated[Four, Told('N m s/rad', 'c_arb, per axle', ASSUMED)] = (
        0.0,
        1e4,
        1e4,
        1e4,
    )
    cornering_stiffness: Annotated[
        Four, Told('N/rad', 'C_alpha, all tyres of each axle', ASSUMED)
    ] = (3e5, 6e5, 5e5, 5e5)
    brake_share: Annotated[
        float, Told('', 'of the tractor in the brake force: its share of the weight', ASSUMED)
    ] = 0.344
    slip_speed: Annotated[
        float,
        Told(
            'm/s', 'below it, slip angle is slip over this: a tyre at rest is a damper', NUMERICAL
        ),
    ] = 1.0
    wheel_forces_pitch: Annotated[
        bool,
        Told('', 'wheel forces pitch the units, over hitch_height; not in the paper', ASSUMED),
    ] = True
    equalised: Annotated[
        bool,
        Told('', 'the bogie shares its static load, unlike the springs of the paper', ASSUMED),
    ] = True

    @classmethod
    def told(cls) -> dict[str, Told]:
        """List what there is to know about each parameter."""
        hints = get_type_hints(cls, include_extras=True)
        return {name: hint.__metadata__[0] for name, hint in hints.items()}

    def paper(self) -> GeneralParameters:
        """Level all heights and drop the lever of the wheel forces, as section 5 does."""
        h = self.semitrailer_height
        return replace(
            self,
            tractor_height=h,
            hitch_height=h,
            tractor_roll_axis=h,
            semitrailer_roll_axis=h,
            wheel_forces_pitch=False,
            equalised=False,
        )

    @property
    def wheel_offsets(self) -> Array:
        """Distances (4,) of the axles behind axle 1 [m]."""
        hitch = self.l_w1 + self.l_bt + self.l_bs
        return np.array([0.0, self.l_w1 + self.l_w2, hitch + self.l_w3, hitch + self.l_w4])


@dataclass(frozen=True)
class GeneralTruck:
    """
    The matrices of `M (y' + u r e_v) + C q' + K q = Q`, the liquid frozen.

    `q` (6,) are heave, pitch and roll of tractor and semitrailer, `y[4:] = q'`. What is not
    linear, tyres above all, is in `Q`.

    Attributes
    ----------
    parameters : GeneralParameters
        Where the numbers come from.
    cargo : RigidCargo
        The frozen liquid.
    """

    parameters: GeneralParameters = field(default_factory=GeneralParameters)
    cargo: RigidCargo = field(default_factory=RigidCargo.half_full)

    @cached_property
    def base_motion(self) -> Array:
        """Gamma (6, 10): velocity and angular velocity of `base_link` per unit of `y`."""
        p, e = self.parameters, np.eye(VELOCITIES)
        return np.array(
            [
                e[U] + (p.semitrailer_height - p.hitch_height) * e[THETA_S],
                e[V]
                - (p.l_bt + p.l_bs) * e[R]
                - p.l_bs * e[GAMMA]
                - (p.semitrailer_height - p.semitrailer_roll_axis) * e[PHI_S],
                e[Z_S],
                e[PHI_S],
                e[THETA_S],
                e[R] + e[GAMMA],
            ]
        )

    @cached_property
    def tractor_motion(self) -> Array:
        """(6, 10): velocity and angular velocity of the tractor's mass centre per unit of `y`."""
        p, e = self.parameters, np.eye(VELOCITIES)
        return np.array(
            [
                e[U] + (p.tractor_height - p.hitch_height) * e[THETA_T],
                e[V] - (p.tractor_height - p.tractor_roll_axis) * e[PHI_T],
                e[Z_T],
                e[PHI_T],
                e[THETA_T],
                e[R],
            ]
        )

    def motion_at(self, point: Array) -> Array:
        """Velocity and angular velocity (6, 10) of a point (3,) of `base_link` [m] per `y`."""
        motion = self.base_motion.copy()
        motion[:3] += np.cross(motion[3:], point, axis=0)
        return motion

    @cached_property
    def bodies(self) -> tuple[tuple[Array, float, Array], ...]:
        """Motion (6, 10), mass [kg] and inertia (3, 3) [kg m^2] of tractor, semitrailer, cargo."""
        p, cargo = self.parameters, self.cargo
        return (
            (self.tractor_motion, p.tractor_mass, np.diag(p.tractor_inertia)),
            (self.base_motion, p.semitrailer_mass, np.diag(p.semitrailer_inertia)),
            (self.motion_at(np.array(cargo.centroid)), cargo.mass, np.array(cargo.inertia)),
        )

    @cached_property
    def mass(self) -> Array:
        """M (10, 10) [kg, kg m, kg m^2]."""
        matrix = np.zeros((VELOCITIES, VELOCITIES))
        for motion, mass, inertia in self.bodies:
            matrix += mass * motion[:3].T @ motion[:3] + motion[3:].T @ inertia @ motion[3:]
        return matrix

    @property
    def total_mass(self) -> float:
        """Mass of the laden truck [kg]."""
        return sum(mass for _, mass, _ in self.bodies)

    @cached_property
    def stiffness(self) -> Array:
        """K (6, 6), gravity on bodies above their pitch and roll axes included [N/m, N, N m]."""
        p, cargo = self.parameters, self.cargo
        matrix = self._suspension(
            p.axle_stiffness, p.hitch_stiffness, p.hitch_roll_stiffness, p.anti_roll_stiffness
        )
        above = cargo.centroid[2]
        lever = p.semitrailer_height - p.semitrailer_roll_axis
        tip = GRAVITY * cargo.mass * above
        matrix[THETA_S - PLANAR, THETA_S - PLANAR] -= tip
        matrix[PHI_S - PLANAR, PHI_S - PLANAR] -= (
            tip + GRAVITY * (p.semitrailer_mass + cargo.mass) * lever
        )
        matrix[PHI_T - PLANAR, PHI_T - PLANAR] -= (
            GRAVITY * p.tractor_mass * (p.tractor_height - p.tractor_roll_axis)
        )
        return matrix

    @cached_property
    def damping(self) -> Array:
        """C (6, 6) [N s/m, N s, N m s]."""
        p = self.parameters
        return self._suspension(
            p.axle_damping, p.hitch_damping, p.hitch_roll_damping, p.anti_roll_damping
        )

    @cached_property
    def axle_rise(self) -> Array:
        """(4, 6): rise of the body over the middle of each axle per unit of `q`."""
        p = self.parameters
        e = np.eye(VELOCITIES - PLANAR)
        heave = [Z_T, Z_T, Z_S, Z_S]
        ahead = [p.l_w1, -p.l_w2, -p.l_w3, -p.l_w4]
        return np.array(
            [e[z - PLANAR] - x * e[z + 1 - PLANAR] for z, x in zip(heave, ahead, strict=True)]
        )

    @cached_property
    def axle_roll(self) -> Array:
        """(4, 6): roll of the body over each axle per unit of `q`."""
        e = np.eye(VELOCITIES - PLANAR)
        return e[[PHI_T - PLANAR, PHI_T - PLANAR, PHI_S - PLANAR, PHI_S - PLANAR]]

    @cached_property
    def wheel_slip(self) -> Array:
        """
        (4, 3): sideways velocity of each axle per unit of (v, r, gamma').

        Its transpose takes the axles' side forces to generalised forces. The semitrailer's axles
        have `-u gamma` besides.
        """
        p = self.parameters
        hitch = p.l_bt + p.l_bs
        return np.array(
            [
                [1.0, p.l_w1, 0.0],
                [1.0, -p.l_w2, 0.0],
                [1.0, -hitch - p.l_w3, -p.l_bs - p.l_w3],
                [1.0, -hitch - p.l_w4, -p.l_bs - p.l_w4],
            ]
        )

    def wheel_force(self, tractor_share: float) -> Array:
        """Generalised force (10,) per unit of drive force (brake: negative) at the ground."""
        p = self.parameters
        lever = p.hitch_height if p.wheel_forces_pitch else 0.0
        push = np.zeros(VELOCITIES)
        push[U] = 1.0
        push[THETA_T] = -lever * tractor_share
        push[THETA_S] = -lever * (1.0 - tractor_share)
        return push

    def side_forces(self, speed: Array, steer: Array, lateral: Array, gamma: Array) -> Array:
        """
        Side forces of the axles from linear tyres.

        Parameters
        ----------
        speed, steer, gamma : array, shape (...)
            u [m/s], steering angle of axle 1 [rad], articulation [rad].
        lateral : array, shape (..., 3)
            v, r, gamma' [m/s, rad/s].

        Returns
        -------
        array, shape (..., 4)
            Positive to the left [N].
        """
        p = self.parameters
        slip = -(lateral @ self.wheel_slip.T)
        slip[..., 0] += speed * steer
        slip[..., 2:] += (speed * gamma)[..., np.newaxis]
        stiffness = np.array(p.cornering_stiffness)
        return np.asarray(stiffness * slip / np.maximum(speed, p.slip_speed)[..., np.newaxis])

    @cached_property
    def tyre_rate(self) -> float:
        """Fastest decay of the side slip, times the speed [m/s^2]: it bounds the step."""
        slip, stiffness = self.wheel_slip, np.array(self.parameters.cornering_stiffness)
        resistance = slip.T @ (stiffness[:, np.newaxis] * slip)
        inertia = self.mass[np.ix_(LATERAL, LATERAL)]
        return float(np.max(np.abs(np.linalg.eigvals(np.linalg.solve(inertia, resistance)))))

    def steering_for(self, radius: float, speed: float) -> float:
        """
        Steering angle that holds the tractor on a circle.

        Parameters
        ----------
        radius : float
            Radius of the path of the tractor's mass centre, positive to the left [m].
        speed : float
            Constant speed [m/s].

        Returns
        -------
        float
            Steering angle [rad]: of the single-track model, articulation and understeer included.
        """
        rate = speed / radius
        # unknowns v, gamma, delta; the tyres must give the inertia forces of the turn
        one, none = np.ones(()), np.zeros(())
        u = speed * one

        def push(lateral: list[float], steer: Array, gamma: Array) -> Array:
            return self.wheel_slip.T @ self.side_forces(u, steer, np.array(lateral), gamma)

        system = np.column_stack(
            [
                push([1.0, 0.0, 0.0], none, none),
                push([0.0, 0.0, 0.0], none, one),
                push([0.0, 0.0, 0.0], one, none),
            ]
        )
        needed = self.mass[LATERAL, V] * speed * rate - push([0.0, rate, 0.0], none, none)
        return float(np.linalg.solve(system, needed)[2])

    def road_force(self, height: Array, rate: Array) -> Array:
        """
        Generalised forces by which the road pushes.

        Parameters
        ----------
        height, rate : array, shape (..., 4, 2)
            Height of the road under the left and right wheel of each axle [m], and its rate.

        Returns
        -------
        array, shape (..., 6)
            [N, N m].
        """
        stiffness, damping = self._road_push
        flat = (*height.shape[:-2], 8)
        return np.asarray(height.reshape(flat) @ stiffness + rate.reshape(flat) @ damping)

    @cached_property
    def _road_push(self) -> tuple[Array, Array]:
        """Generalised force (8, 6) per height and per rate of the road under each wheel."""
        p = self.parameters
        base = 2.0 * np.array(p.spring_base)
        parts = []
        for axle, roll in zip((p.axle_stiffness, p.axle_damping), self._roll_rates, strict=True):
            lift, lean = axle / 2.0 * self.axle_rise, (roll / base)[:, np.newaxis] * self.axle_roll
            parts.append(np.stack([lift + lean, lift - lean], axis=1).reshape(8, -1))
        return parts[0], parts[1]

    def wheel_loads(
        self, q: Array, q_rate: Array, height: Array, rate: Array, side: Array
    ) -> Array:
        """
        Give the loads of the wheels on the road; negative where a real wheel would lift off.

        Parameters
        ----------
        q, q_rate : array, shape (..., 6)
            Deviations and their rates.
        height, rate : array, shape (..., 4, 2)
            Height of the road under the wheels [m], and its rate.
        side : array, shape (..., 4)
            Side forces of the axles [N].

        Returns
        -------
        array, shape (..., 4, 2)
            Left and right wheel of each axle [N].
        """
        p = self.parameters
        lift = (p.axle_stiffness * height + p.axle_damping * rate).mean(axis=-1)
        lift = lift - (p.axle_stiffness * q + p.axle_damping * q_rate) @ self.axle_rise.T
        stiffness, damping = self._roll_rates
        lean = stiffness * (q @ self.axle_roll.T) + damping * (q_rate @ self.axle_roll.T)
        heights = np.repeat([p.tractor_roll_axis, p.semitrailer_roll_axis], 2)
        transfer = (lean - self._road_roll(height, rate) + side * heights) / np.array(p.track)
        return np.asarray(
            self.static_wheel_loads
            + np.stack([lift / 2.0 - transfer, lift / 2.0 + transfer], axis=-1)
        )

    @cached_property
    def static_wheel_loads(self) -> Array:
        """
        Loads (4, 2) of the wheels on the road at rest, with a solid cargo [N].

        A cargo beside the middle leans the truck.
        """
        p, cargo = self.parameters, self.cargo
        laden = p.semitrailer_mass + cargo.mass
        pitching = cargo.mass * cargo.centroid[0]
        if p.equalised:
            behind = (p.l_w3 + p.l_w4) / 2.0
            hitch = GRAVITY * (laden * behind + pitching) / (p.l_bs + behind)
            weight = GRAVITY * p.tractor_mass
            wheelbase = p.l_w1 + p.l_w2
            front = (weight * p.l_w2 + hitch * (p.l_w2 - p.l_bt)) / wheelbase
            bogie = (GRAVITY * laden - hitch) / 2.0
            axles = np.array([front, weight + hitch - front, bogie, bogie])
        else:
            level = [i - PLANAR for i in (Z_T, THETA_T, Z_S, THETA_S)]
            force = -GRAVITY * np.array([p.tractor_mass, 0.0, laden, -pitching])
            settled = np.linalg.solve(self.stiffness[np.ix_(level, level)], force)
            axles = -p.axle_stiffness * self.axle_rise[:, level] @ settled
        roll = [PHI_T - PLANAR, PHI_S - PLANAR]
        moment = np.array([0.0, -GRAVITY * cargo.mass * cargo.centroid[1]])
        lean = np.linalg.solve(self.stiffness[np.ix_(roll, roll)], moment)
        transfer = self._roll_rates[0] * (self.axle_roll[:, roll] @ lean) / np.array(p.track)
        return np.column_stack([axles / 2.0 - transfer, axles / 2.0 + transfer])

    @cached_property
    def _roll_rates(self) -> tuple[Array, Array]:
        """Roll stiffness and damping of each axle (4,), springs and anti-roll bar."""
        p = self.parameters
        base = np.array(p.spring_base) ** 2
        return (
            p.axle_stiffness * base + np.array(p.anti_roll_stiffness),
            p.axle_damping * base + np.array(p.anti_roll_damping),
        )

    def _road_roll(self, height: Array, rate: Array) -> Array:
        """
        Find the rolling moment (..., 4) of the road on each axle [N m].

        Springs and anti-roll bar stand on the axle, which follows the road: on a banked road
        nothing is twisted.
        """
        base = 2.0 * np.array(self.parameters.spring_base)
        stiffness, damping = self._roll_rates
        bank, banking = (-np.diff(x, axis=-1)[..., 0] / base for x in (height, rate))
        return np.asarray(stiffness * bank + damping * banking)

    def _suspension(self, axle: float, hitch: float, hitch_roll: float, bars: Four) -> Array:
        """Sum the springs (or dampers) of axles, hitch and anti-roll bars."""
        p = self.parameters
        e = np.eye(VELOCITIES)
        stretch = (e[Z_T] + p.l_bt * e[THETA_T] - e[Z_S] + p.l_bs * e[THETA_S])[PLANAR:]
        twist = (e[PHI_T] - e[PHI_S])[PLANAR:]
        roll = axle * np.array(p.spring_base) ** 2 + np.array(bars)
        return np.asarray(
            axle * self.axle_rise.T @ self.axle_rise
            + self.axle_roll.T @ (roll[:, np.newaxis] * self.axle_roll)
            + hitch * np.outer(stretch, stretch)
            + hitch_roll * np.outer(twist, twist)
        )
