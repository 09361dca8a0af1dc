"""Tanks that are empty or full: nothing sloshes, a full one turns by Stokes and Joukowski."""

from __future__ import annotations

import itertools
import json

import numpy as np
import pytest
from conftest import REPOSITORY
from drives import RECTANGLE, START, G, engine_of, feed, stamps
from numpy.typing import NDArray
from typer.testing import CliRunner
from wetted import wetted

from slosh_ros.cli import app
from slosh_ros.engine import SloshConfig, SloshEngine
from slosh_ros.errors import InputError
from slosh_ros.hydro import ModalCoefficients, coefficients_of
from slosh_ros.modal import LoadMatrices
from slosh_ros.modal.pressure import PressureMatrices
from slosh_ros.tank import (
    Tank,
    cylinder_x,
    cylinder_z,
    ellipse_x,
    rectangular,
    rounded_rectangle_x,
    section_x,
)

Array = NDArray[np.float64]

DENSITY = 850.0
LEANING = [0.0, 0.0, 2.0, -0.3, 2.4, 1.0, 1.1, 1.6, -0.3, 0.9]  # its top is a point
TANKS = {
    'box': rectangular(3.0, 1.6, 1.2),
    'drum': cylinder_z(1.2, 2.0),
    'pipe': cylinder_x(1.125, 4.0),
    'trapezium': section_x([0.0, 0.0, 1.0, 0.0, 1.8, 1.2, -0.4, 1.2], 3.0),
    'leaning prism': section_x(LEANING, 3.0),
}
REST = np.array([0.0, 0.0, G, 0.0, 0.0, 0.0])


def full(tank: Tank, density: float = 1.0) -> ModalCoefficients:
    return coefficients_of(tank, tank.height, density, 8)


def at_centroid(c: ModalCoefficients) -> Array:
    """Stokes-Joukowski inertia about the mass centre, shape (3, 3)."""
    r = c.liquid.centroid
    return np.asarray(c.inertia_stokes_joukowski - c.mass * (r @ r * np.eye(3) - np.outer(r, r)))


# --- the inertia of the closed volume ------------------------------------------------------------


def test_round_pipe_takes_nothing_along_when_it_turns_about_its_axis() -> None:
    c = full(cylinder_x(1.2, 5.0))
    assert np.abs(at_centroid(c)[0]).max() < 1e-9 * c.inertia_frozen[0, 0]


def test_elliptic_cylinder_has_lambs_inertia() -> None:
    """Lamb, Hydrodynamics, art. 72: m (a^2 - b^2)^2/(4 (a^2 + b^2)) about its axis."""
    c, a, b = full(ellipse_x(2.4, 1.8, 6.0)), 1.2, 0.9
    lamb = c.mass * (a**2 - b**2) ** 2 / (4.0 * (a**2 + b**2))
    assert at_centroid(c)[0, 0] == pytest.approx(lamb, rel=1e-8)


def test_pipe_turned_end_over_end_is_a_drum() -> None:
    """The section route against the closed form: the same cylinder lies or stands."""
    lying, standing = full(cylinder_x(1.2, 5.0)), full(cylinder_z(1.2, 5.0))
    assert np.diag(at_centroid(lying))[1:] == pytest.approx(
        np.diag(at_centroid(standing))[:2], rel=1e-8
    )


def test_box_does_not_know_which_way_is_up() -> None:
    """Closed form: pitch of a box is yaw of the same box on its side."""
    one, other = full(rectangular(5.0, 2.0, 1.0)), full(rectangular(5.0, 1.0, 2.0))
    assert np.diag(at_centroid(one))[[0, 2, 1]] == pytest.approx(
        np.diag(at_centroid(other)), rel=1e-10
    )


@pytest.mark.parametrize(
    'tank',
    [
        rounded_rectangle_x(2.0, 1.0, 0.0, 5.0),
        section_x([-1.0, 0.0, 1.0, 0.0, 1.0, 1.0, -1.0, 1.0], 5.0),
        section_x([0.0, -1.0, 1.0, -1.0, 1.0, 0.0, -1.0, 0.0, -1.0, -0.5, -1.0, -1.0], 5.0),
    ],
    ids=['splines', 'triangles', 'more corners'],
)
def test_sections_agree_with_the_closed_form_of_the_box(tank: Tank) -> None:
    expected = full(rectangular(5.0, 2.0, 1.0)).inertia_stokes_joukowski
    found = full(tank).inertia_stokes_joukowski
    assert np.diag(found) == pytest.approx(np.diag(expected), rel=1e-6)


def test_round_section_agrees_with_a_polygon_of_many_corners() -> None:
    """Splines on half of it and its mirror image, triangles on all of it; corners cut 1/n^2."""
    angle = 2.0 * np.pi * (np.arange(48) + 0.5) / 48
    corners = np.stack([1.3 * np.sin(angle), 0.7 * np.cos(angle)], axis=1)
    found = at_centroid(full(section_x(corners.ravel().tolist(), 4.0)))
    expected = at_centroid(full(ellipse_x(2.6, 1.4, 4.0)))
    assert np.diag(found) == pytest.approx(np.diag(expected), rel=1e-2)


