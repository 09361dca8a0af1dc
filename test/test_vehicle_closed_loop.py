"""Truck and liquid as one system: the paper's cases, conservation laws, an independent solver."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from slosh_ros.constants import GRAVITY
from slosh_ros.vehicle import (
    CALIBRATED_DAMPING_RATIO,
    TABLE_4,
    Bump,
    ClosedLoopResult,
    CoupledSystem,
    Journey,
    LiquidModes,
    Manoeuvre,
    Truck,
    TruckParameters,
    simulate,
)
from slosh_ros.vehicle.lti import Propagator

Array = NDArray[np.float64]

CORRECTED = TruckParameters.corrected()
BRAKING = Manoeuvre.braking(10.0, 0.98)
COASTING = Manoeuvre.from_knots(10.0, (0.0,), (0.0,))
WINDOW = 11.2  # [s] until just before the halt
SLOSHING_MASS = TABLE_4.coupling[0, 0] ** 2 / TABLE_4.mu[0]  # lambda_1^2 / mu [kg]


@cache
def braking(name: str, height: float) -> ClosedLoopResult:
    """Brake over a bump with one of the parameter sets."""
    modes = TABLE_4
    if name == 'nominal':
        parameters = CORRECTED
    elif name == 'd_l = 0.3 m':
        parameters = replace(CORRECTED, liquid_height=0.3)
    elif name == 'solid':
        parameters, modes = CORRECTED, LiquidModes.none()
    else:
        parameters = TruckParameters.calibrated()
        modes = replace(TABLE_4, damping_ratio=np.array([CALIBRATED_DAMPING_RATIO]))
    return simulate(Journey(Truck(parameters), BRAKING, Bump(height)), modes, WINDOW)


@pytest.mark.parametrize(
    ('name', 'height', 'peak'),
    [
        ('nominal', -0.2, 29.15),
        ('nominal', 0.0, 23.21),
        ('nominal', 0.2, 27.58),
        ('d_l = 0.3 m', -0.2, 24.33),
        ('d_l = 0.3 m', 0.0, 23.39),
        ('d_l = 0.3 m', 0.2, 25.98),
        ('calibrated', -0.2, 25.10),
        ('calibrated', 0.0, 21.20),
        ('calibrated', 0.2, 26.60),
    ],
)
def test_peak_force_during_braking(name: str, height: float, peak: float) -> None:
    assert braking(name, height).f1.max() / 1e3 == pytest.approx(peak, rel=1e-3)


@pytest.mark.parametrize(
    ('name', 'low', 'high', 'at', 'moment'),
    [('nominal', -22.75, 23.21, 7.06, 1995.0), ('calibrated', -22.40, 21.20, 6.93, 1908.0)],
)
def test_force_and_moment_during_braking_on_a_flat_road(
    name: str, low: float, high: float, at: float, moment: float
) -> None:
    r = braking(name, 0.0)
    assert r.f1.min() / 1e3 == pytest.approx(low, rel=1e-3)
    assert r.time[r.f1.argmin()] == pytest.approx(1.0, abs=5e-3)  # the end of the ramp
    assert r.f1.max() / 1e3 == pytest.approx(high, rel=1e-3)
    assert r.time[r.f1.argmax()] == pytest.approx(at, abs=6e-3)
    assert r.m5.max() / 1e3 == pytest.approx(moment, rel=1e-3)
    assert r.m5.min() == pytest.approx(0.0, abs=1.0)


def test_bump_raises_the_force_and_hardly_the_moment() -> None:
    flat, pit, bump = (braking('nominal', h) for h in (0.0, -0.2, 0.2))
    for rough in (pit, bump):
        assert rough.f1.max() > 1.15 * flat.f1.max()
        assert rough.m5.max() == pytest.approx(flat.m5.max(), rel=0.008)


def test_force_on_a_rigid_vehicle_is_the_closed_form() -> None:
    rigid = replace(CORRECTED, axle_stiffness=5e10, hitch_stiffness=5e10)
    r = simulate(Journey(Truck(rigid), BRAKING, Bump(0.0)), TABLE_4, WINDOW)
    omega = TABLE_4.omega[0]
    ramp_end = SLOSHING_MASS * 0.98 * np.sin(omega) / omega
    plateau = SLOSHING_MASS * 0.98 * np.sin(omega / 2.0) / (omega / 2.0)
    assert -r.f1[1000] == pytest.approx(ramp_end, rel=1e-4)
    assert -r.f1[1000] / 1e3 == pytest.approx(22.01, rel=1e-3)
    assert r.f1[r.time < 10.2].max() == pytest.approx(plateau, rel=1e-4)
    assert plateau / 1e3 == pytest.approx(23.33, rel=1e-3)


def test_total_force_includes_the_rigid_part() -> None:
    # -M_l a - lambda_1 beta'' in the axes of the road
    for height, peak in ((-0.2, 56.4), (0.0, 50.5), (0.2, 54.9)):
        r = braking('nominal', height)
        road = r.f1 - CORRECTED.liquid_mass * r.acceleration
        assert road.max() / 1e3 == pytest.approx(peak, rel=1.5e-3)
        # in the tank's axes the weight leans forward, and the centroid is d_l above base_link
        lean = CORRECTED.liquid_mass * GRAVITY * r.q[:, 3]
        swing = CORRECTED.liquid_mass * CORRECTED.liquid_height * r.q_acceleration[:, 3]
        np.testing.assert_allclose(r.total[:, 0], road + lean - swing, atol=1e-6)


def test_slosh_enlarges_the_pitch_and_its_mean() -> None:
    liquid, solid = braking('nominal', 0.2).q[:, 3], braking('solid', 0.2).q[:, 3]
    assert solid.min() == pytest.approx(-0.0410, abs=6e-5)
    assert solid.max() == pytest.approx(0.0359, abs=6e-5)
    assert solid.mean() == pytest.approx(0.0016, abs=6e-5)
    assert liquid.min() == pytest.approx(0.0, abs=1e-6)
    assert liquid.max() == pytest.approx(0.2097, abs=6e-5)
    assert liquid.mean() == pytest.approx(0.1112, abs=6e-5)


def test_axles_lift_off_in_the_papers_own_case() -> None:
    lowest = braking('nominal', 0.0).axle_loads.min(axis=0) / 1e3
    assert lowest[3] == pytest.approx(-47.0, abs=0.1)
    strong = Journey(Truck(CORRECTED), Manoeuvre.accelerating(1.96), Bump(0.0))
    assert simulate(strong, TABLE_4, 12.0).axle_loads[:, 1].min() / 1e3 == pytest.approx(
        -219.7, abs=0.1
    )


def test_surface_rises_above_the_tank_in_the_papers_own_case() -> None:
    assert np.abs(braking('nominal', 0.0).beta).max() == pytest.approx(2.4, abs=0.05)


def test_axle_loads_sum_to_the_weight_and_the_vertical_inertia() -> None:
    r, p = braking('nominal', 0.2), CORRECTED
    lifted = p.tractor_mass * r.q_acceleration[:, 0]
    lifted = lifted + (p.semitrailer_mass + p.liquid_mass) * r.q_acceleration[:, 2]
    weight = GRAVITY * (p.tractor_mass + p.semitrailer_mass + p.liquid_mass)
    np.testing.assert_allclose(r.axle_loads.sum(axis=1), weight + lifted, rtol=1e-9)


@pytest.mark.parametrize('offset', [0.0, 0.425])
def test_total_wrench_is_what_an_empty_truck_must_carry(offset: float) -> None:
    laden = replace(CORRECTED, liquid_offset=offset)
    journey = Journey(Truck(laden), BRAKING, Bump(0.2))
    r = simulate(journey, TABLE_4, WINDOW, step=0.01)
    empty = Truck(replace(laden, liquid_mass=0.0, liquid_pitch_inertia=0.0))
    origin = laden.liquid_origin
    heave = r.total[:, 2] + laden.liquid_mass * GRAVITY  # less the static load
    pitch = r.total[:, 4] + origin[2] * r.total[:, 0] - origin[0] * heave
    road = r.axle_loads - journey.truck.axle_loads(np.zeros(4), r.q, r.q_rate)
    lhs = r.q_acceleration @ empty.mass + r.q_rate @ empty.damping + r.q @ empty.stiffness
    rhs = road @ empty.axle_motion.T
    rhs[:, 2] += heave
    rhs[:, 3] += pitch
    np.testing.assert_allclose(lhs, rhs, atol=1e-5)


def test_independent_integration_with_restarts_gives_the_same_history() -> None:
    truck, bump = Truck(CORRECTED), Bump(0.2)
    journey = Journey(truck, BRAKING, bump)
    r = simulate(journey, TABLE_4, 12.0, step=0.01)
    system = CoupledSystem.of(truck, TABLE_4, CORRECTED.liquid_origin)
    inverse = np.linalg.inv(system.mass)

    def slope(t: float, x: Array, left: float, right: float) -> Array:
        distance, speed, acceleration = BRAKING.motion(min(max(t, left), right))
        under = np.array([distance]) - CORRECTED.wheel_offsets
        road = CORRECTED.axle_stiffness * bump.elevation(under)
        road = road + CORRECTED.axle_damping * bump.slope(under) * speed
        force = system.forcing @ np.append(road, acceleration)
        force = force - system.damping @ x[5:] - system.stiffness @ x[:5]
        return np.concatenate([x[5:], inverse @ force])

    x = np.zeros(10)
    for left, right in pairwise(journey.edges(0.0, 12.0)):
        inside = (r.time >= left) & (r.time <= right)
        # a hair inside, so that each end is on the right side of the bump's edge
        ends = (left + 1e-12, right - 1e-12)
        run = solve_ivp(
            slope, (left, right), x, 'DOP853', r.time[inside], args=ends, rtol=1e-11, atol=1e-13
        )
        np.testing.assert_allclose(r.q[inside], run.y[:4].T, atol=1e-9)
        np.testing.assert_allclose(r.beta[inside], run.y[4:5].T, atol=1e-9)
        np.testing.assert_allclose(r.q_rate[inside], run.y[5:9].T, atol=1e-8)
        x = solve_ivp(slope, (left, right), x, 'DOP853', args=ends, rtol=1e-11, atol=1e-13).y[
            :, -1
        ]


def test_spacing_of_the_result_does_not_change_it() -> None:
    journey = Journey(Truck(CORRECTED), BRAKING, Bump(0.2))
    fine = simulate(journey, TABLE_4, 12.0, step=0.002)
    coarse = simulate(journey, TABLE_4, 12.0, step=0.1)
    np.testing.assert_allclose(coarse.q, fine.q[::50], atol=1e-11)
    np.testing.assert_allclose(coarse.f1, fine.f1[::50], atol=1e-5)


def energy(system: CoupledSystem, r: ClosedLoopResult) -> Array:
    y, rate = np.hstack([r.q, r.beta]), np.hstack([r.q_rate, r.beta_rate])
    kinetic = np.einsum('ti,ij,tj->t', rate, system.mass, rate)
    potential = np.einsum('ti,ij,tj->t', y, system.stiffness, y)
    return np.asarray(kinetic + potential) / 2.0


START = np.array([0.02, -0.01, 0.03, 0.01, 0.1, 0.0, 0.0, 0.0, 0.0, 0.2])


UNDAMPED = replace(CORRECTED, axle_damping=0.0, hitch_damping=0.0)
NEAR_PITCH = replace(TABLE_4, omega=np.array([3.8]))  # where the semitrailer pitches


def flipped(parameters: TruckParameters, modes: LiquidModes) -> CoupledSystem:
    """Turn the sign of g lambda_1 beta on the tank, but not of its reaction on the mode."""
    system = CoupledSystem.of(Truck(parameters), modes, parameters.liquid_origin)
    stiffness = system.stiffness.copy()
    stiffness[3, 4] *= -1.0
    return replace(system, stiffness=stiffness)


@pytest.mark.parametrize('modes', [TABLE_4, NEAR_PITCH], ids=['Table 4', 'near pitch'])
def test_undamped_coupled_system_conserves_energy(modes: LiquidModes) -> None:
    truck = Truck(UNDAMPED)
    r = simulate(Journey(truck, COASTING, Bump(0.0)), modes, 60.0, 0.01, initial=START)
    e = energy(CoupledSystem.of(truck, modes, UNDAMPED.liquid_origin), r)
    np.testing.assert_allclose(e, e[0], rtol=1e-8)


def test_flipped_sign_of_the_liquids_weight_on_the_tank_blows_up() -> None:
    system = flipped(UNDAMPED, NEAR_PITCH)
    a, b = system.state_matrices()
    x = Propagator(a, b, 0).step(START, np.zeros((1, 5)), 60.0)
    first, last = (
        s[5:] @ system.mass @ s[5:] + system.stiffness.diagonal() @ s[:5] ** 2 for s in (START, x)
    )
    assert last > 1e4 * first


def test_flipped_sign_of_the_liquids_weight_lets_the_dampers_feed_the_slosh() -> None:
    # Table 4's mode is too slow to flutter, but it grows, while the true sign decays
    system = CoupledSystem.of(Truck(CORRECTED), TABLE_4, CORRECTED.liquid_origin)
    assert system.poles()[0, 1] == pytest.approx(0.0030, abs=5e-5)
    assert flipped(CORRECTED, TABLE_4).poles()[0, 1] < -1e-3


def test_dampers_take_the_energy_that_is_lost() -> None:
    truck = Truck(CORRECTED)
    modes = replace(TABLE_4, damping_ratio=np.array([0.05]))
    r = simulate(Journey(truck, COASTING, Bump(0.0)), modes, 5.0, initial=START)
    system = CoupledSystem.of(truck, modes, CORRECTED.liquid_origin)
    e = energy(system, r)
    rate = np.hstack([r.q_rate, r.beta_rate])
    power = np.einsum('ti,ij,tj->t', rate, system.damping, rate)
    lost = np.append(0.0, np.cumsum((power[1:] + power[:-1]) / 2.0 * np.diff(r.time)))
    assert lost[-1] > 0.4 * e[0]
    np.testing.assert_allclose(e + lost, e[0], rtol=1e-4)


def test_damping_ratio_is_the_decay_rate_of_a_mode_in_a_tank_held_still() -> None:
    rigid = replace(CORRECTED, axle_stiffness=5e11, hitch_stiffness=5e11)
    modes = replace(TABLE_4, damping_ratio=np.array([0.03]))
    system = CoupledSystem.of(Truck(rigid), modes, rigid.liquid_origin)
    np.testing.assert_allclose(system.poles()[0], [0.675, 0.03], rtol=1e-5)


def test_split_of_a_mode_into_two_halves_changes_no_load() -> None:
    # two modes with the same frequency and half of lambda^2 / mu each
    half = LiquidModes(
        omega=np.repeat(TABLE_4.omega, 2),
        mu=np.repeat(2.0 * TABLE_4.mu, 2),
        coupling=np.repeat(TABLE_4.coupling, 2, axis=0),
        damping_ratio=np.zeros(2),
    )
    r = simulate(Journey(Truck(CORRECTED), BRAKING, Bump(0.2)), half, WINDOW)
    np.testing.assert_allclose(r.slosh, braking('nominal', 0.2).slosh, atol=1e-3)
    np.testing.assert_allclose(r.beta.sum(axis=1), braking('nominal', 0.2).beta[:, 0], atol=1e-9)


def test_lateral_modes_stay_at_rest() -> None:
    lateral = LiquidModes(
        omega=np.array([0.675, 3.4383]),
        mu=np.array([300440.0, 12479.0]),
        coupling=np.vstack([TABLE_4.coupling, [[0.0, 14059.9, 0.0, 11667.0, 0.0, 0.0]]]),
        damping_ratio=np.zeros(2),
    )
    r = simulate(Journey(Truck(CORRECTED), BRAKING, Bump(0.2)), lateral, WINDOW)
    assert np.all(r.beta[:, 1] == 0.0)
    np.testing.assert_allclose(r.f1, braking('nominal', 0.2).f1, atol=1e-6)


def test_two_runs_are_equal_bit_for_bit() -> None:
    runs = [
        simulate(Journey(Truck(CORRECTED), BRAKING, Bump(0.2)), TABLE_4, 12.0) for _ in range(2)
    ]
    assert runs[0].q.tobytes() == runs[1].q.tobytes()
    assert runs[0].slosh.tobytes() == runs[1].slosh.tobytes()


def test_printed_equations_grow_beyond_any_truck() -> None:
    truck = Truck(TruckParameters.paper_as_printed())
    r = simulate(Journey(truck, BRAKING, Bump(0.2)), TABLE_4, WINDOW)
    assert np.abs(r.f1).max() > 1e9  # a million kN


@pytest.mark.parametrize(('duration', 'step'), [(1.0, 2.0), (1.0, 0.0), (np.inf, 0.1)])
def test_impossible_spacing_of_the_result_is_refused(duration: float, step: float) -> None:
    journey = Journey(Truck(CORRECTED), BRAKING, Bump(0.0))
    with pytest.raises(ValueError, match='0 < step <= duration'):
        simulate(journey, TABLE_4, duration, step)
