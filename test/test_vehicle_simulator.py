"""The truck stepped with the liquid's state wrench from outside meets the one-system solution."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.vehicle import (
    TABLE_4,
    Bump,
    ClosedLoopResult,
    CoupledSystem,
    Journey,
    LiquidModes,
    Manoeuvre,
    Truck,
    TruckParameters,
    TruckSimulator,
    simulate,
)
from slosh_ros.vehicle.lti import Propagator

Array = NDArray[np.float64]

CORRECTED = TruckParameters.corrected()
TRUCK = Truck(CORRECTED)
BRAKING = Manoeuvre.braking(10.0, 0.98)
MILLISECOND = 1_000_000
NOTHING = np.zeros(6)
VERTICAL = [0, 1, 3, 4]  # z_t, theta_t, z_s, theta_s among the deviations of any truck

LAMBDA = TABLE_4.coupling_at(CORRECTED.liquid_origin)[0]
MU, OMEGA = TABLE_4.mu[0], TABLE_4.omega[0]
COUPLING = np.outer(LAMBDA, LAMBDA) / MU


class Liquid:
    """One mode at base_link, exact for a specific force and an angular rate linear in time."""

    def __init__(self, damping_ratio: float = 0.0) -> None:
        self.resistance = 2.0 * damping_ratio * OMEGA
        # x = (beta, p), p = beta' + lambda_5 omega_y / mu + 2 zeta omega beta
        a = np.array([[-self.resistance, 1.0], [-(OMEGA**2), 0.0]])
        b = -np.array([[0.0, LAMBDA[4]], [LAMBDA[0], 0.0]]) / MU
        self.propagator = Propagator(a, b, 1)
        self.x = np.zeros(2)
        self.wrench = NOTHING

    @property
    def beta(self) -> float:
        """Modal coordinate [m]."""
        return float(self.x[0])

    def step(self, before: Array, after: Array, duration: float) -> None:
        """Move on under (s_x, omega_y) before and after."""
        inputs = np.array([before, (after - before) / duration])
        self.x = self.propagator.step(self.x, inputs, duration)
        beta_rate = self.x[1] - LAMBDA[4] * after[1] / MU - self.resistance * self.beta
        self.wrench = LAMBDA * (OMEGA**2 * self.beta + self.resistance * beta_rate)
        self.wrench = self.wrench + TABLE_4.tilt[0] * self.beta


def sequential(journey: Journey, step_ns: int, duration_ns: int) -> tuple[Array, Array]:
    """Step truck and liquid in turns, the wrench extrapolated; return theta_s and beta."""
    truck, liquid = TruckSimulator(journey, COUPLING), Liquid()
    step = step_ns * 1e-9

    def measure(wrench: Array) -> Array:
        sample = truck.imu(wrench)
        return np.array([sample.specific_force[0], sample.angular_rate[1]])

    previous, motion = NOTHING, measure(NOTHING)
    history = [(0.0, 0.0)]
    for _ in range(duration_ns // step_ns):
        present = liquid.wrench
        rate = (present - previous) / step
        truck.advance(step_ns, present, rate)
        last, motion = motion, measure(present + rate * step)
        liquid.step(last, motion, step)
        previous = present
        history.append((float(truck.q[4]), liquid.beta))
    pitch, beta = np.array(history).T
    return pitch, beta


def relative_rms(value: Array, truth: Array) -> float:
    return float(np.sqrt(np.mean((value - truth) ** 2) / np.mean(truth**2)))


def errors(journey: Journey, step_ns: int) -> Array:
    """Relative errors of theta_s and beta against the one-system solution."""
    pitch, beta = sequential(journey, step_ns, 12_000 * MILLISECOND)
    truth: ClosedLoopResult = simulate(journey, TABLE_4, 12.0, step=step_ns * 1e-9)
    return np.array([relative_rms(pitch, truth.q[:, 3]), relative_rms(beta, truth.beta[:, 0])])


def test_exchange_converges_at_second_order_on_a_flat_road() -> None:
    journey = Journey(TRUCK, BRAKING, Bump(0.0))
    found = np.array([errors(journey, n * MILLISECOND) for n in (20, 10, 5)])
    np.testing.assert_allclose(found[:-1] / found[1:], 4.0, rtol=0.1)
    assert np.all(found[1] < 5e-5)


def test_exchange_stays_accurate_over_a_bump() -> None:
    journey = Journey(TRUCK, BRAKING, Bump(0.2))
    found = np.array([errors(journey, n * MILLISECOND) for n in (20, 10, 5)])
    assert np.all(found[0] / found[2] > 4.0**1.7)
    assert np.all(found[1] < 5e-5)


def test_exchange_converges_when_the_acceleration_starts_with_a_jump() -> None:
    journey = Journey(TRUCK, Manoeuvre.accelerating(0.98), Bump(0.2))
    found = np.array([errors(journey, n * MILLISECOND) for n in (20, 5)])
    assert np.all(found[0] / found[1] > 4.0**1.7)


@pytest.mark.parametrize('step_ns', [10 * MILLISECOND, MILLISECOND])
def test_naive_exchange_of_the_total_wrench_diverges_at_any_step(step_ns: int) -> None:
    # the truck holds no liquid, and the whole wrench comes from its last acceleration
    empty = Truck(replace(CORRECTED, liquid_mass=0.0, liquid_pitch_inertia=0.0))
    truck = TruckSimulator(Journey(empty, BRAKING, Bump(0.0)))
    liquid = Liquid()
    m, d = CORRECTED.liquid_mass, CORRECTED.liquid_height
    frozen = np.zeros((6, 6))
    frozen[0, 0] = frozen[2, 2] = m
    frozen[0, 4] = frozen[4, 0] = m * d
    frozen[4, 4] = CORRECTED.liquid_pitch_inertia + m * d**2
    wrench = NOTHING
    motion, moments = np.zeros(2), []
    for _ in range(40):
        truck.advance(step_ns, wrench, NOTHING)
        sample = truck.imu(wrench)
        pitch = truck.acceleration(wrench)[4]
        felt = np.array(
            [sample.specific_force[0], 0, sample.specific_force[2] - GRAVITY, 0, pitch, 0]
        )
        last, motion = motion, np.array([felt[0], sample.angular_rate[1]])
        liquid.step(last, motion, step_ns * 1e-9)
        wrench = liquid.wrench + (COUPLING - frozen) @ felt
        moments.append(wrench[4])
    # by the pitch of the liquid over that of the empty semitrailer, M_dry^-1 (M_liquid - A)
    assert moments[-1] / moments[-2] == pytest.approx(-12.7, rel=0.08)
    assert abs(moments[-1]) > 1e40


def test_acceleration_is_that_of_the_one_system() -> None:
    journey = Journey(TRUCK, BRAKING, Bump(0.2))
    truth = simulate(journey, TABLE_4, 3.0, step=1e-3)
    state = np.hstack([truth.q, truth.beta, truth.q_rate, truth.beta_rate])[-1]
    system = CoupledSystem.of(TRUCK, TABLE_4, CORRECTED.liquid_origin)
    a, _ = system.state_matrices()
    truck = TruckSimulator(
        Journey(TRUCK, Manoeuvre.from_knots(1.0, (0,), (0,)), Bump(0.0)), COUPLING
    )
    truck._x[:4], truck._x[4:8] = state[:4], state[5:9]
    wrench = state[4] * (LAMBDA * OMEGA**2 + TABLE_4.tilt[0])
    heave, pitch = (a @ state)[[7, 8]]
    found = truck.acceleration(wrench)
    np.testing.assert_allclose(found, [0.0, 0.0, heave, 0.0, pitch, 0.0], rtol=1e-9)


def test_solid_cargo_is_exact_in_steps_of_any_length() -> None:
    journey = Journey(TRUCK, BRAKING, Bump(0.2))
    truth = simulate(journey, LiquidModes.none(), 12.0, step=0.1)
    truck = TruckSimulator(journey)
    for k in range(120):
        lengths = (100 * MILLISECOND,) if k % 2 else (37 * MILLISECOND, 63 * MILLISECOND)
        for length in lengths:
            truck.advance(length, NOTHING, NOTHING)
        np.testing.assert_allclose(truck.q[VERTICAL], truth.q[k + 1], atol=1e-11)
        np.testing.assert_allclose(
            truck.wheel_loads().sum(axis=1), truth.axle_loads[k + 1], atol=1e-4
        )
    assert truck.time_ns == 12_000 * MILLISECOND


def test_two_runs_are_equal_bit_for_bit() -> None:
    journey = Journey(TRUCK, BRAKING, Bump(0.2))
    runs = [np.array(sequential(journey, 10 * MILLISECOND, 4_000 * MILLISECOND)) for _ in '12']
    assert runs[0].tobytes() == runs[1].tobytes()


def test_imu_at_rest_reads_gravity_upwards() -> None:
    truck = TruckSimulator(Journey(TRUCK, BRAKING, Bump(0.2)), COUPLING)
    force, rate = truck.imu(NOTHING)
    np.testing.assert_array_equal(force, [0.0, 0.0, 9.81])
    np.testing.assert_array_equal(rate, 0.0)


def test_imu_feels_the_acceleration_and_the_tilt() -> None:
    # nose down: gravity pulls the proof mass forward, as braking does
    truck = TruckSimulator(Journey(TRUCK, Manoeuvre.accelerating(0.98), Bump(0.0)))
    assert truck.imu(NOTHING).specific_force[0] == pytest.approx(0.98)
    press = np.array([0.0, 0.0, 0.0, 0.0, 5e4, 0.0])
    for _ in range(300):
        truck.advance(10 * MILLISECOND, press, NOTHING)
    assert truck.q[4] > 0.0
    expected = 0.98 - GRAVITY * truck.q[4]
    assert truck.imu(press).specific_force[0] == pytest.approx(expected, rel=1e-12)


def test_mean_specific_force_is_the_mean_of_what_the_imu_reads() -> None:
    journey = Journey(TRUCK, BRAKING, Bump(0.2))
    fine, coarse = TruckSimulator(journey), TruckSimulator(journey)
    with pytest.raises(RuntimeError, match='first step'):
        _ = coarse.mean_specific_force
    for _ in range(60):  # 1 ms steps never straddle a jump by more than 2.5 %
        sums = np.zeros(3)
        coarse.advance(40 * MILLISECOND, NOTHING, NOTHING)
        for _ in range(40):
            before = fine.imu(NOTHING).specific_force
            fine.advance(MILLISECOND, NOTHING, NOTHING)
            mean = fine.mean_specific_force
            sums += mean
            if np.abs(fine.imu(NOTHING).specific_force - before).max() < 0.05:
                after = fine.imu(NOTHING).specific_force
                np.testing.assert_allclose(mean, (before + after) / 2.0, atol=2e-4)
        np.testing.assert_allclose(coarse.mean_specific_force, sums / 40.0, atol=1e-9)


def test_twist_in_body_axes_agrees_with_the_imu() -> None:
    # d(v)/dt + omega x v, turned back to the world, is the acceleration
    truck = TruckSimulator(Journey(TRUCK, Manoeuvre.accelerating(0.98), Bump(0.2)))
    step = MILLISECOND
    for _ in range(5000):
        truck.advance(step, NOTHING, NOTHING)
    before = truck.twist()
    truck.advance(step, NOTHING, NOTHING)
    middle, pitch = truck.twist(), truck.pose().pitch
    heave = truck.acceleration(NOTHING)[2]
    truck.advance(step, NOTHING, NOTHING)
    after = truck.twist()
    rate = (after.linear - before.linear) / (2e-9 * step)
    felt = rate + np.cross(middle.angular, middle.linear)
    c, s = np.cos(pitch), np.sin(pitch)
    expected = np.array([c * 0.98 - s * heave, 0.0, s * 0.98 + c * heave])
    assert abs(middle.angular[1]) > 1e-3
    np.testing.assert_allclose(felt, expected, atol=1e-4)


def test_pose_follows_the_road() -> None:
    truck = TruckSimulator(Journey(TRUCK, BRAKING, Bump(0.2)))
    np.testing.assert_allclose(truck.pose().position, [-13.094, 0.0, 1.25])
    for _ in range(150):
        truck.advance(10 * MILLISECOND, NOTHING, NOTHING)
    distance, speed, _ = BRAKING.motion(1.5)
    position, pitch = truck.pose()
    np.testing.assert_allclose(position, [distance - 13.094, 0.0, 1.25 + truck.q[3]])
    assert pitch == truck.q[4]
    assert (truck.distance, truck.speed) == (distance, speed)


def test_coupling_of_the_papers_tank_is_accepted() -> None:
    truck = TruckSimulator(Journey(TRUCK, BRAKING, Bump(0.2)))
    truck.check_coupling(COUPLING, TABLE_4.softening)
    assert TABLE_4.softening[4, 4] == pytest.approx(5.13e6, rel=2e-3)


def rigid_inertia_told_again() -> Array:
    """Give the frozen liquid's own inertia as a coupling."""
    matrix = np.zeros((6, 6))
    matrix[4, 4] = 2.0 * TRUCK.mass[3, 3]
    return matrix


