"""Tanks given as triangles: the liquid at rest, pools, faults of files and their repair."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from conftest import REPOSITORY
from numpy.typing import NDArray
from test_replay import slosh

from slosh_ros.engine import SloshConfig
from slosh_ros.errors import InputError
from slosh_ros.modal.validity import surface_room
from slosh_ros.tank import (
    LiquidAtRest,
    LiquidSurface,
    MeshTank,
    Tank,
    cylinder_x,
    mesh,
    rectangular,
    section_x,
)
from slosh_ros.tank.mesh_check import checked, winding
from slosh_ros.tank.mesh_cut import cut_below
from slosh_ros.tank.surface import area_vectors, solid_moments
from slosh_ros.tank.triangulation import triangulate

trimesh = pytest.importorskip('trimesh')
Array = NDArray[np.float64]
Surface = tuple[Array, NDArray[np.intp]]


def box(length: float, width: float, height: float, at: tuple[float, ...] = (0, 0, 0)) -> Surface:
    made = trimesh.creation.box((length, width, height))
    return np.array(made.vertices) + at, np.array(made.faces)


def prism(corners: list[tuple[float, float]], length: float) -> Surface:
    """Of a section y, z, counter-clockwise from +x."""
    points, triangles = triangulate(np.array(corners), lambda p: np.full(len(p), 10.0))
    front = np.insert(points, 0, length / 2.0, axis=1)
    back = np.insert(points, 0, -length / 2.0, axis=1)
    m = len(points)
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    inner = {(b, a) for a, b in sides.tolist()}
    edge = np.array([(a, b) for a, b in sides.tolist() if (a, b) not in inner])
    a, b = edge.T
    faces = [
        triangles,
        triangles[:, ::-1] + m,
        np.stack([a, a + m, b], axis=1),
        np.stack([b, a + m, b + m], axis=1),
    ]
    return np.concatenate([front, back]), np.concatenate(faces)


def tank_of(surface: Surface) -> MeshTank:
    sound = checked(*surface)
    middle = (sound.vertices.min(axis=0) + sound.vertices.max(axis=0)) / 2.0
    return MeshTank(sound.vertices - middle, sound.faces, sound.repairs)


def joined(*surfaces: Surface) -> Surface:
    count = np.cumsum([0, *(len(vertices) for vertices, _ in surfaces)])
    return (
        np.concatenate([vertices for vertices, _ in surfaces]),
        np.concatenate([faces + n for (_, faces), n in zip(surfaces, count[:-1], strict=True)]),
    )


def assert_same(found: LiquidAtRest, expected: LiquidAtRest, rel: float = 1e-9) -> None:
    size = expected.volume ** (1.0 / 3.0)
    assert found.volume == pytest.approx(expected.volume, rel=rel)
    assert found.freeboard == pytest.approx(expected.freeboard, abs=rel * size)
    for name, scale in (
        ('surface_centre', size), ('centroid', size), ('inertia', size**5),
        ('surface_inertia', size**4),
    ):  # fmt: skip
        expectation = pytest.approx(getattr(expected, name), rel=rel, abs=rel * scale)
        assert getattr(found, name) == expectation, name


# Tanks that have closed forms: a box, a prism that leans, one with a floor that rises in a step
STEPPED = [(-1.0, 0.0), (0.2, 0.0), (0.2, 0.5), (1.0, 0.5), (1.0, 1.2), (-1.0, 1.2)]
LEANING = [(0.0, 0.0), (2.0, -0.3), (2.4, 1.0), (1.1, 1.6), (-0.3, 0.9)]
PAIRS = {
    'box': (box(3.0, 1.6, 1.2), rectangular(3.0, 1.6, 1.2)),
    'leaning': (prism(LEANING, 3.0), section_x(np.ravel(LEANING).tolist(), 3.0)),
    'stepped': (prism(STEPPED, 2.0), section_x(np.ravel(STEPPED).tolist(), 2.0)),
}
every_pair = pytest.mark.parametrize(('surface', 'exact'), PAIRS.values(), ids=PAIRS)


@every_pair
@pytest.mark.parametrize('fill_ratio', [0.0, 0.01, 0.3, 0.6, 0.99, 1.0])
def test_a_mesh_of_flat_walls_is_exact(surface: Surface, exact: Tank, fill_ratio: float) -> None:
    tank = tank_of(surface)
    depth = tank.depth(fill_ratio)
    assert depth == pytest.approx(exact.depth(fill_ratio), abs=1e-10)
    assert tank.volume == pytest.approx(exact.volume, rel=1e-12)
    assert tank.height == pytest.approx(exact.height, rel=1e-12)
    assert tank.fill_ratio(depth) == pytest.approx(fill_ratio, abs=1e-10)
    assert_same(tank.filled(depth), exact.filled(exact.depth(fill_ratio)), 1e-8)


def test_a_level_at_the_step_of_the_floor() -> None:
    """Corners of the mesh in the surface itself: what touches is neither lost nor doubled."""
    surface, exact = PAIRS['stepped']
    tank = tank_of(surface)
    for depth in (0.5 - 1e-12, 0.5, 0.5 + 1e-12):
        assert tank.filled(depth).volume == pytest.approx(1.2 * 0.5 * 2.0, rel=1e-9)
    assert tank.fill_ratio(0.5) == pytest.approx(exact.fill_ratio(0.5), rel=1e-9)


def test_the_origin_of_the_file_does_not_matter(tmp_path: Path) -> None:
    moved, turned = tmp_path / 'moved.ply', tmp_path / 'turned.obj'
    vertices, faces = PAIRS['leaning'][0]
    trimesh.Trimesh(vertices + np.array([10.0, -2.0, 0.7]), faces, process=False).export(moved)
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # x to y, y to -x
    trimesh.Trimesh(vertices @ quarter.T, faces, process=False).export(turned)
    plain, there, around = tank_of((vertices, faces)), mesh(str(moved)), mesh(str(turned))
    assert 'the origin of the tank frame is at (10, ' in there.repairs[0]
    depth = plain.depth(0.4)
    here = plain.filled(depth)
    assert_same(there.filled(depth), here, 1e-6)
    rotated = around.filled(depth)
    assert rotated.surface_centre == pytest.approx(quarter @ here.surface_centre, abs=1e-6)
    assert rotated.inertia == pytest.approx(quarter @ here.inertia @ quarter.T, abs=1e-6)


@pytest.mark.parametrize('name', ['leaning', 'stepped', 'frame', 'turned capsule'])
def test_the_volume_below_a_level_is_that_of_the_surface_cut_there(name: str) -> None:
    """By heights of triangles alone, to rounding: between, at and next to corners of the mesh."""
    if name == 'frame':
        pytest.importorskip('manifold3d')
        surface = frame()
    elif name == 'turned capsule':
        made = trimesh.creation.capsule(height=2.0, radius=0.7, count=(8, 8))
        made.apply_transform(trimesh.transformations.rotation_matrix(0.7, (0.3, 1.0, 0.2)))
        surface = np.array(made.vertices), np.array(made.faces)
    else:
        surface = PAIRS[name][0]
    tank = tank_of(surface)
    corners = tank.vertices[:, 2] + tank.height / 2.0
    near = [corners + step for step in (-1e-7, 0.0, 1e-7)]
    depths = np.concatenate([np.linspace(0.0, tank.height, 41), *near])
    for depth in np.clip(depths, 0.0, tank.height).tolist():
        cut = cut_below(tank.vertices, tank.faces, depth - tank.height / 2.0)
        volume = solid_moments(cut.points[cut.wall]).whole
        assert tank.fill_ratio(depth) == pytest.approx(volume / tank.volume, rel=0.0, abs=3e-9)
        if np.abs(corners - depth).min() > 1e-8:
            assert tank.fill_ratio(depth) == pytest.approx(volume / tank.volume, abs=1e-13)


@pytest.mark.parametrize('fill_ratio', [0.1, 0.5, 0.9])
def test_a_mesh_of_heads_converges(fill_ratio: float) -> None:
    """The error of a capsule in facets falls as their size squared."""
    exact = cylinder_x(1.0, 3.0, 0.6)
    errors = []
    for count in (12, 24, 48):
        made = trimesh.creation.capsule(height=3.0, radius=1.0, count=(count, count))
        vertices = np.array(made.vertices)[:, [2, 0, 1]]
        beyond = np.maximum(np.abs(vertices[:, 0]) - 1.5, 0.0)
        vertices[:, 0] -= np.sign(vertices[:, 0]) * 0.4 * beyond
        tank = tank_of((vertices, np.array(made.faces)))
        liquid = tank.filled(tank.depth(fill_ratio))
        expected = exact.filled(exact.depth(fill_ratio))
        error = np.diag(liquid.inertia) / np.diag(expected.inertia) - 1.0
        errors.append(np.abs(np.append(error, liquid.volume / expected.volume - 1.0)))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert rates == pytest.approx(np.full((2, 4), 2.0), abs=0.3)


# --- the closed surface --------------------------------------------------------------------------


def assert_closed(surface: LiquidSurface, decimals: int = 9) -> None:
    """Each edge is passed once in either direction; the free surface looks up."""
    edges: dict[tuple[tuple[float, ...], ...], int] = {}
    for triangle in (np.round(surface.triangles, decimals) + 0.0).tolist():
        for i in range(3):
            ends = tuple(triangle[i]), tuple(triangle[(i + 1) % 3])
            edges[ends] = edges.get(ends, 0) + 1
    wrong = [ends for ends, n in edges.items() if n != 1 or edges.get(ends[::-1]) != 1]
    assert not wrong
    assert np.all(surface.free[..., 2] == 0.0)
    assert np.all(area_vectors(surface.free)[:, 2] > 0.0)


@every_pair
@pytest.mark.parametrize('size', [5.0, 0.25])
def test_the_surface_of_the_liquid(surface: Surface, exact: Tank, size: float) -> None:
    tank = tank_of(surface)
    for depth in (tank.depth(0.3), tank.depth(0.8)):
        found = tank.liquid_surface(depth, size)
        assert_closed(found)
        sides = np.linalg.norm(np.roll(found.triangles, 1, axis=1) - found.triangles, axis=2)
        assert sides.max() < 1.6 * size
        centre = tank.filled(depth).surface_centre
        liquid = found.liquid(depth, tank.fill_ratio(depth), centre, tank.height - depth)
        assert_same(liquid, exact.filled(depth), 1e-8)


@pytest.mark.parametrize('fill_ratio', [0.02, 0.6, 0.95])
def test_the_shipped_tanker_as_trimesh_measures_it(fill_ratio: float) -> None:
    """Volume, centroid and inertia by trimesh of the closed surface; its sump below, its heads."""
    tank = mesh(str(REPOSITORY / 'config' / 'meshes' / 'oval_tanker.stl'), 0.001)
    assert tank.box == pytest.approx([6.2, 2.4, 1.85], abs=1e-3)
    depth = tank.depth(fill_ratio)
    liquid, surface = tank.filled(depth), tank.liquid_surface(depth, 0.4)
    assert_closed(surface)
    count = len(surface.triangles)
    other = trimesh.Trimesh(surface.triangles.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))
    other.density = 1.0
    assert liquid.volume == pytest.approx(other.volume, rel=1e-7)
    assert liquid.centroid == pytest.approx(other.center_mass, abs=1e-6)
    x, y, z = other.center_mass
    steiner = np.diag([y**2 + z**2, x**2 + z**2, x**2 + y**2]) * other.volume
    assert liquid.inertia == pytest.approx(other.moment_inertia + steiner, rel=1e-6, abs=1e-6)


def test_a_contact_line_of_many_corners() -> None:
    """A drum in long needles is covered all the same, closed and exactly."""
    made = trimesh.creation.cylinder(radius=1.0, height=3.0, sections=600)
    tank = tank_of((np.array(made.vertices), np.array(made.faces)))
    depth = tank.depth(0.4)
    surface = tank.liquid_surface(depth, 0.2)
    assert_closed(surface)
    centre = tank.filled(depth).surface_centre
    found = surface.liquid(depth, 0.4, centre, 3.0 - depth)
    assert_same(found, tank.filled(depth))
    assert len(surface.free) < 1300  # two for each facet of the drum, as few as there can be


def frame() -> Surface:
    """Two legs joined by a bridge above and a bridge below: a free surface in two pieces."""
    made = trimesh.creation.box((1.0, 3.0, 3.0))
    hole = trimesh.creation.box((2.0, 1.0, 1.0))
    cut = made.difference(hole)
    return np.array(cut.vertices), np.array(cut.faces)


def test_a_free_surface_in_two_pieces() -> None:
    pytest.importorskip('manifold3d')
    tank = tank_of(frame())
    depth = 1.5
    liquid = tank.filled(depth)
    assert liquid.volume == pytest.approx(3.0 + 2.0 * 0.5)
    assert liquid.surface_inertia == pytest.approx(np.diag([2.0 / 12.0, 2.0 * (1.0 / 12.0 + 1.0)]))
    found = tank.liquid_surface(depth, 0.3)
    assert_closed(found)
    assert area_vectors(found.free)[:, 2].sum() == pytest.approx(2.0)
    assert cut_below(tank.vertices, tank.faces, 0.0).pools == 1


def test_a_tube_through_the_surface_leaves_a_hole() -> None:
    pytest.importorskip('manifold3d')
    made = trimesh.creation.box((2.0, 2.0, 2.0)).difference(
        trimesh.creation.box((0.4, 0.6, 3.0)).apply_translation((0.3, 0.0, 0.0))
    )
    tank = tank_of((np.array(made.vertices), np.array(made.faces)))
    liquid = tank.filled(0.7)
    area = 4.0 - 0.24
    assert liquid.volume == pytest.approx(0.7 * area)
    assert liquid.surface_centre == pytest.approx([-0.24 * 0.3 / area, 0.0, -0.3])
    found = tank.liquid_surface(0.7, 0.4)
    assert_closed(found)
    assert area_vectors(found.free)[:, 2].sum() == pytest.approx(area)


def test_two_pools_are_refused() -> None:
    """An arch stands on two legs; below its crown they are not connected."""
    arch = [(-1.5, 0.0), (-0.5, 0.0), (-0.5, 1.0), (0.5, 1.0), (0.5, 0.0), (1.5, 0.0)]
    tank = tank_of(prism([*arch, (1.5, 2.0), (-1.5, 2.0)], 1.0))
    for use in (tank.filled, lambda depth: tank.liquid_surface(depth, 0.5)):
        with pytest.raises(InputError, match='the mesh has 2 pools that are not connected'):
            use(0.6)
    assert tank.filled(1.4).volume == pytest.approx(2.0 + 1.2)


def test_nearest_points_of_a_mesh() -> None:
    tank, exact = tank_of(PAIRS['box'][0]), PAIRS['box'][1]
    rng = np.random.default_rng(5)
    for point in rng.uniform(-2.0, 2.0, (60, 3)):
        assert tank.nearest(0.7, point) == pytest.approx(exact.nearest(0.7, point), abs=1e-12)
    tank, exact = tank_of(PAIRS['leaning'][0]), PAIRS['leaning'][1]
    for point in rng.uniform(-1.5, 1.5, (60, 3)):
        found, expected = (t.nearest(0.8, point) for t in (tank, exact))
        gap = np.linalg.norm(expected - point)
        assert np.linalg.norm(found - point) == pytest.approx(gap, abs=1e-9)


def test_solid_angles_tell_inside_from_outside() -> None:
    vertices, faces = box(2.0, 1.0, 1.0)
    points = np.array([[0.0, 0.0, 0.0], [0.99, 0.49, 0.49], [1.01, 0.0, 0.0], [0.0, 0.0, 5.0]])
    assert winding(points, vertices[faces]) == pytest.approx([1.0, 1.0, 0.0, 0.0], abs=1e-9)


def test_sloping_walls_leave_less_room() -> None:
    """As of the same tank as a section: the watch over linear theory asks for nothing more."""
    for name in ('box', 'leaning'):
        surface, exact = PAIRS[name]
        assert surface_room(tank_of(surface), 0.5) == pytest.approx(surface_room(exact, 0.5))


# --- faults of files -----------------------------------------------------------------------------

VERTICES, FACES = box(3.0, 1.6, 1.2)


def test_normals_that_point_inwards_are_turned() -> None:
    sound = checked(VERTICES, FACES[:, ::-1])
    assert sound.repairs == ('its normals pointed inwards and are turned',)
    inwards, outwards = (tank_of((VERTICES, faces)) for faces in (FACES[:, ::-1], FACES))
    assert_same(inwards.filled(0.5), outwards.filled(0.5))
    some = FACES.copy()
    some[[1, 5, 6]] = some[[1, 5, 6]][:, ::-1]
    mended = checked(VERTICES, some)
    assert mended.repairs == ('3 of 12 triangles faced inwards and are turned',)
    assert np.array_equal(mended.faces, checked(VERTICES, FACES).faces)


def test_corners_given_several_times_are_merged() -> None:
    """As every STL has them, and with the rounding of six digits."""
    loose = VERTICES[FACES].reshape(-1, 3), np.arange(36).reshape(12, 3)
    assert checked(*loose).repairs == ()
    assert len(checked(*loose).vertices) == 8
    rng = np.random.default_rng(1)
    rounded = loose[0] + rng.uniform(-3e-7, 3e-7, (36, 3))
    sound = checked(rounded, loose[1])
    assert len(sound.vertices) == 8
    assert sound.repairs == ('28 corners that differ by rounding are merged',)


def test_triangles_that_are_none_or_repeated_are_left_out() -> None:
    more = np.vstack([FACES, [[0, 0, 1]], FACES[3:4, [1, 2, 0]]])
    sound = checked(VERTICES, more)
    assert sound.repairs == (
        '1 triangles without area are left out',
        '1 triangles given twice are left out',
    )
    assert len(sound.faces) == 12


def bow_tie() -> Surface:
    """Make a prism whose section crosses itself, closed: two triangles at each edge."""
    ring = np.array([[-1.0, -0.5], [1.0, 0.6], [1.0, -0.5], [-1.0, 0.7]])
    front, back = (np.insert(ring, 0, x, axis=1) for x in (0.5, -0.5))
    middle = [[0.5, 0.0, 0.3], [-0.5, 0.0, 0.3]]
    a = np.arange(4)
    b = (a + 1) % 4
    faces = [
        np.stack([a, b, np.full(4, 8)], axis=1),
        np.stack([b + 4, a + 4, np.full(4, 9)], axis=1),
        np.stack([a, a + 4, b], axis=1),
        np.stack([b, a + 4, b + 4], axis=1),
    ]
    return np.concatenate([front, back, middle]), np.concatenate(faces)


FAULTS = {
    'open': ((VERTICES, FACES[:-1]), r'is open: 3 edges .* first at \(.*\) m; close'),
    'separate': (joined(box(1, 1, 1), box(1, 1, 1, (3, 0, 0))), 'encloses 2 separate bodies'),
    'bodies that touch': (
        joined(box(1, 1, 1), box(1, 1, 1, (1, 1, 0))), 'has 1 edges at which more than two .* meet'
    ),
    'crossing bodies': (
        joined(box(2.0, 1.0, 1.0), box(1.0, 2.0, 0.6, (0.1, 0.2, 0.1))), 'encloses 2 separate'
    ),
    'crossing': (bow_tie(), r'passes through itself, first near \(.*\) m; mend'),
    'millimetres': ((1e3 * VERTICES, FACES), r'3000 x 1600 x 1200 m, .* mesh_scale: 0\.001'),
    'kilometres': ((1e-3 * VERTICES, FACES), r'smaller than any tank; .* mesh_scale: 1000\.0'),
    'both sides of a wall': (
        joined(box(3.0, 1.6, 1.2), box(2.98, 1.58, 1.18)), 'two sides of a wall; write the inner'
    ),
    'flat': ((VERTICES * [1, 1, 0], FACES), 'it is flat'),
    'no triangles': ((VERTICES, FACES[:0]), 'has no triangles'),
    'nan': ((VERTICES * [1, np.nan, 1], FACES), 'not finite'),
    'too fine': ((VERTICES, np.repeat(FACES, 5000, axis=0)), 'has 60000 triangles; .* 50000'),
}  # fmt: skip


@pytest.mark.parametrize('name', FAULTS)
def test_a_surface_that_is_no_tank_is_refused(name: str) -> None:
    surface, says = FAULTS[name]
    with pytest.raises(InputError, match=says):
        checked(*surface)


def test_a_void_within_is_no_second_tank() -> None:
    tank = tank_of(joined(box(3.0, 1.6, 1.2), box(1.0, 0.5, 0.4)))
    assert tank.volume == pytest.approx(3.0 * 1.6 * 1.2 - 0.2)
    assert tank.repairs == (
        'it has 0.2 m^3 closed off within, which stay dry',
        '12 of 24 triangles faced inwards and are turned',
    )
    assert tank.filled(0.6).volume == pytest.approx(3.0 * 1.6 * 0.6 - 0.1)


@pytest.mark.parametrize(
    ('name', 'content', 'says'),
    [
        ('tank.stl', None, 'there is no such file'),
        ('tank.step', b'ISO-10303-21;', r'its ending must be \.stl, \.obj, \.ply'),
        ('tank.stl', b'', 'has no triangles'),
        ('tank.stl', b'this is no mesh at all', 'has no triangles|cannot be read'),
        ('tank.ply', b'ply\nformat ascii 1.0\nend_header\n', 'has no triangles|cannot be read'),
        ('tank.obj', b'v 0 0 0\nv 1 0 0\n', 'has no triangles|cannot be read'),
    ],
)
def test_files_that_are_no_mesh(
    tmp_path: Path, name: str, content: bytes | None, says: str
) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=says):
        mesh(str(tmp_path / name))


def test_millimetres_are_scaled(tmp_path: Path) -> None:
    file = tmp_path / 'tank.stl'
    trimesh.Trimesh(1e3 * VERTICES, FACES).export(file)
    with pytest.raises(InputError, match=f'mesh_file {file} has a bounding box of 3000 x'):
        mesh(str(file))
    assert mesh(str(file), 1e-3).volume == pytest.approx(3.0 * 1.6 * 1.2, rel=1e-6)


# --- configuration -------------------------------------------------------------------------------

CONFIG = """
/**:
  ros__parameters:
    tank.shape: mesh
    tank.mesh_file: {file}
    tank.fill_ratio: 0.4
    pressure.wall: [0.0, 0.8, -0.4]
"""


def test_a_mesh_is_sought_beside_its_configuration(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / 'config'
    (folder / 'meshes').mkdir(parents=True)
    trimesh.Trimesh(VERTICES, FACES).export(folder / 'meshes' / 'tank.stl')
    file = folder / 'tank.yaml'
    for name in ('meshes/tank.stl', str(folder / 'meshes' / 'tank.stl')):
        file.write_text(CONFIG.format(file=name))
        (tank,) = SloshConfig.from_file(file).tanks
        assert tank.tank.volume == pytest.approx(3.0 * 1.6 * 1.2, rel=1e-6)
        assert tank.pressure_points['wall'] == pytest.approx([0.0, 0.8, -0.4], abs=1e-6)
    monkeypatch.chdir(folder)
    given = {'tank.shape': 'mesh', 'tank.mesh_file': 'meshes/tank.stl', 'tank.fill_ratio': 0.4}
    assert SloshConfig.from_parameters(given).tanks[0].tank.shape == 'mesh'
    with pytest.raises(InputError, match=r'tank\.mesh_file is nowhere\.stl, but there is no such'):
        SloshConfig.from_parameters({**given, 'tank.mesh_file': 'nowhere.stl'})


def test_check_and_modes_tell_what_has_been_repaired(tmp_path: Path) -> None:
    trimesh.Trimesh(VERTICES + np.array([0.0, 0.0, 0.6]), FACES[:, ::-1]).export(
        tmp_path / 'tank.ply'
    )
    file = tmp_path / 'tank.yaml'
    file.write_text(CONFIG.format(file='tank.ply') + '    tank.modes: 1\n')
    for command in (['check', file], ['modes', file, '--fill', '0.0']):
        out = slosh(*command).stdout.replace('\n', ' ')
        assert 'its normals pointed inwards and are turned' in out
        assert "the origin of the tank frame is at (0, 0, 0.6) m of the file's axes" in out
