"""Pictures of modes and of replayed drives. matplotlib is imported with this module only."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl

mpl.use('Agg')  # files only; works without a display

import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.axes import Axes  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402

from slosh_ros.bag import Recording  # noqa: E402
from slosh_ros.errors import InputError  # noqa: E402
from slosh_ros.hydro import ModalCoefficients  # noqa: E402

# Okabe & Ito: told apart by colour-blind eyes; line styles tell them apart in grey
COLOURS = {'x': '#0072B2', 'y': '#D55E00', 'z': '#009E73', 'wave': '#0072B2', 'mark': '#CC79A7'}
STYLES = {'x': '-', 'y': '--', 'z': ':'}
_COLUMNS = 4


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
    """
    c = coefficients
    count = len(c.names)
    columns = min(count, _COLUMNS)
    rows = -(-count // columns)
    figure, axes = plt.subplots(
        rows, columns, figsize=(3.4 * columns, 2.3 * rows + 0.9), squeeze=False,
        sharex=True, sharey=True, layout='constrained',
    )  # fmt: skip
    x, y = c.surface_points.T
    for j, axis in enumerate(axes.flat):
        if j >= count:
            axis.set_visible(False)
            continue
        drawn = axis.tricontourf(
            x, y, c.surface_shapes[:, j], levels=np.linspace(-1, 1, 21), cmap='RdBu_r'
        )
        axis.tricontour(x, y, c.surface_shapes[:, j], levels=[0.0], colors='k', linewidths=0.8)
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
    figure, axes = plt.subplots(
        5, 1, figsize=(11, 12), sharex=True, layout='constrained',
        height_ratios=[1.1, 0.8, 1, 1.2, 1.2],
    )  # fmt: skip
    motion, turning, wave, force, moment = axes
    if recording.source == 'imu':
        specific = recording.force
        _lines(motion, time, specific[:, :2], 'measured specific force [m/s²]', thin=True)
    else:
        _lines(motion, time, recording.velocity[:, :2], 'velocity [m/s]')
    _lines(turning, time, recording.rate, 'angular rate [rad/s]', thin=True)
    wave.plot(time, recording.elevation_max, color=COLOURS['wave'], linewidth=1.2)
    wave.fill_between(
        time, 0.0, recording.elevation_max, where=(~recording.valid).tolist(), step='mid',
        color=COLOURS['mark'], alpha=0.4, label='beyond linear theory',
    )  # fmt: skip
    wave.set_ylabel('largest wave\nheight [m]')
    wave.set_ylim(bottom=0.0)
    if not recording.valid.all():
        _legend(wave)
    _lines(force, time, recording.wrench[:, :2] / 1e3, 'sloshing force [kN]')
    _lines(moment, time, recording.wrench[:, 3:] / 1e3, 'sloshing moment [kN m]')
    moment.set_xlabel('time since the first sample [s]')
    for axis in axes:
        axis.grid(alpha=0.3)
        axis.margins(x=0)
    figure.suptitle(f'{title}   (loads on the tank, in {recording.frame})')
    _save(figure, path)


def _lines(axis: Axes, time: np.ndarray, values: np.ndarray, label: str, thin: bool = False) -> None:
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
    finally:
        plt.close(figure)
