"""The measured vertical specific force as gravity: slopes, heave, hops; and the slow high-pass."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from drives import RECTANGLE, SECOND, START, G, engine_of, feed, stamps, totals, wrenches
from scipy.integrate import solve_ivp

from slosh_ros.engine import MotionSample, SloshConfig, SloshEngine
from slosh_ros.engine.kinematics import HighPass, Pose, products

MASS = 8 * 2 * 0.8 * 850.0


def measured(**changes: object) -> SloshEngine:
    return engine_of(model__gravity='measured', **changes)


@pytest.mark.parametrize('tilt', [0.1, 0.3])
def test_a_leaning_tank_has_a_surface_of_slope_s_x_over_s_z(tilt):
    """The projection of x tan(theta) on each mode; with a constant g it is that of sin."""
    force = (-G * np.sin(tilt), 0.0, G * np.cos(tilt))
    slopes = []
    for make in (measured, engine_of):
        engine = make(tank__damping_ratio=0.5, tank__modes=6)
        feed(engine, stamps(60.0, 0.05), force)
        (tank,) = engine.tanks
        c = tank.coefficients
        surge = c.coupling[:, 0] != 0
        per_slope = -c.coupling[:, 0] * G / (c.mu * c.omega**2)  # of f = -x: lambda_1 < 0
        slopes.append(-tank.beta[surge] / per_slope[surge])
    assert slopes[0] == pytest.approx(np.tan(tilt), rel=1e-9)
    assert slopes[1] == pytest.approx(np.sin(tilt), rel=1e-9)


def test_the_moment_of_a_leaning_tank_is_exact_to_second_order():
    """Against the centroid of the tilted prism: x = I/V tan, z = z_c + I/(2 V) tan^2."""
    errors = []
    for tilt in (0.1, 0.2):
        force = np.array([-G * np.sin(tilt), 0.0, G * np.cos(tilt)])
        engine = measured(tank__damping_ratio=0.5)
        moment = totals(feed(engine, stamps(60.0, 0.05), tuple(force)))[-1][4]
        inertia = 8.0**2 / 12.0 / 0.8  # I/V
        centroid = np.array([np.tan(tilt) * inertia, 0.0, -0.4 + inertia * np.tan(tilt) ** 2 / 2])
        exact = -MASS * np.cross(centroid, force)[1]
        errors.append(abs(moment / exact - 1.0))
    assert errors[0] < 0.006
    assert errors[1] / errors[0] == pytest.approx(4.0, rel=0.05)


def test_a_level_tank_at_rest_and_constant_gravity_are_the_same():
    drive = lambda t: (np.sin(t), 0.3 * np.cos(2 * t), G)  # noqa: E731
    rate = lambda t: (0.05 * t, 0.02 * t, 0.1 * t)  # noqa: E731
    point = {'pressure__gauge': [3.0, 0.5, -0.5]}
    here = feed(measured(**point), stamps(3.0, 0.01), drive, rate)
    there = feed(engine_of(**point), stamps(3.0, 0.01), drive, rate)
    for part in ('wrench', 'total', 'state', 'pressure', 'beta'):
        one, two = (np.array([getattr(loads, part) for loads in run]) for run in (here, there))
        np.testing.assert_allclose(one, two, atol=1e-12 * np.abs(two).max())


def disturbed(heave, duration: float, step: float = 0.01, **changes: object):
    """Push a tank of one mode, then heave it by `heave(t)` [g]; give omega, time, beta."""
    engine = measured(tank__modes=1, **changes)
    omega = engine.tanks[0].coefficients.omega[0]
    feed(engine, stamps(1.0, step), lambda t: (0.3 * np.sin(np.pi * t), 0.0, G))
    later = [START + SECOND + round(k * step * SECOND) for k in range(1, round(duration / step))]
    loads = feed(engine, later, lambda t: (0.0, 0.0, G * (1.0 + heave(t - 1.0, omega))))
    return omega, np.array([(s - START - SECOND) / SECOND for s in later]), loads


@pytest.mark.parametrize('damping', [0.0, 0.01])
def test_heave_at_twice_the_frequency_makes_waves_grow_as_mathieu_has_it(damping):
    """First instability zone: the envelope grows with (heave/4 - zeta) omega."""
    omega, _, loads = disturbed(
        lambda t, w: 0.1 * np.sin(2.0 * w * t), 100.0, tank__damping_ratio=damping
    )
    beta = np.abs([answer.beta[0] for answer in loads])
    period = round(2.0 * np.pi / omega / 0.01)
    crests = np.array([beta[k : k + period].max() for k in range(0, len(beta) - period, period)])
    grown = np.log(crests[-1] / crests[-7]) / (6 * period * 0.01)
    assert grown == pytest.approx((0.1 / 4.0 - damping) * omega, rel=0.05)


@pytest.mark.parametrize('share', [1.5, 2.0 * 1.06])
def test_heave_outside_the_zone_makes_no_wave_grow(share):
    """|Omega/(2 omega) - 1| < heave/4 is the zone, to first order."""
    _, _, loads = disturbed(lambda t, w: 0.1 * np.sin(share * w * t), 150.0)
    beta = np.abs([answer.beta[0] for answer in loads])
    assert beta[-4000:].max() < 2.5 * beta[:1000].max()


def test_a_heaved_wave_obeys_the_equation_of_motion():
    """Against Runge-Kutta of beta'' + omega^2 s_z/g beta = -lambda s/mu, damped; second order."""
    errors = []
    for step in (0.04, 0.02):
        engine = measured(tank__modes=1, tank__damping_ratio=0.05)
        c = engine.tanks[0].coefficients
        w, gain = c.omega[0], c.coupling[0, 0] / c.mu[0]
        level = lambda t: 1.0 + 0.4 * np.sin(1.7 * t)  # noqa: E731
        loads = feed(
            engine, stamps(8.0, step), lambda t, s=level: (np.sin(0.9 * t), 0.0, G * s(t))
        )

        def rhs(t, y, w=w, gain=gain, level=level):
            damped = 2 * 0.05 * w * np.sqrt(level(t)) * y[1]
            return [y[1], -w * w * level(t) * y[0] - damped - gain * np.sin(0.9 * t)]

        y = solve_ivp(rhs, (0.0, 8.0), [0.0, 0.0], rtol=1e-10, atol=1e-12).y[:, -1]
        errors.append(abs(loads[-1].beta[0] - y[0]))
        # eq (16), with the equation of motion in place of beta''
        force = c.coupling[0, 0] * (
            -rhs(8.0, [loads[-1].beta[0], engine.tanks[0].beta_rate[0]])[1]
        )
        assert loads[-1].wrench[0] == pytest.approx(force, rel=1e-9)
        assert engine.tanks[0].wrench == pytest.approx(loads[-1].wrench, rel=1e-12)
    assert errors[1] < 1e-3 * np.abs([answer.beta[0] for answer in loads]).max()
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)


def test_a_jump_of_the_vertical_force_moves_neither_surface_nor_speed():
    engine = measured(tank__modes=4)
    feed(engine, stamps(2.0, 0.01), lambda t: (np.sin(t), 0.0, G))
    before = engine.tanks[0].beta, engine.tanks[0].beta_rate
    feed(engine, [START + 2 * SECOND + 1000], (np.sin(2.0), 0.0, 2.0 * G))
    after = engine.tanks[0].beta, engine.tanks[0].beta_rate
    np.testing.assert_allclose(after, before, atol=1e-4 * np.abs(before).max())


def test_a_small_change_of_the_vertical_force_changes_the_loads_by_little():
    ends = []
    for level in (G, G * (1.0 + 1e-6)):
        loads = feed(measured(), stamps(3.0, 0.01), lambda t, s=level: (np.sin(t), 0.2, s))
        ends.append(totals(loads)[-1])
    assert ends[1] == pytest.approx(ends[0], rel=1e-4, abs=1e-4 * np.abs(ends[0]).max())


@pytest.mark.parametrize('level', [0.0, -G, 0.01 * G])
def test_a_hop_is_counted_and_stays_finite(level):
    engine = measured()
    loads = feed(engine, stamps(3.0, 0.01), lambda t: (1.0, 0.1, level if 1.0 < t < 1.4 else G))
    told = {k: n for k, n in engine.warnings.items() if 'below 0.05 g' in k}
    assert list(told.values()) == [39]
    assert np.isfinite(totals(loads)).all()
    # no more than twice the settled moment of 1 m/s^2, with a little for the hop
    settled = MASS * 8.0**2 / 12.0 / 0.8
    assert np.abs(wrenches(loads)[:, 4]).max() < 2.5 * settled


def test_tanks_that_lean_differently_have_a_gravity_each():
    """One upright, one leaning by 0.5: each as if it were alone."""

    def tank(name: str, roll: float) -> dict[str, object]:
        own = {key.replace('tank.', f'{name}.'): value for key, value in RECTANGLE.items()}
        return own | {f'{name}.rpy': [roll, 0.0, 0.0], f'{name}.modes': 3}

    drive = lambda t: (np.sin(t), 0.2, G + np.sin(3.0 * t))  # noqa: E731
    common: dict[str, object] = {'model.gravity': 'measured'}
    alone = [
        feed(
            SloshEngine(SloshConfig.from_parameters(common | {'tanks': [n]} | tank(n, roll))),
            stamps(3.0, 0.01), drive,
        )
        for n, roll in (('a', 0.0), ('b', 0.5))
    ]  # fmt: skip
    given = common | {'tanks': ['a', 'b']} | tank('a', 0.0) | tank('b', 0.5)
    both = feed(SloshEngine(SloshConfig.from_parameters(given)), stamps(3.0, 0.01), drive)
    for part in (wrenches, totals):
        total = part(alone[0]) + part(alone[1])
        np.testing.assert_allclose(part(both), total, atol=1e-9 * np.abs(total).max())


def test_tanks_that_lean_differently_may_all_be_empty_or_full():
    """No mode is left then that gravity could act on."""
    own = {
        key.replace('tank.', f'{name}.'): value
        for name in 'ab'
        for key, value in RECTANGLE.items()
    }
    own |= {'tanks': ['a', 'b'], 'b.rpy': [0.5, 0.0, 0.0], 'model.gravity': 'measured'}
    engine = SloshEngine(SloshConfig.from_parameters(own))
    for k, (a, b) in enumerate([(0.5, 0.5), (0.0, 0.5), (0.0, 1.0), (1.0, 1.0), (0.5, 0.0)]):
        engine.set_fill('a', a)
        engine.set_fill('b', b)
        for step in range(3):
            _, loads = engine.feed(
                MotionSample.from_imu(
                    START + (10 * k + step) * SECOND // 100, (0.3, 0.2, G), [0.0] * 3
                )
            )
            assert np.isfinite(loads.total).all()
            assert np.isfinite(loads.wrench).all()


def test_a_twist_knows_no_other_gravity():
    engine = measured(input__source='twist')
    plain = engine_of(input__source='twist')
    for k, stamp in enumerate(stamps(2.0, 0.01)):
        sample = MotionSample.from_twist(stamp, [5.0 + np.sin(0.01 * k), 0.0, 3.0], [0, 0, 0.1])
        one, two = (each.feed(sample)[1].wrench for each in (engine, plain))
        assert np.array_equal(one, two)


# --- the slow high-pass --------------------------------------------------------------------------

CORNER = 0.02  # [Hz]


def test_a_leaning_mount_makes_no_standing_wave():
    """0.05 rad of pitch and a drifting gyro from the start on: no wave at all."""
    lean = (-G * np.sin(0.05), 0.1, G * np.cos(0.05))
    for corner, wave in ((CORNER, 0.0), (0.0, 0.05 * 4.0)):
        engine = engine_of(imu__high_pass=corner, tank__damping_ratio=0.3)
        loads = feed(engine, stamps(60.0, 0.05), lean, (0.01, 0.0, 0.02))
        assert loads[-1].elevation_max == pytest.approx(wave, rel=0.2, abs=1e-12)
        assert loads[-1].total[2] == pytest.approx(-MASS * G * np.cos(0.05))


def test_what_is_left_of_a_long_brake_is_exponential():
    """0.5 m/s^2 from 1 s on: the settled surface follows exp(-corner t)."""
    engine = engine_of(imu__high_pass=CORNER, tank__damping_ratio=0.5)
    loads = feed(engine, stamps(40.0, 0.01), lambda t: (-0.5 * (t > 1.0), 0.0, G))
    time = np.array([(answer.stamp - START) / SECOND for answer in loads])
    force = np.array([answer.total[0] for answer in loads])
    late = time > 30.0
    # the liquid follows the slow change: m a within the lag of the wave, 2 zeta/omega
    lag = 2.0 * 0.5 / engine.tanks[0].coefficients.omega[0]
    expected = MASS * 0.5 * np.exp(-2.0 * np.pi * CORNER * (time - 1.0))
    assert force[late] == pytest.approx(expected[late], rel=4 * np.pi * CORNER * lag)


def test_the_filter_is_exact_for_input_that_runs_linearly():
    rng = np.random.default_rng(4)
    corner, up = 0.3, np.array([0.0, 0.6, 0.8])
    one, ten = HighPass(corner, up), HighPass(corner, up)
    values = rng.normal(size=(20, 15))
    one.follow(values[0], 0.0)
    ten.follow(values[0], 0.0)
    for before, now in itertools.pairwise(values):
        coarse = one.follow(now, 0.5)
        for part in np.arange(1, 11) / 10:
            fine = ten.follow(before + part * (now - before), 0.05)
        np.testing.assert_allclose(fine, coarse, atol=1e-12)
    # a ramp from rest: y = a/corner (1 - exp(-corner t))
    ramp, w = HighPass(corner, up), 2.0 * np.pi * corner
    ramp.follow(np.zeros(15), 0.0)
    passed = ramp.follow(np.full(15, 2.0), 2.0)
    assert passed[6] == pytest.approx((1.0 - np.exp(-2.0 * w)) / w)
    assert passed[3] == 2.0  # velocity passes
    assert up @ passed[:3] == pytest.approx(up @ np.full(3, 2.0))  # and all along the vertical


def test_filtered_or_not_an_imu_may_be_mounted_anywhere():
    """
    Force, rate and products pass one filter: the lever arm still cancels.

    The vehicle starts from rest; between samples the motion is only nearly linear.
    """
    mount = ([3.1, -0.7, 1.9], [0.4, -1.1, 2.3])
    runs = []
    for xyz, rpy in (([0.0] * 3, [0.0] * 3), mount):
        pose = Pose.from_xyz_rpy(np.array(xyz), np.array(rpy))

        def force(t: float, pose: Pose = pose) -> np.ndarray:
            w = np.array([0.0, 0.0, 0.1 * (1.0 - np.cos(0.7 * t))])
            alpha = np.array([0.0, 0.0, 0.07 * np.sin(0.7 * t)])
            s = np.array([np.sin(2 * t), 0.5 * np.cos(3 * t), G])
            s = s + np.cross(alpha, pose.origin) + np.cross(w, np.cross(w, pose.origin))
            return pose.rotation.T @ s

        engine = engine_of(
            imu__xyz=xyz, imu__rpy=rpy, imu__high_pass=0.1, tank__xyz=[-2.0, 0.0, 1.0]
        )
        loads = feed(
            engine, stamps(10.0, 0.01), force,
            lambda t, pose=pose: pose.rotation.T @ [0.0, 0.0, 0.1 * (1.0 - np.cos(0.7 * t))],
        )  # fmt: skip
        runs.append(np.array([answer.state for answer in loads]))
    scale = np.abs(runs[0]).max(axis=0) + 1e-9
    np.testing.assert_allclose(runs[1] / scale, runs[0] / scale, atol=1e-3)


def test_products_are_those_of_the_rate():
    w = np.array([0.3, -0.2, 0.5])
    assert products(*w) == pytest.approx(np.outer(w, w)[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])
