"""Histories as tables."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from slosh_ros.errors import InputError
from slosh_ros.modal.validity import Trust
from slosh_ros.vehicle import History


def summary(history: History) -> dict[tuple[str, str], float]:
    """
    Condense a simulated drive to what tells how near it comes to trouble.

    Parameters
    ----------
    history : History
        The drive.

    Returns
    -------
    dict
        Values by name and unit; largest magnitudes, but for the lowest wheel loads and for the
        times of lifting off, which are infinite where no wheel does.
    """
    f, axles = history.figures, range(1, 5)
    force, moment = np.abs(history.slosh[:, :3]) / 1e3, np.abs(history.slosh[:, 3:]) / 1e3
    return {
        ('sloshing force, fore-aft', 'kN'): float(force[:, 0].max()),
        ('sloshing force, sideways', 'kN'): float(force[:, 1].max()),
        ('sloshing moment, roll', 'kN m'): float(moment[:, 0].max()),
        ('sloshing moment, pitch', 'kN m'): float(moment[:, 1].max()),
        ('semitrailer pitch', 'deg'): float(np.degrees(f.pitch)),
        ('semitrailer roll', 'deg'): float(np.degrees(f.roll)),
        ('lateral acceleration', 'm/s^2'): f.lateral_acceleration,
        ('load transfer ratio, vehicle', ''): f.load_transfer,
        ('load transfer ratio, tractor', ''): f.tractor,
        ('load transfer ratio, semitrailer', ''): f.semitrailer,
        **{(f'load transfer ratio, axle {i}', ''): x for i, x in zip(axles, f.axles, strict=True)},
        **{
            (f'lowest wheel load, axle {i}', 'kN'): x / 1e3
            for i, x in zip(axles, f.lowest_loads, strict=True)
        },
        **{
            (f'wheel lifts off, axle {i}', 's'): x for i, x in zip(axles, f.lift_offs, strict=True)
        },
        ('wave height', 'm'): float(np.max(history.elevation_max, initial=0.0)),
        ('use of linear theory, limit 1', ''): max(map(Trust.use, history.trust)),
    }


def write_history(history: History, path: Path) -> None:
    """
    Write a simulated drive as CSV, doubles in full, columns named as in the contract.

    Raises
    ------
    InputError
        If the ending is not `.csv` or the place cannot be written to.
    """
    if path.suffix != '.csv':
        raise InputError(f"{path}: its ending must be .csv, not '{path.suffix}'")
    columns = history.columns
    rows = np.column_stack(list(columns.values())).tolist()
    try:
        with path.open('w', encoding='ascii') as file:
            file.write(','.join(columns) + '\n')
            file.writelines(','.join(map(repr, row)) + '\n' for row in rows)
    except OSError as error:
        raise InputError(f'{path}: cannot be written: {error.strerror}') from error
