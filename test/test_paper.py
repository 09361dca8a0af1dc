"""`slosh paper`: its verdicts are decisions, its numbers those of theory, its report complete."""

from __future__ import annotations

import csv
import json
import re
import sys
from html.parser import HTMLParser
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from conftest import REPOSITORY
from scipy.sparse.linalg import spsolve
from test_bad_input import refused
from test_replay import slosh
from wetted import wetted

from slosh_ros.hydro import coefficients_of
from slosh_ros.study.paper import (
    ITEMS,
    Found,
    Verdict,
    as_json,
    cases,
    frequency,
    manoeuvres,
    truck,
    trust,
    write_report,
)
from slosh_ros.study.paper.item import Finding, Item, against, claim
from slosh_ros.study.paper.measured import judged, own_frequency
from slosh_ros.vehicle.scenario import Scenario

# A verdict that changes is a matter for people: was it the physics, or the paper? `slosh paper`
# writes the present ones into paper.json.
DECIDED = json.loads((REPOSITORY / 'test' / 'data' / 'paper_verdicts.json').read_text())


@pytest.mark.parametrize('item', ITEMS, ids=lambda item: item.name)
def test_verdicts_are_those_decided_on(item: Item) -> None:
    (found,) = as_json([Found(item, item.find())])['items']
    decided = DECIDED[item.name]
    if find_spec('capytaine') is None:  # then there are no boundary elements
        decided = {k: v for k, v in decided.items() if not k.endswith(('_elements', '_poles'))}
    assert {row['key']: row['verdict'] for row in found['rows']} == decided
    for row in found['rows']:
        assert row['verdict'] == Verdict.REPRODUCED.value or row['why'], row['key']


def test_figures_without_boundary_elements(monkeypatch: pytest.MonkeyPatch) -> None:
    """They say what is left out and how to get it, and draw the rest."""
    monkeypatch.setitem(sys.modules, 'capytaine', None)
    frequency.solver.cache_clear()
    for find in (frequency.figure_3, frequency.figure_5):
        found = find()
        assert any('left out' in text and 'pip install' in text for text in found.text)
        assert not [row for row in found.rows if row.key.endswith(('_elements', '_poles'))]
        assert len(found.drawings) == 1


def test_every_item_is_decided_on() -> None:
    assert list(DECIDED) == [item.name for item in ITEMS]


def test_the_readme_counts_the_verdicts() -> None:
    verdicts = [verdict for rows in DECIDED.values() for verdict in rows.values()]
    good, slips, bad = (
        verdicts.count(v.value) for v in (Verdict.REPRODUCED, Verdict.MISPRINT, Verdict.DIFFERENT)
    )
    told = f'Of {len(verdicts)} rows {good} are reproduced, {slips} are misprints, and {bad} are'
    assert told in (REPOSITORY / 'README.md').read_text(encoding='utf-8')


def test_what_to_expect_is_what_the_manual_tells() -> None:
    (grid,) = trust.expectations().grids
    text = (REPOSITORY / 'docs' / 'theory' / 'validity.md').read_text(encoding='utf-8')
    (table,) = re.findall(r'^## What to expect.*?\|---.*?\n(.*?)\n\n', text, re.DOTALL | re.M)
    told = [[cell.strip() for cell in row.strip('|').split('|')][2:] for row in table.splitlines()]
    for (use, rms, largest), row in zip(told, grid.rows, strict=True):
        ours = [float(text.rstrip('%')) for text in row[2:]]
        for number, text in zip(ours, (use, rms, largest), strict=True):
            plain = text.removesuffix(' %').replace('\u2212', '-')
            decimals = len(plain.partition('.')[2])
            assert number == pytest.approx(float(plain), abs=0.5001 * 10.0**-decimals), row


def test_braking_peaks_by_number_of_modes() -> None:
    """THEORY 8: 1.4657, 1.4734 and 1.4751 of m a for 1, 2 and 24 modes."""
    for modes, peak in ((1, 1.4657), (2, 1.4734), (24, 1.4751)):
        c, run = manoeuvres.braking_run(1.0, modes)
        assert np.abs(run.total[:, 0]).max() / (c.mass * 0.981) == pytest.approx(peak, abs=1e-4)


@pytest.mark.parametrize(('fill', 'factor'), [(1.0, 1.630), (1.5, 1.443)])
def test_amplification_of_a_ramp(fill: float, factor: float) -> None:
    """THEORY 7, P2: 1 + |sin x/x| with x = omega t_r/2."""
    assert manoeuvres.amplification(fill) == pytest.approx(factor, abs=1e-3)


def test_the_largest_forces_by_what_one_assumes() -> None:
    """VEHICLE 5.2, pit, flat and bump [kN]."""
    readings = truck.peak_readings()
    for name, peaks in (
        ('corrected, d_l = 0.65 m', (29.15, 23.21, 27.58)),
        ('d_l = 0.3 m', (24.33, 23.39, 25.98)),
        ('lambda_5 about O used with the motion of S (M6)', (30.93, 24.43, 32.74)),
        ('slosh damping 2 %', (27.88, 21.32, 25.93)),
        ('calibrated: four unknowns fitted to three numbers', (25.10, 21.20, 26.60)),
    ):
        assert readings[name] == pytest.approx(peaks, rel=1e-3), name


