"""Fits of added mass: synthetic data with noise, finite elements, spikes; the paper's recipe."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.hydro import ModalCoefficients, coefficients_of
from slosh_ros.hydro.added_mass import AddedMass
from slosh_ros.hydro.added_mass_checks import check_damping
from slosh_ros.hydro.fit import (
    COVERAGE,
    SURGE,
    SWAY,
    YAW,
    Family,
    FittedFamily,
    added_mass_coefficients,
    fit_family,
    fit_liquid,
    fitted_coefficients,
    pole_problem,
)
from slosh_ros.hydro.frequency import rectangular_wall_ratio, total_added_mass
from slosh_ros.hydro.pole_search import solve
from slosh_ros.hydro.recipe import recipe_from_added_mass, recipe_mode
from slosh_ros.hydro.rectangular import rectangular_coefficients
from slosh_ros.tank import cylinder_x, rectangular
from slosh_ros.tank.upright import cylinder_z

pytestmark = pytest.mark.dear

Array = NDArray[np.float64]

LENGTH, WIDTH, DEPTH, DENSITY = 8.0, 2.0, 0.8, 850.0
TABLE_1 = rectangular(LENGTH, WIDTH, 1.6)
MANY = rectangular_coefficients(TABLE_1, DEPTH, DENSITY, 250)
GRID = np.arange(0.1, 5.01, 0.1)
PAPER_GRID = np.append(0.05 + 0.1 * np.arange(50), 50.0)
AT_REST = total_added_mass(MANY, [0.0])[0].real
IN_BAND = {'surge': ('x1', 'x3', 'x5'), 'sway': ('y1',)}


def data(
    omega: Array = GRID, noise: float = 0.0, seed: int = 0, epsilon: float = 0.0
) -> AddedMass:
    wall_ratio = rectangular_wall_ratio(TABLE_1, DEPTH, MANY.names)
    matrix = total_added_mass(MANY, omega, epsilon, wall_ratio)
    scatter = np.random.default_rng(seed).standard_normal(matrix.shape)
    return AddedMass(omega, matrix * (1.0 + noise * scatter), DENSITY, np.zeros(3))


def truth(family: Family) -> tuple[Array, Array, Array]:
    j = [MANY.names.index(name) for name in IN_BAND[family.name]]
    mass = MANY.coupling[j, family.push] ** 2 / MANY.mu[j]
    lever = MANY.coupling[j, family.turn] / MANY.coupling[j, family.push]
    return MANY.omega[j], mass, lever


def check(fitted: FittedFamily, omega_within: float, within: float, cross_within: float) -> None:
    omega, mass, lever = truth(fitted.family)
    assert fitted.omega == pytest.approx(omega, rel=omega_within)
    assert fitted.modal_mass == pytest.approx(mass, rel=within)
    assert fitted.modal_mass * fitted.lever == pytest.approx(mass * lever, rel=cross_within)


@pytest.mark.parametrize('family', [SURGE, SWAY], ids=['surge', 'sway'])
@pytest.mark.parametrize('seed', [0, 1, 7])
def test_noise_of_one_percent_on_a_coarse_grid(family: Family, seed: int) -> None:
    """Poles and residues of A_11, A_15 within 2 %, and as many modes as the band holds."""
    known = (AT_REST[family.push, family.push], AT_REST[family.push, family.turn])
    fitted = fit_family(data(noise=0.01, seed=seed), family, known)
    check(fitted, 3e-4, 0.02, 0.02)
    assert 0.005 < fitted.noise < 0.015
    # the errors it tells are of the size of those it makes
    off = np.abs(fitted.modal_mass - truth(family)[1]) / fitted.modal_mass_error
    assert np.all(off < COVERAGE)
    assert np.all(fitted.modal_mass_error < 0.01 * fitted.modal_mass)


@pytest.mark.parametrize('family', [SURGE, SWAY], ids=['surge', 'sway'])
def test_residues_without_knowledge_of_the_liquid(family: Family) -> None:
    """The residues of A_15 at the poles, lambda_1 (g lambda_1/omega^2 + lambda_5)/mu, THEORY 5."""
    fitted = fit_family(data(noise=0.01), family, max_modes=6)
    omega, mass, lever = truth(family)
    assert fitted.modal_mass == pytest.approx(mass, rel=0.02)
    residue, exact = (
        r * (family.sign * GRAVITY / w**2 + arm)
        for r, w, arm in (
            (fitted.modal_mass, fitted.omega, fitted.lever),
            (mass, omega, lever),
        )
    )
    # the first two of sway nearly cancel: theirs in terms of what cancels
    cancels = np.max(np.abs(mass * lever))
    assert np.all(np.abs(residue - exact) < 0.02 * np.maximum(np.abs(exact), cancels))


def made_up(
    omega: Array, poles: Array, loss: float, noise: str, rows: tuple[int, ...] = (0, 4)
) -> AddedMass:
    """Eqs (32) and (34) and the entry 55 of modes (omega, R, l), with 1 % of noise."""
    x, (own, mass, lever) = omega[:, np.newaxis] ** 2, poles.T
    gain = x / (own**2 - x * (1.0 + 1j * loss))
    arm = GRAVITY / x + lever
    turn = arm**2 * gain - GRAVITY**2 / (own**2 * x)
    push, cross, turn = (
        k + (mass * of).sum(axis=1) for k, of in ((9.0, gain), (-3.0, arm * gain), (5.0, turn))
    )
    matrix = np.full((len(omega), 6, 6), np.nan, dtype=complex)
    matrix[:, 0, 0] = push
    if 4 in rows:
        matrix[:, 0, 4] = matrix[:, 4, 0] = cross
        matrix[:, 4, 4] = turn
    scatter = np.random.default_rng(31).standard_normal((2, *matrix.shape))
    size = np.abs(matrix)
    if noise == 'same everywhere':
        size = np.broadcast_to(np.median(size, axis=0), matrix.shape)
    scatter[1] *= noise == 'complex'
    return AddedMass(
        omega, matrix + 0.01 * size * (scatter[0] + 1j * scatter[1]), 1.0, np.zeros(3)
    )


FOUR = np.array([[0.87, 2.0, -9.0], [1.21, 3.0, 0.4], [2.96, 0.25, -0.9], [4.44, 0.9, 0.2]])
FEW = np.array([[1.63, 0.4, 0.8], [3.38, 2.5, -1.1]])


@pytest.mark.parametrize(
    ('poles', 'loss', 'noise'),
    [
        (FOUR, 0.0, 'in proportion'),
        (FOUR, 0.0, 'same everywhere'),
        (FEW, 0.0, 'complex'),
        (FEW, 0.05, 'complex'),
        (FEW, 0.1, 'same everywhere'),
    ],
)  # fmt: skip
def test_made_up_poles_are_found_whatever_the_noise(poles: Array, loss: float, noise: str) -> None:
    """Strong and weak modes, levers of both signs, and no mode but those."""
    fitted = fit_family(made_up(np.arange(0.1, 6.01, 0.1), poles, loss, noise), SURGE)
    assert fitted.omega == pytest.approx(poles[:, 0], rel=5e-3)
    assert fitted.modal_mass == pytest.approx(poles[:, 1], rel=0.02)
    own, mass, lever = poles.T
    residue = fitted.modal_mass * (GRAVITY / fitted.omega**2 + fitted.lever)
    off = np.abs(residue - mass * (GRAVITY / own**2 + lever))
    assert np.all(off < 0.02 * mass * (GRAVITY / own**2 + np.abs(lever)))  # the two may cancel
    if loss:
        assert fitted.loss == pytest.approx(loss, rel=0.1)
    off = np.abs(fitted.modal_mass - poles[:, 1]) / fitted.modal_mass_error
    assert np.all(off < 4.0)
    assert np.all(fitted.modal_mass_error < 0.01 * fitted.modal_mass)


def test_a_strong_spike_is_no_mode() -> None:
    """Single points off by their own size bring no pole into the search, and hide none."""
    found = made_up(np.arange(0.1, 6.01, 0.1), FEW, 0.0, 'in proportion', rows=(0,))
    matrix = found.matrix.copy()
    matrix[[8, 24, 50]] *= np.array([2.0, -1.0, 3.0])[:, np.newaxis, np.newaxis]
    modes = solve(pole_problem(replace(found, matrix=matrix), SURGE), 12).modes
    modes = modes.take(np.argsort(modes.omega))
    assert modes.omega == pytest.approx(FEW[:, 0], rel=5e-3)
    assert modes.mass == pytest.approx(FEW[:, 1], rel=0.02)


def test_push_alone_gives_poles_and_masses_but_no_lever() -> None:
    """A_11 alone, with the rows of frequency 0 and infinity that WAMIT has."""
    omega = np.concatenate([[1e-3], np.arange(0.3, 6.01, 0.1), [1e3]])
    found = made_up(omega, FOUR, 0.0, 'in proportion', rows=(0,))
    found = replace(found, omega=np.concatenate([[0.0], omega[1:-1], [np.inf]]))
    fitted = fit_family(found, SURGE)
    assert fitted.omega == pytest.approx(FOUR[:, 0], rel=5e-3)
    assert fitted.modal_mass == pytest.approx(FOUR[:, 1], rel=0.02)
    assert np.all(np.isnan(fitted.lever))


def test_one_triangle_is_enough_but_two_must_agree() -> None:
    found = made_up(np.arange(0.1, 6.01, 0.1), FEW, 0.0, 'in proportion')
    below = found.matrix.copy()
    below[:, 4, 0] = np.nan
    fitted = fit_family(replace(found, matrix=below), SURGE, max_modes=4)
    assert fitted.modal_mass * fitted.lever == pytest.approx(FEW[:, 1] * FEW[:, 2], abs=0.15)
    below[:, 4, 0] = 0.0
    with pytest.raises(InputError, match='write both triangles'):
        fit_family(replace(found, matrix=below), SURGE)


def test_noise_is_not_taken_for_a_liquid_that_makes_energy() -> None:
    """Complex noise gives undamped data as much damping of the one sign as of the other."""
    exact = data(GRID[:30])
    random = np.random.default_rng(5)
    noise = 0.01 * np.abs(exact.matrix) * random.standard_normal(exact.matrix.shape)
    check_damping(replace(exact, matrix=exact.matrix + 1j * noise))
    with pytest.raises(InputError, match='would make energy'):
        check_damping(replace(exact, matrix=exact.matrix - 1j * np.abs(noise)))


@pytest.fixture(scope='module')
def families() -> tuple[FittedFamily, ...]:
    """Surge, sway and yaw of exact data."""
    return fit_liquid(data(), MANY.liquid)


def test_exact_data_give_exact_modes(families: tuple[FittedFamily, ...]) -> None:
    for fitted in families[:2]:
        check(fitted, 1e-5, 1e-4, 1e-4)


@pytest.fixture(scope='module')
def damped_surge() -> FittedFamily:
    return fit_family(data(PAPER_GRID, epsilon=0.005), SURGE, max_modes=8)


def test_table_1_on_the_papers_grid_gives_the_values_off_it(damped_surge: FittedFamily) -> None:
    """Where the paper reads 1.05, 2.95, 4.25 and 3.65 rad/s: the peaks of |A| are there."""
    found = data(PAPER_GRID, epsilon=0.005)
    for fitted, exact, read in (
        (damped_surge, [1.082569, 2.917224, 4.203104], [1.05, 2.95, 4.25]),
        (fit_family(found, SWAY, max_modes=6), [3.619414], [3.65]),
    ):
        assert fitted.omega == pytest.approx(exact, rel=2e-5)
        push = np.abs(found.matrix[:50, fitted.family.push, fitted.family.push])
        peaks = 1 + np.flatnonzero((push[1:-1] > push[:-2]) & (push[1:-1] > push[2:]))
        assert PAPER_GRID[peaks] == pytest.approx(read)


def test_wall_damping_is_found_with_the_modes(damped_surge: FittedFamily) -> None:
    """Eq (36) acts as the loss factor epsilon S_m."""
    wall_ratio = rectangular_wall_ratio(TABLE_1, DEPTH, IN_BAND['surge'])
    assert damped_surge.loss == pytest.approx(0.005 * wall_ratio, rel=1e-2)


@pytest.mark.parametrize('family', [SURGE, SWAY], ids=['surge', 'sway'])
def test_spikes_do_no_harm(family: Family) -> None:
    """Points at the poles have the wrong sign, as of an ill-conditioned matrix; others are off."""
    clean = data(noise=0.002)
    at_poles = [int(np.argmin(np.abs(GRID - omega))) for omega in truth(family)[0]]
    for points, factor in ((at_poles, -1.0), ([14, 36], 3.0))[: 2 if family is SURGE else 1]:
        spiked = clean.matrix.copy()
        spiked[points] *= factor
        check(fit_family(replace(clean, matrix=spiked), family, max_modes=6), 5e-3, 0.02, 0.1)


@pytest.mark.parametrize('seed', range(2))
def test_modal_masses_are_positive_whatever_the_data(seed: int) -> None:
    random = np.random.default_rng(seed)
    matrix = random.standard_normal((20, 6, 6)) * 1e3
    matrix = matrix + matrix.transpose(0, 2, 1) + 0j
    found = AddedMass(np.linspace(0.2, 4.0, 20), matrix, 1.0, np.zeros(3))
    fitted = fit_family(found, SURGE, max_modes=4)
    assert np.all(fitted.modal_mass > 0.0)


def test_modes_above_the_band_are_left_out_but_not_forgotten(
    families: tuple[FittedFamily, ...],
) -> None:
    """Their hydrostatic moment is what Parseval's sum leaves."""
    fitted = families[0]
    exact = DENSITY * WIDTH * LENGTH**3 / 12.0 - np.sum(
        GRAVITY * truth(SURGE)[1] / truth(SURGE)[0] ** 2
    )
    lever = MANY.mass * -DEPTH / 2.0
    assert fitted.constants[1] - lever == pytest.approx(exact, rel=0.01)
    assert fitted.at_rest == pytest.approx((MANY.mass, AT_REST[0, 4]), rel=1e-4)


