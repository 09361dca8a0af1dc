"""Tanks of any shape that are full: the liquid under Stokes's and Joukowski's closed lid."""

from __future__ import annotations

import numpy as np
import pytest
from test_mesh import box, tank_of

from slosh_ros.hydro import coefficients_of
from slosh_ros.hydro.volume import VolumeResolution, full_volume_coefficients
from slosh_ros.tank import cylinder_x, rectangular, sphere

FEW = VolumeResolution(triangles=2000)  # good for three digits of smooth walls
POINTS = np.array([[0.3, 0.2, -0.6], [-0.5, 0.4, -0.9], [0.0, 0.0, 0.0]])


def test_a_full_sphere_is_a_point_mass() -> None:
    """Nothing turns its liquid about its centre: Omega_4 = R y, Omega_5 = -R x about the top."""
    found = full_volume_coefficients(sphere(1.0), 2.0, 1000.0, FEW)
    inertia = found.inertia_stokes_joukowski / found.mass
    assert inertia == pytest.approx(np.diag([1.0, 1.0, 0.0]), abs=5e-4)
    assert found.omega.size == 0
    assert found.error is not None
    assert found.error < 1e-4
    x, y, _ = POINTS.T
    assert found.potentials is not None
    omega = found.potentials.stokes_joukowski(POINTS)
    assert omega == pytest.approx(np.stack([y, -x, 0.0 * x], axis=1), abs=5e-4)


def test_a_full_box_as_by_its_series() -> None:
    """Also where it leans on nothing: about O, in the middle of its roof."""
    exact = coefficients_of(rectangular(3.0, 1.6, 1.2), 1.2, 1000.0, 6)
    tank = tank_of(box(3.0, 1.6, 1.2, (5.0, 1.0, 0.0)))
    found = full_volume_coefficients(tank, tank.height, 1000.0, FEW)
    inertia, expected = (c.inertia_stokes_joukowski for c in (found, exact))
    assert inertia == pytest.approx(expected, rel=2e-5, abs=1e-5 * expected.max())
    assert found.liquid.surface_centre == pytest.approx([0.0, 0.0, 0.6])
    assert found.potentials is not None
    assert exact.potentials is not None
    constant = exact.potentials.stokes_joukowski(np.zeros((1, 3)))
    assert found.potentials.stokes_joukowski(POINTS) == pytest.approx(
        exact.potentials.stokes_joukowski(POINTS) - constant, abs=2e-5
    )


def test_full_tanks_with_heads_go_their_way() -> None:
    """Roll about the axis moves no liquid; pitch and yaw less than if it were frozen."""
    tank = cylinder_x(1.0, 3.0, 0.5)
    c = coefficients_of(tank, tank.height, 1000.0, 6)
    assert c.names == ()
    inertia = np.diag(c.inertia_stokes_joukowski)
    assert inertia[0] == pytest.approx(c.mass, rel=1e-4)  # at the distance R from the axis
    assert inertia[1] == pytest.approx(inertia[2] + c.mass, rel=1e-4)
    assert np.all(inertia < np.diag(c.inertia_frozen))
