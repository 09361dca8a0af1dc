"""`slosh simulate`: every scenario of the library, as table, CSV and picture."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import REPOSITORY
from test_bad_input import refused
from test_replay import slosh

SCENARIOS = REPOSITORY / 'config' / 'scenarios'
HEAD = 't,u,ax,ay,r,z_t,theta_t,phi_t,z_s,theta_s,phi_s,fx,fy,fz,mx,my,mz,elevation_max,ltr,beta_'


@pytest.mark.parametrize('scenario', sorted(SCENARIOS.glob('*.yaml')), ids=lambda p: p.stem)
def test_every_scenario_of_the_library_runs(tmp_path, scenario):
    out = tmp_path / 'history.csv'
    result = slosh('simulate', scenario, '--out', out)
    assert result.returncode == 0, result.stderr
    assert 'load transfer ratio' in result.stdout
    text = out.read_text()
    assert text.startswith(HEAD)
    assert text.partition('\n')[0].endswith('fz_1l,fz_1r,fz_2l,fz_2r,fz_3l,fz_3r,fz_4l,fz_4r')
    history = np.genfromtxt(out, delimiter=',', names=True)
    for name in set(history.dtype.names) - {'elevation_max'}:  # Table 4 tells no mode shape
        assert np.isfinite(history[name]).all(), name


def test_section_5_peaks_with_the_coefficients_of_table_4(tmp_path):
    """VEHICLE 5.2, corrected truck: 29.15, 23.21, 27.58 kN for h = -0.2, 0, 0.2 m."""
    peaks = []
    for name in ('pit', 'flat', 'bump'):
        out = tmp_path / f'{name}.csv'
        assert (
            slosh('simulate', SCENARIOS / f'paper_brake_{name}.yaml', '--out', out).returncode == 0
        )
        history = np.genfromtxt(out, delimiter=',', names=True)
        peaks.append(history['fx'][history['t'] <= 11.2].max() / 1e3)
    np.testing.assert_allclose(peaks, [29.15, 23.21, 27.58], rtol=1e-3)


@pytest.mark.parametrize('name', ['brake_bump', 'lane_change'])
def test_picture_of_a_scenario(tmp_path, name):
    picture = tmp_path / 'history.png'
    result = slosh('simulate', SCENARIOS / f'{name}.yaml', '--plot', picture)
    assert result.returncode == 0, result.stderr
    assert picture.read_bytes().startswith(b'\x89PNG')


def test_bad_scenarios(tmp_path):
    refused(['simulate', tmp_path / 'no.yaml'], 'no.yaml: cannot be read')
    refused(['simulate', SCENARIOS / 'brake.yaml', '--out', tmp_path / 'x.xls'], 'must be .csv')
    file = tmp_path / 'odd.yaml'
    text = (SCENARIOS / 'brake.yaml').read_text()
    file.write_text(text.replace('speed: 10.0', 'speed: ten'))
    refused(['simulate', file], f'{file}: speed has the text')
