"""The section solver: known frequencies, exact identities of the circle, limits, convergence."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.hydro.coefficients import ModalCoefficients, peaks
from slosh_ros.hydro.rectangular import rectangular_coefficients
from slosh_ros.hydro.section import _Family, section_coefficients
from slosh_ros.hydro.section_functions import Parity
from slosh_ros.hydro.section_mesh import DEFAULT, Resolution, half_section
from slosh_ros.tank import Circle, UniformTank, cylinder_x, rectangular

Array = NDArray[np.float64]

SURGE, SWAY, _, ROLL, PITCH, YAW = range(6)
UNIT = Circle(1.0)
FILLS = (0.01, 0.1, 0.5, 0.9, 0.99)


class Row(NamedTuple):
    """A row of the table of a unit circle: triangular elements of degree 4, seven digits."""

    depth: float
    area: float
    sway: tuple[float, float, float]  # kappa
    even: tuple[float, float]  # kappa
    masses: tuple[float, float]  # of sway 1 and 2, per mass of liquid
    all_masses: float
    roll_inertia: float  # Stokes-Joukowski, per density and length


TABLE = [
    Row(0.4, 0.447295, (1.096982, 4.937039, 9.007492), (2.890542, 6.990583), (0.835662, 0.006113),
        0.842640, 0.062160),
    Row(1.0, 1.570796, (1.355727, 4.651054, 7.819864), (3.033105, 6.239198), (0.569156, 0.017797),
        0.594715, 0.487841),
    Row(1.6, 2.694297, (2.123716, 6.139316, 10.080735), (4.143275, 8.103143), (0.261153, 0.017537),
        0.291127, 1.537000),
]  # fmt: skip


def sway_modes(depth: float, count: int) -> ModalCoefficients:
    """
    Modes of a unit circle, density 1, in so short a tank that the lowest are all of sway.

    They are fewer than `count` in a film, whose higher modes do not couple.
    """
    length = 0.005 * UNIT.moments(depth).half_width
    found = section_coefficients(cylinder_x(1.0, length), depth, 1.0, count)
    sway = sum('x' not in name for name in found.names)
    assert found.names[:sway] == tuple(f'y{2 * n + 1}' for n in range(sway))
    assert sway >= min(count, 9)
    return lowest(found, sway)


def lowest(c: ModalCoefficients, count: int) -> ModalCoefficients:
    return replace(
        c,
        names=c.names[:count],
        omega=c.omega[:count],
        mu=c.mu[:count],
        coupling=c.coupling[:count],
        surface_shapes=c.surface_shapes[:, :count],
    )


def plane_eigenvalues(parity: str, depth: float, resolution: Resolution = DEFAULT) -> Array:
    """Eigenvalues kappa of the unit circle for a = 0, the constant excepted."""
    functions = half_section(UNIT, depth, resolution).whole(Parity[parity.upper()])
    return _Family(functions, UNIT.moments(depth), 1.0).steklov(0.0)[0]


def kappa(c: ModalCoefficients) -> Array:
    return c.omega**2 / GRAVITY


def relative_couplings(c: ModalCoefficients) -> Array:
    """Coupling lambda/sqrt(mu) over that of a rigid liquid: independent of the scale of f."""
    rigid = np.array([c.mass, c.mass, np.inf, *np.diag(c.inertia_frozen)])
    return c.coupling / np.sqrt(np.outer(c.mu, rigid))


# --- the circle: known values --------------------------------------------------------------------


def test_half_full_circle_has_the_literature_frequencies() -> None:
    assert plane_eigenvalues('odd', 1.0)[:3] == pytest.approx(
        [1.355727, 4.651055, 7.819864], abs=1e-6
    )
    assert plane_eigenvalues('even', 1.0)[:2] == pytest.approx([3.033105, 6.239198], abs=1e-6)


@pytest.mark.parametrize('row', TABLE, ids=lambda row: f'h={row.depth}R')
def test_table_of_the_circle(row: Row) -> None:
    c = sway_modes(row.depth, 20)
    length = c.liquid.volume / UNIT.moments(row.depth).area
    assert UNIT.moments(row.depth).area == pytest.approx(row.area, abs=1e-6)
    assert kappa(c)[:3] == pytest.approx(row.sway, abs=1e-6)
    assert plane_eigenvalues('even', row.depth)[:2] == pytest.approx(row.even, abs=1e-6)
    masses = relative_couplings(c)[:, SWAY] ** 2
    assert masses[:2] == pytest.approx(row.masses, abs=1e-6)
    assert masses.sum() == pytest.approx(row.all_masses, abs=6e-4)  # twenty of them
    assert c.inertia_stokes_joukowski[0, 0] / length == pytest.approx(row.roll_inertia, abs=1e-6)


def test_first_surge_mode_of_a_half_full_tank_by_3d_elements() -> None:
    c = section_coefficients(cylinder_x(1.2, 5.75), 1.2, 1000.0, 1)
    assert c.names == ('x1',)
    assert c.mu[0] == pytest.approx(26200.0, abs=1.0)
    assert c.coupling[0] == pytest.approx([-15866.0, 0.0, 0.0, 0.0, 15690.0, 0.0], abs=1.0)
    assert c.coupling[0, SURGE] ** 2 / c.mu[0] == pytest.approx(9607.9, abs=0.05)


@pytest.mark.parametrize(
    ('depth', 'inertia'),
    # roll, pitch, yaw of R = 1.2, L = 5.75: scikit-fem, curved quadratic triangles, no grading
    [
        (1.2, (5.81663, 35.93474, 25.99615)),
        (1.8, (15.36730, 60.49330, 40.83135)),
        (2.2, (27.60785, 78.70015, 49.47743)),
    ],
)
def test_stokes_joukowski_inertia_of_a_cylinder_by_triangles(
    depth: float, inertia: tuple[float, float, float]
) -> None:
    c = section_coefficients(cylinder_x(1.2, 5.75), depth, 1.0, 1)
    assert np.diag(c.inertia_stokes_joukowski) == pytest.approx(inertia, rel=5e-6)


def test_surface_of_the_first_sway_mode_is_neither_sine_nor_line() -> None:
    c = sway_modes(1.0, 1)
    side = np.isclose(c.surface_points[:, 1], -1.0)
    middle = np.isclose(c.surface_points[:, 1], -0.5)
    assert np.all(np.abs(c.surface_shapes[side] - 1.0) < 1e-9)
    assert np.all(np.abs(c.surface_shapes[middle] - 0.67837) < 1e-5)


# --- the circle: exact identities ----------------------------------------------------------------


@pytest.mark.parametrize('fill_ratio', FILLS)
def test_every_sway_mode_hangs_on_the_axis(fill_ratio: float) -> None:
    """The pressure passes through the axis: lambda_4 = -lambda_2 (z_axis - g/omega^2)."""
    depth = cylinder_x(1.0, 1.0).depth(fill_ratio)
    c = sway_modes(depth, 12)
    pivot = (1.0 - depth) - 1.0 / kappa(c)
    assert c.coupling[:, ROLL] == pytest.approx(-c.coupling[:, SWAY] * pivot, rel=1e-5)


@pytest.mark.parametrize('fill_ratio', FILLS)
def test_a_circle_turns_its_liquid_by_waves_only(fill_ratio: float) -> None:
    """No pressure turns the liquid about the axis: J44 there is sum lambda_4^2/mu there."""
    depth = cylinder_x(1.0, 1.0).depth(fill_ratio)
    c = sway_modes(depth, 20)
    axis = 1.0 - depth  # above O
    centroid = c.liquid.centroid[2]
    steiner = c.mass * ((axis - centroid) ** 2 - centroid**2)
    inertia = c.inertia_stokes_joukowski[0, 0] + steiner
    turned = np.cumsum((c.coupling[:, ROLL] + axis * c.coupling[:, SWAY]) ** 2 / c.mu)
    assert np.all(turned < inertia * (1.0 + 1e-9))
    assert turned[-1] == pytest.approx(inertia, rel=3e-6)


@pytest.mark.parametrize('fill_ratio', FILLS)
def test_sway_modes_carry_the_whole_hydrostatic_moment(fill_ratio: float) -> None:
    """Sum of g lambda_2^2/(mu omega^2) over the modes -> rho I_yy (Parseval)."""
    c = sway_modes(cylinder_x(1.0, 1.0).depth(fill_ratio), 20)
    counts = [n for n in (1, 3, 9, 20) if n <= len(c.names)]
    rest = [lowest(c, n).static_residual[1, 1] / c.liquid.surface_inertia[1, 1] for n in counts]
    assert np.all(np.array(rest) > 0.0)
    assert np.all(np.diff(rest) < 0.0)
    assert rest[-1] < 1.2e-4  # twenty of them; of 0.99, where it falls most slowly, 1.07e-4


def test_surge_modes_carry_the_whole_hydrostatic_moment() -> None:
    """Sum of g lambda_1^2/(mu omega^2) over the modes -> rho I_xx (Parseval)."""
    c = section_coefficients(cylinder_x(1.0, 20.0), 1.0, 1.0, 320)
    rest = [
        lowest(c, n).static_residual[0, 0] / c.liquid.surface_inertia[0, 0]
        for n in (5, 20, 80, 320)
    ]
    assert np.all(np.diff(rest) < 0.0)
    assert 0.0 < rest[-1] < 3e-7


@pytest.mark.parametrize('fill_ratio', FILLS)
def test_modal_masses_stay_below_the_mass(fill_ratio: float) -> None:
    tank = cylinder_x(1.0, 3.0)
    c = section_coefficients(tank, tank.depth(fill_ratio), 1.0, 60)
    assert np.all(np.sum(relative_couplings(c) ** 2, axis=0) < 1.0)


@pytest.mark.parametrize('fill_ratio', FILLS)
def test_a_lid_only_takes_inertia_away(fill_ratio: float) -> None:
    tank = cylinder_x(1.0, 3.0)
    c = section_coefficients(tank, tank.depth(fill_ratio), 850.0, 1)
    assert np.linalg.eigvalsh(c.inertia_frozen - c.inertia_stokes_joukowski).min() > 0.0
    assert np.linalg.eigvalsh(c.inertia_stokes_joukowski).min() > 0.0


# --- limits --------------------------------------------------------------------------------------


def test_a_film_sways_like_a_point_on_the_wall() -> None:
    assert kappa(sway_modes(0.01, 1)) == pytest.approx([1.00201], abs=1e-5)
    assert kappa(sway_modes(0.001, 1)) == pytest.approx([1.0], abs=3e-4)


def test_a_nearly_full_circle_sways_like_an_opening_in_a_roof() -> None:
    """Kappa times half the width -> 2.006, linearly in the width."""
    depths = (1.97, 1.99, 1.997)
    widths = np.array([UNIT.moments(depth).half_width for depth in depths])
    scaled = np.array([kappa(sway_modes(depth, 1))[0] for depth in depths]) * widths
    assert scaled[:2] == pytest.approx([1.9416, 1.9702], abs=5e-5)
    assert np.polyval(np.polyfit(widths, scaled, 2), 0.0) == pytest.approx(2.006, abs=1e-3)


@pytest.mark.parametrize('depth', [0.3, 1.0, 1.8])
def test_stokes_joukowski_inertia_of_a_slice_and_of_a_pipe(depth: float) -> None:
    """A slice moves along x as if frozen; a pipe turns as if all its mass were on its axis."""
    thin = section_coefficients(cylinder_x(1.0, 1e-3), depth, 1.0, 1)
    section = UNIT.moments(depth)
    assert np.diag(thin.inertia_stokes_joukowski)[1:] / 1e-3 == pytest.approx(
        [section.zz, section.yy], rel=2e-3
    )
    long = section_coefficients(cylinder_x(1.0, 1e3), depth, 1.0, 1)
    assert np.diag(long.inertia_stokes_joukowski)[1:] == pytest.approx(
        [section.area * 1e9 / 12.0] * 2, rel=2e-5
    )


def test_dimensions() -> None:
    """Twice the size: omega/sqrt(2), masses times 8, lambda_4..6 times 16, inertia times 32."""
    small = section_coefficients(cylinder_x(1.2, 5.75), 1.8, 850.0, 8)
    large = section_coefficients(cylinder_x(2.4, 11.5), 3.6, 850.0, 8)
    assert large.names == small.names
    assert large.omega == pytest.approx(small.omega / np.sqrt(2.0))
    assert large.mu == pytest.approx(small.mu * 8.0)
    assert large.coupling == pytest.approx(small.coupling * np.repeat([8.0, 16.0], 3))
    assert large.inertia_stokes_joukowski == pytest.approx(small.inertia_stokes_joukowski * 32.0)


# --- the rectangle -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ('length', 'width', 'depth'),
    [(8.0, 2.0, 0.8), (8.1, 2.0, 0.05), (2.0, 2.3, 3.0), (1.0, 3.0, 2.9), (5.0, 10.0, 0.1)],
)
def test_a_rectangle_agrees_with_its_closed_form(
    length: float, width: float, depth: float
) -> None:
    tank = rectangular(length, width, 4.0)
    exact = rectangular_coefficients(tank, depth, 850.0, 6)
    found = section_coefficients(tank, depth, 850.0, 6)
    # the same modes, none of those that do not couple; two may have one frequency
    assert sorted(found.names) == sorted(exact.names)
    order = [found.names.index(name) for name in exact.names]
    scale = np.abs(exact.coupling).max(axis=0)
    assert found.omega[order] == pytest.approx(exact.omega, rel=1e-7)
    assert found.mu[order] == pytest.approx(exact.mu, rel=1e-6)
    assert found.coupling[order] == pytest.approx(exact.coupling, rel=1e-6, abs=1e-9 * scale.max())
    assert found.inertia_stokes_joukowski == pytest.approx(
        exact.inertia_stokes_joukowski, rel=1e-6
    )
    assert found.wall_friction is not None
    assert found.wall_friction[order] == pytest.approx(exact.wall_friction, rel=1e-6)
    assert found.surface_points == pytest.approx(exact.surface_points)
    assert found.surface_shapes[:, order] == pytest.approx(exact.surface_shapes, abs=1e-6)


def test_modes_that_do_not_couple_are_dropped() -> None:
    """Whole waves across a rectangle leave no force and no moment."""
    names = section_coefficients(rectangular(3.0, 2.0, 2.0), 1.0, 850.0, 20).names
    assert all('y' not in name or int(name.split('y')[1]) % 2 for name in names)
    assert 'x1y2' in section_coefficients(cylinder_x(1.0, 3.0), 1.0, 850.0, 20).names


# --- shapes and signs ----------------------------------------------------------------------------


@pytest.mark.parametrize('fill_ratio', FILLS)
def test_crests_stand_on_the_sides_of_negative_x_and_y(fill_ratio: float) -> None:
    tank = cylinder_x(1.0, 3.0)
    c = section_coefficients(tank, tank.depth(fill_ratio), 850.0, 16)
    corner = np.lexsort(c.surface_points.T[::-1])[0]
    assert np.all(c.surface_shapes[corner] > 0.0)
    assert np.abs(c.surface_shapes).max(axis=0) == pytest.approx(np.ones(16), abs=0.05)
    assert np.abs(c.surface_shapes).max() < 1.0 + 1e-6
    surge = [j for j, name in enumerate(c.names) if 'y' not in name]
    sway = [j for j, name in enumerate(c.names) if 'x' not in name]
    assert surge
    assert sway
    assert np.all(c.coupling[surge, SURGE] < 0.0)
    assert np.all(c.coupling[sway, SWAY] < 0.0)


def test_largest_value_between_samples_is_found() -> None:
    x = np.linspace(0.0, 1.0, 1001)
    waves = np.stack([np.cos(40.0 * x + 0.3), 3.0 - 0.0 * x, -2.0 * np.exp(-x), x], axis=1)
    assert peaks(waves) == pytest.approx([1.0, 3.0, 2.0, 1.0], rel=1e-7)


def test_modal_mass_is_the_integral_of_the_surface_shape() -> None:
    """Eqs (10)-(12): mu = (rho g/omega^2) int f^2 dS, lambda_1,2 = rho int f (x, y) dS."""
    c = section_coefficients(cylinder_x(1.0, 3.0), 0.9, 850.0, 5)
    n = round(np.sqrt(len(c.surface_points)))
    simpson = np.array([1.0, *[4.0, 2.0] * (n // 2)]) / 3.0
    simpson[-1] = 1.0 / 3.0
    sides = 2.0 * c.surface_points[-1]
    weight = np.outer(simpson, simpson).ravel() * np.prod(sides) / (n - 1) ** 2
    f = c.surface_shapes
    assert 850.0 / kappa(c) * (weight @ f**2) == pytest.approx(c.mu, rel=1e-3)
    moments = 850.0 * (weight * f.T) @ c.surface_points
    assert moments == pytest.approx(c.coupling[:, :2], rel=5e-3, abs=1e-6)
    assert weight @ f == pytest.approx(np.zeros(5), abs=1e-6)


# --- convergence ---------------------------------------------------------------------------------


@pytest.mark.parametrize('fill_ratio', [0.75, 0.9, 0.99])
def test_refinement_gains_what_the_singularity_allows(fill_ratio: float) -> None:
    """
    Psi ~ r^(pi/angle) at the contact line: energies converge as spans^-(4 pi/angle).

    The knots at (i/spans)^2 double the exponent; an energy has twice the order of its function.
    """
    depth = cylinder_x(1.0, 1.0).depth(fill_ratio)
    angle = np.pi - np.arcsin(UNIT.moments(depth).half_width)
    spans = np.array([4, 8, 16])
    exact = plane_eigenvalues('odd', depth, Resolution(48, 6, 16))[0]
    errors = [
        plane_eigenvalues('odd', depth, Resolution(int(n), 6, 16))[0] / exact - 1.0 for n in spans
    ]
    assert np.all(np.array(errors) > 0.0)  # Rayleigh quotients
    rates = -np.diff(np.log2(errors))
    assert rates == pytest.approx(np.full(2, 4.0 * np.pi / angle), rel=0.1)


@pytest.mark.parametrize('fill_ratio', [0.1, 0.5, 0.9])
def test_degree_of_the_fan_gains_exponentially(fill_ratio: float) -> None:
    depth = cylinder_x(1.0, 1.0).depth(fill_ratio)
    exact = plane_eigenvalues('odd', depth, Resolution(24, 7, 18))[2]
    errors = [
        plane_eigenvalues('odd', depth, Resolution(24, 7, degree))[2] / exact - 1.0
        for degree in (4, 6, 8, 10)
    ]
    assert np.all(np.divide(errors[:-1], errors[1:]) > 5.0)


@pytest.mark.parametrize('fill_ratio', [0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99])
def test_twelve_modes_keep_five_digits_on_a_finer_mesh(fill_ratio: float) -> None:
    tank = cylinder_x(1.0, 4.0)
    depth = tank.depth(fill_ratio)
    coarse = section_coefficients(tank, depth, 850.0, 12)
    fine = section_coefficients(
        tank, depth, 850.0, 12, Resolution(2 * DEFAULT.spans, DEFAULT.degree, 18)
    )
    assert coarse.names == fine.names
    assert coarse.omega == pytest.approx(fine.omega, rel=1e-7)
    assert coarse.mu == pytest.approx(fine.mu, rel=5e-6)
    # the wall takes the velocity at the contact line, where it is singular in a nearly full tank
    assert coarse.wall_friction == pytest.approx(fine.wall_friction, rel=2e-3)
    assert relative_couplings(coarse) == pytest.approx(
        relative_couplings(fine), rel=5e-6, abs=1e-7
    )
    assert coarse.inertia_stokes_joukowski == pytest.approx(
        fine.inertia_stokes_joukowski, rel=1e-6
    )


def test_many_waves_across_have_a_mesh_as_fine_as_they_need() -> None:
    """In so short a tank the lowest twelve modes are waves across; the default knows them."""
    tank = cylinder_x(1.0, 0.2)
    coarse = section_coefficients(tank, 1.0, 850.0, 12)
    assert 'y11' in coarse.names
    fine = section_coefficients(tank, 1.0, 850.0, 12, Resolution(36, 7, 20))
    assert coarse.names == fine.names
    assert coarse.omega == pytest.approx(fine.omega, rel=1e-7)
    assert coarse.mu == pytest.approx(fine.mu, rel=5e-6)
    assert coarse.inertia_stokes_joukowski == pytest.approx(
        fine.inertia_stokes_joukowski, rel=1e-6
    )


# --- geometry ------------------------------------------------------------------------------------


@pytest.mark.parametrize('fill_ratio', [0.001, *FILLS, 0.999])
def test_fan_covers_the_liquid_once(fill_ratio: float) -> None:
    """Its Jacobian is positive (or InputError), and its moments are those of the segment."""
    depth = cylinder_x(1.0, 1.0).depth(fill_ratio)
    half = half_section(UNIT, depth)
    exact = UNIT.moments(depth)
    one = np.ones(len(half.mass))  # the functions are a partition of unity
    assert 2.0 * one @ half.mass @ one == pytest.approx(exact.area, rel=1e-9)
    assert 2.0 * half.z @ one == pytest.approx(exact.z, rel=1e-9)
    assert one @ half.stiffness @ one == pytest.approx(0.0, abs=1e-6)
    wetted = np.arctan2(exact.half_width, 1.0 - depth)  # arc length of half the wall
    assert one @ half.wall_mass @ one == pytest.approx(wetted, rel=1e-9)
    assert half.surface_one.sum() == pytest.approx(exact.half_width, rel=1e-12)


class _Hourglass(Circle):
    """A circle with a waist, too narrow to be seen through."""

    def wall(self, depth: float, s: Array) -> Array:
        points = super().wall(depth, s)
        return points * np.stack([1.0 - 0.9 * np.sin(np.pi * s) ** 2, np.ones_like(s)])


def test_a_section_far_from_convex_is_refused() -> None:
    tank = UniformTank('hourglass', _Hourglass(1.0), 3.0)
    with pytest.raises(InputError, match='convex'):
        section_coefficients(tank, 1.0, 850.0, 3)
