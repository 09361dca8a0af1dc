"""Delaunay refinement: the triangles fill the polygon, fit together and are not too thin."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from slosh_ros.errors import InputError
from slosh_ros.tank.triangulation import corner_angles, inside, triangulate

Array = NDArray[np.float64]

ANGLE = np.linspace(-np.pi, 0.0, 60)
OUTLINES = {
    'square': np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]),
    'half a circle': np.stack([np.cos(ANGLE), np.sin(ANGLE)], axis=1),
    'two legs': np.array(
        [[-1, -1], [1, -1], [1, 0], [0.2, 0], [0.2, -0.4], [-0.3, -0.4], [-0.3, 0], [-1, 0]],
        dtype=float,
    ),
    'film': np.array([[-1.0, -0.01], [1.0, -0.01], [1.0, 0.0], [-1.0, 0.0]]),
    'acute': np.array([[0.0, -0.05], [1.0, 0.0], [-1.0, 0.0]]),
    'spikes': np.array(
        [0, 0, 1, 0, 1.02, -1, 1.04, 0, 2, 0, 2, 1, 1.1, 1, 1, 0.1, 0.9, 1, 0, 1], dtype=float
    ).reshape(-1, 2),
}  # fmt: skip


def areas(corners: Array) -> Array:
    (y, z), (v, w) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    return (y * w - z * v) / 2.0


def sides(corners: Array) -> Array:
    return np.stack([np.hypot(*(corners[:, i - 1] - corners[:, i - 2]).T) for i in range(3)], 1)


@pytest.mark.parametrize('name', OUTLINES)
@pytest.mark.parametrize('size', [0.3, 0.8])
def test_triangles_fill_the_polygon_and_fit_together(name: str, size: float) -> None:
    outline = OUTLINES[name]
    points, triangles = triangulate(outline, lambda p: np.full(len(p), size))
    corners = points[triangles]
    (y, z), (v, w) = outline.T, np.roll(outline, -1, axis=0).T
    assert np.all(areas(corners) > 0.0)
    assert areas(corners).sum() == pytest.approx((y * w - v * z).sum() / 2.0, rel=1e-12)
    assert np.array_equal(points[: len(outline)], outline)
    # every side belongs to two triangles, or to one and lies on the outline
    ends = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, uses = np.unique(ends, axis=0, return_counts=True)
    assert set(uses.tolist()) <= {1, 2}
    around = np.hypot(*(points[edges[uses == 1, 1]] - points[edges[uses == 1, 0]]).T).sum()
    assert around == pytest.approx(np.hypot(v - y, w - z).sum(), rel=1e-12)
    # no triangle is larger than asked for, by its circumcircle
    lengths = sides(corners)
    radius = np.prod(lengths, axis=1) / (4.0 * areas(corners))
    assert np.sqrt(3.0) * radius.max() < 1.31 * size


@pytest.mark.parametrize('name', ['square', 'half a circle', 'two legs', 'film'])
def test_no_triangle_is_thin_where_no_corner_is_acute(name: str) -> None:
    points, triangles = triangulate(OUTLINES[name], lambda p: np.full(len(p), 0.5))
    lengths = sides(points[triangles])
    radius = np.prod(lengths, axis=1) / (4.0 * areas(points[triangles]))
    assert np.all(lengths.min(axis=1) / (2.0 * radius) > np.sin(np.radians(19.0)))  # the sine rule


def test_sizes_follow_the_request() -> None:
    points, triangles = triangulate(OUTLINES['square'], lambda p: 0.02 + 0.5 * p[:, 0])
    middle, lengths = points[triangles].mean(axis=1), sides(points[triangles]).max(axis=1)
    assert lengths[middle[:, 0] < 0.05].max() < 0.06
    assert lengths[middle[:, 0] > 0.8].min() > 0.15


def test_acute_corners_end_and_details_too_small_are_refused() -> None:
    for degrees in (1.0, 5.0, 20.0, 40.0):
        tip = np.array([[0.0, 0.0], [1.0, 0.0], [np.cos(np.radians(degrees)), 0.0]])
        tip[2, 1] = np.sin(np.radians(degrees))
        _, triangles = triangulate(tip, lambda p: np.full(len(p), 0.4))
        assert len(triangles) < 600 / degrees + 100
    hair = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1e-4], [0.0, 1e-4]])
    with pytest.raises(InputError, match='too small to be computed'):
        triangulate(hair, lambda p: np.full(len(p), 0.4))


def test_angles_at_corners() -> None:
    found = np.degrees(corner_angles(OUTLINES['two legs']))
    assert found == pytest.approx([90.0, 90.0, 90.0, 90.0, 270.0, 270.0, 90.0, 90.0])


def test_points_level_with_a_corner_are_inside() -> None:
    """Whatever the rounding of the way from one corner to the next."""
    rng = np.random.default_rng(3)
    angle = 2.0 * np.pi * np.arange(240) / 240.0
    for turn in rng.uniform(0.0, 1.0, 10):
        outline = np.stack([1.7 * np.cos(angle + turn), 0.9 * np.sin(angle + turn)], axis=-1)
        assert inside([outline], 0.9 * outline).all()
        assert inside([outline], outline * [0.5, 1.0])[np.abs(outline[:, 1]) < 0.89].all()
        assert not inside([outline], outline * [1.5, 1.0])[np.abs(outline[:, 0]) > 0.1].any()


@pytest.mark.parametrize('name', OUTLINES)
def test_any_triangles_that_join_the_corners(name: str) -> None:
    """Without a size they are few, fill the polygon, and have its edges as sides."""
    outline = OUTLINES[name]
    points, triangles = triangulate(outline, None)
    found = areas(points[triangles])
    assert found.min() > 0.0
    (y, z), (v, w) = outline.T, np.roll(outline, -1, axis=0).T
    assert found.sum() == pytest.approx(np.sum(y * w - v * z) / 2.0)
    assert len(triangles) == len(points) - 2


def test_a_polygon_with_a_hole() -> None:
    outline, hole = OUTLINES['square'], 0.25 + 0.5 * OUTLINES['square'][::-1]
    for size in (None, lambda p: np.full(len(p), 0.2)):
        points, triangles = triangulate(outline, size, [hole])
        assert areas(points[triangles]).sum() == pytest.approx(0.75)
        middles = np.abs(points[triangles].mean(axis=1) - 0.5).max(axis=1)
        assert middles.min() > 0.25
