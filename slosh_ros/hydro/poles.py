"""
What a family of modes makes of the added mass over frequency (THEORY 5).

Over x = omega^2 a family of modes that share a plane of motion (surge with pitch, sway with roll)
has, with s = +1 for surge and -1 for sway, the lever l = lambda_5/lambda_1 (lambda_4/lambda_2),
and the modal mass R = lambda_1^2/mu > 0,

    A_push  = k_0 + sum R x/D,
    A_cross = k_1 + sum R (l x + s g)/D,
    A_turn  = k_2 + sum R (l^2 x + 2 s g l + (1 + i delta) g^2/x_m)/D,  D = x_m - x (1 + i delta),

which are eqs (32)-(35) with the liquid under its lid, the hydrostatic moment of the modes that
are not resolved in k_1, and what is the same at all frequencies in k_0 and k_2. So each mode takes
one pole x_m, one R and one lever for all entries together; yaw has A_66 alone.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY

Array = NDArray[np.float64]

SMALLEST_LOSS = 1e-9  # of modes without any, so that they are finite at their pole


class Family(NamedTuple):
    """Modes that share a plane of motion: rows of the 6x6 matrix, and s of the module's notes."""

    name: str
    push: int
    turn: int
    sign: float


SURGE = Family('surge', 0, 4, 1.0)
SWAY = Family('sway', 1, 3, -1.0)
YAW = Family('yaw', 5, 5, 0.0)


class Modes(NamedTuple):
    """
    Modes of one family.

    Attributes
    ----------
    omega : array, shape (m,)
        Natural frequencies [rad/s].
    mass : array, shape (m,)
        R = lambda^2/mu, positive [kg], of yaw [kg m^2].
    lever : array, shape (m,)
        lambda_5/lambda_1, lambda_4/lambda_2 [m].
    loss : array, shape (m,)
        Loss factor delta, twice the damping ratio at resonance.
    """

    omega: Array
    mass: Array
    lever: Array
    loss: Array

    @property
    def hanging(self) -> Array:
        """Return g R/omega^2, what a mode adds to the hydrostatic moment [kg m]."""
        hanging: Array = GRAVITY * self.mass / self.omega**2
        return hanging

    def take(self, which: NDArray[np.bool_] | NDArray[np.intp]) -> Modes:
        """Return some of them."""
        return Modes(*(of[which] for of in self))

    def without(self, *which: int) -> Modes:
        """Return the others."""
        return Modes(*(np.delete(of, which) for of in self))

    def joined(self, other: Modes, at: int | None = None) -> Modes:
        """Return these with another put at a place, the end by default."""
        place = len(self.omega) if at is None else at
        return Modes(*(np.insert(mine, place, its) for mine, its in zip(self, other, strict=True)))


class PoleModel(NamedTuple):
    """
    The first entries (push, cross, turn) of the module's notes at given frequencies.

    Attributes
    ----------
    x : array, shape (n,)
        Squares of the frequencies; 0 and infinity may be among them.
    entries : int
        How many entries, from one to three.
    sign : float
        s of the module's notes.
    lossy : bool
        Modes have losses.
    """

    x: Array
    entries: int
    sign: float
    lossy: bool

    def values(self, modes: Modes, constants: Array) -> Array:
        """Real parts of the entries, (entries, n)."""
        total: Array = self.shapes(modes) @ modes.mass + constants[:, np.newaxis]
        return total

    def shapes(self, modes: Modes) -> Array:
        """Real parts of what modes with R = 1 make, (entries, n, modes)."""
        return np.asarray(np.real(self._shapes(modes)[0]))

    def slopes(self, modes: Modes) -> Array:
        """How the real parts change with log omega, log R, lever, log delta: (.., 4 modes)."""
        shapes, response, over, lossy = self._shapes(modes)
        pole = modes.omega**2
        by_pole = -shapes * over
        by_lever = np.zeros_like(shapes)
        by_loss = 1j * shapes * np.where(np.isinf(self.x)[:, np.newaxis], 0.0, response)
        if self.entries > 1:
            by_lever[1] = response
        if self.entries > 2:
            by_lever[2] = 2.0 * shapes[1]
            by_pole[2] -= (GRAVITY / pole) ** 2 * lossy * over
            by_loss[2] += 1j * GRAVITY**2 / pole * over
        each = [2.0 * pole * by_pole, shapes, by_lever, modes.loss * by_loss]
        return np.asarray(np.real(np.concatenate([modes.mass * of for of in each], axis=2)))

    def by_lever(self, modes: Modes) -> Array:
        """Real parts of what goes with R, R l and R l^2, whatever the lever: (.., entries)."""
        response, over, lossy = self._over(modes)
        tilt, hinge = self.sign * GRAVITY * over, (GRAVITY / modes.omega) ** 2 * lossy * over
        none = np.zeros_like(response)
        table = [[response, none, none], [tilt, response, none], [hinge, 2.0 * tilt, response]]
        rows = [np.stack(row[: self.entries], axis=-1) for row in table[: self.entries]]
        return np.asarray(np.real(np.stack(rows)))

    def _shapes(self, modes: Modes) -> tuple[NDArray[Any], ...]:
        response, over, lossy = self._over(modes)
        tilt = self.sign * GRAVITY
        shapes = [response]
        if self.entries > 1:
            shapes.append(modes.lever * response + tilt * over)
        if self.entries > 2:
            hinge = (GRAVITY / modes.omega) ** 2 * lossy * over
            shapes.append(modes.lever * (shapes[1] + tilt * over) + hinge)
        return np.stack(shapes), response, over, lossy

    def _over(self, modes: Modes) -> tuple[NDArray[Any], ...]:
        """Return x/D and 1/D, (n, modes), and 1 + i delta."""
        infinite = np.isinf(self.x)[:, np.newaxis]
        x = np.where(infinite, 0.0, self.x[:, np.newaxis])
        if self.lossy:
            lossy = 1.0 + 1j * modes.loss
            over = 1.0 / (modes.omega**2 - x * lossy)
        else:
            lossy = np.ones_like(modes.omega)
            gap = modes.omega**2 - x
            over = gap / (gap**2 + (SMALLEST_LOSS * modes.omega**2) ** 2)
        over = np.where(infinite, 0.0, over)
        return np.where(infinite, -1.0, x * over), over, lossy
