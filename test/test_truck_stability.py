"""Load transfer, lift-off, warnings: returned as data."""

from __future__ import annotations

import numpy as np
import pytest
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
from slosh_ros.vehicle import (
    Bump,
    Drive,
    History,
    Journey,
    LoadTransfer,
    SloshingCargo,
    SteeringKnots,
    TankLiquid,
    Thresholds,
    load_transfer_ratio,
    simulate,
    simulate_general,
)
from slosh_ros.vehicle.history import columns_of
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
    assert set(kinds) == {'contact', 'wave'}
    assert kinds['wave'].worst == pytest.approx(2.4 / 1.125, rel=0.02)
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
    loads, wave = np.ones((3, 4, 2)), np.zeros(3)
    (warning,) = warnings_of(time, loads, wave, np.array([0.0, -0.5, 0.1]))
    assert (warning.kind, warning.first, warning.worst) == ('articulation', 1.0, 0.5)


def test_thresholds_stand_side_by_side() -> None:
    t = Thresholds.of(TRUCK, LIQUID)
    assert t.rigid_liquid < t.rigid_frozen
    assert t.liquid < t.frozen < t.rigid_frozen
    assert t.lift_off_liquid < t.liquid
    same = Thresholds.of(TRUCK, SOLID)
    assert same.rigid_liquid == same.rigid_frozen
    assert same.liquid == same.frozen


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
