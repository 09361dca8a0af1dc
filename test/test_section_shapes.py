"""Elliptical and rounded rectangular sections: their limits, an independent solver, identities."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from section_elements import Elements, assert_same

from slosh_ros.errors import InputError
from slosh_ros.hydro.coefficients import ModalCoefficients
from slosh_ros.hydro.rectangular import rectangular_coefficients
from slosh_ros.hydro.section import section_coefficients
from slosh_ros.hydro.section_mesh import Resolution
from slosh_ros.tank import (
    UniformTank,
    cylinder_x,
    ellipse_x,
    rectangular,
    rounded_rectangle_x,
    section_x,
)

pytestmark = pytest.mark.dear

Array = NDArray[np.float64]

SURGE, SWAY, _, ROLL, PITCH, YAW = range(6)
FILLS = (0.01, 0.25, 0.5, 0.75, 0.99)
ELLIPSE = ellipse_x(2.4, 1.7, 6.0)
ROUNDED = rounded_rectangle_x(2.4, 1.7, 0.5, 6.0)
SHAPES = pytest.mark.parametrize('tank', [ELLIPSE, ROUNDED], ids=lambda tank: tank.shape)


def solved(tank: UniformTank, fill_ratio: float, modes: int = 12) -> ModalCoefficients:
    return section_coefficients(tank, tank.depth(fill_ratio), 850.0, modes)


def shares(c: ModalCoefficients) -> Array:
    """Coupling over that of a rigid liquid: lambda^2/(mu m) is a share of the mass."""
    rigid = np.array([c.mass, c.mass, np.inf, *np.diag(c.inertia_frozen)])
    return c.coupling / np.sqrt(np.outer(c.mu, rigid))


def assert_alike(found: ModalCoefficients, exact: ModalCoefficients, rel: float) -> None:
    assert found.names == exact.names
    assert found.omega == pytest.approx(exact.omega, rel=rel)
    assert found.mu == pytest.approx(exact.mu, rel=rel)
    assert shares(found) == pytest.approx(shares(exact), abs=rel)
    assert found.inertia_stokes_joukowski == pytest.approx(
        exact.inertia_stokes_joukowski, rel=rel, abs=rel * exact.mass
    )
    assert found.wall_friction == pytest.approx(exact.wall_friction, rel=10.0 * rel)


# --- limits --------------------------------------------------------------------------------------


@pytest.mark.parametrize('fill_ratio', [0.05, 0.6])
def test_an_ellipse_of_equal_axes_and_a_square_of_quarter_circles_are_circles(
    fill_ratio: float,
) -> None:
    circle = solved(cylinder_x(1.0, 4.0), fill_ratio)
    assert_alike(solved(ellipse_x(2.0, 2.0, 4.0), fill_ratio), circle, 1e-9)
    assert_alike(solved(rounded_rectangle_x(2.0, 2.0, 1.0, 4.0), fill_ratio), circle, 1e-7)


@pytest.mark.parametrize(('radius', 'rel'), [(0.0, 1e-6), (1e-3, 2e-5)])
def test_a_rounded_rectangle_of_sharp_corners_is_a_rectangle(radius: float, rel: float) -> None:
    depth = 1.1
    exact = rectangular_coefficients(rectangular(6.0, 2.4, 1.7), depth, 850.0, 12)
    tank = rounded_rectangle_x(2.4, 1.7, radius, 6.0)
    assert_alike(section_coefficients(tank, depth, 850.0, 12), exact, rel)


def test_a_full_ellipse_turns_about_its_axis_as_in_the_textbook() -> None:
    """
    Lamb, Hydrodynamics, art. 72: J = m (a^2 - b^2)^2/(4 (a^2 + b^2)) about the axis.

    The free surface is so small that all but 1e-7 of the ellipse is full. About O at the top, the
    liquid's mass goes with its centroid.
    """
    a, b, length = 1.2, 0.85, 6.0
    tank = ellipse_x(2.0 * a, 2.0 * b, length)
    c = section_coefficients(tank, 2.0 * b * (1.0 - 1e-5), 850.0, 1)
    about_axis = c.mass * (a**2 - b**2) ** 2 / (4.0 * (a**2 + b**2))
    lever = c.mass * c.liquid.centroid[2] ** 2
    assert c.inertia_stokes_joukowski[0, 0] == pytest.approx(about_axis + lever, rel=1e-6)
    assert c.liquid.centroid[2] == pytest.approx(-b, rel=1e-4)


@SHAPES
@pytest.mark.parametrize('fill_ratio', FILLS)
def test_the_liquid_at_rest_is_that_of_a_polygon_of_many_corners(
    tank: UniformTank, fill_ratio: float
) -> None:
    corners = tank.section.outline(800)
    corners = corners[np.hypot(*np.diff(corners, axis=0, append=corners[:1]).T) > 1e-6]
    around = section_x(corners.ravel().tolist(), tank.length)
    assert around.volume == pytest.approx(tank.volume, rel=1e-5)
    liquid, like = tank.filled(tank.depth(fill_ratio)), around.filled(around.depth(fill_ratio))
    for name in ('depth', 'volume', 'centroid', 'inertia', 'surface_centre', 'surface_inertia'):
        expected = getattr(like, name)
        scale = 2e-5 * max(1.0, np.abs(expected).max())
        assert getattr(liquid, name) == pytest.approx(expected, abs=scale), name


@pytest.mark.parametrize('radius', [-0.1, 0.86, float('nan')])
def test_corners_that_do_not_fit_are_refused(radius: float) -> None:
    with pytest.raises(InputError, match=r'corner_radius .* has room for 0 to 0.85 m'):
        rounded_rectangle_x(2.4, 1.7, radius, 6.0)


# --- an independent solver -----------------------------------------------------------------------


def to_ellipse(tank: UniformTank, depth: float) -> Callable[[Array], Array]:
    """Return what moves points from a side to the arc, along the ray from the centre."""
    b, c = np.array(tank.section.bounding_box) / 2.0

    def curve(points: Array) -> Array:
        y, z = points[0] / b, (points[1] + depth - c) / c
        r = np.hypot(y, z)
        return np.stack([y / r * b, z / r * c - (depth - c)])

    return curve


def to_arcs(tank: UniformTank, depth: float) -> Callable[[Array], Array]:
    """Return what moves points from a side to the arc, along the ray from the corner's centre."""
    section = tank.section
    r = section.corner_radius
    middle = section.height / 2.0 - depth  # of the section, above O

    def curve(points: Array) -> Array:
        y, z = points[0], points[1] - middle
        centre_y = np.sign(y) * (section.width / 2.0 - r)
        centre_z = np.sign(z) * (section.height / 2.0 - r)
        away = np.hypot(y - centre_y, z - centre_z)
        corner = (np.abs(y) > np.abs(centre_y)) & (np.abs(z) > np.abs(centre_z))
        push = np.where(corner, r / np.where(corner, away, 1.0), 1.0)
        return np.stack(
            [centre_y + push * (y - centre_y), centre_z + push * (z - centre_z) + middle]
        )

    return curve


