"""Wall pressure in a pitching tank: Figure 9, and the measurement of Akyildiz & Unal (2006)."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from slosh_ros.constants import GRAVITY
from slosh_ros.hydro import ModalCoefficients, coefficients_of
from slosh_ros.study.paper import cases
from slosh_ros.study.paper.cases import Array
from slosh_ros.study.paper.draw import Curve, Panel, picture
from slosh_ros.study.paper.item import Drawing, Finding, Grid, Row, Verdict, claim
from slosh_ros.study.paper.measured import AGREES, judged, rms_error, table
from slosh_ros.tank import rectangular

LENGTH, WIDTH, HEIGHT = 0.92, 0.46, 0.62  # [m]
OMEGA = 2.0  # of the pitching [rad/s]
SENSOR = 0.06  # height of Figure 9's over the bottom [m]
MODES = 30
DAMPING = 0.01  # only to let the start die away
LEAD = 10.0  # [deg] that a digitised curve may be off
SPIN_UP, STEP = 14.0, 0.02  # [s]
AXES = ('bottom', 'mid-height', 'free surface')

FIGURE_9 = {'a': 0.25, 'b': 0.5}  # fills
PROBES = {2: 0.17, 8: 0.45}  # heights over the bottom [m]
FULL = 0.465  # depth of the measurement [m]


class Pitched(NamedTuple):
    """Time [s], whole gauge pressure of the points [Pa], room of linear theory used up."""

    time: Array
    pressure: Array
    use: float


@cache
def _liquid(depth: float) -> ModalCoefficients:
    return coefficients_of(rectangular(LENGTH, WIDTH, HEIGHT), depth, 1000.0, MODES)


@cache
def pitched(
    depth: float, degrees: float, axis: str, heights: tuple[float, ...], damping: float = DAMPING
) -> Pitched:
    """
    Pitch the tank by theta_0 sin(omega t), nose down, about a level axis across its middle.

    Parameters
    ----------
    depth : float
        Of the water [m].
    degrees : float
        Amplitude.
    axis : str
        One of `AXES`.
    heights : tuple of float
        Points over the bottom [m]: on the end wall that goes down first; below zero, on the other.
    damping : float
        Damping ratio of all modes.
    """
    c = _liquid(depth)
    place = {'bottom': -depth, 'mid-height': HEIGHT / 2.0 - depth, 'free surface': 0.0}[axis]
    time = np.arange(-SPIN_UP, 10.0 + STEP / 2.0, STEP)
    # it swells over half the run-up, so that what is left at zero is the steady motion
    share = np.clip((time + SPIN_UP) / (SPIN_UP / 2.0), 0.0, 1.0)
    swell, swell_rate = share**2 * (3.0 - 2.0 * share), 6.0 * share * (1.0 - share) / (SPIN_UP / 2)
    largest = np.radians(degrees)
    angle = largest * swell * np.sin(OMEGA * time)
    rate = np.zeros((len(time), 3))
    rate[:, 1] = largest * (
        swell_rate * np.sin(OMEGA * time) + swell * OMEGA * np.cos(OMEGA * time)
    )
    # an accelerometer on the axis feels gravity alone
    force = GRAVITY * np.column_stack([-np.sin(angle), np.zeros_like(angle), np.cos(angle)])
    points = {
        f'p{k}': np.array([np.copysign(LENGTH / 2.0, z), 0.0, abs(z) - depth])
        for k, z in enumerate(heights)
    }
    tank = {'shape': 'rectangular', 'length': LENGTH, 'width': WIDTH, 'height': HEIGHT,
            'fill_depth': depth}  # fmt: skip
    run = cases.drive(tank, c, time + SPIN_UP, force, rate, place, damping, points)
    kept = time >= -STEP / 2.0
    at_rest = c.density * GRAVITY * (depth - np.abs(heights))
    return Pitched(time[kept], run.pressure[kept] + at_rest, float(run.use[kept].max()))


def _swing(values: Array) -> float:
    """Half the distance from the lowest to the highest."""
    return float(values.max() - values.min()) / 2.0


def _harmonic(time: Array, values: Array) -> complex:
    """Amplitude and phase of the motion's own frequency, by least squares."""
    turn = OMEGA * time
    basis = np.column_stack([np.ones_like(turn), np.sin(turn), np.cos(turn)])
    _, in_phase, ahead = np.linalg.lstsq(basis, values, rcond=None)[0]
    return complex(in_phase, ahead)


