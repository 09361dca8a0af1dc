"""Load transfer, lift-off, warnings: returned as data."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import REPOSITORY
from test_truck_general import (
    BRAKING,
    CRUISING,
    FLAT_TRUCK,
    LIQUID,
    PAPER_TRUCK,
    SOLID,
    TANK,
    TRUCK,
)

from slosh_ros.constants import GRAVITY
from slosh_ros.engine import SloshConfig, SloshEngine
from slosh_ros.hydro import coefficients_of
from slosh_ros.modal.validity import UNMOVED, Criterion, Trust
from slosh_ros.study.rollover import imu_samples
from slosh_ros.study.tanks import liquids_of
from slosh_ros.tank import Tank, cylinder_x, cylinder_z, rectangular
from slosh_ros.vehicle import (
    Bump,
    Drive,
    GeneralTruck,
    History,
    Journey,
    LiquidModes,
    LoadTransfer,
    Manoeuvre,
    RigidCargo,
    Road,
    SloshingCargo,
    StabilityFigures,
    SteeringKnots,
    TankLiquid,
    Thresholds,
    load_transfer_ratio,
    rigid_threshold,
    simulate,
    simulate_general,
)
from slosh_ros.vehicle.history import columns_of
from slosh_ros.vehicle.scenario import Scenario
from slosh_ros.vehicle.stability import WHEELS, StabilityWatch, warnings_of

PAPER_LIQUID = SloshingCargo.of(TankLiquid.paper(FLAT_TRUCK.parameters.liquid_origin))


def test_load_transfer_ratio_is_one_when_a_side_carries_nothing() -> None:
    even = np.full((4, 2), 1e4)
    assert load_transfer_ratio(even) == 0.0
    tipped = even * [0.0, 1.0]
    assert load_transfer_ratio(tipped) == 1.0
    assert load_transfer_ratio(tipped[:, ::-1]) == -1.0
    half = np.array([[[1.0, 3.0], [2.0, 2.0], [0.0, 4.0], [2.0, 2.0]]])
    transfer = LoadTransfer.of(half)
    assert transfer.vehicle[0] == pytest.approx(6.0 / 16.0)
    assert transfer.tractor[0] == pytest.approx(2.0 / 8.0)
    assert transfer.semitrailer[0] == pytest.approx(4.0 / 8.0)
    np.testing.assert_allclose(transfer.axles[0], [0.5, 0.0, 1.0, 0.0])


def test_wheel_loads_sum_to_the_weight_and_the_vertical_inertia() -> None:
    cargo = SloshingCargo.of(TANK)
    r = simulate_general(Drive(TRUCK, CRUISING, SteeringKnots.step(0.03, 0.5)), cargo, 4.0)
    p = TRUCK.parameters
    lifted = p.tractor_mass * r.q_acceleration[:, 0]
    lifted = lifted + (p.semitrailer_mass + TRUCK.cargo.mass) * r.q_acceleration[:, 3]
    weight = GRAVITY * TRUCK.total_mass
    np.testing.assert_allclose(r.wheel_loads.sum(axis=(1, 2)), weight + lifted, rtol=1e-9)


def test_loads_under_braking_balance_the_moments_about_the_road() -> None:
    r = simulate_general(Drive(TRUCK, BRAKING), SOLID, 11.2)
    p, c = TRUCK.parameters, TRUCK.cargo
    added = r.wheel_loads.sum(axis=2) - TRUCK.static_wheel_loads.sum(axis=1)
    ahead = -p.wheel_offsets  # of axle 1
    s = -(p.l_w1 + p.l_bt + p.l_bs)
    bodies = (  # mass, about y, place, height, its heave and pitch
        (p.tractor_mass, p.tractor_inertia[1], -p.l_w1, p.tractor_height, 0),
        (p.semitrailer_mass, p.semitrailer_inertia[1], s, p.semitrailer_height, 3),
        (c.mass, c.inertia[1][1], s, p.semitrailer_height + c.centroid[2], 3),
    )
    spin = np.zeros_like(r.time)
    for mass, inertia, x, height, k in bodies:
        heave, pitch = r.q_acceleration[:, k], r.q_acceleration[:, k + 1]
        surge = r.acceleration[:, 0] + (height - p.hitch_height) * pitch
        spin += inertia * pitch + mass * (height * surge - x * heave)
    leaning = GRAVITY * c.mass * c.centroid[2] * r.q[:, 4]
    np.testing.assert_allclose(leaning - added @ ahead, spin, atol=1e-4 * np.abs(spin).max())
    assert added[:, 0].max() > 3e3  # the front axle takes load


def test_papers_own_case_is_warned_about() -> None:
    r = simulate_general(Drive(PAPER_TRUCK, BRAKING), PAPER_LIQUID, 11.2)
    kinds = {w.kind: w for w in r.warnings}
    assert set(kinds) == {'contact', 'liquid'}
    wave = next(w for w in r.warnings if w.where == Criterion.WAVE.value)
    assert wave.worst == pytest.approx(2.4 / 1.125, rel=0.02)
    assert wave.limit == 0.3  # shallow
    where = {w.where: w for w in r.warnings if w.kind == 'contact'}
    assert set(where) == {'4l', '4r'}
    assert where['4l'].worst == pytest.approx(-47e3 / 2.0, rel=0.01)
    assert r.wheel_loads[round(where['4l'].first / 0.01), 3, 0] < 0.0
    assert r.wheel_loads[round(where['4l'].first / 0.01) - 1, 3, 0] >= 0.0
    assert 0.0 < where['4l'].share < 1.0
    assert r.figures.lift_off == where['4l'].first
    assert r.lift_off[:, 3].any()


def test_mild_drive_warns_of_nothing() -> None:
    mild = Drive(TRUCK, CRUISING, SteeringKnots.step(0.01))
    r = simulate_general(mild, SloshingCargo.of(TANK), 5.0)
    assert r.warnings == ()
    assert r.figures.lift_off == np.inf


def test_sharp_articulation_is_warned_about() -> None:
    time = np.arange(3.0)
    loads = np.ones((3, 4, 2))
    (warning,) = warnings_of(time, loads, [UNMOVED] * 3, np.array([0.0, -0.5, 0.1]))
    assert (warning.kind, warning.first, warning.worst) == ('articulation', 1.0, 0.5)


def test_thresholds_stand_side_by_side() -> None:
    t = Thresholds.of(TRUCK, LIQUID)
    assert t.rigid_liquid < t.rigid_frozen
    assert t.liquid < t.frozen < t.rigid_frozen
    assert t.lift_off_liquid < t.liquid
    same = Thresholds.of(TRUCK, SOLID)
    assert same.rigid_liquid == same.rigid_frozen
    assert same.liquid == same.frozen


def test_hydrostatic_moments_are_all_that_the_thresholds_need() -> None:
    settled = SloshingCargo.settled(LIQUID.surface_moment)
    assert settled.surface_moment == pytest.approx(LIQUID.surface_moment)
    found, exact = Thresholds.of(TRUCK, settled), Thresholds.of(TRUCK, LIQUID)
    assert vars(found) == pytest.approx(vars(exact), rel=1e-9)


def test_first_wheel_lifts_off_where_the_steady_turn_says() -> None:
    ramp = Drive(TRUCK, CRUISING, SteeringKnots((0.0, 60.0), (0.0, 0.10)))
    r = simulate_general(ramp, LIQUID, 60.0, 0.05)
    at = np.interp(r.figures.lift_off, r.time, r.acceleration[:, 1])
    assert at == pytest.approx(Thresholds.of(TRUCK, LIQUID).lift_off_liquid, rel=0.01)


def test_both_trucks_present_the_same_table() -> None:
    flat = simulate(
        Journey(FLAT_TRUCK, BRAKING, Bump(0.0)), PAPER_LIQUID.modes, 5.0, 0.01, np.zeros(3)
    )
    one = History.of_paper(flat, PAPER_LIQUID, np.zeros((len(flat.time), 4))).columns
    other = simulate_general(Drive(PAPER_TRUCK, BRAKING), PAPER_LIQUID, 5.0).columns
    assert list(one) == list(other)
    assert list(one)[:5] == ['t', 'u', 'ax', 'ay', 'r']
    assert list(one)[17:20] == ['elevation_max', 'ltr', 'beta_x1']
    assert list(one)[-1] == 'fz_4r'
    for name, column in one.items():
        np.testing.assert_allclose(other[name], column, atol=1e-5, err_msg=name)


def test_watch_finds_the_figures_of_the_whole_drive() -> None:
    ramp = Drive(TRUCK, CRUISING, SteeringKnots((0.0, 20.0), (0.0, 0.10)))
    r = simulate_general(ramp, LIQUID, 20.0, 0.05)
    watch = StabilityWatch()
    for i, t in enumerate(r.time.tolist()):
        transfer = watch.look(t, r.wheel_loads[i], float(r.articulation[i]))
        assert watch.ratio == transfer.vehicle == r.transfer.vehicle[i]
        np.testing.assert_array_equal(transfer.axles, r.transfer.axles[i])
        assert watch.lifted == tuple(np.array(WHEELS)[r.lift_off[i].ravel()])
        assert watch.bent == (abs(r.articulation[i]) > 0.35)
    f = r.figures
    assert watch.load_transfer == f.load_transfer
    assert watch.lowest_load == r.wheel_loads.min()
    assert np.isfinite(watch.lift_off)
    assert watch.lift_off == f.lift_off
    k = r.time.tolist().index(watch.lowest_at)
    lowest = r.wheel_loads[k].flat[WHEELS.index(watch.lowest_wheel)]
    assert lowest == watch.lowest_load


def test_columns_of_an_instant_are_those_of_the_history() -> None:
    r = simulate_general(Drive(TRUCK, BRAKING), SloshingCargo.of(TANK), 1.0)
    instant = columns_of(
        r.time[-1], r.speed[-1], r.acceleration[-1], r.yaw_rate[-1], r.q[-1], r.slosh[-1],
        r.wheel_loads[-1],
    )  # fmt: skip
    known = {k: v for k, v in r.columns.items() if not k.startswith(('beta_', 'elevation'))}
    assert list(instant) == list(known)
    for name, column in known.items():
        assert instant[name] == column[-1], name


def test_each_axle_tells_its_lowest_load_and_when_it_lifts_off() -> None:
    time = np.array([0.0, 0.5, 1.0])
    loads = np.full((3, 4, 2), 5.0)
    loads[1, 1, 0], loads[2, 1, 1], loads[2, 3, 1] = -1.0, -3.0, 2.0
    figures = StabilityFigures.of(time, loads, np.zeros((3, 6)), np.zeros(3))
    assert figures.lowest_loads == (5.0, -3.0, 5.0, 2.0)
    assert figures.lift_offs == (np.inf, 0.5, np.inf, np.inf)
    assert figures.lift_off == 0.5


@pytest.mark.parametrize('manoeuvre', [BRAKING, Manoeuvre.accelerating(0.98)])
def test_both_trucks_tell_when_their_axles_are_on_the_bump(manoeuvre: Manoeuvre) -> None:
    bump = Bump(0.2)
    exact = Journey(FLAT_TRUCK, manoeuvre, bump).contacts
    found = simulate_general(Drive(TRUCK, manoeuvre, road=Road.even(bump)), SOLID, 5.0).contacts
    for one, other in zip(found, exact, strict=True):
        assert one.axle == other.axle
        for side in ('entry', 'exit'):
            at = getattr(other, side)
            assert getattr(one, side) == (np.inf if at > 5.0 else pytest.approx(at, abs=1e-4))
    assert simulate_general(Drive(TRUCK, manoeuvre), SOLID, 1.0).contacts == ()
    flat = simulate(Journey(FLAT_TRUCK, manoeuvre, Bump(0.0)), LiquidModes.none(), 1.0, 0.01)
    none = np.zeros((len(flat.time), 4))
    assert History.of_paper(flat, SloshingCargo.none(), none).contacts == ()


def test_frozen_liquid_of_the_tank_is_the_papers_cargo() -> None:
    frozen, assumed = TANK.frozen, RigidCargo.half_full()
    assert frozen is not None
    assert frozen.mass == pytest.approx(assumed.mass, rel=1e-6)
    np.testing.assert_allclose(frozen.centroid, assumed.centroid, atol=1e-9)
    np.testing.assert_allclose(frozen.inertia, assumed.inertia, rtol=1e-4, atol=1e-6)


def test_two_bodies_are_as_one_with_their_distance_in_the_inertia() -> None:
    # a dumb-bell along a skew line: m1 m2 / (m1 + m2) d^2 about its centroid
    ends = np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 2.0]])
    parts = [
        RigidCargo.principal(m, (x, y, z), (0.0, 0.0, 0.0))
        for m, (x, y, z) in zip((2.0, 4.0), ends.tolist(), strict=True)
    ]
    joined = RigidCargo.joined(*parts)
    assert joined.mass == 6.0
    np.testing.assert_allclose(joined.centroid, [2 / 3, 4 / 3, 4 / 3])
    along = ends[1] / 3.0
    expected = 8.0 / 6.0 * 9.0 * (np.eye(3) - np.outer(along, along))
    np.testing.assert_allclose(joined.inertia, expected, atol=1e-12)


def test_each_criterion_of_linear_theory_is_told_once_with_its_worst() -> None:
    mild = UNMOVED._replace(value=0.1)
    wave, worse = Trust(Criterion.WAVE, 0.5, 0.4), Trust(Criterion.WAVE, 0.9, 0.4)
    steep = Trust(Criterion.SLOPE, 0.3, 0.25)
    found = warnings_of(
        np.arange(5.0), np.ones((5, 4, 2)), [mild, wave, steep, worse, mild], np.zeros(5)
    )
    told = [(w.kind, w.where, w.first, w.worst, w.limit, w.share) for w in found]
    assert told == [
        ('liquid', 'wave height over depth or freeboard', 1.0, 0.9, 0.4, 0.4),
        ('liquid', 'slope of the wave', 2.0, 0.3, 0.25, 0.2),
    ]


def test_simulation_judges_linear_theory_as_slosh_node_does() -> None:
    """The engine is fed with what an IMU at base_link measures in the simulated drive."""
    file = REPOSITORY / 'config' / 'scenarios' / 'lane_change.yaml'
    scenario, config = Scenario.from_file(file), SloshConfig.from_file(file)
    history = scenario.simulate(liquids_of(config))
    engine = SloshEngine(config)
    assert isinstance(scenario.plan, Drive)
    values = []
    for sample in imu_samples(history, scenario.plan.truck):
        _, loads = engine.feed(sample)
        assert loads is not None
        values.append(loads.trust)
    uses = np.array([[t.use() for t in trust] for trust in (values, history.trust)])
    np.testing.assert_allclose(uses[0], uses[1], atol=0.02 * uses.max())
    same = np.mean(
        [a.criterion is b.criterion for a, b in zip(values, history.trust, strict=True)]
    )
    assert same > 0.97
    assert uses.max() > 0.8


@pytest.mark.parametrize(
    ('shape', 'inertia'),
    [
        (rectangular(8.0, 2.4, 1.6), 8.0 * 2.4**3 / 12.0),
        (cylinder_z(1.2, 2.0), np.pi * 1.2**4 / 4.0),
        (cylinder_x(1.0, 9.0), 9.0 * 2.0**3 / 12.0),
    ],
    ids=lambda x: getattr(x, 'shape', None),
)
def test_liquid_of_any_tank_lowers_the_threshold_by_its_hydrostatic_moment(
    shape: Tank, inertia: float
) -> None:
    """In a steady turn the surface tilts: rho I_yy of the half-full tank adds to the moment."""
    c = coefficients_of(shape, shape.depth(0.5), 1000.0, 40)
    liquid = TankLiquid.of(c, np.zeros(40), np.array([0.5, 0.0, 1.0]), tank=shape)
    truck = GeneralTruck(cargo=liquid.frozen)
    solid, sloshing = (rigid_threshold(truck, x) for x in (None, SloshingCargo.of(liquid)))
    p = truck.parameters
    moment = p.tractor_mass * p.tractor_height + p.semitrailer_mass * p.semitrailer_height
    moment += liquid.frozen.mass * (p.semitrailer_height + liquid.frozen.centroid[2])
    assert solid / sloshing - 1.0 == pytest.approx(1000.0 * inertia / moment, rel=0.01)
    thresholds = Thresholds.of(truck, SloshingCargo.of(liquid))
    assert thresholds.liquid < thresholds.frozen
    drive = Drive(truck, CRUISING, SteeringKnots.step(0.02, 0.5))
    r = simulate_general(drive, SloshingCargo.of(liquid), 1.5)
    assert np.isfinite(r.slosh).all()
    assert np.abs(r.slosh[:, 1]).max() > 10.0
