"""Added mass by boundary elements, and the paper's whole route from there to modes."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.hydro import coefficients_of
from slosh_ros.hydro.boundary_elements import BoundaryElements, Panels
from slosh_ros.hydro.fit import SURGE, SWAY, fit_family
from slosh_ros.hydro.frequency import rectangular_wall_ratio, total_added_mass
from slosh_ros.tank import UniformTank, cylinder_x, rectangular, rounded_rectangle_x
from slosh_ros.tank.surface import LiquidSurface

Array = NDArray[np.float64]

TANK, DEPTH, DENSITY = rectangular(8.0, 2.0, 1.6), 0.8, 850.0  # Table 1
ENTRIES = ((0, 0), (1, 1), (0, 4), (1, 3), (3, 3), (4, 4), (5, 5))


@pytest.fixture(scope='module')
def pair() -> tuple[BoundaryElements, BoundaryElements]:
    """300 and 1200 panels, of half the size."""
    pytest.importorskip('capytaine')
    coarse, fine = (
        BoundaryElements(Panels.of_tank(TANK, DEPTH, size), DENSITY) for size in (0.4, 0.2)
    )
    return coarse, fine


@pytest.mark.parametrize('depth', [0.8, 1.2, 2.0])
@pytest.mark.parametrize('tank', [rectangular(5.0, 2.0, 2.4), cylinder_x(1.2, 5.0)])
def test_panels_enclose_the_liquid(tank: UniformTank, depth: float) -> None:
    panels = Panels.of_tank(tank, depth, 0.1)
    closed = np.concatenate([panels.wall, panels.free])
    triangles = np.concatenate([closed[:, [0, 1, 2]], closed[:, [0, 2, 3]]])
    volume = np.linalg.det(triangles).sum() / 6.0
    assert volume == pytest.approx(tank.filled(depth).volume, rel=5e-3)
    a, b, c = triangles.transpose(1, 0, 2)
    assert np.abs(np.cross(b - a, c - a).sum(axis=0)).max() < 1e-9
    assert panels.free[..., 2] == pytest.approx(np.zeros(panels.free.shape[:2]))


def test_natural_frequencies_converge_with_the_size_of_panels(
    pair: tuple[BoundaryElements, BoundaryElements],
) -> None:
    """Steklov's eigenvalues; the error of constant panels falls as their size."""
    exact = coefficients_of(TANK, DEPTH, DENSITY, 2).omega  # 1.082569, 2.917224, THEORY 3
    coarse, fine = (panels.omega[[0, 2]] / exact - 1.0 for panels in pair)
    assert np.all(np.abs(fine) < [5e-3, 6e-3])
    assert np.all((coarse / fine > 1.7) & (coarse / fine < 3.5))
    assert 2.0 * fine[0] - coarse[0] == pytest.approx(0.0, abs=1e-3)  # extrapolated


def test_added_mass_is_that_of_the_exact_modes(
    pair: tuple[BoundaryElements, BoundaryElements],
) -> None:
    """THEORY 5 and every other entry, away from the poles, within what panels leave."""
    omega = [0.3, 0.8, 2.0]
    c = coefficients_of(TANK, DEPTH, DENSITY, 300)
    exact = total_added_mass(c, omega).real
    assert exact[:2, 0, 0] == pytest.approx([11600.09, 21227.9], rel=1e-4)
    coarse, fine = (panels.added_mass(omega).matrix.real for panels in pair)
    for i, k in ENTRIES:
        # near -435 kg A_11 goes through zero
        size = np.maximum(np.abs(exact[:, i, k]), 0.1 * np.abs(exact[0, i, k]))
        extrapolated = 2.0 * fine[:, i, k] - coarse[:, i, k]
        if (i, k) != (1, 3):  # there what the floor and what the sides do nearly cancels
            assert np.all(np.abs(extrapolated - exact[:, i, k]) < 0.06 * size), (i, k)
            assert np.abs(fine - exact)[:, i, k].max() < np.abs(coarse - exact)[:, i, k].max()
    assert fine == pytest.approx(np.swapaxes(fine, 1, 2), rel=1e-9, abs=1e-6 * np.abs(fine).max())


def test_liquid_follows_the_tank_where_nothing_sloshes(
    pair: tuple[BoundaryElements, BoundaryElements],
) -> None:
    """At rest A_11 is the mass, at infinity what of it the modes leave: 10880, -9698.97 kg."""
    coarse, fine = (
        panels.added_mass([1e-3, np.inf]).matrix[:, 0, 0].real - [10880.0, 10880.0 - 9698.97]
        for panels in pair
    )
    assert np.all(np.abs(fine) < 0.02 * 10880.0)
    assert abs(2.0 * fine[0] - coarse[0]) < 0.012 * 10880.0


