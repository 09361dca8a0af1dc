"""Modes of tanks of any shape over the fill: followed by likeness, tabulated, changed live."""

from __future__ import annotations

import pickle
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest
from conftest import REPOSITORY
from drives import START

from slosh_ros.engine import MotionSample, SloshConfig, SloshEngine
from slosh_ros.engine import fill as engine_fill
from slosh_ros.errors import InputError
from slosh_ros.hydro import coefficients_of, table_cache, volume, volume_sweep
from slosh_ros.hydro.corner_levels import corner_levels
from slosh_ros.hydro.fill_table import FillTable, Start
from slosh_ros.hydro.volume import VolumeResolution, volume_coefficients
from slosh_ros.hydro.volume_modes import symmetries
from slosh_ros.hydro.volume_surface import FreeSurface
from slosh_ros.hydro.volume_sweep import VolumeSweep, _ranks
from slosh_ros.tank import Capsule, MeshTank, cylinder_x, mesh, rectangular, section_x
from slosh_ros.tank.surface import LiquidSurface

pytestmark = pytest.mark.dear

LENGTH, WIDTH, HEIGHT = 3.0, 1.2, 1.0
BOX = rectangular(LENGTH, WIDTH, HEIGHT)
FEW = VolumeResolution(cells=1.4, degree=3, triangles=800, grids=0)
FILLS = (0.02, 0.17, 0.55, 0.9)
HEXAGON = [-0.5, 0.0, 0.5, 0.0, 0.9, 0.5, 0.5, 1.0, -0.5, 1.0, -0.9, 0.5]


def box_mesh() -> MeshTank:
    """Twelve triangles."""
    corners = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]) / 2.0
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [[a, b, c] for a, b, c, _ in quads] + [[a, c, d] for a, _, c, d in quads]
    return MeshTank(corners * [LENGTH, WIDTH, HEIGHT], np.array(faces))


def prism(outline: list[float], length: float) -> MeshTank:
    """Two triangles on each side of a convex outline, and fans at both ends."""
    ring = np.array(outline).reshape(-1, 2)
    ring[:, 1] -= np.ptp(ring[:, 1]) / 2.0
    n = len(ring)
    front, rear = (np.insert(ring, 0, x, axis=1) for x in (length / 2.0, -length / 2.0))
    sides = [[i, j, n + j] for i, j in zip(range(n), [*range(1, n), 0], strict=True)]
    sides += [[i, n + j, n + i] for i, j in zip(range(n), [*range(1, n), 0], strict=True)]
    ends = [[n, n + i, n + i + 1] for i in range(1, n - 1)]
    ends += [[0, i + 1, i] for i in range(1, n - 1)]
    return MeshTank(np.concatenate([rear, front]), np.array(sides + ends))


@cache
def heads() -> Capsule:
    tank = cylinder_x(1.2, 4.0, 0.6)
    assert isinstance(tank, Capsule)
    return tank


@cache
def box_table() -> FillTable:
    """From x1 and y1, with the lowest mode of yaw."""
    tank = box_mesh()
    sweep = VolumeSweep(tank, Start(2, tank.depth(0.3)), FEW)
    return FillTable(tank, (), None, 1e-4, sweep.at).build()


@cache
def hexagon_table() -> FillTable:
    tank = prism(HEXAGON, 1.0)
    sweep = VolumeSweep(tank, Start(1, tank.depth(0.3), all_kinds=False), FEW)
    return FillTable(tank, (), None, 5e-4, sweep.at).build()


@cache
def heads_sweep() -> VolumeSweep:
    tank = heads()
    return VolumeSweep(tank, Start(5, tank.depth(0.5), all_kinds=False), FEW)


@pytest.mark.parametrize('fill', FILLS)
def test_table_of_a_mesh_agrees_with_the_closed_form_of_its_shape(fill: float) -> None:
    """Frequencies, scale, moved masses and inertia, over fills that were not solved for."""
    table = box_table()
    found = table.at(fill, 850.0)
    exact = coefficients_of(BOX, BOX.depth(fill), 850.0, 12)
    order = [exact.names.index(name) for name in found.names]
    assert found.names[:2] == ('x1', 'y1')
    assert set(found.names) == {'x1', 'y1', 'x1y1'}
    assert found.omega == pytest.approx(exact.omega[order], rel=3e-4)
    assert found.mass_moved == pytest.approx(
        exact.mass_moved[order], rel=1e-3, abs=1e-5 * found.mass
    )
    assert found.mu == pytest.approx(exact.mu[order], rel=3e-3)
    assert np.abs(found.coupling) == pytest.approx(
        np.abs(exact.coupling[order]), rel=3e-3, abs=1e-3 * np.abs(exact.coupling).max()
    )
    assert found.inertia_stokes_joukowski == pytest.approx(
        exact.inertia_stokes_joukowski, rel=1e-3, abs=1e-3 * exact.inertia_stokes_joukowski.max()
    )


