"""One look for all figures of the report."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

# Okabe & Ito's colours by rising brightness, so that grey prints tell them apart as well; each
# goes with a line style of its own
_STYLES: tuple[dict[str, Any], ...] = (
    {'color': 'black', 'linestyle': '-', 'linewidth': 1.8},
    {'color': '#0072B2', 'linestyle': '--', 'linewidth': 1.5},
    {'color': '#D55E00', 'linestyle': '-.', 'linewidth': 1.5},
    {'color': '#009E73', 'linestyle': ':', 'linewidth': 2.0},
    {'color': '#E69F00', 'linestyle': (0, (6, 1, 1, 1, 1, 1)), 'linewidth': 1.5},
    {'color': '#56B4E9', 'linestyle': (0, (8, 3)), 'linewidth': 1.2},
)
_POINTS: dict[str, Any] = {
    'zorder': 3,
    'color': '#F0A0D0', 'marker': 'o', 'markersize': 4.5, 'linestyle': 'none',
    'markeredgecolor': 'black', 'markeredgewidth': 0.6,
}  # fmt: skip
_WIDTH, _HEIGHT = 6.4, 2.3  # inches of a panel; legible on a phone
_CLOSE = 0.03  # of the axis: marks nearer than that are named on either side


@dataclass(frozen=True, eq=False)
class Curve:
    """
    A line of a panel, or points.

    Attributes
    ----------
    name : str
        For the legend.
    x, y : array_like, shape (n,)
        What to draw.
    points : bool
        Measured or computed points instead of a line.
    """

    name: str
    x: ArrayLike
    y: ArrayLike
    points: bool = False


@dataclass(frozen=True, eq=False)
class Panel:
    """
    One pair of axes.

    Attributes
    ----------
    ylabel : str
        With its unit.
    curves : sequence of Curve
        What is drawn.
    ylim : tuple of float, optional
        Range, where a pole would leave nothing to see of the rest.
    marks : mapping
        Vertical lines by name: where on the x axis.
    log : bool
        Logarithmic y axis.
    """

    ylabel: str
    curves: Sequence[Curve]
    ylim: tuple[float, float] | None = None
    marks: Mapping[str, float] | None = None
    log: bool = False


def picture(title: str, xlabel: str, panels: Sequence[Panel], share_x: bool = True) -> Figure:
    """Draw panels above each other; legends stand above the axes, outside the data."""
    figure = Figure(figsize=(_WIDTH, 0.5 + (_HEIGHT + 0.35) * len(panels)), layout='constrained')
    axes = figure.subplots(len(panels), 1, sharex=share_x, squeeze=False)[:, 0]
    for axis, panel in zip(axes, panels, strict=True):
        _fill(axis, panel)
    axes[-1].set_xlabel(xlabel)
    figure.suptitle(title, fontsize=11)
    return figure


def _fill(axis: Axes, panel: Panel) -> None:
    lines = iter(_STYLES)
    for curve in panel.curves:
        style = _POINTS if curve.points else next(lines)
        axis.plot(curve.x, curve.y, label=curve.name, **style)
    axis.set_ylabel(panel.ylabel)
    if panel.ylim is not None:
        axis.set_ylim(*panel.ylim)
    if panel.log:
        axis.set_yscale('log')
    axis.grid(alpha=0.3, which='both' if panel.log else 'major')
    axis.margins(x=0)
    axis.legend(
        ncols=2 if len(panel.curves) == 4 else 3,
        loc='lower left', bbox_to_anchor=(0.0, 1.0), frameon=False, fontsize=9,
        borderaxespad=0.2, handlelength=2.8, columnspacing=1.2,
    )  # fmt: skip
    _mark(axis, sorted((panel.marks or {}).items(), key=lambda mark: mark[1]))


def _mark(axis: Axes, marks: Sequence[tuple[str, float]]) -> None:
    """Draw vertical lines, named at the top."""
    low, high = axis.get_xlim()
    following = [place for _, place in marks[1:]]
    for (name, place), after in zip(marks, [*following, math.inf], strict=False):
        left = after - place < _CLOSE * (high - low)
        axis.axvline(place, color='0.55', linewidth=0.8, zorder=0)
        axis.annotate(
            name, (place, 1.0), xycoords=('data', 'axes fraction'), fontsize=8, color='0.35',
            xytext=(-2 if left else 2, -2), textcoords='offset points', va='top',
            ha='right' if left else 'left',
        )  # fmt: skip
