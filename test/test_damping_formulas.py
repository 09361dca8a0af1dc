"""Published damping formulas: their own figures, and against the boundary layers of theory."""

from __future__ import annotations

import json

import numpy as np
import pytest
from test_bad_input import refused
from test_replay import slosh

from slosh_ros.engine import SloshConfig
from slosh_ros.errors import InputError
from slosh_ros.hydro import coefficients_of
from slosh_ros.hydro.damping import (
    mikishev_dorozhkin,
    ring_damping,
    stephens,
    stofan_sumner,
    viscous_damping,
)
from slosh_ros.tank import cylinder_z, rectangular

WATER = 1.0e-6  # [m^2/s]
GALILEO = np.sqrt(9.81 * 0.5**3)  # sqrt(g R^3) of R = 0.5 m [m^2/s]


def test_deep_cylinder_is_0_79_over_the_root_of_the_reynolds_number() -> None:
    """The short form of SP-106 and Dodge (2000) for h > R; the bottom has no part in it."""
    assert mikishev_dorozhkin(0.5, 5.0, WATER) == pytest.approx(
        0.79 * np.sqrt(WATER / GALILEO), rel=4e-3
    )


def test_formulas_by_hand() -> None:
    """Half a metre of radius, as deep as wide, water: with the printed constants."""
    root = np.sqrt(WATER / GALILEO)
    assert mikishev_dorozhkin(0.5, 0.5, WATER) == pytest.approx(
        4.98 * root * (1 + 0.318 / np.sinh(1.84)) / (2 * np.pi)
    )
    assert stephens(0.5, 0.5, WATER) == pytest.approx(
        5.23 * root * np.tanh(1.84) ** -0.25 / (2 * np.pi)
    )
    decrement = 0.131 * (1e4 * WATER / np.sqrt(9.81)) ** 0.359  # D = 1 m
    assert stofan_sumner(0.5, 0.5, WATER) == pytest.approx(decrement / (2 * np.pi))
    assert stofan_sumner(0.5, 0.25, WATER) == pytest.approx(2 * decrement / (2 * np.pi))
    assert stofan_sumner(0.5, 0.75, WATER) == pytest.approx(decrement * 1.23 / 0.73 / (2 * np.pi))
    # a ring of a tenth of the radius, a tenth of it deep, in a wave of a tenth: 4.7 %
    assert ring_damping(1.0, 0.1, np.array([0.1]), 0.1) == pytest.approx(
        2.83 * np.exp(-0.46) * 0.19**1.5 * np.sqrt(0.1)
    )


def test_sphere_formula_is_continuous_at_half_full() -> None:
    below, above = (stofan_sumner(1.0, h, WATER) for h in (1.0 - 1e-9, 1.0 + 1e-9))
    assert below == pytest.approx(above, rel=1e-6)


@pytest.mark.parametrize('fill', [0.5, 1.0, 2.0])
@pytest.mark.parametrize('formula', [mikishev_dorozhkin, stephens])
def test_measured_damping_is_above_theory_and_of_its_order(fill: float, formula) -> None:
    """
    Independent of each other: experiments, and our integral over the wall.

    Theory has a clean surface and no contact line: measured is 1.0 to 2 times as much, at every
    Reynolds number alike, R^-3/4 both.
    """
    ratios = []
    for radius in (0.15, 1.0, 5.0):
        c = coefficients_of(cylinder_z(radius, 4 * radius), fill * radius, 1000.0, 2)
        theory = c.wall_damping_ratio(WATER)[0]
        ratios.append(formula(radius, fill * radius, WATER) / theory)
    assert ratios == pytest.approx([ratios[0]] * 3, rel=1e-9)
    assert 1.0 < ratios[0] < 2.0


def test_two_measured_formulas_agree() -> None:
    """Within 7 % from as deep as wide on, though found apart from each other."""
    for fill in (1.0, 1.5, 3.0):
        one, other = (f(0.5, 0.5 * fill, WATER) for f in (mikishev_dorozhkin, stephens))
        assert one == pytest.approx(other, rel=0.07)


