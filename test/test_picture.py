"""Free surface and tank in triangles and lines: the picture shows what is computed."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib import colormaps

from slosh_ros.hydro import coefficients_of
from slosh_ros.modal.picture import POINTS, SurfaceMesh, colours, tank_lines
from slosh_ros.tank import Tank, cylinder_x, cylinder_z, rectangular, section_x

# (tank, depth, area of the free surface)
SURFACES = [
    (rectangular(8.0, 2.0, 1.6), 0.8, 16.0),
    (cylinder_x(1.0, 5.0), 0.6, 5.0 * 2.0 * np.sqrt(1.0 - 0.4**2)),
    (cylinder_z(1.2, 2.0), 0.9, np.pi * 1.2**2),
]


def mesh_of(tank: Tank, depth: float, modes: int = 6) -> SurfaceMesh:
    return SurfaceMesh.of(coefficients_of(tank, depth, 1000.0, modes))


def areas(mesh: SurfaceMesh) -> np.ndarray:
    """Vectors of the triangles' areas."""
    a, b, c = (mesh.points[mesh.triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a) / 2.0


@pytest.mark.parametrize(('tank', 'depth', 'area'), SURFACES)
def test_triangles_cover_the_surface_once_and_look_up(tank, depth, area):
    mesh = mesh_of(tank, depth)
    vectors = areas(mesh)
    assert np.all(vectors[:, 2] > 0.0)
    # an inscribed polygon of a circle with 48 corners has 0.3 % less
    assert vectors[:, 2].sum() == pytest.approx(area, rel=0.003)
    assert len(mesh.points) <= 1.6 * POINTS


@pytest.mark.parametrize(('tank', 'depth', 'area'), SURFACES)
def test_edge_of_the_surface_is_on_the_wall(tank, depth, area):
    del area
    mesh = mesh_of(tank, depth)
    edges = np.sort(mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    sides, count = np.unique(edges, axis=0, return_counts=True)
    assert set(count) == {1, 2}
    edge = mesh.points[np.unique(sides[count == 1])]
    assert edge[:, 2] == pytest.approx(depth - tank.height / 2.0)
    surface = tank.filled(depth).surface_centre
    for point in edge:
        outwards = np.append(point[:2] - surface[:2], 0.0) * 1e-6
        assert tank.nearest(depth, point) == pytest.approx(point, abs=1e-9)
        there = tank.nearest(depth, point + outwards)
        assert np.linalg.norm(there - point - outwards) > 1e-8  # a little further is outside


def test_wave_of_a_mode_has_its_shape():
    """Rectangle: cos(pi (x + L/2)/L); both walls among the points."""
    c = coefficients_of(rectangular(8.0, 2.0, 1.6), 0.8, 1000.0, 4)
    mesh = SurfaceMesh.of(c)
    j = c.names.index('x1')
    beta = np.zeros(4)
    beta[j] = 0.25
    expected = 0.25 * np.cos(np.pi * (mesh.points[:, 0] + 4.0) / 8.0)
    np.testing.assert_allclose(mesh.elevation(beta), expected, atol=1e-12)
    assert mesh.points[:, 0].min() == -4.0
    assert mesh.points[:, 0].max() == 4.0


def test_pieces_of_a_surface_are_not_joined_over_the_wall_between():
    """Two chimneys on a tank: the liquid stands in both, with a wall in between."""
    corners = [-1, 0, 1, 0, 1, 1.5, 0.4, 1.5, 0.4, 0.8, -0.2, 0.8, -0.2, 1.5, -1, 1.5]
    tank = section_x([float(c) for c in corners], 2.0)
    depth = 1.2
    c = coefficients_of(tank, depth, 1000.0, 4)
    ((begin, end),) = c.surface_gaps
    mesh = SurfaceMesh.of(c)
    assert areas(mesh)[:, 2].sum() == pytest.approx(2.0 * (0.6 + 0.8), rel=1e-9)
    y = mesh.points[mesh.triangles, 1] - c.liquid.surface_centre[1]
    across = (y.min(axis=1) <= begin + 1e-9) & (y.max(axis=1) >= end - 1e-9)
    assert not across.any()
    assert (y.max(axis=1) <= begin + 1e-9).any()
    assert (y.min(axis=1) >= end - 1e-9).any()


def test_colours_are_viridis():
    values = np.linspace(-1.0, 1.0, 201)
    viridis = colormaps['viridis']((values + 1.0) / 2.0)[:, :3]
    assert np.abs(colours(values) - viridis).max() < 0.02
    np.testing.assert_array_equal(colours(np.array([-9.0, 9.0])), colours(np.array([-1.0, 1.0])))


@pytest.mark.parametrize('tank', [tank for tank, *_ in SURFACES])
def test_outline_of_the_tank_is_its_wall(tank):
    lines = tank_lines(tank)
    top = tank.height * (1.0 - 1e-9)
    for end in lines.reshape(-1, 3):
        assert tank.nearest(top, end) == pytest.approx(end, abs=1e-6)
    high = lines.max(axis=(0, 1))
    assert high[2] == pytest.approx(tank.height / 2.0)
    assert lines.min(axis=(0, 1)) == pytest.approx(-high)
