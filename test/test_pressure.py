"""Pressure at points: it adds up to the wrench, is hydrostatic at rest, and is eq (37)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import REPOSITORY
from drives import RECTANGLE, SECOND, START, G, engine_of, feed, stamps
from numpy.typing import NDArray
from wetted import Surface, wetted

from slosh_ros.constants import GRAVITY
from slosh_ros.engine import SloshConfig, SloshEngine
from slosh_ros.engine.parameters import rows_for
from slosh_ros.errors import InputError
from slosh_ros.hydro import ModalCoefficients, coefficients_of
from slosh_ros.modal import LoadMatrices
from slosh_ros.modal.pressure import PressureMatrices
from slosh_ros.tank import Tank, cylinder_x, cylinder_z, rectangular, section_x, sphere

pytestmark = pytest.mark.dear

Array = NDArray[np.float64]

DENSITY = 850.0
TANKS = {
    'box': (rectangular(3.0, 1.6, 1.2), 0.75),
    'drum': (cylinder_z(1.2, 2.0), 0.45),
    'half-full pipe': (cylinder_x(1.125, 4.0), 0.5),
    'pipe': (cylinder_x(1.125, 4.0), 0.7),
    'ball': (sphere(1.2), 0.8),
    'prism': (section_x([0.0, 0.0, 2.0, -0.3, 2.4, 1.0, 1.1, 1.6, -0.3, 0.9], 3.0), 0.6),
}
REST = np.array([0.0, 0.0, G, 0.0, 0.0, 0.0])


@pytest.fixture(params=TANKS)
def case(request: pytest.FixtureRequest) -> tuple[Tank, float]:
    tank, fill_ratio = TANKS[request.param]
    return tank, tank.depth(fill_ratio)


def random_motion(modes: int, seed: int = 7) -> tuple[Array, Array, Array]:
    """Waves, their rates, and an acceleration of O in six degrees of freedom."""
    rng = np.random.default_rng(seed)
    share = 0.1 / (1.0 + np.arange(modes))
    return (
        share * rng.normal(size=modes),
        share * rng.normal(size=modes),
        REST + rng.normal(size=6),
    )


def integrated(
    c: ModalCoefficients, zeta: Array, wall: Surface, motion: tuple[Array, Array, Array]
) -> Array:
    """Force and moment about O of the pressure on the wetted wall."""
    pressure = PressureMatrices.of(c, zeta, wall.points).at(*motion)
    pressure = pressure - c.density * G * wall.points[:, 2]
    push = (wall.weights * pressure)[:, np.newaxis] * wall.normals
    return np.concatenate([push.sum(axis=0), np.cross(wall.points, push).sum(axis=0)])


def wrench(c: ModalCoefficients, zeta: Array, motion: tuple[Array, Array, Array]) -> Array:
    """Total wrench about O, THEORY 2.2."""
    beta, beta_rate, acceleration = motion
    loads = LoadMatrices.of(c, zeta)
    return loads.state(beta, beta_rate) + (loads.coupling + loads.rigid) @ acceleration


# --- pressure and wrench -------------------------------------------------------------------------


def test_wall_pressure_adds_up_to_force_and_moment(case: tuple[Tank, float]) -> None:
    tank, depth = case
    c = coefficients_of(tank, depth, DENSITY, 128)
    motion, none = random_motion(128), np.zeros(128)
    wall, _ = wetted(tank, depth, 120)
    found, expected = integrated(c, none, wall, motion), wrench(c, none, motion)
    for part in (slice(0, 3), slice(3, 6)):
        assert found[part] == pytest.approx(
            expected[part], abs=1e-5 * np.abs(expected[part]).max()
        )


def test_few_modes_miss_only_what_the_others_do_under_angular_acceleration(
    case: tuple[Tank, float],
) -> None:
    """
    Modes that are not kept stand still against the acceleration, in pressure and wrench alike.

    The wrench takes their hydrostatic moment under s_x and s_y into account, not that under
    alpha; the pressure has both. Damping leaves the force alone.
    """
    tank, depth = case
    c = coefficients_of(tank, depth, DENSITY, 6)
    motion = random_motion(6)
    wall, lid = wetted(tank, depth, 120)
    found, expected = integrated(c, np.zeros(6), wall, motion), wrench(c, np.zeros(6), motion)
    assert found[:3] == pytest.approx(expected[:3], abs=1e-7 * np.abs(expected[:3]).max())
    assert c.potentials is not None
    arms = (lid.weights * lid.points[:, :2].T) @ c.potentials.stokes_joukowski(lid.points)
    kept = (c.coupling[:, :2].T * (GRAVITY / (c.mu * c.omega**2))) @ c.coupling[:, 3:]
    missing = (DENSITY * arms - kept) @ motion[2][3:]
    assert found[3:] - expected[3:] == pytest.approx(
        [missing[1], -missing[0], 0.0], abs=1e-6 * np.abs(expected[3:]).max()
    )
    damped = np.full(6, 0.1)
    found, expected = integrated(c, damped, wall, motion), wrench(c, damped, motion)
    assert found[:3] == pytest.approx(expected[:3], abs=1e-7 * np.abs(expected[:3]).max())


def test_no_pressure_at_the_free_surface_when_struck(case: tuple[Tank, float]) -> None:
    """However fast it accelerates: with all modes, sum phi lambda/(kappa mu) is (r, Omega)."""
    tank, depth = case
    _, lid = wetted(tank, depth)
    left = []
    for modes in (4, 16, 64):
        c = coefficients_of(tank, depth, DENSITY, modes)
        struck = PressureMatrices.of(c, np.zeros(modes), lid.points).acceleration
        without = c.density * np.hstack(
            [lid.points, c.potentials.stokes_joukowski(lid.points)]  # type: ignore[union-attr]
        )
        square, whole = (np.sqrt(lid.weights @ part**2) for part in (struck, without))
        left.append(square[whole > 1e-9] / whole[whole > 1e-9])
    assert np.all(np.array(left[1]) < np.array(left[0]) + 1e-12)
    assert np.all(np.array(left[2]) < np.array(left[1]) + 1e-12)
    assert np.max(left[2]) < 0.1


def test_at_the_free_surface_the_pressure_is_that_of_the_wave(case: tuple[Tank, float]) -> None:
    """A free wave: p = rho g zeta at z = 0."""
    tank, depth = case
    c = coefficients_of(tank, depth, DENSITY, 8)
    beta, beta_rate, _ = random_motion(8)
    points = np.pad(c.surface_points, ((0, 0), (0, 1)))
    pressure = PressureMatrices.of(c, np.zeros(8), points).at(beta, beta_rate, REST)
    assert pressure == pytest.approx(DENSITY * G * c.surface_shapes @ beta, abs=1e-6)


# --- the engine ----------------------------------------------------------------------------------

CORNERS = {
    'tank.pressure.low_front': [4.0, 1.0, -0.8],
    'tank.pressure.high_back': [-4.0, -1.0, -0.1],
    'tank.pressure.middle': [0.5, 0.2, -0.4],
}  # sorted by name: high_back, low_front, middle


def corners(**changes: object) -> SloshEngine:
    return engine_of(**CORNERS, **changes)


def pressures(loads: list) -> Array:
    """Shape (n, p)."""
    return np.array([answer.pressure for answer in loads])


@pytest.mark.parametrize('modes', [1, 12])
def test_a_tilted_tank_at_rest_has_the_hydrostatic_pressure(modes: int) -> None:
    """As deep as below the tilted surface, at any point and with any number of modes."""
    tilt = np.radians(3.0)
    engine = corners(tank__damping_ratio=0.3, tank__modes=modes)
    up = np.array([-np.sin(tilt), 0.0, np.cos(tilt)])  # nose down
    loads = feed(engine, stamps(200.0, 0.05), tuple(G * up))
    points = np.array(
        [CORNERS[f'tank.pressure.{n}'] for n in ('high_back', 'low_front', 'middle')]
    )
    # O is the middle of the bounding box here; the tilted surface goes through it
    below = -points @ up
    level = -points[:, 2]
    assert pressures(loads)[-1] == pytest.approx(DENSITY * G * (below - level), abs=1e-6)


def test_a_level_tank_at_rest_has_none() -> None:
    assert np.all(pressures(feed(corners(), stamps(1.0, 0.01), (0.0, 0.0, G))) == 0.0)


def test_heave_presses_as_gravity_does() -> None:
    loads = feed(corners(), stamps(1.0, 0.01), lambda t: (0.0, 0.0, G + np.sin(9.0 * t)))
    heave = np.sin(9.0 * np.linspace(0.0, 1.0, 101))
    expected = DENSITY * np.outer(heave, [0.1, 0.8, 0.4])
    assert pressures(loads) == pytest.approx(expected, abs=1e-9)


def test_engine_and_matrices_agree_in_random_motion() -> None:
    """The engine's points are the user's, moved to O; an IMU at O gives the acceleration."""
    rng = np.random.default_rng(3)
    engine = corners(tank__fill_depth=0.9, tank__damping_ratio=0.05, imu__xyz=[0.0, 0.0, 0.1])
    (tank,) = engine.tanks
    points = np.array(list(tank.config.pressure_points.values())) - [0.0, 0.0, 0.1]
    matrices = PressureMatrices.of(tank.coefficients, tank.damping_ratio, points)
    rate = np.zeros(3)
    for k in range(100):
        force, last = rng.normal(size=3) + REST[:3], rate
        rate = rate + 0.01 * rng.normal(size=3)
        (loads,) = feed(engine, [START + k * SECOND // 100], force, rate)
        alpha = (rate - last) / 0.01 if k else np.zeros(3)
        expected = matrices.at(tank.beta, tank.beta_rate, np.concatenate([force, alpha]))
        assert loads.pressure == pytest.approx(expected, rel=1e-9)


def test_pressure_is_the_same_wherever_the_imu_is_and_the_wrench_goes() -> None:
    drive = (lambda t: (np.sin(t), 0.3 * np.cos(2.0 * t), G), (0.0, 0.0, 0.0))
    times = stamps(2.0, 0.01)
    here = pressures(feed(corners(), times, *drive))
    for change in ({'imu__xyz': [3.0, 0.0, 1.0]}, {'frames__output': 'tank_link'}):
        assert pressures(feed(corners(**change), times, *drive)) == pytest.approx(here)


def test_pressure_costs_nothing_where_it_is_not_asked_for() -> None:
    """Same loads to the bit; no pressure, and no potentials evaluated."""
    times, brake = stamps(1.0, 0.01), (-1.0, 0.2, G)
    without, with_points = feed(engine_of(), times, brake), feed(corners(), times, brake)
    assert all(answer.pressure.shape == (0,) for answer in without)
    for a, b in zip(without, with_points, strict=True):
        assert np.array_equal(a.total, b.total)


# --- section 4.5 of the paper --------------------------------------------------------------------

SHAKEN = {'tank__length': 0.92, 'tank__width': 0.46, 'tank__height': 0.62, 'tank__density': 1000.0}


def pitched(
    axis: float, amplitude: float, depth: float, probe: tuple[float, float], end: float = 10.0
) -> tuple[SloshEngine, Array, Array]:
    """
    Pitch the tank of the experiments as theta_0 sin(2 t) about an axis.

    Heights of axis and probe are those above the bottom; probe is x and height.

    Returns
    -------
    engine, time (n,), pressure without the hydrostatic part of the level tank (n,)
    """
    engine = engine_of(
        **SHAKEN,
        tank__fill_depth=depth, tank__modes=20, tank__xyz=[0.0, 0.0, 0.31 - axis],
        pressure__probe=[probe[0], 0.0, probe[1] - 0.31],
    )  # fmt: skip
    angle = lambda t: amplitude * np.sin(2.0 * t)  # noqa: E731
    loads = feed(
        engine, stamps(end, 0.004),
        lambda t: (-G * np.sin(angle(t)), 0.0, G * np.cos(angle(t))),
        lambda t: (0.0, 2.0 * amplitude * np.cos(2.0 * t), 0.0),
    )  # fmt: skip
    time = np.array([(answer.stamp - START) / SECOND for answer in loads])
    return engine, time, pressures(loads)[:, 0]


@pytest.mark.parametrize('fill_ratio', [0.25, 0.5])
def test_section_4_5_pitching_about_the_surface_is_eq_37(fill_ratio: float) -> None:
    """Eq (37) as printed, with beta from rest in closed form; 6 cm above the bottom, 4 degrees."""
    depth, amplitude = 0.62 * fill_ratio, np.radians(4.0)
    engine, t, found = pitched(depth, amplitude, depth, (0.46, 0.06), 6.0)
    c = engine.tanks[0].coefficients
    force, turn = c.coupling[:, 0], c.coupling[:, 4]
    eta, eta_2 = amplitude * np.sin(2.0 * t), -4.0 * amplitude * np.sin(2.0 * t)
    size = (G * force + 4.0 * turn) * amplitude / (c.mu * (c.omega**2 - 4.0))
    beta_2 = size * (
        -4.0 * np.sin(2.0 * t)[:, None] + 2.0 * c.omega * np.sin(np.outer(t, c.omega))
    )
    # phi and Omega_5 of THEORY 3, written out
    x, z = 0.46, 0.06 - depth
    kappa = c.omega**2 / G
    a = np.array([int(n[1:]) if n[0] == 'x' and 'y' not in n else 0 for n in c.names])
    k = a * np.pi / 0.92
    phi = np.cos(k * (x + 0.46)) * np.cosh(k * (z + depth)) / np.cosh(k * depth)
    m = np.arange(1, 400, 2)
    q = m * np.pi / depth
    series = 8.0 * depth / (m * np.pi) ** 2 * np.cos(q * (z + depth)) * np.tanh(q * x) / q
    omega_5 = -x * z - depth * x - series.sum()
    surge = a > 0
    expected = 1000.0 * (
        G * x * eta - omega_5 * eta_2 - (beta_2 * (phi / kappa)[None])[:, surge].sum(axis=1)
    )
    # the tilt relieves the bottom by rho g depth theta^2/2, of second order
    assert found[2:] == pytest.approx(expected[2:], abs=0.02 * np.abs(expected).max())
    assert np.abs(expected).max() > 300.0


def test_measured_pressure_in_a_pitching_tank() -> None:
    """
    Akyildiz & Unal 2006: amplitude on an end wall, 75 % full, 4 degrees at 2 rad/s.

    The height of the axis is not stated with the data. About the bottom linear theory gives the
    measured amplitude, about the middle and the surface 12 and 18 % less; the phase is 6 degrees
    early. The mean is 0.33 kPa above the hydrostatic pressure, which is the gauge's or the
    digitising's, and is left out.
    """
    data = np.genfromtxt(
        REPOSITORY / 'slosh_ros/study/data/slosh_experiments/akyildiz2006_probe2_pressure.csv',
        delimiter=',', names=True,
    )  # fmt: skip

    def harmonic(t: Array, pressure: Array) -> complex:
        basis = np.stack([np.ones_like(t), np.sin(2.0 * t), np.cos(2.0 * t)], axis=-1)
        _, in_phase, ahead = np.linalg.lstsq(basis, pressure, rcond=None)[0]
        return complex(in_phase, ahead)

    measured = harmonic(data['t_s'], 1e3 * data['pressure_kPa'])
    ratios = []
    for axis in (0.0, 0.31, 0.465):
        _, t, pressure = pitched(axis, np.radians(4.0), 0.465, (0.46, 0.17))
        ratios.append(harmonic(t, pressure) / measured)
    assert np.abs(ratios) == pytest.approx([1.0, 0.88, 0.82], abs=0.015)
    assert np.degrees(np.angle(ratios)) == pytest.approx([6.0] * 3, abs=1.0)


# --- configuration -------------------------------------------------------------------------------


def configured(**changes: object) -> SloshConfig:
    given = RECTANGLE | {name.replace('__', '.'): value for name, value in changes.items()}
    return SloshConfig.from_parameters(given)


@pytest.mark.parametrize(
    ('point', 'says'),
    [
        ([4.3, 0.0, -0.6],
         r'pressure.gauge is \(4.3, 0, -0.6\) m in the tank frame, 0.3 m outside of the tank; '
         r'its nearest wall is at \(4, 0, -0.6\) m'),
        ([4.3, -1.4, -0.9], r'0.51 m outside .* at \(4, -1, -0.8\) m'),
        ([0.0, 0.0, 0.9], r'\(0, 0, 0.9\) m .* 0.1 m outside .* at \(0, 0, 0.8\) m'),
        ([0.0, 0.0, float('nan')], 'pressure.gauge is nan'),
        ([0.0, 0.0], 'pressure.gauge has 2 numbers; it takes 3'),
        ([0.0, 0.0, 0], 'write 0.0'),
    ],
)  # fmt: skip
def test_a_point_outside_of_the_tank_is_refused(point: list[float], says: str) -> None:
    with pytest.raises(InputError, match=says):
        configured(pressure__gauge=point)


@pytest.mark.parametrize(
    ('shape', 'point', 'says'),
    [
        ({'shape': 'cylinder_x', 'radius': 1.0, 'length': 4.0}, [0.0, 0.8, -0.8],
         r'0.131 m outside .* at \(0, 0.7071, -0.7071\)'),
        ({'shape': 'cylinder_z', 'radius': 1.0, 'height': 2.0}, [0.8, -0.8, -0.5],
         r'0.131 m outside .* at \(0.7071, -0.7071, -0.5\)'),
    ],
)  # fmt: skip
def test_the_nearest_wall_of_a_round_tank_is_told(
    shape: dict[str, object], point: list[float], says: str
) -> None:
    given = {f'tank.{k}': v for k, v in shape.items()} | {'tank.fill_ratio': 0.5}
    with pytest.raises(InputError, match=says):
        SloshConfig.from_parameters(given | {'pressure.gauge': point})


def test_rounding_puts_a_point_onto_the_wall() -> None:
    """Coordinates in millimetres of a round wall are a little inside or outside."""
    given = {'tank.shape': 'cylinder_x', 'tank.radius': 1.125, 'tank.length': 4.0}
    given |= {'tank.fill_ratio': 0.5, 'pressure.gauge': [2.0004, 0.796, -0.796]}
    config = SloshConfig.from_parameters(given)
    (point,) = config.tanks[0].pressure_points.values()
    assert point[0] == 2.0
    assert np.hypot(*point[1:]) == pytest.approx(1.125, abs=1e-6)
    assert np.isfinite(
        feed(SloshEngine(SloshConfig.from_parameters(given)), [START], (1, 0, 9))[0].pressure
    )


TWO: dict[str, object] = {
    f'{name}.{key.removeprefix("tank.")}': value
    for name in ('front', 'rear')
    for key, value in RECTANGLE.items()
}
TWO |= {'tanks': ['front', 'rear'], 'rear.xyz': [-9.0, 0.0, 0.0]}


def test_points_of_several_tanks() -> None:
    """Each is of its tank; they come tank by tank, by name, whatever the order in the file."""
    points = {'rear.pressure.a': [4.0, 0.0, -0.5], 'front.pressure.z': [-4.0, 0.0, -0.5]}
    points |= {'front.pressure.b': [4.0, 0.0, -0.5]}
    config = SloshConfig.from_parameters(TWO | points)
    assert config.pressure_points == {'b': 'front_link', 'z': 'front_link', 'a': 'rear_link'}
    loads = feed(SloshEngine(config), stamps(1.0, 0.01), (-1.0, 0.0, G))
    single = feed(
        engine_of(pressure__b=[4.0, 0.0, -0.5], pressure__z=[-4.0, 0.0, -0.5]),
        stamps(1.0, 0.01),
        (-1.0, 0.0, G),
    )
    assert pressures(loads)[:, :2] == pytest.approx(pressures(single))
    assert pressures(loads)[:, 2] == pytest.approx(pressures(single)[:, 0])
    assert configured(pressure__b=[4.0, 0.0, -0.5]).pressure_points == {'b': 'tank_link'}


@pytest.mark.parametrize(
    ('points', 'says'),
    [
        ({'pressure.a': [0.0] * 3}, 'its tank; write front.pressure.a or rear.pressure.a'),
        ({'front.pressure.a': [0.0] * 3, 'rear.pressure.a': [0.0] * 3},
         'front.pressure.a and rear.pressure.a have the same name'),
        ({'front.pressure.a-b': [0.0] * 3}, "gives a point the name 'a-b'; a name has letters"),
        ({'pressure.3': [0.0] * 3}, "gives a point the name '3'"),
        ({'front.presure.a': [0.0] * 3}, 'did you mean front.pressure'),
        ({'pressure': [0.0] * 3}, 'pressure is not a parameter'),
        ({'tanks': ['pressure']}, "tanks has the name 'pressure'"),
    ],
)  # fmt: skip
def test_a_point_that_is_not_told_plainly_is_refused(points: dict[str, object], says: str) -> None:
    with pytest.raises(InputError, match=says):
        SloshConfig.from_parameters(TWO | points)


def test_rows_of_points_have_meaning_unit_and_range() -> None:
    row = rows_for(['tank'], ['pressure.gauge', 'tank.pressure.other'])
    for name in ('pressure.gauge', 'tank.pressure.other'):
        assert (row[name].name, row[name].kind, row[name].unit) == (name, 'double[3]', 'm')
        assert 'mean free surface' in row[name].meaning


def test_coefficients_without_potentials_tell_no_pressure() -> None:
    c = replace(
        coefficients_of(rectangular(3.0, 1.6, 1.2), 0.9, DENSITY, 2),
        potentials=None,
        route='a fit',
    )
    with pytest.raises(InputError, match='route "a fit" tell no pressure'):
        PressureMatrices.of(c, np.zeros(2), np.zeros((1, 3)))
