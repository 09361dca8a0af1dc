"""Fill tables on the disk: the same bits, never an old one, and no trouble with damaged files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slosh_ros.engine.config import SloshConfig
from slosh_ros.engine.fill import LiveFill
from slosh_ros.engine.fill import _table as table_of_process
from slosh_ros.hydro import table_cache
from slosh_ros.hydro.fill_table import FillTable
from slosh_ros.hydro.table_cache import known_table
from slosh_ros.tank import sphere

BALL, NAMES = sphere(0.7), ('x1', 'y1')
POINTS = np.array([[0.0, 0.0, -0.6], [0.1, 0.2, 0.3]])


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    return tmp_path / 'slosh_ros'


@pytest.fixture
def solutions(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Places that are solved for."""
    solved: list[float] = []
    solve = FillTable._solved

    def counted(self: FillTable, angle: float) -> object:
        solved.append(angle)
        return solve(self, angle)

    monkeypatch.setattr(FillTable, '_solved', counted)
    return solved


def assert_same_bits(a: FillTable, b: FillTable) -> None:
    assert (a.error, a.solutions) == (b.error, b.solutions)
    for fill in (0.0, 0.004, 0.01, 0.2, 0.5, 0.77, 0.99, 0.996, 1.0):
        c, d = (table.at(fill, 850.0) for table in (a, b))
        for part in ('omega', 'mu', 'coupling', 'inertia_stokes_joukowski', 'wall_friction'):
            assert np.array_equal(getattr(c, part), getattr(d, part))
        assert np.array_equal(c.surface_shapes, d.surface_shapes)
        about = POINTS - c.liquid.surface_centre
        if c.names:
            assert c.potentials is not None
            assert d.potentials is not None
            assert np.array_equal(c.potentials.modes(about), d.potentials.modes(about))


def test_a_table_from_the_disk_is_the_one_that_was_built(
    folder: Path, solutions: list[float]
) -> None:
    built = known_table(BALL, NAMES, POINTS)
    assert len(solutions) == built.solutions
    (file,) = folder.iterdir()  # and nothing half-written
    read = known_table(BALL, NAMES, POINTS)
    assert len(solutions) == built.solutions
    assert_same_bits(built, read)
    assert_same_bits(read, FillTable(BALL, NAMES, POINTS).build())
    whole = file.read_bytes()
    np.savez(folder / 'part.npz', **{k: v for k, v in np.load(file).items() if k != 'values'})
    part = (folder / 'part.npz').read_bytes()
    for damage in (b'', b'no table', whole[:-700], _flipped(whole), part, b'\x93NUMPY\x01'):
        file.write_bytes(damage)
        assert not table_cache._read(file, FillTable(BALL, NAMES, POINTS))
    before = len(solutions)
    assert_same_bits(built, known_table(BALL, NAMES, POINTS))
    assert len(solutions) == before + built.solutions
    assert file.read_bytes() == whole  # mended


def _flipped(whole: bytes) -> bytes:
    """One bit of a number in the middle."""
    middle = len(whole) // 2
    return whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :]


def test_another_tank_mode_point_or_source_has_another_table(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def key(tank: object = BALL, names: object = NAMES, points: object = POINTS) -> str:
        return table_cache._key((tank, names), points)  # type: ignore[arg-type]

    keys = [key(), key(replace(BALL, radius=np.nextafter(0.7, 1.0))), key(names=('x1',))]
    keys += [key(names=('x1y1',)), key(points=None), key(points=POINTS * [1.0, 1.0, -1.0])]
    monkeypatch.setattr(table_cache, '_source', lambda: 'of another version')
    keys.append(key())
    assert len(set(keys)) == len(keys)


def test_the_digest_is_of_the_source_that_computes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    digests = [table_cache._source.__wrapped__()]
    for room in ('hydro', 'tank'):
        (tmp_path / room).mkdir()
    (tmp_path / 'constants.py').write_text('GRAVITY = 9.81\n')
    (tmp_path / 'hydro' / 'solver.py').write_text('a = 1\n')
    monkeypatch.setattr(table_cache, '__file__', str(tmp_path / 'hydro' / 'table_cache.py'))
    digests.append(table_cache._source.__wrapped__())
    for path in (tmp_path / 'hydro' / 'solver.py', tmp_path / 'constants.py'):
        path.write_text(path.read_text() + '# \n')
        digests.append(table_cache._source.__wrapped__())
    (tmp_path / 'tank' / 'shape.py').write_text('')
    digests.append(table_cache._source.__wrapped__())
    assert len(set(digests)) == len(digests)


def test_where_nothing_can_be_written_nothing_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, solutions: list[float]
) -> None:
    (tmp_path / 'file').write_text('')
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'file'))
    for k in (1, 2):
        table = known_table(BALL, NAMES)
        assert len(solutions) == k * table.solutions
    assert [path.name for path in tmp_path.iterdir()] == ['file']


def test_the_last_tables_are_kept(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(table_cache, '_MOST', 3)
    folder.mkdir()
    for k in range(6):
        (folder / f'fill-{k}.npz').write_text('')
    (folder / 'letter.txt').write_text('not ours')
    known_table(BALL, NAMES)
    assert len(list(folder.glob('fill-*.npz'))) == 3
    assert (folder / 'letter.txt').exists()


def test_the_second_engine_has_its_table_at_once_and_from_elsewhere_the_same(
    folder: Path, solutions: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    config = SloshConfig.from_parameters(
        {
            'tank.shape': 'sphere', 'tank.radius': 0.61, 'tank.fill_ratio': 0.5, 'tank.modes': 2,
            'tank.pressure.wall': [0.0, 0.0, -0.5],
        }
    )  # fmt: skip
    (tank,) = config.tanks
    solved = []
    for _ in range(2):  # as in two processes
        table_of_process.cache_clear()
        fill = LiveFill(tank, tank.coefficients())
        fill.prepare()
        assert fill.ready
        solved.append(len(solutions))
    assert 0 < solved[0] == solved[1]
    assert fill.error < 1e-4
    (file,) = folder.iterdir()
    monkeypatch.setenv('XDG_CACHE_HOME', str(file))  # nothing comes by the disk
    elsewhere = LiveFill(tank, tank.coefficients())
    elsewhere.prepare(elsewhere=True)
    assert len(solutions) == solved[1]
    assert elsewhere.error == fill.error
    for ratio in (0.004, 0.3, 0.5, 0.9, 0.995, 1.0):
        (a, share), (b, other_share) = fill.at(ratio), elsewhere.at(ratio)
        assert (a.names, share) == (b.names, other_share)
        for part in ('omega', 'mu', 'coupling', 'inertia_stokes_joukowski', 'surface_shapes'):
            assert np.array_equal(getattr(a, part), getattr(b, part))
        points = tank.points_of_pressure(a.liquid)
        assert a.potentials is not None
        assert b.potentials is not None
        assert np.array_equal(a.potentials.modes(points), b.potentials.modes(points))
        assert np.array_equal(
            a.potentials.stokes_joukowski(points), b.potentials.stokes_joukowski(points)
        )
