"""
How many poles, and where: the search for the most likely fit of added mass over frequency.

Why not vector fitting or AAA. Both fit a rational function with free residues and few data per
unknown: 1 % of noise gives them poles beside zeros (Froissart doublets) and residues of the wrong
sign or rank. Here sign and rank are built in (:mod:`slosh_ros.hydro.poles`).

Where. Least squares carry no pole past a frequency of the data, where the fit would be infinite.
So poles start where they must be: between poles a lossless A_push rises everywhere (Foster's
theorem), hence wherever it falls from one grid point to the next there is a pole between the two,
however coarse the grid. From there on a pole is put where it explains most of what is left, at a
few places between any two frequencies, all other parameters giving way to first order; and a pole
that would do better elsewhere goes there.

How many. A mode comes in if that lowers Bayes's information criterion by more than `EVIDENCE`, and
would still without the frequency that speaks for it most: one point is a spike, not a mode. It
goes if that does not hold any more. Poles above the band of the data stand for all that lies
there.

What it cannot tell apart. Two poles of a family between the same two frequencies of the data come
out as one, with about the sum of their modal masses: give frequencies closer than the modes are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy
from numpy.typing import NDArray

from slosh_ros.hydro.pole_fit import FLOOR, PoleFit, Solved
from slosh_ros.hydro.pole_noise import surprise, weight
from slosh_ros.hydro.poles import Modes

Array = NDArray[np.float64]

EVIDENCE = 10.0  # "very strong" on Kass & Raftery's scale (J. Am. Stat. Assoc. 90, 1995)
MOVED = 2.0  # the least evidence there is a word for on that scale: no more modes, only elsewhere
FALL = 0.1  # of |A_push| before and after, by which it falls past a pole: 1 % of noise does not
WITHIN = (0.03, 0.2, 0.5, 0.8, 0.97)  # of a step of the frequencies: where a pole is tried
ABOVE = (1.1, 1.4, 2.0, 3.0)  # of the band's end: the same
LOSSES = (0.01, 0.05, 0.2)  # with which it is tried
TRIED = 2  # places that promise most, and modes that tell least, which are tried
MOST_STEPS = 40  # for a dozen modes in, elsewhere and out again
SMALLEST_SHARE = 1e-4  # of all modal masses of a family; a mode below it is not worth its state


def solve(problem: PoleFit, max_modes: int) -> Solved:
    """
    Find the poles.

    Parameters
    ----------
    problem : PoleFit
        The data.
    max_modes : int
        Most modes to try, those above the band included.
    """
    # A_push first, where a fall is a pole whatever the levers
    push = replace(
        problem,
        model=problem.model._replace(entries=1),
        values=problem.values[:1],
        modulus=problem.modulus[:1],
        level=problem.level[:1],
    )
    search = PoleSearch(push, max_modes)
    best = search.improved(search.start())
    modes, constants = best.modes, best.constants
    if problem.model.entries > 1:
        modes, constants = _with_levers(problem, modes)
    for settled in (False, True):
        search = PoleSearch(replace(problem, settled=settled), max_modes)
        best = search.improved(search.problem.refined(modes, constants))
        modes, constants = best.modes, best.constants
    return best


def falls(omega: Array, push: Array, most: int) -> Array:
    """Frequencies about which A_push falls most: poles, by Foster's theorem."""
    found: list[tuple[float, float]] = []
    i = 0
    while i < len(omega) - 1:
        start = i
        while i < len(omega) - 1 and push[i + 1] < push[i]:
            i += 1
        high, low = push[start], push[i]
        size = (high - low) / (abs(high) + abs(low) + np.finfo(float).tiny)
        if size > FALL:
            steepest = start + int(np.argmin(np.diff(push[start : i + 1])))
            found.append((size, float(np.mean(omega[steepest : steepest + 2]))))
        i = max(i, start + 1)
    return np.array([place for _, place in sorted(found)[::-1][:most]])