def test_higher_modes_in_the_proportion_of_their_boundary_layers() -> None:
    tank = cylinder_z(0.5, 1.5)
    c = coefficients_of(tank, 0.7, 1000.0, 6)
    damping = viscous_damping(tank, c, WATER)
    assert 'Mikishev' in damping.source
    assert damping.ratio[0] == pytest.approx(mikishev_dorozhkin(0.5, 0.7, WATER))
    theory = c.wall_damping_ratio(WATER)
    np.testing.assert_allclose(damping.ratio / damping.ratio[0], theory / theory[0])
    bare = viscous_damping(tank, c, WATER, 'boundary_layer')
    np.testing.assert_array_equal(bare.ratio, theory)


def test_rectangles_keep_their_boundary_layers() -> None:
    tank = rectangular(8.0, 2.0, 1.6)
    c = coefficients_of(tank, 0.8, 1000.0, 4)
    damping = viscous_damping(tank, c, WATER)
    assert 'Keulegan' in damping.source
    np.testing.assert_array_equal(damping.ratio, c.wall_damping_ratio(WATER))
    with pytest.raises(InputError, match='which is of a cylinder_z, not of a rectangular'):
        viscous_damping(tank, c, WATER, 'stephens')


CYLINDER = {
    'tank.shape': 'cylinder_z',
    'tank.radius': 1.0,
    'tank.height': 3.0,
    'tank.fill_depth': 1.5,
    'tank.modes': 4,
    'tank.kinematic_viscosity': WATER,
}
RINGS = {
    'tank.baffle_width': 0.1,
    'tank.baffle_heights': [-0.2, 0.05, -0.5],
    'tank.baffle_wave': 0.1,
}


def damping(**changes: object):
    given = CYLINDER | {f'tank.{name}': value for name, value in changes.items()}
    (tank,) = SloshConfig.from_parameters(given).tanks
    return tank.damping_of(tank.coefficients())


def test_rings_damp_the_lowest_modes_and_only_under_water() -> None:
    """One ring is dry, two hang 0.2 and 0.5 m deep; the pair of lowest modes feels them."""
    bare, ringed = (
        damping(**{k.removeprefix('tank.'): v for k, v in keys.items()}) for keys in ({}, RINGS)
    )
    added = 2.83 * (np.exp(-0.92) + np.exp(-2.3)) * 0.19**1.5 * np.sqrt(0.1)
    assert ringed.ratio[:2] - bare.ratio[:2] == pytest.approx([added] * 2)
    np.testing.assert_array_equal(ringed.ratio[2:], bare.ratio[2:])
    assert '2 of 3 ring baffles' in ringed.source


def test_the_users_number_wins() -> None:
    given = damping(damping_ratio=0.03, damping_formula='stephens')
    assert np.all(given.ratio == 0.03)
    assert given.source == 'damping_ratio of the configuration'


@pytest.mark.parametrize(
    ('changes', 'says'),
    [
        ({'baffle_width': 0.1}, 'tank.baffle_heights is missing; rings need all three'),
        ({'damping_formula': 'stofan_sumner'}, 'tank.damping_formula is stofan_sumner, which'),
        ({'kinematic_viscosity': 0.9}, 'tank.kinematic_viscosity is 0.9 m^2/s, for which thin'),
        (
            {'baffle_width': 1.5, 'baffle_heights': [0.0], 'baffle_wave': 0.1},
            'tank.baffle_width is 1.5 m; in a cylinder of 1 m radius',
        ),
    ],
)
def test_what_does_not_fit(changes: dict, says: str) -> None:
    with pytest.raises(InputError) as error:
        damping(**changes)
    assert says in str(error.value)


def test_source_is_printed_and_in_the_json(tmp_path) -> None:
    file = tmp_path / 'tank.yaml'
    file.write_text(
        '/**:\n  ros__parameters:\n    tank:\n      shape: cylinder_z\n      radius: 1.0\n'
        '      height: 3.0\n      fill_depth: 1.5\n      kinematic_viscosity: 1.0e-6\n'
    )
    found = json.loads(slosh('modes', file, '--json').stdout)
    assert found['damping'].startswith('Mikishev & Dorozhkin (1961), NASA SP-106')
    assert found['modes'][0]['damping_ratio'] == pytest.approx(mikishev_dorozhkin(1.0, 1.5, WATER))
    assert 'damping: Mikishev' in slosh('modes', file).stdout
    file.write_text(file.read_text() + '      baffle_width: 0.1\n')
    refused(['modes', file], 'tank.baffle_width is given', 'tank.baffle_heights is missing')
