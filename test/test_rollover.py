"""Rollover figures from an IMU and the sloshing wrench: by hand, simulated, recorded."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from conftest import REPOSITORY
from drives import engine_of, stamps, write_bag
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from test_bad_input import refused
from test_replay import HEAD, slosh, table

from slosh_ros.bag import MotionBag, Recording, replay
from slosh_ros.constants import GRAVITY
from slosh_ros.engine import MotionSample, SloshConfig, SloshEngine, feed_message
from slosh_ros.engine.convert import IMU
from slosh_ros.errors import InputError
from slosh_ros.modal.loads import rigid_matrix
from slosh_ros.monitor import Pairs, RolloverMonitor
from slosh_ros.study.plots import plot_rollover
from slosh_ros.study.rollover import RolloverStudy, imu_samples
from slosh_ros.vehicle import (
    Drive,
    GeneralSimulator,
    GeneralTruck,
    Manoeuvre,
    SineSteering,
    SloshingCargo,
    rigid_threshold,
    simulate_general,
)
from slosh_ros.vehicle.rollover import RollBalance, RollVehicle

SCENARIOS = REPOSITORY / 'config/scenarios'
BAG, BAG_CONFIG = REPOSITORY / 'bags/highway_drive', REPOSITORY / 'config/highway_drive.yaml'
VEHICLE_FILE = REPOSITORY / 'config/rollover.yaml'

TRUCK = GeneralTruck()
VEHICLE = RollVehicle.of(TRUCK)
EMPTY_HEIGHT = VEHICLE.base_height + VEHICLE.mass_centre[2]

# The half-full cylinder of the scenarios, by hand: R = 1.125 m, L = 14 m
RADIUS, LENGTH = 1.125, 14.0
AXIS = 1.12746  # above base_link [m]
LIQUID = 1000.0 * LENGTH * np.pi * RADIUS**2 / 2.0
CENTROID = AXIS - 4.0 * RADIUS / (3.0 * np.pi)
FROZEN = rigid_matrix(LIQUID, np.array([0.0, 0.0, CENTROID]), np.diag([4e4, 0.0, 0.0]))
SETTLED = np.zeros((6, 3))
SETTLED[3, 1] = 1000.0 * LENGTH * (2.0 * RADIUS) ** 3 / 12.0  # hydrostatic, rho I_xx
BALANCE = RollBalance(VEHICLE, FROZEN, SETTLED)
MASS = VEHICLE.mass + LIQUID
NOTHING = np.zeros(6)


def felt(lateral: float, lean: float = 0.0, roll: float = 0.0, yaw: float = 0.0) -> np.ndarray:
    """Acceleration (6,) of base_link in a left turn: leaning, speeding up in roll or yaw."""
    return np.array([0.0, lateral + GRAVITY * lean, GRAVITY, roll, 0.0, yaw])


def in_turn(lateral: float, liquid: float, pushing: float = 0.0) -> tuple[np.ndarray, float]:
    """
    Lean as far as the springs let it, the liquid acting at a height above base_link [m].

    Leaning brings weight to bear, which makes it lean further. `pushing` is a roll moment besides.
    """
    axis, lean = VEHICLE.roll_axis, 0.0
    for _ in range(200):
        side = lateral + GRAVITY * lean
        moment = VEHICLE.mass * (EMPTY_HEIGHT - axis) * side + pushing
        moment += LIQUID * (VEHICLE.base_height + liquid - axis) * side
        lean = moment / VEHICLE.roll_stiffness
    return felt(lateral, lean), lean


def ratio(balance: RollBalance, acceleration: np.ndarray, wrench: np.ndarray) -> float:
    return float(balance.judge(acceleration, wrench).load_transfer_ratio)


@lru_cache
def study(name: str) -> RolloverStudy:
    return RolloverStudy.of(SCENARIOS / f'{name}.yaml')


# ---- first principles


@pytest.mark.parametrize(('settled', 'height'), [(False, CENTROID), (True, AXIS)])
def test_steady_turn_is_the_balance_of_moments_about_the_road(settled, height):
    """Without lean. Frozen, the liquid acts at its centroid; settled, at the axis of a circle."""
    balance = RollBalance(replace(VEHICLE, roll_stiffness=1e12), FROZEN, SETTLED)
    now = felt(2.0)
    wrench = SETTLED @ now[:3] if settled else NOTHING
    moment = 2.0 * (VEHICLE.mass * EMPTY_HEIGHT + LIQUID * (VEHICLE.base_height + height))
    expected = 2.0 * moment / (MASS * GRAVITY * VEHICLE.track)
    assert ratio(balance, now, wrench) == pytest.approx(expected, rel=1e-6)
    assert ratio(balance, felt(-2.0), -wrench) == pytest.approx(-expected, rel=1e-6)


@pytest.mark.parametrize(('settled', 'height'), [(False, CENTROID), (True, AXIS)])
def test_leaning_vehicle_is_the_balance_of_moments_about_the_road(settled, height):
    """In axes of the road: inertia, and weight beside the middle, rolled about the roll axis."""
    now, lean = in_turn(1.5, height)
    about_road = sum(
        mass * (h * 1.5 + GRAVITY * (h - VEHICLE.roll_axis) * lean)
        for mass, h in ((VEHICLE.mass, EMPTY_HEIGHT), (LIQUID, VEHICLE.base_height + height))
    )
    expected = 2.0 * about_road / (MASS * GRAVITY * VEHICLE.track)
    wrench = SETTLED @ now[:3] if settled else NOTHING
    found = BALANCE.judge(now, wrench)
    assert found.load_transfer_ratio == pytest.approx(expected)
    threshold = BALANCE.threshold_liquid if settled else BALANCE.threshold_solid
    assert threshold == pytest.approx(1.5 / expected)
    if settled:
        assert found.settled == pytest.approx(expected)


def test_roll_inertia_resists():
    """Euler: about the mass centre of one rigid piece, T/2 (F_R - F_L) = m h s_y - I alpha_x."""
    mass, above, inertia, alpha, side = 2e4, 0.55, 3e4, 0.5, 1.0
    vehicle = replace(
        VEHICLE, mass=mass, mass_centre=(0.0, 0.0, above), roll_inertia=inertia, roll_axis=0.0
    )
    balance = RollBalance(vehicle, np.zeros((6, 6)), np.zeros((6, 3)))
    below = felt(side + alpha * above, roll=alpha)  # s_y of base_link, that of the centre is side
    moment = mass * (vehicle.base_height + above) * side - inertia * alpha
    assert ratio(balance, below, NOTHING) == pytest.approx(
        2.0 * moment / (mass * GRAVITY * vehicle.track)
    )


def test_yaw_acceleration_pushes_what_is_ahead():
    vehicle = replace(VEHICLE, mass_centre=(3.0, 0.0, 0.5))
    balance = RollBalance(vehicle, np.zeros((6, 6)), np.zeros((6, 3)))
    assert ratio(balance, felt(0.0, yaw=0.2), NOTHING) == pytest.approx(
        ratio(balance, felt(0.6), NOTHING)
    )


def test_sloshing_wrench_is_moved_to_the_road():
    """A force F to the right, h above the road, is worth F h about the road."""
    balance = RollBalance(replace(VEHICLE, roll_axis=0.0), FROZEN, SETTLED)
    force, above = 5e3, 1.5
    wrench = np.array([0.0, -force, 0.0, above * force, 0.0, 0.0])
    assert ratio(balance, felt(0.0), wrench) == pytest.approx(
        2.0 * force * (above + VEHICLE.base_height) / (MASS * GRAVITY * VEHICLE.track)
    )


def test_bank_of_the_road_counts_as_lateral_acceleration():
    """Parked on a bank the IMU feels g times its angle, and the wheels below carry more."""
    bank = 0.05  # left side up
    now, _ = in_turn(GRAVITY * bank, CENTROID)
    assert BALANCE.threshold_solid * ratio(BALANCE, now, NOTHING) == pytest.approx(GRAVITY * bank)


def test_margin_is_the_lateral_acceleration_that_is_left():
    """Add it, let the body lean as far as it then does: all of the load is on one side."""
    wrench = np.array([0.0, -2e3, 0.0, 1.5e4, 0.0, 0.0])
    pushing = wrench[3] + (VEHICLE.roll_axis - VEHICLE.base_height) * wrench[1]
    for side in (1.0, -1.0):
        now = BALANCE.judge(in_turn(1.2 * side, CENTROID, side * pushing)[0], side * wrench)
        assert 0.0 < now.margin < BALANCE.threshold_solid / GRAVITY
        more = side * (1.2 + float(now.margin) * GRAVITY)
        then = BALANCE.judge(in_turn(more, CENTROID, side * pushing)[0], side * wrench)
        assert then.load_transfer_ratio == pytest.approx(side)
        assert then.margin == pytest.approx(0.0, abs=1e-9)


def test_load_beside_the_middle_is_seen_at_rest():
    beside = replace(VEHICLE, mass_centre=(0.0, 0.3, VEHICLE.mass_centre[2]))  # to the left
    balance = RollBalance(beside, FROZEN, SETTLED)
    pushing = -VEHICLE.mass * GRAVITY * 0.3
    now, _ = in_turn(0.0, AXIS, pushing)
    found = balance.judge(now, SETTLED @ now[:3])
    assert found.load_transfer_ratio < 2.0 * pushing / (MASS * GRAVITY * VEHICLE.track) < -0.05
    assert found.settled == pytest.approx(found.load_transfer_ratio)


# ---- the liquid, as the engine tells it


@pytest.mark.parametrize('modes', [1, 8])
def test_engine_tells_the_liquid_frozen_and_settled(modes):
    given = {
        'shape': 'cylinder_x', 'radius': RADIUS, 'length': LENGTH, 'fill_ratio': 0.5,
        'modes': modes, 'xyz': [0.0, 0.0, AXIS],
    }  # fmt: skip
    engine = SloshEngine(
        SloshConfig.from_parameters({f'tank.{name}': value for name, value in given.items()})
    )
    at_rest = engine.rigid[:, :3] + engine.settled
    np.testing.assert_allclose(at_rest[[1, 3], 1], (FROZEN[:, :3] + SETTLED)[[1, 3], 1], rtol=1e-6)
    balance = RollBalance(VEHICLE, engine.rigid, engine.settled)
    assert balance.threshold_solid == pytest.approx(BALANCE.threshold_solid)
    assert balance.threshold_liquid == pytest.approx(BALANCE.threshold_liquid)


def test_settled_wrench_is_the_one_that_a_long_constant_turn_leads_to():
    engine = engine_of(
        tank__damping_ratio=0.5, tank__xyz=[0.3, 0.2, 0.4], tank__rpy=[0.0, 0.0, 0.5]
    )
    force = np.array([0.2, 0.3, GRAVITY])
    for k in range(4000):
        _, loads = engine.feed(MotionSample(10**9 + k * 10**7, force, np.zeros(3), np.zeros(3)))
    np.testing.assert_allclose(loads.wrench, engine.settled @ force, rtol=1e-6, atol=1e-3)
    np.testing.assert_allclose(
        loads.total - loads.wrench, engine.rigid[:, :3] @ force, rtol=1e-9, atol=1e-6
    )


# ---- the simulated truth


def test_imu_of_a_history_is_that_of_the_stepped_truck():
    drive = Drive(TRUCK, Manoeuvre.braking(15.0, 1.5), SineSteering(0.03))
    history = simulate_general(drive, SloshingCargo.none(), 5.0, 0.05)
    truck = GeneralSimulator(drive)
    for k, sample in enumerate(imu_samples(history, TRUCK)):
        if k:
            truck.advance(50_000_000, NOTHING, NOTHING)
            measured = truck.imu(NOTHING)
            np.testing.assert_allclose(sample.force, measured.specific_force, atol=1e-6)
            np.testing.assert_allclose(sample.rate, measured.angular_rate, atol=1e-8)


def test_truck_is_condensed_to_its_thresholds():
    stiff = replace(VEHICLE, roll_stiffness=1e12)
    rigid = RollBalance(stiff, FROZEN, SETTLED)
    assert rigid.threshold_solid == pytest.approx(rigid_threshold(TRUCK), rel=1e-4)
    truth = study('step_steer').thresholds
    assert rigid.threshold_liquid == pytest.approx(truth.rigid_liquid, rel=5e-3)
    assert truth.lift_off_liquid / GRAVITY == pytest.approx(0.28, abs=0.005)  # as in the README
    assert truth.liquid / GRAVITY == pytest.approx(0.36, abs=0.005)
    # with springs: one lean for both units is a little too soft
    for found, true in (
        (BALANCE.threshold_solid, truth.frozen),
        (BALANCE.threshold_liquid, truth.liquid),
    ):
        assert 0.95 * true < found < true


@pytest.mark.parametrize(
    ('name', 'rms', 'peak', 'cost'),
    [
        ('step_steer', 0.009, 0.018, 0.10),
        ('lane_change', 0.005, 0.016, 0.14),
        ('roundabout', 0.006, 0.018, 0.055),
    ],
)
def test_load_transfer_from_the_imu_is_that_of_the_wheels(name, rms, peak, cost):
    """What it costs to take the load for solid is several times the error that is left."""
    s = study(name)
    assert s.error(s.liquid)[0] < rms
    assert s.error(s.liquid)[1] < peak
    assert s.error(s.solid)[1] > cost
    assert s.error(s.solid)[0] > 6.0 * s.error(s.liquid)[0]
    np.testing.assert_allclose(s.liquid.margin, s.true_margin, atol=0.02)


def test_without_the_roll_axis_it_errs_on_the_safe_side():
    """As config/rollover.yaml says: a tenth too high."""
    s = study('step_steer')
    engine = SloshEngine(SloshConfig.from_file(SCENARIOS / 'step_steer.yaml'))
    level = RolloverMonitor(engine, replace(VEHICLE, roll_axis=0.0))
    *_, last = imu_samples(s.truth, TRUCK)
    found = level.take(last, engine.settled @ last.force).load_transfer_ratio
    assert 1.05 < found / s.truth.transfer.vehicle[-1] < 1.15


def test_left_turn_loads_the_right_wheels():
    s = study('step_steer')
    left, right = s.truth.wheel_loads[-1].sum(axis=0)
    assert s.truth.yaw_rate[-1] > 0.0
    assert right > left
    assert s.liquid.load_transfer_ratio[-1] > 0.5


def test_settled_ratio_is_ahead_of_what_comes():
    """Half of the final transfer is announced before it has come."""
    s = study('step_steer')
    final = s.truth.transfer.vehicle[-1]
    assert s.liquid.settled[-1] == pytest.approx(final, rel=0.02)
    announced = s.truth.time[np.argmax(s.liquid.settled > final / 4.0)]
    come = s.truth.time[np.argmax(s.truth.transfer.vehicle > final / 4.0)]
    assert announced < come - 0.15


def test_recorded_wrench_of_the_simulation_does_as_well_as_the_engine():
    """The wrench from inside the simulation, moved from O to base_link."""
    s = study('lane_change')
    wrench = s.truth.slosh.copy()
    wrench[:, 3:] += np.cross([0.0, 0.0, AXIS], wrench[:, :3])
    engine = SloshEngine(SloshConfig.from_file(SCENARIOS / 'lane_change.yaml'))
    monitor = RolloverMonitor(engine, VEHICLE)
    samples = imu_samples(s.truth, TRUCK)
    found = [monitor.take(*pair).load_transfer_ratio for pair in zip(samples, wrench, strict=True)]
    np.testing.assert_allclose(found, s.liquid.load_transfer_ratio, atol=5e-4)


@pytest.mark.parametrize('angle', [0.03, -0.03])
def test_solid_cargo_needs_no_wrench(angle):
    drive = Drive(TRUCK, Manoeuvre.from_knots(15.0, (0.0,), (0.0,)), SineSteering(angle, 0.3))
    history = simulate_general(drive, SloshingCargo.none(), 8.0)
    cargo = TRUCK.cargo
    centre = np.array(cargo.centroid)
    about = np.array(cargo.inertia)
    about[0, 0] += cargo.mass * centre[2] ** 2
    balance = RollBalance(VEHICLE, rigid_matrix(cargo.mass, centre, about), np.zeros((6, 3)))
    samples = list(imu_samples(history, TRUCK))
    rate = np.array([sample.rate for sample in samples])
    motion = np.hstack([[s.force for s in samples], np.gradient(rate, history.time, axis=0)])
    found = balance.judge(motion, np.zeros((len(samples), 6)))
    truth = history.transfer.vehicle
    assert np.sqrt(np.mean((found.load_transfer_ratio - truth) ** 2)) < 0.04 * truth.std()
    assert np.abs(found.load_transfer_ratio - truth).max() < 0.05 * np.abs(truth).max()
    assert np.sign(truth[np.argmax(np.abs(truth) > 0.1)]) == np.sign(angle)


def test_picture_of_the_study(tmp_path):
    plot_rollover([study('step_steer'), study('lane_change')], tmp_path / 'rollover.png')
    assert (tmp_path / 'rollover.png').read_bytes().startswith(b'\x89PNG')


# ---- sample by sample


def test_mount_of_the_imu_makes_no_difference():
    """The same steady screw motion, felt at base_link and by a turned IMU up front."""
    force, rate = np.array([0.3, 1.2, 9.7]), np.array([0.02, -0.03, 0.2])
    arm = np.array([2.0, 0.5, 1.0])
    at_imu = force + np.cross(rate, np.cross(rate, arm))
    turned = engine_of(imu__xyz=arm.tolist(), imu__rpy=[0.0, 0.0, np.pi / 2.0])
    there = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # base to IMU axes
    wrench = np.array([0.0, 1e3, 0.0, 2e3, 0.0, 0.0])
    figures = []
    for engine, s, omega in (
        (engine_of(), force, rate),
        (turned, there @ at_imu, there @ rate),
    ):
        monitor = RolloverMonitor(engine, VEHICLE)
        for k in range(3):
            last = monitor.take(MotionSample(10**9 + k * 10**7, s, np.zeros(3), omega), wrench)
        figures.append(np.array(last))
    np.testing.assert_allclose(figures[0], figures[1], rtol=1e-12)


def test_what_is_not_finite_is_not_judged_and_harms_nothing():
    clean, hit = (RolloverMonitor(engine_of(), VEHICLE) for _ in range(2))
    wrench = np.array([0.0, 1e3, 0.0, 2e3, 0.0, 0.0])

    def sample(k: int, side: float = 1.0) -> MotionSample:
        force = np.array([0.0, side, GRAVITY])
        return MotionSample(10**9 + k * 10**7, force, np.zeros(3), np.full(3, 0.01 * k**2))

    for k, bad in enumerate((0.0, 0.0, np.nan, np.inf, -np.inf)):
        assert hit.take(sample(k, float('nan')), wrench) is None
        expected = clean.take(sample(k), wrench)
        found = hit.take(sample(k), wrench + np.full(6, bad))
        if bad == 0.0:
            np.testing.assert_array_equal(found, expected)
        else:
            assert found is None
    np.testing.assert_array_equal(hit.take(sample(9), wrench), clean.take(sample(9), wrench))


def stamped(stamp: int) -> MotionSample:
    return MotionSample(stamp, np.zeros(3), np.zeros(3), np.zeros(3))


def test_pairs_meet_whichever_comes_first():
    pairs, first, second = Pairs(), stamped(1), stamped(2)
    assert pairs.sample(first) is None
    found = pairs.answer(1, NOTHING)
    assert found is not None
    assert found[0] is first
    assert pairs.answer(2, NOTHING) is None
    found = pairs.sample(second)
    assert found is not None
    assert found[0] is second
    assert pairs.unanswered == 0


def test_samples_that_are_not_answered_are_counted_and_not_paired_later():
    pairs = Pairs()
    for stamp in (1, 2, 3):
        assert pairs.sample(stamped(stamp)) is None
    assert pairs.answer(3, NOTHING) is not None
    assert pairs.unanswered == 2
    assert pairs.answer(1, NOTHING) is None  # too late
    assert pairs.sample(stamped(4)) is None
    assert pairs.answer(4, NOTHING) is not None


def test_of_duplicates_the_first_is_judged_as_slosh_node_does():
    pairs, first = Pairs(), stamped(1)
    pairs.sample(first)
    pairs.sample(stamped(1))
    found = pairs.answer(1, NOTHING)
    assert found is not None
    assert found[0] is first
    assert pairs.answer(1, NOTHING) is None


def test_pairs_go_on_after_a_backward_jump():
    pairs = Pairs()
    for stamp in (1000, 1001, 5, 6):
        pairs.sample(stamped(stamp))
        assert pairs.answer(stamp, NOTHING) is not None
    assert pairs.unanswered == 0


def test_silent_partner_costs_no_memory_and_its_late_word_no_stale_number():
    pairs = Pairs(lag=20)
    for stamp in range(1, 1001):
        assert pairs.sample(stamped(stamp)) is None
    assert pairs.unanswered == 980
    assert pairs.answer(980, NOTHING) is None
    assert pairs.answer(981, NOTHING) is not None
    for stamp in range(2000, 3000):
        assert pairs.answer(stamp, NOTHING) is None
    assert pairs.sample(stamped(2979)) is None


# ---- parameters


def test_shipped_vehicle_is_the_truck_of_the_scenarios():
    shipped = RollVehicle.from_file(VEHICLE_FILE)
    for name, value in vars(VEHICLE).items():
        np.testing.assert_allclose(getattr(shipped, name), value, rtol=1e-3, err_msg=name)


@pytest.mark.parametrize(
    ('change', 'says'),
    [
        (('track: 1.878', ''), 'vehicle.track missing'),
        (('track: 1.878', 'track: 2'), 'vehicle.track has the integer 2'),
        (('track: 1.878', 'tracks: 1.878'), 'did you mean vehicle.track?'),
        (('mass: 11219.0', 'mass: -1.0'), 'vehicle.mass is -1 [kg]'),
        (('/**/rollover_node', 'other'), 'is not a parameter file for rollover_node'),
    ],
)
def test_bad_vehicle_is_one_clear_message(tmp_path, change, says):
    file = tmp_path / 'truck.yaml'
    file.write_text(VEHICLE_FILE.read_text().replace(*change))
    with pytest.raises(InputError) as caught:
        RollVehicle.from_file(file)
    assert str(caught.value).startswith(f'{file}: ')
    assert says in str(caught.value)


def test_vehicle_that_cannot_stand_is_one_clear_message(tmp_path):
    file = tmp_path / 'truck.yaml'
    file.write_text(VEHICLE_FILE.read_text().replace('1703000.0', '400000.0'))
    command = ['replay', BAG, '--config', BAG_CONFIG, '--rollover', file]
    refused(command, f'{BAG_CONFIG} with {file}: ', 'falls over at rest; it needs')


@pytest.mark.parametrize(
    ('changes', 'says'),
    [
        ({'input__source': 'twist'}, 'does not feel the vehicle lean'),
        ({'frames__output': 'tank_link'}, 'rollover figures need base_link'),
    ],
)
def test_engine_that_cannot_serve_is_refused(changes, says):
    with pytest.raises(InputError, match=says):
        RolloverMonitor(engine_of(**changes), VEHICLE)


def test_check_knows_the_vehicle_file():
    result = slosh('check', VEHICLE_FILE)
    assert result.returncode == 0, result.stderr
    assert '11219 kg' in result.stdout


# ---- a recorded drive


@pytest.mark.dear
def test_recorded_drive_is_judged(tmp_path):
    """A half-full tanker on the highway: never near rolling over; only its liquid is restless."""
    out, bag, plain = (tmp_path / name for name in ('loads.csv', 'loads.mcap', 'plain.csv'))
    command = ('replay', BAG, '--config', BAG_CONFIG)
    picture = tmp_path / 'drive.png'
    result = slosh(*command, '--rollover', VEHICLE_FILE, '--out', out, '--plot', picture)
    assert result.returncode == 0, result.stderr
    assert 'least rollover margin' in result.stdout
    assert picture.stat().st_size > 50_000
    loads = table(out)
    assert out.read_text().startswith(HEAD + ',ltr,ltr_settled,rollover_margin\n')
    assert all(np.isfinite(loads[name]).all() for name in loads.dtype.names)
    assert 0.10 < np.abs(loads['ltr']).max() < 0.25
    assert abs(loads['ltr'].mean()) < 0.02
    assert loads['rollover_margin'].min() > 0.3

    assert slosh(*command, '--out', plain, '--duration', 5.0).returncode == 0
    rows = plain.read_text().splitlines()
    assert rows[0] == HEAD
    assert len(rows) > 500
    assert rows == [line.rsplit(',', 3)[0] for line in out.read_text().splitlines()[: len(rows)]]

    result = slosh(*command, '--rollover', VEHICLE_FILE, '--out', bag, '--duration', 2.0)
    assert result.returncode == 0, result.stderr
    with AnyReader([bag], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        (connection,) = (
            c for c in reader.connections if c.topic == '/rollover_node/rollover_margin'
        )
        found = [
            (stamp, reader.deserialize(raw, connection.msgtype).data)
            for _, stamp, raw in reader.messages([connection])
        ]
    count = len(found)
    assert count > 200
    expected = zip(loads['stamp_ns'][:count], loads['rollover_margin'][:count], strict=True)
    assert [m for _, m in found] == [m for _, m in expected]


def test_replay_is_the_monitor_fed_by_hand():
    """The few lines that a stack of one's own needs."""
    engine = SloshEngine(SloshConfig.from_file(BAG_CONFIG))
    monitor = RolloverMonitor(engine, RollVehicle.from_file(VEHICLE_FILE))
    with MotionBag(BAG, IMU, duration=5.0) as source:
        for message, received in source.messages():
            _, loads = feed_message(engine, message, received)
            rollover = monitor.take(loads.sample, loads.wrench)
            assert abs(rollover.load_transfer_ratio) < 0.25


def test_a_fill_that_changes_in_a_bag_is_a_load_that_changes(tmp_path):
    """The vehicle is judged with the liquid that is there, from the sample on that finds it."""
    times = stamps(2.0, 0.01)
    bag = write_bag(
        tmp_path / 'drive', times, lambda _: (0.0, 1.0, GRAVITY), fills=[(times[100], '/f', 0.9)]
    )
    engine = engine_of()
    monitor = RolloverMonitor(engine, VEHICLE)
    recording = Recording(engine)
    with MotionBag(bag, IMU, fills={'tank': ('/f', '')}) as source:
        replay(source, engine, [recording], monitor=monitor)
    laden = RolloverMonitor(engine_of(tank__fill_depth=0.9 * 1.6), VEHICLE).balance
    assert monitor.balance.threshold_liquid == pytest.approx(laden.threshold_liquid, rel=1e-9)
    assert monitor.balance.threshold_solid == pytest.approx(laden.threshold_solid, rel=1e-9)
    steps = np.abs(np.diff(recording.rollover.settled))
    assert steps.argmax() == 99
    assert steps[99] > 20.0 * np.delete(steps, 99).max()
