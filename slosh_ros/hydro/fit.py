"""
From added mass over frequency to poles, modal masses and levers (THEORY 5, item "fit").

Over x = omega^2 a family of modes that share a plane of motion (surge with pitch, sway with roll)
has, with s = +1 for surge and -1 for sway, the lever l = lambda_5/lambda_1 (lambda_4/lambda_2),
and the modal mass R = lambda_1^2/mu > 0,

    A_push  = k_0 + sum R x/D,
    A_cross = k_1 + sum R (l x + s g)/D,
    A_turn  = k_2 + sum R (l^2 x + 2 s g l + (1 + i delta) g^2/x_m)/D,  D = x_m - x (1 + i delta),

which are eqs (32)-(35) with the liquid under its lid, the hydrostatic moment of the modes that
are not resolved in k_1, and what is the same at all frequencies in k_0 and k_2. So each mode takes
one pole x_m, one R >= 0 and one lever for all entries together; yaw has A_66 alone.

Why not vector fitting or AAA. Both fit a rational function with free residues and few data per
unknown: 1 % of noise gives them poles beside zeros (Froissart doublets) and residues of the wrong
sign or rank. Here sign and rank are built in, and poles start where they must be: between poles a
lossless A_push rises everywhere (Foster's theorem), hence wherever it falls from one grid point to
the next there is a pole between the two, however coarse the grid. From there a nonlinear least
squares on relative deviations, with a loss that lets single points go (the spikes at resonance),
moves all at once.

How many. A mode comes in or goes out if that lowers Bayes's information criterion
n log(sigma^2) + p log n by more than `EVIDENCE`; two neighbours become one if that lowers it at
all. Poles above the band of the data stand for all that lies there: they take part in the fit, not
in the result.

What it cannot tell apart. Two poles of a family between the same two frequencies of the data come
out as one, with about the sum of their modal masses: give frequencies closer than the modes are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.hydro.added_mass import AddedMass
from slosh_ros.hydro.coefficients import ModalCoefficients, surface_grid
from slosh_ros.tank import LiquidAtRest

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

EVIDENCE = 10.0  # "very strong" on Kass & Raftery's scale (J. Am. Stat. Assoc. 90, 1995)
FLOOR = 0.03  # of the median modulus: deviations below it count as those of this
TRUST = 30.0  # weight of what is known of the liquid at rest, in data of the same value
DOUBT = 10.0  # standard errors of the data's own value at rest beyond which it is not used
SPIKE = 3.0  # standard deviations beyond which a point tells no more about the number of modes
SMALLEST_SHARE = 1e-4  # of all modal masses of a family; a mode below it is not worth its state
SMALL_SHARE, LONELY = 0.03, 0.01  # a small mode felt at one point a hundred times more is a spike
FEW_STEPS, MANY_STEPS = 30, 80  # of least squares, to come near and to come home
CLOSE = 5  # steps of the frequencies; poles so near each other may be the halves of one
SAME_WAY = 1e-3  # relative difference of modes from which least squares come home alike
BEST_NOISE = 1e-5  # relative; no boundary element code is better than that
SAME = 1e-6  # relative difference of entries of surge and sway that are the same
ASYMMETRY = 0.01  # of the geometric mean of the diagonal entries
RECIPROCITY = 0.05  # of the same
GAIN, GAINING = 0.01, 0.1  # negative damping over |A| that is no rounding; share of frequencies
MASS_TOLERANCE = 0.05  # of A_11(0) against the liquid's mass
SMALLEST_LOSS = 1e-9
SURE = 5.0  # standard errors a mass must have: somewhere on a grid three come about by chance
COVERAGE = 10.0  # standard errors that errors reach: what lies above the band bends a fit, too


class Family(NamedTuple):
    """Modes that share a plane of motion: rows of the 6x6 matrix, and s of the module's notes."""

    name: str
    push: int
    turn: int
    sign: float


SURGE = Family('surge', 0, 4, 1.0)
SWAY = Family('sway', 1, 3, -1.0)
YAW = Family('yaw', 5, 5, 0.0)