@pytest.mark.parametrize('fill_ratio', [0.3, 0.85])
@pytest.mark.parametrize(
    ('tank', 'curve'), [(ELLIPSE, to_ellipse), (ROUNDED, to_arcs)], ids=['ellipse', 'rounded']
)
def test_triangles_of_degree_four_agree(
    tank: UniformTank, curve: Callable, fill_ratio: float
) -> None:
    """Scikit-fem, quadratic sides, graded to the contact line: all twelve modes, the inertia."""
    depth = tank.depth(fill_ratio)
    corners = tank.section.corners(depth)
    s = np.union1d(np.linspace(0.0, 1.0, 41), corners)
    right = tank.section.wall(depth, s).T
    outline = np.concatenate([right[::-1], right[:-1] * [-1.0, 1.0]])
    contact = [right[0], right[0] * [-1.0, 1.0]]
    elements = Elements(outline, 0.15, contact, 4, curve(tank, depth))
    assert_same(section_coefficients(tank, depth, 850.0, 12), elements, tank.length)


# --- convergence and identities ------------------------------------------------------------------


@SHAPES
@pytest.mark.parametrize('fill_ratio', FILLS)
def test_twelve_modes_keep_five_digits_on_a_finer_mesh(
    tank: UniformTank, fill_ratio: float
) -> None:
    depth = tank.depth(fill_ratio)
    coarse = section_coefficients(tank, depth, 850.0, 12)
    fine = section_coefficients(tank, depth, 850.0, 12, Resolution(30, 6, 18))
    assert coarse.names == fine.names
    assert coarse.omega == pytest.approx(fine.omega, rel=1e-7)
    assert coarse.mu == pytest.approx(fine.mu, rel=2e-6)
    assert coarse.wall_friction == pytest.approx(fine.wall_friction, rel=2e-3)
    assert shares(coarse) == pytest.approx(shares(fine), abs=1e-7)
    assert coarse.inertia_stokes_joukowski == pytest.approx(
        fine.inertia_stokes_joukowski, rel=1e-6
    )


def test_a_flat_ellipse_keeps_five_digits_under_its_roof() -> None:
    """Five times as wide as high and nearly full: surface and wall meet at 175 degrees."""
    tank = ellipse_x(4.5, 0.9, 4.0)
    depth = tank.depth(0.95)
    coarse = section_coefficients(tank, depth, 850.0, 12)
    fine = section_coefficients(tank, depth, 850.0, 12, Resolution(30, 7, 22))
    assert coarse.omega == pytest.approx(fine.omega, rel=2e-6)
    assert coarse.mu == pytest.approx(fine.mu, rel=5e-6)
    assert shares(coarse) == pytest.approx(shares(fine), abs=1e-6)


@SHAPES
@pytest.mark.parametrize('fill_ratio', [0.1, 0.9])
def test_modes_carry_the_hydrostatic_moment_and_less_than_the_mass(
    tank: UniformTank, fill_ratio: float
) -> None:
    """Sums of g lambda^2/(mu omega^2) rise to rho I (Parseval); those of lambda^2/mu to less."""
    # in a slice all are of sway, in a pipe most of surge
    for axis, length in ((SWAY, 0.01), (SURGE, 100.0)):
        piece = UniformTank(tank.shape, tank.section, length)
        few, many = solved(piece, fill_ratio, 3), solved(piece, fill_ratio, 20)
        whole = few.density * few.liquid.surface_inertia[axis, axis]
        first, last = (c.static_residual[axis, axis] / whole for c in (few, many))
        assert 0.0 < last < first
        assert last < 1e-4
        assert np.all(np.sum(shares(many) ** 2, axis=0) < 1.0)
    c = solved(tank, fill_ratio, 3)
    assert np.linalg.eigvalsh(c.inertia_frozen - c.inertia_stokes_joukowski).min() > 0.0
    assert np.all(c.wall_friction > 0.0)


def test_a_flat_ellipse_floods_like_a_channel_and_a_tall_one_sways_fast() -> None:
    """The flatter the section of one area, the longer its sway period: its surface is wider."""
    periods = [
        2.0 * np.pi / next(w for w, name in zip(c.omega, c.names, strict=True) if name == 'y1')
        for c in (solved(ellipse_x(w, 4.0 / w, 3.0), 0.5) for w in (1.4, 2.0, 2.8))
    ]
    assert np.all(np.diff(periods) > 0.1)