@pytest.mark.parametrize('name', TANKS)
def test_full_tank_is_where_filling_leads_to(name: str) -> None:
    """Under a closed lid, the inertia in the tank frame's axes goes on without a jump."""
    tank, end = TANKS[name], full(TANKS[name])
    gaps = []
    for empty in (0.04, 0.02):
        c = coefficients_of(tank, tank.depth(1.0 - empty), 1.0, 2)
        gaps.append(np.abs(at_centroid(c) - at_centroid(end)).max())
    assert gaps[1] < 0.62 * gaps[0]  # in proportion to the rest of the volume, or its power 2/3
    assert gaps[1] < 0.05 * np.abs(at_centroid(end)).max()


@pytest.mark.parametrize('name', TANKS)
def test_pressure_over_all_walls_adds_up_to_a_rigid_body(name: str) -> None:
    """Lid included, in any motion: F = -m (s + alpha x c), M = -m c x s - J0 alpha."""
    tank = TANKS[name]
    c = full(tank, DENSITY)
    wall, lid = wetted(tank, tank.height)
    points = wall.points, lid.points
    motion = REST + np.random.default_rng(3).normal(size=6)
    none = np.zeros(0)
    found = np.zeros(6)
    for part in (wall, lid):
        pressure = PressureMatrices.of(c, none, part.points).at(none, none, motion)
        pressure = pressure - DENSITY * G * part.points[:, 2]
        push = (part.weights * pressure)[:, np.newaxis] * part.normals
        found += np.concatenate([push.sum(axis=0), np.cross(part.points, push).sum(axis=0)])
    expected = LoadMatrices.of(c, none).rigid @ motion
    s, alpha, r = motion[:3], motion[3:], c.liquid.centroid
    assert expected[:3] == pytest.approx(-c.mass * (s + np.cross(alpha, r)))
    assert expected[3:] == pytest.approx(
        -c.mass * np.cross(r, s) - c.inertia_stokes_joukowski @ alpha
    )
    assert len(points[0]) > 1000
    assert found == pytest.approx(expected, abs=2e-5 * np.abs(expected).max())


@pytest.mark.parametrize('name', TANKS)
def test_full_tank_is_vented_at_its_top(name: str) -> None:
    """Bernoulli's constant: O, where the surface shrinks to, has the gas's pressure."""
    c = full(TANKS[name])
    assert c.potentials is not None
    highest = np.array([[0.0, 0.0, 0.0]])
    if name != 'trapezium':  # of which only the mean over the roof is zero
        assert c.potentials.stokes_joukowski(highest) == pytest.approx(np.zeros((1, 3)), abs=1e-9)
    _, lid = wetted(TANKS[name], TANKS[name].height)
    if len(lid.points):
        mean = lid.weights @ c.potentials.stokes_joukowski(lid.points)
        assert mean == pytest.approx(np.zeros(3), abs=1e-8)


# --- the engine ----------------------------------------------------------------------------------

SHAPES: dict[str, dict[str, object]] = {
    'box': RECTANGLE,
    'drum': {'tank.shape': 'cylinder_z', 'tank.radius': 1.2, 'tank.height': 2.0},
    'pipe': {'tank.shape': 'cylinder_x', 'tank.radius': 1.2, 'tank.length': 4.0},
    'prism': {'tank.shape': 'section_x', 'tank.points': LEANING, 'tank.length': 3.0},
}


def still_engine(shape: str, fill_ratio: float, **more: object) -> SloshEngine:
    given = {k: v for k, v in SHAPES[shape].items() if not k.startswith('tank.fill')}
    given |= {'tank.fill_ratio': fill_ratio, 'tank.xyz': [1.0, 0.5, 2.0]}
    given |= {name.replace('__', '.'): value for name, value in more.items()}
    return SloshEngine(SloshConfig.from_parameters(given))


DRIVE = (lambda t: (np.sin(9 * t), 2.0 * t, G), lambda t: (0.1 * t, -0.2 * t**2, 0.3))


@pytest.mark.parametrize('shape', SHAPES)
def test_empty_tank_has_no_mass_and_no_loads(shape: str) -> None:
    engine = still_engine(shape, 0.0, pressure__gauge=[0.2, 0.1, 0.0])
    loads = feed(engine, stamps(0.5, 0.01), *DRIVE)
    for one in loads:
        assert not np.any([one.wrench, one.total, one.state])
        assert (one.elevation_max, one.valid, one.pressure.tolist()) == (0.0, True, [0.0])
    carried = engine.carried
    assert carried.mass == 0.0
    assert not carried.centroid.any()
    assert not engine.settled.any()
    assert not engine.softening.any()