@dataclass(frozen=True, eq=False)
class FittedFamily:
    """
    Modes of one family within the band of the data, by rising frequency.

    Attributes
    ----------
    family : Family
        Which.
    omega : array, shape (n,)
        Natural frequencies [rad/s].
    modal_mass : array, shape (n,)
        R = lambda^2/mu, positive [kg], of yaw [kg m^2].
    lever : array, shape (n,)
        lambda_5/lambda_1 of surge, lambda_4/lambda_2 of sway [m]; zero for yaw.
    loss : array, shape (n,)
        Loss factor delta, twice the damping ratio at resonance.
    omega_error, modal_mass_error, lever_error : array, shape (n,)
        Standard errors, from the scatter of the data about the fit.
    constants : array, shape (3,)
        k_0 [kg], k_1 [kg m], k_2 [kg m^2] at rest: with the modes above the band at omega = 0.
    above_band : float
        Sum of g R/omega_m^2 over what lies above the band [kg m].
    at_rest : tuple of float
        A_push and A_cross at frequency 0, extrapolated from the data alone.
    noise : float
        Typical relative deviation of the data from the fit.
    """

    family: Family
    omega: Array
    modal_mass: Array
    lever: Array
    loss: Array
    omega_error: Array
    modal_mass_error: Array
    lever_error: Array
    constants: Array
    above_band: float
    at_rest: tuple[float, float]
    noise: float


def fit_family(
    data: AddedMass,
    family: Family,
    at_rest: tuple[float, float] | None = None,
    max_modes: int = 12,
) -> FittedFamily:
    """
    Fit the modes of one family.

    Parameters
    ----------
    data : AddedMass
        About O, radiation potential alone: see :meth:`AddedMass.about_surface_centre`.
    family : Family
        `SURGE`, `SWAY` or `YAW`.
    at_rest : tuple of float, optional
        A_push and A_cross at frequency 0 as known from the liquid at rest: m [kg], and
        m z_c + rho I_xx of surge or -(m z_c + rho I_yy) of sway [kg m]. It settles the lever of a
        low mode, of which g R/omega^2 leaves little to see in A_cross.
    max_modes : int
        Most modes to try, those above the band included.

    Raises
    ------
    InputError
        If entries are missing or there are too few frequencies.
    """
    free = _Fit(data, family)
    solved = free.solve(max_modes)
    found = free.at_rest(solved)
    if at_rest is not None and family is not YAW and _told_by(found, solved, at_rest):
        # only now: far from the solution so much trust would draw poles to where they are not
        known = _Fit(data, family, at_rest)
        solved = known.optimised(solved.modes, max(2.0 * solved.noise, 1e-4), known.settled)
    return free.result(solved, found)


def _told_by(found: tuple[float, float], solved: _Solved, known: tuple[float, float]) -> bool:
    """
    Tell that what is known is within the errors of what the data tell.

    Panels make a liquid 1 % lighter at every frequency alike: such data have no use for its true
    mass, which would tear their modes apart.
    """
    off = np.abs(np.subtract(found, known))
    return bool(np.all(off <= DOUBT * solved.rest_error + 1e-6 * np.abs(known)))


