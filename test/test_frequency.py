"""Added mass over frequency: against finite elements in 3-D, the paper's peaks, its limits."""

from __future__ import annotations

import numpy as np
import pytest
import skfem
from numpy.typing import NDArray
from scipy.sparse.linalg import splu
from skfem.helpers import dot, grad

from slosh_ros.constants import GRAVITY
from slosh_ros.hydro import coefficients_of
from slosh_ros.hydro.frequency import (
    modal_added_mass,
    rectangular_wall_ratio,
    total_added_mass,
)
from slosh_ros.hydro.rectangular import rectangular_coefficients
from slosh_ros.tank import cylinder_x, rectangular
from slosh_ros.tank.upright import cylinder_z

Array = NDArray[np.float64]

LENGTH, WIDTH, DEPTH, DENSITY = 8.0, 2.0, 0.8, 850.0
TABLE_1 = rectangular(LENGTH, WIDTH, 1.6)
MANY = rectangular_coefficients(TABLE_1, DEPTH, DENSITY, 250)
WALL_RATIO = rectangular_wall_ratio(TABLE_1, DEPTH, MANY.names)
PAPER_GRID = 0.05 + 0.1 * np.arange(50)


class FiniteElements:
    """Radiation problem of the liquid of Table 1 in 3-D, with the impedance walls of eq (36)."""

    def __init__(self) -> None:
        # along x as fine as the third surge mode wants it
        mesh = skfem.MeshHex.init_tensor(
            np.linspace(-LENGTH / 2.0, LENGTH / 2.0, 25),
            np.linspace(-WIDTH / 2.0, WIDTH / 2.0, 7),
            np.linspace(-DEPTH, 0.0, 5),
        ).with_boundaries({'surface': lambda x: x[2] == 0.0, 'wall': lambda x: x[2] < -1e-9})
        top = mesh.facets_satisfying(lambda x: np.isclose(x[2], 0.0), boundaries_only=True)
        wall = np.setdiff1d(mesh.boundary_facets(), top)
        element = skfem.ElementHex2()
        inside = skfem.Basis(mesh, element)
        on_top, on_wall = (
            skfem.FacetBasis(mesh, element, facets=facets) for facets in (top, wall)
        )

        @skfem.BilinearForm
        def stiffness(u, v, _):
            return dot(grad(u), grad(v))

        @skfem.BilinearForm
        def mass(u, v, _):
            return u * v

        def normal(k: int) -> skfem.LinearForm:
            def form(v, w):
                arm = [w.n, np.cross(w.x, w.n, axis=0)][k // 3]
                return arm[k % 3] * v

            return skfem.LinearForm(form)

        self.stiffness = stiffness.assemble(inside)
        self.surface = mass.assemble(on_top)
        self.wall = mass.assemble(on_wall)
        self.normals = np.stack([normal(k).assemble(on_wall) for k in range(6)], axis=1)

    def added_mass(self, omega: float, epsilon: float = 0.0) -> NDArray[np.complex128]:
        k0 = omega**2 / GRAVITY
        matrix = self.stiffness - k0 * self.surface - 1j * epsilon * k0 * self.wall
        potential = splu(matrix.tocsc()).solve(self.normals.astype(complex))
        return DENSITY * self.normals.T @ potential  # eq (31)


@pytest.fixture(scope='module')
def elements() -> FiniteElements:
    return FiniteElements()


ENTRIES = [(0, 0), (1, 1), (0, 4), (4, 0), (1, 3), (3, 1), (3, 3), (4, 4), (5, 5)]


@pytest.mark.parametrize('omega', [0.3, 1.3, 2.0, 3.3, 4.0])
def test_total_added_mass_is_that_of_finite_elements(
    elements: FiniteElements, omega: float
) -> None:
    """A direct solution of the boundary value problem that knows nothing of modes."""
    direct = elements.added_mass(omega)
    modal = total_added_mass(MANY, [omega])[0]
    for i, j in ENTRIES:
        # the scale of the entry over the band: some are near a zero of theirs
        assert modal[i, j] == pytest.approx(
            direct[i, j], rel=2e-3, abs=2e-4 * abs(direct[j, j])
        ), (i, j)


@pytest.mark.parametrize(
    ('entry', 'omega'), [(0, 1.07), (0, 1.09), (0, 2.91), (1, 3.6), (1, 3.63)]
)
def test_wall_damping_is_that_of_finite_elements(
    elements: FiniteElements, entry: int, omega: float
) -> None:
    """Near resonance, where eq (36) decides height and phase, it acts as a loss factor."""
    direct = elements.added_mass(omega, 0.01)[entry, entry]
    modal = total_added_mass(MANY, [omega], 0.01, WALL_RATIO)[0, entry, entry]
    assert direct.imag > 0.1 * abs(direct)
    assert abs(modal - direct) < 0.03 * abs(direct)


# (omega, A11, A15) of the tank of Table 1: THEORY 5, by another finite element code
SHARED = [
    (0.3, 11600.09, 73567.0),
    (0.8, 21227.9, 146055.6),
    (1.0, 60663.0, 444525.0),
    (1.3, -16758.4, -142840.0),
    (2.0, -435.1, -23077.1),
    (2.7, 5473.9, -7086.3),
    (3.3, -1771.5, -5812.1),
    (4.0, 2192.6, -2567.6),
    (4.8, 476.2, -532.9),
]


def test_total_added_mass_to_the_digits_of_the_shared_table() -> None:
    omega, a11, a15 = np.array(SHARED).T
    found = total_added_mass(MANY, omega)
    assert found[:, 0, 0].real == pytest.approx(a11, rel=5e-6, abs=0.15)
    assert found[:, 0, 4].real == pytest.approx(a15, rel=5e-6, abs=0.15)
    assert np.all(found.imag == 0.0)


@pytest.mark.parametrize(
    ('entry', 'peaks'), [(0, [1.05, 2.95, 4.25]), (1, [3.65])], ids=['A11', 'A22']
)
@pytest.mark.parametrize('seen', [np.abs, np.imag])
def test_the_papers_peaks_are_its_grid(entry: int, peaks: list[float], seen: np.ufunc) -> None:
    """1.05, 2.95, 4.25, 3.65 rad/s are points of the grid; off it the peaks stand at the modes."""

    def peaks_on(grid: Array) -> Array:
        height = seen(modal_added_mass(MANY, grid, 0.02, WALL_RATIO)[:, entry, entry])
        top = (height[1:-1] > height[:-2]) & (height[1:-1] > height[2:])
        return grid[1:-1][top]

    assert peaks_on(PAPER_GRID) == pytest.approx(peaks)
    natural = [1.082569, 2.917224, 4.203104] if entry == 0 else [3.619414]
    if seen is np.imag:  # the peaks of the modulus stand beside, by the mass of the other modes
        assert peaks_on(np.arange(0.05, 5.0, 0.001)) == pytest.approx(natural, abs=0.002)


def test_entries_are_equations_32_to_35() -> None:
    """The sums as printed, and those of 44, 55 and 66 that go with them."""
    omega = 2.3
    found = modal_added_mass(MANY, [omega])[0]
    response = omega**2 / (MANY.omega**2 - omega**2) / MANY.mu
    lambda_1, lambda_2, _, lambda_4, lambda_5, lambda_6 = MANY.coupling.T
    pitch = GRAVITY * lambda_1 / omega**2 + lambda_5
    roll = -GRAVITY * lambda_2 / omega**2 + lambda_4
    for (i, j), left, right in (
        ((1, 1), lambda_1, lambda_1),
        ((2, 2), lambda_2, lambda_2),
        ((1, 5), pitch, lambda_1),
        ((5, 1), pitch, lambda_1),
        ((2, 4), roll, lambda_2),
        ((4, 2), roll, lambda_2),
        ((5, 5), pitch, pitch),
        ((4, 4), roll, roll),
        ((6, 6), lambda_6, lambda_6),
    ):
        assert found[i - 1, j - 1] == pytest.approx(np.sum(left * right * response)), (i, j)


def test_limits_of_zero_and_infinite_frequency() -> None:
    for frozen, fast in ((0.0, np.inf), (1e-4, 1e4)):
        low, high = modal_added_mass(MANY, [frozen, fast]).real
        lambdas = MANY.coupling
        assert low[0, 0] == pytest.approx(0.0, abs=1e-3)
        assert low[0, 4] == pytest.approx(DENSITY * WIDTH * LENGTH**3 / 12.0, rel=1e-4)
        assert low[1, 3] == pytest.approx(-DENSITY * LENGTH * WIDTH**3 / 12.0, rel=1e-3)
        assert low[4, 4] > 1e12
        assert high == pytest.approx(-(lambdas.T / MANY.mu) @ lambdas, rel=1e-4, abs=1e-2)
    assert high[0, 0] < 0.0 < high[0, 4]
    assert high[1, 3] < 0.0


@pytest.mark.parametrize(
    'tank', [TABLE_1, cylinder_z(1.2, 2.0), cylinder_x(1.0, 3.0)], ids=lambda tank: tank.shape
)
def test_at_rest_the_liquid_is_a_mass_with_a_metacentre(tank) -> None:
    """At frequency 0: A11 = m, A15 = m z_c + rho I_xx, A24 = -(m z_c + rho I_yy), finite A55."""
    c = coefficients_of(tank, 0.9, DENSITY, 12)
    at_rest = total_added_mass(c, [0.0])[0].real
    i_xx, i_yy = DENSITY * np.diag(c.liquid.surface_inertia)
    z = c.liquid.centroid[2]
    assert at_rest[[0, 1, 2], [0, 1, 2]] == pytest.approx([c.mass] * 3)
    assert at_rest[0, 4] == pytest.approx(c.mass * z + i_xx)
    assert at_rest[1, 3] == pytest.approx(-(c.mass * z + i_yy))
    assert np.all(np.isfinite(at_rest))
    # what a code leaves to its stiffness matrix
    other = total_added_mass(c, [0.7], hydrostatic=False) - total_added_mass(c, [0.7])
    expected = np.zeros((6, 6))
    expected[[3, 4], [3, 4]] = GRAVITY / 0.7**2 * np.array([i_yy, i_xx])
    assert other[0] == pytest.approx(expected, abs=1e-6)


def test_infinite_frequency_leaves_less_than_the_liquids_mass() -> None:
    high = total_added_mass(MANY, [np.inf])[0].real
    assert np.linalg.eigvalsh(high[np.ix_([0, 1, 5], [0, 1, 5])]).min() > 0.0


def test_added_mass_is_symmetric_and_dissipates() -> None:
    found = total_added_mass(MANY, np.linspace(0.1, 6.0, 40), 0.02, WALL_RATIO)
    assert found == pytest.approx(found.transpose(0, 2, 1))
    scale = np.sqrt(np.einsum('nii->ni', np.abs(found)))
    scaled = found.imag / scale[:, :, np.newaxis] / scale[:, np.newaxis, :]
    assert np.linalg.eigvalsh(scaled).min() > -1e-9


@pytest.mark.parametrize('name', ['x1', 'y1', 'x3', 'x1y1', 'x3y1'])
def test_wall_ratio_by_quadrature(name: str) -> None:
    node, weight = np.polynomial.legendre.leggauss(40)
    a, b = (int(name.split(axis)[1][0]) if axis in name else 0 for axis in 'xy')
    k_a, k_b = np.pi * a / LENGTH, np.pi * b / WIDTH
    k = np.hypot(k_a, k_b)
    x, y, z = node * LENGTH / 2.0, node * WIDTH / 2.0, (node - 1.0) * DEPTH / 2.0
    wx, wy, wz = weight * LENGTH / 2.0, weight * WIDTH / 2.0, weight * DEPTH / 2.0

    def squared(x: Array, y: Array, z: Array) -> Array:
        f = np.cos(k_a * (x + LENGTH / 2.0)) * np.cos(k_b * (y + WIDTH / 2.0))
        return (f * np.cosh(k * (z + DEPTH)) / np.cosh(k * DEPTH)) ** 2

    def over(u: Array, v: Array, values: Array) -> float:
        return float(u @ values @ v)

    walls = sum(
        over(wy, wz, squared(side * LENGTH / 2.0, y[:, None], z))
        + over(wx, wz, squared(x[:, None], side * WIDTH / 2.0, z))
        for side in (-1.0, 1.0)
    ) + over(wx, wy, squared(x[:, None], y, -DEPTH))
    surface = over(wx, wy, squared(x[:, None], y, 0.0))
    assert rectangular_wall_ratio(TABLE_1, DEPTH, (name,)) == pytest.approx([walls / surface])


def test_damping_without_its_wall_ratio_is_refused() -> None:
    with pytest.raises(TypeError, match='wall_ratio'):
        modal_added_mass(MANY, [1.0], 0.02)
    with pytest.raises(TypeError, match='rectangular'):
        rectangular_wall_ratio(cylinder_x(1.0, 2.0), 0.5, ('x1',))
