"""
Least squares for a given number of poles, from near by: all parameters at once.

What is unknown of a mode is taken as log omega, log R, lever and log delta, so that R > 0 whatever
the data, and no bound is in the way.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from slosh_ros.hydro.pole_noise import FREEDOM, spread, steepness, surprise, weight
from slosh_ros.hydro.poles import Modes, PoleModel

Array = NDArray[np.float64]

BEST_NOISE = 1e-5  # relative; no boundary element code is better than that
FLOOR = 0.03  # of the median modulus: at first, deviations below it count as those of this
FEW_STEPS, MANY_STEPS = 20, 60  # of least squares, to come near and to come home
NEAR, HOME = 1e-4, 1e-8  # relative change of the sum of squares at which that is so
ROUNDS = 3  # of least squares and spread in turn
SPREAD_FOUND = 0.05  # relative change of the spread from which there is no other round
FAR = 50.0  # times the end of the band, above which poles do not go; squared, below


class Solved(NamedTuple):
    """
    Where least squares came to.

    Attributes
    ----------
    modes : Modes
        In any order, those above the band included.
    constants : array, shape (entries,)
        k_0, k_1, k_2.
    spread : array, shape (entries, n)
        Of each value of the data.
    deviation : array, shape (entries, n)
        Of the fit from the data, over the spread.
    criterion : float
        Bayes's information criterion, less what is the same for all.
    """

    modes: Modes
    constants: Array
    spread: Array
    deviation: Array
    criterion: float


@dataclass(frozen=True, eq=False)
class PoleFit:
    """
    Data, and what they are fitted with.

    Attributes
    ----------
    model : PoleModel
        What modes make.
    values : array, shape (entries, n)
        Real parts of the data.
    modulus : array, shape (entries, n)
        What noise in proportion is in proportion to.
    level : array, shape (entries, 1)
        Typical modulus of each entry.
    band_end : float
        Last frequency of the band [rad/s]; what is above it stands for infinity.
    settled : bool
        The poles are near: each entry tells its own noise, both the same everywhere and in
        proportion. False: all deviations count relative, lest one entry be taken for noise.
    known : array, shape (2, k), or None
        A_push and A_cross at frequency 0, and their spread.
    """

    model: PoleModel
    values: Array
    modulus: Array
    level: Array
    band_end: float
    settled: bool = False
    known: Array | None = None

    @property
    def per_mode(self) -> int:
        """Return how many numbers are to be found for a mode."""
        return 2 + (self.model.entries > 1) + self.model.lossy

    def refined(
        self,
        modes: Modes,
        constants: Array,
        spreads: Array | None = None,
        rounds: int = ROUNDS,
        near: bool = False,
    ) -> Solved:
        """Move all parameters from the given ones to the most likely, and find the spread."""
        if spreads is None:
            spreads = self._spread(modes, constants)
        for _ in range(rounds):
            modes, constants = self._least_squares(modes, constants, spreads, near)
            before, spreads = spreads, self._spread(modes, constants)
            if np.allclose(spreads, before, rtol=SPREAD_FOUND):
                break
        z = self._deviations(modes, constants, spreads)
        z = z[: self.values.size].reshape(self.values.shape)
        free = self.per_mode * len(modes.omega) + self.model.entries
        return Solved(
            modes,
            constants,
            spreads,
            z,
            float(np.sum(surprise(z**2)) + 2.0 * np.sum(np.log(spreads)) + free * np.log(z.size)),
        )

    def covariance(self, solved: Solved) -> Array:
        """
        Covariance of the parameters, as Huber has it for any likelihood (Ann. Stat. 1, 1973).

        Parameters
        ----------
        solved : Solved
            A fit.

        Returns
        -------
        array, shape (4 modes + entries, 4 modes + entries)
            Of log omega, log R, lever and log delta of each mode, and of the constants.
        """
        square = solved.deviation**2
        free = self.free(len(solved.modes.omega))
        slopes = self.slopes(solved.modes, solved.spread)[:, free]
        scale: Array = np.linalg.norm(slopes, axis=0) + 1e-100
        normal = (slopes / scale).T @ (slopes / scale)
        # the pseudo-inverse leaves out what the data do not tell
        inverse: Array = np.linalg.pinv(normal, rcond=1e-13, hermitian=True) / np.outer(
            scale, scale
        )
        size = float(np.mean(weight(square) ** 2 * square))
        size /= max(0.1, float(np.mean(steepness(square)))) ** 2
        size *= square.size / max(square.size - int(np.count_nonzero(free)), 1)
        full = np.zeros((len(free), len(free)))
        full[np.ix_(free, free)] = size * inverse
        return full

    def at_rest(self, modes: Modes, constants: Array) -> Array:
        """A_push and A_cross of a fit at frequency 0; of a single entry the first alone."""
        rest = constants[:2].copy()
        rest[1:] += self.model.sign * modes.hanging.sum()
        return rest

    def at_rest_slopes(self, modes: Modes) -> Array:
        """How they change with all parameters, (entries, parameters)."""
        count = len(modes.omega)
        slopes = np.zeros((min(self.model.entries, 2), 4 * count + self.model.entries))
        slopes[:, 4 * count : 4 * count + 2] = np.eye(len(slopes))
        slopes[1:, :count] = -2.0 * self.model.sign * modes.hanging
        slopes[1:, count : 2 * count] = self.model.sign * modes.hanging
        return slopes

    def free(self, count: int) -> NDArray[np.bool_]:
        """Tell which parameters of so many modes and of the constants are to be found."""
        each = [count] * 4 + [self.model.entries]
        return np.repeat([True, True, self.model.entries > 1, self.model.lossy, True], each)

    def _spread(self, modes: Modes, constants: Array) -> Array:
        same = np.broadcast_to(self.level**2, self.values.shape)
        along = self.modulus**2 + BEST_NOISE**2 * same  # an entry may be exactly zero
        parts = (same, along) if self.settled else (FLOOR**2 * same + along,)
        deviation = self.model.values(modes, constants) - self.values
        return spread(deviation, parts, BEST_NOISE**2 * (same + along), self.settled)

    def _deviations(self, modes: Modes, constants: Array, spreads: Array) -> Array:
        """Deviations over spread, those of what is known at rest behind the data's."""
        deviation = ((self.model.values(modes, constants) - self.values) / spreads).ravel()
        if self.known is None:
            return deviation
        known, trust = self.known
        return np.append(deviation, (self.at_rest(modes, constants) - known) / trust)

    def slopes(self, modes: Modes, spreads: Array) -> Array:
        """How the deviations change with all parameters, free or not."""
        entries, n = self.values.shape
        constant = np.broadcast_to(np.eye(entries)[:, np.newaxis], (entries, n, entries))
        slopes = np.concatenate([self.model.slopes(modes), constant], axis=2)
        flat = (slopes / spreads[:, :, np.newaxis]).reshape(entries * n, -1)
        if self.known is None:
            return flat
        return np.vstack([flat, self.at_rest_slopes(modes) / self.known[1][:, np.newaxis]])

    def _least_squares(
        self, modes: Modes, constants: Array, spreads: Array, near: bool
    ) -> tuple[Modes, Array]:
        count = len(modes.omega)
        free = self.free(count)
        each = [count] * 4 + [self.model.entries]
        unit = float(np.abs(self.values[0]).max())
        bounds = np.array(
            [
                np.log([self.band_end / FAR**2, self.band_end * FAR]),
                [-50.0, 50.0],
                [-np.inf, np.inf],
                [np.log(1e-6), 0.0],
                [-np.inf, np.inf],
            ]
        )
        low, high = np.repeat(bounds, each, axis=0).T
        first = np.concatenate(
            [
                np.log(modes.omega),
                np.log(modes.mass / unit),
                modes.lever,
                np.log(np.maximum(modes.loss, 1e-6)),
                constants,
            ]
        )

        def unpacked(p: Array) -> tuple[Modes, Array]:
            full = first.copy()
            full[free] = p
            full = np.clip(full, low, high)
            omega, mass, lever, loss = full[: 4 * count].reshape(4, count)
            return Modes(np.exp(omega), unit * np.exp(mass), lever, np.exp(loss)), full[
                4 * count :
            ]

        def residual(p: Array) -> Array:
            z = self._deviations(*unpacked(p), spreads)
            return z * np.sqrt(self._flattening(z**2))

        def jacobian(p: Array) -> Array:
            modes, constants = unpacked(p)
            square = self._deviations(modes, constants, spreads) ** 2
            steep = weight(square) / np.sqrt(self._flattening(square))
            steep[self.values.size :] = 1.0
            slopes: Array = self.slopes(modes, spreads)[:, free] * steep[:, np.newaxis]
            return slopes

        found = scipy.optimize.least_squares(
            residual,
            first[free],
            jacobian,
            method='lm',
            x_scale='jac',
            ftol=NEAR if near else HOME,
            xtol=1e-10,
            gtol=1e-12,
            max_nfev=FEW_STEPS if near else MANY_STEPS,
        )
        return unpacked(found.x)

    def _flattening(self, square: Array) -> Array:
        """Surprise over the square of a deviation; one for what is known, which is not let go."""
        tiny = 1e-12
        limit = (FREEDOM + 1.0) / FREEDOM
        ratio = np.where(square > tiny, surprise(square) / np.maximum(square, tiny), limit)
        ratio[self.values.size :] = 1.0
        return ratio