@pytest.mark.parametrize('shape', SHAPES)
def test_full_tank_loads_its_carrier_as_a_rigid_body(shape: str) -> None:
    engine = still_engine(shape, 1.0, tank__density=DENSITY, pressure__gauge=[0.2, 0.1, 0.0])
    c = engine.tanks[0].coefficients
    assert c.mass == pytest.approx(DENSITY * engine.config.tanks[0].tank.volume)
    times = stamps(0.5, 0.01)
    loads = feed(engine, times, *DRIVE)
    origin = np.array([1.0, 0.5, 2.0]) + c.liquid.surface_centre
    for before, now in itertools.pairwise(loads):
        assert not now.wrench.any()
        assert not now.state.any()
        assert (now.elevation_max, now.valid) == (0.0, True)
        omega, s = now.sample.rate, now.sample.force
        alpha = (omega - before.sample.rate) / 0.01
        at_o = s + np.cross(alpha, origin) + np.cross(omega, np.cross(omega, origin))
        r = c.liquid.centroid
        force = -c.mass * (at_o + np.cross(alpha, r))
        moment = -c.mass * np.cross(r, at_o) - c.inertia_stokes_joukowski @ alpha
        moment = moment + np.cross(origin, force)
        np.testing.assert_allclose(
            now.total, np.concatenate([force, moment]), rtol=1e-9, atol=1e-3
        )
        assert np.isfinite(now.pressure).all()


@pytest.mark.parametrize('damping', [{'tank__damping_ratio': [0.1] * 8},
                                     {'tank__kinematic_viscosity': 1e-6}, {}])  # fmt: skip
@pytest.mark.parametrize('fill_ratio', [0.0, 1.0])
def test_damping_of_modes_that_are_not_there(
    damping: dict[str, object], fill_ratio: float
) -> None:
    assert len(still_engine('pipe', fill_ratio, **damping).tanks[0].damping_ratio) == 0


def test_fill_depth_reaches_from_the_bottom_to_the_roof() -> None:
    given = {k: v for k, v in RECTANGLE.items() if not k.startswith('tank.fill')}
    for depth, ratio in ((0.0, 0.0), (1.6, 1.0)):
        config = SloshConfig.from_parameters(given | {'tank.fill_depth': depth})
        assert not config.tanks[0].coefficients().names
        (tank,) = SloshEngine(config).tanks
        assert tank.coefficients.liquid.fill_ratio == ratio
    with pytest.raises(InputError, match=r'fill_depth is 1.7 m; the tank is 1.6 m high'):
        SloshConfig.from_parameters(given | {'tank.fill_depth': 1.7})


def test_a_point_above_the_liquid_is_dry_and_reads_the_gas() -> None:
    """Half full, to z = 0: below it the point feels the wave, above it nothing."""
    engine = engine_of(pressure__wet=[4.0, 0.0, -0.1], pressure__dry=[4.0, 0.0, 0.1])
    loads = feed(engine, stamps(1.0, 0.01), (1.0, 0.5, G))
    dry, wet = np.array([one.pressure for one in loads]).T  # by name
    assert not dry.any()
    assert np.abs(wet).max() > 1000.0


def test_two_tanks_one_full_one_empty() -> None:
    box = {k: v for k, v in RECTANGLE.items() if not k.startswith('tank.fill')}
    two = {k.replace('tank.', f'{n}.'): v for n in ('a', 'b') for k, v in box.items()}
    two |= {'tanks': ['a', 'b'], 'a.fill_ratio': 1.0, 'b.fill_ratio': 0.0}
    both = SloshEngine(SloshConfig.from_parameters(two))
    one = SloshEngine(SloshConfig.from_parameters(box | {'tank.fill_ratio': 1.0}))
    for loads, expected in zip(
        feed(both, [START, START + 10**7], *DRIVE),
        feed(one, [START, START + 10**7], *DRIVE),
        strict=True,
    ):
        np.testing.assert_array_equal(loads.total, expected.total)


# --- the command ---------------------------------------------------------------------------------


@pytest.mark.parametrize('fill', ['0', '1'])
@pytest.mark.parametrize('config', ['half_full_tanker', 'rectangular_tank', 'modified_oval'])
def test_modes_of_an_empty_and_of_a_full_tank(config: str, fill: str) -> None:
    file = str(REPOSITORY / 'config' / f'{config}.yaml')
    told = CliRunner().invoke(app, ['modes', file, '--fill', fill])
    assert told.exit_code == 0, told.output
    assert 'nothing sloshes' in told.output
    assert 'nan' not in told.output
    found = json.loads(CliRunner().invoke(app, ['modes', file, '--fill', fill, '--json']).output)
    assert found['modes'] == []
    assert (found['mass'] > 0.0) == (fill == '1')
    assert np.all(np.linalg.eigvalsh(found['inertia_frozen']) >= 0.0)
    assert np.isfinite(found['inertia_stokes_joukowski']).all()


def test_no_picture_of_no_mode(tmp_path: object) -> None:
    file = str(REPOSITORY / 'config' / 'rectangular_tank.yaml')
    run = CliRunner().invoke(app, ['modes', file, '--fill', '1', '--plot', f'{tmp_path}/x.png'])
    assert isinstance(run.exception, InputError)
    assert 'no mode can be drawn' in str(run.exception)