def test_yaw_has_its_own_poles(families: tuple[FittedFamily, ...]) -> None:
    fitted = families[2]
    assert fitted.family is YAW
    j = MANY.names.index('x1y1')
    assert fitted.omega[0] == pytest.approx(MANY.omega[j], rel=1e-4)
    assert fitted.modal_mass[0] == pytest.approx(MANY.coupling[j, 5] ** 2 / MANY.mu[j], rel=1e-2)
    assert fitted.constants[0] == pytest.approx(MANY.inertia_stokes_joukowski[2, 2], rel=1e-4)


@pytest.fixture(scope='module')
def coefficients(families: tuple[FittedFamily, ...]) -> ModalCoefficients:
    return fitted_coefficients(data(), MANY.liquid, families, 12, (LENGTH, WIDTH))


def test_coefficients_give_back_the_added_mass(coefficients: ModalCoefficients) -> None:
    """At frequencies between those of the fit; modes above 5 rad/s act at rest only."""
    omega = np.array([0.35, 0.95, 1.35, 2.05])
    found, exact = (total_added_mass(c, omega) for c in (coefficients, MANY))
    for i, j in ((0, 0), (1, 1), (0, 4), (1, 3), (4, 4), (5, 5)):
        scale = np.median(np.abs(exact[:, i, j]))
        assert found[:, i, j] == pytest.approx(exact[:, i, j], rel=0.02, abs=0.02 * scale), (i, j)