def figure_9() -> Finding:
    """Wall pressure at both fills, both amplitudes, three axes."""
    rows: list[Row] = []
    panels, table_rows = [], []
    columns: dict[str, Array] = {}
    for part, fill in FIGURE_9.items():
        depth = fill * HEIGHT
        omega = float(_liquid(depth).omega[0])
        runs = {
            (angle, axis): pitched(depth, angle, axis, (SENSOR,))
            for angle in (4.0, 8.0)
            for axis in AXES
        }
        swings = {key: _swing(run.pressure[:, 0]) for key, run in runs.items()}
        for angle in (4.0, 8.0):
            values = [swings[angle, axis] for axis in AXES]
            use = max(runs[angle, axis].use for axis in AXES)
            table_rows.append(
                (f'{fill:.0%} full, {angle:g} deg', *(f'{v:.0f}' for v in values), f'{use:.0%}')
            )
            rows.append(
                claim(
                    f'swing_{part}_{angle:g}',
                    f'pressure amplitude, {fill:.0%} full, {angle:g} deg',
                    f'{min(values):.0f} to {max(values):.0f}', 'in a picture',
                    abs(swings[8.0, AXES[0]] / swings[4.0, AXES[0]] - 2.0) < 0.02, unit='Pa',
                    verdict=Verdict.OPEN, head=angle == 4.0,
                    why='neither the curve nor the height of the pitch axis is in the text; '
                    'the range is that of axis at bottom, mid-height and surface',
                    evidence='engine, 30 modes, pressure by eq (37)',
                )
            )  # fmt: skip
        use_4, use_8 = (max(runs[a, axis].use for axis in AXES) for a in (4.0, 8.0))
        if part == 'b':
            rows.append(
                claim(
                    'nonlinear', 'linear at 4 deg, overestimated at 8 deg, half full',
                    f'room of linear theory used up: {use_4:.0%} and {use_8:.0%}',
                    'measured curve in a picture', 1.5 < use_8 / use_4 < 4.5, head=True,
                    verdict=Verdict.OPEN, why='by the limits of the engine 8 deg is near the end '
                    f'of linear theory; first natural frequency {omega:.2f} rad/s',
                    evidence='validity limits of the engine',
                )
            )  # fmt: skip
        time = runs[4.0, AXES[0]].time
        for angle in (4.0, 8.0):
            panels.append(
                Panel(f'{fill:.0%} full, {angle:g} deg\n[kPa]',
                      [Curve(f'axis at {axis}', time, runs[angle, axis].pressure[:, 0] / 1e3)
                       for axis in AXES])
            )  # fmt: skip
            columns |= {
                f'p [Pa], {fill:.0%}, {angle:g} deg, {axis}': runs[angle, axis].pressure[:, 0]
                for axis in AXES
            }
    rows.append(
        claim(
            'captions', 'captions of Figure 9: "h_1 = 0.5 R", "1.0 R"', '25 % and 50 % full',
            '0.5 R and 1.0 R', tuple(FIGURE_9.values()) == (0.5 / 2.0, 1.0 / 2.0),
            verdict=Verdict.MISPRINT, evidence='h/(2 R)',
            why='a box has no R: of a cylinder these depths are 25 % and 50 % of the height, the '
            'fills of the text',
        )
    )  # fmt: skip
    return Finding(
        rows,
        text=(
            'Tank 0.92 m x 0.46 m x 0.62 m, pitched by theta_0 sin(2 t); sensor on an end wall '
            '0.06 m over the bottom.',
        ),
        drawings=(
            Drawing('fig9', 'Figure 9: whole pressure at the sensor, steady motion.',
                    picture('Wall pressure under pitching at 2 rad/s', 'time [s]', panels),
                    {'time [s]': time, **columns}),
        ),
        grids=(
            Grid('Pressure amplitude [Pa] by height of the pitch axis',
                 ('', *AXES, 'room of linear theory used'), table_rows),
        ),
    )  # fmt: skip


