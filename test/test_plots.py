"""Pictures of simulated drives: what they hold, and where the bump is marked."""

from __future__ import annotations

from pathlib import Path

import pytest
from matplotlib.figure import Figure
from test_scenario_library import run

from slosh_ros.study.plots import mark_contacts, plot_histories


def texts(folder: Path, name: str) -> list[str]:
    """Draw a scenario with its variants, and read the words back."""
    cargoes = ('exact inertia', 'frozen inertia', 'solid cargo')
    if name.startswith('paper'):
        cargoes = ('Table 4', 'exact coefficients', 'solid cargo')
    path = folder / 'drive.svg'
    plot_histories({cargo: run(name, cargo) for cargo in cargoes}, name, path)
    lines = path.read_text().splitlines()
    return [line.strip()[5:-4] for line in lines if line.strip().startswith('<!-- ')]


def test_figure_13_and_its_bump(tmp_path: Path) -> None:
    words = texts(tmp_path, 'paper_brake_bump')
    assert 'semitrailer pitch,' in words
    assert 'nose down [deg]' in words
    assert 'beyond linear theory' in words
    assert not any('roll' in word or 'left' in word or 'lateral' in word for word in words)
    for cargo in ('Table 4', 'exact coefficients', 'solid cargo'):
        assert words.count(cargo) == 4  # pitch, force, moment, wave height
    assert {'1', '2', '3', '4'} <= set(words)  # the axles, over their bands
    assert 'axle 4 each side' in words


def test_steered_drive_shows_roll_and_load_transfer(tmp_path: Path) -> None:
    words = texts(tmp_path, 'lane_change')
    for wanted in ('semitrailer roll,', 'load transfer ratio', 'to the left [kN]', 'axle 3 right'):
        assert wanted in words
    assert not any('pitch' in word for word in words)
    assert not any('bump' in word for word in words)


@pytest.mark.parametrize('stop', [12.0, 3.0, 1.2])
def test_bump_is_marked_when_the_axles_are_on_it(stop: float) -> None:
    contacts = run('paper_brake_bump').contacts
    axis = Figure().add_subplot()
    mark_contacts(axis, contacts, stop)
    bands = [band.get_extents().transformed(axis.transData.inverted()) for band in axis.patches]
    met = [contact for contact in contacts if contact.entry < stop]
    assert len(bands) == len(met) > 0
    for band, contact in zip(bands, met, strict=True):
        assert band.x0 == pytest.approx(contact.entry, abs=1e-6)
        assert band.x1 == pytest.approx(min(contact.exit, stop), abs=1e-6)