def test_coefficients_are_those_of_the_closed_form(coefficients: ModalCoefficients) -> None:
    """Up to the scale of the modes: lambda lambda^T/mu is free of it."""
    assert set(coefficients.names) >= {'surge1', 'surge2', 'surge3', 'sway1', 'yaw1'}
    for name, own in (('surge1', 'x1'), ('surge2', 'x3'), ('sway1', 'y1'), ('yaw1', 'x1y1')):
        j, k = coefficients.names.index(name), MANY.names.index(own)
        found, exact = (
            np.outer(c.coupling[n], c.coupling[n]) / c.mu[n]
            for c, n in ((coefficients, j), (MANY, k))
        )
        assert found == pytest.approx(exact, rel=2e-3, abs=1e-6 * np.abs(exact).max())
    inertia = np.diag(coefficients.inertia_stokes_joukowski)
    assert inertia == pytest.approx(np.diag(MANY.inertia_stokes_joukowski), rel=0.01)
    assert np.all(np.diff(coefficients.omega) > 0.0)
    assert np.all(np.diag(coefficients.static_residual) > 0.0)


def test_elevation_of_a_plane_with_the_same_moment(coefficients: ModalCoefficients) -> None:
    """For a slosh mass displaced by s, the plane of equal first moment: 12/pi^2 of the cosine."""
    j = coefficients.names.index('surge1')
    top = np.abs(coefficients.surface_shapes[:, j]).max()
    per_mass = top / abs(coefficients.coupling[j, 0])
    k = MANY.names.index('x1')
    assert per_mass == pytest.approx(12.0 / np.pi**2 / abs(MANY.coupling[k, 0]), rel=1e-3)