def test_damping_of_eq_36_is_that_of_the_modes(
    pair: tuple[BoundaryElements, BoundaryElements],
) -> None:
    """At each panels' own resonance the peak is as high as that of the exact mode at its own."""
    c = coefficients_of(TANK, DEPTH, DENSITY, 100)
    ratio = rectangular_wall_ratio(TANK, DEPTH, c.names)
    exact = total_added_mass(c, c.omega[0], 0.02, ratio)[0, 0, 0].imag
    fine = pair[1]
    found = fine.added_mass(fine.omega[0], 0.02).matrix[0, 0, 0].imag
    assert found == pytest.approx(exact, rel=0.03)
    assert np.all(np.linalg.eigvalsh(fine.added_mass(2.0, 0.02).matrix[0].imag) > -1e-6)


def test_the_whole_route_of_the_paper(pair: tuple[BoundaryElements, BoundaryElements]) -> None:
    """Damped boundary elements on the paper's grid, poles and residues fitted: the exact modes."""
    grid = 0.05 + 0.1 * np.arange(36)
    coarse = pair[0]
    fitted = fit_family(coarse.added_mass(grid, 0.02), SURGE, max_modes=4)
    exact = coefficients_of(TANK, DEPTH, DENSITY, 2)
    assert fitted.omega == pytest.approx(coarse.omega[[0, 2]], rel=5e-3)  # its own poles
    assert fitted.omega == pytest.approx(exact.omega, rel=0.02)
    mass = exact.coupling[:, 0] ** 2 / exact.mu  # 8539.9, 765.6 kg
    assert fitted.modal_mass == pytest.approx(mass, rel=0.06)
    # A_15 tells the height of the pivot, from which the mass hangs: 7.6 m and 0.4 m above O
    pivot, found = (
        lever + GRAVITY / omega**2
        for lever, omega in (
            (exact.coupling[:, 4] / exact.coupling[:, 0], exact.omega),
            (fitted.lever, fitted.omega),
        )
    )
    assert np.all(np.abs(found - pivot) < [0.2, 0.1])


def test_undamped_panels_give_their_own_poles_to_the_fit(
    pair: tuple[BoundaryElements, BoundaryElements],
) -> None:
    """Without damping the added mass of panels is a sum over their own modes: nothing is lost."""
    elements = pair[0]
    for family, grid, own, exact in (
        (SURGE, 0.1 * np.arange(1, 36), [0, 2], [8539.88, 765.59]),
        (SWAY, 0.1 * np.arange(1, 40), [4], [5966.19]),
    ):
        found = fit_family(elements.added_mass(grid), family)
        assert found.omega == pytest.approx(elements.omega[own], rel=1e-6)
        assert found.noise < 1e-4
        assert found.modal_mass == pytest.approx(exact, rel=0.07)


def test_a_pipe_and_a_surface_of_triangles() -> None:
    pytest.importorskip('capytaine')
    pipe = cylinder_x(1.2, 5.75)
    exact = coefficients_of(pipe, 1.2, 1000.0, 1).omega[0]
    panels = Panels.of_tank(pipe, 1.2, 0.3)
    assert BoundaryElements(panels, 1000.0).omega[0] == pytest.approx(exact, rel=0.01)
    halves = ([0, 1, 2], [0, 2, 3])
    wall, free = (
        np.concatenate([part[:, half] for half in halves]) for part in (panels.wall, panels.free)
    )
    triangles = Panels.of_surface(LiquidSurface(wall, free))
    assert BoundaryElements(triangles, 1000.0).omega[0] == pytest.approx(exact, rel=0.01)


def test_what_cannot_be_done_is_said(
    pair: tuple[BoundaryElements, BoundaryElements], monkeypatch: pytest.MonkeyPatch
) -> None:
    for omega, damping in (([0.0, 1.0], 0.0), ([1.0, np.inf], 0.02)):
        with pytest.raises(InputError, match='above 0'):
            pair[0].added_mass(omega, damping)
    with pytest.raises(TypeError, match='boxes and horizontal cylinders'):
        Panels.of_tank(rounded_rectangle_x(2.0, 2.0, 0.3, 4.0), 1.0, 0.2)
    panels = Panels.of_tank(TANK, DEPTH, 0.8)
    with pytest.raises(InputError, match='do not close'):
        BoundaryElements(Panels(panels.wall[:-1], panels.free), DENSITY)
    monkeypatch.setitem(sys.modules, 'capytaine', None)
    with pytest.raises(InputError, match='pip install'):
        BoundaryElements(panels, DENSITY)
