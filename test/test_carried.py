"""What a vehicle's simulator is told of its liquid: coupling, inertia correction, softening."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import REPOSITORY
from drives import RECTANGLE, G, engine_of, feed, stamps, wrenches
from test_engine import engine_with

from slosh_ros.engine import SloshConfig, SloshEngine
from slosh_ros.engine.kinematics import Pose
from slosh_ros.vehicle import RigidCargo, SloshingCargo, TankLiquid
from slosh_ros.vehicle.scenario import Scenario

Array = np.ndarray

DENSITY, LENGTH, WIDTH, DEPTH = 850.0, 8.0, 2.0, 0.8  # of drives.RECTANGLE
HEIGHT = 1.6  # of the tank
SCENARIOS = REPOSITORY / 'config' / 'scenarios'
TURN = [0.1, -0.2, 0.7]
PLACE = [1.5, -0.4, 0.9]


def closed_form() -> tuple[Array, Array]:
    """Frozen and Stokes-Joukowski inertia of the rectangle about O, THEORY 3 [kg m^2]."""
    rho, L, B, d = DENSITY, LENGTH, WIDTH, DEPTH
    m = rho * L * B * d
    odd = np.arange(1, 400, 2)

    def series(side: float, over: float) -> float:
        return float(np.sum(np.tanh(odd * np.pi * side / (2.0 * over)) / odd**5))

    frozen = m / 12.0 * np.array([B**2 + 4.0 * d**2, L**2 + 4.0 * d**2, L**2 + B**2])
    tail = 64.0 / np.pi**5
    lid = [
        rho * L * (d * B**3 / 12.0 + tail * d**4 * series(B, d)),
        rho * B * (d * L**3 / 12.0 + tail * d**4 * series(L, d)),
        rho * d * (B * L**3 / 12.0 - L * B**3 / 4.0 + tail * B**4 * series(L, B)),
    ]
    return np.diag(frozen), np.diag(lid)


def test_closed_form_is_the_published_one():
    frozen, lid = (np.diag(m) for m in closed_form())
    np.testing.assert_allclose(frozen, [5948.0, 60348.0, 61653.0], rtol=1e-4)
    np.testing.assert_allclose(lid, [4211.35, 58172.95, 49432.35], rtol=2e-6)


def test_exact_coupling_adds_the_inertia_that_a_frozen_liquid_has_too_much():
    """A pure moment per angular acceleration: turned with the tank, the same at every point."""
    frozen, lid = closed_form()
    turn = Pose.from_xyz_rpy(np.zeros(3), np.array(TURN)).rotation
    expected = np.zeros((6, 6))
    expected[3:, 3:] = turn @ (frozen - lid) @ turn.T
    for place in ([0.0, 0.0, 0.0], PLACE):
        carried = engine_of(tank__xyz=place, tank__rpy=TURN).carried
        added = carried.coupling_exact - carried.coupling
        np.testing.assert_allclose(added, expected, rtol=1e-8, atol=1e-6)
    in_tank = engine_of(tank__xyz=PLACE, tank__rpy=TURN, frames__output='tank_link').carried
    np.testing.assert_allclose(in_tank.relief[3:, 3:], frozen - lid, rtol=1e-8, atol=1e-6)


def test_several_tanks_add():
    front = {f'front.{key.removeprefix("tank.")}': v for key, v in RECTANGLE.items()}
    rear = {f'rear.{key.removeprefix("tank.")}': v for key, v in RECTANGLE.items()}
    places = {'front.xyz': PLACE, 'front.rpy': TURN, 'rear.xyz': [-4.0, 0.0, 1.0]}
    both = SloshEngine(
        SloshConfig.from_parameters(front | rear | places | {'tanks': ['front', 'rear']})
    ).carried
    one = engine_of(tank__xyz=PLACE, tank__rpy=TURN).carried
    other = engine_of(tank__xyz=[-4.0, 0.0, 1.0]).carried
    for name in ('coupling', 'coupling_exact', 'inertia'):
        total = getattr(one, name) + getattr(other, name)
        np.testing.assert_allclose(getattr(both, name), total, rtol=1e-12, atol=1e-9)
    assert both.mass == pytest.approx(2.0 * DENSITY * LENGTH * WIDTH * DEPTH)


def test_frozen_liquid_is_the_cuboid_turned_about_its_centroid():
    carried = engine_of(tank__xyz=PLACE, tank__rpy=TURN).carried
    pose = Pose.from_xyz_rpy(np.array(PLACE), np.array(TURN))
    depth_below = -(HEIGHT - DEPTH) / 2.0
    centroid = pose.origin + pose.rotation @ [0.0, 0.0, depth_below]
    np.testing.assert_allclose(carried.centroid, centroid, atol=1e-12)
    sides = np.array([LENGTH, WIDTH, DEPTH]) ** 2
    own = np.diag(carried.mass / 12.0 * (sides.sum() - sides))
    turned = pose.rotation @ own @ pose.rotation.T
    np.testing.assert_allclose(carried.inertia_at_centroid, turned, rtol=1e-9, atol=1e-6)


@pytest.mark.parametrize('yaw', [0.0, 0.6])
@pytest.mark.parametrize('make', [engine_of, engine_with])
def test_softening_is_the_static_moment_of_a_tilted_vehicle(make, yaw):
    """The liquid of a vehicle that leans for long pushes it further, by H times the angles."""
    roll, pitch = 0.01, -0.02
    engine = make(tank__damping_ratio=0.3, tank__modes=6, tank__rpy=[0.0, 0.0, yaw])
    force = (-G * pitch, G * roll, G)  # first order in the angles
    moment = wrenches(feed(engine, stamps(150.0, 0.05), force))[-1]
    expected = engine.softening @ [0.0, 0.0, 0.0, roll, pitch, 0.0]
    np.testing.assert_allclose(moment, expected, rtol=1e-8, atol=1e-5)
    assert expected[3] > 0.0 > expected[4]


def test_softening_of_all_modes_is_the_second_moment_of_the_surface():
    """Parseval: rho g I_xx about y, rho g I_yy about x."""
    modes = 60
    softening = engine_of(tank__modes=modes).softening
    about_y = DENSITY * G * WIDTH * LENGTH**3 / 12.0
    about_x = DENSITY * G * LENGTH * WIDTH**3 / 12.0
    assert softening[4, 4] == pytest.approx(about_y, rel=2e-3)
    assert softening[3, 3] == pytest.approx(about_x, rel=2e-3)
    assert softening[4, 4] < about_y
    assert softening[3, 3] < about_x


def test_tanker_of_section_5_is_the_cargo_of_both_trucks():
    half_full = {
        'tank.shape': 'cylinder_x',
        'tank.radius': 1.125,
        'tank.length': 14.0,
        'tank.fill_ratio': 0.5,
        'tank.xyz': [0.0, 0.0, 1.12746],
    }
    carried = SloshEngine(SloshConfig.from_parameters(half_full)).carried
    cargo = RigidCargo.half_full()
    assert carried.mass == pytest.approx(cargo.mass, rel=1e-5)
    np.testing.assert_allclose(carried.centroid, cargo.centroid, atol=1e-5)
    np.testing.assert_allclose(carried.inertia_at_centroid, cargo.inertia, rtol=5e-5, atol=1e-6)


def test_engine_and_monolithic_truck_know_the_same_liquid():
    """Two ways to the same matrices: moved loads here, moved coupling coefficients there."""
    engine = engine_of(tank__xyz=PLACE, tank__rpy=[0.0, 0.0, 0.7])
    (model,) = engine.tanks
    pose = model.config.pose
    cargo = SloshingCargo.of(
        TankLiquid.of(model.coefficients, model.damping_ratio, pose.origin, pose.rotation)
    )
    np.testing.assert_allclose(engine.carried.coupling_exact, cargo.coupling, rtol=1e-9, atol=1e-6)
    softening = cargo.modes.softening
    np.testing.assert_allclose(engine.softening, softening, rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(engine.surface_centre, cargo.reference, rtol=1e-12)


@pytest.mark.parametrize('path', sorted(SCENARIOS.glob('*.yaml')), ids=lambda p: p.stem)
def test_every_scenario_of_the_library_may_drive_with_its_tanks(path):
    """Both nodes read the same file, as closed_loop.launch.py gives it to them."""
    scenario, engine = Scenario.from_file(path), SloshEngine(SloshConfig.from_file(path))
    carried = engine.carried
    scenario.simulator().check_coupling(carried.coupling_exact, engine.softening)
    inertia = tuple(tuple(row) for row in carried.inertia_at_centroid.tolist())
    centroid = tuple(carried.centroid.tolist())
    scenario.check_liquid(RigidCargo(carried.mass, centroid, inertia))
    assert engine.config.imu_frame == 'base_link'
    assert 'reliability: reliable' in path.read_text()  # in lock-step no sample may be lost