class _Fit:
    """The least-squares problem; a model is an array of (omega, R, lever, loss) rows."""

    def __init__(
        self, data: AddedMass, family: Family, at_rest: tuple[float, float] | None = None
    ) -> None:
        push, turn = family.push, family.turn
        entries = [(push, push)]
        if family is not YAW:
            entries += [(push, turn), (turn, turn)]
            if not data.has(*entries[:2]):
                raise InputError(
                    f'{data.source}: a fit of {family.name} needs the entries '
                    f'{push + 1}{push + 1} and {push + 1}{turn + 1} at every frequency'
                )
            if not data.has(entries[2]):
                entries.pop()
        self.family = family
        self.x = data.omega**2
        self.omega = data.omega
        finite = data.omega[np.isfinite(data.omega)]
        if len(finite) < 8:
            raise InputError(
                f'{data.source}: {len(finite)} frequencies are too few for a fit; give 8 or more'
            )
        self.band_end = _band_end(finite)
        # reciprocity: both triangles tell the same
        both = 0.5 * (data.matrix + data.matrix.transpose(0, 2, 1))
        self.values: ComplexArray = np.stack([both[:, i, j] for i, j in entries])
        modulus = np.abs(self.values)
        median = np.median(modulus, axis=1, keepdims=True)
        # an entry may vanish, as that of roll about the axis of a cylinder: then it counts against
        # what a lever of the size of g/omega^2 would make of it
        lever = (GRAVITY / self.band_end**2) ** np.arange(len(entries))[:, np.newaxis]
        floor = FLOOR * np.maximum(median, median[0] * lever)
        self.weight = 1.0 / np.hypot(modulus, np.maximum(floor, np.finfo(float).tiny))
        self.lossy = bool(np.any(np.abs(self.values.imag) > 1e-9 * modulus))
        if self.lossy:
            # losses change the shape of a mode, too: felt where lever and g/x nearly cancel
            with np.errstate(divide='ignore', invalid='ignore'):
                arm = np.where(self.x > 0.0, GRAVITY / self.x, 0.0)
            blur = np.abs(self.values[0].imag) * arm ** np.arange(len(entries))[:, np.newaxis]
            blur[0] = 0.0
            self.weight = 1.0 / np.hypot(1.0 / self.weight, blur)
        self.settled = self.weight
        if at_rest is not None and family is not YAW:
            known = np.zeros((len(entries), 1))
            known[:2, 0] = at_rest
            trust = np.zeros_like(known)
            trust[:2, 0] = 1.0 / np.maximum(np.abs(at_rest), floor[:2, 0])
            self.x, self.omega = (np.append(0.0, a) for a in (self.x, self.omega))
            self.values = np.hstack([known, self.values])
            self.weight = np.hstack([trust, self.weight])
            self.settled = np.hstack([TRUST * trust, self.weight[:, 1:]])

    # --- the model -----------------------------------------------------------------------------

    def shapes(self, modes: Array) -> Array | ComplexArray:
        """Contribution of each mode for R = 1 in the module's notes, (entries, n, modes)."""
        return self._shapes(modes)[0][: len(self.values)]

    def _shapes(
        self, modes: Array
    ) -> tuple[Array | ComplexArray, Array | ComplexArray, Array | ComplexArray]:
        """Shapes of all three entries, x/D, and 1/D; they are real if the data have no loss."""
        omega, _, lever, loss = modes.T
        pole, tilt = omega**2, self.family.sign * GRAVITY
        infinite = np.isinf(self.x)[:, np.newaxis]
        x = np.where(infinite, 0.0, self.x[:, np.newaxis])
        lossy = 1.0 + 1j * loss if self.lossy else 1.0
        if self.lossy:
            over = 1.0 / (pole - x * lossy)
        else:  # finite at the pole itself
            over = (pole - x) / ((pole - x) ** 2 + (SMALLEST_LOSS * x) ** 2)
        over = np.where(infinite, 0.0, over)
        response = np.where(infinite, -1.0, x * over)
        cross = lever * response + tilt * over
        turn = lever * (cross + tilt * over) + GRAVITY**2 / pole * lossy * over
        return np.stack([response, cross, turn]), response, over

    def slopes(self, modes: Array) -> tuple[Array, Array]:
        """
        Real parts of shapes and of their derivatives.

        Returns
        -------
        shapes : array, shape (entries, n, modes)
            Of each mode for R = 1.
        slopes : array, shape (3, entries, n, modes)
            By natural frequency, lever and loss factor.
        """
        omega, _, _, loss = modes.T
        pole = omega**2
        shapes, response, over = self._shapes(modes)
        by_pole = -shapes * over
        by_pole[2] -= (GRAVITY / pole) ** 2 * (1.0 + 1j * loss if self.lossy else 1.0) * over
        slopes = np.zeros((3, *shapes.shape))
        slopes[0] = np.real(2.0 * omega * by_pole)
        slopes[1, 1:] = np.real([response, 2.0 * shapes[1]])
        if self.lossy:
            slopes[2] = -np.imag(shapes * (response * np.isfinite(self.x)[:, np.newaxis]))
            slopes[2, 2] -= np.imag(GRAVITY**2 / pole * over)
        return np.real(shapes[: len(self.values)]), slopes[:, : len(self.values)]

    def deviations(self, modes: Array, constants: Array, weight: Array) -> Array:
        """Relative deviations of the real parts, shape (entries, n)."""
        model = np.real(self.shapes(modes) @ modes[:, 1]) + constants[:, np.newaxis]
        deviation: Array = (model - self.values.real) * weight
        return deviation

    # --- start ---------------------------------------------------------------------------------

    def falls(self) -> list[float]:
        """Frequencies between grid points where A_push falls: poles, by Foster's theorem."""
        push = self.values[0].real
        inside = np.flatnonzero(self.omega <= self.band_end)
        found: list[float] = []
        i = 0
        while i < len(inside) - 1:
            start = i
            while i < len(inside) - 1 and push[i + 1] < push[i]:
                i += 1
            high, low = push[start], push[i]
            # 1 % of noise alone makes it fall by a few percent
            if i > start and high - low > 0.1 * (abs(high) + abs(low)):
                steepest = start + int(np.argmin(np.diff(push[start : i + 1])))
                found.append(float(np.mean(self.omega[steepest : steepest + 2])))
            i = max(i, start + 1)
        return found

    def linear(self, modes: Array, weight: Array) -> tuple[Array, Array]:
        """Best modal masses >= 0 and constants for given poles, levers and losses."""
        entries, n = self.values.shape
        shapes = np.real(self.shapes(modes))
        constant = np.broadcast_to(np.eye(entries)[:, np.newaxis], (entries, n, entries))
        columns = np.concatenate([shapes, constant], axis=2) * weight[:, :, np.newaxis]
        scale = np.linalg.norm(columns, axis=(0, 1)) + np.finfo(float).tiny
        lower = np.repeat([0.0, -np.inf], [len(modes), entries])
        solution = scipy.optimize.lsq_linear(
            (columns / scale).reshape(entries * n, -1),
            (self.values.real * weight).ravel(),
            (lower, np.inf),
        ).x
        solution /= scale
        return solution[: len(modes)], solution[len(modes) :]

    # --- least squares -------------------------------------------------------------------------

    def optimised(
        self, start: Array, spread: float, weight: Array, steps: int = MANY_STEPS
    ) -> _Solved:
        """Move all parameters from the given modes; `spread`: deviations beyond count less."""
        count, entries = len(start), len(self.values)
        mass, constants = self.linear(start, weight)
        units = np.concatenate(
            [
                np.full(count, self.band_end),
                np.full(count, max(float(mass.max()), 1e-6 * float(np.abs(self.values[0]).max()))),
                np.full(count, GRAVITY / self.band_end**2),
                np.ones(count),
                np.median(np.abs(self.values), axis=1) + np.finfo(float).tiny,
            ]
        )
        each = [count] * 4 + [entries]
        free = np.repeat([True, True, self.family is not YAW, self.lossy, True], each)
        lower = np.repeat([1e-3, 0.0, -np.inf, 0.0, -np.inf], each)
        upper = np.repeat([50.0, np.inf, np.inf, 1.0, np.inf], each)
        first = np.concatenate([start[:, 0], mass, start[:, 2], start[:, 3], constants]) / units

        constant = np.broadcast_to(np.eye(entries)[:, np.newaxis], (*self.values.shape, entries))

        def unpacked(p: Array) -> tuple[Array, Array]:
            full = first.copy()
            full[free] = p
            full *= units
            return full[: 4 * count].reshape(4, count).T, full[4 * count :]

        def residual(p: Array) -> Array:
            return self.deviations(*unpacked(p), weight).ravel()

        def jacobian(p: Array) -> Array:
            modes, _ = unpacked(p)
            shapes, slopes = self.slopes(modes)
            by_omega, by_lever, by_loss = slopes * modes[:, 1]
            columns = np.concatenate([by_omega, shapes, by_lever, by_loss, constant], axis=2)
            weighted = columns * weight[:, :, np.newaxis] * units
            flat: Array = weighted.reshape(self.values.size, -1)[:, free]
            return flat

        found = scipy.optimize.least_squares(
            residual,
            np.clip(first[free], lower[free] + 1e-12, upper[free] - 1e-12),
            jacobian,
            bounds=(lower[free], upper[free]),
            loss='soft_l1',
            f_scale=spread,
            x_scale='jac',
            max_nfev=steps,
        )
        modes, constants = unpacked(found.x)
        deviation = self.deviations(modes, constants, weight)
        noise = max(float(np.median(np.abs(deviation))) / 0.6745, BEST_NOISE)
        # what single points (spikes) contribute is limited, as in the loss
        capped = np.minimum(np.abs(deviation), SPIKE * noise)
        variance = float(np.mean(capped**2)) + BEST_NOISE**2
        error = np.zeros_like(first)
        # the pseudo-inverse leaves out what the data do not tell
        covariance = np.linalg.pinv(found.jac.T @ found.jac)
        freedom = max(deviation.size - int(free.sum()), 1) / deviation.size
        error[free] = np.sqrt(variance / freedom * np.maximum(np.diag(covariance), 0.0))
        at_rest = np.zeros((2, len(first)))  # by all parameters: k_0, k_1 + s sum g R/omega^2
        at_rest[0, 4 * count] = 1.0
        if entries > 1:
            hanging = self.family.sign * GRAVITY / modes[:, 0] ** 2
            at_rest[1, :count] = -2.0 * hanging * modes[:, 1] / modes[:, 0]
            at_rest[1, count : 2 * count] = hanging
            at_rest[1, 4 * count + 1] = 1.0
        slope = (at_rest * units)[:, free]
        rest_variance = variance / freedom * np.einsum('ij,jk,ik->i', slope, covariance, slope)
        return _Solved(
            modes=modes,
            errors=(error * units)[: 4 * count].reshape(4, count).T,
            constants=constants,
            noise=noise,
            variance=variance,
            criterion=deviation.size * np.log(variance) + free.sum() * np.log(deviation.size),
            deviation=deviation,
            rest_error=np.sqrt(np.maximum(rest_variance, 0.0)),
        )

    def solve(self, max_modes: int) -> _Solved:
        """Let modes in and out while the criterion tells to."""
        start = self._rows([*self.falls()[: max_modes - 1], 1.4 * self.band_end])
        best = self._home(self._near(start))
        while better := self._step(best, max_modes) or self._jump(best) or self._merge(best):
            best = better
        return best

    def _exact(self, solved: _Solved) -> bool:
        """Tell that it is as good as data are: one more mode has nothing left to explain."""
        return solved.deviation.size * math.log(solved.variance / BEST_NOISE**2) < EVIDENCE

    def _jump(self, best: _Solved) -> _Solved | None:
        """Put single poles across the next grid point, which least squares do not pass."""
        trials: list[Array] = []
        for j in [] if self._exact(best) else np.flatnonzero(self._inside(best)):
            after = int(np.searchsorted(self.omega, best.modes[j, 0]))
            for low, high in ((after - 2, after - 1), (after, after + 1)):
                if low < 0 or high >= len(self.omega) or self.omega[high] > self.band_end:
                    continue
                trial = best.modes.copy()
                trial[j, 0] = 0.5 * (self.omega[low] + self.omega[high])
                trials.append(trial)
        better = (self._better([trial], best, 1.0) for trial in trials)
        return next((found for found in better if found is not None), None)

    def _merge(self, best: _Solved) -> _Solved | None:
        """Make one of two neighbouring poles, of which a sharp peak may be made up."""
        order = np.argsort(best.modes[:, 0])
        order = order[self._inside(best)[order]]
        step = np.searchsorted(self.omega, best.modes[:, 0])
        trials: list[Array] = []
        for left, right in pairwise(order):
            if step[right] - step[left] > CLOSE:
                continue
            both = best.modes[[left, right]]
            one = np.average(both, axis=0, weights=both[:, 1] + np.finfo(float).tiny)
            one[1] = both[:, 1].sum()
            trials.append(np.vstack([np.delete(best.modes, [left, right], axis=0), one]))
        return self._better(trials, best, 0.0)

    def at_rest(self, solved: _Solved) -> tuple[float, float]:
        """A_push and A_cross of a fit at frequency 0; of yaw only the first."""
        constants, hanging = (
            solved.constants,
            GRAVITY * solved.modes[:, 1] / solved.modes[:, 0] ** 2,
        )
        cross = constants[1] + self.family.sign * hanging.sum() if len(constants) > 1 else 0.0
        return float(constants[0]), float(cross)

    def _step(self, best: _Solved, max_modes: int) -> _Solved | None:
        trials: list[Array] = []
        if len(best.modes) < max_modes and not self._exact(best):
            worst = np.abs(best.deviation).max(axis=0)
            inside = np.flatnonzero((self.omega <= self.band_end) & (self.omega > 0.0))
            for i in inside[np.argsort(worst[inside])[::-1][:1]]:
                for j in (i - 1, i + 1):
                    if 0 <= j < len(self.omega) and 0.0 < self.omega[j] <= self.band_end:
                        between = 0.5 * (self.omega[i] + self.omega[j])
                        trials.append(np.vstack([best.modes, self._rows([between])]))
            above = best.modes[best.modes[:, 0] > self.band_end, 0]
            lowest, highest = (min(above), max(above)) if len(above) else [self.band_end] * 2
            trials += [
                np.vstack([best.modes, self._rows([place])])
                for place in (1.5 * highest, math.sqrt(self.band_end * lowest))
            ]
        if len(best.modes) > 1:
            weakest = np.argsort(best.modes[:, 1] / np.maximum(best.errors[:, 1], 1e-300))[:1]
            trials += [np.delete(best.modes, j, axis=0) for j in weakest]
        return self._better(trials, best, EVIDENCE)

    def _better(self, trials: list[Array], best: _Solved, by: float) -> _Solved | None:
        """Optimise trials to the end; return the best if it beats `best` by so much."""
        solved = [self._home(self._near(trial)) for trial in trials]
        solved = [s for s in solved if self._sound(s)]
        top = min(solved, key=lambda s: s.criterion, default=best)
        return top if top.criterion < best.criterion - by else None

    def _inside(self, solved: _Solved) -> NDArray[np.bool_]:
        return np.asarray(solved.modes[:, 0] <= self.band_end)

    def _sound(self, solved: _Solved) -> bool:
        """Tell that the grid tells modes apart, and that none is there for a single point."""
        inside = self._inside(solved)
        modes = solved.modes[inside]
        step = np.searchsorted(self.omega, modes[:, 0])
        if len(set(step)) < len(step):
            return False
        mass = modes[:, 1]
        felt = np.abs(self.shapes(modes)) * mass * self.weight[:, :, np.newaxis]
        strongest = np.sort(felt.max(axis=0), axis=0)[-2:]
        alone = strongest[0] < LONELY * strongest[1]
        share = mass / max(float(np.sum(mass)), np.finfo(float).tiny)
        return not np.any((share < SMALLEST_SHARE) | (alone & (share < SMALL_SHARE)))

    def _near(self, modes: Array) -> list[_Solved]:
        """Optimise a little from near and far; one or two ways that differ, the better first."""
        # all deviations in earnest first, or outliers let go from the start
        far = self.optimised(modes, 1.0, self.weight, FEW_STEPS).modes
        ways = [self.optimised(start, 0.05, self.weight, FEW_STEPS) for start in (modes, far)]
        ways.sort(key=lambda s: s.criterion)
        return ways[:1] if np.allclose(ways[0].modes, ways[1].modes, rtol=SAME_WAY) else ways

    def _home(self, ways: list[_Solved]) -> _Solved:
        """Optimise to the end with the spread of deviations so found."""
        solved = [
            self.optimised(near.modes, max(2.0 * near.noise, 10.0 * BEST_NOISE), self.settled)
            for near in ways
        ]
        return min(solved, key=lambda s: s.criterion)

    def _rows(self, omega: list[float]) -> Array:
        rows = np.zeros((len(omega), 4))
        rows[:, 0], rows[:, 3] = omega, 0.02 if self.lossy else SMALLEST_LOSS
        # the slosh mass hangs between 0 (shallow) and 2 g/omega^2 (deep) below the surface
        rows[:, 2] = -self.family.sign * GRAVITY / np.array(omega) ** 2
        return rows

    def result(self, solved: _Solved, at_rest: tuple[float, float]) -> FittedFamily:
        """Keep what lies within the band and is sure."""
        order = np.argsort(solved.modes[:, 0])
        modes, errors = solved.modes[order], solved.errors[order]
        kept = (modes[:, 0] <= self.band_end) & (modes[:, 1] > SURE * errors[:, 1])
        omega, mass, lever, loss = modes[kept].T
        rest = modes[~kept]
        hanging = GRAVITY * rest[:, 1] / rest[:, 0] ** 2
        constants = np.zeros(3)
        constants[: len(solved.constants)] = solved.constants
        if self.family is not YAW:
            constants[1] += self.family.sign * hanging.sum()
            constants[2] += np.sum(
                hanging * (2.0 * self.family.sign * rest[:, 2] + GRAVITY / rest[:, 0] ** 2)
            )
        return FittedFamily(
            family=self.family,
            omega=omega,
            modal_mass=mass,
            lever=lever if self.family is not YAW else np.zeros_like(omega),
            loss=loss if self.lossy else np.zeros_like(omega),
            omega_error=errors[kept, 0],
            modal_mass_error=errors[kept, 1],
            lever_error=errors[kept, 2],
            constants=constants,
            above_band=float(hanging.sum()),
            at_rest=at_rest,
            noise=solved.noise,
        )


