"""Potentials of modes and of rotation under a lid: Laplace, boundary conditions, energy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from wetted import Surface, interval, wetted

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.hydro import ModalCoefficients, coefficients_of
from slosh_ros.hydro.coefficients import Potentials
from slosh_ros.hydro.hyperbolic import cosh_ratio, sinh_ratio
from slosh_ros.hydro.rectangular import rectangular_coefficients
from slosh_ros.hydro.section import section_coefficients
from slosh_ros.tank import (
    Polygon,
    Tank,
    UniformTank,
    cylinder_x,
    cylinder_z,
    rectangular,
    section_x,
    sphere,
)

Array = NDArray[np.float64]

BOX, PIPE, DRUM = rectangular(3.0, 1.6, 1.2), cylinder_x(1.1, 3.0), cylinder_z(1.2, 2.0)
PRISM = section_x([0.0, 0.0, 2.0, -0.3, 2.4, 1.0, 1.1, 1.6, -0.3, 0.9], 3.0)  # leans

BALL = sphere(1.2)


class Liquid:
    """A tank's liquid with its coefficients and potentials, kept for all tests."""

    def __init__(self, tank: Tank, fill_ratio: float) -> None:
        self.tank, self.depth = tank, tank.depth(fill_ratio)
        self.coefficients: ModalCoefficients = coefficients_of(tank, self.depth, 850.0, 12)
        assert self.coefficients.potentials is not None
        self.potentials: Potentials = self.coefficients.potentials
        self.wall, self.lid = wetted(tank, self.depth)
        shrink = np.random.default_rng(2).uniform(0.2, 0.9, (40, 1))
        wall = self.wall.points[:: len(self.wall.points) // 40][:40]
        centroid = self.coefficients.liquid.centroid
        self.inside = centroid + shrink * (wall - centroid)  # star-shaped about the centroid

    def all(self, points: Array) -> Array:
        """All potentials at points, Omega_4 to Omega_6 behind the modes."""
        p = self.potentials
        return np.hstack([p.modes(points), p.stokes_joukowski(points)])


_LIQUIDS = {
    'box': (BOX, 0.75), 'drum': (DRUM, 0.45), 'prism': (PRISM, 0.6),
    'ball, 30 %': (BALL, 0.3), 'ball, 80 %': (BALL, 0.8),
    'pipe, 30 %': (PIPE, 0.3), 'pipe, 50 %': (PIPE, 0.5), 'pipe, 80 %': (PIPE, 0.8),
}  # fmt: skip


@pytest.fixture(scope='module', params=_LIQUIDS)
def liquid(request: pytest.FixtureRequest) -> Liquid:
    return Liquid(*_LIQUIDS[request.param])


def slope(f: Callable[[Array], Array], at: Surface, step: float = 1e-3) -> Array:
    """Differentiate along the normal, by three points on the side of the liquid, (p, n)."""
    inwards = [f(at.points - k * step * at.normals) for k in range(3)]
    return (1.5 * inwards[0] - 2.0 * inwards[1] + 0.5 * inwards[2]) / step


def some(surface: Surface) -> Surface:
    return Surface(*(part[3::17] for part in surface))


# --- what makes a potential ----------------------------------------------------------------------


def test_potentials_are_harmonic(liquid: Liquid) -> None:
    """The mean over any sphere in the liquid is the value at its centre."""
    cosine, weight = interval(-1.0, 1.0, 6)
    angle = 2.0 * np.pi * np.arange(12) / 12
    sine = np.sqrt(1.0 - cosine**2)
    sphere = np.stack(
        [
            np.outer(sine, np.cos(angle)),
            np.outer(sine, np.sin(angle)),
            np.outer(cosine, np.ones(12)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    share = np.repeat(weight / 24.0, 12)
    around = liquid.inside[:, np.newaxis] + 0.03 * sphere
    mean = share @ liquid.all(around.reshape(-1, 3)).reshape(len(liquid.inside), len(share), -1)
    second = np.abs(6.0 * (mean - liquid.all(liquid.inside)) / 0.03**2)  # the Laplacian
    k_squared = (liquid.coefficients.omega**2 / GRAVITY) ** 2
    assert np.all(second[:, :12] < 1e-4 * np.maximum(k_squared, 1.0))
    assert second[:, 12:].max() < 1e-3


def test_no_mode_flows_through_the_wall(liquid: Liquid) -> None:
    wall = some(liquid.wall)
    # modes bend sharply at the contact line of a pipe more than half full, and at corners
    sharp = np.array([[np.inf, np.inf]])
    if isinstance(liquid.tank, UniformTank) and isinstance(liquid.tank.section, Polygon):
        sharp = liquid.tank.section.liquid_outline(liquid.depth)
    away = np.hypot(*(wall.points[:, np.newaxis, 1:] - sharp).transpose(2, 0, 1)).min(axis=1)
    wall = Surface(*(part[(wall.points[:, 2] < -0.05) & (away > 0.1)] for part in wall))
    kappa = liquid.coefficients.omega**2 / GRAVITY
    assert np.all(np.abs(slope(liquid.potentials.modes, wall)) < 3e-5 * (1.0 + kappa) ** 3)


def test_modes_oscillate_on_the_free_surface(liquid: Liquid) -> None:
    """There phi is f, as sampled for the wave height, and dphi/dz = kappa phi, THEORY 1."""
    c = liquid.coefficients
    on_top = np.pad(c.surface_points, ((0, 0), (0, 1)))
    assert liquid.potentials.modes(on_top) == pytest.approx(c.surface_shapes, abs=1e-9)
    lid = some(liquid.lid)
    x, y, _ = lid.points.T
    away = y if isinstance(liquid.tank, UniformTank) else np.hypot(x, y)
    at_wall = np.abs(away) > 0.9 * np.abs(c.surface_points[:, 1]).max()
    lid = Surface(*(part[~at_wall] for part in lid))
    kappa = c.omega**2 / GRAVITY
    rise = slope(liquid.potentials.modes, lid)
    expected = kappa * liquid.potentials.modes(lid.points)
    assert np.all(np.abs(rise - expected) < 1e-5 * (1.0 + kappa) ** 3)


def test_modal_mass_and_coupling_are_integrals_of_the_potential(liquid: Liquid) -> None:
    """Eqs (10)-(12), and lambda_4..6 by Green's identity over the closed surface, THEORY 1."""
    c = liquid.coefficients
    kappa = c.omega**2 / GRAVITY
    f = liquid.potentials.modes(liquid.lid.points)
    assert 850.0 / kappa * (liquid.lid.weights @ f**2) == pytest.approx(c.mu, rel=1e-6)
    closed = liquid.wall + liquid.lid
    push = (closed.weights * np.cross(closed.points, closed.normals).T).T
    turned = 850.0 / kappa * (push.T @ liquid.potentials.modes(closed.points))
    assert pytest.approx(c.coupling[:, 3:], abs=2e-6 * np.abs(c.coupling).max()) == turned.T


def test_rotation_under_a_lid_follows_the_wall(liquid: Liquid) -> None:
    """dOmega_k/dn = (r x n)_k on the walls and on the lid."""
    closed = some(liquid.wall + liquid.lid)
    expected = np.cross(closed.points, closed.normals)
    error = np.abs(slope(liquid.potentials.stokes_joukowski, closed) - expected)
    # the slopes of the series converge slowly where walls meet
    assert np.quantile(error, 0.98) < 3e-3
    assert np.sqrt(closed.weights @ error**2 / closed.weights.sum()).max() < 3e-3


def test_energy_of_rotation_is_the_stokes_joukowski_inertia(liquid: Liquid) -> None:
    """J0_ik = rho oint Omega_i (r x n)_k dS, all nine, THEORY 2.2."""
    closed = liquid.wall + liquid.lid
    potential = liquid.potentials.stokes_joukowski(closed.points)
    turn = np.cross(closed.points, closed.normals)
    inertia = 850.0 * (closed.weights * potential.T) @ turn
    expected = liquid.coefficients.inertia_stokes_joukowski
    assert inertia == pytest.approx(expected, rel=3e-6, abs=3e-6 * expected.max())


def test_rotation_leaves_the_mean_pressure_of_the_surface_alone(liquid: Liquid) -> None:
    mean = liquid.lid.weights @ liquid.potentials.stokes_joukowski(liquid.lid.points)
    assert np.abs(mean).max() < 2e-9


# --- closed form and section ---------------------------------------------------------------------


@pytest.mark.parametrize(
    ('length', 'width', 'depth'),
    [(8.0, 2.0, 0.8), (8.1, 2.0, 0.05), (2.0, 2.3, 3.0), (1.0, 3.0, 2.9), (5.0, 10.0, 0.1)],
)
def test_a_rectangle_by_closed_form_and_by_section(
    length: float, width: float, depth: float
) -> None:
    tank = rectangular(length, width, 4.0)
    exact, found = (
        solve(tank, depth, 850.0, 6) for solve in (rectangular_coefficients, section_coefficients)
    )
    order = [found.names.index(name) for name in exact.names]
    wall, lid = wetted(tank, depth)
    points = (wall + lid).points[::23]
    exactly, approximately = (c.potentials for c in (exact, found) if c.potentials)
    assert approximately.modes(points)[:, order] == pytest.approx(exactly.modes(points), abs=1e-6)
    rotation = exactly.stokes_joukowski(points)
    error = np.abs(approximately.stokes_joukowski(points) - rotation) / np.abs(rotation).max(0)
    # largest in the corners of the bottom, where second derivatives are logarithmic
    assert error.max() < 1e-3
    assert np.sqrt(np.mean(error**2)) < 5e-5


def test_section_finds_points_in_any_liquid() -> None:
    """Wherever a point is, in a film or in a nearly full pipe: phi = f, and odd ones vanish."""
    rng = np.random.default_rng(4)
    for fill_ratio in (0.01, 0.05, 0.3, 0.5, 0.7, 0.95, 0.99):
        depth = PIPE.depth(fill_ratio)
        c = section_coefficients(PIPE, depth, 850.0, 12)
        assert c.potentials is not None
        wall, _ = wetted(PIPE, depth)
        points = wall.points * rng.uniform(0.0, 1.0, (len(wall.points), 1))
        points[::2] = wall.points[::2]
        points = points[::3]
        values = c.potentials.modes(points)
        assert np.abs(values).max() < 1.0 + 1e-6  # greatest on the free surface
        mirrored = c.potentials.modes(points * [1.0, -1.0, 1.0])
        odd = np.array([name[-2] == 'y' and int(name[-1]) % 2 == 1 for name in c.names])
        assert np.array_equal(mirrored, np.where(odd, -1.0, 1.0) * values)
    with pytest.raises(InputError, match='has no liquid at y = 1'):
        c.potentials.modes(np.array([[0.0, 1.2, -1.0]]))


@pytest.mark.parametrize(
    ('tank', 'depth'),
    [
        (rectangular(50.0, 2.0, 3.0), 1e-3),
        (rectangular(0.1, 0.1, 30.0), 25.0),
        (cylinder_z(50.0, 3.0), 1e-3),
        (cylinder_z(0.1, 30.0), 25.0),
    ],
)
def test_films_and_shafts_do_not_overflow(tank: Tank, depth: float) -> None:
    c = coefficients_of(tank, depth, 850.0, 40)
    assert c.potentials is not None
    wall, lid = wetted(tank, depth)
    points = np.concatenate([(wall + lid).points[::7], [[0.0, 0.0, 0.0], [0.0, 0.0, -depth]]])
    with np.errstate(all='raise', under='ignore'):
        modes = c.potentials.modes(points)
        rotation = c.potentials.stokes_joukowski(points)
    assert np.abs(modes).max() < 1.0 + 1e-12
    size = np.max(np.ptp(points, axis=0))
    assert np.abs(rotation).max() < size**2


def test_ratios_of_hyperbolic_functions() -> None:
    k = np.array([0.3, 2.0, 9.0])
    assert cosh_ratio(k, -0.4 * np.ones(3), 1.1) == pytest.approx(
        np.cosh(k * 0.7) / np.cosh(k * 1.1)
    )
    assert sinh_ratio(k, -0.4, 1.1) == pytest.approx(-np.sinh(k * 0.4) / (k * np.cosh(k * 1.1)))
    with np.errstate(over='raise', invalid='raise'):
        assert cosh_ratio(np.array([1e9]), np.array([-1.0]), 3.0) == 0.0
        assert sinh_ratio(np.array([1e9]), 2.0, 2.0) == pytest.approx(1e-9)
        assert sinh_ratio(np.array([1e-150]), 0.7, 2.0) == pytest.approx(0.7)
        assert sinh_ratio(np.array([1e-150]), 0.0, 2.0) == 0.0
