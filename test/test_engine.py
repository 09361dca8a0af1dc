"""The engine's physics: what the loads must be, whatever the code."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from drives import RECTANGLE, SECOND, START, G, engine_of, feed, stamps, totals, wrenches

from slosh_ros.engine import MotionSample, SloshConfig, SloshEngine, Verdict
from slosh_ros.engine.kinematics import Pose

REST = (0.0, 0.0, G)
MASS = 8 * 2 * 0.8 * 850.0
CYLINDER = {
    'tank.shape': 'cylinder_x',
    'tank.radius': 1.125,
    'tank.length': 6.0,
    'tank.fill_ratio': 0.6,
}


def engine_with(**changes: object) -> SloshEngine:
    given = CYLINDER | {name.replace('__', '.'): value for name, value in changes.items()}
    return SloshEngine(SloshConfig.from_parameters(given))


def test_liquid_at_rest_weighs_and_does_not_slosh():
    loads = feed(engine_of(), stamps(1.0, 0.01), REST)
    assert np.all(wrenches(loads) == 0.0)
    np.testing.assert_allclose(totals(loads)[-1], [0, 0, -MASS * G, 0, 0, 0], atol=1e-9)


def test_pure_heave_excites_nothing():
    loads = feed(engine_of(), stamps(5.0, 0.01), lambda t: (0, 0, G + 3 * np.sin(7 * t)))
    assert np.all(wrenches(loads) == 0.0)
    assert totals(loads)[:, 2].min() < -MASS * (G + 2.9)


@pytest.mark.parametrize('axis', ['pitch', 'roll'])
@pytest.mark.parametrize('make', [engine_of, engine_with])
@pytest.mark.parametrize('modes', [3, 12])
def test_static_tilt_gives_the_hydrostatic_moment(make, axis, modes):
    """Metacentre: M = m g (z_c + I/V) theta about O, exact with any number of modes kept."""
    tilt = np.radians(2.0)
    engine = make(tank__damping_ratio=0.3, tank__modes=modes)
    liquid = engine.tanks[0].coefficients.liquid
    force = (
        (-G * np.sin(tilt), 0.0, G * np.cos(tilt))
        if axis == 'pitch'
        else (0.0, G * np.sin(tilt), G * np.cos(tilt))
    )
    loads = feed(engine, stamps(120.0, 0.05), force)
    inertia = np.diag(liquid.surface_inertia)[0 if axis == 'pitch' else 1]
    metacentric = liquid.centroid[2] + inertia / liquid.volume
    mass = engine.tanks[0].coefficients.mass
    moment = totals(loads)[-1][4 if axis == 'pitch' else 3]
    # about O, from about base_link at the centre of the tank
    lever = liquid.surface_height
    push = totals(loads)[-1][0 if axis == 'pitch' else 1]
    about_o = moment - lever * push if axis == 'pitch' else moment + lever * push
    assert about_o == pytest.approx(mass * G * metacentric * np.sin(tilt), rel=1e-9)


@pytest.mark.parametrize(('modes', 'tolerance'), [(8, 0.06), (60, 0.01)])
def test_static_tilt_levels_the_surface_in_the_world(modes, tolerance):
    """The surface slopes by theta against the tank; its projection on f_j is beta_j exactly."""
    tilt = np.radians(2.0)
    engine = engine_of(tank__damping_ratio=0.3, tank__modes=modes)
    loads = feed(engine, stamps(120.0, 0.05), (-G * np.sin(tilt), 0.0, G * np.cos(tilt)))
    c = engine.tanks[0].coefficients
    surface = c.surface_shapes @ engine.tanks[0].beta
    level = np.sin(tilt) * c.surface_points[:, 0]  # nose down: the liquid stands high in front
    assert np.sqrt(np.mean((surface - level) ** 2)) < tolerance * level.max()
    assert loads[-1].elevation_max == pytest.approx(level.max(), rel=3 * tolerance)
    surge = c.coupling[:, 0] != 0
    np.testing.assert_allclose(
        engine.tanks[0].beta[surge],
        (np.sin(tilt) * -c.coupling[:, 0] * -G / (c.mu * c.omega**2))[surge],
        rtol=1e-9,
    )


def test_free_decay_of_the_force_has_the_rate_zeta_omega():
    engine = engine_of(tank__modes=1, tank__damping_ratio=0.05)
    omega = engine.tanks[0].coefficients.omega[0]
    period = 2 * np.pi / (omega * np.sqrt(1 - 0.05**2))
    times = [START, START + SECOND // 10]
    feed(engine, times, (2.0, 0.0, G))
    first = [START + SECOND // 10 + round(0.01 * k * SECOND) for k in range(1, 3000)]
    force = wrenches(feed(engine, first, REST))[:, 0]
    crests = [k for k in range(1, len(force) - 1) if force[k - 1] < force[k] > force[k + 1]]
    fitted = np.polyfit(np.arange(len(crests)), np.log(force[crests]), 1)[0]
    assert len(crests) > 3
    assert -fitted / period == pytest.approx(0.05 * omega, rel=1e-3)


def test_splitting_intervals_in_ten_changes_nothing():
    """Piecewise-linear motion, sampled at its corners or ten times as often."""
    rng = np.random.default_rng(3)
    corners = np.array(stamps(4.0, 0.1))
    force = rng.normal(size=(len(corners), 3)) + REST
    rate = 0.2 * rng.normal(size=(len(corners), 3))
    rate[:, :2] = 0.0  # omega x (omega x r) is quadratic; about one axis it stays along x, y
    rate[:] = rate[0] * 0.0
    fine = np.array(stamps(4.0, 0.01))

    def along(values: np.ndarray):
        def at(t: float) -> list[float]:
            return [float(np.interp(START + t * SECOND, corners, v)) for v in values.T]

        return at

    one = feed(engine_of(tank__damping_ratio=0.02), corners.tolist(), along(force), along(rate))
    ten = feed(engine_of(tank__damping_ratio=0.02), fine.tolist(), along(force), along(rate))
    scale = np.abs(wrenches(one)).max(axis=0) + 1.0
    np.testing.assert_allclose(wrenches(ten)[::10] / scale, wrenches(one) / scale, atol=1e-10)


# an IMU anywhere on the vehicle, turned in any way
MOUNT = ([3.1, -0.7, 1.9], [0.4, -1.1, 2.3])


def measured(mount: tuple, spin: object, angular_acceleration: object, force: object):
    """Measure with an IMU at the mount, on a vehicle whose base_link moves as told."""
    pose = Pose.from_xyz_rpy(*map(np.array, mount))

    def specific(t: float) -> np.ndarray:
        w, alpha = np.array(spin(t)), np.array(angular_acceleration(t))
        at_mount = np.array(force(t)) + np.cross(alpha, pose.origin)
        at_mount = at_mount + np.cross(w, np.cross(w, pose.origin))
        return pose.rotation.T @ at_mount

    return specific, lambda t: pose.rotation.T @ np.array(spin(t))


def mounted_loads(
    mount: tuple, step: float, spin: object, alpha: object, force: object
) -> np.ndarray:
    engine = engine_of(
        tank__damping_ratio=0.02, tank__xyz=[-2.0, 0.1, 1.3], tank__modes=12,
        imu__xyz=mount[0], imu__rpy=mount[1],
    )  # fmt: skip
    loads = feed(engine, stamps(6.0, step), *measured(mount, spin, alpha, force))
    return np.hstack([wrenches(loads), totals(loads)])[1:]  # no derivative at the first sample


def test_moving_and_turning_the_imu_changes_nothing():
    """A vehicle in speeding rotation: omega is linear, so sampling loses nothing."""
    drive = (
        lambda t: (0.02 * t, -0.03 * t, 0.1 + 0.05 * t),
        lambda t: (0.02, -0.03, 0.05),
        lambda t: (np.sin(2 * t), 0.5 * np.cos(3 * t) - 0.5, G + 0.1 * np.sin(t)),
    )
    at_base = mounted_loads(([0.0] * 3, [0.0] * 3), 0.01, *drive)
    elsewhere = mounted_loads(MOUNT, 0.01, *drive)
    scale = np.abs(at_base).max(axis=0) + 1e-9
    np.testing.assert_allclose(elsewhere / scale, at_base / scale, atol=1e-10)


def test_moving_the_imu_in_general_motion_differs_by_the_square_of_the_step():
    """Between samples motion is taken as linear; only there can two mounts differ."""
    drive = (
        lambda t: (0.1 * np.sin(2 * t), 0.1 * np.sin(1.5 * t), 0.2 * np.sin(t)),
        lambda t: (0.2 * np.cos(2 * t), 0.15 * np.cos(1.5 * t), 0.2 * np.cos(t)),
        lambda t: (np.sin(2 * t), 0.5 * np.sin(3 * t), G),
    )
    errors = []
    for step in (0.02, 0.01):
        at_base = mounted_loads(([0.0] * 3, [0.0] * 3), step, *drive)
        elsewhere = mounted_loads(MOUNT, step, *drive)
        # the state part: the feed-through uses a backward difference, first order in the step
        engine_difference = (elsewhere - at_base)[:, :2]
        errors.append(np.abs(engine_difference).max() / np.abs(at_base[:, :2]).max())
    assert errors[0] < 0.02
    assert errors[1] < 0.6 * errors[0]


def test_loads_move_with_the_output_frame():
    drive = (lambda t: (np.sin(t), 0.3 * np.sin(2 * t), G), lambda t: (0.0, 0.0, 0.1 * t))
    pose = {'tank__xyz': [1.0, 2.0, 3.0], 'tank__rpy': [0.0, 0.0, 0.5], 'tank__modes': 12}
    times = stamps(2.0, 0.01)
    in_base = feed(engine_of(**pose), times, *drive)
    in_tank = feed(engine_of(**pose, frames__output='tank_link'), times, *drive)
    mount = Pose.from_xyz_rpy(np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, 0.5]))
    for a, b in ((wrenches(in_base), wrenches(in_tank)), (totals(in_base), totals(in_tank))):
        force = b[:, :3] @ mount.rotation.T
        moment = b[:, 3:] @ mount.rotation.T + np.cross(mount.origin, force)
        np.testing.assert_allclose(a, np.hstack([force, moment]), atol=1e-6)


def test_coupling_matrix_is_the_feed_through_of_the_wrench():
    """A jump in acceleration changes the wrench by A (s, alpha), the state wrench by nothing."""
    engine = engine_of(tank__xyz=[1.0, 0.5, 2.0])
    *_, before = feed(engine, stamps(0.1, 0.01), REST)
    jump = np.array([0.7, -0.4, 0.2])
    ((_, after),) = [
        engine.feed(MotionSample.from_imu(START + SECOND // 10 + 1, [*jump + REST], [0.0] * 3))
    ]
    np.testing.assert_allclose(after.state, before.state, atol=1e-3)
    np.testing.assert_allclose(
        after.wrench - before.wrench,
        engine.carried.coupling @ [*jump, 0, 0, 0],
        rtol=1e-6,
        atol=1e-3,
    )
    symmetric = engine.carried.coupling.T
    np.testing.assert_allclose(engine.carried.coupling, symmetric, rtol=1e-12, atol=1e-9)


def test_mirrored_drive_gives_mirrored_loads():
    """Y -> -y: forces and moments change as a vector and an axial vector do."""
    drive = (
        lambda t: (np.sin(t), 0.3 * np.sin(2 * t), G),
        lambda t: (0.05 * t, 0.02 * t, 0.1 * t),
    )
    mirrored = (
        lambda t: (np.sin(t), -0.3 * np.sin(2 * t), G),
        lambda t: (-0.05 * t, 0.02 * t, -0.1 * t),
    )
    times = stamps(3.0, 0.01)
    sign = np.array([1, -1, 1, -1, 1, -1])
    for part in (wrenches, totals):
        a, b = part(feed(engine_of(), times, *drive)), part(feed(engine_of(), times, *mirrored))
        np.testing.assert_allclose(a * sign, b, atol=1e-7)


def test_two_half_tanks_weigh_as_one_and_slosh_less():
    """A dividing wall: the same liquid, a quarter of the length squared, far less surge."""
    half = {k.replace('tank.', 'front.'): v for k, v in RECTANGLE.items()}
    half |= {k.replace('tank.', 'rear.'): v for k, v in RECTANGLE.items()}
    half |= {'tanks': ['front', 'rear'], 'front.length': 4.0, 'rear.length': 4.0}
    half |= {'front.xyz': [2.0, 0.0, 0.0], 'rear.xyz': [-2.0, 0.0, 0.0]}
    times = stamps(8.0, 0.01)
    brake = lambda t: (-0.981 * min(t / 0.5, 1.0), 0.0, G)  # noqa: E731
    one = feed(engine_of(), times, brake)
    two = feed(SloshEngine(SloshConfig.from_parameters(half)), times, brake)
    assert totals(two)[0, 2] == pytest.approx(totals(one)[0, 2])
    assert np.abs(wrenches(two)[:, 4]).max() < 0.4 * np.abs(wrenches(one)[:, 4]).max()


def test_twist_agrees_with_the_imu_on_a_level_road():
    """Surge and a steady bend, known as velocity or as specific force."""
    times = stamps(10.0, 0.01)
    speed = lambda t: 10.0 + 2.0 * np.sin(t)  # noqa: E731
    yaw = lambda t: 0.1 * (1 - np.cos(0.7 * t))  # noqa: E731
    imu = feed(
        engine_of(tank__xyz=[2.0, 0.0, 1.0]), times,
        lambda t: (2.0 * np.cos(t), speed(t) * yaw(t), G), lambda t: (0.0, 0.0, yaw(t)),
    )  # fmt: skip
    engine = engine_of(tank__xyz=[2.0, 0.0, 1.0], input__source='twist')
    # at the first sample a twist knows no acceleration; the engine takes the tank as unaccelerated
    twist = [
        engine.feed(
            MotionSample.from_twist(
                stamp,
                [speed((stamp - START) / SECOND), 0.0, 0.0],
                [0.0, 0.0, yaw((stamp - START) / SECOND)],
            )
        )[1]
        for stamp in times
    ]
    for part in (wrenches, totals):
        a, b = part(imu)[1:], part(twist)[1:]
        assert np.abs(a - b).max(axis=0) == pytest.approx(0, abs=0.012 * np.abs(a).max())


@pytest.mark.parametrize('pace', [0.5, 3.0])
def test_twist_and_imu_differ_by_the_stated_bound(pace):
    """MotionSample.from_twist: (Omega h)^2/6 of the state, h/2 of delay in the feed-through."""
    speed = lambda t: 10.0 + 2.0 * np.sin(pace * t)  # noqa: E731
    sway = lambda t: 0.3 * np.sin(0.5 * pace * t) ** 2  # noqa: E731
    yaw = lambda t: 0.1 * (1.0 - np.cos(0.7 * pace * t))  # noqa: E731

    def force(t: float) -> tuple[float, float, float]:
        surging = 2.0 * pace * np.cos(pace * t) - yaw(t) * sway(t)
        swaying = 0.15 * pace * np.sin(pace * t) + yaw(t) * speed(t)
        return surging, swaying, G

    errors = []
    for step in (0.1, 0.05):
        times = stamps(20.0, step)
        imu, twist = (
            engine_of(tank__xyz=[2.0, 0.0, 1.0], tank__damping_ratio=0.02, input__source=source)
            for source in ('imu', 'twist')
        )
        felt = feed(imu, times, force, lambda t: (0.0, 0.0, yaw(t)))
        seen = []
        for stamp in times:
            t = (stamp - START) / SECOND
            sample = MotionSample.from_twist(stamp, [speed(t), sway(t), 0.0], [0.0, 0.0, yaw(t)])
            seen.append(twist.feed(sample)[1])
        one, two = (np.array([loads.state for loads in run])[1:] for run in (felt, seen))
        peak = np.abs(one).max(axis=0) + 1e-9
        errors.append((np.abs(two - one).max(axis=0) / peak).max())
        assert errors[-1] < (pace * step) ** 2 / 6.0
        # what follows the acceleration: A (s, alpha), half a step late
        acceleration = np.array(
            [[*force(t), 0.0, 0.0, 0.07 * pace * np.sin(0.7 * pace * t)]
             for t in np.arange(0.0, 20.0, 0.01)]
        )  # fmt: skip
        passed = acceleration @ imu.carried.coupling.T
        changes = np.abs(np.gradient(passed, 0.01, axis=0)).max(axis=0)
        # an IMU engine differentiates the rate backwards as well; only s is late against it
        late = np.abs((wrenches(seen) - wrenches(felt))[1:] - (two - one)).max(axis=0)
        assert np.all(late < 1.05 * step / 2.0 * changes + 1e-6 * peak.max())
        assert late[0] > 0.5 * step / 2.0 * changes[0]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


def test_twist_does_not_see_pitch_roll_and_heave():
    engine = engine_of(input__source='twist')
    for stamp in stamps(1.0, 0.01):
        _, loads = engine.feed(MotionSample.from_twist(stamp, [5.0, 0.0, 3.0], [0.3, 0.3, 0.0]))
    np.testing.assert_allclose(loads.wrench, 0.0, atol=1e-8)


def test_a_gap_is_coasted_and_a_long_one_restarts():
    engine = engine_of()
    feed(engine, stamps(1.0, 0.01), (1.0, 0.0, G))
    verdict, _ = engine.feed(MotionSample.from_imu(START + 4 * SECOND, [1.0, 0.0, G], [0.0] * 3))
    assert verdict is Verdict.COASTED
    verdict, loads = engine.feed(
        MotionSample.from_imu(START + 20 * SECOND, [1.0, 0.0, G], [0.0] * 3)
    )
    assert verdict is Verdict.RESTARTED_GAP
    assert np.all(engine.tanks[0].beta == 0.0)
    assert np.isfinite(loads.wrench).all()


@pytest.mark.parametrize('bad', [float('nan'), float('inf'), -float('inf'), 1e308])
@pytest.mark.parametrize('place', range(6))
def test_absurd_numbers_never_reach_the_state(bad, place):
    clean, dirty = engine_of(), engine_of()
    times = stamps(0.5, 0.01)
    for k, stamp in enumerate(times):
        fields = [1.0, 0.2, G, 0.01, 0.02, 0.03]
        expected = clean.feed(MotionSample.from_imu(stamp, fields[:3], fields[3:]))[1]
        if k % 7 == 3:
            spoilt = fields.copy()
            spoilt[place] = bad
            verdict, loads = dirty.feed(MotionSample.from_imu(stamp - 1, spoilt[:3], spoilt[3:]))
            assert not verdict.accepted
            assert loads is None
        got = dirty.feed(MotionSample.from_imu(stamp, fields[:3], fields[3:]))[1]
        assert np.array_equal(got.wrench, expected.wrench)


def test_rejections_are_counted_by_reason():
    engine = engine_of()
    for stamp in (0, START, START, START - 5, START + 9, START - 2 * SECOND):
        engine.feed(MotionSample.from_imu(stamp, [0.0, 0.0, G], [0.0] * 3))
    assert engine.gate.counts == {
        Verdict.ZERO_STAMP: 1,
        Verdict.STARTED: 1,
        Verdict.DUPLICATE: 1,
        Verdict.LATE: 1,
        Verdict.ACCEPTED: 1,
        Verdict.RESTARTED_BACKWARD: 1,
    }


def test_loads_are_those_of_theory_in_random_motion():
    """THEORY 2.2 written out for the rectangle, with J_0 and z_c from its closed forms."""
    rng = np.random.default_rng(5)
    engine = engine_of(tank__damping_ratio=0.05, tank__modes=6)
    c = engine.tanks[0].coefficients
    j44, j55, j66 = 4211.354445, 58172.951633, 49432.353388  # THEORY 3, about O
    z_c = -0.4
    parts = {name: c.coupling[:, k] for k, name in enumerate(('l1', 'l2', 'l3', 'l4', 'l5', 'l6'))}
    step = 0.01
    rate = np.zeros(3)
    for k in range(200):
        force = rng.normal(size=3) + REST
        new_rate = rate + 0.01 * rng.normal(size=3)
        alpha = (new_rate - rate) / step if k else np.zeros(3)
        rate = new_rate
        stamp = START + round(k * step * SECOND)
        _, loads = engine.feed(MotionSample.from_imu(stamp, force.tolist(), rate.tolist()))
        beta, velocity = engine.tanks[0].beta, engine.tanks[0].beta_rate
        # eq (8)-(9), the IMU at O
        forcing = c.coupling[:, :3] @ force + c.coupling[:, 3:] @ alpha
        acceleration = -(2 * 0.05 * c.omega * velocity + c.omega**2 * beta + forcing / c.mu)
        slosh = -c.coupling.T @ acceleration
        slosh[3] -= G * parts['l2'] @ beta
        slosh[4] += G * parts['l1'] @ beta
        np.testing.assert_allclose(loads.wrench, slosh, atol=1e-6 * np.abs(slosh).max())
        (sx, sy, sz), (a4, a5, a6) = force, alpha
        surge, sway = np.diag(c.static_residual)
        rigid = [
            -MASS * (sx + z_c * a5),
            -MASS * (sy - z_c * a4),
            -MASS * sz,
            MASS * z_c * sy - j44 * a4 + sway * sy,
            -MASS * z_c * sx - j55 * a5 - surge * sx,
            -j66 * a6,
        ]
        np.testing.assert_allclose(loads.total - loads.wrench, rigid, rtol=1e-6, atol=1e-3)


def test_beta_acceleration_is_the_derivative_of_beta_rate():
    """The loads' beta'' and the integrated motion are of one liquid, damping included."""
    engine = engine_of(tank__damping_ratio=0.2, tank__modes=1)
    c = engine.tanks[0].coefficients
    step, speeds, forces = 0.001, [], []
    for k in range(3000):
        t = k * step
        force = [np.sin(2 * t), 0.0, G]
        _, loads = engine.feed(MotionSample.from_imu(START + round(t * SECOND), force, [0.0] * 3))
        speeds.append(engine.tanks[0].beta_rate[0])
        forces.append(loads.wrench[0])
    from_speed = -c.coupling[0, 0] * np.gradient(speeds, step)
    np.testing.assert_allclose(forces[5:-5], from_speed[5:-5], atol=1e-4 * np.abs(forces).max())


