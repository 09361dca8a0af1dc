# ruff: noqa: E501 (a table of messages is read along its lines)
"""`shape: added_mass`: from a file to modes, loads and the node; what does not fit is told."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import REPOSITORY
from drives import stamps, write_bag
from test_added_mass_files import wamit_text
from test_replay import brake, slosh, table

from slosh_ros.engine import SloshConfig, SloshEngine, feed_message
from slosh_ros.errors import InputError
from slosh_ros.hydro import ModalCoefficients, coefficients_of
from slosh_ros.hydro.added_mass import AddedMass
from slosh_ros.hydro.frequency import total_added_mass
from slosh_ros.modal.validity import surface_room
from slosh_ros.tank import ellipse_x, rectangular

pytestmark = pytest.mark.dear

SHIPPED = REPOSITORY / 'config' / 'added_mass.yaml'
BY_SHAPE = ellipse_x(2.4, 1.8, 5.75)  # what elliptical_tank.1 is of

# A small deep box: few modes in the band, so that fits are quick.
BOX = rectangular(3.0, 2.0, 2.0)
DENSITY, DEPTH = 900.0, 1.2
MANY = coefficients_of(BOX, DEPTH, DENSITY, 40)
OMEGA = np.arange(0.25, 5.5, 0.25)
ABOVE = 0.5  # [m] of the reference point over O
KEYS = {
    'shape': 'added_mass',
    'added_mass_file': 'box.1',
    'added_mass_reference': [0.0, 0.0, ABOVE],
    'added_mass_length_scale': 2.0,
    'density': DENSITY,
    'liquid_mass': 6480.0,
    'liquid_depth': DEPTH,
    'liquid_centroid': [0.0, 0.0, -0.4],
    'liquid_inertia': [2937.6, 5637.6, 7020.0],
    'surface_centre': [0.0, 0.0, 0.2],
    'surface_length': 3.0,
    'surface_width': 2.0,
    'freeboard': 0.8,
    'tank_volume': 12.0,
}


def box_data() -> AddedMass:
    """Give the added mass of the box about a point `ABOVE` O, as its code would write it."""
    shift = np.eye(6)  # moments about P: r_PO x force beside
    shift[3:, :3] = [[0.0, ABOVE, 0.0], [-ABOVE, 0.0, 0.0], [0.0, 0.0, 0.0]]
    matrix = shift @ total_added_mass(MANY, OMEGA) @ shift.T
    return AddedMass(OMEGA, matrix, DENSITY, np.array([0.0, 0.0, ABOVE]))


def yaml(folder: Path, **changes: object) -> Path:
    """Write a parameter file; None leaves a key out."""
    keys = {name: value for name, value in (KEYS | changes).items() if value is not None}
    lines = [f'      {name}: {json.dumps(value)}\n' for name, value in keys.items()]
    file = folder / 'box.yaml'
    file.write_text('/**:\n  ros__parameters:\n    tank:\n' + ''.join(lines))
    return file


def written(folder: Path, data: AddedMass | None = None, **changes: object) -> Path:
    (folder / 'box.1').write_text(wamit_text(data or box_data(), 2.0, skip=1e-3))
    return yaml(folder, **changes)


@pytest.fixture(scope='module')
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp('box')
    written(made)
    return made


@pytest.fixture(scope='module')
def engine(folder: Path) -> SloshEngine:
    return SloshEngine(SloshConfig.from_file(folder / 'box.yaml'))


def invariant(c: ModalCoefficients, name: str) -> np.ndarray:
    """Give lambda lambda^T/mu: free of the scale of the mode."""
    j = c.names.index(name)
    return np.outer(c.coupling[j], c.coupling[j]) / c.mu[j]


def test_file_gives_the_modes_of_the_closed_form(engine: SloshEngine) -> None:
    """About O, though the file has its moments about another point and is dimensionless."""
    found = engine.tanks[0].coefficients
    assert found.route == 'added mass'
    for name, own in (('surge1', 'x1'), ('sway1', 'y1'), ('yaw1', 'x1y1')):
        j, k = found.names.index(name), MANY.names.index(own)
        assert found.omega[j] == pytest.approx(MANY.omega[k], rel=1e-4)
        exact = invariant(MANY, own)
        assert invariant(found, name) == pytest.approx(exact, rel=5e-3, abs=1e-6 * exact.max())
    assert np.diag(found.inertia_stokes_joukowski) == pytest.approx(
        np.diag(MANY.inertia_stokes_joukowski), rel=0.01
    )
    assert found.inertia_frozen == pytest.approx(MANY.inertia_frozen, rel=1e-6)
    assert found.liquid.fill_ratio == pytest.approx(0.6)  # 7.2 of 12 m^3


def test_watch_of_linear_theory_works_without_walls(engine: SloshEngine) -> None:
    tank = engine.tanks[0].config.tank
    assert tank.height == pytest.approx(2.0)
    assert surface_room(tank, DEPTH) == np.inf
    with pytest.raises(InputError, match='one fill only'):
        tank.filled(1.0)
    with pytest.raises(InputError, match='one fill only'):
        tank.depth(0.3)


def test_replay_of_the_shipped_example_against_the_shape_itself(tmp_path: Path) -> None:
    """Half-full ellipse braked at 0.1 g: 1,296 constant panels are off the section by 2 %."""
    other = tmp_path / 'ellipse.yaml'
    other.write_text(
        '/**:\n  ros__parameters:\n    tank:\n      xyz: [0.0, 0.0, 1.4]\n      shape: ellipse_x\n'
        '      width: 2.4\n      height: 1.8\n      length: 5.75\n      fill_depth: 0.9\n'
        '      density: 850.0\n      damping_ratio: 0.01\n'
    )
    bag = write_bag(tmp_path / 'bag', stamps(6.0, 0.01), brake)
    loads = []
    for config in (SHIPPED, other):
        out = tmp_path / f'{config.stem}.csv'
        result = slosh('replay', bag, '--config', config, '--out', out)
        assert result.returncode == 0, result.stderr
        loads.append(table(out))
    for column in ('fx', 'my', 'total_fx', 'total_my'):
        found, exact = (one[column] for one in loads)
        assert np.sqrt(np.mean((found - exact) ** 2) / np.mean(exact**2)) < 0.04, column


def test_shipped_example_is_reported_with_file_errors_and_constants(tmp_path: Path) -> None:
    result = slosh('modes', SHIPPED, '--json')
    assert result.returncode == 0, result.stderr
    found = json.loads(result.stdout)
    exact = coefficients_of(BY_SHAPE, 0.9, 850.0, 12)
    assert found['route'] == 'added mass'
    fit = found['fit']
    assert fit['file'].endswith('elliptical_tank.1')
    assert [family['name'] for family in fit['families']] == ['surge', 'sway', 'yaw']
    by_name = {mode['name']: mode for mode in fit['modes']}
    for name, own, axis in (('surge1', 'x1', 0), ('sway1', 'y1', 1)):
        k = exact.names.index(own)
        mode = by_name[name]
        assert mode['omega'] == pytest.approx(exact.omega[k], rel=0.008)
        mass = exact.coupling[k, axis] ** 2 / exact.mu[k]
        assert mode['modal_mass'] == pytest.approx(mass, rel=0.025)
        assert 0.0 < mode['omega_error'] < 1e-3
        assert 0.0 < mode['modal_mass_error'] < 0.01 * mass
    assert fit['families'][0]['at_rest'][0] == pytest.approx(found['mass'], rel=0.02)


def test_table_tells_the_fit(folder: Path) -> None:
    result = slosh('modes', folder / 'box.yaml')
    assert result.returncode == 0, result.stderr
    for text in (
        'fitted',
        '+-',
        'box.1: 21 frequencies',
        '900 kg/m^3',
        '0.5] m',
        'constant terms',
        'typically',
        'largest relative error of omega and lambda, estimated: ',
        'of the fit: what the data are off comes on top',
        'less than a step of its frequencies, 0.2',
    ):
        assert text in ' '.join(result.stdout.split()), text


@pytest.mark.parametrize(
    ('changes', 'says'),
    [
        ({'liquid_mass': None}, 'tank.liquid_mass is missing; a added_mass tank needs'),
        ({'added_mass_reference': None}, 'tank.added_mass_reference is missing; a file of WAMIT'),
        ({'added_mass_length_scale': None}, 'tank.added_mass_length_scale is missing'),
        ({'added_mass_file': 'none.1'}, 'none.1: cannot be read: No such file'),
        ({'added_mass_file': 'box.txt'}, "ends in '.txt'; added mass is read from"),
        ({'fill_ratio': 0.5}, 'tank.fill_ratio is given, but the added mass of tank.added_mass_file is that of one fill; remove it'),
        ({'fill_depth': 1.2}, 'tank.fill_depth is given'),
        ({'radius': 1.0}, 'tank.radius is given, but'),
        ({'tank_volume': 7.0}, 'tank.tank_volume is 7 m^3, but the liquid alone takes 7.2 m^3'),
        ({'liquid_centroid': [0.2, 0.0, -0.4]}, 'tank.liquid_centroid is [0.2, 0.0, -0.6'),
        ({'liquid_centroid': [0.0, 0.0, 0.4]}, 'it must lie straight below it'),
        ({'liquid_inertia': [1.0, 1.0, 9.0]}, 'tank.liquid_inertia is 1, 1, 9 kg m^2, which no body has'),
        ({'surface_moments': [1.0]}, 'tank.surface_moments is [1.0]; it takes two'),
        ({'added_mass_first_column': 'degrees'}, "tank.added_mass_first_column is 'degrees'"),
        ({'freeboard': 0.0}, 'tank.freeboard is 0 [m]'),
        ({'added_mass_file': 'box.nc'}, 'tank.added_mass_length_scale is given, but it is of the .1 of WAMIT, and added_mass_file is box.nc'),
    ],
)  # fmt: skip
def test_keys_that_do_not_fit(folder: Path, tmp_path: Path, changes: dict, says: str) -> None:
    for file in ('box.1', 'box.txt'):
        (tmp_path / file).write_bytes((folder / 'box.1').read_bytes())
    with pytest.raises(InputError) as error:
        SloshConfig.from_file(yaml(tmp_path, **changes))
    assert says in str(error.value)


def test_pressure_is_refused(folder: Path) -> None:
    text = (folder / 'box.yaml').read_text()
    file = folder / 'pressure.yaml'
    file.write_text(text + '    pressure:\n      wall: [1.5, 0.0, -0.5]\n')
    with pytest.raises(InputError, match=r'pressure\.wall is given, but added mass tells nothing'):
        SloshConfig.from_file(file)


def only(row: int, column: int, value: complex):
    """Spoil one entry at all frequencies."""

    def spoiled(data: AddedMass) -> AddedMass:
        matrix = data.matrix.copy()
        matrix[:, row, column] = value * matrix[:, row, column]
        return replace(data, matrix=matrix)

    return spoiled


def makes_energy(data: AddedMass) -> AddedMass:
    matrix = data.matrix.copy()
    matrix[:, 0, 0] -= 0.5j * np.abs(matrix[:, 0, 0])
    return replace(data, matrix=matrix)


@pytest.mark.parametrize(
    ('spoil', 'changes', 'says'),
    [
        (None, {'added_mass_length_scale': 1.0}, 'its entry 11 tends to 810'),
        (None, {'density': 1000.0}, 'its entry 11 tends to 7200 kg at rest, but the liquid has a mass of 6480 kg'),
        (None, {'added_mass_reference': [0.0, 0.0, 0.0]}, 'its entry 15 tends to'),
        (None, {'added_mass_reference': [0.3, 0.0, ABOVE]}, 'entry 26 is not zero'),
        (None, {'surface_length': 4.0}, 'its entry 15 tends to'),
        (None, {'liquid_inertia': [500.0, 900.0, 1300.0]}, 'check liquid_inertia'),
        (None, {'added_mass_first_column': 'frequency'}, 'tends to'),
        (None, {'added_mass_hydrostatic': False}, 'check added_mass_hydrostatic'),
        (only(4, 4, np.nan), {}, 'entry 55'),
        (only(0, 4, np.nan), {}, 'nowhere 15; write both triangles'),
        (only(0, 4, 0.5), {}, 'the entry 15 is'),
        (makes_energy, {}, 'the radiation damping 11 is negative at 21 of 21 frequencies'),
    ],
)  # fmt: skip
def test_data_that_do_not_fit(tmp_path: Path, spoil, changes: dict, says: str) -> None:
    data = box_data() if spoil is None else spoil(box_data())
    with pytest.raises(InputError) as error:
        SloshEngine(SloshConfig.from_file(written(tmp_path, data, **changes)))
    assert says in str(error.value), error.value


@pytest.mark.ros
def test_node_runs_from_a_file_beside_its_parameter_file(folder: Path, tmp_path: Path) -> None:
    """A braked tank, the same as offline; another fill is refused in words, and changes nothing."""
    rig = pytest.importorskip('ros_rig', reason='needs the ROS 2 wheels (make venv)')
    from std_msgs.msg import Float64

    second = 1_000_000_000
    with (
        rig.NodeProcess(
            'slosh_node', tmp_path / 'node.log', '--params-file', str(folder / 'box.yaml')
        ) as node,
        rig.Driver() as driver,
    ):
        node.wait_for('ready', 300.0)  # it fits first
        driver.wait_for_node()
        fills = driver.node.create_publisher(Float64, 'slosh_node/fill', rig.QOS)
        driver.spin_until(lambda: fills.get_subscription_count() > 0)
        offline = SloshEngine(SloshConfig.from_file(folder / 'box.yaml'))
        for k in range(10):
            if k == 5:
                for ratio in (0.6, 0.5):  # the one that it has is no other one
                    fills.publish(Float64(data=ratio))
                node.wait_for(
                    'the fill of tank cannot change while it runs: the added mass of '
                    'tank.added_mass_file is that of one fill; start again with the file of another'
                )
            force = (-1.0, 0.2, 9.81)
            message = rig.imu(100 * second + k * second // 100, force)
            sloshing, total = driver.exchange(message)
            _, loads = feed_message(offline, message, 0)
            assert rig.wrench_of(sloshing) == loads.wrench.tolist()
            assert rig.wrench_of(total) == loads.total.tolist()
        seen = rig.diagnostics(driver)
        assert (seen['fill refused'], seen['tank.fill_ratio']) == ('1', '0.6000')
        assert seen['tank.released so far [kg]'] == '0.000'
        assert not node.children  # nothing is being computed


def test_its_fill_cannot_change_while_it_runs(folder: Path) -> None:
    engine = SloshEngine(SloshConfig.from_file(folder / 'box.yaml'))
    engine.prepare_fills()  # of the other tanks, if there were any
    with pytest.raises(
        InputError, match=r'fill of tank cannot change .* added mass of tank.added_mass_file'
    ):
        engine.set_fill('tank', 0.5)
    assert engine.fill_ratio('tank') == pytest.approx(0.6)