class _Solved(NamedTuple):
    modes: Array
    errors: Array
    constants: Array
    noise: float
    variance: float
    criterion: float
    deviation: Array
    rest_error: Array


def added_mass_coefficients(
    data: AddedMass,
    liquid: LiquidAtRest,
    modes: int,
    plan: tuple[float, float] | None = None,
) -> ModalCoefficients:
    """
    Coefficients of a tank from its added mass: :func:`fit_liquid` and :func:`fitted_coefficients`.

    Parameters
    ----------
    data : AddedMass
        With the entries 11, 22, 15, 24, 44, 55, 66.
    liquid : LiquidAtRest
        The liquid; its mass, centroid and surface moments must fit the data.
    modes : int
        Most modes to keep, from the lowest frequency.
    plan : tuple of float, optional
        Length (x) and width (y) of the mean free surface [m].

    Raises
    ------
    InputError
        See :func:`fit_liquid`.
    """
    return fitted_coefficients(data, liquid, fit_liquid(data, liquid), modes, plan)


def fit_liquid(data: AddedMass, liquid: LiquidAtRest) -> tuple[FittedFamily, ...]:
    """
    Fit surge, sway and, unless it turns about a vertical axis of symmetry, yaw of a known liquid.

    Parameters
    ----------
    data : AddedMass
        With the entries 11, 22, 15, 24, 44, 55, 66.
    liquid : LiquidAtRest
        The liquid; its mass, centroid and surface moments must fit the data.

    Raises
    ------
    InputError
        If entries are missing, the matrix is not symmetric, the tank is not symmetric fore and aft
        and to both sides about O, radiation makes energy, or mass or moments at rest are not those
        of the liquid.
    """
    _check_entries(data)
    about_o = data.about_surface_centre(liquid.surface_inertia)
    _check_symmetry(about_o)
    _check_damping(about_o)
    mass = data.density * liquid.volume
    lever = mass * float(liquid.centroid[2])
    i_xx, i_yy = data.density * np.diag(liquid.surface_inertia)
    families = [_checked(about_o, SURGE, (mass, lever + i_xx), i_xx)]
    if _round(about_o):
        families.append(_turned(families[0]))
    else:
        families.append(_checked(about_o, SWAY, (mass, -(lever + i_yy)), i_yy))
    # a vertical axis of symmetry leaves rounding in 66
    if np.abs(about_o.matrix[:, 5, 5]).max() > 1e-6 * np.abs(about_o.matrix[:, 4, 4]).max():
        families.append(fit_family(about_o, YAW))
    if not any(len(fitted.omega) for fitted in families):
        raise InputError(f'{data.source}: there is no sloshing mode within its frequencies')
    return tuple(families)


