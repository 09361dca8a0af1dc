"""Files of boundary element codes: genuine samples, round trips, and what does not fit."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from slosh_ros.errors import InputError
from slosh_ros.hydro.added_mass import AddedMass
from slosh_ros.hydro.added_mass_files import describe, read_added_mass, write_added_mass
from slosh_ros.hydro.fit import SURGE, fit_family
from slosh_ros.hydro.frequency import rectangular_wall_ratio, total_added_mass
from slosh_ros.hydro.rectangular import rectangular_coefficients
from slosh_ros.tank import rectangular

DATA = Path(__file__).parent / 'data'
DENSITY, DEPTH = 850.0, 0.8  # of the samples and of Table 1's tank
REFERENCE = (0.0, 0.0, -0.25)  # of the samples
WAMIT = {'density': DENSITY, 'length_scale': 1.0, 'reference': REFERENCE}

TANK = rectangular(8.0, 2.0, 1.6)
MANY = rectangular_coefficients(TANK, DEPTH, DENSITY, 100)

pytestmark = pytest.mark.filterwarnings('ignore:numpy.ndarray size changed:RuntimeWarning')


def test_wamit_sample() -> None:
    data = read_added_mass(DATA / 'hemisphere.1', **WAMIT)
    assert data.omega == pytest.approx([0.0, 1.0, 2.0, 3.0, np.inf], rel=1e-5)
    # a heaving half sphere at infinite frequency: half its mass, 2/3 pi rho R^3/2 (Lamb)
    assert data.matrix[-1, 2, 2].real == pytest.approx(DENSITY * np.pi / 3.0, rel=0.08)
    assert data.matrix[0, 0, 0].real == pytest.approx(972.32575652, rel=1e-6)
    assert np.all(data.matrix[1:4, 0, 0].imag > 0.0)
    assert np.all(data.matrix[[0, -1]].imag == 0.0)
    assert data.reference == pytest.approx(REFERENCE)


def test_netcdf_of_capytaine_and_its_wamit_file_agree() -> None:
    pytest.importorskip('xarray')
    pytest.importorskip('netCDF4')
    netcdf = read_added_mass(DATA / 'hemisphere.nc')
    wamit = read_added_mass(DATA / 'hemisphere.1', **WAMIT)
    assert netcdf.omega == pytest.approx(wamit.omega, rel=1e-5)
    # capytaine writes I for the motion and J for the force; its matrix is symmetric to 1e-3
    transposed = wamit.matrix.transpose(0, 2, 1)
    assert netcdf.matrix == pytest.approx(transposed, rel=2e-6, abs=1e-3)
    assert (netcdf.density, netcdf.reference.tolist()) == (DENSITY, list(REFERENCE))


def test_hdf5_of_bemio_agrees_with_netcdf() -> None:
    pytest.importorskip('xarray')
    pytest.importorskip('netCDF4')
    pytest.importorskip('h5py')
    netcdf = read_added_mass(DATA / 'hemisphere.nc')
    bemio = read_added_mass(DATA / 'hemisphere.h5')
    assert bemio.omega.tolist() == [1.0, 2.0, 3.0, np.inf]
    assert bemio.matrix == pytest.approx(netcdf.matrix[1:], rel=1e-12, abs=1e-9)
    assert (bemio.density, bemio.reference.tolist()) == (DENSITY, list(REFERENCE))


def test_length_scale_of_wamit() -> None:
    """A = Abar rho L^k with k = 3, 4, 5."""
    one = read_added_mass(DATA / 'hemisphere.1', **WAMIT)
    two = read_added_mass(DATA / 'hemisphere.1', **{**WAMIT, 'length_scale': 2.0})
    for (i, j), factor in {(0, 0): 8.0, (2, 2): 8.0, (0, 4): 16.0, (4, 4): 32.0}.items():
        assert two.matrix[:, i, j] == pytest.approx(factor * one.matrix[:, i, j])


def wamit_text(data: AddedMass, length: float = 1.0, skip: float = 0.0) -> str:
    """Write as WAMIT does, which leaves out entries that are zero by symmetry."""
    power = 3 + np.add.outer([0, 0, 0, 1, 1, 1], [0, 0, 0, 1, 1, 1])
    lines = []
    for omega, matrix in zip(data.omega, data.matrix, strict=True):
        scaled = matrix / (data.density * length**power)
        period = -1.0 if omega == 0.0 else 0.0 if np.isinf(omega) else 2.0 * np.pi / omega
        for i, j in np.argwhere(np.abs(matrix) > skip):
            value = scaled[i, j]
            tail = f' {value.imag: .9E}' if period > 0.0 else ''
            lines.append(f' {period: .8E} {i + 1:5d} {j + 1:5d} {value.real: .9E}{tail}')
    return '\n'.join(lines) + '\n'


def tank_data(epsilon: float = 0.0) -> AddedMass:
    omega = np.concatenate([[0.0], np.arange(0.1, 5.0, 0.1), [np.inf]])
    ratio = rectangular_wall_ratio(TANK, DEPTH, MANY.names)
    return AddedMass(
        omega, total_added_mass(MANY, omega, epsilon, ratio), DENSITY, np.array([0.0, 0.0, 0.3])
    )


def test_a_tank_survives_a_wamit_file(tmp_path: Path) -> None:
    data = tank_data(0.01)
    data.matrix.imag[[0, -1]] = 0.0  # has no place in the file
    path = tmp_path / 'tank.1'
    path.write_text(wamit_text(data, 2.5, skip=1e-3))
    back = read_added_mass(path, density=DENSITY, length_scale=2.5, reference=(0.0, 0.0, 0.3))
    assert back.matrix == pytest.approx(data.matrix, rel=1e-6, abs=2e-3)
    assert back.has((0, 0), (0, 1), (4, 4))


def test_netcdf_round_trip_and_the_way_to_the_modes(tmp_path: Path) -> None:
    xarray = pytest.importorskip('xarray')
    pytest.importorskip('netCDF4')
    data = tank_data(0.01)
    data.matrix.imag[[0, -1]] = 0.0
    path = tmp_path / 'tank.nc'
    write_added_mass(path, data)
    back = read_added_mass(path, density=DENSITY, reference=(0.0, 0.0, 0.3))
    assert back.matrix == pytest.approx(data.matrix, rel=1e-12, abs=1e-9)
    assert back.reference == pytest.approx(data.reference)
    # as capytaine would look at it
    with xarray.open_dataset(path) as dataset:
        named = dataset.sel(influenced_dof='Surge', radiating_dof='Pitch', omega=0.0)
        assert float(named.added_mass) == pytest.approx(data.matrix[0, 0, 4].real)
    undamped = tmp_path / 'undamped.nc'
    write_added_mass(
        undamped, AddedMass(data.omega, tank_data().matrix.real + 0j, DENSITY, np.zeros(3))
    )
    fitted = fit_family(read_added_mass(undamped), SURGE)
    assert fitted.omega[:2] == pytest.approx(MANY.omega[[0, 1]], rel=1e-3)


def test_report_tells_units_frame_and_reference() -> None:
    text = describe(read_added_mass(DATA / 'hemisphere.1', **WAMIT))
    for part in ('3 frequencies from 1 to 3 rad/s', '0, infinity', '850 kg/m^3', '-0.25', 'z up'):
        assert part in text


def test_surface_centre_elsewhere_in_the_files_axes() -> None:
    data = read_added_mass(DATA / 'hemisphere.1', surface_centre=(1.0, 0.0, 0.5), **WAMIT)
    assert data.reference == pytest.approx([-1.0, 0.0, -0.75])


GOOD = '-1.0 1 1 1.5\n0.0 1 1 0.5\n6.28 1 1 2.0 0.1\n3.14 1 1 1.0 0.1\n'


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        (GOOD + '3.0 1 1 1.0\n', 'tank.1: line 5: has no B'),
        (GOOD + '3.0 1 1\n', 'line 5: has 3 columns'),
        (GOOD + '3.0 1 7 1.0 0.1\n', 'line 5: has I J = 1 7'),
        (GOOD + '3.0 1 1 abc 0.1\n', 'line 5: has a word that is no number'),
        (GOOD + '3.0 1 1 nan 0.1\n', 'line 5: .* not finite'),
        (GOOD + '3.14 1 1 1.0 0.1\n', 'line 5: entry 11 of this frequency comes twice'),
        (
            GOOD + '3.14 5 5 1.0 0.1\n',
            'lacks entry 55 at 0 rad/s, .* first in line 1, but',
        ),
        ('', 'is empty'),
    ],
)
def test_wamit_lines_that_do_not_fit(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / 'tank.1'
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_added_mass(path, **WAMIT)


def test_a_header_and_frequencies_in_the_first_column(tmp_path: Path) -> None:
    path = tmp_path / 'tank.1'
    path.write_text('PER I J A B\n' + GOOD)
    assert read_added_mass(path, **WAMIT).omega == pytest.approx(
        [0.0, 2 * np.pi / 6.28, 2 * np.pi / 3.14, np.inf]
    )
    found = read_added_mass(path, first_column='frequency', **WAMIT)
    assert found.omega == pytest.approx([0.0, 3.14, 6.28, np.inf])


@pytest.mark.parametrize(
    ('name', 'options', 'message'),
    [
        ('hemisphere.1', {'length_scale': 1.0, 'reference': REFERENCE}, 'give density'),
        ('hemisphere.1', {'density': 850.0, 'reference': REFERENCE}, 'give length_scale'),
        ('hemisphere.1', {'density': 850.0, 'length_scale': 1.0}, 'give reference, which is'),
        ('hemisphere.1', {**WAMIT, 'density': 0.0}, 'density of 0 kg'),
        ('hemisphere.1', {**WAMIT, 'length_scale': -1.0}, 'length scale of -1 m'),
        ('hemisphere.1', {**WAMIT, 'first_column': 'wavenumber'}, 'write period or frequency'),
        ('nowhere.1', WAMIT, 'nowhere.1: cannot be read: No such file'),
        ('make_samples.py', WAMIT, "ends in '.py'"),
    ],
)
def test_what_must_be_given_is_asked_for(name: str, options: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_added_mass(DATA / name, **options)


@pytest.mark.parametrize('suffix', ['.nc', '.h5'])
def test_what_is_given_is_held_against_the_file(suffix: str) -> None:
    pytest.importorskip({'.nc': 'netCDF4', '.h5': 'h5py'}[suffix])
    path = DATA / f'hemisphere{suffix}'
    with pytest.raises(InputError, match=r'density of 850 .* not for the given 1000'):
        read_added_mass(path, density=1000.0)
    with pytest.raises(InputError, match='moments about'):
        read_added_mass(path, reference=(0.0, 0.0, 0.0))


@pytest.mark.parametrize(('suffix', 'message'), [('.nc', 'as NetCDF'), ('.h5', 'as HDF5')])
def test_files_that_are_none(tmp_path: Path, suffix: str, message: str) -> None:
    pytest.importorskip({'.nc': 'netCDF4', '.h5': 'h5py'}[suffix])
    path = tmp_path / f'tank{suffix}'
    path.write_text('this is neither')
    with pytest.raises(InputError, match=message):
        read_added_mass(path)


def test_datasets_that_lack_something(tmp_path: Path) -> None:
    xarray = pytest.importorskip('xarray')
    pytest.importorskip('netCDF4')
    with xarray.open_dataset(DATA / 'hemisphere.nc') as opened:
        dataset = opened.load()
    path = tmp_path / 'tank.nc'
    for spoiled, message in (
        (dataset.drop_vars('added_mass'), "no variable 'added_mass'"),
        (
            dataset.sel(radiating_dof=['Surge', 'Heave']),
            'lacks Sway, Roll, Pitch, Yaw in radiating_dof; it has Surge, Heave: rename them',
        ),
        (dataset.drop_vars('rho'), "no single density 'rho'"),
        (dataset.assign_coords(rho='heavy'), "a 'rho' that is not of numbers"),
        (dataset.drop_vars('rotation_center'), 'give reference, which is added_mass_reference'),
        (dataset.assign_coords(omega=-dataset.omega), r'a frequency of -.* rad/s; they must be 0'),
        (xarray.concat([dataset, dataset], 'omega'), 'rad/s comes twice or out of order'),
    ):
        spoiled.to_netcdf(path)
        with pytest.raises(InputError, match=message):
            read_added_mass(path)


def test_a_bemio_file_that_lacks_something(tmp_path: Path) -> None:
    h5py = pytest.importorskip('h5py')
    path = tmp_path / 'tank.h5'
    path.write_bytes((DATA / 'hemisphere.h5').read_bytes())
    with h5py.File(path, 'a') as file:
        file['simulation_parameters/scaled'][...] = 1.0
    with pytest.raises(InputError, match='is scaled'):
        read_added_mass(path)
    with h5py.File(path, 'a') as file:
        del file['simulation_parameters/rho']
        file['simulation_parameters/rho'] = 'heavy'
    with pytest.raises(InputError, match="a 'simulation_parameters/rho' that is not of numbers"):
        read_added_mass(path)
    with h5py.File(path, 'a') as file:
        del file['simulation_parameters/rho']
    with pytest.raises(InputError, match="no 'simulation_parameters/rho'"):
        read_added_mass(path)


@pytest.mark.parametrize(
    ('name', 'library', 'hint'),
    [
        ('hemisphere.nc', 'xarray', 'pip install xarray netCDF4'),
        ('hemisphere.h5', 'h5py', 'pip install h5py'),
    ],
)
def test_a_missing_library_is_named_with_the_remedy(
    monkeypatch: pytest.MonkeyPatch, name: str, library: str, hint: str
) -> None:
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(InputError, match=hint):
        read_added_mass(DATA / name)


def test_a_missing_reader_of_netcdf_is_named() -> None:
    """In a process of its own: xarray asks once which readers there are."""
    pytest.importorskip('xarray')
    done = subprocess.run(
        [
            sys.executable, '-c',
            'import sys; sys.modules |= {"netCDF4": None, "h5netcdf": None}\n'
            'from slosh_ros.hydro.added_mass_files import read_added_mass\n'
            'from pathlib import Path\n'
            f'read_added_mass(Path({str(DATA / "hemisphere.nc")!r}))',
        ],
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert done.returncode == 1
    assert 'hemisphere.nc: needs netCDF4: pip install netCDF4' in done.stderr