def test_table_states_what_it_misses_solutions_by() -> None:
    """Against solutions at other fills by the same grids."""
    table = box_table()
    assert table.error <= 1e-4
    assert table.solutions <= 24
    sent = pickle.loads(pickle.dumps(table))  # by the process that has built it
    assert np.array_equal(sent.at(0.4, 850.0).coupling, table.at(0.4, 850.0).coupling)
    tank = box_mesh()
    sweep = VolumeSweep(tank, Start(2, tank.depth(0.3)), FEW)
    for fill in (0.06, 0.8):
        found, solved = table.at(fill, 1.0), sweep.at(tank.depth(fill))
        assert found.omega == pytest.approx(solved.omega, rel=1e-4)
        moved = solved.mass_moved
        assert found.mass_moved == pytest.approx(moved, rel=0.0, abs=1e-4 * moved.max())


def test_levels_of_corners_of_a_mesh_are_those_of_its_section() -> None:
    found, section = (
        [corner.depth for corner in corner_levels(tank)]
        for tank in (prism(HEXAGON, 2.0), section_x(HEXAGON, 2.0))
    )
    assert found == pytest.approx(section)
    pytest.importorskip('trimesh')
    tank = mesh(str(REPOSITORY / 'config' / 'meshes' / 'oval_tanker.stl'), 0.001)
    rows = 0.15 + 0.85 * (1.0 - np.cos(np.pi * np.arange(33) / 32.0))  # above the sump
    depths = np.array([corner.depth for corner in corner_levels(tank)])
    apart = np.abs(depths[:, np.newaxis] - rows).min(axis=1)
    assert len(apart) >= 25
    assert apart.max() < 2e-3


@pytest.mark.parametrize('fill', [0.3, 0.46, 0.54, 0.8])
def test_table_of_a_mesh_with_corners(fill: float) -> None:
    """Against the other route: at half full frequencies have a kink."""
    found, shape = hexagon_table().at(fill, 850.0), section_x(HEXAGON, 1.0)
    exact = coefficients_of(shape, shape.depth(fill), 850.0, found.names)
    assert found.omega == pytest.approx(exact.omega, rel=2e-4)
    assert found.mass_moved == pytest.approx(exact.mass_moved, rel=2e-3)


def test_modes_keep_their_names_where_their_frequencies_cross() -> None:
    """With heads x3 is faster than y1 at half full, and slower when it is all but full."""
    half, full = (heads_sweep().at(heads().depth(fill)) for fill in (0.5, 0.98))
    assert half.names == full.names
    x1, x3, y1 = map(half.names.index, ('x1', 'x3', 'y1'))
    assert half.omega[x3] > half.omega[y1]
    assert full.omega[x3] < full.omega[y1]
    for c in (half, full):
        surge, sway = np.abs(c.coupling[:, 0]), np.abs(c.coupling[:, 1])
        assert sway[[x1, x3]].max() < 1e-9 * sway[y1]
        assert surge[y1] < 1e-9 * surge[x1]
    alone = volume_coefficients(heads(), heads().depth(0.98), 1.0, 2, FEW)
    assert alone.names == ('x1', 'x3')
    assert full.omega[[x1, x3]] == pytest.approx(alone.omega, rel=1e-3)


def test_modes_that_come_close_turn_into_each_other() -> None:
    """Those of one parity do not cross in a tank with heads, however far apart the fills are."""
    sweep = VolumeSweep(heads(), Start(7, heads().depth(0.6), all_kinds=False), FEW)
    ranks = [_ranks(sweep.at(heads().depth(fill))).tolist() for fill in (0.6, 0.92)]
    assert ranks == [[0, 0, 0, 1, 1, 1, 2]] * 2


def test_signs_go_on_from_fill_to_fill() -> None:
    """At the start it is that of the solver; then no mode turns over."""
    fills = (0.98, 0.75, 0.5, 0.25)
    rows = [heads_sweep().at(heads().depth(fill)).coupling[[0, 1], [0, 1]] for fill in fills]
    assert np.all(np.array(rows) < 0.0)


