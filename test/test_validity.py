"""How far to trust linear theory, held against two-phase CFD and a measurement."""

from __future__ import annotations

import csv
from collections.abc import Callable

import numpy as np
import pytest
from conftest import REPOSITORY

from slosh_ros.engine import Loads, MotionSample, SloshConfig, SloshEngine
from slosh_ros.hydro import coefficients_of
from slosh_ros.modal.validity import (
    AMPLIFICATION_MAX,
    Criterion,
    Trust,
    TrustWatch,
    surface_room,
    wave_numbers,
)
from slosh_ros.tank import cylinder_x, rectangular

DATA = REPOSITORY / 'slosh_ros' / 'study' / 'data'
G = 9.81


def drive(
    acceleration: Callable[[float], float], time: np.ndarray, rate: float = 0.0, **tank: object
) -> list[Loads]:
    """Feed a forward acceleration [m/s^2] to a tank of half fill unless told otherwise."""
    given = {'fill_ratio': 0.5, 'modes': 24, **tank}
    parameters = {f'tank.{key}': value for key, value in given.items()}
    engine = SloshEngine(SloshConfig.from_parameters({**parameters, 'frames.output': 'tank_link'}))
    loads = []
    for t in time.tolist():
        sample = MotionSample.from_imu(
            10**9 + round(t * 1e9), [acceleration(t), 0.0, G], [0.0, 0.0, rate]
        )
        loads.append(engine.feed(sample)[1])
    return loads


