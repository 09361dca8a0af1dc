"""Coefficients over the fill: against direct solutions, identities of the circle, the two ends."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.hydro import ModalCoefficients, coefficients_of
from slosh_ros.hydro.fill_table import FILL_RANGE, TOLERANCE, FillTable
from slosh_ros.modal.validity import Criterion, TrustWatch
from slosh_ros.tank import Tank, cylinder_x, section_x, sphere

Array = NDArray[np.float64]

DENSITY = 850.0
NAMES = ('x1', 'y1', 'x1y1')
PIPE = cylinder_x(1.2, 4.0)
# of the pipe: near its end, always wet; at its side, dry below half full
POINTS = np.array([[1.9, 0.1, -1.05], [0.3, 1.19, 0.1]])
BALL = sphere(0.9)
TRAPEZIUM = section_x([-0.6, 0.0, 0.6, 0.0, 1.0, 1.2, -1.0, 1.2], 3.0)
HEXAGON = section_x([-0.5, 0.0, 0.5, 0.0, 0.9, 0.5, 0.5, 1.0, -0.5, 1.0, -0.9, 0.5], 2.0)
FILLS = (0.011, 0.2, 0.43, 0.7, 0.985)


@cache
def pipe() -> FillTable:
    return FillTable(PIPE, NAMES, POINTS).build()


@cache
def trapezium() -> FillTable:
    return FillTable(TRAPEZIUM, NAMES).build()


@cache
def hexagon() -> FillTable:
    return FillTable(HEXAGON, NAMES).build()


@cache
def ball() -> FillTable:
    """Build it as `build` does, in steps of one solution, with something else in between."""
    table = FillTable(BALL, ('x1', 'y1', 'x3'))
    steps = 0
    while not table.ready:
        table.step()
        steps += 1
    assert steps == table.solutions
    return table


@cache
def direct(tank: Tank, fill_ratio: float) -> ModalCoefficients:
    return coefficients_of(tank, tank.depth(fill_ratio), DENSITY, NAMES)


def kinds(c: ModalCoefficients) -> list[Array]:
    """Quantities of one kind together."""
    return [c.omega, c.mu, *c.coupling.T[[0, 1, 3, 4, 5]], c.inertia_stokes_joukowski]


# --- against direct solutions --------------------------------------------------------------------


@pytest.mark.parametrize('fill_ratio', FILLS)
@pytest.mark.parametrize('shape', ['pipe', 'trapezium'])
def test_table_agrees_with_direct_solutions(shape: str, fill_ratio: float) -> None:
    """In omega, mu, lambda and inertias, each over the largest of its kind."""
    table, tank = (pipe(), PIPE) if shape == 'pipe' else (trapezium(), TRAPEZIUM)
    found, expected = table.at(fill_ratio, DENSITY), direct(tank, fill_ratio)
    assert found.names == expected.names == NAMES
    for a, b in zip(kinds(found), kinds(expected), strict=True):
        assert a == pytest.approx(b, abs=1e-4 * np.abs(b).max(), rel=0.0)
    assert found.omega == pytest.approx(expected.omega, rel=1e-4)
    assert found.wall_friction == pytest.approx(expected.wall_friction, rel=1e-3)
    assert found.surface_shapes == pytest.approx(expected.surface_shapes, abs=1e-3)
    assert found.surface_points == pytest.approx(expected.surface_points, abs=1e-4)
    assert (found.mass, found.liquid.depth) == (expected.mass, expected.liquid.depth)


def test_stated_error_is_small_and_so_is_the_number_of_solutions() -> None:
    assert pipe().error <= TOLERANCE
    assert pipe().solutions <= 24
    assert trapezium().error <= TOLERANCE


def test_stated_error_is_no_less_than_the_true_one_with_few_nodes() -> None:
    """Of a table that is content early, against direct solutions."""
    coarse = FillTable(PIPE, NAMES, tolerance=1e-2).build()
    errors = [
        np.abs(coarse.at(fill, DENSITY).omega / direct(PIPE, fill).omega - 1.0).max()
        for fill in FILLS
    ]
    assert 1e-7 < max(errors) <= coarse.error <= 1e-2
    assert coarse.solutions < pipe().solutions


def test_the_pivot_of_a_round_pipe_is_its_axis_at_any_fill() -> None:
    """THEORY 4: lambda_4 = -lambda_2 (z_axis - g/omega^2), which no node was asked for."""
    for fill in np.linspace(0.013, 0.987, 9):
        c = pipe().at(float(fill), DENSITY)
        axis = PIPE.section.radius - c.liquid.depth  # type: ignore[union-attr]
        pivot = axis - GRAVITY / c.omega[1] ** 2
        assert c.coupling[1, 3] == pytest.approx(-c.coupling[1, 1] * pivot, rel=1e-4)


def test_the_pivot_of_a_sphere_is_its_centre_at_any_fill() -> None:
    """No moment about the centre: lambda_4 and lambda_5 follow from lambda_2 and lambda_1."""
    for fill in np.linspace(0.013, 0.987, 9):
        c = ball().at(float(fill), DENSITY)
        pivot = BALL.radius - c.liquid.depth - GRAVITY / c.omega**2
        surge, sway, _, roll, pitch, yaw = c.coupling.T
        largest = np.abs(roll).max()
        assert roll == pytest.approx(-sway * pivot, rel=0.0, abs=1e-4 * largest)
        assert pitch == pytest.approx(surge * pivot, rel=0.0, abs=1e-4 * largest)
        assert not yaw.any()
    assert ball().error <= TOLERANCE
    assert ball().solutions <= 16


def test_coefficients_go_on_smoothly_over_the_ends_of_intervals() -> None:
    """At a level with a corner there may be a kink, but no jump; elsewhere not even a kink."""
    step = 1e-5
    for table in (pipe(), trapezium()):
        for fill in (0.3, 0.5, 0.8):
            rows = [
                np.concatenate(
                    [part.ravel() for part in kinds(table.at(fill + k * step, DENSITY))]
                )
                for k in (-1, 0, 1)
            ]
            scale = np.abs(rows[1]).max()
            assert np.abs(rows[2] - 2.0 * rows[1] + rows[0]).max() < 1e-8 * scale
            assert np.abs(rows[2] - rows[0]).max() < 1e-3 * scale


@pytest.mark.parametrize('fill_ratio', [0.5003, 0.503, 0.53])
def test_above_a_corner_of_the_wall(fill_ratio: float) -> None:
    """Also the scale of the shapes: the highest wave is as near to the wall as the corner."""
    found, expected = hexagon().at(fill_ratio, DENSITY), direct(HEXAGON, fill_ratio)
    assert found.omega == pytest.approx(expected.omega, rel=1e-4)
    moved = expected.mass_moved
    assert found.mass_moved == pytest.approx(moved, rel=0.0, abs=1e-4 * moved.max())
    assert found.mu == pytest.approx(expected.mu, rel=1e-4)
    assert hexagon().solutions <= 28  # without crowding 35


@pytest.mark.parametrize('fill_ratio', [0.43, 0.7, 0.985])
def test_potentials_at_points_of_pressure(fill_ratio: float) -> None:
    """Also of a point that the surface has just passed."""
    found, expected = pipe().at(fill_ratio, DENSITY), direct(PIPE, fill_ratio)
    about = POINTS - expected.liquid.surface_centre
    wet = about[about[:, 2] <= 0.0]
    assert len(wet) == (1 if fill_ratio == 0.43 else 2)
    assert found.potentials is not None
    assert expected.potentials is not None
    assert found.potentials.modes(wet) == pytest.approx(expected.potentials.modes(wet), abs=2e-3)
    assert found.potentials.stokes_joukowski(wet) == pytest.approx(
        expected.potentials.stokes_joukowski(wet), abs=2e-3
    )


# --- the ends ------------------------------------------------------------------------------------


@pytest.mark.parametrize('edge', FILL_RANGE)
def test_modes_fade_from_the_last_solution_to_the_end(edge: float) -> None:
    """Continuously, in proportion to what liquid or air is left; masses stay positive."""
    end = round(edge)
    at_edge = pipe().at(edge, DENSITY)
    close = pipe().at(edge + 1e-9 * np.sign(end - edge + 1e-12), DENSITY)
    for a, b in zip(kinds(close), kinds(at_edge), strict=True):
        assert a == pytest.approx(b, abs=1e-6 * np.abs(b).max())
    for share in (0.7, 0.1, 1e-4):
        c = pipe().at(end + share * (edge - end), DENSITY)
        assert c.mass == pytest.approx(DENSITY * PIPE.volume * c.liquid.fill_ratio)
        assert c.mass_moved == pytest.approx(share * at_edge.mass_moved, rel=1e-6)
        assert np.all(np.diag(c.static_residual) >= 0.0)
        assert c.mass > c.mass_moved[0]
        assert np.all(np.linalg.eigvalsh(c.inertia_stokes_joukowski) >= 0.0)
        trust = TrustWatch([(PIPE, c)]).judge([0.0], np.zeros(3), np.zeros(3), 0.01, 0.0)
        assert not trust.valid
        if end:
            assert trust.criterion is Criterion.FILM
    last = pipe().at(float(end), DENSITY)
    assert last.names == ()
    nearly = pipe().at(end + 1e-6 * (edge - end), DENSITY)
    assert nearly.inertia_stokes_joukowski == pytest.approx(
        last.inertia_stokes_joukowski, abs=1e-4 * pipe().at(0.5, DENSITY).inertia_frozen.max()
    )


def test_inside_the_range_nothing_is_taken_for_a_film() -> None:
    for fill in FILL_RANGE:
        c = pipe().at(fill, DENSITY)
        trust = TrustWatch([(cylinder_x(1.2, 0.01), c)]).judge(
            [0.0], np.zeros(3), np.zeros(3), 0.01, 0.0
        )
        assert trust.criterion is not Criterion.FILM


def test_the_full_tank_is_that_of_its_own_solution() -> None:
    """Nobody who fills a tank to the brim has to wait for it."""
    table, exact = pipe().at(1.0, DENSITY), coefficients_of(PIPE, PIPE.height, DENSITY, 1)
    assert not table.names
    assert np.array_equal(table.inertia_stokes_joukowski, exact.inertia_stokes_joukowski)
    assert np.array_equal(table.liquid.centroid, exact.liquid.centroid)
    about = POINTS - exact.liquid.surface_centre
    assert table.potentials is not None
    assert exact.potentials is not None
    assert np.array_equal(
        table.potentials.stokes_joukowski(about), exact.potentials.stokes_joukowski(about)
    )
    assert table.potentials.modes(about).shape == (2, 0)
