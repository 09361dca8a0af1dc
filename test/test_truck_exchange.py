"""The general truck stepped with the liquid's state wrench meets the one-system solution."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from test_truck_general import TANK, TRUCK

from slosh_ros.constants import GRAVITY
from slosh_ros.vehicle import Bump, Manoeuvre, TruckParameters, TruckSimulator
from slosh_ros.vehicle.cargo import SloshingCargo
from slosh_ros.vehicle.dynamics import Drive
from slosh_ros.vehicle.general_loop import simulate_general
from slosh_ros.vehicle.general_simulator import GeneralSimulator
from slosh_ros.vehicle.general_truck import GeneralParameters, GeneralTruck
from slosh_ros.vehicle.journey import Journey
from slosh_ros.vehicle.lti import Propagator
from slosh_ros.vehicle.road import Road
from slosh_ros.vehicle.stability import load_transfer_ratio
from slosh_ros.vehicle.steering import SineSteering, SteeringKnots
from slosh_ros.vehicle.truck import Truck

Array = NDArray[np.float64]

MILLISECOND = 1_000_000
NOTHING = np.zeros(6)
CARGO = SloshingCargo.of(TANK)
BRAKING = Manoeuvre.braking(15.0, 1.5)
CRUISING = Manoeuvre.from_knots(15.0, (0.0,), (0.0,))


class Liquid:
    """All modes at base_link, exact for specific force and angular rate linear in time."""

    def __init__(self, cargo: SloshingCargo) -> None:
        m = cargo.modes
        n = len(m.omega)
        self.cargo, self.n = cargo, n
        self.resistance = 2.0 * m.damping_ratio * m.omega
        self.turned = m.coupling[:, 3:] / m.mu[:, np.newaxis]
        # x = (beta, p), p = beta' + 2 zeta omega beta + lambda_4..6 . omega / mu
        a, b = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 6))
        a[:n, :n], a[:n, n:] = -np.diag(self.resistance), np.eye(n)
        a[n:, :n] = -np.diag(m.omega**2)
        b[:n, 3:], b[n:, :3] = -self.turned, -m.coupling[:, :3] / m.mu[:, np.newaxis]
        self.propagator = Propagator(a, b, 1)
        self.x = np.zeros(2 * n)

    def step(self, before: Array, after: Array, duration: float) -> Array:
        """Move on under (s, omega) before and after; return the state wrench."""
        inputs = np.array([before, (after - before) / duration])
        self.x = self.propagator.step(self.x, inputs, duration)
        beta = self.x[: self.n]
        rate = self.x[self.n :] - self.resistance * beta - self.turned @ after[3:]
        return self.cargo.state_wrench(beta, rate)


def sequential(drive: Drive, step_ns: int, duration: float, cargo: SloshingCargo = CARGO) -> Array:
    """Step truck and liquid in turns, the wrench extrapolated; return (q, beta) over time."""
    truck, liquid = GeneralSimulator(drive, cargo.coupling), Liquid(cargo)
    step = step_ns * 1e-9

    def measure(wrench: Array) -> Array:
        sample = truck.imu(wrench)
        return np.concatenate([sample.specific_force, sample.angular_rate])

    present = previous = NOTHING
    motion = measure(NOTHING)
    motion[2] = GRAVITY
    history = [np.zeros(6 + liquid.n)]
    for _ in range(round(duration / step)):
        rate = (present - previous) / step
        truck.advance(step_ns, present, rate)
        last, motion = motion, measure(present + rate * step)
        previous, present = present, liquid.step(last, motion, step)
        history.append(np.concatenate([truck.q, liquid.x[: liquid.n]]))
    return np.array(history)


def errors(drive: Drive, step_ns: int, duration: float) -> Array:
    """Relative rms errors of those of (q, beta) that move at all."""
    found = sequential(drive, step_ns, duration)
    truth = simulate_general(drive, CARGO, duration, step_ns * 1e-9)
    exact = np.hstack([truth.q, truth.beta])
    size = np.sqrt(np.mean(exact**2, axis=0))
    moving = size > 1e-5
    return np.sqrt(np.mean((found - exact) ** 2, axis=0))[moving] / size[moving]


@pytest.mark.parametrize(
    'drive',
    [
        Drive(TRUCK, BRAKING),
        Drive(TRUCK, CRUISING, SineSteering(0.04, 0.4, 0.0)),
        Drive(TRUCK, BRAKING, SineSteering(0.02, 0.2, 0.0)),
        Drive(TRUCK, BRAKING, control='force'),
    ],
    ids=['braking', 'lane change', 'braking in a bend', 'brake force'],
)
def test_exchange_converges_at_second_order_in_all_directions(drive: Drive) -> None:
    found = [errors(drive, n * MILLISECOND, 4.0) for n in (20, 10, 5)]
    assert np.all(found[1] < 2e-3)
    order = np.log2(np.linalg.norm(found[0]) / np.linalg.norm(found[2])) / 2.0
    assert order > 1.8


def test_exchange_over_a_one_sided_bump_stays_accurate() -> None:
    drive = Drive(TRUCK, CRUISING, road=Road(Bump(0.1), Bump(0.0)))
    coarse, fine = (errors(drive, n * MILLISECOND, 4.0) for n in (20, 5))
    assert np.linalg.norm(coarse) > 4.0 * np.linalg.norm(fine)
    assert np.all(fine < 1e-2)


def test_solid_cargo_steps_as_one_system() -> None:
    drive = Drive(TRUCK, BRAKING, SineSteering(0.03), Road(Bump(0.1), Bump(0.05)))
    truth = simulate_general(drive, SloshingCargo.none(), 6.0, 0.05)
    truck = GeneralSimulator(drive)
    for k in range(1, 121):
        truck.advance(50 * MILLISECOND, NOTHING, NOTHING)
        np.testing.assert_allclose(truck.q, truth.q[k], atol=1e-10)
        np.testing.assert_allclose(truck.wheel_loads(), truth.wheel_loads[k], atol=1e-4)
        assert truck.speed == pytest.approx(truth.speed[k])
        assert load_transfer_ratio(truck.wheel_loads()) == pytest.approx(
            truth.transfer.vehicle[k], abs=1e-9
        )
    assert truck.time_ns == 6_000 * MILLISECOND


def test_stepped_truck_is_the_four_dof_truck_in_the_plane() -> None:
    level = GeneralTruck(GeneralParameters().paper())
    braking = Manoeuvre.braking(10.0, 0.98)
    flat = Truck(TruckParameters.corrected())
    paper = TruckSimulator(Journey(flat, braking, Bump(0.2)))
    general = GeneralSimulator(Drive(level, braking, road=Road.even(Bump(0.2))))
    wrench = np.array([3e3, 0.0, 0.0, 0.0, 5e4, 0.0])
    coupling = np.zeros((6, 6))
    coupling[np.ix_([0, 4], [0, 4])] = [[2e4, -1e4], [-1e4, 3e4]]
    paper.set_coupling(coupling)
    general.set_coupling(coupling)
    for _ in range(50):
        for truck in (paper, general):
            truck.advance(100 * MILLISECOND, wrench, -wrench)
        np.testing.assert_allclose(general.q, paper.q, atol=1e-9)
        np.testing.assert_allclose(general.wheel_loads(), paper.wheel_loads(), atol=1e-3)
        for one, other in zip(general.imu(wrench), paper.imu(wrench), strict=True):
            np.testing.assert_allclose(one, other, atol=1e-7)
        assert general.distance == pytest.approx(paper.distance)
    np.testing.assert_allclose(general.q[[2, 5]], 0.0, atol=1e-15)


def test_imu_in_a_steady_turn_feels_the_turn_and_the_lean() -> None:
    truck = GeneralSimulator(Drive(TRUCK, CRUISING, SteeringKnots.step(0.03)))
    truck.advance(20_000 * MILLISECOND, NOTHING, NOTHING)
    force, rate = truck.imu(NOTHING)
    assert force[1] == pytest.approx(15.0 * rate[2] + GRAVITY * truck.q[5], rel=1e-6)
    assert rate[2] > 0.0
    assert truck.q[5] > 0.0


def test_twist_and_pose_agree() -> None:
    truck = GeneralSimulator(Drive(TRUCK, CRUISING, SineSteering(0.02)))
    truck.advance(2_000 * MILLISECOND, NOTHING, NOTHING)
    before = truck.pose()
    truck.advance(MILLISECOND, NOTHING, NOTHING)
    velocity = truck.twist().linear
    middle = truck.pose()
    truck.advance(MILLISECOND, NOTHING, NOTHING)
    ground = (truck.pose().position - before.position) / 2e-3
    c, s = np.cos(middle.yaw), np.sin(middle.yaw)
    expected = np.array([c * velocity[0] - s * velocity[1], s * velocity[0] + c * velocity[1]])
    # base_link is not on the roll axis, which the pose on the ground leaves out
    np.testing.assert_allclose(ground[:2], expected, atol=0.03)


def test_coupling_with_the_rigid_inertia_is_refused() -> None:
    truck = GeneralSimulator(Drive(TRUCK, BRAKING))
    truck.check_coupling(CARGO.coupling, CARGO.modes.softening)
    wrong = CARGO.coupling + np.diag([0.0, 0.0, 0.0, 0.0, 2e6, 0.0])
    with pytest.raises(ValueError, match='not positive definite'):
        truck.set_coupling(wrong)
    with pytest.raises(ValueError, match='cannot stand up'):
        truck.check_coupling(CARGO.coupling, np.diag([0.0, 0.0, 0.0, 3e6, 0.0, 0.0]))
    with pytest.raises(ValueError, match='exceeds the truck'):
        truck.set_coupling(2.0 * CARGO.coupling)
    with pytest.raises(ValueError, match='longer than 0'):
        truck.advance(0, NOTHING, NOTHING)


def test_state_wrench_of_a_liquid_at_rest_is_zero_whatever_the_acceleration() -> None:
    n = len(CARGO.modes.omega)
    np.testing.assert_array_equal(CARGO.state_wrench(np.zeros(n), np.zeros(n)), 0.0)