def test_a_fill_that_is_changed_live_goes_on_without_a_jump(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The wrench of a settled liquid: from solutions to the table, and up to full."""
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    monkeypatch.setattr(table_cache, 'SWEPT_TOLERANCE', 2e-2)
    monkeypatch.setattr(volume_sweep, 'VolumeSweep', partial(VolumeSweep, resolution=FEW))
    monkeypatch.setattr(
        volume, 'volume_coefficients', partial(volume_coefficients, resolution=FEW)
    )
    monkeypatch.setattr(engine_fill, 'apart', engine_fill._here)
    monkeypatch.setattr(engine_fill, '_sweep', engine_fill._sweep.__wrapped__)
    config = SloshConfig.from_parameters(
        {
            'tank.shape': 'cylinder_x', 'tank.length': 4.0, 'tank.radius': 1.2,
            'tank.head_depth': 0.6, 'tank.fill_ratio': 0.6, 'tank.modes': 2,
            'tank.damping_ratio': 0.3,
        }
    )  # fmt: skip
    engine = SloshEngine(config)
    force, count = [0.3, 0.2, 9.81], 0

    def after(seconds: float) -> np.ndarray:
        nonlocal count
        for _ in range(round(seconds / 0.05)):
            count += 1
            stamp = START + count * 50_000_000
            _, loads = engine.feed(MotionSample.from_imu(stamp, force, [0.0] * 3))
        assert loads is not None
        return np.asarray(loads.total)

    after(20.0)
    assert not engine.fill_known('tank', 0.62)
    engine.solve_fill('tank', 0.62)  # as long as there is no table
    assert engine.fill_known('tank', 0.62)
    assert not engine.fill_known('tank', 0.63)
    assert engine.set_fill('tank', 0.62)
    assert not engine.set_fill('tank', 0.62)
    before = after(20.0)
    alone = engine.tanks[0].coefficients
    assert alone.route == 'volume'
    with pytest.raises(InputError, match=r'at a fill of 0\.002 is not solved for'):
        engine.solve_fill('tank', 0.002)
    engine.prepare_fills()
    books = engine.books['tank'].received
    assert engine.set_fill('tank', 0.62)  # as it is tabulated
    assert np.abs(after(0.05) - before).max() < 5e-3 * np.abs(before).max()
    assert engine.tanks[0].coefficients.route == 'fill table'
    assert engine.tanks[0].coefficients.names[:2] == alone.names
    assert engine.books['tank'].received == pytest.approx(books, abs=1e-6)
    assert not engine.set_fill('tank', 0.62)
    assert len(list((tmp_path / 'slosh_ros').glob('fill-*.npz'))) == 1
    assert {'x1', 'y1'} <= set(engine.tanks[0].coefficients.names)
    last = after(0.05)
    for fill in np.linspace(0.62, 0.995, 80)[1:].tolist():
        engine.set_fill('tank', fill)
        now = after(0.1)
        assert np.abs(now - last).max() < 0.02 * np.abs(last).max()
        last = now
        assert now[2] == pytest.approx(-1000.0 * heads().volume * fill * 9.81, rel=1e-6)
    engine.set_fill('tank', 1.0)
    assert after(0.1)[2] == pytest.approx(-1000.0 * heads().volume * 9.81, rel=1e-4)


def test_another_density_changes_what_has_a_mass() -> None:
    light, heavy = (coefficients_of(BOX, 0.4, density, 3) for density in (850.0, 1700.0))
    found = light.weighing(1700.0)
    for part in ('omega', 'mu', 'coupling', 'inertia_stokes_joukowski', 'mass'):
        assert getattr(found, part) == pytest.approx(getattr(heavy, part), rel=1e-14)


def test_walls_between_pieces_of_a_surface_are_told() -> None:
    """Two squares one before the other, and side by side."""
    square = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    piece = square[[[0, 1, 2], [0, 2, 3]]]
    ahead, beside = (np.concatenate([piece - away, piece]) for away in np.diag([1.3, 1.3, 0])[:2])
    assert FreeSurface.of(ahead).gaps == ()
    ((left, right),) = FreeSurface.of(beside).gaps
    assert (left, right) == pytest.approx((-0.3, 0.0))


def test_the_symmetry_of_a_mesh_is_seen_through_its_triangles() -> None:
    """The shipped tanker is symmetric, whatever corners its free surface puts on the wall."""
    pytest.importorskip('trimesh')
    tank = mesh(str(REPOSITORY / 'config' / 'meshes' / 'oval_tanker.stl'), 0.001)
    surface = tank.liquid_surface(tank.depth(0.4), 0.2)
    assert symmetries(surface) == (True, True)
    corners = surface.wall + np.where(surface.wall[..., :1] > 2.0, [0.0, 0.01, 0.0], 0.0)
    moved = LiquidSurface(corners, surface.free)
    assert symmetries(moved) == (False, False)


def test_a_mode_that_cannot_be_followed_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Here nothing is ever enough of a likeness."""
    monkeypatch.setattr(volume_sweep, '_LEAST', 1.5)
    monkeypatch.setattr(volume_sweep, '_SURE', 1.5)
    tank = box_mesh()
    sweep = VolumeSweep(tank, Start(1, 0.5, all_kinds=False), FEW)
    with pytest.raises(InputError, match='the mode x1 cannot be followed from a depth'):
        sweep.at(0.505)
