"""Spheres by the problem in the meridian plane: published values, identities, convergence."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.hydro import ModalCoefficients, coefficients_of
from slosh_ros.hydro.axisymmetric import axisymmetric_coefficients
from slosh_ros.hydro.section_mesh import Resolution
from slosh_ros.hydro.volume import VolumeResolution, volume_coefficients
from slosh_ros.tank import Circle, Rectangle, cylinder_z, sphere

Array = NDArray[np.float64]

RADIUS = 1.3
BALL = sphere(RADIUS)
FILLS = (0.01, 0.5, 0.99)

every_fill = pytest.mark.parametrize('fill_ratio', FILLS)


@cache
def solved(fill_ratio: float, modes: int = 12) -> ModalCoefficients:
    return coefficients_of(BALL, BALL.depth(fill_ratio), 850.0, modes)


@pytest.mark.parametrize(
    ('relative_depth', 'kappas', 'share'),
    [
        (0.4, [1.158261, 5.674217], 0.854368),
        (1.0, [1.560157, 5.275546, 8.504441], 0.579693),
        (1.6, [2.686348, 6.957093], 0.222226),
    ],
)
def test_published_frequencies(relative_depth: float, kappas: list[float], share: float) -> None:
    """
    Published kappa R = 1.5602 of a half-full sphere, and the table of THEORY 4.

    The table is by finite elements of fourth degree, converged to seven digits.
    """
    c = coefficients_of(BALL, relative_depth * RADIUS, 850.0, 6)
    found = c.omega**2 / GRAVITY * RADIUS
    assert found[::2][: len(kappas)] == pytest.approx(kappas, abs=6e-7)
    assert c.coupling[0, 0] ** 2 / c.mu[0] / c.mass == pytest.approx(share, abs=1e-6)


def test_a_shallow_sphere_is_a_paraboloid() -> None:
    """Kappa R -> 1 as the depth vanishes: shallow water in a bowl, Lamb (1932) article 193."""
    kappas = [coefficients_of(BALL, h * RADIUS, 850.0, 2).omega[0] ** 2 for h in (0.02, 0.01)]
    first, second = np.array(kappas) * RADIUS / GRAVITY - 1.0
    assert 0.0 < second < 5e-3
    assert first / second == pytest.approx(2.0, rel=0.02)


@every_fill
def test_modes_swing_about_the_centre_of_the_sphere(fill_ratio: float) -> None:
    """Pressure on the wall passes through the centre: lambda_5 = lambda_1 (z - g/omega^2)."""
    c = solved(fill_ratio)
    arm = -c.liquid.surface_height - GRAVITY / c.omega**2
    surge, sway = slice(0, None, 2), slice(1, None, 2)
    assert c.coupling[surge, 4] == pytest.approx(c.coupling[surge, 0] * arm[surge], rel=1e-8)
    assert c.coupling[sway, 3] == pytest.approx(-c.coupling[sway, 1] * arm[sway], rel=1e-8)


@every_fill
def test_nothing_turns_a_sphere_about_its_centre(fill_ratio: float) -> None:
    """
    The wall carries no moment about the centre, whatever the angular acceleration.

    Stokes-Joukowski's inertia there is not zero, for the lid takes liquid along; what it lacks,
    the modes give back: J = sum lambda_5^2/mu about the centre, over all modes.
    """
    c = solved(fill_ratio, 24)
    arm = -c.liquid.surface_height
    about_centre = c.inertia_stokes_joukowski[1, 1] + c.mass * (
        # Steiner, through the centroid
        (c.liquid.centroid[2] - arm) ** 2 - c.liquid.centroid[2] ** 2
    )
    levers = c.coupling[::2, 4] - arm * c.coupling[::2, 0]
    parts = levers**2 / c.mu[::2]
    assert parts.sum() == pytest.approx(about_centre, rel=1e-3)
    assert parts.sum() < about_centre * (1.0 + 1e-9)  # each is positive, and the rest to come


@every_fill
def test_static_moment_is_that_of_the_inclined_surface(fill_ratio: float) -> None:
    """Parseval: sum g lambda_1^2/(mu omega^2) -> rho I_xx, from below (THEORY 2.2)."""
    c = solved(fill_ratio, 24)
    whole = c.density * c.liquid.surface_inertia[0, 0]
    rest = np.diag(c.static_residual)
    assert np.all(rest > -1e-9 * whole)
    assert rest == pytest.approx(np.zeros(2), abs=1e-3 * whole)
    assert solved(fill_ratio, 4).static_residual[0, 0] > rest[0] + 1e-9 * whole


@every_fill
def test_added_mass_and_inertia_are_bounded(fill_ratio: float) -> None:
    c = solved(fill_ratio)
    assert 0.0 < np.sum(c.coupling[:, 0] ** 2 / c.mu) < c.mass
    less = c.inertia_frozen - c.inertia_stokes_joukowski
    assert np.all(np.linalg.eigvalsh(less) > 0.0)
    assert c.inertia_stokes_joukowski[2, 2] == 0.0
    assert np.all(c.coupling[:, 5] == 0.0)


@every_fill
def test_twelve_modes_have_five_digits(fill_ratio: float) -> None:
    """Against a mesh more than twice as fine; two digits of the wall friction near the top."""
    c, depth = solved(fill_ratio), BALL.depth(fill_ratio)
    fine = axisymmetric_coefficients(
        Circle(RADIUS), BALL.filled(depth), 850.0, 12, Resolution(30, 8, 16)
    )
    invariant = [x.coupling[::2, [0, 4]] ** 2 / x.mu[::2, np.newaxis] for x in (c, fine)]
    assert c.omega == pytest.approx(fine.omega, rel=1e-6)
    assert invariant[0] == pytest.approx(invariant[1], rel=5e-6)
    assert c.mu == pytest.approx(fine.mu, rel=2e-5)
    j, k = (x.inertia_stokes_joukowski for x in (c, fine))
    assert j == pytest.approx(k, rel=1e-8)
    assert c.wall_friction == pytest.approx(fine.wall_friction, rel=5e-3)


def test_an_upright_cylinder_by_closed_form() -> None:
    """Any tank of revolution: the meridian of a cylinder is a rectangle."""
    tank, depth = cylinder_z(1.2, 2.0), 0.9
    exact = coefficients_of(tank, depth, 850.0, 12)
    found = axisymmetric_coefficients(Rectangle(2.4, 2.0), tank.filled(depth), 850.0, 12)
    assert found.names == exact.names
    for name in ('omega', 'mu', 'coupling', 'inertia_stokes_joukowski', 'wall_friction'):
        exactly = getattr(exact, name)
        scale = np.abs(exactly).max()
        assert getattr(found, name) == pytest.approx(exactly, rel=2e-5, abs=1e-9 * scale), name
    assert found.surface_shapes == pytest.approx(exact.surface_shapes, abs=2e-5)
    assert found.surface_points == pytest.approx(exact.surface_points)
    points = np.array([[0.3, 0.2, -0.5], [1.2, 0.0, -0.1], [0.0, 0.0, -0.9], [0.0, 0.0, 0.0]])
    assert exact.potentials
    assert found.potentials
    assert found.potentials.modes(points) == pytest.approx(
        exact.potentials.modes(points), abs=2e-5
    )
    assert found.potentials.stokes_joukowski(points) == pytest.approx(
        exact.potentials.stokes_joukowski(points), abs=2e-5
    )


def test_a_sphere_by_the_route_of_any_volume() -> None:
    """Splines that a surface of triangles cuts know nothing of revolution: published 1.560157."""
    resolution = VolumeResolution(triangles=6000)
    found = volume_coefficients(BALL, RADIUS, 850.0, 4, resolution)
    exact = coefficients_of(BALL, RADIUS, 850.0, 4)
    assert found.omega**2 / GRAVITY * RADIUS == pytest.approx(
        [1.560157, 1.560157, 5.275546, 5.275546], rel=1e-4
    )
    shares = [c.coupling[:, :2] ** 2 / c.mu[:, np.newaxis] / c.mass for c in (found, exact)]
    assert shares[0] == pytest.approx(shares[1], abs=1e-4)
    inertia, expected = (c.inertia_stokes_joukowski for c in (found, exact))
    assert inertia == pytest.approx(expected, abs=1e-3 * expected.max())
    assert found.wall_friction == pytest.approx(exact.wall_friction, rel=5e-3)


def test_modes_come_in_pairs() -> None:
    c = solved(0.6, 5)
    assert c.names == ('x1', 'y1', 'x3', 'y3', 'x5')
    assert c.omega[:2] == pytest.approx(c.omega[0])
    assert np.all(np.diff(c.omega) >= 0.0)
    assert c.coupling[0, 0] == c.coupling[1, 1] < 0.0
    assert c.coupling[0, 4] == -c.coupling[1, 3]
    assert np.abs(c.surface_shapes).max(axis=0) == pytest.approx(np.ones(5), abs=0.03)
    first = c.surface_points[:, 0].argmin()
    assert np.all(c.surface_shapes[first, ::2] > 0.0)


def test_a_full_sphere_is_a_point_mass() -> None:
    """Nothing turns its liquid; the limit of a nearly full one, whose surface is a pinhole."""
    full = coefficients_of(BALL, 2.0 * RADIUS, 850.0, 6)
    assert full.omega.size == 0
    mass = 850.0 * 4.0 / 3.0 * np.pi * RADIUS**3
    assert full.mass == pytest.approx(mass)
    expected = mass * RADIUS**2 * np.diag([1.0, 1.0, 0.0])
    assert full.inertia_stokes_joukowski == pytest.approx(expected)
    nearly = solved(0.9999)
    across = nearly.mass * nearly.liquid.surface_height**2  # O is not yet at the top
    assert nearly.inertia_stokes_joukowski[0, 0] == pytest.approx(across, rel=1e-3)
    points = np.array([[0.4, 0.1, -1.5], [-0.3, 0.6, -0.9]])
    assert full.potentials
    assert nearly.potentials
    almost = nearly.potentials.stokes_joukowski(points)
    assert full.potentials.stokes_joukowski(points) == pytest.approx(almost, rel=0.02)
    assert coefficients_of(BALL, 0.0, 850.0, 6).mass == 0.0
