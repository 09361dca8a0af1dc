"""Damping of a smooth bare tank by the boundary layers at its walls."""

from __future__ import annotations

import json

import numpy as np
import pytest
from drives import RECTANGLE
from test_bad_input import GOOD, refused
from test_replay import slosh

from slosh_ros.engine import SloshConfig, SloshEngine
from slosh_ros.hydro.rectangular import rectangular_coefficients
from slosh_ros.hydro.section import section_coefficients
from slosh_ros.tank import cylinder_x, rectangular

WATER = 1.0e-6  # [m^2/s]


def test_deep_box_rubs_on_its_four_walls():
    """No bottom: half the wall over the volume integral is 1/L + 1/B for the first modes."""
    c = rectangular_coefficients(rectangular(2.0, 3.0, 40.0), 30.0, 1000.0, 2)
    np.testing.assert_allclose(c.wall_friction, 1 / 2.0 + 1 / 3.0, rtol=1e-12)


@pytest.mark.parametrize('mode', ['x1', 'x1y1', 'x3y1', 'y3'])
def test_wall_friction_of_a_box_is_the_quadrature_of_the_velocity(mode):
    """Tangential velocity squared over bottom, sides and ends, by Gauss points."""
    length, width, depth = 8.0, 2.0, 0.8
    c = rectangular_coefficients(rectangular(length, width, 1.6), depth, 1000.0, 20)
    a, b = (int(mode.partition(axis)[2][:1] or 0) for axis in 'xy')
    ka, kb = np.pi * a / length, np.pi * b / width
    k = np.hypot(ka, kb)

    def velocity(x, y, z):
        u, v = ka * (x + length / 2), kb * (y + width / 2)
        ch, sh = np.cosh(k * (z + depth)), np.sinh(k * (z + depth))
        return (
            -ka * np.sin(u) * np.cos(v) * ch,
            -kb * np.cos(u) * np.sin(v) * ch,
            k * np.cos(u) * np.cos(v) * sh,
        )

    points, weights = np.polynomial.legendre.leggauss(40)
    x, y, z = points * length / 2, points * width / 2, (points - 1) * depth / 2
    wx, wy, wz = weights * length / 2, weights * width / 2, weights * depth / 2

    def over(p, q, r, wp, wq, wr, parts):
        grid = np.meshgrid(p, q, r, indexing='ij')
        square = sum(velocity(*grid)[i] ** 2 for i in parts)
        return np.einsum('ijk,i,j,k->', square, wp, wq, wr)

    one = np.ones(1)
    wall = over(x, y, -depth * one, wx, wy, one, (0, 1))
    wall += sum(over(x, s * width / 2 * one, z, wx, one, wz, (0, 2)) for s in (-1, 1))
    wall += sum(over(s * length / 2 * one, y, z, one, wy, wz, (1, 2)) for s in (-1, 1))
    volume = over(x, y, z, wx, wy, wz, (0, 1, 2))
    got = c.wall_friction[c.names.index(mode)]
    assert got == pytest.approx(wall / (2 * volume), rel=1e-10)


def test_section_route_agrees_with_the_closed_form():
    tank = rectangular(8.0, 2.3, 1.6)
    exact = rectangular_coefficients(tank, 0.8, 850.0, 6)
    found = section_coefficients(tank, 0.8, 850.0, 6)
    assert found.names == exact.names
    np.testing.assert_allclose(found.wall_friction, exact.wall_friction, rtol=1e-8)


def test_similar_tanks_damp_less_the_larger_they_are():
    """Similar tanks: the ratio falls as the length to the power -3/4."""
    small, large = (
        section_coefficients(cylinder_x(r, 5 * r), r, 1000.0, 3).wall_damping_ratio(WATER)
        for r in (0.1, 1.6)
    )
    np.testing.assert_allclose(small / large, 16**0.75, rtol=1e-6)
    assert 1e-5 < large.min() < large.max() < 1e-3


def config(**changes: object) -> SloshConfig:
    given = RECTANGLE | {name.replace('__', '.'): value for name, value in changes.items()}
    return SloshConfig.from_parameters(given)


def test_without_viscosity_the_liquid_is_ideal_and_the_users_number_comes_first():
    def ratios(**changes: object) -> np.ndarray:
        return SloshEngine(config(**changes)).tanks[0].damping_ratio

    assert np.all(ratios() == 0.0)
    viscous = ratios(tank__kinematic_viscosity=WATER)
    assert np.all((viscous > 1e-5) & (viscous < 1e-2))
    np.testing.assert_allclose(ratios(tank__kinematic_viscosity=4 * WATER), 2 * viscous)
    assert np.all(ratios(tank__kinematic_viscosity=WATER, tank__damping_ratio=0.03) == 0.03)


def test_the_damping_in_use_is_reported(tmp_path):
    file = tmp_path / 'tank.yaml'
    file.write_text(GOOD + '      kinematic_viscosity: 1.0e-6\n')
    found = json.loads(slosh('modes', file, '--json').stdout)
    assert all(0 < mode['damping_ratio'] < 0.01 for mode in found['modes'])


def test_honey_is_refused(tmp_path):
    file = tmp_path / 'tank.yaml'
    file.write_text(GOOD + '      kinematic_viscosity: 0.5\n')
    refused(['modes', file], 'tank.kinematic_viscosity is 0.5 m^2/s', 'write the damping_ratio')
