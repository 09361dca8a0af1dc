"""`slosh simulate`: every scenario of the library, as table, CSV, picture and moving picture."""

from __future__ import annotations

import os
import pty
import re
import subprocess
import sys

import numpy as np
import pytest
from conftest import REPOSITORY
from test_bad_input import refused
from test_replay import slosh
from typer.testing import CliRunner

from slosh_ros.cli import app

pytestmark = pytest.mark.dear

SCENARIOS = REPOSITORY / 'config' / 'scenarios'
HEAD = 't,u,ax,ay,r,z_t,theta_t,phi_t,z_s,theta_s,phi_s,fx,fy,fz,mx,my,mz,elevation_max,ltr,beta_'


def rows(text: str) -> dict[str, list[float]]:
    """Read the numbers of a printed table, by name of the row; infinite where none is told."""
    found = {}
    for line in text.splitlines():
        match = re.match(r' *(.+?)  +((?:(?:-?\d+\.\d+|-) +)+)', line + ' ')
        if match:
            numbers = match[2].split()
            found[match[1]] = [np.inf if number == '-' else float(number) for number in numbers]
    return found


@pytest.mark.parametrize('scenario', sorted(SCENARIOS.glob('*.yaml')), ids=lambda p: p.stem)
def test_every_scenario_of_the_library_runs(tmp_path, scenario):
    out = tmp_path / 'history.csv'
    result = CliRunner().invoke(app, ['simulate', str(scenario), '--out', str(out)])
    assert result.exit_code == 0, result.output
    assert 'driving' not in result.output  # no progress where there is no terminal
    text = out.read_text()
    assert text.startswith(HEAD)
    assert text.partition('\n')[0].endswith('fz_1l,fz_1r,fz_2l,fz_2r,fz_3l,fz_3r,fz_4l,fz_4r')
    history = np.genfromtxt(out, delimiter=',', names=True)
    for name in history.dtype.names:
        assert np.isfinite(history[name]).all(), name
    told = rows(result.stdout)
    for k in range(1, 5):  # the table tells what the CSV holds
        lowest = min(history[f'fz_{k}l'].min(), history[f'fz_{k}r'].min()) / 1e3
        assert told[f'lowest wheel load, axle {k}'] == [pytest.approx(lowest, abs=1e-3)]
    turned = np.abs(history['ltr']).max()
    assert told.get('load transfer ratio, vehicle', [0.0]) == [pytest.approx(turned, abs=1e-3)]
    assert ('rolls over at' in result.stdout) == ('ASSUMED: mass centre' in scenario.read_text())


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


def test_table_4_exact_coefficients_and_solid_cargo_side_by_side(tmp_path):
    """Fig. 13: with liquid the pitch is 0.2097 rad, with a solid cargo 0.0410 rad."""
    picture = tmp_path / 'fig13.png'
    result = slosh('simulate', SCENARIOS / 'paper_brake_bump.yaml', '--compare', '--plot', picture)
    assert result.returncode == 0, result.stderr
    assert re.search(r'Table 4 +exact coefficients +solid cargo', result.stdout)
    told = rows(result.stdout)
    table_4, exact, solid = np.radians(told['semitrailer pitch'])
    assert table_4 == pytest.approx(0.2097, abs=6e-5)
    assert solid == pytest.approx(0.0410, abs=6e-5)
    assert exact == pytest.approx(table_4, rel=0.05)
    assert exact != pytest.approx(table_4, rel=0.01)
    assert told['wheel lifts off, axle 1'][0] == pytest.approx(1.23, abs=0.02)  # on the bump
    assert told['wheel lifts off, axle 4'][2] == np.inf  # not with a solid cargo
    assert picture.read_bytes().startswith(b'\x89PNG')


def test_liquid_turns_with_either_inertia_side_by_side():
    """The frozen liquid is harder to turn: it answers a lane change with more roll."""
    result = slosh('simulate', SCENARIOS / 'lane_change.yaml', '--compare')
    assert result.returncode == 0, result.stderr
    assert re.search(r'exact inertia +frozen inertia +solid cargo', result.stdout)
    told = rows(result.stdout)
    for name in ('semitrailer roll', 'load transfer ratio, vehicle'):
        exact, frozen, solid = told[name]
        assert frozen > 1.01 * exact > 1.2 * solid
    # VEHICLE 7.4: thresholds with liquid and frozen, on springs
    assert told['truck on its springs'] == [
        pytest.approx(x, rel=2e-3) for x in (0.357 * 9.81, 0.357, 0.472 * 9.81, 0.472)
    ]


def test_a_solid_cargo_is_told_alone(tmp_path):
    file = tmp_path / 'solid.yaml'
    text = (SCENARIOS / 'step_steer.yaml').read_text()
    file.write_text(text.replace('cargo: liquid ', 'cargo: solid '))
    result = slosh('simulate', file)
    assert result.returncode == 0, result.stderr
    assert 'liquid cargo' not in result.stdout
    assert 'wave height' not in result.stdout
    told = rows(result.stdout)
    assert told['truck on its springs'][1] == pytest.approx(0.472, abs=1e-3)
    compared = slosh('simulate', file, '--compare').stdout
    assert re.search(r'solid cargo +exact inertia +frozen inertia', compared)
    assert rows(compared)['semitrailer roll'][0] == told['semitrailer roll'][0]


def test_lost_contact_and_linear_theory_are_told_with_time_and_number():
    """The paper's own case: a wave of 2.4 m, axle 4 down to -38.7 kN on each side."""
    result = slosh('simulate', SCENARIOS / 'paper_brake_bump.yaml')
    said = ' '.join(result.stdout.split())
    assert 'contact is lost at 1.23 s: wheel 1l, 1r down to -5.2 kN, 1% of the time' in said
    assert 'contact is lost at 3.28 s: wheel 4l, 4r down to -38.7 kN, 43% of the time' in said
    assert 'linear theory is left at 2.09 s, 80% of the time: wave height over depth or' in said
    assert 'up to 2.2, limit 0.3' in said
    mild = slosh('simulate', SCENARIOS / 'roundabout.yaml').stdout
    assert 'contact' not in mild
    assert 'is left' not in mild


def test_progress_is_shown_on_a_terminal():
    ours, theirs = pty.openpty()
    command = [sys.executable, '-m', 'slosh_ros.cli', 'simulate', SCENARIOS / 'roundabout.yaml']
    environment = {**os.environ, 'TERM': 'xterm'}
    with subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=theirs, env=environment
    ) as run:
        os.close(theirs)
        shown = b''
        while True:
            try:
                piece = os.read(ours, 4096)
            except OSError:  # Linux: the other end is closed
                break
            if not piece:
                break
            shown += piece
    os.close(ours)
    assert run.returncode == 0
    assert b'driving: exact inertia' in shown
    assert b'100%' in shown


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
    file.write_text(
        (SCENARIOS / 'step_steer.yaml').read_text().replace('ratio: 0.5', 'ratio: 0.3')
    )
    refused(['simulate', file], 'slosh_node holds 16699.5 kg', 'truck carries 27832.5 kg')
    file.write_text((SCENARIOS / 'brake.yaml').read_text().partition('/**/slosh_node')[0])
    refused(['simulate', file], 'is not a parameter file for slosh_node')
