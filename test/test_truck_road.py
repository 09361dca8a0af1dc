"""Roads and steering of the general truck."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.signal import csd, welch

from slosh_ros.vehicle import (
    Bump,
    Drive,
    GeneralTruck,
    Manoeuvre,
    Profile,
    Road,
    SineSteering,
    SloshingCargo,
    SteeringKnots,
    random_road,
    simulate_general,
)

CRUISING = Manoeuvre.from_knots(10.0, (0.0,), (0.0,))
SOLID = SloshingCargo.none()
TRUCK = GeneralTruck()


@pytest.mark.parametrize(('grade', 'roughness'), [('A', 16e-6), ('C', 256e-6), ('E', 4096e-6)])
def test_random_road_has_the_psd_of_its_class(grade: str, roughness: float) -> None:
    road = random_road(grade, 20_000.0, seed=3)
    for track in (road.left, road.right):
        assert isinstance(track, Profile)
        n, psd = welch(track.height, fs=10.0, nperseg=2048)
        band = (n > 0.02) & (n < 0.9)
        expected = roughness * (n[band] / 0.1) ** -2.0
        # in thirds of a decade the scatter of the estimate averages out
        for part in np.array_split(np.arange(band.sum()), 6):
            assert np.mean(psd[band][part] / expected[part]) == pytest.approx(1.0, abs=0.12)


def test_tracks_of_a_random_road_agree_in_long_waves_and_differ_in_short_ones() -> None:
    road = random_road('C', 20_000.0, seed=1)
    left, right = road.left, road.right
    assert isinstance(left, Profile)
    assert isinstance(right, Profile)
    n, cross = csd(left.height, right.height, fs=10.0, nperseg=1024)
    power = [welch(t.height, fs=10.0, nperseg=1024)[1] for t in (left, right)]
    coherence = np.abs(cross) / np.sqrt(power[0] * power[1])
    assert np.all(coherence[(n > 0.01) & (n < 0.03)] > 0.9)
    assert np.mean(coherence[(n > 0.5) & (n < 0.9)]) < 0.25


def test_random_road_is_the_same_for_the_same_seed_and_begins_flat() -> None:
    one, two, other = (random_road('D', 100.0, seed=s) for s in (5, 5, 6))
    x = np.linspace(-30.0, 150.0, 999)
    np.testing.assert_array_equal(one.under(x), two.under(x))
    assert np.abs(one.under(x)[0] - other.under(x)[0]).max() > 1e-3
    np.testing.assert_allclose(one.under(np.array([-16.6, -1.0, 0.0, 200.0])), 0.0, atol=1e-15)


def test_profile_gives_back_its_points_and_the_slope_of_its_curve() -> None:
    x = np.linspace(0.0, 20.0, 81)
    profile = Profile(x, 0.05 * np.sin(np.pi * x / 20.0) ** 2)
    np.testing.assert_allclose(profile.under(x)[0], profile.height, atol=1e-15)
    between = np.linspace(0.5, 19.5, 77)
    exact = 0.05 * np.pi / 20.0 * np.sin(2.0 * np.pi * between / 20.0)
    np.testing.assert_allclose(profile.under(between)[1], exact, atol=1e-6)


def test_measured_bump_is_driven_as_the_bump() -> None:
    x = np.arange(9.0, 15.0, 0.01)
    bump = Bump(0.05)
    measured = Road.even(Profile(x, bump.elevation(x)))
    r, truth = (
        simulate_general(Drive(TRUCK, CRUISING, road=road), SOLID, 4.0)
        for road in (measured, Road.even(bump))
    )
    np.testing.assert_allclose(r.q, truth.q, atol=2e-4)
    assert np.abs(truth.q[:, 3]).max() > 0.01


def test_random_road_converges() -> None:
    drive = Drive(TRUCK, CRUISING, road=random_road('C', 100.0, seed=2))
    fine = simulate_general(drive, SOLID, 4.0, 0.04, max_step=1e-3)
    usual = simulate_general(drive, SOLID, 4.0, 0.04)
    np.testing.assert_allclose(usual.q, fine.q, atol=2e-6)
    assert np.abs(fine.q[:, 5]).max() > 1e-4


def test_one_sided_bump_rolls_to_the_other_side() -> None:
    r = simulate_general(Drive(TRUCK, CRUISING, road=Road(Bump(0.1), Bump(0.0))), SOLID, 4.0)
    on_bump = (r.road[:, 2, 0] > 0.08) & (r.time > 2.0)
    assert np.all(r.road[..., 1] == 0.0)
    assert np.all(r.q[on_bump, 5] > 0.0)  # left side up
    assert r.wheel_loads[:, 2, 0].max() > r.wheel_loads[0, 2, 0]


@pytest.mark.parametrize(
    ('position', 'height', 'words'),
    [
        ([0.0, 1.0], [0.0], 'as many heights'),
        ([0.0], [0.0], 'at least 2'),
        ([0.0, 0.0], [0.0, 1.0], 'rise'),
        ([0.0, 1.0], [0.0, np.nan], 'finite'),
    ],
)
def test_impossible_profile_is_refused(
    position: list[float], height: list[float], words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        Profile(np.array(position), np.array(height))


def test_impossible_random_road_is_refused() -> None:
    with pytest.raises(ValueError, match="road class 'Z'"):
        random_road('Z', 100.0)
    with pytest.raises(ValueError, match='random road'):
        random_road('A', 1.0)
    with pytest.raises(ValueError, match='random road'):
        random_road('A', 100.0, band=(0.1, 9.0))


def test_step_is_a_jump_or_a_ramp() -> None:
    jump, ramp = SteeringKnots.step(0.1, 2.0), SteeringKnots.step(0.1, 2.0, 1.0)
    assert jump.angle(2.0, 1.9) == 0.0
    assert jump.angle(2.0, 2.1) == 0.1
    assert jump.events == (2.0,)
    assert ramp.angle(2.5, 2.5) == pytest.approx(0.05)
    assert ramp.angle(9.0, 9.0) == 0.1


def test_roundabout_leaves_as_it_came() -> None:
    steering = SteeringKnots.roundabout(0.1, 1.0, 0.8, 6.0)
    t = np.linspace(0.0, 30.0, 30_001)
    angles = np.array([steering.angle(x, x) for x in t])
    assert trapezoid(angles, t) == pytest.approx(0.0, abs=1e-4)
    assert (angles.min(), angles.max()) == (-0.1, 0.1)
    drive = Drive(TRUCK, CRUISING, SteeringKnots.roundabout(0.05, 1.0, 0.8, 6.0))
    assert simulate_general(drive, SOLID, 30.0, 0.1).heading[-1] == pytest.approx(0.0, abs=1e-3)


def test_lane_change_is_one_period_of_a_sine() -> None:
    steering = SineSteering(0.1, 0.5, 1.0)
    assert steering.angle(1.5, 1.5) == pytest.approx(0.1)
    assert steering.angle(2.5, 2.5) == pytest.approx(-0.1)
    assert steering.angle(3.0, 3.1) == 0.0
    assert steering.events == (1.0, 3.0)


@pytest.mark.parametrize(
    ('build', 'words'),
    [
        (lambda: SteeringKnots((0.0, 1.0), (0.0,)), 'angle for each knot'),
        (lambda: SteeringKnots((1.0, 0.0), (0.0, 0.0)), 'do not fall'),
        (lambda: SteeringKnots.roundabout(0.1, 0.0, 2.0, 1.0), 'hold > rise'),
        (lambda: SineSteering(0.1, 0.0), 'frequency > 0'),
    ],
)
def test_impossible_steering_is_refused(build, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        build()