@pytest.mark.parametrize(
    ('coupling', 'words'),
    [
        (np.zeros((3, 3)), '6 x 6'),
        (np.full((6, 6), np.nan), 'finite'),
        (COUPLING + np.eye(6, k=1), 'not symmetric'),
        (-COUPLING, 'negative eigenvalue'),
        (np.diag([0.0, 0.0, 1.0, 0.0, 0.0, 0.0]), 'heave'),
        (1.2 * COUPLING, 'exceeds the truck'),
        (rigid_inertia_told_again(), 'not positive definite'),
    ],
    ids=['shape', 'nan', 'asymmetric', 'sign', 'heave', 'mass', 'inertia'],
)
def test_impossible_coupling_is_refused_in_words(coupling: Array, words: str) -> None:
    truck = TruckSimulator(Journey(TRUCK, BRAKING, Bump(0.2)), COUPLING)
    truck.advance(MILLISECOND, NOTHING, NOTHING)
    before = truck.acceleration(NOTHING)
    with pytest.raises(ValueError, match=words):
        truck.set_coupling(coupling)
    np.testing.assert_array_equal(truck.acceleration(NOTHING), before)


def test_truck_that_cannot_stand_up_is_refused() -> None:
    soft = Truck(replace(CORRECTED, hitch_stiffness=4.1e4))
    truck = TruckSimulator(Journey(soft, BRAKING, Bump(0.2)), COUPLING)
    with pytest.raises(ValueError, match=r'takes 1\.0\d+ times the stiffness'):
        truck.check_coupling(COUPLING, TABLE_4.softening)
    firm = Truck(replace(CORRECTED, hitch_stiffness=4.3e4))
    truck = TruckSimulator(Journey(firm, BRAKING, Bump(0.2)), COUPLING)
    truck.check_coupling(COUPLING, TABLE_4.softening)


def test_truck_too_soft_for_its_frozen_cargo_is_refused() -> None:
    limp = Truck(replace(CORRECTED, axle_stiffness=1e3, hitch_stiffness=1e3))
    truck = TruckSimulator(Journey(limp, BRAKING, Bump(0.2)))
    with pytest.raises(ValueError, match='even with its cargo frozen'):
        truck.check_coupling(np.zeros((6, 6)), np.zeros((6, 6)))


def test_step_backwards_is_refused() -> None:
    truck = TruckSimulator(Journey(TRUCK, BRAKING, Bump(0.2)))
    with pytest.raises(ValueError, match='longer than 0'):
        truck.advance(0, NOTHING, NOTHING)
