"""Figures 6 to 8: braking and turning of a tank, section 4.3 and 4.4."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from slosh_ros.constants import GRAVITY
from slosh_ros.hydro import ModalCoefficients
from slosh_ros.hydro.recipe import Shape, recipe_mode
from slosh_ros.study.paper import cases
from slosh_ros.study.paper.cases import Array, Run
from slosh_ros.study.paper.draw import Curve, Panel, picture
from slosh_ros.study.paper.item import Drawing, Finding, Row, Verdict, against, claim

BRAKING = 0.1 * GRAVITY  # [m/s^2]
RAMP = 2.0  # [s] in which it rises
STEP = 0.005  # [s]
MANY = 24  # modes along the tank that stand for all

# Fig. 7 is a picture: this trapezoid is ours
TURN_TIMES, TURN = (0.0, 1.5, 6.5, 8.0, 15.0), (0.0, 0.1 * GRAVITY, 0.1 * GRAVITY, 0.0, 0.0)


def braking_pulse(time: Array) -> Array:
    """Deceleration of section 4.3 [m/s^2]."""
    return np.asarray(BRAKING * np.minimum(time / RAMP, 1.0))


@cache
def braking_run(fill: float, modes: int) -> tuple[ModalCoefficients, Run]:
    """Brake the cylinder of section 4.3 for three and a half periods."""
    c = cases.along(cases.braked(fill), modes)
    periods = 3.5 * 2.0 * np.pi / c.omega[0]
    time = np.arange(0.0, periods, STEP)
    shape = {'shape': 'cylinder_x', 'radius': 1.2, 'length': 5.75, 'fill_depth': fill * 1.2}
    return c, cases.drive(shape, c, time, cases.level(time, -braking_pulse(time)))


def amplification(fill: float) -> float:
    """Largest over static moment of the raised surface, g lambda_1 beta, first mode."""
    c, run = braking_run(fill, 1)
    static = c.coupling[0, 0] * BRAKING / (c.mu[0] * c.omega[0] ** 2)
    return float(np.abs(run.beta).max() / np.abs(static))


def figure_6() -> Finding:
    """Normalised braking force, both fills, one and more modes; the numbers of section 4.3."""
    rows: list[Row] = []
    panels, apart = [], []
    columns: dict[str, Array] = {}
    for fill, factor in ((1.0, '1.64'), (1.5, '1.44')):
        runs = {n: braking_run(fill, n) for n in (1, 2, MANY)}
        c, one = runs[1]
        period, weight = 2.0 * np.pi / c.omega[0], c.mass * BRAKING
        force = {n: run.total[:, 0] / weight for n, (_, run) in runs.items()}
        slosh = {n: run.slosh[:, 0] for n, (_, run) in runs.items()}
        tag, at = f'{fill:.1f}R'.replace('.', '_'), f'h = {fill:.1f} R'
        half = c.omega[0] * RAMP / 2.0
        share = c.coupling[0, 0] ** 2 / c.mu[0] / c.mass
        closed = 1.0 + share * abs(np.sin(half) / half)
        peak = float(np.abs(force[1]).max())
        rows.append(
            claim(
                f'peak_{tag}', f'largest force over rigid force, one mode, {at}', f'{peak:.4f}',
                'in a picture', abs(peak / closed - 1.0) < 1e-4, verdict=Verdict.OPEN,
                why=f'closed form {closed:.4f}; with two modes {np.abs(force[2]).max():.4f}, '
                f'with {MANY} {np.abs(force[MANY]).max():.4f}',
                evidence='engine against 1 + (m_1/m)|sin x/x|, x = omega t_r/2', head=True,
            )
        )  # fmt: skip
        rows.append(
            against(
                f'daf_{tag}', f'moment amplification factor, {at}', amplification(fill), factor,
                '-', within=0.01, head=True,
                why='largest over static moment of the raised surface, g lambda_1 beta; the other '
                f'readings do not fit: sloshing moment {_other(one, 4):.2f}, total force '
                f'{peak:.2f}', evidence='engine, one mode',
            )
        )  # fmt: skip
        of_total = float(np.abs(force[2]).max() / np.abs(force[1]).max() - 1.0)
        of_slosh = float(np.abs(slosh[2]).max() / np.abs(slosh[1]).max() - 1.0)
        rows += [
            against(
                f'second_{tag}', f'second mode, share of the total force, {at}', 100.0 * of_total,
                '1.7', '%', head=True, why='by peaks; what fits is its share of the sloshing '
                'part alone, and that of the half-full tank only',
                evidence='engine, one and two modes',
            ),
            against(
                f'second_part_{tag}', f'second mode, share of the sloshing part, {at}',
                100.0 * of_slosh, '1.7', '%', within=0.05,
                why='a reading of "total liquid force" that the text does not give',
                evidence='engine, one and two modes',
            ),
        ]  # fmt: skip
        panels.append(
            Panel(
                f'F / (m a) [-],\n{at}',
                (
                    Curve(f'{MANY} modes', one.time / period, force[MANY]),
                    Curve('1 mode', one.time / period, force[1]),
                    Curve('2 modes', one.time / period, force[2]),
                ),
            )
        )
        apart += [
            Curve(f'{n} mode{"s" * (n > 1)}, {fill:.1f} R', one.time / period,
                  100.0 * (force[n] - force[MANY]))
            for n in (1, 2)
        ]  # fmt: skip
        columns |= {f't/T at {fill} R': one.time / period}
        columns |= {f'F/(m a) at {fill} R, {n} modes': f for n, f in force.items()}
    rows.append(_larger_inertia())
    panels.append(Panel(f'less that of {MANY} modes\n[% of m a]', apart))
    return Finding(
        rows,
        text=(
            'Cylinder R = 1.2 m, L = 5.75 m, water; the deceleration rises to 0.1 g in 2 s and '
            'stays. Times are in natural periods, forces in those of the liquid as a solid. For '
            'a computation by two-phase CFD of the half-full case see the item cfd_cylinder.',
        ),
        drawings=(
            Drawing(
                'fig6', 'Figure 6: braking force of the liquid, both fills, by number of modes; '
                'and what few modes leave out.',
                picture('Braking at 0.1 g, ramp 2 s', 'time / fundamental period [-]', panels,
                        share_x=False),
                columns,
            ),
        ),
    )  # fmt: skip


def _other(run: Run, part: int) -> float:
    """Largest over mean of another load, after the ramp."""
    after = np.abs(run.slosh[run.time >= RAMP, part])
    return float(after.max() / after.mean())


def _larger_inertia() -> Row:
    """Compare both fills: mass grows by more than the sloshing part."""
    (half, low), (full, high) = braking_run(1.0, MANY), braking_run(1.5, MANY)
    mass = full.mass / half.mass
    slosh = float(np.abs(high.slosh[:, 0]).max() / np.abs(low.slosh[:, 0]).max())
    return claim(
        'inertia', 'from h = 1.0 R to 1.5 R: mass, sloshing force',
        f'x {mass:.2f}, x {slosh:.2f}', 'inertia effect grows more', mass > slosh,
        evidence='engine, both fills',
        why='the inertia effect grows by more than the sloshing effect, as the text says',
    )  # fmt: skip


def turning_modes() -> dict[str, ModalCoefficients]:
    """One mode by the recipe with either shape, the exact one, and many."""
    c = cases.turned()
    push, cross = cases.at_infinity(c)[2:]
    first = cases.across(c, 1)
    found = {'exact, all modes': cases.across(c, len(c.mu)), 'exact, 1 mode': first}
    shapes: tuple[Shape, ...] = ('cosine', 'linear')
    for shape in shapes:
        m = recipe_mode(float(first.omega[0]), push, cross, 3.0, shape)
        coupling = first.coupling.copy()
        coupling[0, [1, 3]] = m.push, m.turn
        found[f'recipe, {shape}'] = replace(first, mu=np.array([m.mu]), coupling=coupling)
    return found


@cache
def turning_runs() -> dict[str, Run]:
    """Turn the cylinder of section 4.4."""
    time = np.arange(0.0, TURN_TIMES[-1], STEP)
    force = cases.level(time, sway=np.interp(time, TURN_TIMES, TURN))
    shape = {'shape': 'cylinder_x', 'radius': 1.5, 'length': 15.5, 'fill_depth': 1.5}
    return {name: cases.drive(shape, c, time, force) for name, c in turning_modes().items()}


def figure_7() -> Finding:
    """Draw the lateral acceleration that stands for Fig. 7."""
    return Finding(
        [
            claim(
                'curve', 'lateral acceleration of the turn',
                'trapezoid: 0.1 g from 1.5 s to 6.5 s', 'in a picture', True, verdict=Verdict.OPEN,
                why='the text gives no number of Fig. 7; amplitude and times here are ours',
                evidence='none', head=True,
            ),
        ],
        drawings=(
            Drawing(
                'fig7', 'Figure 7: a trapezoid in place of the acceleration of the paper.',
                picture('Turn to the left', 'time [s]',
                        [Panel('lateral acceleration [m/s²]',
                               (Curve('assumed', TURN_TIMES, TURN),))]),
                {'time [s]': TURN_TIMES, 'acceleration [m/s^2]': TURN},
            ),
        ),
    )  # fmt: skip


def _largest(wrench: Array) -> Array:
    return np.asarray(np.abs(wrench).max(axis=0))


def figure_8() -> Finding:
    """Sloshing force and moment while turning: trial shapes against the exact mode."""
    runs = turning_runs()
    cosine, linear = runs['recipe, cosine'], runs['recipe, linear']
    exact = runs['exact, all modes']
    apart = max(
        _largest(cosine.slosh - linear.slosh)[i] / _largest(cosine.slosh)[i] for i in (1, 3)
    )
    waves = float(np.abs(linear.beta).max() / np.abs(cosine.beta).max())
    # beta is the elevation at the wall in all three: f = 1 there
    wall = float(np.abs(cosine.beta).max() / np.abs(runs['exact, 1 mode'].beta).max())
    over = _largest(cosine.slosh)[[1, 3]] / _largest(exact.slosh)[[1, 3]]
    pivot = _largest(exact.total)[3] / _largest(exact.slosh)[3]
    rows = [
        claim(
            'identical', 'force and moment with cosine and with linear shape',
            f'equal to {apart:.0e}', '"remain identical"', apart < 1e-9, head=True,
            why='by construction: the recipe takes lambda²/mu from the added mass, whatever the '
            'shape. It is no evidence for either; wave heights do differ (linear over cosine '
            f'{waves:.2f}, cosine over exact {wall:.2f})',
            evidence='engine with the coefficients of both',
        ),
        claim(
            'conservative', 'recipe over exact: force, moment',
            f'{over[0]:.3f}, {over[1]:.3f}', '"on the conservative side"',
            bool(np.all(over > 1.0)),
            head=True, evidence='engine, recipe against all sway modes',
            why='the recipe lumps all modes into one, at the frequency of the first. The text '
            'says it of CFD, whose curve is in a picture',
        ),
        claim(
            'curve', "the paper's curves and the CFD of its ref. [17]", 'not in the text',
            'in pictures', True, verdict=Verdict.OPEN, why='nothing to compare with',
            evidence='none',
        ),
    ]  # fmt: skip
    time = cosine.time
    names = {'exact, all modes': 'exact, all modes', 'recipe, cosine': 'recipe, cosine',
             'recipe, linear': 'recipe, linear (on top)'}  # fmt: skip
    panels = [
        Panel('wave at the wall,\nfirst mode [m]',
              [Curve('exact', time, runs['exact, 1 mode'].beta[:, 0]),
               Curve('recipe, cosine', time, cosine.beta[:, 0]),
               Curve('recipe, linear', time, linear.beta[:, 0])]),
        Panel('sloshing force F2 [kN]',
              [Curve(label, time, runs[n].slosh[:, 1] / 1e3) for n, label in names.items()]),
        Panel('sloshing moment M4 [kN m]',
              [Curve(label, time, runs[n].slosh[:, 3] / 1e3) for n, label in names.items()]),
    ]  # fmt: skip
    columns = {'time [s]': time}
    for name, run in runs.items():
        columns |= {
            f'beta_1 [m], {name}': run.beta[:, 0],
            f'F2 [N], {name}': run.slosh[:, 1],
            f'M4 [N m], {name}': run.slosh[:, 3],
        }
    return Finding(
        rows,
        text=(
            'Half-full cylinder R = 1.5 m, L = 15.5 m, gasoline (820 kg/m³), turned as in fig7.',
            'Pressures on a circle pass through its axis, so that the liquid cannot turn it: the '
            'sloshing moment drawn here is cancelled by that of the liquid as a solid. Of the '
            f'sum, {pivot:.0e} of the sloshing part is left.',
        ),
        drawings=(
            Drawing(
                'fig8', 'Figure 8: wave, sloshing force and moment about O while turning.',
                picture('Turning at 0.1 g', 'time [s]', panels), columns,
            ),
        ),
    )  # fmt: skip
