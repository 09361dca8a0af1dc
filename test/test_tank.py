"""The liquid at rest: moments by quadrature, fill and depth, centroid and frozen inertia."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from slosh_ros.errors import InputError
from slosh_ros.tank import (
    Circle,
    Rectangle,
    Section,
    Tank,
    UniformTank,
    cylinder_x,
    cylinder_z,
    ellipse_x,
    rectangular,
    rounded_rectangle_x,
    section_x,
    sphere,
)

Array = NDArray[np.float64]

FILLS = (0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99)


def by_slices(section: Section, depth: float) -> dict[str, float]:
    """Integrate the moments over horizontal slices of a circle or rectangle, about O."""
    # z = -depth + depth sin^2: the ends of the slices' width are square roots of the height
    x, weight = np.polynomial.legendre.leggauss(60)
    angle = np.pi / 4.0 * (1.0 + x)
    z = -depth * np.cos(angle) ** 2
    dz = weight * np.pi / 4.0 * 2.0 * depth * np.cos(angle) * np.sin(angle)
    if isinstance(section, Circle):
        above_bottom = z + depth
        half_width = np.sqrt(above_bottom * (2.0 * section.radius - above_bottom))
    else:
        half_width = np.full_like(z, section.bounding_box[0] / 2.0)
    return {
        'area': float(2.0 * half_width @ dz),
        'z': float((2.0 * half_width * z) @ dz),
        'yy': float((2.0 / 3.0 * half_width**3) @ dz),
        'zz': float((2.0 * half_width * z**2) @ dz),
    }


@pytest.mark.parametrize(
    'section', [Circle(1.3), Rectangle(2.1, 2.6)], ids=['circle', 'rectangle']
)
@pytest.mark.parametrize('relative_depth', [0.001, 0.02, 0.3, 0.5, 0.8, 0.98, 0.999])
def test_moments_of_a_section_by_quadrature(section: Section, relative_depth: float) -> None:
    depth = 2.6 * relative_depth
    moments = section.moments(depth)
    for name, value in by_slices(section, depth).items():
        # about O, the moments of a circular film are small differences: digits of zz get lost
        assert getattr(moments, name) == pytest.approx(value, rel=1e-6), name


def test_a_full_circle_is_a_disc() -> None:
    radius = 1.7
    moments = Circle(radius).moments(2.0 * radius)
    disc = np.pi * radius**2
    assert moments.area == pytest.approx(disc)
    assert moments.half_width == pytest.approx(0.0, abs=1e-7)
    assert moments.z == pytest.approx(-disc * radius)
    assert moments.yy == pytest.approx(disc * radius**2 / 4.0)
    assert moments.zz == pytest.approx(disc * radius**2 * (1.0 / 4.0 + 1.0))  # Steiner


def test_a_film_in_a_circle_is_a_parabola() -> None:
    radius, depth = 1.0, 1e-5
    moments = Circle(radius).moments(depth)
    half_width = np.sqrt(2.0 * radius * depth)
    assert moments.half_width == pytest.approx(half_width, rel=1e-5)
    assert moments.area == pytest.approx(4.0 / 3.0 * half_width * depth, rel=1e-5)
    assert moments.yy == pytest.approx(4.0 / 15.0 * half_width**3 * depth, rel=1e-5)


def test_centroid_of_a_half_full_cylinder() -> None:
    radius = 1.2
    liquid = cylinder_x(radius, 5.75).filled(radius)
    assert liquid.centroid == pytest.approx([0.0, 0.0, -4.0 * radius / (3.0 * np.pi)])
    assert liquid.volume == pytest.approx(np.pi * radius**2 / 2.0 * 5.75)


@pytest.mark.parametrize('tank', [cylinder_x(1.2, 5.75), rectangular(8.0, 2.0, 1.6)], ids=str)
@pytest.mark.parametrize('fill_ratio', FILLS)
def test_fill_ratio_and_depth_round_trip(tank: UniformTank, fill_ratio: float) -> None:
    depth = tank.depth(fill_ratio)
    assert tank.fill_ratio(depth) == pytest.approx(fill_ratio, rel=1e-12)
    assert tank.filled(depth).fill_ratio == pytest.approx(fill_ratio, rel=1e-12)


def test_depth_rises_with_the_fill() -> None:
    tank = cylinder_x(1.0, 3.0)
    depths = [tank.depth(fill) for fill in np.linspace(0.01, 0.99, 99)]
    assert np.all(np.diff(depths) > 0.0)
    assert tank.depth(0.5) == pytest.approx(1.0, rel=1e-12)
    assert tank.depth(0.2) + tank.depth(0.8) == pytest.approx(2.0, rel=1e-12)  # upside down


@pytest.mark.parametrize('fill_ratio', FILLS)
def test_frozen_inertia_by_quadrature(fill_ratio: float) -> None:
    length = 5.75
    tank = cylinder_x(1.2, length)
    depth = tank.depth(fill_ratio)
    section = by_slices(tank.section, depth)
    x, weight = np.polynomial.legendre.leggauss(4)
    xx = section['area'] * float(weight @ (x * length / 2.0) ** 2) * length / 2.0
    yy, zz = section['yy'] * length, section['zz'] * length
    assert tank.filled(depth).inertia == pytest.approx(
        np.diag([yy + zz, xx + zz, xx + yy]), rel=1e-7
    )


def test_frozen_inertia_of_a_box() -> None:
    length, width, depth = 8.0, 2.0, 0.8
    liquid = rectangular(length, width, 1.6).filled(depth)
    volume = length * width * depth
    # about its centroid, and from there to O by Steiner
    lift = (depth / 2.0) ** 2
    expected = volume * np.array(
        [
            (width**2 + depth**2) / 12.0 + lift,
            (length**2 + depth**2) / 12.0 + lift,
            (length**2 + width**2) / 12.0,
        ]
    )
    assert np.diag(liquid.inertia) == pytest.approx(expected)
    assert np.diag(liquid.surface_inertia) == pytest.approx(
        (width * length**3 / 12.0, length * width**3 / 12.0)
    )


def test_surface_height_and_freeboard_meet_the_bounding_box() -> None:
    tank = cylinder_x(1.2, 5.75)
    liquid = tank.filled(1.8)
    assert liquid.surface_height == pytest.approx(0.6)  # above the axis
    assert liquid.freeboard == pytest.approx(0.6)


def arc_lengths(points: Array) -> Array:
    return np.hypot(*np.diff(points, axis=1))


@pytest.mark.parametrize('depth', [0.05, 1.0, 1.3, 2.5])
def test_wall_of_a_circle_from_contact_line_to_lowest_point(depth: float) -> None:
    circle = Circle(1.3)
    points = circle.wall(depth, np.linspace(0.0, 1.0, 101))
    assert points[:, 0] == pytest.approx([circle.moments(depth).half_width, 0.0], abs=1e-14)
    assert points[:, -1] == pytest.approx([0.0, -depth])
    assert np.hypot(points[0], points[1] + depth - 1.3) == pytest.approx(np.full(101, 1.3))
    assert arc_lengths(points) == pytest.approx(np.full(100, arc_lengths(points)[0]))
    assert circle.corners(depth) == ()


def test_wall_of_a_rectangle_turns_at_its_corner() -> None:
    section, depth = Rectangle(3.0, 2.0), 0.5
    (corner,) = section.corners(depth)
    s = np.array([0.0, corner / 2.0, corner, (1.0 + corner) / 2.0, 1.0])
    expected = np.array([[1.5, 1.5, 1.5, 0.75, 0.0], [0.0, -0.25, -0.5, -0.5, -0.5]])
    assert section.wall(depth, s) == pytest.approx(expected)


@pytest.mark.parametrize(
    ('tank', 'inside'),
    [
        (cylinder_x(1.0, 3.0), lambda x, y, z: (abs(x) <= 1.5) & (y**2 + z**2 <= 1.0)),
        (rectangular(3.0, 2.0, 2.0), lambda x, y, z: (abs(x) <= 1.5) & (abs(y) <= 1) & (z >= -1)),
        (cylinder_z(1.0, 2.0), lambda x, y, z: (x**2 + y**2 <= 1.0) & (z >= -1.0)),
    ],
    ids=['cylinder_x', 'rectangular', 'cylinder_z'],
)  # fmt: skip
@pytest.mark.parametrize('depth', [0.3, 1.0, 1.7])
def test_nearest_point_of_the_liquid(tank: Tank, inside: object, depth: float) -> None:
    """The point itself if it is wet; else no point of a fine grid of the liquid is closer."""
    axes = np.linspace(-1.5, 1.5, 61), np.linspace(-1.0, 1.0, 41), np.linspace(-1.0, 1.0, 41)
    grid = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 3)
    liquid = grid[inside(*grid.T) & (grid[:, 2] <= depth - 1.0)]
    for point in np.random.default_rng(1).uniform(-2.0, 2.0, (40, 3)):
        nearest = tank.nearest(depth, point)
        if inside(*point) and point[2] <= depth - 1.0:
            assert np.array_equal(nearest, point)
            continue
        assert inside(*(nearest * (1.0 - 1e-6)))
        assert nearest[2] <= depth - 1.0 + 1e-9
        closest = np.linalg.norm(liquid - point, axis=1).min()
        assert closest - 0.1 < np.linalg.norm(nearest - point) < closest + 1e-6


@pytest.mark.parametrize('length', [0.0, -1.0, np.nan, np.inf])
def test_lengths_that_are_none(length: float) -> None:
    for name, make in (
        ('length', lambda x: rectangular(x, 1.0, 1.0)),
        ('width', lambda x: rectangular(1.0, x, 1.0)),
        ('height', lambda x: ellipse_x(1.0, x, 1.0)),
        ('width', lambda x: rounded_rectangle_x(x, 1.0, 0.1, 1.0)),
        ('radius', lambda x: cylinder_x(x, 1.0)),
        ('length', lambda x: cylinder_x(1.0, x)),
        ('height', lambda x: cylinder_z(1.0, x)),
        ('radius', sphere),
        ('length', lambda x: section_x([0.0, 0.0, 1.0, 0.0, 0.0, 1.0], x)),
    ):
        with pytest.raises(InputError, match=f'^{name} is {length:g} m; it must be greater'):
            make(length)
