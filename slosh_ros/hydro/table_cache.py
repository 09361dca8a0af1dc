"""
Fill tables that were built before, on the disk.

A table is stored under the hash of all that it follows from: the tank, the modes, the points of
pressure, and the source of what computes it. So another version never gets an old one. What cannot
be read, or is damaged, is computed anew; where nothing can be written, nothing is.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import platform
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path

import numpy as np
import scipy

from slosh_ros.hydro.coefficients import Array
from slosh_ros.hydro.fill_table import SWEPT_TOLERANCE, FillTable, Start
from slosh_ros.tank import Capsule, MeshTank, Tank

_FORMAT = 2  # of the files
_MOST = 60  # tables that are kept, the last ones that were asked for
_ROOMS = ('hydro', 'tank', 'constants.py')  # what tables are computed by


def known_table(tank: Tank, names: Sequence[str], points: Array | None = None) -> FillTable:
    """
    Take a table from the disk, bit for bit as it was built, or build it and leave it there.

    Parameters
    ----------
    tank, names, points
        See :class:`~slosh_ros.hydro.fill_table.FillTable`.
    """
    return _known((tank, tuple(names)), points, lambda: FillTable(tank, names, points))


def known_sweep(tank: Capsule | MeshTank, start: Start, points: Array | None = None) -> FillTable:
    """
    Take such a table of a tank of any shape, whose modes are followed from a fill.

    Parameters
    ----------
    tank : Capsule or MeshTank
        The tank.
    start : Start
        Where which modes have their names.
    points : array, shape (p, 3), optional
        See :class:`~slosh_ros.hydro.fill_table.FillTable`.
    """
    from slosh_ros.hydro.volume_sweep import VolumeSweep

    def table() -> FillTable:
        sweep = VolumeSweep(tank, start, many=True)
        return FillTable(tank, (), points, SWEPT_TOLERANCE, sweep.at)

    return _known((tank, start), points, table)


def _known(
    what: tuple[object, ...], points: Array | None, new: Callable[[], FillTable]
) -> FillTable:
    table = new()
    try:
        path = _folder() / f'fill-{_key(what, points)}.npz'
    except (OSError, RuntimeError):  # no home, or no source
        return table.build()
    if _read(path, table):
        return table
    table = new().build()  # a file may have been taken up in part
    _write(path, table)
    return table


def _read(path: Path, table: FillTable) -> bool:
    try:
        with path.open('rb') as file, np.load(file, allow_pickle=False) as stored:
            table.restore({name: stored[name] for name in stored.files})
        path.touch()
    except Exception:  # a damaged file may break anywhere: it is as good as none
        return False
    return True


def _write(path: Path, table: FillTable) -> None:
    """Write the whole file or none; others may do the same at the same time."""
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, suffix='.part', delete=False) as file:
            try:
                np.savez(file, **table.stored())  # type: ignore[arg-type]
                file.close()
                Path(file.name).replace(path)
            except OSError:
                Path(file.name).unlink(missing_ok=True)
        known = sorted(path.parent.glob('fill-*.npz'), key=lambda file: file.stat().st_mtime)
        for old in known[:-_MOST]:
            old.unlink(missing_ok=True)


def _folder() -> Path:
    """Where the XDG Base Directory Specification puts caches."""
    given = os.environ.get('XDG_CACHE_HOME', '')
    home = Path(given) if os.path.isabs(given) else Path.home() / '.cache'
    return home / 'slosh_ros'


def _key(what: tuple[object, ...], points: Array | None) -> str:
    points = np.zeros((0, 3)) if points is None else points
    told = _told((_FORMAT, _source(), *what, points))
    return hashlib.sha256(told.encode()).hexdigest()[:40]


def _told(thing: object) -> str:
    """Tell all that a value holds."""
    if is_dataclass(thing):
        parts = [f'{f.name}={_told(getattr(thing, f.name))}' for f in fields(thing)]
        return f'{type(thing).__name__}({", ".join(parts)})'
    if isinstance(thing, np.ndarray):
        digest = hashlib.sha256(np.ascontiguousarray(thing).tobytes()).hexdigest()
        return f'array({thing.dtype}, {thing.shape}, {digest})'
    if isinstance(thing, tuple):
        return f'({", ".join(map(_told, thing))})'
    return repr(thing)


@cache
def _source() -> str:
    """Digest of the source of what computes, and of what that stands on."""
    digest = hashlib.sha256()
    house = Path(__file__).resolve().parents[1]
    for room in map(house.joinpath, _ROOMS):
        for path in sorted(room.glob('*.py')) if room.is_dir() else [room]:
            digest.update(f'{path.name}\n'.encode() + path.read_bytes())
    digest.update(f'{np.__version__} {scipy.__version__} {platform.machine()}'.encode())
    return digest.hexdigest()