def akyildiz() -> Finding:
    """Wall pressure measured by Akyildiz & Unal (2006), 75 % full."""
    heights = (PROBES[2], -PROBES[8])
    runs = {axis: pitched(FULL, 4.0, axis, heights) for axis in AXES}
    rows: list[Row] = []
    panels, table_rows = [], []
    columns: dict[str, Array] = {'time [s]': runs[AXES[0]].time}
    for k, probe in enumerate(PROBES):
        data = table('slosh_experiments', f'akyildiz2006_probe{probe}_pressure')
        when, theirs = data['t_s'], data['pressure_kPa']
        ours = {
            axis: np.interp(when, run.time, np.maximum(run.pressure[:, k], 0.0) / 1e3)
            for axis, run in runs.items()
        }
        dry = max(float(np.mean(run.pressure[:, k] < 0.0)) for run in runs.values())
        offset = float(theirs.min()) if dry else float(np.mean(theirs - ours['bottom']))
        measured = _harmonic(when, theirs)
        ratios = {axis: _harmonic(when, mine) / measured for axis, mine in ours.items()}
        errors = {axis: abs(ratio) - 1.0 for axis, ratio in ratios.items()}
        nearest = min(AXES, key=lambda axis: abs(errors[axis]))
        for axis, mine in ours.items():
            # a dry sensor reads nothing: what it shows then is its zero
            left = rms_error(mine + offset - theirs.mean(), theirs - theirs.mean())
            table_rows.append(
                (f'probe {probe}, axis at {axis}', f'{abs(ratios[axis] * measured):.3f}',
                 f'{abs(measured):.3f}', f'{errors[axis]:+.1%}',
                 f'{np.degrees(np.angle(ratios[axis])):+.0f}', f'{left:.0%}', f'{offset:+.2f}')
            )  # fmt: skip
            columns[f'p [kPa], probe {probe}, {axis}'] = runs[axis].pressure[:, k] / 1e3
        amplitudes = ', '.join(f'{abs(ratios[axis] * measured):.3f}' for axis in AXES)
        rows.append(
            judged(
                f'probe_{probe}', f'pressure amplitude, probe {probe}, axis at {", ".join(AXES)}',
                amplitudes, f'{abs(measured):.3f}', 'kPa', errors[nearest], AGREES,
                runs[nearest].use, head=True,
                why='the height of the axis is not stated with the data; the '
                f'difference is that of the nearest, {nearest}'
                + ('. The sensor falls dry, which linear theory does not know' if dry else ''),
                evidence='engine, 30 modes, steady motion',
            )
        )  # fmt: skip
        lead = float(np.degrees(np.angle(ratios[nearest])))
        rows.append(
            claim(
                f'lead_{probe}', f'phase, probe {probe}: lead of ours', f'{lead:+.0f}',
                'digitised curve', abs(lead) < LEAD, unit='deg',
                why=f'{np.radians(lead) / OMEGA:.2f} s: of the size of what digitising a printed '
                'curve may be off', evidence='least squares at 2 rad/s',
            )
        )  # fmt: skip
        columns |= {f'time of measurement [s], probe {probe}': when,
                    f'p measured [kPa], probe {probe}': theirs}  # fmt: skip
        panels.append(
            Panel(f'probe {probe} [kPa]',
                  [*(Curve(f'axis at {axis}', run.time,
                           np.maximum(run.pressure[:, k], 0.0) / 1e3 + offset)
                     for axis, run in runs.items()), Curve('measured', when, theirs, True)])
        )  # fmt: skip
    return Finding(
        rows,
        text=(
            'Tank of Figure 9, 75 % full, pitched by 4 degrees at 2 rad/s; probe 2 is 0.17 m over '
            'the bottom on one end wall, probe 8 0.45 m on the other, 0.015 m below the mean '
            'surface. Curves digitised from a published figure (data: PySPH developers, '
            'BSD-3-Clause). The zero of the sensors is not stated: ours are drawn with the offset '
            'of the table, and amplitudes at 2 rad/s are compared.',
        ),
        drawings=(
            Drawing('akyildiz2006', 'Wall pressure: linear theory and measurement.',
                    picture('Akyildiz & Unal 2006, fig. 5', 'time [s]', panels), columns),
        ),
        grids=(
            Grid('Amplitudes at 2 rad/s, lead of ours, rms of the difference',
                 ('', 'ours [kPa]', 'measured [kPa]', 'difference', 'lead [deg]', 'rms left',
                  'offset [kPa]'),
                 table_rows),
        ),
    )  # fmt: skip
