"""
Added mass from and to the files of boundary element codes.

* WAMIT `.1`: lines `PER I J A [B]` with A = A_ij/(rho L^k), B = B_ij/(rho L^k omega), k = 3, 4, 5
  for two translations, one of each, two rotations; PER < 0 is zero, PER = 0 infinite frequency.
  Density, length scale (ULEN) and reference point (XBODY) stand elsewhere and must be given.
* Capytaine's NetCDF: SI units, `rho` and `rotation_center` within.
* HDF5 of WEC-Sim's BEMIO: A/rho and B/(rho omega), about the body's centre of gravity.

All three have z up from the mean free surface. Reading NetCDF needs xarray with netCDF4 or
h5netcdf, HDF5 needs h5py; both are imported only then.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slosh_ros.errors import InputError
from slosh_ros.hydro.added_mass import AddedMass

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_DOFS = ('Surge', 'Sway', 'Heave', 'Roll', 'Pitch', 'Yaw')
_ROTATES = np.array([0, 0, 0, 1, 1, 1])
_POWERS = 3.0 + _ROTATES + _ROTATES[:, np.newaxis]  # of the length scale
_DENSITY_RANGE = (1e-3, 3e4)  # [kg/m^3]


def read_added_mass(
    path: Path,
    *,
    density: float | None = None,
    reference: ArrayLike | None = None,
    length_scale: float | None = None,
    surface_centre: ArrayLike = (0.0, 0.0, 0.0),
    hydrostatic: bool | None = None,
    first_column: str = 'period',
) -> AddedMass:
    """
    Read total added mass from a file; the suffix tells which kind.

    Parameters
    ----------
    path : Path
        `.1`, `.nc`, `.h5` or `.hdf5`.
    density : float, optional
        Density of the liquid [kg/m^3]; needed for `.1`, checked against the others'.
    reference : array_like, shape (3,), optional
        Point of the moments and rotations in the axes of the file [m]; needed for `.1` and where
        the file has none, checked against it where it has.
    length_scale : float, optional
        Length that made a `.1` dimensionless, ULEN [m]; needed for `.1`.
    surface_centre : array_like, shape (3,)
        O, the centre of the mean free surface, in the axes of the file [m].
    hydrostatic : bool, optional
        See :class:`~slosh_ros.hydro.added_mass.AddedMass`; as the file tells, or true.
    first_column : str
        Of a `.1`: `period` [s], or `frequency` [rad/s] (IPEROUT = 2), where 0 is zero and a
        negative number infinite frequency.

    Raises
    ------
    InputError
        If something is missing or does not fit; the message names file, place and reason.
    """
    suffix = path.suffix.lower()
    within: bool | None = None
    try:
        if suffix == '.1':
            omega, matrix, rho, point = _read_wamit(path, density, length_scale, first_column)
        elif suffix == '.nc':
            omega, matrix, rho, point, within = _read_netcdf(path)
        elif suffix in ('.h5', '.hdf5'):
            omega, matrix, rho, point = _read_bemio(path)
        else:
            raise InputError(
                f"ends in '{suffix}'; added mass is read from .1 (WAMIT), .nc (Capytaine) and "
                '.h5 (BEMIO)'
            )
        _check_density(rho, density)
        if point is None and reference is None:
            raise InputError(
                'does not tell the point of its moments; give reference, which is '
                'added_mass_reference in a configuration'
            )
        if point is None:
            point = np.asarray(reference, dtype=float)
        elif reference is not None and not np.allclose(point, reference, atol=1e-6):
            raise InputError(
                f'has its moments about {point.tolist()}, not about the given '
                f'{np.asarray(reference).tolist()} m'
            )
        if None not in (within, hydrostatic) and within != hydrostatic:
            raise InputError(
                f'{"holds" if within else "lacks"} the hydrostatic part of 44 and 55, as its '
                'attribute hydrostatic_in_added_mass tells; you say the contrary'
            )
        hydrostatic = within if hydrostatic is None else hydrostatic
        order = np.argsort(omega)
        return AddedMass(
            omega=omega[order],
            matrix=matrix[order],
            density=rho,
            reference=point - np.asarray(surface_centre, dtype=float),
            hydrostatic=True if hydrostatic is None else hydrostatic,
            source=str(path),
        )
    except InputError as error:
        raise InputError(f'{path}: {str(error).removeprefix(f"{path}: ")}') from error


def describe(data: AddedMass) -> str:
    """Say in a few lines what was read, for people to check."""
    finite = data.omega[np.isfinite(data.omega) & (data.omega > 0.0)]
    limits = [
        name for name, there in (('0', 0.0), ('infinity', np.inf)) if np.any(data.omega == there)
    ]
    known = [
        f'{i + 1}{j + 1}'
        for i, j in ((0, 0), (1, 1), (0, 4), (1, 3), (3, 3), (4, 4), (5, 5))
        if data.has((i, j))
    ]
    return (
        f'{data.source}: {len(finite)} frequencies from {finite.min():.4g} to '
        f'{finite.max():.4g} rad/s{" and " + ", ".join(limits) if limits else ""}; '
        f'density {data.density:g} kg/m^3; moments about {data.reference.tolist()} m from the '
        f'centre of the mean free surface, x forward, y left, z up; entries {", ".join(known)}; '
        f'A11 = {data.matrix[0, 0, 0].real:.5g} kg at {data.omega[0]:.4g} rad/s'
    )


def write_added_mass(path: Path, data: AddedMass) -> None:
    """
    Write NetCDF as Capytaine lays it out: SI, added mass and radiation damping by name of motion.

    Radiation damping omega Im A has no value at 0 and infinite frequency and is 0 there.
    """
    xarray = _library('xarray', 'xarray netCDF4')
    finite = np.isfinite(data.omega)
    damping = np.zeros(data.matrix.shape)
    damping[finite] = data.matrix.imag[finite] * data.omega[finite, np.newaxis, np.newaxis]
    axes = ('omega', 'influenced_dof', 'radiating_dof')
    dataset = xarray.Dataset(
        {
            'added_mass': (axes, data.matrix.real, {'long_name': 'Added mass'}),
            'radiation_damping': (axes, damping, {'long_name': 'Radiation damping'}),
        },
        {
            'omega': ('omega', data.omega, {'units': 'rad/s'}),
            'influenced_dof': list(_DOFS),
            'radiating_dof': list(_DOFS),
            'space_coordinate': ['x', 'y', 'z'],
            'rotation_center': ('space_coordinate', data.reference, {'units': 'm'}),
            'rho': ((), data.density, {'units': 'kg/m^3'}),
        },
        {'hydrostatic_in_added_mass': int(data.hydrostatic), 'source': data.source},
    )
    dataset.to_netcdf(path)


_Content = tuple[Array, ComplexArray, float, Array | None]


def _read_wamit(
    path: Path, density: float | None, length_scale: float | None, first_column: str
) -> _Content:
    missing = [
        name
        for name, value in (('density', density), ('length_scale', length_scale))
        if value is None
    ]
    if density is None or length_scale is None:
        raise InputError(f'is dimensionless; give {" and ".join(missing)} (rho and ULEN)')
    if not length_scale > 0.0:
        raise InputError(f'cannot have a length scale of {length_scale:g} m')
    if first_column not in ('period', 'frequency'):
        raise InputError(f"cannot have '{first_column}' first; write period or frequency")
    entries: dict[float, dict[tuple[int, int], complex]] = {}
    lines: list[int] = []  # at which a frequency comes first
    for number, line in enumerate(_lines(path), start=1):
        if not line.split():
            continue
        try:
            at, i, j, value = _wamit_line(line.split(), first_column)
        except InputError as error:
            if number == 1 and not _is_number(line.split()[0]):
                continue  # a header, which WAMIT writes on request
            raise InputError(f'line {number}: {error}') from error
        if at not in entries:
            lines.append(number)
        of_frequency = entries.setdefault(at, {})
        if (i, j) in of_frequency:
            raise InputError(f'line {number}: entry {i + 1}{j + 1} of this frequency comes twice')
        of_frequency[i, j] = value
    if not entries:
        raise InputError('is empty')
    omega = np.array(list(entries))
    matrix = np.full((len(omega), 6, 6), np.nan, dtype=np.complex128)
    for n, of_frequency in enumerate(entries.values()):
        for (i, j), value in of_frequency.items():
            matrix[n, i, j] = value
    _fill_zeros(omega, matrix, lines)
    scale: Array = density * length_scale**_POWERS
    return omega, np.asarray(matrix * scale, dtype=complex), density, None


def _wamit_line(words: list[str], first_column: str) -> tuple[float, int, int, complex]:
    if len(words) not in (4, 5):
        raise InputError(f'has {len(words)} columns; it needs PER I J A, and B if 0 < PER')
    try:
        first, *values = (float(words[n].replace('D', 'E')) for n in (0, *range(3, len(words))))
        i, j = int(words[1]), int(words[2])
    except ValueError as error:
        raise InputError(f'has a word that is no number: {" ".join(words)}') from error
    if not np.all(np.isfinite([first, *values])):
        raise InputError(f'has a number that is not finite: {" ".join(words)}')
    if not (1 <= i <= 6 and 1 <= j <= 6):
        raise InputError(f'has I J = {i} {j}; one rigid tank has 1 to 6')
    if first > 0.0 and len(values) < 2:
        raise InputError('has no B')
    if first_column == 'period':
        omega = 2.0 * np.pi / first if first > 0.0 else (np.inf if first == 0.0 else 0.0)
    else:
        omega = first if first >= 0.0 else np.inf
    damping = values[1] if len(values) == 2 and first > 0.0 else 0.0
    return omega, i - 1, j - 1, complex(values[0], damping)  # B is over omega already


def _fill_zeros(omega: Array, matrix: NDArray[np.complex128], lines: list[int]) -> None:
    """Put zeros where symmetry let WAMIT leave an entry out: at all frequencies or none."""
    absent = np.isnan(matrix)
    halved = absent.all(axis=0) & ~absent.all(axis=0).T
    if halved.any():
        i, j = np.argwhere(halved)[0]
        raise InputError(
            f'has the entry {j + 1}{i + 1} but nowhere {i + 1}{j + 1}; write both triangles'
        )
    partly = absent.any(axis=0) & ~absent.all(axis=0)
    if partly.any():
        i, j = np.argwhere(partly)[0]
        n = int(np.argmax(absent[:, i, j]))
        raise InputError(
            f'lacks entry {i + 1}{j + 1} at {omega[n]:.6g} rad/s, which comes first in line '
            f'{lines[n]}, but has it at other frequencies'
        )
    solved = ~np.einsum('nii->ni', absent).any(axis=0)
    matrix[absent & np.outer(solved, solved)] = 0.0


def _read_netcdf(path: Path) -> tuple[Array, ComplexArray, float, Array | None, bool | None]:
    xarray = _library('xarray', 'xarray netCDF4')
    try:
        dataset = xarray.load_dataset(path)
    except (OSError, ValueError) as error:
        reason = _first_line(error)
        if 'dependencies may not be installed' in reason:
            raise InputError('needs netCDF4: pip install netCDF4') from error
        reason = reason.split('. Consider')[0]  # advice of xarray, which goes on over more lines
        raise InputError(f'cannot be read as NetCDF: {reason}') from error
    for name in ('added_mass', 'radiation_damping'):
        if name not in dataset:
            raise InputError(f"has no variable '{name}'; is it a dataset of Capytaine?")
    frequency = next(
        (n for n in ('omega', 'period', 'freq') if n in dataset.added_mass.dims), None
    )
    if frequency is None or 'omega' not in dataset.coords:
        raise InputError(f'has added_mass over {dataset.added_mass.dims}; it must be over omega')
    axes = (frequency, 'influenced_dof', 'radiating_dof')
    tables = []
    for name in ('added_mass', 'radiation_damping'):
        table = dataset[name]
        for dim in table.dims:
            if dim not in axes:
                if table.sizes[dim] > 1:
                    raise InputError(f'has {table.sizes[dim]} values of {dim}; select one of them')
                table = table.squeeze(dim, drop=True)
        for axis in axes[1:]:
            there = [str(name) for name in table[axis].values]
            lacking = [name for name in _DOFS if name not in there]
            if lacking:
                raise InputError(
                    f'lacks {", ".join(lacking)} in {axis}; it has {", ".join(there)}: rename them'
                )
            table = table.sel({axis: list(_DOFS)})
        tables.append(_numbers(table.transpose(*axes).values, name))
    if 'rho' not in dataset.coords or np.size(dataset.rho.values) != 1:
        raise InputError("has no single density 'rho'")
    point = None
    if 'rotation_center' in dataset.variables:
        point = _numbers(dataset.rotation_center.values, 'rotation_center').ravel()
        if point.shape != (3,) or not np.all(np.isfinite(point)):
            raise InputError(f'has a rotation_center of {point.tolist()}')
    omega = _numbers(dataset.omega.values, 'omega')
    within = dataset.attrs.get('hydrostatic_in_added_mass')
    return (
        omega,
        _complex(omega, *tables),
        float(_numbers(dataset.rho.values, 'rho').ravel()[0]),
        point,
        None if within is None else bool(within),
    )


def _read_bemio(path: Path) -> _Content:
    h5py = _library('h5py', 'h5py')
    try:
        with h5py.File(path, 'r') as file:
            found = {
                name: _numbers(_dataset(file, name), name)
                for name in (
                    'simulation_parameters/rho',
                    'simulation_parameters/w',
                    'simulation_parameters/scaled',
                    'body1/properties/cg',
                    'body1/hydro_coeffs/added_mass/all',
                    'body1/hydro_coeffs/added_mass/inf_freq',
                    'body1/hydro_coeffs/radiation_damping/all',
                )
            }
            bodies = sum(name.startswith('body') for name in file)
    except OSError as error:
        raise InputError(f'cannot be read as HDF5: {_first_line(error)}') from error
    rho, omega, scaled, point, added, infinite, damping = found.values()
    if bodies > 1:
        raise InputError(f'has {bodies} bodies; a tank is one')
    omega, density = omega.ravel(), float(rho.ravel()[0])
    if added.shape != (6, 6, len(omega)) or damping.shape != added.shape:
        raise InputError(
            f'has added_mass/all of shape {added.shape}; {len(omega)} frequencies of one body '
            f'need (6, 6, {len(omega)})'
        )
    if infinite.shape != (6, 6):
        raise InputError(f'has added_mass/inf_freq of shape {infinite.shape}, not (6, 6)')
    if scaled.ravel()[0]:
        raise InputError('is scaled; write it with simulation_parameters/scaled = 0')
    matrix = np.moveaxis(added + 1j * damping, 2, 0)  # B is over omega already
    with_limit = density * np.concatenate([matrix, infinite[np.newaxis]])
    return (
        np.append(omega, np.inf),
        np.asarray(with_limit, dtype=complex),
        density,
        np.asarray(point.ravel(), dtype=float),
    )


def _complex(omega: Array, added: Array, damping: Array) -> NDArray[np.complex128]:
    """Return A + i B/omega; B counts at finite frequencies only."""
    inner = np.isfinite(omega) & (omega > 0.0)
    over = np.zeros_like(damping)
    over[inner] = damping[inner] / omega[inner, np.newaxis, np.newaxis]
    return np.asarray(added + 1j * over, dtype=complex)


def _dataset(file: Any, name: str) -> Any:
    if name not in file or not hasattr(file[name], 'shape'):  # a group
        raise InputError(f"has no '{name}'; is it a file of BEMIO?")
    return file[name][()]


def _numbers(values: Any, name: str) -> Array:
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(f"has a '{name}' that is not of numbers") from error


def _check_density(found: float, given: float | None) -> None:
    low, high = _DENSITY_RANGE
    if not low <= found <= high:
        raise InputError(f'has a density of {found:g} kg/m^3, out of {low:g} to {high:g}')
    if given is not None and abs(found - given) > 1e-3 * given:
        raise InputError(
            f'is for a density of {found:g} kg/m^3, not for the given {given:g} kg/m^3'
        )


def _lines(path: Path) -> list[str]:
    try:
        return path.read_text(encoding='utf-8').splitlines()
    except OSError as error:
        raise InputError(f'cannot be read: {error.strerror}') from error
    except UnicodeDecodeError as error:
        raise InputError('is not a text file') from error


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _library(name: str, packages: str) -> ModuleType:
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        raise InputError(f'needs {name}: pip install {packages}') from error


def _first_line(error: Exception) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[0]
