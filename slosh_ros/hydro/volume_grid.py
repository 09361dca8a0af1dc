"""A grid of cells around a liquid, fine where its waves are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slosh_ros.hydro.coefficients import Array
from slosh_ros.hydro.volume_splines import Axis
from slosh_ros.tank.surface import LiquidSurface

_LEANING = 0.01  # [of the liquid's extent] by which a wall leans out over the free surface
_AT_CONTACT = 0.25  # [cells of the waves] how fine the grid is where it does: a singularity
_GROWTH = 0.5  # of cells with the distance from there, and from the free surface
_FEWEST = 5.0  # cells in half the liquid, and in half the free surface
_FEWEST_AT_CONTACT = 3.0  # there they are smaller
_FEWEST_DOWN = 3.0  # from the free surface to the bottom


def grid_around(
    surface: LiquidSurface,
    symmetric: tuple[bool, bool],
    cell: float,
    degree: int,
    finer: Sequence[float] = (1.0, 1.0, 1.0),
    cells: Sequence[int] | None = None,
) -> tuple[Axis, Axis, Axis]:
    """
    Divide the box around a liquid.

    Parameters
    ----------
    surface : LiquidSurface
        Of the liquid, folded where it is symmetric.
    symmetric : tuple of bool
        Whether it is folded at x = 0, and at y = 0.
    cell : float
        Size of the cells that the waves need [m].
    degree : int
        Of the splines.
    finer : sequence of float
        By which the cells are smaller than that along x, y and z, wherever they are.
    cells : sequence of int, optional
        How many there shall be instead along x, y and z.
    """
    corners, rim = (part.reshape(-1, 3) for part in (surface.triangles, surface.free))
    low, high = corners.min(axis=0), corners.max(axis=0)
    axes, leans = [], False
    counts = (None, None, None) if cells is None else cells
    for k in range(2):
        whole = 0.0 if symmetric[k] else low[k], high[k]
        top = 0.0 if symmetric[k] else rim[:, k].min(), rim[:, k].max()
        contact = [
            end
            for end, limit in zip(top, whole, strict=True)
            if abs(end - limit) > _LEANING * (whole[1] - whole[0])
        ]
        sides = 1.0 if symmetric[k] else 2.0
        fewest = _FEWEST_AT_CONTACT if contact else _FEWEST
        waves = min(cell, (top[1] - top[0]) / sides / fewest)

        place = _places(*whole)
        outside = (place < top[0]) | (place > top[1])
        size = np.where(outside, (whole[1] - whole[0]) / sides / _FEWEST, waves)
        for end in contact:
            size = np.minimum(size, _AT_CONTACT * waves + _GROWTH * np.abs(place - end))
        axes.append(Axis(_divided(*whole, size / finer[k], counts[k]), degree))
        leans |= bool(contact)

    place = _places(low[2], 0.0)
    finest = cell * (_AT_CONTACT if leans else 1.0)
    size = np.minimum(finest - _GROWTH * place, -low[2] / _FEWEST_DOWN)
    return axes[0], axes[1], Axis(_divided(low[2], 0.0, size / finer[2], counts[2]), degree)


def _places(low: float, high: float, count: int = 2000) -> Array:
    """Middles of so many equal parts of an interval."""
    return low + (high - low) * (np.arange(count) + 0.5) / count


def _divided(low: float, high: float, size: Array, cells: int | None = None) -> Array:
    """Divide an interval into cells of the sizes wished for at its places, or into so many."""
    step = (high - low) / len(size)
    count = np.append(0.0, np.cumsum(step / size))
    ends = np.linspace(0.0, count[-1], (cells or int(np.ceil(count[-1]))) + 1)
    return np.interp(ends, count, np.linspace(low, high, len(size) + 1))
