"""The closed form: the paper's Table 1, the volume integrals behind it, its sums."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.hydro.coefficients import ModalCoefficients
from slosh_ros.hydro.rectangular import rectangular_coefficients
from slosh_ros.hydro.section import section_coefficients
from slosh_ros.tank import cylinder_x, rectangular

Array = NDArray[np.float64]

LENGTH, WIDTH, DEPTH, DENSITY = 8.0, 2.0, 0.8, 850.0  # Table 1; the density is not printed there
TABLE_1 = rectangular(LENGTH, WIDTH, 1.6)
SURGE, SWAY, _, ROLL, PITCH, _ = range(6)


@pytest.fixture(scope='module')
def coefficients() -> ModalCoefficients:
    return rectangular_coefficients(TABLE_1, DEPTH, DENSITY, 12)


def mode(coefficients: ModalCoefficients, name: str) -> dict[str, float]:
    j = coefficients.names.index(name)
    lambdas = {f'lambda_{k + 1}': float(coefficients.coupling[j, k]) for k in range(6)}
    return {'omega': float(coefficients.omega[j]), 'mu': float(coefficients.mu[j]), **lambdas}


@pytest.mark.parametrize(
    ('name', 'quantity', 'printed', 'digits'),
    [
        ('x1', 'omega', 1.082569, 6),
        ('x1', 'lambda_1', -22047.49, 2),
        ('x1', 'mu', 56920.24, 2),
        ('x1', 'lambda_5', 17494.34, 2),
        ('y1', 'omega', 3.619414, 6),
        ('y1', 'lambda_2', -5511.87, 2),
        ('y1', 'mu', 5092.15, 2),
        ('y1', 'lambda_4', -3908.24, 2),
        ('x3', 'omega', 2.917224, 6),
        ('x3', 'lambda_1', -2449.72, 2),
        ('x3', 'mu', 7838.60, 2),
        ('x3', 'lambda_5', 1826.53, 2),
        ('x5', 'omega', 4.203104, 6),
        ('x5', 'lambda_1', -881.90, 2),
        ('x5', 'mu', 3776.05, 2),
        ('x5', 'lambda_5', 589.10, 2),
        ('x1y1', 'lambda_6', 7884.27, 2),
    ],
)
def test_table_1_to_every_printed_digit(
    coefficients: ModalCoefficients, name: str, quantity: str, printed: float, digits: int
) -> None:
    assert round(mode(coefficients, name)[quantity], digits) == printed


@pytest.mark.parametrize(
    ('name', 'axis', 'printed'), [('x1', 'lambda_1', -0.38734), ('y1', 'lambda_2', -1.08242)]
)
def test_table_1_forcing_coefficient(
    coefficients: ModalCoefficients, name: str, axis: str, printed: float
) -> None:
    values = mode(coefficients, name)
    assert round(values[axis] / values['mu'], 5) == printed


def test_third_lateral_mode() -> None:
    many = rectangular_coefficients(TABLE_1, DEPTH, DENSITY, 30)
    assert mode(many, 'y3')['omega'] == pytest.approx(6.795, abs=1e-3)


def test_mass_and_inertias_of_table_1(coefficients: ModalCoefficients) -> None:
    assert coefficients.mass == pytest.approx(10880.0)
    assert np.diag(coefficients.inertia_frozen).round() == pytest.approx([5948, 60348, 61653])
    assert np.diag(coefficients.inertia_stokes_joukowski).round(2) == pytest.approx(
        [4211.35, 58172.95, 49432.35]
    )


def test_sums_over_all_modes_of_table_1() -> None:
    # In a tank too narrow for cross modes the lowest modes are those of one direction.
    count = 60
    narrow = 1e-2
    along = rectangular_coefficients(rectangular(LENGTH, narrow, 1.6), DEPTH, DENSITY, count)
    across = rectangular_coefficients(rectangular(narrow, WIDTH, 1.6), DEPTH, DENSITY, count)
    for c, axis, moment, span, side, mass_sum, moment_sum in (
        (along, SURGE, PITCH, LENGTH, WIDTH, 9698.97, -7572.90),
        (across, SWAY, ROLL, WIDTH, LENGTH, 6329.44, 4356.39),
    ):
        scale = side / narrow
        # The rest of the sum, sum over odd a > 2 count of 8 rho side span^2/(pi a)^3, by its
        # integral: tanh(k d) is 1 there.
        rest = 8.0 * DENSITY * side * span**2 / np.pi**3 / (4.0 * (2.0 * count) ** 2)
        masses = c.coupling[:, axis] ** 2 / c.mu * scale
        moments = c.coupling[:, axis] * c.coupling[:, moment] / c.mu * scale
        assert masses.sum() + rest == pytest.approx(mass_sum, abs=0.006)
        assert moments.sum() == pytest.approx(moment_sum, rel=1e-5)


@pytest.mark.parametrize('name', ['x1', 'x3', 'y1', 'y3', 'x1y1', 'x3y1', 'x1y3'])
def test_couplings_are_greens_volume_integrals(name: str) -> None:
    """lambda_4..6 = (rho/kappa) int (r x grad phi) dV, with the closed-form potential."""
    c = rectangular_coefficients(TABLE_1, DEPTH, DENSITY, 30)
    values = mode(c, name)
    a, b = (int(name.split(axis)[1][0]) if axis in name else 0 for axis in 'xy')
    k_a, k_b = np.pi * a / LENGTH, np.pi * b / WIDTH
    k = np.hypot(k_a, k_b)

    node, weight = np.polynomial.legendre.leggauss(24)
    x, y, z = np.meshgrid(
        node * LENGTH / 2.0, node * WIDTH / 2.0, (node - 1.0) * DEPTH / 2.0, indexing='ij'
    )
    volume = np.einsum('i,j,k->ijk', weight, weight, weight) * LENGTH * WIDTH * DEPTH / 8.0
    u, v = k_a * (x + LENGTH / 2.0), k_b * (y + WIDTH / 2.0)
    cosh, sinh = (f(k * (z + DEPTH)) / np.cosh(k * DEPTH) for f in (np.cosh, np.sinh))
    phi_x = -k_a * np.sin(u) * np.cos(v) * cosh
    phi_y = -k_b * np.cos(u) * np.sin(v) * cosh
    phi_z = k * np.cos(u) * np.cos(v) * sinh

    per_kappa = DENSITY * GRAVITY / values['omega'] ** 2
    integrals = {
        'lambda_4': per_kappa * np.sum(volume * (y * phi_z - z * phi_y)),
        'lambda_5': per_kappa * np.sum(volume * (z * phi_x - x * phi_z)),
        'lambda_6': per_kappa * np.sum(volume * (x * phi_y - y * phi_x)),
    }
    for quantity, integral in integrals.items():
        assert values[quantity] == pytest.approx(integral, rel=1e-9, abs=1e-6), quantity


def test_modal_mass_is_the_integral_of_the_surface_shape() -> None:
    """Eqs (10)-(12): mu = (rho g/omega^2) int f^2 dS, lambda_1,2 = rho int f (x, y) dS."""
    six = rectangular_coefficients(TABLE_1, DEPTH, DENSITY, 6)
    n = round(np.sqrt(len(six.surface_points)))
    simpson = np.array([1.0, *[4.0, 2.0] * (n // 2)]) / 3.0
    simpson[-1] = 1.0 / 3.0
    weight = np.outer(simpson, simpson).ravel() * LENGTH * WIDTH / (n - 1) ** 2
    f = six.surface_shapes
    mu = DENSITY * GRAVITY / six.omega**2 * (weight @ f**2)
    assert mu == pytest.approx(six.mu, rel=2e-3)
    moments = DENSITY * (weight * f.T) @ six.surface_points
    assert moments == pytest.approx(six.coupling[:, :2], rel=5e-3, abs=1e-6)


def test_crests_stand_on_the_sides_of_negative_x_and_y(coefficients: ModalCoefficients) -> None:
    corner = np.all(coefficients.surface_points == [-LENGTH / 2.0, -WIDTH / 2.0], axis=1)
    assert coefficients.surface_shapes[corner] == pytest.approx(np.ones((1, 12)))
    assert np.abs(coefficients.surface_shapes).max() == pytest.approx(1.0)


@pytest.mark.parametrize(
    ('length', 'width', 'depth'), [(8.0, 2.0, 0.8), (2.0, 3.0, 2.5), (5.0, 4.0, 0.1)]
)
def test_stokes_joukowski_inertia_by_another_route(
    length: float, width: float, depth: float
) -> None:
    """The series against the section solver, which knows nothing of rectangles."""
    tank = rectangular(length, width, 3.0)
    series = rectangular_coefficients(tank, depth, 1.0, 1).inertia_stokes_joukowski
    solved = section_coefficients(tank, depth, 1.0, 1).inertia_stokes_joukowski
    assert series == pytest.approx(solved, rel=3e-7)


@pytest.mark.parametrize('depth', [0.08, 0.8, 1.6])
def test_a_lid_only_takes_inertia_away(depth: float) -> None:
    c = rectangular_coefficients(TABLE_1, depth, DENSITY, 1)
    assert np.linalg.eigvalsh(c.inertia_frozen - c.inertia_stokes_joukowski).min() > 0.0
    assert np.linalg.eigvalsh(c.inertia_stokes_joukowski).min() > 0.0


def test_hydrostatic_moment_is_complete_with_all_modes() -> None:
    """Sum of g lambda^2/(mu omega^2) over all modes = rho I_xx, rho I_yy (Parseval)."""
    residuals = []
    for count in (10, 30, 90):
        c = rectangular_coefficients(TABLE_1, DEPTH, DENSITY, count)
        residuals.append(
            np.diag(c.static_residual) / (DENSITY * np.diag(c.liquid.surface_inertia))
        )
    assert np.all(np.array(residuals) > 0.0)
    assert np.all(np.diff(residuals, axis=0) < 0.0)
    # what is left of the sum over 96/(pi a)^4 after (1, 0), (3, 0) .. (2n - 1, 0)
    surge = sum('y' not in name for name in c.names)
    assert residuals[-1][0] == pytest.approx(
        96.0 / np.pi**4 / (6.0 * (2.0 * surge) ** 3), rel=0.02
    )


def test_a_square_plan_has_no_yaw_from_equal_half_waves() -> None:
    c = rectangular_coefficients(rectangular(2.0, 2.0, 2.0), 1.0, DENSITY, 12)
    assert 'x1y1' not in c.names
    assert {'x1y3', 'x3y1'} <= set(c.names)


def test_modes_stand_by_rising_frequency(coefficients: ModalCoefficients) -> None:
    assert np.all(np.diff(coefficients.omega) >= 0.0)
    four = rectangular_coefficients(TABLE_1, DEPTH, DENSITY, 4)
    assert four.names == coefficients.names[:4]
    assert four.coupling == pytest.approx(coefficients.coupling[:4])


def test_other_sections_are_refused() -> None:
    with pytest.raises(TypeError, match='rectangular section'):
        rectangular_coefficients(cylinder_x(1.0, 3.0), 1.0, DENSITY, 3)