def fitted_coefficients(
    data: AddedMass,
    liquid: LiquidAtRest,
    families: tuple[FittedFamily, ...],
    modes: int,
    plan: tuple[float, float] | None = None,
) -> ModalCoefficients:
    """
    Coefficients of what :func:`fit_liquid` has found.

    The scale of a mode is free: here mu = R and lambda_1 = -R (lambda_2 of sway), so that beta is
    minus the displacement of the slosh mass; of yaw mu = R/m^2 and lambda_6 = -R/m.

    Parameters
    ----------
    data : AddedMass
        What was fitted.
    liquid : LiquidAtRest
        The liquid.
    families : tuple of FittedFamily
        Surge, sway and perhaps yaw.
    modes : int
        Most modes to keep, from the lowest frequency.
    plan : tuple of float, optional
        Length (x) and width (y) of the mean free surface [m]. With it, the elevation is that of
        the plane with the same first moment as the mode, lambda x/(rho I_xx): for a cosine its
        edge is 22 % too high. Without it there is none.
    """
    i_xx, i_yy = data.density * np.diag(liquid.surface_inertia)
    names: list[str] = []
    rows: list[Array] = []
    errors: list[float] = []
    for fitted in families:
        family = fitted.family
        for n, (omega, weight, arm) in enumerate(
            zip(fitted.omega, fitted.modal_mass, fitted.lever, strict=True), start=1
        ):
            coupling = np.zeros(6)
            coupling[family.push] = -weight
            if family is not YAW:
                coupling[family.turn] = -weight * arm
            names.append(f'{family.name}{n}')
            rows.append(np.array([omega, weight, *coupling]))
            errors.append(
                max(
                    fitted.omega_error[n - 1] / omega,
                    fitted.modal_mass_error[n - 1] / weight,
                )
            )
    order = np.argsort([row[0] for row in rows])[:modes]
    table = np.array(rows)[order]
    inertia = [families[1].constants[2], families[0].constants[2]]
    inertia.append(families[2].constants[0] if len(families) > 2 else 0.0)
    points = np.zeros((0, 2)) if plan is None else surface_grid(*plan)
    return ModalCoefficients(
        route='added mass',
        density=data.density,
        liquid=liquid,
        names=tuple(names[j] for j in order),
        omega=table[:, 0],
        mu=table[:, 1],
        coupling=table[:, 2:],
        inertia_stokes_joukowski=np.diag(inertia),
        wall_friction=None,
        surface_points=points,
        surface_shapes=points @ (table[:, 2:4] / np.array([i_xx, i_yy])).T,
        error=COVERAGE * float(max(errors[j] for j in order)),
    )


