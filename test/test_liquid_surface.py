"""The liquid as a closed surface of triangles: moments by the divergence theorem."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from slosh_ros.tank import LiquidSurface, rectangular
from slosh_ros.tank.surface import solid_moments, surface_moments

Array = NDArray[np.float64]


def box_surface(length: float, width: float, depth: float) -> LiquidSurface:
    """Twelve triangles of the liquid in a box, about O."""
    x, y = length / 2.0, width / 2.0
    top = np.array([[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]])
    bottom = top - [0.0, 0.0, depth]
    quads = [bottom[::-1]]
    quads += [
        np.array([bottom[i], bottom[(i + 1) % 4], top[(i + 1) % 4], top[i]]) for i in range(4)
    ]

    def split(quad: Array) -> list[Array]:
        return [quad[[0, 1, 2]], quad[[0, 2, 3]]]

    wall = np.array([triangle for quad in quads for triangle in split(quad)])
    return LiquidSurface(wall, np.array(split(top)))


def test_moments_of_a_box_by_the_divergence_theorem() -> None:
    tank, depth = rectangular(3.0, 1.6, 1.2), 0.7
    expected = tank.filled(depth)
    found = box_surface(3.0, 1.6, depth).liquid(
        depth, expected.fill_ratio, expected.surface_centre, expected.freeboard
    )
    assert found.volume == pytest.approx(expected.volume, rel=1e-14)
    for name in ('centroid', 'inertia', 'surface_inertia'):
        exactly = getattr(expected, name)
        assert getattr(found, name) == pytest.approx(exactly, rel=1e-14, abs=1e-15), name


def test_moments_of_a_tetrahedron() -> None:
    """Of x^i y^j z^k over the unit simplex: i! j! k!/(i + j + k + 3)!."""
    o, (x, y, z) = np.zeros(3), np.eye(3)
    m = solid_moments(np.array([[x, y, z], [o, y, x], [o, z, y], [o, x, z]]))
    assert m.whole == pytest.approx(1.0 / 6.0)
    assert m.first == pytest.approx(np.full(3, 1.0 / 24.0))
    assert m.second == pytest.approx((np.ones((3, 3)) + np.eye(3)) / 120.0)


def test_moments_do_not_depend_on_the_origin() -> None:
    """A body far from the origin has the moments of Steiner's theorem."""
    box, shift = box_surface(2.0, 1.0, 0.5), np.array([0.3, -0.7, 1.9])
    here, there = solid_moments(box.triangles), solid_moments(box.triangles + shift)
    for found, expected in zip(there.about(shift), here, strict=True):
        assert found == pytest.approx(expected, abs=1e-14)
    assert surface_moments(box.free + shift).about(shift).second == pytest.approx(
        surface_moments(box.free).second, abs=1e-14
    )
    # a quarter turn about z changes the places of x and y
    turned = solid_moments(
        box.triangles @ np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0, 0, 1]])
    )
    assert np.diag(turned.second) == pytest.approx(np.diag(here.second)[[1, 0, 2]])