def cfd(name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time [s], acceleration of the tank [m/s^2] and force Fx of a computation."""
    with (DATA / 'cfd' / f'{name}.csv').open() as file:
        rows = np.array([row[:3] for row in list(csv.reader(file))[1:]], dtype=float)
    return rows[:, 0], rows[:, 1], rows[:, 2]


RECTANGLE = {'shape': 'rectangular', 'length': 8.0, 'width': 1.0, 'height': 1.6}
CYLINDER = {'shape': 'cylinder_x', 'radius': 1.2, 'length': 5.75}


@pytest.mark.parametrize(
    ('name', 'tank', 'mild'),
    [
        ('rectangle_8m_0p005g', RECTANGLE, True),
        ('rectangle_8m_0p02g', RECTANGLE, True),
        ('rectangle_8m_0p1g', RECTANGLE, False),
        ('rectangle_8m_0p2g', RECTANGLE, False),
        ('cylinder_braking_0p1g', CYLINDER, True),
    ],
)
def test_the_verdict_turns_before_cfd_leaves_linear_theory(
    name: str, tank: dict[str, object], mild: bool
) -> None:
    time, acceleration, force = cfd(name)
    loads = drive(lambda t: float(np.interp(t, time, acceleration)), time, **tank)
    linear = np.array([one.total[0] for one in loads])
    settled = time > 0.1
    off = np.abs(linear - force) / np.abs(linear).max()
    error = np.sqrt(np.mean(off[settled] ** 2) / np.mean((linear / np.abs(linear).max()) ** 2))
    valid = np.array([one.valid for one in loads])
    if mild:
        assert error < 0.05
        assert valid.all()
    else:
        assert error > 0.2
        turned, wrong = time[np.argmin(valid)], time[np.argmax(settled & (off > 0.05))]
        assert turned < wrong
        worst = max((one.trust for one in loads), key=Trust.use)
        assert worst.criterion is Criterion.WAVE


def test_near_resonance_theory_is_left_at_waves_that_are_fine_elsewhere() -> None:
    time = np.arange(0.0, 60.0, 0.02)
    tank = {**RECTANGLE, 'length': 2.0, 'height': 2.0}
    omega = np.sqrt(G * np.pi / 2.0 * np.tanh(np.pi / 2.0))
    at, off = (
        drive(lambda t, w=w: 0.01 * G * np.sin(w * t), time, **tank) for w in (omega, 0.7 * omega)
    )
    assert all(one.valid for one in off)
    first = [one.valid for one in at].index(False)
    assert at[first].trust.criterion is Criterion.RESONANCE
    highest = max(one.elevation_max for one in at[:first])
    # the tilted surface of 0.01 g, amplified ten times and more, yet far from roof and bottom
    assert 10.0 * 0.01 * 1.0 < highest < 0.3


def test_a_decaying_wave_is_not_near_resonance() -> None:
    time = np.arange(0.0, 60.0, 0.02)
    loads = drive(
        lambda t: 0.05 * G * (t < 5.0), time, **{**RECTANGLE, 'height': 4.0}, damping_ratio=0.02
    )
    assert all(one.valid for one in loads)


@pytest.mark.parametrize('rate', [0.2, 0.6])
def test_fast_turning_is_outside_linear_theory(rate: float) -> None:
    # centripetal acceleration at the end of the tank: 0.016 and 0.15 g
    loads = drive(lambda _: 0.0, np.arange(0.0, 1.0, 0.01), rate, **RECTANGLE)
    assert loads[-1].valid == (rate == 0.2)
    if rate == 0.6:
        assert loads[-1].trust.criterion is Criterion.SPIN
        assert loads[-1].trust.value == pytest.approx(rate**2 * 4.0 / G, rel=1e-3)


def test_a_film_is_never_within_linear_theory() -> None:
    tank = {**RECTANGLE, 'fill_ratio': 0.1}  # 0.16 m under 8 m of surface
    loads = drive(lambda _: 0.0, np.arange(0.0, 0.1, 0.01), **tank)
    assert not loads[-1].valid
    assert loads[-1].trust.criterion is Criterion.SHALLOW


def test_a_wave_uses_up_the_freeboard_of_a_full_tank() -> None:
    time = np.arange(0.0, 4.0, 0.01)
    uses = [
        max(one.trust.use() for one in drive(lambda _: 0.02 * G, time, fill_ratio=f, **RECTANGLE))
        for f in (0.5, 0.9)
    ]
    assert uses[1] > 2.0 * uses[0]


def test_waves_on_sloping_walls_change_the_surface() -> None:
    # half full, the width 2 sqrt(R^2 - z^2) has lost a quarter at z = 0.66 R; upright walls: never
    circle, box = cylinder_x(1.0, 5.0), rectangular(5.0, 2.0, 2.0)
    assert surface_room(circle, 1.0) == pytest.approx(np.sqrt(1.0 - 0.75**2), rel=0.01)
    assert surface_room(box, 1.0) == np.inf
    # at 0.1 R the half-width sqrt(2 z - z^2) loses a quarter 0.0444 R lower
    low = 0.1
    width = 0.75 * np.sqrt(2.0 * low - low**2)
    assert surface_room(circle, low) == pytest.approx(
        low - (1.0 - np.sqrt(1.0 - width**2)), rel=0.02
    )


def test_wave_numbers_obey_the_dispersion_relation() -> None:
    k = np.array([1e-3, 0.1, 1.0, 5.0, 40.0])
    assert wave_numbers(np.sqrt(G * k * np.tanh(k * 0.7)), 0.7) == pytest.approx(k, rel=1e-9)


def test_the_wave_of_faltinsen_2000_is_beyond_linear_theory() -> None:
    # T = 1.3 s in a tank of 1.67 s, amplitude 0.032 m: measured crests beat troughs by far
    with (DATA / 'slosh_experiments' / 'faltinsen2000_wave_height.csv').open() as file:
        rows = np.array(list(csv.reader(file))[1:], dtype=float)
    asymmetry = rows[:, 1].max() / -rows[:, 1].min()
    w = 2.0 * np.pi / 1.3
    tank = {'shape': 'rectangular', 'length': 1.73, 'width': 0.2, 'height': 1.2}
    loads = drive(lambda t: -0.032 * w**2 * np.cos(w * t), np.arange(0.0, 10.0, 0.01), **tank)
    assert asymmetry > 1.3  # of linear theory: 1.07
    worst = max((one.trust for one in loads), key=Trust.use)
    assert not worst.valid
    assert worst.criterion is Criterion.SLOPE


def test_a_wave_that_no_forcing_made_has_a_bounded_amplification():
    """A jerk of yaw moves modes that no acceleration ever drove."""
    engine = SloshEngine(SloshConfig.from_parameters(
        {f'tank.{key}': value for key, value in RECTANGLE.items()} | {'tank.fill_ratio': 0.5}
    ))  # fmt: skip
    c = engine.tanks[0].coefficients
    watch = TrustWatch([(engine.config.tanks[0].tank, c)])
    still = np.zeros(len(c.omega))
    trust = watch.judge([0.0], still + 1e3, still, 0.01, 0.0)
    assert trust.criterion is Criterion.RESONANCE
    steepness = wave_numbers(c.omega, c.liquid.depth).max() * 1e3
    assert trust.value == pytest.approx(AMPLIFICATION_MAX * steepness**2)


@pytest.mark.parametrize(('before', 'after'), [(0.5, 0.3), (0.3, 0.5)])
def test_what_has_driven_the_waves_is_remembered_through_another_fill(before: float, after: float):
    """After hours, as after seconds: the fill changes how fast it fades, not what it is."""
    tank = cylinder_x(1.0, 6.0)
    liquids = [
        (tank, coefficients_of(tank, tank.depth(fill), 1000.0, 1)) for fill in (before, after)
    ]
    one, other = (TrustWatch([liquid]) for liquid in liquids)
    c = liquids[0][1]
    high = 0.2 / wave_numbers(c.omega, c.liquid.depth)  # at a steepness of 0.2
    forcing, still = 0.9 * high * c.omega**2, 0.0 * high
    assert other.judge([0.0], high, still, 0.01, 0.0).criterion is Criterion.RESONANCE
    other.start()
    one.judge([0.0], high, forcing, 5e4, 0.0)
    other.resume(one)
    assert other.judge([0.0], high, still, 0.01, 0.0).criterion is Criterion.SLOPE


def test_many_instants_are_judged_as_one_by_one() -> None:
    """To the last bit where resonance decides, and what has driven the waves fades meanwhile."""
    tank = cylinder_x(1.0, 6.0)
    c = coefficients_of(tank, tank.depth(0.5), 1000.0, 3)
    alone, at_once = (TrustWatch([(tank, c)]) for _ in range(2))
    rng, count = np.random.default_rng(1), 200
    intervals = rng.uniform(0.5, 2.0, count).tolist()
    high = 0.24 / wave_numbers(c.omega, c.liquid.depth)
    driving = rng.uniform(-1.0, 1.0, (count, 3)) ** 45 * high * c.omega**2
    envelope = rng.uniform(0.5, 1.0, (count, 3)) * high
    spin = np.zeros(count)
    expected = [alone.follow(*row) for row in zip(envelope, driving, intervals, spin, strict=True)]
    for part in (slice(0, 90), slice(90, count)):
        found = at_once.follow_all(envelope[part], driving[part], intervals[part], spin[part])
        trusts = expected[part]
        assert [found[k] for k in range(len(trusts))] == trusts
        assert found.mild.tolist() == [trust.valid for trust in trusts]
    near = [trust for trust in expected if trust.criterion is Criterion.RESONANCE]
    assert 10 < len(near) < count  # of the rest, the slope decides: they were driven lately
