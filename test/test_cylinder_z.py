"""The upright cylinder: published zeros, integrals over the liquid, its limits."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.special import i1, ivp, j1, jvp

from slosh_ros.constants import GRAVITY
from slosh_ros.hydro import ModalCoefficients, coefficients_of
from slosh_ros.tank.upright import cylinder_z

Array = NDArray[np.float64]

RADIUS, DEPTH, DENSITY = 1.2, 0.9, 850.0
TANK = cylinder_z(RADIUS, 2.0)

# zeros of J_1', Abramowitz and Stegun, table 9.5
PUBLISHED_ZEROS = (1.84118, 5.33144, 8.53632, 11.70600, 14.86359)


def solved(depth: float = DEPTH, modes: int = 10) -> ModalCoefficients:
    return coefficients_of(TANK, depth, DENSITY, modes)


def quadrature(depth: float) -> tuple[Array, Array, Array]:
    """Points (3, n) of the liquid in cylindrical coordinates, weights, and cartesian points."""
    node, weight = np.polynomial.legendre.leggauss(40)
    theta = 2.0 * np.pi * np.arange(16) / 16
    r, t, z = (
        grid.ravel()
        for grid in np.meshgrid(
            RADIUS * (node + 1.0) / 2.0, theta, depth * (node - 1.0) / 2.0, indexing='ij'
        )
    )
    w = np.einsum('i,j,k->ijk', weight, np.full(16, 2.0 * np.pi / 16), weight).ravel()
    cartesian = np.stack([r * np.cos(t), r * np.sin(t), z])
    return np.stack([r, t, z]), w * r * RADIUS * depth / 4.0, cartesian


def gradient(zero: float, sine: bool, depth: float, at: Array) -> Array:
    """Cartesian gradient of the potential whose value is 1 on the wall towards -x or -y."""
    r, t, z = at
    k = zero / RADIUS
    angular, turned = (np.sin(t), np.cos(t)) if sine else (np.cos(t), -np.sin(t))
    vertical = np.cosh(k * (z + depth)) / np.cosh(k * depth) / -j1(zero)
    slope = np.sinh(k * (z + depth)) / np.cosh(k * depth) / -j1(zero)
    along = k * jvp(1, k * r) * angular * vertical
    around = j1(k * r) / r * turned * vertical
    up = k * j1(k * r) * angular * slope
    return np.stack(
        [along * np.cos(t) - around * np.sin(t), along * np.sin(t) + around * np.cos(t), up]
    )


def test_frequencies_are_those_of_the_published_zeros() -> None:
    for pair, zero in enumerate(PUBLISHED_ZEROS):
        omega = np.sqrt(GRAVITY * zero / RADIUS * np.tanh(zero * DEPTH / RADIUS))
        assert solved().omega[2 * pair : 2 * pair + 2] == pytest.approx(omega, rel=3e-6)


def test_first_mode_carries_the_published_share_of_the_mass() -> None:
    """m_1/m = 2 R tanh(e d/R)/(e (e^2 - 1) d): Abramson, NASA SP-106, and Ibrahim."""
    for depth in (0.3, 0.9, 1.9):
        c = solved(depth)
        zero = 1.841183781
        share = 2.0 * RADIUS * np.tanh(zero * depth / RADIUS) / (zero * (zero**2 - 1.0) * depth)
        assert c.coupling[0, 0] ** 2 / c.mu[0] / c.mass == pytest.approx(share, rel=1e-8)


def test_first_mode_hangs_at_the_published_height() -> None:
    """Slosh mass d/2 - (2 R/e) tanh(e d/2R) + d/2 below the surface: Abramson, NASA SP-106."""
    c = solved()
    zero = 1.841183781
    height = c.coupling[0, 4] / c.coupling[0, 0]
    above_centre = DEPTH / 2.0 - 2.0 * RADIUS / zero * np.tanh(zero * DEPTH / (2.0 * RADIUS))
    assert height == pytest.approx(above_centre - DEPTH / 2.0, rel=1e-9)


@pytest.mark.parametrize('pair', range(5))
@pytest.mark.parametrize('sine', [False, True], ids=['cosine', 'sine'])
@pytest.mark.parametrize('depth', [0.2, 0.9, 1.9])
def test_couplings_are_greens_volume_integrals(pair: int, sine: bool, depth: float) -> None:
    """Couplings are (rho/kappa) int (grad phi, r x grad phi) dV over the liquid, THEORY 1."""
    c = solved(depth)
    j = 2 * pair + sine
    at, weight, r = quadrature(depth)
    grad = gradient(PUBLISHED_ZEROS_FULL[pair], sine, depth, at)
    scale = np.abs(j1(PUBLISHED_ZEROS_FULL[pair])) / j1(PUBLISHED_ZEROS_FULL[0])
    grad *= scale
    kappa = c.omega[j] ** 2 / GRAVITY
    energy = DENSITY / kappa**2 * np.sum(weight * grad**2)
    assert c.mu[j] == pytest.approx(energy, rel=1e-9)
    turned = DENSITY / kappa * np.cross(r, grad, axis=0) @ weight
    assert c.coupling[j, 3:] == pytest.approx(turned, rel=1e-8, abs=1e-8)
    pushed = DENSITY / kappa * grad @ weight
    assert c.coupling[j, :2] == pytest.approx(pushed[:2], rel=1e-8, abs=1e-8)


PUBLISHED_ZEROS_FULL = tuple(
    # Newton's step from five digits to all
    zero - jvp(1, zero) / jvp(1, zero, 2)
    for zero in PUBLISHED_ZEROS
)


@pytest.mark.parametrize('depth', [0.2, 0.9, 1.9])
def test_stokes_joukowski_inertia_is_the_energy_of_its_potential(depth: float) -> None:
    """The gradient of the series is checked against the boundary condition, then squared."""
    at, weight, _ = quadrature(depth)
    r, t, z = at
    grad = np.stack([-(z + depth) * np.cos(t), (z + depth) * np.sin(t), -r * np.cos(t)])
    wall = np.zeros(40)
    heights = np.linspace(-0.95, -0.05, 40) * depth
    for m in range(1, 160, 2):
        q = m * np.pi / depth
        factor = -8.0 * depth / np.pi**2 / m**2 / (q * ivp(1, q * RADIUS))
        cosine, sine = np.cos(q * (z + depth)), np.sin(q * (z + depth))
        grad += factor * np.stack(
            [
                q * ivp(1, q * r) * cosine * np.cos(t),
                -i1(q * r) / r * cosine * np.sin(t),
                -q * i1(q * r) * sine * np.cos(t),
            ]
        )
        wall += factor * q * ivp(1, q * RADIUS) * np.cos(q * (heights + depth))
        if q * RADIUS > 600.0:
            break
    # dOmega_5/dn = z n_1 on the wall, where r is the normal
    assert wall - (heights + depth) == pytest.approx(heights, abs=0.01 * depth)
    energy = DENSITY * np.sum(weight * grad**2)
    inertia = solved(depth).inertia_stokes_joukowski
    assert inertia[1, 1] == pytest.approx(energy, rel=1e-4)
    assert inertia[0, 0] == inertia[1, 1]


def test_a_smooth_round_wall_takes_nothing_along_in_yaw() -> None:
    c = solved()
    assert c.inertia_stokes_joukowski[2, 2] == 0.0
    assert np.all(c.coupling[:, 5] == 0.0)
    assert c.inertia_frozen[2, 2] == pytest.approx(c.mass * RADIUS**2 / 2.0)


def test_frozen_inertia_by_quadrature() -> None:
    _, weight, (x, y, z) = quadrature(DEPTH)
    c = solved()
    moments = [y**2 + z**2, x**2 + z**2, x**2 + y**2]
    assert np.diag(c.inertia_frozen) == pytest.approx(
        [DENSITY * float(weight @ m) for m in moments]
    )
    assert c.liquid.surface_inertia == pytest.approx(np.pi * RADIUS**4 / 4.0 * np.eye(2))


@pytest.mark.parametrize('depth', [0.02, 0.9, 1.98])
def test_a_lid_only_takes_inertia_away(depth: float) -> None:
    c = solved(depth)
    rest = np.diag(c.inertia_frozen - c.inertia_stokes_joukowski)
    assert np.all(rest > 0.0)


def test_a_film_and_a_rod_move_as_if_frozen_in_pitch() -> None:
    """A film only tips, a thin rod only swings: the lid takes nothing from either."""
    for tank, depth in ((cylinder_z(1.0, 1.0), 1e-4), (cylinder_z(1e-4, 1.0), 0.9)):
        c = coefficients_of(tank, depth, DENSITY, 2)
        frozen, lid = (m[1, 1] for m in (c.inertia_frozen, c.inertia_stokes_joukowski))
        assert lid == pytest.approx(frozen, rel=1e-3)


def test_shallow_liquid_runs_as_long_waves_and_deep_liquid_forgets_the_bottom() -> None:
    zero = PUBLISHED_ZEROS_FULL[0]
    shallow = coefficients_of(cylinder_z(1.0, 1.0), 1e-3, DENSITY, 2).omega[0]
    assert shallow == pytest.approx(zero * np.sqrt(GRAVITY * 1e-3), rel=1e-5)
    deep = coefficients_of(cylinder_z(1.0, 20.0), 10.0, DENSITY, 2).omega[0]
    assert deep == pytest.approx(np.sqrt(GRAVITY * zero), rel=1e-12)


def test_sums_over_all_modes() -> None:
    """The modes together carry the hydrostatic moment (Parseval), and less than the mass."""
    c = solved(modes=160)
    surface = DENSITY * np.diag(c.liquid.surface_inertia)
    assert np.all(np.diag(c.static_residual) > 0.0)
    assert c.static_residual == pytest.approx(np.zeros((2, 2)), abs=1e-5 * surface[0])
    assert np.sum(c.coupling[:, 0] ** 2 / c.mu) < c.mass


def test_shapes_have_their_crest_towards_negative_x_and_y() -> None:
    c = solved(modes=6)
    for j, axis in enumerate([0, 1] * 3):
        edge = np.argmin(c.surface_points[:, axis])
        assert c.surface_shapes[edge, j] > 0.0
    assert np.abs(c.surface_shapes).max(axis=0) == pytest.approx(np.ones(6), abs=0.03)
    top = quad(lambda r: r * j1(PUBLISHED_ZEROS_FULL[1] * r / RADIUS) ** 2, 0.0, RADIUS)[0]
    mean_square = np.pi * top / j1(PUBLISHED_ZEROS_FULL[0]) ** 2  # with max |f| = 1
    assert c.mu[2] == pytest.approx(DENSITY * GRAVITY / c.omega[2] ** 2 * mean_square)


def test_modes_come_in_pairs_of_one_frequency() -> None:
    c = solved(modes=5)
    assert c.names == ('x1', 'y1', 'x3', 'y3', 'x5')
    assert c.omega[[0, 2]] == pytest.approx(c.omega[[1, 3]], rel=1e-15)
    assert c.coupling[1, 1] == c.coupling[0, 0]
    assert c.coupling[1, 3] == -c.coupling[0, 4]


@pytest.mark.parametrize('fill_ratio', [0.01, 0.5, 0.99])
def test_fill_ratio_and_depth_round_trip(fill_ratio: float) -> None:
    depth = TANK.depth(fill_ratio)
    assert TANK.fill_ratio(depth) == pytest.approx(fill_ratio)
    liquid = TANK.filled(depth)
    assert liquid.volume == pytest.approx(fill_ratio * TANK.volume)
    assert liquid.surface_height + liquid.freeboard == pytest.approx(TANK.height / 2.0)


@pytest.mark.parametrize('depth', [0.2, 0.9, 1.9])
@pytest.mark.parametrize('pair', [0, 1, 2])
def test_wall_friction_by_quadrature(depth: float, pair: int) -> None:
    """Squared velocity along side wall and bottom over that in the volume."""
    zero = PUBLISHED_ZEROS_FULL[pair]
    node, weight = np.polynomial.legendre.leggauss(40)
    theta = 2.0 * np.pi * np.arange(16) / 16
    z, r = depth * (node - 1.0) / 2.0, RADIUS * (node + 1.0) / 2.0

    def speed_squared(r: Array, z: Array) -> Array:
        at = np.stack(np.broadcast_arrays(r, theta[:, np.newaxis], z)).reshape(3, -1)
        return np.sum(gradient(zero, False, depth, at) ** 2, axis=0).reshape(16, -1).sum(axis=0)

    around = 2.0 * np.pi / 16
    side = around * RADIUS * depth / 2.0 * weight @ speed_squared(np.full(40, RADIUS), z)
    bottom = around * RADIUS / 2.0 * (weight * r) @ speed_squared(r, np.full(40, -depth))
    at, volume, _ = quadrature(depth)
    inside = np.sum(volume * gradient(zero, False, depth, at) ** 2)
    c = solved(depth)
    assert c.wall_friction[2 * pair] == pytest.approx((side + bottom) / (2.0 * inside), rel=1e-8)
    assert c.wall_friction[2 * pair + 1] == c.wall_friction[2 * pair]


def test_damping_of_a_deep_cylinder_is_case_and_parkinsons() -> None:
    """Damping ratio sqrt(nu/(2 omega))/(2 R) (1 + 1/e^2)/(1 - 1/e^2) with no bottom felt."""
    nu = 1e-6
    c = coefficients_of(cylinder_z(RADIUS, 20.0), 10.0, DENSITY, 2)
    e = PUBLISHED_ZEROS_FULL[0]
    published = np.sqrt(nu / (2.0 * c.omega)) / (2.0 * RADIUS) * (e**2 + 1.0) / (e**2 - 1.0)
    assert c.wall_damping_ratio(nu) == pytest.approx(published, rel=1e-6)