def test_moments_about_another_point_give_the_same_modes() -> None:
    """A15^P = A15 - z0 A11, A24^P = A24 + z0 A22 (THEORY 2.4)."""
    about_o = data()
    height = 1.7
    shift = np.eye(6)
    shift[3:, :3] = -height * np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    moved = AddedMass(
        GRID,
        shift @ about_o.matrix @ shift.T,
        DENSITY,
        np.array([0.0, 0.0, height]),
    )
    assert moved.matrix[:, 0, 4] == pytest.approx(
        about_o.matrix[:, 0, 4] - height * about_o.matrix[:, 0, 0]
    )
    assert moved.matrix[:, 1, 3] == pytest.approx(
        about_o.matrix[:, 1, 3] + height * about_o.matrix[:, 1, 1]
    )
    assert moved.about_surface_centre().matrix == pytest.approx(about_o.matrix, abs=1e-6)


def test_hydrostatic_part_in_the_stiffness_is_brought_back() -> None:
    without = AddedMass(
        GRID,
        total_added_mass(MANY, GRID, hydrostatic=False),
        DENSITY,
        np.zeros(3),
        hydrostatic=False,
    )
    found = without.about_surface_centre(MANY.liquid.surface_inertia)
    assert found.matrix == pytest.approx(data().matrix, rel=1e-9, abs=1e-6)
    with pytest.raises(InputError, match='second moments of the mean free surface'):
        without.about_surface_centre()