@pytest.mark.parametrize('gravity', ['constant', 'measured'])
def test_wrenches_of_tanks_add_up(gravity):
    """Also where gravity is measured and the waves move at another pace."""
    rear = {name.replace('tank.', 'rear.'): value for name, value in RECTANGLE.items()}
    engine = engine_of(
        tanks=['tank', 'rear'], model__gravity=gravity, tank__xyz=[3.0, 0.1, 1.0],
        rear__xyz=[-4.0, 0.0, 1.2], rear__rpy=[0.0, 0.0, 0.5], **rear,
    )  # fmt: skip
    loads = feed(engine, stamps(2.0, 0.01), (-0.8, 0.5, G + 2.0))[-1]
    shares = [tank.wrench for tank in engine.tanks]
    np.testing.assert_allclose(np.sum(shares, axis=0), loads.wrench, rtol=1e-12, atol=1e-9)
    assert min(np.abs(share[:2]).max() for share in shares) > 100.0


def test_force_of_a_tank_at_rest_is_what_moves_the_mass_centre():
    """Newton: F = -m c'' of all the liquid, in two tanks, one turned, whatever the damping."""
    rear = {
        name.replace('tank.', 'rear.'): value for name, value in (RECTANGLE | CYLINDER).items()
        if name not in ('tank.width', 'tank.height', 'tank.fill_depth')
    }  # fmt: skip
    engine = engine_of(
        tanks=['tank', 'rear'], tank__damping_ratio=0.05, tank__xyz=[3.0, 0.1, 1.0],
        tank__rpy=[0.0, 0.0, 0.5], rear__xyz=[-4.0, 0.0, 1.2], **rear,
    )  # fmt: skip
    feed(engine, stamps(1.0, 0.01), (-0.8, 0.5, G))
    step, centres, forces = 0.002, [], []
    for stamp in stamps(3.0, step):
        loads = feed(engine, [stamp + 2 * SECOND], REST)[0]
        centres.append(engine.centre_of_mass)
        forces.append(loads.wrench[:3])
    accelerations = np.diff(centres, 2, axis=0) / step**2
    forces = np.array(forces)[1:-1]
    np.testing.assert_allclose(
        forces, -engine.carried.mass * accelerations, atol=2e-3 * np.abs(forces).max()
    )