@pytest.mark.parametrize('road', ['pit', 'flat', 'bump'])
@pytest.mark.parametrize('manoeuvre', ['brake', 'accelerate 0.1 g', 'accelerate 0.2 g'])
def test_cases_of_section_5_are_those_of_the_library(manoeuvre: str, road: str) -> None:
    name = manoeuvre.replace(' ', '_').replace('0.', '0p').replace('_g', 'g')
    file = REPOSITORY / 'config' / 'scenarios' / f'paper_{name}_{road}.yaml'
    (height,) = (h for h, known in truck.ROADS.items() if known == road)
    one, other = Scenario.from_file(file), truck.scenario(manoeuvre, height)
    ours, theirs = (s.simulate((), 0.05).columns for s in (one, other))
    for column in ('t', 'ax', 'theta_s', 'fx', 'my'):
        np.testing.assert_array_equal(ours[column], theirs[column])


def test_damping_at_the_papers_infinite_frequency_is_small_for_a_small_epsilon_only() -> None:
    """Eq (36) at 50 rad/s, boundary elements against plane finite elements."""
    fem, helpers = pytest.importorskip('skfem'), pytest.importorskip('skfem.helpers')
    pytest.importorskip('capytaine')
    c, tank, depth = cases.table_1(), cases.TABLE_1_TANK, cases.TABLE_1_DEPTH
    place = np.linspace(-1.0, 1.0, 61)  # finer towards the ends
    x = 4.0 * np.sign(place) * (1.0 - (1.0 - np.abs(place)) ** 2)
    z = -depth * np.linspace(1.0, 0.0, 17) ** 1.5
    mesh, element = fem.MeshQuad.init_tensor(x, z), fem.ElementQuad2()
    inside, wall, surface = (
        fem.Basis(mesh, element, intorder=4),
        *(
            fem.FacetBasis(mesh, element, intorder=4, facets=mesh.facets_satisfying(where, True))
            for where in (lambda p: p[1] < -1e-9, lambda p: p[1] > -1e-9)
        ),
    )
    product = fem.BilinearForm(lambda u, v, _: u * v)
    stiff = fem.BilinearForm(lambda u, v, _: helpers.dot(helpers.grad(u), helpers.grad(v)))
    push = fem.LinearForm(lambda v, w: w.n[0] * v).assemble(wall)
    kappa = cases.INFINITE**2 / 9.81
    # both sides are walls as well, 2 m apart: damped over the area
    sides = fem.BilinearForm(lambda u, v, _: 2.0 / 2.0 * u * v).assemble(inside)
    epsilons = (0.0, 5e-4, 0.02)
    plane = []
    for epsilon in epsilons:
        matrix = stiff.assemble(inside) - kappa * product.assemble(surface)
        lossy = matrix - 1j * epsilon * kappa * (product.assemble(wall) + sides)
        plane.append((push @ spsolve(lossy.tocsc(), push.astype(complex))).real)
    ours = (1.0 + frequency.at_infinity(tank, depth, c, epsilons)[1][:, 0]) * cases.at_infinity(c)[
        0
    ]
    theirs = c.density * 2.0 * np.array(plane) - c.mass
    np.testing.assert_allclose(ours, theirs, rtol=5e-3)
    assert abs(theirs[1] / theirs[0] - 1.0) < 5e-3
    assert theirs[2] / theirs[0] > 1.08


@pytest.mark.parametrize('fill', [0.5, 1.0, 1.5])
def test_wall_ratio_of_a_cylinder_is_that_of_another_quadrature(fill: float) -> None:
    c = coefficients_of(cases.BRAKED_TANK, fill * 1.2, 1000.0, 6)
    wall, lid = wetted(cases.BRAKED_TANK, fill * 1.2)
    above, below = (face.weights @ c.potentials.modes(face.points) ** 2 for face in (wall, lid))
    ratio = frequency.cylinder_wall_ratio(c, cases.BRAKED_TANK, fill * 1.2)
    np.testing.assert_allclose(ratio, above / below, rtol=2e-4)


# --- judging -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ('ours', 'theirs', 'within', 'good'),
    [
        (3.6194, '3.62', None, True),
        (3.6149, '3.62', None, False),
        (-22047.49, '-22047', None, True),
        (-22047.6, '-22047', None, False),
        (101.0, '100', 0.02, True),
        (97.9, '100', 0.02, False),
        (-97.9, '-100', 0.02, False),
    ],
)
def test_a_number_is_reproduced_if_it_rounds_to_the_printed_one(
    ours: float, theirs: str, within: float | None, good: bool
) -> None:
    row = against('k', 'what', ours, theirs, 'kg', within=within, otherwise=Verdict.MISPRINT)
    assert row.verdict is (Verdict.REPRODUCED if good else Verdict.MISPRINT)
    assert row.difference == pytest.approx((ours - float(theirs)) / abs(float(theirs)))


