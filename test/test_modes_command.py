"""`slosh modes` and `slosh check`: table, JSON and picture."""

from __future__ import annotations

import json
from importlib.util import find_spec

import numpy as np
import pytest
from conftest import REPOSITORY
from test_replay import slosh

CONFIG = REPOSITORY / 'config' / 'rectangular_tank.yaml'


def test_json_has_the_names_of_the_contract_and_table_1():
    result = slosh('modes', CONFIG, '--json')
    assert result.returncode == 0, result.stderr
    found = json.loads(result.stdout)
    assert list(found) == [
        'tank', 'route', 'mass', 'volume', 'surface_height', 'surface_centre', 'centroid',
        'inertia_frozen', 'inertia_stokes_joukowski', 'error', 'damping', 'damping_holds',
        'damping_beyond', 'modes',
    ]  # fmt: skip
    assert found['mass'] == pytest.approx(10880.0)
    assert found['volume'] == pytest.approx(12.8)
    assert found['surface_height'] == pytest.approx(0.0)
    assert found['centroid'] == pytest.approx([0.0, 0.0, -0.4])
    assert np.shape(found['inertia_stokes_joukowski']) == (3, 3)
    first = found['modes'][0]
    assert list(first) == ['name', 'omega', 'mu', 'lambda', 'damping_ratio']
    assert first['omega'] == pytest.approx(1.082569, abs=5e-7)
    assert first['lambda'] == pytest.approx([-22047.49, 0, 0, 0, 17494.34, 0], abs=5e-3)
    assert [m['omega'] for m in found['modes']] == sorted(m['omega'] for m in found['modes'])


def test_table_shows_units_and_every_mode():
    result = slosh('modes', CONFIG)
    assert result.returncode == 0, result.stderr
    for text in (
        '[rad/s]',
        '[kg m]',
        'lambda_5',
        '1.08257',
        'x1y1',
        '17494.3',
        'Stokes-Joukowski',
    ):
        assert text in result.stdout
    assert '…' not in result.stdout  # nothing is cut off


def test_large_numbers_are_not_cut_off(tmp_path):
    file = tmp_path / 'hold.yaml'
    file.write_text(
        '/**:\n  ros__parameters:\n    tank:\n      shape: rectangular\n      length: 190.0\n'
        '      width: 180.0\n      height: 170.0\n      fill_ratio: 0.5\n'
    )
    result = slosh('modes', file)
    assert result.returncode == 0, result.stderr
    assert '…' not in result.stdout


def test_fill_is_taken_from_the_command_line():
    depths = []
    for fill in (0.25, 0.5):
        found = json.loads(slosh('modes', CONFIG, '--json', '--fill', fill).stdout)
        assert found['mass'] == pytest.approx(fill * 8 * 2 * 1.6 * 850)
        depths.append(found['modes'][0]['omega'])
    assert depths[0] < depths[1]


@pytest.mark.parametrize('name', ['rectangular_tank', 'half_full_tanker', 'modified_oval'])
def test_picture_of_the_surface_shapes(tmp_path, name):
    picture = tmp_path / 'modes.png'
    result = slosh('modes', REPOSITORY / 'config' / f'{name}.yaml', '--plot', picture)
    assert result.returncode == 0, result.stderr
    assert picture.read_bytes().startswith(b'\x89PNG')
    assert picture.stat().st_size > 30_000


@pytest.mark.dear
def test_every_shipped_configuration_is_good():
    files = sorted((REPOSITORY / 'config').rglob('*.yaml'))
    if find_spec('trimesh') is None:  # an extra
        files = [file for file in files if 'mesh_file' not in file.read_text()]
    result = slosh('check', *files)
    assert result.returncode == 0, result.stderr
    assert result.stdout.count(': good: ') == len(files)


def test_upright_cylinder_sloshes_alike_in_all_directions(tmp_path):
    """First mode: omega^2 = g e/R tanh(e h/R) with e = 1.8412, twice, and no moment about z."""
    file = tmp_path / 'tank.yaml'
    file.write_text(
        '/**:\n  ros__parameters:\n    tank:\n      shape: cylinder_z\n      radius: 1.2\n'
        '      height: 3.0\n      fill_depth: 1.5\n      modes: 4\n'
    )
    modes = json.loads(slosh('modes', file, '--json').stdout)['modes']
    e = 1.841184
    expected = np.sqrt(9.81 * e / 1.2 * np.tanh(e * 1.5 / 1.2))
    assert [m['name'] for m in modes] == ['x1', 'y1', 'x3', 'y3']
    assert [modes[0]['omega'], modes[1]['omega']] == pytest.approx([expected] * 2, rel=1e-6)
    assert modes[0]['lambda'][0] == pytest.approx(modes[1]['lambda'][1])
    assert all(m['lambda'][5] == 0.0 for m in modes)