def _round(data: AddedMass) -> bool:
    """Tell that sway is surge, as in a tank that turns about a vertical axis of symmetry."""
    m = data.matrix
    pairs = ((m[:, 1, 1], m[:, 0, 0]), (m[:, 1, 3], -m[:, 0, 4]), (m[:, 3, 1], -m[:, 4, 0]))
    return all(
        np.allclose(sway, surge, rtol=SAME, atol=0.0)
        for sway, surge in (*pairs, (m[:, 3, 3], m[:, 4, 4]))
    )


def _turned(surge: FittedFamily) -> FittedFamily:
    """Return sway of a tank whose sway is surge."""
    mass, moment = surge.at_rest
    return replace(
        surge,
        family=SWAY,
        lever=-surge.lever,
        constants=surge.constants * np.array([1.0, -1.0, 1.0]),
        at_rest=(mass, -moment),
    )


def _checked(
    data: AddedMass, family: Family, at_rest: tuple[float, float], surface: float
) -> FittedFamily:
    """Fit a family of a liquid that is known at rest."""
    row, column = family.push + 1, family.turn + 1
    fitted = fit_family(data, family, at_rest)
    mass, moment = fitted.at_rest
    if abs(mass - at_rest[0]) > MASS_TOLERANCE * at_rest[0]:
        raise InputError(
            f'{data.source}: its entry {row}{row} tends to {mass:.4g} kg at rest, but the '
            f'liquid has a mass of {at_rest[0]:.4g} kg; check density, length scale, units and '
            'whether periods are taken for frequencies'
        )
    if abs(moment - at_rest[1]) > MASS_TOLERANCE * (abs(at_rest[1]) + surface):
        raise InputError(
            f'{data.source}: its entry {row}{column} tends to {moment:.4g} kg m at rest, but '
            f'centroid and free surface of the liquid give {at_rest[1]:.4g} kg m; check the '
            'reference point of its moments, its axes (x forward, y left, z up), its angles (rad) '
            'and the surface'
        )
    return fitted