def test_a_claim_that_does_not_hold_is_not_reproduced() -> None:
    good, bad = (claim('k', '', '', '', holds, verdict=Verdict.OPEN) for holds in (True, False))
    assert (good.verdict, bad.verdict) == (Verdict.OPEN, Verdict.DIFFERENT)


def test_disagreement_with_data_is_excused_only_where_the_engine_warned() -> None:
    verdicts = [
        judged('k', '', '', '', '', difference, 0.05, use).verdict
        for difference, use in ((-0.04, 2.0), (-0.06, 2.0), (-0.06, 0.9))
    ]
    assert verdicts == [Verdict.REPRODUCED, Verdict.BEYOND, Verdict.DIFFERENT]


def test_the_free_wave_beside_the_forced_one_is_found() -> None:
    time = np.arange(0.0, 10.0, 0.05)
    wave = 0.1 * np.sin(2 * np.pi / 1.3 * time) - 0.08 * np.cos(3.7 * time + 0.3) + 0.01
    assert own_frequency(time, wave) == pytest.approx(3.7, abs=1e-3)


# --- report ------------------------------------------------------------------------------------


class _Page(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.sources: list[str] = []
        self.links: list[str] = []
        self.names: set[str] = set()
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        given = dict(attributes)
        self.sources += [given['src'] or ''] if 'src' in given else []
        self.links += [given['href'] or ''] if 'href' in given else []
        self.names |= {given['id'] or ''} if 'id' in given else set()
        if tag not in ('meta', 'img'):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.fixture(scope='module')
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp('paper') / 'report'
    chosen = ('table3', 'fig12', 'fig13')
    write_report([Found(item, item.find()) for item in ITEMS if item.name in chosen], out)
    return out


def test_the_page_is_whole_and_holds_its_pictures(report: Path) -> None:
    page = _Page()
    page.feed((report / 'index.html').read_text(encoding='utf-8'))
    assert page.open == []
    assert len(page.sources) == 2
    assert all(source.startswith('data:image/png;base64,iVBORw0KGgo') for source in page.sources)
    for link in page.links:
        if link.startswith('#'):
            assert link[1:] in page.names
        elif not link.startswith('https://'):
            assert (report / link).is_file()


def test_markdown_tells_the_same(report: Path) -> None:
    text = (report / 'report.md').read_text(encoding='utf-8')
    places = set(re.findall(r'<a id="([^"]+)">', text))
    assert 'table3.l_w13' in places
    assert set(re.findall(r'\]\(#([^)]+)\)', text)) <= places
    for link in re.findall(r'\]\(([^)#]+)\)', text):
        assert link.startswith('https://') or (report / link).is_file()
    rows = json.loads((report / 'paper.json').read_text(encoding='utf-8'))['items'][0]['rows']
    for row in rows:
        assert f'| {row["ours"]} | {row["theirs"]} |' in text
        assert row['what'] in (report / 'index.html').read_text(encoding='utf-8')


def test_numbers_of_a_figure_are_in_its_csv(report: Path) -> None:
    with (report / 'figures' / 'fig13.csv').open(encoding='utf-8') as file:
        head, *rows = csv.reader(file)
    assert head == ['time [s]', 'pitch [deg], liquid', 'pitch [deg], solid']
    pitch = np.array(rows, dtype=float)[:, 1]
    history = truck.history('brake', 0.2)
    np.testing.assert_allclose(pitch, np.degrees(history.q[:, 4]), rtol=1e-7, atol=1e-9)
    assert (report / 'figures' / 'fig13.png').read_bytes().startswith(b'\x89PNG')


def test_verdicts_are_counted(report: Path) -> None:
    data = json.loads((report / 'paper.json').read_text(encoding='utf-8'))
    verdicts = [row['verdict'] for item in data['items'] for row in item['rows']]
    assert data['counts'] == {v.value: verdicts.count(v.value) for v in Verdict}


def test_odd_characters_stay_what_they_are(tmp_path: Path) -> None:
    row = claim('k', 'a < b & c | d', '<b>', '"x"', True, why='it is', head=True)
    item = Item('one', 'A & B', lambda: Finding([row]))
    write_report([Found(item, item.find())], tmp_path)
    page = (tmp_path / 'index.html').read_text(encoding='utf-8')
    assert 'a &lt; b &amp; c | d' in page
    assert '<b>' not in page
    assert 'a < b & c \\| d' in (tmp_path / 'report.md').read_text(encoding='utf-8')


def test_one_item_by_command(tmp_path: Path) -> None:
    result = slosh('paper', '--only', 'table3', '--out', tmp_path / 'new' / 'folder')
    assert result.returncode == 0, result.stderr
    assert 'index.html' in result.stdout
    data = json.loads((tmp_path / 'new' / 'folder' / 'paper.json').read_text(encoding='utf-8'))
    assert [item['name'] for item in data['items']] == ['table3']


def test_bad_input_of_the_command(tmp_path: Path) -> None:
    refused(['paper', '--only', 'fig99', '--out', tmp_path], 'no item fig99; choose of table1')
    file = tmp_path / 'file'
    file.write_text('')
    refused(['paper', '--only', 'table3', '--out', file / 'x'], 'cannot be written')