@pytest.mark.parametrize(('axis', 'side'), [(0, 8.0), (1, 2.0)])
def test_mass_centre_of_a_tilted_tank_moves_by_the_wedge(axis, side):
    """I/V times the slope: L^2/(12 d); it lies at the frozen centroid before anything moves."""
    engine = engine_of(tank__damping_ratio=0.3, tank__modes=80, frames__output='tank_link')
    tilt = np.radians(2.0)
    feed(engine, stamps(0.0, 0.05), REST)
    at_rest = engine.centre_of_mass
    np.testing.assert_allclose(at_rest, engine.carried.centroid, atol=1e-12)
    force = np.array([0.0, 0.0, G * np.cos(tilt)])
    force[axis] = -G * np.sin(tilt)  # this side down
    feed(engine, [s + SECOND for s in stamps(120.0, 0.05)], tuple(force))
    shift = engine.centre_of_mass - at_rest
    assert shift[axis] == pytest.approx(np.sin(tilt) * side**2 / (12 * 0.8), rel=1e-3)
    assert np.delete(shift, axis) == pytest.approx(0.0, abs=1e-9)


def test_memory_does_not_grow_with_the_drive():
    """Twenty thousand samples, good and bad, through two tanks; `make soak` drives a million."""
    engine = SloshEngine(SloshConfig.from_parameters(
        {f'{name}.{key.removeprefix("tank.")}': value
         for name in ('front', 'rear') for key, value in RECTANGLE.items()}
        | {'tanks': ['front', 'rear'], 'rear.xyz': [-9.0, 0.0, 0.0]}
    ))  # fmt: skip

    def go(samples: range) -> None:
        for k in samples:
            force = [np.nan if k % 50 == 49 else 0.3 * np.sin(0.01 * k), 0.1, G]
            # jumps and gaps as well: each verdict is to leave nothing behind
            stamp = START + k * 10_000_000 + (3 * SECOND if k % 1000 < 500 else 0)
            engine.feed(MotionSample.from_imu(stamp, force, [0.0, 0.01, 0.02]))

    go(range(2000))  # warm
    tracemalloc.start()
    try:
        before = tracemalloc.take_snapshot()
        go(range(2000, 22_000))
        growth = sum(
            d.size_diff for d in tracemalloc.take_snapshot().compare_to(before, 'filename')
        )
    finally:
        tracemalloc.stop()
    assert len(engine.gate.counts) > 3
    assert growth < 20_000  # bytes, a byte a sample: what caches and the counters need
