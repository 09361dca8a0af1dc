"""The general truck and its liquid as one system: reduction, conservation, lateral figures."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.hydro import coefficients_of
from slosh_ros.tank import cylinder_x
from slosh_ros.vehicle import TABLE_4, Bump, LiquidModes, Manoeuvre, TruckParameters, simulate
from slosh_ros.vehicle.cargo import RigidCargo, SloshingCargo, TankLiquid
from slosh_ros.vehicle.dynamics import STATES, Drive, LinearSystem
from slosh_ros.vehicle.general_loop import simulate_general
from slosh_ros.vehicle.general_truck import GeneralParameters, GeneralTruck
from slosh_ros.vehicle.history import History
from slosh_ros.vehicle.journey import Journey
from slosh_ros.vehicle.road import Road
from slosh_ros.vehicle.stability import rigid_threshold, steady_turn
from slosh_ros.vehicle.steering import SineSteering, SteeringKnots
from slosh_ros.vehicle.truck import Truck

pytestmark = pytest.mark.dear

Array = NDArray[np.float64]

TRUCK = GeneralTruck()
PAPER_TRUCK = GeneralTruck(GeneralParameters().paper())
FLAT_TRUCK = Truck(TruckParameters.corrected())
SOLID = SloshingCargo.none()
CRUISING = Manoeuvre.from_knots(15.0, (0.0,), (0.0,))
BRAKING = Manoeuvre.braking(10.0, 0.98)

COEFFICIENTS = coefficients_of(cylinder_x(1.125, 14.0), 1.125, 1000.0, 8)
AXIS = np.array([0.0, 0.0, 0.65 + 4.0 * 1.125 / (3.0 * np.pi)])
TANK = TankLiquid.of(COEFFICIENTS, np.full(8, 0.02), AXIS)

# VEHICLE 7.3: half-full circle of R = 1.125 m
SWAY = TankLiquid(
    LiquidModes(
        omega=np.array([3.4383, 6.3685, 8.2577]),
        mu=np.array([12479.0, 3754.4, 2255.7]),
        coupling=np.array(
            [[0, 14059.9, 0, 11667, 0, 0], [0, 1363.7, 0, 329.9, 0, 0], [0, 504.5, 0, 72.6, 0, 0]],
            dtype=float,
        ),
        damping_ratio=np.full(3, 0.02),
    ),
    ('y1', 'y3', 'y5'),
    AXIS,
    np.eye(3),
    np.zeros((3, 3)),
)
LIQUID = SloshingCargo.of(SWAY)


@cache
def step_steer(cargo: str, angle: float = 0.04) -> History:
    truck = GeneralTruck(cargo=RigidCargo.none()) if cargo == 'empty' else TRUCK
    drive = Drive(truck, CRUISING, SteeringKnots.step(angle, 1.0))
    return simulate_general(drive, LIQUID if cargo == 'liquid' else SOLID, 40.0)


def relative_rms(value: Array, truth: Array) -> float:
    return float(np.sqrt(np.mean((value - truth) ** 2) / np.mean(truth**2)))


# reduction to the four degrees of freedom of section 5


def test_matrices_reduce_to_the_four_dof_truck() -> None:
    y, q = [4, 5, 7, 8], [0, 1, 3, 4]
    for name, scale in (('mass', 1e6), ('stiffness', 2e7), ('damping', 3e5)):
        rows = y if name == 'mass' else q
        general, flat = getattr(PAPER_TRUCK, name), getattr(FLAT_TRUCK, name)
        np.testing.assert_allclose(general[np.ix_(rows, rows)], flat, atol=1e-15 * scale)
    np.testing.assert_allclose(PAPER_TRUCK.mass[y, 0], -FLAT_TRUCK.surge, atol=1e-9)
    np.testing.assert_allclose(
        PAPER_TRUCK.static_wheel_loads.sum(axis=1), FLAT_TRUCK.static_axle_loads, rtol=1e-12
    )
    np.testing.assert_allclose(
        PAPER_TRUCK.parameters.wheel_offsets, FLAT_TRUCK.parameters.wheel_offsets
    )


@pytest.mark.parametrize('height', [0.0, 0.2, -0.2])
@pytest.mark.parametrize('manoeuvre', [BRAKING, Manoeuvre.accelerating(1.96)])
def test_straight_driving_is_the_exact_four_dof_solution(
    manoeuvre: Manoeuvre, height: float
) -> None:
    origin = FLAT_TRUCK.parameters.liquid_origin
    truth = simulate(Journey(FLAT_TRUCK, manoeuvre, Bump(height)), TABLE_4, 12.0, 0.01)
    drive = Drive(PAPER_TRUCK, manoeuvre, road=Road.even(Bump(height)))
    found = simulate_general(drive, SloshingCargo.of(TankLiquid.paper(origin)), 12.0)
    np.testing.assert_allclose(found.q[:, [0, 1, 3, 4]], truth.q, atol=2e-9)
    np.testing.assert_allclose(found.beta, truth.beta, atol=1e-10)
    np.testing.assert_allclose(found.slosh, truth.slosh, atol=1e-3)
    np.testing.assert_allclose(found.wheel_loads.sum(axis=2), truth.axle_loads, atol=2e-2)
    np.testing.assert_allclose(found.distance, truth.distance, atol=1e-9)
    np.testing.assert_allclose(found.q[:, [2, 5]], 0.0, atol=1e-15)
    if not height:
        np.testing.assert_allclose(found.q[:, [0, 1, 3, 4]], truth.q, atol=1e-12)


def test_any_number_of_modes_reduces_too() -> None:
    truth = simulate(
        Journey(FLAT_TRUCK, BRAKING, Bump(0.2)), TANK.modes, 12.0, 0.01, origin=TANK.origin
    )
    frozen = replace(TANK, relief=np.zeros((3, 3)))
    drive = Drive(PAPER_TRUCK, BRAKING, road=Road.even(Bump(0.2)))
    found = simulate_general(drive, SloshingCargo.of(frozen), 12.0)
    np.testing.assert_allclose(found.q[:, [0, 1, 3, 4]], truth.q, atol=2e-9)
    np.testing.assert_allclose(found.slosh, truth.slosh, atol=1e-3)


def test_full_heights_change_the_force_as_known() -> None:
    # VEHICLE 7.2: -22.92/+23.41 kN, against -22.75/+23.21 kN of the paper's truck
    origin = FLAT_TRUCK.parameters.liquid_origin
    cargo = SloshingCargo.of(TankLiquid.paper(origin))
    force = simulate_general(Drive(TRUCK, BRAKING), cargo, 11.2).slosh[:, 0] / 1e3
    assert force.min() == pytest.approx(-22.92, abs=0.06)
    assert force.max() == pytest.approx(23.41, abs=0.06)


# brake force or deceleration


def test_prescribed_brake_force_lets_the_slosh_drive_the_truck() -> None:
    # VEHICLE 6: a_x in [-2.55, 2.22] m/s^2, F1 from -60.3 to 86.3 kN, without clamp at standstill
    cargo = SloshingCargo.of(TankLiquid.paper(FLAT_TRUCK.parameters.liquid_origin))
    held, force = (
        simulate_general(Drive(PAPER_TRUCK, BRAKING, control=c), cargo, 11.2)
        for c in ('acceleration', 'force')
    )
    assert np.abs(force.slosh[:, 0]).max() > 2.0 * np.abs(held.slosh[:, 0]).max()
    assert force.acceleration[:, 0].max() > 1.0
    assert held.acceleration[:, 0].max() == pytest.approx(0.0, abs=1e-12)
    assert np.all(force.speed >= 0.0)


def test_brake_force_on_a_solid_truck_is_the_deceleration() -> None:
    held, force = (
        simulate_general(Drive(PAPER_TRUCK, Manoeuvre.braking(10.0, 2.0), control=c), SOLID, 4.0)
        for c in ('acceleration', 'force')
    )
    # the frozen liquid above the hitch's height pitches, which surges the centre of mass
    np.testing.assert_allclose(force.speed, held.speed, atol=0.03)


def test_momentum_along_the_road_is_the_impulse_of_the_brakes() -> None:
    cargo = SloshingCargo.of(TANK)
    r = simulate_general(Drive(TRUCK, BRAKING, control='force'), cargo, 6.0)
    system = LinearSystem(TRUCK, cargo.modes, cargo.feed_through)
    assert system.mass[0, 0] == pytest.approx(TRUCK.total_mass)
    weight = GRAVITY * TRUCK.total_mass
    impulse = TRUCK.total_mass * (BRAKING.motion(6.0)[1] - 10.0)
    gained = TRUCK.total_mass * (r.speed[-1] - 10.0)
    inner = system.mass[0, [5, 8]] @ r.q_rate[-1, [1, 4]] + system.mass[0, 10:] @ r.beta_rate[-1]
    assert gained + inner == pytest.approx(impulse, abs=1e-5 * weight)


def test_truck_that_stops_by_force_stands_while_it_brakes() -> None:
    plan = Manoeuvre.braking(6.0, 3.0)  # brakes until 3 s
    slower = replace(plan, speed=plan.speed - 1.0)  # so it stops before
    drive = Drive(TRUCK, slower, control='force')
    r = simulate_general(drive, SOLID, 4.0)
    stop = float(r.time[np.argmax(r.speed == 0.0)])
    assert 1.5 < stop < 2.4
    standing = (r.time >= stop) & (r.time < 2.6)
    np.testing.assert_array_equal(r.speed[standing], 0.0)
    np.testing.assert_allclose(r.acceleration[standing, 0], 0.0, atol=1e-12)
    # liquid that swings forward pushes the truck on, past its brakes
    r = simulate_general(drive, SloshingCargo.of(TANK), 8.0)
    assert np.all(r.speed >= 0.0)
    first = np.argmax(r.speed == 0.0)
    assert r.speed[first:].max() > 0.1


# laws


def test_mass_matrix_is_symmetric_and_positive_definite() -> None:
    for cargo in (SOLID, LIQUID, SloshingCargo.of(TANK)):
        mass = LinearSystem(TRUCK, cargo.modes, cargo.feed_through).mass
        np.testing.assert_allclose(mass, mass.T, atol=1e-9)
        assert np.linalg.eigvalsh(mass).min() > 0.0


def test_rigid_inertia_told_twice_makes_the_kinetic_energy_indefinite() -> None:
    twice = TRUCK.motion_at(np.array(TRUCK.cargo.centroid))
    inertia = np.diag([2.0 * TRUCK.total_mass] * 3 + [1e6] * 3)
    felt = TRUCK.mass - twice.T @ inertia @ twice
    assert np.linalg.eigvalsh(felt).min() < 0.0


@pytest.mark.parametrize(
    'cargo', [SOLID, LIQUID, SloshingCargo.of(TANK)], ids=['solid', 'sway', 'all']
)
def test_undamped_truck_and_liquid_conserve_energy(cargo: SloshingCargo) -> None:
    smooth = replace(
        GeneralParameters(),
        axle_damping=0.0,
        hitch_damping=0.0,
        hitch_roll_damping=0.0,
        anti_roll_damping=(0.0, 0.0, 0.0, 0.0),
        cornering_stiffness=(0.0, 0.0, 0.0, 0.0),
        wheel_forces_pitch=False,  # the truck is held by a force that must do no work
    )
    truck = GeneralTruck(smooth)
    modes = replace(cargo.modes, damping_ratio=np.zeros(len(cargo.modes.omega)))
    lossless = replace(cargo, modes=modes)
    n = len(modes.omega)
    rng = np.random.default_rng(4)
    start = np.zeros(STATES + 2 * n)
    start[:6] = rng.uniform(-0.01, 0.01, 6)
    start[STATES : STATES + n] = rng.uniform(-0.05, 0.05, n)
    rest = Manoeuvre.from_knots(0.0, (0.0,), (0.0,))
    r = simulate_general(Drive(truck, rest), lossless, 20.0, 0.05, initial=start)
    system = LinearSystem(truck, modes, cargo.feed_through)
    planar = np.column_stack([np.zeros((len(r.time), 1)), r.planar_rate[:, 1:]])
    rate = np.hstack([planar, r.q_rate, r.beta_rate])
    places = np.hstack([r.q, r.beta])
    kinetic = np.einsum('ti,ij,tj->t', rate, system.mass, rate) / 2.0
    potential = np.einsum('ti,ij,tj->t', places, system.stiffness[4:], places) / 2.0
    energy = kinetic + potential
    np.testing.assert_allclose(energy, energy[0], rtol=1e-7)


def test_mirrored_drive_gives_the_mirrored_history() -> None:
    road = Road(Bump(0.1), Bump(-0.05, 2.0, 14.0))
    one = Drive(TRUCK, Manoeuvre.braking(15.0, 2.0), SineSteering(0.03), road)
    other = replace(one, steering=SineSteering(-0.03), road=Road(road.right, road.left))
    cargo = SloshingCargo.of(TANK)
    left, right = (simulate_general(d, cargo, 6.0) for d in (one, other))
    turned = np.array([1.0, 1.0, -1.0, 1.0, 1.0, -1.0])
    np.testing.assert_allclose(left.q, right.q * turned, atol=1e-12)
    np.testing.assert_allclose(left.wheel_loads, right.wheel_loads[:, :, ::-1], atol=1e-5)
    np.testing.assert_allclose(left.yaw_rate, -right.yaw_rate, atol=1e-12)
    np.testing.assert_allclose(left.transfer.vehicle, -right.transfer.vehicle, atol=1e-10)
    assert np.abs(left.q[:, 5]).max() > 0.01


def test_two_runs_are_equal_bit_for_bit() -> None:
    drive = Drive(TRUCK, BRAKING, SineSteering(0.03), Road(Bump(0.1), Bump(0.0)))
    one, two = (simulate_general(drive, SloshingCargo.of(TANK), 5.0) for _ in '12')
    assert one.q.tobytes() == two.q.tobytes()
    assert one.slosh.tobytes() == two.slosh.tobytes()


def test_steps_converge_at_fourth_order() -> None:
    drive = Drive(TRUCK, Manoeuvre.braking(15.0, 1.0), SineSteering(0.04))
    cargo = SloshingCargo.of(TANK)

    def run(max_step: float) -> Array:
        return simulate_general(drive, cargo, 5.0, 0.04, max_step=max_step).q[:, 5]

    truth = run(6.25e-4)
    errors = [relative_rms(run(h), truth) for h in (0.02, 0.01, 0.005)]
    assert errors[1] < 1e-6
    assert np.log2(errors[0] / errors[2]) / 2.0 > 3.5


def test_banked_road_leans_a_weightless_truck_by_its_angle() -> None:
    bank = 0.02
    half = np.array(TRUCK.parameters.spring_base)
    height = np.stack([half * bank, -half * bank], axis=-1)
    push = TRUCK.road_force(height, np.zeros((4, 2)))
    lean = np.array([0.0, 0.0, bank, 0.0, 0.0, bank])
    gravity = np.zeros((6, 6))
    p, c = TRUCK.parameters, TRUCK.cargo
    gravity[2, 2] = GRAVITY * p.tractor_mass * (p.tractor_height - p.tractor_roll_axis)
    gravity[5, 5] = GRAVITY * (
        (p.semitrailer_mass + c.mass) * (p.semitrailer_height - p.semitrailer_roll_axis)
        + c.mass * c.centroid[2]
    )
    np.testing.assert_allclose((TRUCK.stiffness + gravity) @ lean, push, atol=1e-6)
    loads = TRUCK.wheel_loads(lean, np.zeros(6), height, np.zeros((4, 2)), np.zeros(4))
    np.testing.assert_allclose(loads, TRUCK.static_wheel_loads, atol=1e-6)


# steering


@pytest.mark.parametrize(
    ('cargo', 'a_y', 'roll', 'roll_peak', 'ltr', 'ltr_peak'),
    [
        ('liquid', 2.113, 0.0968, 0.1001, 0.603, 0.622),
        ('frozen', 2.113, 0.0660, 0.0662, 0.456, 0.457),
        ('empty', 1.505, 0.0042, 0.0042, 0.185, 0.185),
    ],
)
def test_step_steer_table(
    cargo: str, a_y: float, roll: float, roll_peak: float, ltr: float, ltr_peak: float
) -> None:
    # the table of VEHICLE 7.4 has one lateral mode and no roll inertia of the liquid itself
    mass = 0.0 if cargo == 'empty' else TRUCK.cargo.mass
    thin = RigidCargo.principal(mass, TRUCK.cargo.centroid, (0.0, 457050.0, 455e3))
    drive = Drive(GeneralTruck(cargo=thin), CRUISING, SteeringKnots.step(0.04, 1.0))
    if cargo == 'empty':
        drive = replace(drive, truck=GeneralTruck(cargo=RigidCargo.none()))
    m = SWAY.modes
    first = LiquidModes(m.omega[:1], m.mu[:1], m.coupling[:1], m.damping_ratio[:1])
    sloshing = SloshingCargo.of(replace(SWAY, modes=first, names=('y1',)))
    r = simulate_general(drive, sloshing if cargo == 'liquid' else SOLID, 40.0)
    assert r.acceleration[-1, 1] == pytest.approx(a_y, abs=6e-4)
    assert r.q[-1, 5] == pytest.approx(roll, abs=6e-5)
    assert r.q[:, 5].max() == pytest.approx(roll_peak, abs=6e-5)
    assert r.transfer.vehicle[-1] == pytest.approx(ltr, abs=6e-4)
    assert r.transfer.vehicle.max() == pytest.approx(ltr_peak, abs=6e-4)


@pytest.mark.parametrize(
    ('cargo', 'ltr', 'peak'), [('liquid', 0.603, 0.622), ('frozen', 0.456, 0.457)]
)
def test_more_modes_and_the_liquids_own_roll_inertia_change_the_table_little(
    cargo: str, ltr: float, peak: float
) -> None:
    r = step_steer(cargo)
    assert r.transfer.vehicle[-1] == pytest.approx(ltr, rel=4e-3)
    assert r.transfer.vehicle.max() == pytest.approx(peak, rel=1e-2)


def test_load_transfer_balances_the_moments_about_the_road() -> None:
    # one roll axis for both units: otherwise the hitch force has two heights (VEHICLE 7.1)
    p = replace(GeneralParameters(), tractor_roll_axis=0.6)
    truck = GeneralTruck(p)
    c = truck.cargo
    for cargo in (LIQUID, SOLID):
        drive = Drive(truck, CRUISING, SteeringKnots.step(0.04, 1.0))
        r = simulate_general(drive, cargo, 40.0, 0.1)
        a_y, lean = r.acceleration[-1, 1], r.q[-1]
        bodies = (  # mass, height, roll
            (p.tractor_mass, p.tractor_height, lean[2]),
            (p.semitrailer_mass, p.semitrailer_height, lean[5]),
            (c.mass, p.semitrailer_height + c.centroid[2], lean[5]),
        )
        moment = sum(m * (a_y * h + GRAVITY * (h - 0.6) * phi) for m, h, phi in bodies)
        moment += r.beta[-1] @ cargo.modes.tilt[:, 3]
        transferred = (np.diff(r.wheel_loads[-1], axis=1)[:, 0] / 2.0) @ np.array(p.track)
        assert transferred == pytest.approx(moment, rel=1e-4)
        assert r.wheel_loads[-1].sum() == pytest.approx(GRAVITY * truck.total_mass, rel=1e-6)


def test_steady_turn_is_where_the_step_steer_settles() -> None:
    for name, cargo in (('liquid', LIQUID), ('frozen', SOLID)):
        r = step_steer(name)
        turn = steady_turn(TRUCK, cargo, r.acceleration[-1, 1])
        np.testing.assert_allclose(turn.q, r.q[-1], atol=1e-6)
        np.testing.assert_allclose(turn.wheel_loads, r.wheel_loads[-1], rtol=1e-4)
        np.testing.assert_allclose(turn.beta, r.beta[-1], atol=1e-6)


def test_rollover_thresholds() -> None:
    even = GeneralTruck(replace(GeneralParameters(), track=(1.86, 1.86, 1.86, 1.86)))
    assert rigid_threshold(even, LIQUID) / GRAVITY == pytest.approx(0.460, abs=1e-3)
    assert rigid_threshold(even) / GRAVITY == pytest.approx(0.553, abs=1e-3)
    empty = GeneralTruck(even.parameters, RigidCargo.none())
    assert rigid_threshold(empty) / GRAVITY == pytest.approx(0.814, abs=2e-3)
    assert steady_turn(TRUCK, LIQUID).threshold / GRAVITY == pytest.approx(0.357, abs=1e-3)
    assert steady_turn(TRUCK, SOLID).threshold / GRAVITY == pytest.approx(0.472, abs=1e-3)


def test_stiff_truck_rolls_over_at_the_rigid_threshold() -> None:
    stiff = replace(
        GeneralParameters(),
        axle_stiffness=5e11,
        hitch_roll_stiffness=1e12,
        tractor_roll_axis=0.6,
        track=(1.86, 1.86, 1.86, 1.86),
    )
    for cargo in (LIQUID, SOLID):
        truck = GeneralTruck(stiff)
        sloshing = cargo if len(cargo.modes.omega) else None
        assert steady_turn(truck, cargo).threshold == pytest.approx(
            rigid_threshold(truck, sloshing), rel=1e-6
        )


def test_liquid_lowers_the_rollover_threshold_and_frozen_does_not() -> None:
    # a steering ramp slow enough that nothing swings, until the first wheels lift off
    ramp = SteeringKnots((0.0, 60.0), (0.0, 0.12))
    drive = Drive(TRUCK, CRUISING, ramp)
    limits = {}
    for name, cargo in (('liquid', LIQUID), ('solid', SOLID)):
        r = simulate_general(drive, cargo, 60.0, 0.05)
        limits[name] = np.interp(1.0, r.transfer.vehicle, r.acceleration[:, 1])
        assert limits[name] == pytest.approx(steady_turn(TRUCK, cargo).threshold, rel=0.01)
    assert limits['liquid'] < 0.8 * limits['solid']
    rigid = {name: rigid_threshold(TRUCK, c) for name, c in (('liquid', LIQUID), ('solid', None))}
    assert rigid['liquid'] < 0.85 * rigid['solid']
    assert rigid_threshold(TRUCK, SOLID) == rigid['solid']


def test_roll_moment_about_the_axis_of_a_half_full_circle_vanishes() -> None:
    # pressures pass through the axis: frozen part, relief and modes cancel, whatever the motion
    coefficients = coefficients_of(cylinder_x(1.125, 14.0), 1.125, 1000.0, 48)
    tank = TankLiquid.of(coefficients, np.zeros(48), AXIS)
    cargo = SloshingCargo.of(tank)
    drive = Drive(TRUCK, CRUISING, SineSteering(0.04))
    r = simulate_general(drive, cargo, 8.0)
    liquid = coefficients.liquid
    depth = liquid.centroid[2]  # below O
    gamma = TRUCK.motion_at(AXIS)
    alpha = r.q_acceleration[:, 5]
    # specific force at O sideways, from that of base_link (1.127 m below) and the roll
    felt = r.acceleration[:, 1] - AXIS[2] * alpha + GRAVITY * r.q[:, 5]
    frozen = coefficients.mass * depth * felt - coefficients.inertia_frozen[0, 0] * alpha
    total = frozen + tank.relief[0, 0] * alpha + r.slosh[:, 3]
    assert gamma[3, 9] == 1.0
    assert np.abs(total).max() < 3e-3 * np.abs(frozen).max()
    assert np.abs(r.slosh[:, 3]).max() > 0.5 * np.abs(frozen).max()


def test_slow_circle_has_the_kinematic_radius() -> None:
    crawl = Manoeuvre.from_knots(1.0, (0.0,), (0.0,))
    p = TRUCK.parameters
    angle = 0.1
    r = simulate_general(Drive(TRUCK, crawl, SteeringKnots.step(angle)), SOLID, 60.0, 0.5)
    tractor_rate = np.diff(r.heading)[-1] / 0.5
    radius = (p.l_w1 + p.l_w2) / angle
    # two axles of the bogie at one radius: they scrub a little
    assert 1.0 / tractor_rate == pytest.approx(radius, rel=0.02)
    behind = p.l_bs + (p.l_w3 + p.l_w4) / 2.0
    # the hitch is 0.6 m ahead of axle 2: gamma is -(l_bs + x_r)/R + (l_w2 - l_bt)/R
    assert r.articulation[-1] == pytest.approx(-(behind - (p.l_w2 - p.l_bt)) / radius, rel=0.02)


@pytest.mark.parametrize('speed', [3.0, 10.0, 20.0])
def test_steering_for_a_radius_drives_that_radius(speed: float) -> None:
    angle = TRUCK.steering_for(80.0, speed)
    cruise = Manoeuvre.from_knots(speed, (0.0,), (0.0,))
    r = simulate_general(Drive(TRUCK, cruise, SteeringKnots.step(angle)), SOLID, 30.0, 0.1)
    assert speed / r.yaw_rate[-1] == pytest.approx(80.0, rel=1e-3)


def test_lane_change_returns_to_straight() -> None:
    r = simulate_general(Drive(TRUCK, CRUISING, SineSteering(0.03)), SloshingCargo.of(TANK), 30.0)
    assert r.position[-1, 1] > 1.0  # one lane to the left
    assert abs(r.heading[-1]) < 2e-3
    for rest in (r.yaw_rate, r.articulation, r.acceleration[:, 1]):
        assert abs(rest[-1]) < 2e-3
    np.testing.assert_allclose(r.transfer.vehicle[-1], 0.0, atol=0.01)
    assert np.abs(r.transfer.vehicle).max() > 0.1


def test_liquid_turns_lighter_than_frozen() -> None:
    # the Stokes-Joukowski inertia belongs in the coupling: without it the roll period is longer
    real = SloshingCargo.of(TANK)
    frozen = replace(real, relief=np.zeros((3, 3)))
    assert np.linalg.eigvalsh(real.relief).min() > -1e-6 * np.max(real.relief)
    drive = Drive(TRUCK, CRUISING, road=Road(Bump(0.1), Bump(0.0)))
    a, b = (simulate_general(drive, c, 6.0) for c in (real, frozen))
    assert relative_rms(a.q[:, 5], b.q[:, 5]) > 0.01
    np.testing.assert_allclose((real.coupling - frozen.coupling)[3:, 3:], real.relief, atol=1e-6)


def test_tank_turned_about_the_vertical_turns_its_modes() -> None:
    # a quarter turn: surge modes answer to the steering
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    cargo = SloshingCargo.of(replace(TANK, rotation=quarter))
    surge = COEFFICIENTS.names.index('x1')
    r = simulate_general(Drive(TRUCK, CRUISING, SineSteering(0.02)), cargo, 3.0)
    assert np.abs(r.beta[:, surge]).max() > 0.01
    plain = simulate_general(
        Drive(TRUCK, CRUISING, SineSteering(0.02)), SloshingCargo.of(TANK), 3.0
    )
    assert np.abs(plain.beta[:, surge]).max() < 1e-9


def test_two_tanks_of_half_the_liquid_are_as_one() -> None:
    half = replace(TANK.modes, mu=TANK.modes.mu / 2.0, coupling=TANK.modes.coupling / 2.0)
    part = replace(TANK, modes=half, relief=TANK.relief / 2.0)
    drive = Drive(TRUCK, BRAKING, SineSteering(0.02))
    one, two = (
        simulate_general(drive, SloshingCargo.of(*tanks), 4.0) for tanks in ((TANK,), (part, part))
    )
    np.testing.assert_allclose(one.q, two.q, atol=1e-9)
    np.testing.assert_allclose(one.slosh, two.slosh, atol=1e-3)
    assert two.names[0] == f'1_{TANK.names[0]}'


def test_impossible_spacing_of_the_result_is_refused() -> None:
    with pytest.raises(ValueError, match='0 < step <= duration'):
        simulate_general(Drive(TRUCK, BRAKING), SOLID, 1.0, 2.0)