def _with_levers(problem: PoleFit, modes: Modes) -> tuple[Modes, Array]:
    """Add the levers that A_cross tells with the modes of A_push, and constants."""
    parts = problem.model.by_lever(modes)[1] * modes.mass[:, np.newaxis]
    trust = 1.0 / np.hypot(FLOOR * problem.level[1], problem.modulus[1])
    columns = np.column_stack([parts[:, :, 1], np.ones(len(trust))]) * trust[:, np.newaxis]
    rest = (problem.values[1] - parts[:, :, 0].sum(axis=1)) * trust
    modes = modes._replace(lever=np.linalg.lstsq(columns, rest, rcond=1e-6)[0][:-1])
    return modes, np.median(problem.values - problem.model.shapes(modes) @ modes.mass, axis=1)


class PoleSearch:
    """Steps from one number of poles, or one place, to another."""

    def __init__(self, problem: PoleFit, max_modes: int) -> None:
        self.problem, self.band_end = problem, problem.band_end
        model, size = problem.model, problem.values.size
        self.omega = omega = np.sqrt(model.x)
        self.most = min(max_modes, (size // 2 - model.entries) // problem.per_mode)
        self.inside = np.flatnonzero((omega > 0.0) & (omega <= self.band_end))
        steps = np.diff(omega[self.inside])[:, np.newaxis]
        within = omega[self.inside[:-1], np.newaxis] + steps * WITHIN
        places, losses = np.meshgrid(
            np.append(within.ravel(), self.band_end * np.array(ABOVE)),
            LOSSES if model.lossy else [1e-6],
        )
        nothing = np.zeros(places.size)
        self.places = Modes(places.ravel(), nothing + 1.0, nothing, losses.ravel())
        shapes = model.by_lever(self.places).transpose(2, 0, 1, 3)
        self.shapes = np.ascontiguousarray(shapes).reshape(places.size, size, model.entries)

    def start(self) -> Solved:
        """Return the fit of A_push with poles wherever it falls."""
        problem, push = self.problem, self.problem.values[0]
        omega = falls(self.omega[self.inside], push[self.inside], self.most)
        nothing = np.zeros_like(omega)
        modes = Modes(omega, nothing + 1.0, nothing, nothing + LOSSES[0])
        trust = 1.0 / np.hypot(FLOOR * problem.level[0], problem.modulus[0])
        ones = np.ones((len(push), 1))
        columns = np.hstack([problem.model.shapes(modes)[0], ones, -ones]) * trust[:, np.newaxis]
        size = np.linalg.norm(columns, axis=0)
        masses = scipy.optimize.nnls(columns / size, push * trust)[0] / size
        modes = modes._replace(mass=masses[:-2]).take(masses[:-2] > 0.0)
        best = problem.refined(modes, masses[-2:-1] - masses[-1:])
        while fewer := self._drop(best):  # much noise falls, too
            best = fewer
        return best

    def improved(self, best: Solved) -> Solved:
        """Let modes in, elsewhere and out while the criterion tells to."""
        for _ in range(MOST_STEPS):
            better = self._add(best) or self._move(best) or self._drop(best)
            if better is None:
                break
            best = better
        return best

    def _add(self, best: Solved) -> Solved | None:
        if len(best.modes.omega) >= self.most:
            return None
        places = self._places(best, best.modes, TRIED)
        return self._better(best, [best.modes.joined(one) for one in places], EVIDENCE, True)

    def _move(self, best: Solved) -> Solved | None:
        moved = None
        for j in np.argsort(best.modes.mass):
            if best.modes.omega[j] > self.band_end:
                continue
            others = best.modes.without(int(j))
            trials = [
                others.joined(one, int(j))
                for one in self._places(best, others, 1)
                if self._step(one)[0] != self._step(best.modes)[j]
            ]
            if found := self._better(best, trials, MOVED):
                best = moved = found
        return moved

    def _drop(self, best: Solved) -> Solved | None:
        """Leave out a mode that tells little, or tells at one frequency alone."""
        modes, count = best.modes, len(best.modes.omega)
        if not count:
            return None
        inside = np.flatnonzero(modes.omega <= self.band_end)
        unsure = np.diag(self.problem.covariance(best))[count : 2 * count]
        felt = self.problem.model.shapes(modes) * modes.mass / best.spread[:, :, np.newaxis]
        felt = np.sum(felt**2, axis=0)
        second = (felt.sum(axis=0) - felt.max(axis=0))[inside]
        weak = [*np.argsort(unsure)[::-1][:TRIED], *inside[np.argsort(second)[:TRIED]]]
        for j in dict.fromkeys(int(j) for j in weak):
            fewer = self.problem.refined(modes.without(j), best.constants, best.spread)
            if self._sound(fewer) and not (
                self._sound(best)
                and best.criterion < fewer.criterion
                and (j not in inside or self._evidence(best, fewer) > 0.0)
            ):
                return fewer
        return None

    def _better(
        self, best: Solved, trials: Sequence[Modes], by: float, wide: bool = False
    ) -> Solved | None:
        """Return the first of the most promising trials that beats `best` by so much."""
        start = best.constants, best.spread
        near = [self.problem.refined(trial, *start, rounds=1, near=True) for trial in trials]
        for one in sorted(near, key=lambda s: s.criterion)[:TRIED]:
            home = self.problem.refined(one.modes, one.constants, one.spread)
            if (
                home.criterion < best.criterion - by
                and self._sound(home)
                and (not wide or self._evidence(home, best) > by)
            ):
                return home
        return None

    def _sound(self, solved: Solved) -> bool:
        """Tell that the grid tells modes apart, and that each is worth its state."""
        inside = solved.modes.take(solved.modes.omega <= self.band_end)
        apart = len(set(self._step(inside).tolist())) == len(inside.omega)
        return apart and bool(np.all(inside.mass > SMALLEST_SHARE * inside.mass.sum()))

    def _evidence(self, more: Solved, less: Solved) -> float:
        """By how much one mode more is likelier without the frequency that tells it most."""
        gain = surprise((less.deviation * less.spread / more.spread) ** 2)
        gain = np.sum(gain - surprise(more.deviation**2), axis=0)
        price = self.problem.per_mode * np.log(self.problem.values.size)
        return float(gain.sum() - gain.max() - price)

    def _step(self, modes: Modes) -> NDArray[np.intp]:
        """Behind which frequency of the data modes are."""
        return np.asarray(np.searchsorted(self.omega, modes.omega))

    def _places(self, solved: Solved, kept: Modes, most: int) -> list[Modes]:
        """Where one mode more explains most of what the kept ones leave."""
        free = ~np.isin(self._step(self.places), self._step(kept))
        free |= self.places.omega > self.band_end
        places = self.places.take(free)
        rest = self.problem.values - self.problem.model.values(kept, solved.constants)
        found: list[Modes] = []
        # single points let go as the fit does, and all in earnest
        for trust in (np.sqrt(weight(solved.deviation**2)), np.ones_like(rest)):
            # all other parameters give way
            slopes = self.problem.slopes(kept, solved.spread / trust)[: rest.size]
            base, _ = np.linalg.qr(slopes[:, self.problem.free(len(kept.omega))])
            shapes = self.shapes[free] * (trust / solved.spread).ravel()[:, np.newaxis]
            shapes -= base @ (base.T @ shapes)
            left = (rest * trust / solved.spread).ravel()
            left -= base @ (base.T @ left)
            size = np.linalg.norm(shapes, axis=1, keepdims=True) + 1e-100
            shapes /= size
            normal = shapes.transpose(0, 2, 1) @ shapes + 1e-9 * np.eye(shapes.shape[2])
            right = left @ shapes
            best = np.linalg.solve(normal, right[:, :, np.newaxis])[:, :, 0]
            gain = np.where(best[:, 0] > 0.0, np.sum(best * right, axis=1), 0.0)
            best /= size[:, 0]
            steps = self._step(places)
            order = np.argsort(gain)[::-1][: np.count_nonzero(gain)]
            first = np.sort(np.unique(steps[order], return_index=True)[1])  # one place a step
            for j in order[first[:most]]:
                one = places.take(np.array([j]))
                lever = best[[j], 1] / best[j, 0] if best.shape[1] > 1 else one.lever
                found.append(one._replace(mass=np.array([best[j, 0]]), lever=lever))
        return found
