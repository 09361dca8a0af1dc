"""Histories as tables."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from slosh_ros.errors import InputError
from slosh_ros.vehicle import History


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
