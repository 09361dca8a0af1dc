"""Sloshing computed by two-phase CFD and measured in the laboratory, against linear theory."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from functools import cache
from importlib.resources import files

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar

from slosh_ros.constants import GRAVITY
from slosh_ros.hydro import ModalCoefficients, coefficients_of
from slosh_ros.study.paper import cases
from slosh_ros.study.paper.cases import Array, Run
from slosh_ros.study.paper.draw import Curve, Panel, picture
from slosh_ros.study.paper.item import Drawing, Finding, Grid, Row, Verdict
from slosh_ros.tank import rectangular

AGREES = 0.05  # rms over rms up to which a history counts as reproduced
PRESSURE = 0.1  # the same of a pressure at a single point
START = 0.1  # [s] of the CFD that its README tells to leave out
WATER = 1.0e-6  # kinematic viscosity [m^2/s]
DAMPINGS = (0.0, 0.005, 0.01, 0.02, 0.05)

NARROW = 0.1  # [m]; with a density ten times that of water, all is per metre of width
RECTANGLES = {'0p005g': 0.005, '0p02g': 0.02, '0p1g': 0.1, '0p2g': 0.2}

ALL = 60  # modes of the cylinder, 24 of them along it
# on the end walls, in the middle: which end, and height about O [m]; those at -0.2 m run dry
SENSORS = {
    'rear': (-1, -0.6), 'front': (1, -0.6), 'rear_low': (-1, -1.0), 'front_low': (1, -1.0),
}  # fmt: skip

# Faltinsen et al. 2000, fig. 7
LENGTH, DEPTH, AMPLITUDE, PERIOD, PROBE = 1.73, 0.6, 0.032, 1.3, 0.05


@cache
def table(folder: str, name: str) -> dict[str, Array]:
    """Read a data file of the package: columns by name."""
    text = (files('slosh_ros.study') / 'data' / folder / f'{name}.csv').read_text('ascii')
    head, *rows = csv.reader(text.splitlines())
    columns = np.array(rows, dtype=float).T
    return dict(zip(head, columns, strict=True))


def rms_error(ours: Array, theirs: Array) -> float:
    """Root mean square of the difference over that of theirs."""
    return float(np.sqrt(np.mean((ours - theirs) ** 2) / np.mean(theirs**2)))


def judged(
    key: str, what: str, ours: str, theirs: str, unit: str, difference: float, within: float,
    use: float, *, why: str = '', evidence: str = '', head: bool = False,
) -> Row:  # fmt: skip
    """
    Judge against data: reproduced, or beyond linear theory by the engine's own verdict.

    Parameters
    ----------
    key, what, ours, theirs, unit, why, evidence, head
        See `Row`.
    difference, within : float
        Relative difference, and how much of it counts as reproduced.
    use : float
        How much of the room of linear theory the run used up, as the engine told.
    """
    if abs(difference) <= within:
        verdict = Verdict.REPRODUCED
    else:
        verdict = Verdict.BEYOND if use > 1.0 else Verdict.DIFFERENT
    return Row(key, what, ours, theirs, unit, difference, within, verdict, why, evidence, head)


def _started(data: dict[str, Array]) -> tuple[Array, Array]:
    """Time and acceleration of a CFD file, from rest at time zero."""
    return np.append(0.0, data['t_s']), np.append(0.0, data['ax_tank_m_s2'])


def _damping_grid(caption: str, errors: Sequence[tuple[str, Sequence[float]]]) -> Grid:
    heads = ('', *(f'{100 * z:g} %' for z in DAMPINGS))
    rows = [(name, *(f'{e:.1%}' for e in values)) for name, values in errors]
    return Grid(caption, heads, rows)


# --- cylinder ----------------------------------------------------------------------------------


@cache
def cylinder_run(damping: float = 0.0) -> Run:
    """Brake the half-full cylinder of section 4.3 as the CFD does."""
    time, surge = _started(table('cfd', 'cylinder_braking_0p1g'))
    c = cases.braked(1.0, ALL)
    tank = {'shape': 'cylinder_x', 'radius': 1.2, 'length': 5.75, 'fill_depth': 1.2}
    points = {name: np.array([end * 2.875, 0.0, z]) for name, (end, z) in SENSORS.items()}
    force = cases.level(time, surge)
    return cases.drive(tank, c, time, force, damping=damping, points=points)


def _first_peaks(values: Array) -> Array:
    """Places of the crests, highest of their neighbourhood, in order of time."""
    inner = (values[1:-1] > values[:-2]) & (values[1:-1] >= values[2:])
    places = 1 + np.flatnonzero(inner)
    high = places[values[places] > 0.5 * values.max()]
    return np.array([p for p in high if values[p] >= values[max(0, p - 50) : p + 51].max()])


def cylinder() -> Finding:
    """Two-phase CFD of section 4.3."""
    data = table('cfd', 'cylinder_braking_0p1g')
    late = data['t_s'] > START
    run = cylinder_run()
    ours, theirs = run.total[1:, 0], data['Fx_N']
    moment, their_moment = run.total[1:, 4], data['My_Nm']
    use = float(run.use.max())
    weight = cases.braked(1.0).mass * 0.1 * GRAVITY
    rows = [
        _rms_row('force', 'longitudinal force', ours[late], theirs[late], use, head=True),
        _rms_row('moment', 'pitch moment about the axis', moment[late], their_moment[late], use),
    ]
    for n, (mine, other) in enumerate(
        zip(_first_peaks(ours)[:2], _first_peaks(theirs)[:2], strict=True), start=1
    ):
        rows.append(
            judged(
                f'peak_{n}', f'force peak {n} over m a, at {data["t_s"][other]:.2f} s',
                f'{ours[mine] / weight:.3f} at {data["t_s"][mine]:.2f} s',
                f'{theirs[other] / weight:.3f}', '-', float(ours[mine] / theirs[other] - 1.0),
                AGREES, use, head=n == 1, evidence='engine, undamped',
            )
        )  # fmt: skip
    lowest = [float(f[data['t_s'] > 4.0].min()) / 1e3 for f in (ours, theirs)]
    errors = [rms_error(cylinder_run(z).total[1:][late, 0], theirs[late]) for z in DAMPINGS]
    time = data['t_s']
    walls: dict[str, tuple[Array, Array]] = {}
    for k, (name, (end, z)) in enumerate(sorted(SENSORS.items())):
        walls[name] = (
            run.pressure[1:, k] / 1e3,
            (data[f'p_Pa@x={end * 2.875:.4f};z={z:.4f}'] + 1000.0 * GRAVITY * z) / 1e3,
        )
        mine, other = (p[late] for p in walls[name])
        rows.append(
            _rms_row(f'pressure_{name}', f'dynamic pressure, {name.replace("_", " ")}', mine,
                     other, use, within=PRESSURE, why='nonlinear, as the force: single points '
                     'show it more than their sum')
        )  # fmt: skip
    return Finding(
        rows,
        text=(
            'The half-full cylinder of section 4.3, braked at 0.1 g: 51,200 cells, one mesh (see '
            f'the README of the data). Linear theory: {ALL} modes, undamped. The wave uses up '
            f'{use:.0%} of the room of linear theory by the judgement of the engine.',
            'What is left looks nonlinear: troughs are shallower (between the peaks the force '
            f'falls to {lowest[1]:.1f} kN, to {lowest[0]:.1f} kN in linear theory) and crests '
            'come earlier. The mesh of the CFD was not varied: part of it may be its error.',
        ),
        drawings=(
            Drawing(
                'cfd_cylinder', 'Figure 6 again, with two-phase CFD: whole force and moment.',
                picture('Half-full cylinder, braking at 0.1 g', 'time [s]', [
                    Panel('force Fx [kN]', (Curve('linear theory', time, ours / 1e3),
                                            Curve('CFD', time, theirs / 1e3))),
                    Panel('moment My about\nthe axis [kN m]',
                          (Curve('linear theory', time, moment / 1e3),
                           Curve('CFD', time, their_moment / 1e3))),
                    Panel('dynamic pressure on the\nend walls, 0.6 m deep [kPa]',
                          [Curve(f'{end}, {who}', time, walls[end][k])
                           for end in ('front', 'rear')
                           for k, who in enumerate(('linear theory', 'CFD'))]),
                ]),
                {'time [s]': time, 'Fx [N], linear': ours, 'Fx [N], CFD': theirs,
                 'My [N m], linear': moment, 'My [N m], CFD': their_moment,
                 **{f'p [kPa], {name}, {who}': pair[k] for name, pair in walls.items()
                    for k, who in enumerate(('linear', 'CFD'))}},
            ),
        ),
        grids=(_damping_grid('rms error of the force by damping ratio', [('force', errors)]),),
    )  # fmt: skip


def _rms_row(
    key: str, what: str, ours: Array, theirs: Array, use: float, *, head: bool = False,
    why: str = '', within: float = AGREES,
) -> Row:  # fmt: skip
    error = rms_error(ours, theirs)
    return judged(
        f'rms_{key}', f'rms of the difference, {what}', f'{error:.1%}', 'of the rms of theirs', '',
        error, within, use, head=head, why=why, evidence='engine against the data, all instants',
    )  # fmt: skip


# --- rectangle ---------------------------------------------------------------------------------


@cache
def shallow_tank() -> ModalCoefficients:
    """Solve the rectangle of the CFD, so narrow that its lowest modes run along it."""
    return coefficients_of(rectangular(8.0, NARROW, 1.6), 0.8, 1000.0 / NARROW, 24)


@cache
def rectangle_run(name: str, damping: float = 0.0) -> Run:
    """Drive the 8 m rectangle as the CFD does, per metre of width."""
    time, surge = _started(table('cfd', f'rectangle_8m_{name}'))
    c = shallow_tank()
    tank = {'shape': 'rectangular', 'length': 8.0, 'width': NARROW, 'height': 1.6,
            'fill_depth': 0.8}  # fmt: skip
    return cases.drive(tank, c, time, cases.level(time, surge), damping=damping)


def rectangles() -> Finding:
    """Two-phase CFD of a shallow rectangle, from mild to violent."""
    rows, panels, errors, over = [], [], [], []
    columns: dict[str, Array] = {}
    for name, level in RECTANGLES.items():
        data, run = table('cfd', f'rectangle_8m_{name}'), rectangle_run(name)
        time, theirs, ours = data['t_s'], data['Fx_N_per_m'], run.total[1:, 0]
        late = time > START
        use, wave = float(run.use.max()), float(run.elevation_max.max())
        peak = float(np.abs(ours).max() / np.abs(theirs).max())
        early = float(time[np.abs(ours).argmax()] - time[np.abs(theirs).argmax()])
        rows.append(
            _rms_row(name, f'force at {level} g', ours[late], theirs[late], use, head=True,
                     why=f'wave {wave / 0.8:.2f} of the depth, {use:.0%} of the room of linear '
                     'theory used up')
        )  # fmt: skip
        rows.append(
            judged(
                f'peak_{name}', f'largest force at {level} g', f'{np.abs(ours).max() / 1e3:.3f}',
                f'{np.abs(theirs).max() / 1e3:.3f}', 'kN/m', peak - 1.0, AGREES, use,
                evidence='engine, 24 modes, undamped',
                why='' if use <= 1.0 else
                f'theirs comes {early:.1f} s earlier: in shallow water high waves are fast',
            )
        )  # fmt: skip
        panels.append(
            Panel(f'force at {level} g\n[kN/m]',
                  (Curve('linear theory', time, ours / 1e3), Curve('CFD', time, theirs / 1e3)))
        )  # fmt: skip
        columns |= {f'time [s], {level} g': time, f'Fx [N/m], linear, {level} g': ours,
                    f'Fx [N/m], CFD, {level} g': theirs}  # fmt: skip
        over += [f'{rms_error(theirs[late], ours[late]):.0%}'] if use > 1.0 else []
        errors.append(
            (f'{level} g', [rms_error(rectangle_run(name, z).total[1:, 0][late], theirs[late])
                            for z in DAMPINGS])
        )  # fmt: skip
    return Finding(
        rows,
        text=(
            'Rectangle 8 m long, 0.8 m deep (the plan of Table 1), water; the acceleration rises '
            'to its value in 0.5 s. So shallow a tank is where linear theory leaves the road: '
            'from 0.1 g on its crests come early and break into bores. Errors here are over the '
            'rms of the CFD; over that of linear theory, which is higher, they are '
            f'{" and ".join(over)} at 0.1 and 0.2 g.',
        ),
        drawings=(
            Drawing('cfd_rectangle', 'Force from mild to violent, linear theory and CFD.',
                    picture('Shallow rectangle under a sudden acceleration', 'time [s]', panels),
                    columns),
        ),
        grids=(_damping_grid('rms error of the force by damping ratio', errors),),
    )  # fmt: skip


# --- Faltinsen et al. 2000 ---------------------------------------------------------------------


@cache
def wave_tank() -> ModalCoefficients:
    """Solve the tank of Faltinsen et al. (2000)."""
    return cases.along(coefficients_of(rectangular(LENGTH, 0.2, 1.05), DEPTH, 1000.0, 60), 12)


@cache
def wave_run(damping: float = 0.0) -> tuple[Array, Array, Run]:
    """Time, wave height at the probe [m], and the run."""
    c = wave_tank()
    time = np.arange(0.0, 10.0, 0.01)
    omega = 2.0 * np.pi / PERIOD
    surge = -AMPLITUDE * omega**2 * np.cos(omega * time)
    tank = {'shape': 'rectangular', 'length': LENGTH, 'width': 0.2, 'height': 1.05,
            'fill_depth': DEPTH}  # fmt: skip
    run = cases.drive(tank, c, time, cases.level(time, surge), damping=damping)
    middle = np.abs(c.surface_points[:, 1]) < 1e-9
    x = c.surface_points[middle, 0]
    at_probe = CubicSpline(x, c.surface_shapes[middle])(PROBE - LENGTH / 2.0)
    return time, run.beta @ at_probe, run


def own_frequency(time: Array, wave: Array) -> float:
    """Frequency of the free wave beside the forced one, by least squares [rad/s]."""
    forced = 2.0 * np.pi / PERIOD

    def rest(free: float) -> float:
        columns = [f(w * time) for w in (forced, free) for f in (np.cos, np.sin)]
        matrix = np.column_stack([*columns, np.ones_like(time)])
        return float(np.sum((wave - matrix @ np.linalg.lstsq(matrix, wave, rcond=None)[0]) ** 2))

    return float(minimize_scalar(rest, bounds=(0.65 * forced, 0.95 * forced), method='bounded').x)


def _delay(when: Array, theirs: Array, time: Array, wave: Array) -> tuple[float, float]:
    """Find the delay [s] of a measurement, and the rms error left with it."""

    def left(delay: float) -> float:
        return rms_error(np.interp(when - delay, time, wave), theirs)

    best = minimize_scalar(left, bounds=(-0.3, 0.3), method='bounded')
    return float(best.x), float(best.fun)


def faltinsen() -> Finding:
    """Wave height of Faltinsen, Rognebakke, Lukovsky & Timokha (2000), fig. 7."""
    data = table('slosh_experiments', 'faltinsen2000_wave_height')
    when, theirs = data['t_s'], data['wave_height_m']
    time, wave, run = wave_run()
    ours = np.interp(when, time, wave)
    use, c = float(run.use.max()), wave_tank()
    forced = 2.0 * np.pi / PERIOD
    own = [own_frequency(t, w) for t, w in ((time, wave), (when, theirs))]
    beats = [2.0 * np.pi / (forced - w) for w in own]
    crests, troughs = ([float(s * w.max() if s > 0 else -w.min()) for w in (ours, theirs)]
                       for s in (1.0, -1.0))  # fmt: skip
    asymmetry = [crest / trough for crest, trough in zip(crests, troughs, strict=True)]
    laminar = float(c.wall_damping_ratio(WATER)[0])
    first = when < 2.5
    errors = [rms_error(np.interp(when, *wave_run(z)[:2]), theirs) for z in DAMPINGS]
    rows = [
        _rms_row('wave', 'wave height', ours, theirs, use, head=True,
                 why='the measured wave is nonlinear: the engine says so by the slope, '
                 f'{use:.1f} of what linear theory bears'),
        _rms_row('wave_start', 'wave height, first 2.5 s', ours[first], theirs[first], use,
                 why='late, and with shallower troughs, from the first wave on'),
        judged('crest', 'highest crest', f'{crests[0]:.3f}', f'{crests[1]:.3f}', 'm',
               crests[0] / crests[1] - 1.0, AGREES, use, head=True, evidence='all instants',
               why='linear theory makes crests as high as troughs are deep'),
        judged('trough', 'deepest trough', f'{troughs[0]:.3f}', f'{troughs[1]:.3f}', 'm',
               troughs[0] / troughs[1] - 1.0, AGREES, use, evidence='all instants',
               why='nonlinear waves have high crests and shallow troughs'),
        judged('asymmetry', 'crest over trough', f'{asymmetry[0]:.2f}', f'{asymmetry[1]:.2f}',
               '-', asymmetry[0] / asymmetry[1] - 1.0, AGREES, use, head=True,
               evidence='all instants', why='beyond any linear theory'),
        judged('beat', 'beat period', f'{beats[0]:.2f}', f'{beats[1]:.2f}', 's',
               beats[0] / beats[1] - 1.0, AGREES, use, head=True,
               evidence='two sinusoids fitted: the forced one, and a free one of any frequency',
               why=f'free wave at {own[0]:.3f} rad/s in linear theory, {own[1]:.3f} measured; '
               f'exact first mode {c.omega[0]:.3f}'),
    ]  # fmt: skip
    delay = _delay(when[first], theirs[first], time, wave)
    return Finding(
        rows,
        text=(
            'Tank 1.73 m long, 0.6 m deep, moved by 0.032 m cos(2 pi t/1.3 s) from rest; linear '
            f'first period {2 * np.pi / c.omega[0]:.2f} s; probe 0.05 m from the wall. Curve '
            'digitised from a published figure (data: PySPH developers, BSD-3-Clause).',
            f'In the first 2.5 s the measured wave is {delay[0]:.2f} s late; with its clock set '
            f'so, {delay[1]:.0%} rms are left there.',
            f'Used here: no damping. Boundary layers of water at smooth walls would give '
            f'{laminar:.2%} (for a width of 0.2 m). The table has a flat minimum near 1 %: more '
            'damping lowers the waves that nonlinearity has lowered.',
        ),
        drawings=(
            Drawing(
                'faltinsen2000', 'Wave height at the probe: linear theory and measurement.',
                picture('Faltinsen et al. 2000, fig. 7', 'time [s]', [
                    Panel('wave height [m]', (Curve('linear theory', time, wave),
                                              Curve('measured', when, theirs, True))),
                ]),
                {'time [s]': time, 'wave [m], linear': wave, 'time of measurement [s]': when,
                 'wave [m], measured': theirs},
            ),
        ),
        grids=(_damping_grid('rms error of the wave height by damping ratio',
                             [('wave height', errors)]),),
    )  # fmt: skip
