"""What a user may expect of linear theory, near and far from resonance."""

from __future__ import annotations

from functools import cache

import numpy as np

from slosh_ros.constants import GRAVITY
from slosh_ros.study.paper import cases, measured
from slosh_ros.study.paper.cases import Run
from slosh_ros.study.paper.draw import Curve, Panel, picture
from slosh_ros.study.paper.item import Drawing, Finding, Grid, claim
from slosh_ros.study.paper.measured import AMPLITUDE, DEPTH, LENGTH, PERIOD, rms_error

DAMPING = 0.01
RATIOS = (0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0, 1.05, 1.1, 1.2, 1.4)
_STEP, _PERIODS, _STEPS = 0.05, 15, 6


def _use(ratio: float, level: float) -> tuple[float, float]:
    """Room used up by a harmonic acceleration [g] that sets in at once, and its wave [m]."""
    c = cases.along(measured.wave_tank(), 4)
    time = np.arange(0.0, _PERIODS * 2.0 * np.pi / c.omega[0], _STEP)
    surge = -level * GRAVITY * np.cos(ratio * c.omega[0] * time)
    tank = {'shape': 'rectangular', 'length': LENGTH, 'width': 0.2, 'height': 1.05,
            'fill_depth': DEPTH}  # fmt: skip
    run = cases.drive(tank, c, time, cases.level(time, surge), damping=DAMPING)
    return float(run.use.max()), float(run.elevation_max.max())


@cache
def limit(ratio: float) -> tuple[float, float]:
    """Largest harmonic acceleration within linear theory [g], and its wave over the length."""
    level = 0.01
    for _ in range(_STEPS):  # the room used up goes with the acceleration, or with its square
        level /= _use(ratio, level)[0] ** 0.6
    return level, _use(ratio, level)[1] / LENGTH


def _histories() -> list[tuple[str, str, Run, float, float]]:
    """Give name, forcing, run, rms error and error of the largest value of every data set."""
    found = []
    for name, level in measured.RECTANGLES.items():
        data, run = measured.table('cfd', f'rectangle_8m_{name}'), measured.rectangle_run(name)
        found.append(('rectangle, depth 0.1 L', f'sudden {level} g', run, data['Fx_N_per_m']))
    cylinder = measured.table('cfd', 'cylinder_braking_0p1g')['Fx_N']
    found.append(
        ('half-full cylinder', '0.1 g in half a period', measured.cylinder_run(), cylinder)
    )
    rows = []
    for name, forcing, run, theirs in found:
        late, ours = run.time[1:] > measured.START, run.total[1:, 0]
        peak = float(np.abs(ours).max() / np.abs(theirs).max() - 1.0)
        rows.append((name, forcing, run, rms_error(ours[late], theirs[late]), peak))
    data = measured.table('slosh_experiments', 'faltinsen2000_wave_height')
    time, wave, run = measured.wave_run()
    ours = np.interp(data['t_s'], time, wave)
    ratio = 2.0 * np.pi / PERIOD / measured.wave_tank().omega[0]
    peak = float(np.abs(ours).max() / np.abs(data['wave_height_m']).max() - 1.0)
    rows.append((
        'rectangle, depth 0.35 L, measured',
        f'{AMPLITUDE / LENGTH:.1%} of the length at {ratio:.2f} of resonance', run,
        rms_error(ours, data['wave_height_m']), peak,
    ))  # fmt: skip
    return rows


def expectations() -> Finding:
    """Say what to expect, with numbers."""
    histories = _histories()
    within = [h for h in histories if h[2].use.max() <= 1.0]
    beyond = [h for h in histories if h[2].use.max() > 1.0]
    limits = {ratio: limit(ratio) for ratio in RATIOS}
    narrow = limits[0.5][0] / limits[1.0][0]
    worst, best = max(h[3] for h in within), min(h[3] for h in beyond)
    level, wave = np.array([limits[ratio] for ratio in RATIOS]).T
    name = 'largest within linear theory'
    forced = 2.0 * np.pi / PERIOD
    nearest = forced / measured.wave_tank().omega[0]
    theirs = Curve(
        'their experiment',
        [nearest],
        [AMPLITUDE * forced**2 / GRAVITY],
        points=True,
    )
    panels = [
        Panel('acceleration [g]', (Curve(name, RATIOS, level), theirs), log=True),
        Panel('wave height then\n[% of the length]', (Curve(name, RATIOS, 100.0 * wave),)),
    ]
    off = max(abs(h[4]) for h in beyond)
    return Finding(
        [
            claim('within', 'where the engine says "within linear theory": rms, largest value',
                  f'{worst:.1%} or less, {max(abs(h[4]) for h in within):.1%} or less',
                  f'CFD, {len(within)} cases', worst <= measured.AGREES,
                  evidence='table below', head=True),
            claim('beyond', 'where it says "beyond": rms, largest value',
                  f'{best:.0%} or more, {max(h[4] for h in beyond):+.0%} at most',
                  f'CFD and measured, {len(beyond)} cases',
                  best > measured.AGREES and min(h[4] for h in beyond) > 0.0,
                  why='loads come out too high, not too low: waves break and steepen',
                  evidence='table below', head=True),
            claim('resonance',
                  'largest acceleration to and fro, at half the frequency and at resonance',
                  f'{limits[0.5][0]:.3f} g and {limits[1.0][0]:.4f} g',
                  '"away from the natural frequency"', narrow > 10.0,
                  why=f'{narrow:.0f} times less at resonance ({DAMPING:.0%} damping, '
                  f'{_PERIODS} periods)', evidence='the validity limits of the engine', head=True),
        ],
        text=(
            'Far from resonance, and for starts and stops that take half a period or more, expect '
            f'forces within {worst:.0%} (rms) as long as "valid" is true. Beyond, the largest '
            f'value was within {off:.0%} all the same, in the cases here, but not the history: '
            'crests come early in shallow tanks, troughs are cut off, and what follows the first '
            'period is lost.',
            f'Near resonance the limit is at {limits[1.0][0]:.4f} g, with a wave of '
            f'{limits[1.0][1]:.1%} of the length; at half the frequency at {limits[0.5][0]:.3f} g '
            f'and {limits[0.5][1]:.1%}. Trust no amplitude that lasts there: the real wave limits '
            'itself at heights at which that of linear theory still grows (Moiseev; Faltinsen & '
            f'Timokha). The nearest measurement here is at {nearest:.2f} of resonance.',
            'Damping matters little off resonance over a few periods. At resonance it is all that '
            'matters, and of a smooth tank it is small: give damping_ratio from a test, not from '
            'a guess, if your vehicle dwells there.',
        ),
        drawings=(
            Drawing(
                'trust',
                'How hard a tank may be shaken within linear theory.',
                picture(
                    'Limits of linear theory, tank of Faltinsen et al. 2000',
                    'frequency of the motion / first natural frequency [-]',
                    panels,
                ),
                {'frequency ratio': RATIOS, 'acceleration [g]': level, 'wave over length': wave},
            ),
        ),
        grids=(
            Grid('All histories, undamped linear theory against data',
                 ('tank', 'forcing', 'room of linear theory used', 'rms error', 'largest value'),
                 [(name, forcing, f'{run.use.max():.0%}', f'{rms:.1%}', f'{peak:+.1%}')
                  for name, forcing, run, rms, peak in histories]),
        ),
    )  # fmt: skip
