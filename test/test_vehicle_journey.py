"""When the wheels meet the bump, when the truck stops, and what the inputs are between."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import inf

import numpy as np
import pytest

from slosh_ros.vehicle import Bump, Journey, Manoeuvre, Truck, TruckParameters

TRUCK = Truck(TruckParameters.corrected())
BRAKING = Manoeuvre.braking(10.0, 0.98)


@pytest.mark.parametrize(
    ('manoeuvre', 'entries'),
    [
        (BRAKING, [1.0172, 1.5814, 2.7913, 2.9621]),
        (Manoeuvre.accelerating(0.98), [4.518, 5.570, 7.186, 7.369]),
        (Manoeuvre.accelerating(1.96), [3.194, 3.938, 5.081, 5.211]),
    ],
    ids=['braking', '0.1 g', '0.2 g'],
)
def test_wheels_meet_the_bump_when_the_paper_says(
    manoeuvre: Manoeuvre, entries: list[float]
) -> None:
    contacts = Journey(TRUCK, manoeuvre, Bump(0.2)).contacts
    np.testing.assert_allclose([c.entry for c in contacts], entries, atol=5e-4)
    assert [c.axle for c in contacts] == [1, 2, 3, 4]


def test_contacts_are_where_the_distances_say() -> None:
    journey = Journey(TRUCK, BRAKING, Bump(0.2, span=3.7, start=10.0))
    for contact, offset in zip(journey.contacts, [0.0, 5.2, 15.3, 16.61], strict=True):
        assert BRAKING.motion(contact.entry)[0] == pytest.approx(10.0 + offset, abs=1e-12)
        assert BRAKING.motion(contact.exit)[0] == pytest.approx(13.7 + offset, abs=1e-12)


def test_truck_halts_for_good() -> None:
    stop = 10.0 / 0.98 + 1.0
    assert BRAKING.knots[-1] == pytest.approx(11.204, abs=5e-4)
    distance, speed, acceleration = BRAKING.motion(stop + 1e-9)
    assert (speed, acceleration) == (0.0, 0.0)
    assert BRAKING.motion(1e3)[0] == distance
    assert distance == pytest.approx(10.0 * stop / 2.0, rel=1e-12)  # the pulse is symmetric


def test_axles_that_stop_short_of_the_bump_never_meet_it() -> None:
    halt = BRAKING.motion(20.0)[0]
    journey = Journey(TRUCK, BRAKING, Bump(0.2, start=halt - 6.0))
    assert [np.isfinite(c.entry) for c in journey.contacts] == [True, True, False, False]
    assert [np.isfinite(c.exit) for c in journey.contacts] == [True, False, False, False]
    assert journey.contacts[3].entry == inf
    assert len(journey.events) == 3 + 3  # kinks and edges


def test_events_are_sorted_and_complete() -> None:
    journey = Journey(TRUCK, BRAKING, Bump(0.2))
    assert np.all(np.diff(journey.events) > 0.0)
    assert len(journey.events) == 3 + 8


def test_speed_is_the_integral_of_the_acceleration() -> None:
    manoeuvre = Manoeuvre.from_knots(3.0, (0.0, 1.0, 2.5, 4.0), (0.5, -1.0, 2.0, 0.25))
    t = np.linspace(0.0, 6.0, 60001)
    distance, speed, half, jerk = manoeuvre.taylor(t).T
    np.testing.assert_allclose(
        2.0 * half[[0, 10000, 25000, 40000, 60000]], [0.5, -1, 2, 0.25, 0.25]
    )
    np.testing.assert_allclose(np.gradient(distance, t)[1:-1], speed[1:-1], atol=1e-7)
    smooth = np.abs((t + 5e-5) % 0.5) > 2e-4  # the knots are multiples of 0.5 s
    np.testing.assert_allclose(
        np.gradient(speed, t)[smooth][1:-1], 2 * half[smooth][1:-1], atol=1e-7
    )
    assert 6.0 * jerk[5000] == pytest.approx(-1.5)


@pytest.mark.parametrize(
    'build',
    [
        lambda: Manoeuvre.from_knots(1.0, (0.0,), (-0.1,)),
        lambda: Manoeuvre.from_knots(0.0, (0.0, 1.0, 2.0), (-1.0, 1.0, 0.0)),
        lambda: Manoeuvre.accelerating(-1.0, speed=1.0),
    ],
)
def test_truck_never_reverses(build: Callable[[], Manoeuvre]) -> None:
    with pytest.raises(ValueError, match='backwards'):
        build()


def test_dip_of_the_speed_below_zero_inside_a_piece_is_seen() -> None:
    # speed 0.4 - t + t^2/2 is lowest, -0.1 m/s, at t = 1 s, and 0.4 m/s at both knots
    with pytest.raises(ValueError, match='backwards'):
        Manoeuvre.from_knots(0.4, (0.0, 2.0), (-1.0, 1.0))


@pytest.mark.parametrize(('knots', 'a'), [((0.0, 0.0), (1, 1)), ((1.0,), (1,)), ((0.0,), (1, 2))])
def test_disordered_knots_are_refused(knots: tuple[float, ...], a: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match='knots'):
        Manoeuvre.from_knots(5.0, knots, a)


def test_braking_too_gentle_for_its_ramp_is_refused() -> None:
    with pytest.raises(ValueError, match='shorten the ramp'):
        Manoeuvre.braking(1.0, 2.0, ramp=1.0)


def test_bump_is_the_parabola_of_eq_39() -> None:
    h = 0.2
    bump = Bump(h)
    x = np.linspace(0.0, 3.69, 50)
    printed = -400.0 / 1369.0 * h * x**2 + 40.0 / 37.0 * h * x
    np.testing.assert_allclose(bump.elevation(10.0 + x), printed, atol=1e-15)
    assert bump.elevation(np.array(11.85)) == pytest.approx(h)
    np.testing.assert_array_equal(bump.elevation(np.array([0.0, 9.99, 13.71, 50.0])), 0.0)
    np.testing.assert_array_equal(bump.slope(np.array([9.99, 13.71])), 0.0)
    np.testing.assert_allclose(bump.slope(np.array([10.0, 13.7 - 1e-9])), [0.8 / 3.7, -0.8 / 3.7])


def test_bump_behind_the_truck_or_without_length_is_refused() -> None:
    with pytest.raises(ValueError, match='ahead of axle 1'):
        Bump(0.2, start=-1.0)
    with pytest.raises(ValueError, match='span'):
        Bump(0.2, span=0.0)


def test_input_polynomials_are_the_road_under_the_wheels() -> None:
    bump = Bump(0.2)
    journey = Journey(TRUCK, BRAKING, bump)
    p = TRUCK.parameters
    for left, right in pairwise(journey.edges(0.0, 12.0)):
        tau = (right - left) * np.array([0.1, 0.5, 0.9])
        inputs = journey.inputs(np.array([left]), (left + right) / 2.0)[0]
        values = np.polynomial.polynomial.polyval(tau, inputs)
        for k, t in enumerate(left + tau):
            distance, speed, acceleration = BRAKING.motion(t)
            under = distance - p.wheel_offsets
            force = p.axle_stiffness * bump.elevation(under)
            force += p.axle_damping * bump.slope(under) * speed
            np.testing.assert_allclose(values[:4, k], force, rtol=1e-9, atol=1e-6)
            assert values[4, k] == pytest.approx(acceleration, abs=1e-12)
