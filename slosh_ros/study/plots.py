"""Pictures of modes and of drives. matplotlib is imported with this module only."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation
from numpy.typing import NDArray

from slosh_ros.bag import Recording
from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.hydro import ModalCoefficients
from slosh_ros.study.rollover import RolloverStudy
from slosh_ros.vehicle import Contact, History
from slosh_ros.vehicle.rollover import Rollover

# Okabe & Ito: told apart by colour-blind eyes; line styles tell them apart in grey
COLOURS = {'x': '#0072B2', 'y': '#D55E00', 'z': '#009E73', 'k': 'black', 'mark': '#CC79A7'}
STYLES = {'x': '-', 'y': '--', 'z': ':'}
_COLUMNS = 4
_VISIBLE = 1e-6  # a quantity that stays below it, in the units of a plot, is zero


def plot_modes(name: str, coefficients: ModalCoefficients, path: Path) -> None:
    """
    Draw the surface shape of every mode, seen from above.

    Parameters
    ----------
    name : str
        Name of the tank.
    coefficients : ModalCoefficients
        The modes.
    path : Path
        PNG, SVG or PDF file.

    Raises
    ------
    InputError
        If there is no mode.
    """
    c = coefficients
    count = len(c.names)
    if not count:
        raise InputError(f'{name} is empty or full: no mode can be drawn; choose another fill')
    columns = min(count, _COLUMNS)
    rows = -(-count // columns)
    figure = Figure(figsize=(3.4 * columns, 2.3 * rows + 0.9), layout='constrained')
    axes = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    mesh = Triangulation(*c.surface_points.T)
    middle = c.surface_points[mesh.triangles, 1].mean(axis=1)
    dry = [(begin < middle) & (middle < end) for begin, end in c.surface_gaps]
    mesh.set_mask(np.any([np.zeros(len(middle), dtype=bool), *dry], axis=0))
    for j, axis in enumerate(axes.flat):
        if j >= count:
            axis.set_visible(False)
            continue
        drawn = axis.tricontourf(
            mesh, c.surface_shapes[:, j], levels=np.linspace(-1, 1, 21), cmap='RdBu_r'
        )
        axis.tricontour(mesh, c.surface_shapes[:, j], levels=[0.0], colors='k', linewidths=0.8)
        axis.set_title(
            f'{c.names[j]}   {c.omega[j]:.3f} rad/s   {2 * np.pi / c.omega[j]:.2f} s', fontsize=9
        )
    for axis in axes[-1]:
        axis.set_xlabel('x, forward [m]')
    for axis in axes[:, 0]:
        axis.set_ylabel('y, left [m]')
    bar = figure.colorbar(drawn, ax=axes, shrink=0.8, ticks=[-1, -0.5, 0, 0.5, 1])
    bar.set_label('surface elevation f per modal coordinate [-]')
    figure.suptitle(
        f'{name}: sloshing modes, {c.liquid.fill_ratio:.0%} full, {c.mass / 1e3:.2f} t '
        f'({c.route}); black: nodal lines'
    )
    _save(figure, path)


def plot_sweep(name: str, found: Sequence[ModalCoefficients], path: Path) -> None:
    """
    Draw natural frequencies and the masses that modes move over the fill.

    Parameters
    ----------
    name : str
        Name of the tank.
    found : sequence of ModalCoefficients
        Of the same modes at rising or falling fill; without modes at its ends.
    path : Path
        PNG, SVG or PDF file.

    Raises
    ------
    InputError
        If there is no mode.
    """
    moving = [c for c in found if c.names]
    if not moving:
        raise InputError(f'{name} is empty or full: no mode can be drawn; choose other fills')
    figure = Figure(figsize=(9.0, 9.0), layout='constrained')
    frequency, mass = figure.subplots(2, 1, sharex=True)
    for k, mode in enumerate(dict.fromkeys(name for c in moving for name in c.names)):
        style = {'color': f'C{k % 10}', 'linestyle': '-' if k < 10 else '--', 'label': mode}
        there = [(c, c.names.index(mode)) for c in moving if mode in c.names]
        fill = [100.0 * c.liquid.fill_ratio for c, _ in there]
        frequency.plot(fill, [c.omega[j] for c, j in there], **style)
        if np.isfinite([c.lever[j] for c, j in there]).any():
            mass.plot(fill, [c.mass_moved[j] / 1e3 for c, j in there], **style)
    filled = [c for c in found if c.mass]
    everything = [100.0 * c.liquid.fill_ratio for c in filled]
    mass.plot(everything, [c.mass / 1e3 for c in filled], 'k:', label='all liquid')
    frequency.set_ylabel('natural frequency [rad/s]')
    mass.set_ylabel('mass that the mode moves [t]')
    mass.set_xlabel('fill [% of the volume]')
    mass.set_yscale('log')
    most = max(c.mass for c in found) / 1e3
    mass.set_ylim(1e-4 * most, 1.5 * most)
    for axis in (frequency, mass):
        axis.grid(alpha=0.3)
        axis.legend(ncols=2, fontsize=8, loc='center left', bbox_to_anchor=(1.0, 0.5))
    figure.suptitle(f'{name}: sloshing modes over the fill ({moving[0].route})')
    _save(figure, path)


def plot_replay(recording: Recording, title: str, path: Path) -> None:
    """
    Draw motion, wave height, force and moment over a shared time axis.

    Parameters
    ----------
    recording : Recording
        The replayed drive.
    title : str
        Title of the picture.
    path : Path
        PNG, SVG or PDF file.
    """
    time = recording.time
    rollover = recording.rollover
    heights = [1.1, 0.8, 1, 1.2, 1.2] + ([1.2] if rollover else [])
    figure = Figure(figsize=(11, 12.0 * sum(heights) / 5.3), layout='constrained')
    axes = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
    motion, turning, wave, force, moment = axes[:5]
    if recording.source == 'imu':
        specific = recording.force
        _lines(motion, time, specific[:, :2], 'measured specific force [m/s²]', thin=True)
    else:
        _lines(motion, time, recording.velocity[:, :2], 'velocity [m/s]')
    _lines(turning, time, recording.rate, 'angular rate [rad/s]', thin=True)
    _waves(wave, recording)
    _lines(force, time, recording.wrench[:, :2] / 1e3, 'sloshing force [kN]')
    _lines(moment, time, recording.wrench[:, 3:] / 1e3, 'sloshing moment [kN m]')
    if rollover:
        _rollover(axes[5], time, rollover)
    axes[-1].set_xlabel('time since the first sample [s]')
    for axis in axes:
        axis.grid(alpha=0.3)
        axis.margins(x=0)
    figure.suptitle(f'{title}   (loads on the tank, in {recording.frame})')
    _save(figure, path)


def plot_closed_loop(
    history: NDArray[np.void],
    recording: Recording,
    truth: History,
    solid: History,
    path: Path,
) -> None:
    """
    Draw a truck with liquid and with solid cargo over a shared time axis.

    Parameters
    ----------
    history : structured array, shape (n,)
        The log of vehicle_node.
    recording : Recording
        Loads at the same instants.
    truth, solid : History
        The scenario as one system of equations, with liquid and with frozen cargo.
    path : Path
        PNG, SVG or PDF file.
    """
    time = history['t']
    figure = Figure(figsize=(11, 14), layout='constrained')
    axes = figure.subplots(6, 1, sharex=True, height_ratios=[0.8, 1.1, 1.1, 1, 0.8, 1.2])
    motion, pitch, force, moment, wave, axles = axes
    motion.plot(time, history['u'], color='k', label='speed [m/s]')
    motion.plot(time, history['ax'], '--', color=COLOURS['y'], label='acceleration [m/s²]')
    motion.set_ylabel('vehicle')
    pitch.plot(time, np.degrees(history['theta_s']), color=COLOURS['x'], label='liquid cargo')
    pitch.plot(
        solid.time, np.degrees(solid.q[:, 4]), '--', color=COLOURS['y'], label='solid cargo'
    )
    pitch.set_ylabel('semitrailer pitch,\nnose down [deg]')
    force.plot(time, history['fx'] / 1e3, color=COLOURS['x'], label='two nodes over DDS')
    force.plot(truth.time, truth.slosh[:, 0] / 1e3, ':', color='k', label='one process, exact')
    force.set_ylabel('sloshing force,\nforward [kN]')
    moment.plot(time, history['my'] / 1e3, color=COLOURS['x'], label='two nodes over DDS')
    moment.plot(truth.time, truth.slosh[:, 4] / 1e3, ':', color='k', label='one process, exact')
    moment.set_ylabel('sloshing moment about\nthe surface centre [kN m]')
    _waves(wave, recording)
    for k, (style, colour) in enumerate(
        zip(('-', '--', '-.', ':'), COLOURS.values(), strict=False)
    ):
        load = history[f'fz_{k + 1}l'] + history[f'fz_{k + 1}r']
        axles.plot(time, load / 1e3, style, color=colour, label=f'axle {k + 1}')
    axles.axhline(0.0, color='k', linewidth=0.8)
    axles.set_ylabel('axle load [kN]\n(negative: would lift off)')
    axles.set_xlabel('time [s]')
    for axis in axes:
        mark_contacts(axis, truth.contacts, float(time[-1]))
        axis.grid(alpha=0.3)
        axis.margins(x=0)
        _legend(axis)
    figure.suptitle(
        'Half-full tractor-semitrailer brakes from 10 m/s over a 0.2 m bump '
        '(grey: an axle is on the bump)'
    )
    _save(figure, path)


def plot_histories(histories: Mapping[str, History], name: str, path: Path) -> None:
    """
    Draw a simulated drive, and its variants over it, over a shared time axis.

    Quantities that stay zero in all of them are left out. Wheel loads, bump and linear theory are
    shown for the first.

    Parameters
    ----------
    histories : mapping of str to History
        The drive with one or more cargoes, by name.
    name : str
        Of the scenario.
    path : Path
        PNG, SVG or PDF file.
    """
    first = next(iter(histories.values()))
    time, stop = first.time, float(first.time[-1])
    curves: tuple[tuple[str, Callable[[History], NDArray[np.float64]]], ...] = (
        ('lateral acceleration\n[m/s²]', lambda h: h.acceleration[:, 1]),
        ('semitrailer pitch,\nnose down [deg]', lambda h: np.degrees(h.q[:, 4])),
        ('semitrailer roll,\nleft side up [deg]', lambda h: np.degrees(h.q[:, 5])),
        ('load transfer ratio\nof the vehicle [-]', lambda h: h.transfer.vehicle),
        ('sloshing force,\nforward [kN]', lambda h: h.slosh[:, 0] / 1e3),
        ('sloshing force,\nto the left [kN]', lambda h: h.slosh[:, 1] / 1e3),
        ('sloshing moment,\nroll [kN m]', lambda h: h.slosh[:, 3] / 1e3),
        ('sloshing moment,\npitch [kN m]', lambda h: h.slosh[:, 4] / 1e3),
        ('wave height\n[m]', lambda h: h.elevation_max),
    )
    shown = [
        (label, value) for label, value in curves
        if max(np.abs(value(h)).max() for h in histories.values()) > _VISIBLE
    ]  # fmt: skip
    count = len(shown) + 2
    figure = Figure(figsize=(11, 1.9 * count + 1.2), layout='constrained')
    axes = figure.subplots(count, 1, sharex=True, height_ratios=[0.8, *[1.0] * len(shown), 1.3])
    motion, loads = axes[0], axes[-1]
    motion.plot(time, first.speed, color='k', label='speed [m/s]')
    motion.plot(
        time, first.acceleration[:, 0], '--', color=COLOURS['y'], label='acceleration [m/s²]'
    )
    motion.set_ylabel('forward')
    for axis, (label, value) in zip(axes[1:], shown, strict=False):
        for (cargo, history), key in zip(histories.items(), STYLES, strict=False):
            axis.plot(history.time, value(history), STYLES[key], color=COLOURS[key], label=cargo)
        axis.set_ylabel(label)
        if label.startswith('wave'):
            _shade(axis, time, ~first.valid)
            axis.set_ylim(bottom=0.0)
    wheels = first.wheel_loads / 1e3
    even = np.abs(np.diff(wheels, axis=2)).max() < _VISIBLE
    for k, colour in enumerate(list(COLOURS.values())[:4]):
        for side, style, word in ((0, '-', 'left'), (1, ':', 'right')):
            if even and side:
                continue
            loads.plot(
                time, wheels[:, k, side], style, color=colour,
                label=f'axle {k + 1} ' + ('each side' if even else word),
            )  # fmt: skip
    loads.axhline(0.0, color='k', linewidth=0.8)
    loads.set_ylabel('wheel load [kN]\n(negative: would lift off)')
    loads.set_xlabel('time [s]')
    for axis in axes:
        mark_contacts(axis, first.contacts, stop)
        axis.grid(alpha=0.3)
        axis.margins(x=0)
        _legend(axis)
    for contact in first.contacts:
        if contact.entry < stop:
            motion.text(
                contact.entry, 1.02, str(contact.axle), fontsize=8, ha='center',
                transform=motion.get_xaxis_transform(),
            )  # fmt: skip
    grey = '; grey: the numbered axle is on the bump' if first.contacts else ''
    figure.suptitle(f'{name}: {" | ".join(histories)}{grey}')
    _save(figure, path)


def plot_rollover(studies: Sequence[RolloverStudy], path: Path) -> None:
    """
    Draw what an IMU and the sloshing wrench tell of rolling over, against the simulated truth.

    Parameters
    ----------
    studies : sequence of RolloverStudy
        A column each.
    path : Path
        PNG, SVG or PDF file.
    """
    figure = Figure(figsize=(5.2 * len(studies) + 2.2, 8.5), layout='constrained')
    axes = figure.subplots(
        3, len(studies), sharex='col', sharey='row', squeeze=False, height_ratios=[0.7, 1.3, 1]
    )
    for (turning, transfer, margin), study in zip(axes.T, studies, strict=True):
        truth, time = study.truth, study.truth.time
        turning.plot(
            time, truth.acceleration[:, 1] / GRAVITY, color=COLOURS['k'], label='simulated truck'
        )
        turning.set_title(study.name)
        for axis, exact, figure_of in (
            (transfer, truth.transfer.vehicle, 'load_transfer_ratio'),
            (margin, study.true_margin, 'margin'),
        ):
            axis.plot(time, exact, color=COLOURS['k'], linewidth=2.5, alpha=0.35, label='truth')
            for judged, colour, style, label in (
                (study.liquid, 'x', '-', 'IMU and ~/wrench'),
                (study.solid, 'y', '--', 'IMU, as if solid'),
            ):
                axis.plot(
                    time, getattr(judged, figure_of), style, color=COLOURS[colour], label=label
                )
        transfer.plot(
            time, study.liquid.settled, ':', color=COLOURS['mark'], label='IMU: once settled'
        )
        transfer.axhline(0.0, color='k', linewidth=0.8)
        margin.set_xlabel('time [s]')
    for axis, label in zip(
        axes[:, 0],
        ('lateral acceleration\n[g]', 'load transfer ratio [-]\n1: left side lifts off',
         'rollover margin,\nlateral [g]'),
        strict=True,
    ):  # fmt: skip
        axis.set_ylabel(label)
    for axis in axes.flat:
        axis.grid(alpha=0.3)
        axis.margins(x=0)
    for axis in axes[:, -1]:
        _legend(axis)
    figure.suptitle('Half-full tanker: rollover figures from its IMU alone')
    _save(figure, path)


def mark_contacts(axis: Axes, contacts: Sequence[Contact], stop: float) -> None:
    """
    Shade the times at which axles are on the bump, as far as they are shown.

    Parameters
    ----------
    axis : Axes
        With time along x [s].
    contacts : sequence of Contact
        The times.
    stop : float
        End of the time axis [s].
    """
    for contact in contacts:
        if contact.entry < stop:
            axis.axvspan(
                contact.entry, min(contact.exit, stop), color='0.5', alpha=0.15, linewidth=0.0
            )
            axis.axvline(contact.entry, color='0.5', linewidth=0.6)


def _shade(axis: Axes, time: NDArray[np.float64], beyond: NDArray[np.bool_]) -> None:
    """Shade the times beyond linear theory."""
    axis.fill_between(
        time, 0.0, 1.0, where=beyond.tolist(), step='mid', linewidth=0.0,
        color=COLOURS['mark'], alpha=0.3, label='beyond linear theory',
        transform=axis.get_xaxis_transform(),
    )  # fmt: skip


def _waves(axis: Axes, recording: Recording) -> None:
    """Draw wave height, shaded where it is too high for linear theory."""
    axis.plot(
        recording.time, recording.elevation_max, color=COLOURS['x'], label='largest in the tank'
    )
    _shade(axis, recording.time, ~recording.valid)
    axis.set_ylabel('wave height [m]')
    axis.set_ylim(bottom=0.0)
    _legend(axis)


def _rollover(axis: Axes, time: NDArray[np.float64], rollover: Rollover) -> None:
    axis.plot(
        time, rollover.load_transfer_ratio, color=COLOURS['x'], label='load transfer ratio [-]'
    )
    axis.plot(time, rollover.margin, '--', color=COLOURS['y'], label='rollover margin [g]')
    axis.axhline(0.0, color='k', linewidth=0.8)
    axis.set_ylabel('rollover')
    _legend(axis)


def _lines(
    axis: Axes,
    time: NDArray[np.float64],
    values: NDArray[np.float64],
    label: str,
    thin: bool = False,
) -> None:
    for column, name in zip(values.T, 'xyz', strict=False):
        axis.plot(
            time, column, STYLES[name], color=COLOURS[name], label=name,
            linewidth=0.6 if thin else 1.2,
        )  # fmt: skip
    axis.set_ylabel(label.replace(' [', '\n['))
    _legend(axis)


def _legend(axis: Axes) -> None:
    axis.legend(loc='upper left', bbox_to_anchor=(1.005, 1.0), frameon=False)


def _save(figure: Figure, path: Path) -> None:
    try:
        figure.savefig(path, dpi=130)
    except (OSError, ValueError) as error:
        raise InputError(f'{path}: the picture cannot be written: {error}') from error
