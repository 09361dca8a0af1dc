"""What the added mass of a tank has to be, whatever the tank; what is not ends in an error."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slosh_ros.errors import InputError
from slosh_ros.hydro.added_mass import AddedMass

ASYMMETRY = 0.01  # of the geometric mean of the diagonal entries
RECIPROCITY = 0.05  # of the same
GAIN, GAINING = 0.01, 0.1  # negative damping over |A| that is no rounding; share of frequencies
CHANCE = 3.0  # standard deviations by which they outnumber the others


def check_entries(data: AddedMass) -> None:
    """Raise unless every frequency has the entries of surge, sway and yaw."""
    for i, j in ((0, 0), (1, 1), (3, 3), (4, 4), (5, 5), (0, 4), (1, 3)):
        known = np.isfinite(data.matrix[:, [i, j], [j, i]])
        absent: NDArray[np.bool_] = np.asarray(~known.all(axis=1))
        if absent.any():
            raise InputError(
                f'{data.source}: the entry {i + 1}{j + 1} is missing at {int(absent.sum())} of '
                f'{len(absent)} frequencies, first at {data.omega[np.argmax(absent)]:.4g} rad/s; '
                'surge needs 11, 15, 55, sway 22, 24, 44, yaw 66'
            )


def check_reciprocity(data: AddedMass, i: int, j: int) -> None:
    """Raise unless both triangles have the same entry, where they have it."""
    above, below = data.matrix[:, i, j], data.matrix[:, j, i]
    size = np.median(np.sqrt(np.abs(data.matrix[:, i, i] * data.matrix[:, j, j])))
    if not np.isfinite(size):
        size = np.median(np.abs(above))
    off = np.nan_to_num(np.abs(above - below))
    if np.median(off) > RECIPROCITY * size:
        n = int(np.argmax(off))
        raise InputError(
            f'{data.source}: at {data.omega[n]:.4g} rad/s the entry {i + 1}{j + 1} is '
            f'{above[n].real:.4g} kg m and {j + 1}{i + 1} is {below[n].real:.4g} kg m; they '
            'must be the same: write both triangles'
        )


def check_symmetry(data: AddedMass) -> None:
    """Raise unless the matrix is symmetric, and the tank about the planes x = 0 and y = 0."""
    for i, j in ((0, 4), (1, 3)):
        check_reciprocity(data, i, j)
    size = np.sqrt(np.median(np.abs(np.einsum('nii->ni', data.matrix)), axis=0))
    for i, j in ((0, 1), (0, 3), (0, 5), (1, 4), (1, 5), (3, 4), (3, 5), (4, 5)):
        coupling = np.nan_to_num(np.abs(data.matrix[:, [i, j], [j, i]])).max(axis=1)
        if np.median(coupling) > ASYMMETRY * size[i] * size[j]:
            raise InputError(
                f'{data.source}: the entry {i + 1}{j + 1} is not zero, as it is in a tank '
                'symmetric about the planes x = 0 and y = 0 through O; check the reference point'
            )


def check_damping(data: AddedMass) -> None:
    """Raise if motion gains energy by radiation; single points may, as spikes do, and noise."""
    for i in (0, 1, 3, 4, 5):
        over = data.matrix[:, i, i].imag / (np.abs(data.matrix[:, i, i]) + np.finfo(float).tiny)
        gains: NDArray[np.bool_] = np.asarray(over < -GAIN)
        gained, lost = int(gains.sum()), int(np.sum(over > GAIN))
        # noise alone gains as often as it loses
        chance = CHANCE * np.sqrt(gained + lost) if lost else 0.0
        if gained > GAINING * len(gains) and gained - lost > chance:
            n = int(np.argmax(gains))
            raise InputError(
                f'{data.source}: the radiation damping {i + 1}{i + 1} is negative at '
                f'{gained} of {len(gains)} frequencies, first at {data.omega[n]:.4g} '
                'rad/s: the liquid would make energy; check its sign'
            )
