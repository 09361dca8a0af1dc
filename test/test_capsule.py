"""Spheres and cylinders with ellipsoidal heads: the liquid at rest, its surface."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from slosh_ros.errors import InputError
from slosh_ros.modal.validity import SURFACE_CHANGE, surface_room
from slosh_ros.tank import Capsule, LiquidAtRest, cylinder_x, sphere
from slosh_ros.tank.surface import area_vectors

Array = NDArray[np.float64]

TANKS = {
    'sphere': sphere(1.3),
    'hemispherical heads': cylinder_x(1.3, 2.0, 1.3),
    'dished heads': cylinder_x(1.3, 4.0, 0.5),
    'shallow heads': cylinder_x(1.0, 1e-6, 0.05),
}
FILLS = (0.01, 0.2, 0.5, 0.8, 0.99)

every_tank = pytest.mark.parametrize('tank', TANKS.values(), ids=TANKS)


def by_slices(tank: Capsule, depth: float) -> dict[str, float]:
    """Integrate over the sections at places along x, each a part of a circle."""
    u, weight = np.polynomial.legendre.leggauss(400)
    half = tank.length / 2.0
    # x = half + head sin(angle): the radius of the sections is smooth in the angle
    angle = np.pi / 4.0 * (1.0 + u)
    x = np.concatenate([half / 2.0 * (1.0 + u), half + tank.head_depth * np.sin(angle)])
    radius = np.concatenate([np.full_like(u, tank.radius), tank.radius * np.cos(angle)])
    dx = np.concatenate(
        [half / 2.0 * weight, np.pi / 4.0 * weight * tank.head_depth * np.cos(angle)]
    )
    level = depth - tank.radius
    v, v_weight = np.polynomial.legendre.leggauss(60)
    bottom, top = -radius, np.clip(level, -radius, radius)
    # z = -r cos(t), as the width of the section is smooth in t
    end = np.arccos(np.clip(-top / radius, -1.0, 1.0))
    t = np.outer(end / 2.0, 1.0 + v)
    z = bottom[:, None] * np.cos(t)
    b = radius[:, None] * np.sin(t)
    dz = np.outer(end / 2.0, v_weight) * radius[:, None] * np.sin(t) * dx[:, None] * 2.0
    return {
        'volume': float(np.sum(2.0 * b * dz)),
        'z': float(np.sum(2.0 * b * (z - level) * dz)),
        'xx': float(np.sum(2.0 * b * x[:, None] ** 2 * dz)),
        'yy': float(np.sum(2.0 / 3.0 * b**3 * dz)),
        'zz': float(np.sum(2.0 * b * (z - level) ** 2 * dz)),
    }


@every_tank
@pytest.mark.parametrize('fill_ratio', FILLS)
def test_moments_by_quadrature(tank: Capsule, fill_ratio: float) -> None:
    depth = tank.depth(fill_ratio)
    liquid, m = tank.filled(depth), by_slices(tank, depth)
    assert liquid.fill_ratio == pytest.approx(fill_ratio, rel=1e-11)
    assert liquid.volume == pytest.approx(m['volume'], rel=1e-5)
    assert liquid.centroid == pytest.approx([0.0, 0.0, m['z'] / m['volume']], rel=1e-5)
    expected = [m['yy'] + m['zz'], m['xx'] + m['zz'], m['xx'] + m['yy']]
    assert np.diag(liquid.inertia) == pytest.approx(expected, rel=1e-5)


def test_cap_of_a_sphere() -> None:
    """Published: V = pi h^2 (3R - h)/3, centroid 3 (2R - h)^2/(4 (3R - h)) from the centre."""
    radius = 1.7
    for depth in (0.01, 0.6, 1.7, 2.5, 3.39):
        liquid = sphere(radius).filled(depth)
        assert liquid.volume == pytest.approx(np.pi * depth**2 * (3.0 * radius - depth) / 3.0)
        below = 3.0 * (2.0 * radius - depth) ** 2 / (4.0 * (3.0 * radius - depth))
        centre = liquid.surface_height + liquid.centroid[2]
        assert centre == pytest.approx(-below, rel=1e-9)
        edge = depth * (2.0 * radius - depth)  # squared
        assert liquid.surface_inertia == pytest.approx(np.pi / 4.0 * edge**2 * np.eye(2))


def test_full_and_half_full_spheres_are_balls() -> None:
    """Inertia 2/5 m R^2 about the centre: of the half as of the whole."""
    radius = 1.7
    ball = 4.0 / 3.0 * np.pi * radius**3
    half = sphere(radius).filled(radius)
    assert half.inertia == pytest.approx(ball / 2.0 * 0.4 * radius**2 * np.eye(3))
    full = sphere(radius).filled(2.0 * radius)
    assert full.volume == pytest.approx(ball)
    steiner = ball * radius**2 * np.diag([1.0, 1.0, 0.0])
    assert full.inertia == pytest.approx(ball * 0.4 * radius**2 * np.eye(3) + steiner)


@pytest.mark.parametrize('fill_ratio', FILLS)
def test_hemispherical_heads_are_a_cylinder_and_a_sphere(fill_ratio: float) -> None:
    """Volumes, and moments about y = 0 and the surface, add up."""
    radius, length = 1.2, 3.0
    tank, parts = cylinder_x(radius, length, radius), (cylinder_x(radius, length), sphere(radius))
    depth = tank.depth(fill_ratio)
    whole, straight, ball = (t.filled(depth) for t in (tank, *parts))
    assert whole.volume == pytest.approx(straight.volume + ball.volume)
    assert whole.inertia[0, 0] == pytest.approx(straight.inertia[0, 0] + ball.inertia[0, 0])
    assert whole.surface_inertia[1, 1] == pytest.approx(
        straight.surface_inertia[1, 1] + ball.surface_inertia[1, 1]
    )
    # the halves of the ball stand apart
    assert whole.inertia[1, 1] > straight.inertia[1, 1] + ball.inertia[1, 1]


def test_flat_ends_stay_a_uniform_tank() -> None:
    assert cylinder_x(1.2, 3.0, 0.0) == cylinder_x(1.2, 3.0)


@pytest.mark.parametrize('head_depth', [-0.1, 1.21, 600.0, np.nan])
def test_heads_deeper_than_half_a_sphere_are_refused(head_depth: float) -> None:
    with pytest.raises(InputError, match=r'head_depth is .*the radius of 1\.2 m'):
        cylinder_x(1.2, 3.0, head_depth)


@every_tank
@pytest.mark.parametrize('fill_ratio', FILLS)
def test_the_surface_of_the_liquid_is_closed_and_on_the_wall(
    tank: Capsule, fill_ratio: float
) -> None:
    depth = tank.depth(fill_ratio)
    surface = tank.liquid_surface(depth, 0.3 * tank.radius)
    triangles = np.round(surface.triangles, 12) + 0.0  # + 0.0: no minus zero
    edges = {}
    for triangle in triangles.tolist():
        for i in range(3):
            ends = tuple(triangle[i]), tuple(triangle[(i + 1) % 3])
            edges[ends] = edges.get(ends, 0) + 1
    # each edge once in either direction
    assert all(count == 1 and edges.get(ends[::-1]) == 1 for ends, count in edges.items())
    assert np.all(surface.free[..., 2] == 0.0)
    assert np.all(area_vectors(surface.free)[:, 2] > 0.0)

    x, y, z = surface.wall.reshape(-1, 3).T
    away = np.maximum(np.abs(x) - tank.length / 2.0, 0.0) / tank.head_depth
    axis = (tank.radius - depth, tank.radius)
    on_wall = away**2 + (y / axis[1]) ** 2 + ((z - axis[0]) / axis[1]) ** 2
    assert on_wall == pytest.approx(np.ones_like(x), abs=1e-12)
    # normals out of the liquid, which is convex
    outwards = surface.wall.mean(axis=1) - tank.filled(depth).centroid
    assert np.all(np.sum(area_vectors(surface.wall) * outwards, axis=1) > 0.0)


def moments(liquid: LiquidAtRest) -> Array:
    inertia, surface = np.diag(liquid.inertia), np.diag(liquid.surface_inertia)
    return np.array([liquid.volume, liquid.centroid[2], *inertia, *surface])


@pytest.mark.parametrize('name', ['sphere', 'dished heads'])
@pytest.mark.parametrize('fill_ratio', [0.2, 0.8])
def test_the_error_of_the_surface_falls_as_its_size_squared(name: str, fill_ratio: float) -> None:
    tank = TANKS[name]
    depth = tank.depth(fill_ratio)
    exact = tank.filled(depth)
    errors = []
    for size in (0.2, 0.1, 0.05):
        found = tank.liquid_surface(depth, size).liquid(
            depth, fill_ratio, exact.surface_centre, exact.freeboard
        )
        errors.append(np.abs(moments(found) / moments(exact) - 1.0))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.array(errors[-1]) < 3e-3)
    assert rates.mean(axis=0) == pytest.approx(np.full(7, 2.0), abs=0.35)


def test_walls_leave_room_for_waves() -> None:
    """Infinite between upright walls; in a half-full sphere the surface shrinks as 1 - h^2/R^2."""
    radius = TANKS['sphere'].radius
    assert surface_room(TANKS['sphere'], radius) == pytest.approx(
        radius * np.sqrt(SURFACE_CHANGE), rel=1e-3
    )
    assert surface_room(TANKS['dished heads'], 1.3) < surface_room(cylinder_x(1.3, 4.0), 1.3)


@every_tank
def test_nearest_points(tank: Capsule) -> None:
    """On the liquid, and from there no direction into it leads closer (it is convex)."""
    rng = np.random.default_rng(3)
    depth = tank.depth(0.7)
    surface = depth - tank.radius
    size = tank.length / 2.0 + tank.radius
    inside = rng.uniform(-1.0, 1.0, (4000, 3)) * size
    away = np.maximum(np.abs(inside[:, 0]) - tank.length / 2.0, 0.0) / tank.head_depth
    full = away**2 + np.sum((inside[:, 1:] / tank.radius) ** 2, axis=1) < 1.0
    inside = inside[full & (inside[:, 2] < surface)]
    for point in rng.uniform(-1.5, 1.5, (60, 3)) * size:
        foot = tank.nearest(depth, point)
        assert np.all((inside - foot) @ (point - foot) <= 1e-9)
        assert tank.nearest(depth, foot) == pytest.approx(foot, abs=1e-9)
    for point in inside[:20]:
        assert np.array_equal(tank.nearest(depth, point), point)