def test_an_axisymmetric_tank_has_pairs_and_no_yaw() -> None:
    tank = cylinder_z(1.2, 2.0)
    exact = coefficients_of(tank, 0.9, DENSITY, 40)
    omega = np.arange(0.2, 7.5, 0.1)
    fitted = added_mass_coefficients(
        AddedMass(omega, total_added_mass(exact, omega), DENSITY, np.zeros(3)), exact.liquid, 4
    )
    assert not any('yaw' in name for name in fitted.names)
    assert fitted.surface_shapes.shape == (0, 4)  # no plan, no elevation
    assert fitted.omega == pytest.approx(exact.omega[:4], rel=1e-4)
    assert fitted.lever == pytest.approx(exact.lever[:4], rel=5e-3)
    mass = np.sum(fitted.coupling[:, :2] ** 2, axis=1) / fitted.mu
    assert mass == pytest.approx(
        np.sum(exact.coupling[:4, :2] ** 2, axis=1) / exact.mu[:4], rel=5e-3
    )


@pytest.mark.parametrize(
    ('spoil', 'message'),
    [
        (lambda d: replace(d, density=1000.0), '11 tends to 1.088e\\+04 kg at rest.*density'),
        (lambda d: replace(d, matrix=d.matrix * 1e-3), '11 tends to 10.88 kg'),
        (lambda d: replace(d, reference=np.array([0.0, 0.0, 1.0])), '15 tends to .*reference'),
        (lambda d: replace(d, reference=np.array([0.5, 0.0, 0.0])), 'entry .. is not zero'),
        (lambda d: replace(d, omega=d.omega[:6], matrix=d.matrix[:6]), '6 frequencies are too'),
        (
            lambda d: replace(d, matrix=np.where(np.arange(6) == 4, np.nan, d.matrix)),
            'entry 55 is missing',
        ),
    ],
    ids=['density', 'units', 'height', 'off centre', 'too few', 'no pitch'],
)
def test_what_does_not_fit_the_liquid_is_told(spoil, message: str) -> None:
    with pytest.raises(InputError, match=message):
        added_mass_coefficients(spoil(data(GRID[:20], noise=5e-4)), MANY.liquid, 8)


def test_frequencies_out_of_order_are_refused() -> None:
    with pytest.raises(InputError, match='out of order'):
        AddedMass(GRID[::-1], data().matrix, DENSITY, np.zeros(3))
    with pytest.raises(InputError, match='shape'):
        AddedMass(GRID[:3], data().matrix, DENSITY, np.zeros(3))


# --- the paper's recipe ----------------------------------------------------------------------

# Table 1, column "numerical": omega, lambda, mu, K_t, lambda_4 or lambda_5
PRINTED = {
    'surge': (1.05, -26638.0, 72982.0, -0.365, 20052.0),
    'sway': (3.65, -5764.0, 5231.0, -1.102, -3848.0),
}