def _check_entries(data: AddedMass) -> None:
    for i, j in ((0, 0), (1, 1), (3, 3), (4, 4), (5, 5), (0, 4), (1, 3)):
        known = np.isfinite(data.matrix[:, [i, j], [j, i]])
        absent: NDArray[np.bool_] = np.asarray(~known.all(axis=1))
        if absent.any():
            raise InputError(
                f'{data.source}: the entry {i + 1}{j + 1} is missing at {int(absent.sum())} of '
                f'{len(absent)} frequencies, first at {data.omega[np.argmax(absent)]:.4g} rad/s; '
                'surge needs 11, 15, 55, sway 22, 24, 44, yaw 66'
            )


def _check_symmetry(data: AddedMass) -> None:
    """Raise unless the matrix is symmetric, and the tank about the planes x = 0 and y = 0."""
    size = np.sqrt(np.median(np.abs(np.einsum('nii->ni', data.matrix)), axis=0))
    for i, j in ((0, 4), (1, 3)):
        above, below = data.matrix[:, i, j], data.matrix[:, j, i]
        if np.median(np.abs(above - below)) > RECIPROCITY * size[i] * size[j]:
            n = int(np.argmax(np.abs(above - below)))
            raise InputError(
                f'{data.source}: at {data.omega[n]:.4g} rad/s the entry {i + 1}{j + 1} is '
                f'{above[n].real:.4g} kg m and {j + 1}{i + 1} is {below[n].real:.4g} kg m; they '
                'must be the same: write both triangles'
            )
    for i, j in ((0, 1), (0, 3), (0, 5), (1, 4), (1, 5), (3, 4), (3, 5), (4, 5)):
        coupling = np.nan_to_num(np.abs(data.matrix[:, [i, j], [j, i]])).max(axis=1)
        if np.median(coupling) > ASYMMETRY * size[i] * size[j]:
            raise InputError(
                f'{data.source}: the entry {i + 1}{j + 1} is not zero, as it is in a tank '
                'symmetric about the planes x = 0 and y = 0 through O; check the reference point'
            )


def _check_damping(data: AddedMass) -> None:
    """Raise if motion gains energy by radiation; single points may, as spikes do."""
    for i in (0, 1, 3, 4, 5):
        entry = data.matrix[:, i, i]
        gains: NDArray[np.bool_] = np.asarray(entry.imag < -GAIN * np.abs(entry))
        if float(np.mean(gains)) > GAINING:
            n = int(np.argmax(gains))
            raise InputError(
                f'{data.source}: the radiation damping {i + 1}{i + 1} is negative at '
                f'{int(gains.sum())} of {len(gains)} frequencies, first at {data.omega[n]:.4g} '
                'rad/s: the liquid would make energy; check its sign'
            )


def _band_end(omega: Array) -> float:
    """Last frequency before the grid breaks off; a row far above stands for infinity."""
    steps = np.diff(omega)
    breaks = np.flatnonzero(steps > 5.0 * np.median(steps))
    late = breaks[breaks >= len(omega) // 2]
    return float(omega[late[0]] if len(late) else omega[-1])