@pytest.mark.parametrize(('family', 'span'), [(SURGE, LENGTH), (SWAY, WIDTH)])
def test_the_recipe_gives_the_numerical_column_of_table_1(family: Family, span: float) -> None:
    """Fed as the paper was: damped, on its grid, with 50 rad/s for infinity."""
    found = data(PAPER_GRID, epsilon=0.02)
    mode = recipe_from_added_mass(found, MANY.liquid, span, family)
    omega, push, mu, ratio, turn = PRINTED[family.name]
    assert mode.omega == pytest.approx(omega)
    assert mode.push == pytest.approx(push, rel=0.004)
    assert mode.mu == pytest.approx(mu, rel=0.005)
    assert mode.ratio == pytest.approx(ratio, rel=0.002)
    assert mode.turn == pytest.approx(turn, rel=0.04)


def test_the_recipes_error_is_that_of_lumping_and_of_the_grid() -> None:
    """All modes in one: 1.136 of the first; the frequency in lambda squared, in mu to the 4th."""
    mode = recipe_from_added_mass(data(PAPER_GRID), MANY.liquid, LENGTH)
    first = MANY.names.index('x1')
    mass = MANY.coupling[first, 0] ** 2 / MANY.mu[first]
    lumped = mode.push**2 / mode.mu / mass
    assert lumped == pytest.approx(1.136, abs=0.002)
    off_grid = (1.082569 / 1.05) ** 2
    assert mode.push / MANY.coupling[first, 0] == pytest.approx(lumped * off_grid, rel=1e-6)
    assert mode.mu / MANY.mu[first] == pytest.approx(lumped * off_grid**2, rel=1e-6)


def test_the_recipe_gives_table_2() -> None:
    """Horizontal cylinder R = 1.2 m, L = 5.75 m, half full: A_11 and A_15 as printed there."""
    mode = recipe_mode(1.65, -10660.0, 9806.0, 5.75)
    assert mode.push == pytest.approx(-16465.0, rel=2e-3)
    assert mode.mu == pytest.approx(25434.0, rel=3e-3)


def test_cosine_and_plane_give_the_same_force() -> None:
    """Section 4.4 takes their agreement for evidence; it holds by construction."""
    cosine, linear = (recipe_mode(3.65, -6329.0, 4356.0, 2.0, s) for s in ('cosine', 'linear'))
    assert cosine.push**2 / cosine.mu == pytest.approx(linear.push**2 / linear.mu, rel=1e-14)
    assert cosine.push * cosine.turn / cosine.mu == pytest.approx(
        linear.push * linear.turn / linear.mu, rel=1e-14
    )
    assert cosine.push != pytest.approx(linear.push, rel=0.1)


# --- entries that vanish ---------------------------------------------------------------------


def test_a_cylinder_rolls_about_its_axis_without_a_moment() -> None:
    """Half full, O lies on the axis: A_24 and A_44 are rounding, and must not steer the fit."""
    exact = coefficients_of(cylinder_x(1.2, 5.75), 1.2, DENSITY, 40)
    omega = np.arange(0.15, 5.5, 0.15)
    matrix = total_added_mass(exact, omega)
    assert np.abs(matrix[:, 1, 3]).max() < 1e-6 * np.abs(matrix[:, 1, 1]).max()
    known = (exact.mass, 0.0)  # m z_c + rho I_yy = 0: the metacentre is on the axis, too
    fitted = fit_family(AddedMass(omega, matrix, DENSITY, np.zeros(3)), SWAY, known)
    j = exact.names.index('y1')
    assert fitted.omega[0] == pytest.approx(exact.omega[j], rel=1e-5)
    mass = exact.coupling[j, 1] ** 2 / exact.mu[j]
    assert fitted.modal_mass[0] == pytest.approx(mass, rel=1e-3)
    # every mode hangs g/omega^2 below the axis
    assert fitted.lever[0] == pytest.approx(GRAVITY / exact.omega[j] ** 2, rel=1e-3)
    assert fitted.constants[2] == pytest.approx(exact.inertia_stokes_joukowski[0, 0], rel=5e-3)


def test_a_liquid_that_is_too_light_alike_everywhere_keeps_its_modes() -> None:
    """Panels cut 2 % off a tank: its true mass, which the data belie, must not tear modes."""
    light = replace(data(), matrix=0.98 * data().matrix)
    known = (AT_REST[1, 1], AT_REST[1, 3])
    fitted = fit_family(light, SWAY, known)
    omega, mass, _ = truth(SWAY)
    assert fitted.omega == pytest.approx(omega, rel=1e-4)
    assert fitted.modal_mass == pytest.approx(0.98 * mass, rel=2e-3)
