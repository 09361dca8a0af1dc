"""
Pictures of the manual that come from the package itself, into docs/images.

Run `.venv/bin/python docs/figures.py` when what they show has changed.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle, Polygon, Rectangle

from slosh_ros.engine import SloshConfig
from slosh_ros.hydro import coefficients_of
from slosh_ros.study.paper.draw import Curve, Panel, picture
from slosh_ros.study.paper.measured import cylinder
from slosh_ros.study.paper.pitching import akyildiz
from slosh_ros.study.paper.trust import expectations
from slosh_ros.study.plots import plot_modes
from slosh_ros.tank import cylinder_x

HERE = Path(__file__).resolve().parent
IMAGES = HERE / 'images'
RADIUS, LENGTH, DEPTH = 1.125, 7.0, 0.75  # of the tank in the sketch; its axis is z = 0
BASE = (-0.6, -1.9)  # base_link, x and z
LIQUID, STEEL, FRAME = '#9ecae1', '0.35', 'black'


def frames() -> None:
    """Sketch frames and positive rotations, from the left and from behind."""
    figure = Figure(figsize=(8.0, 7.2), layout='constrained')
    side, rear = figure.subplots(2, 1, height_ratios=(1.0, 1.25))
    surface = DEPTH - RADIUS
    half = LENGTH / 2.0
    side.add_patch(Rectangle((-half, -RADIUS), LENGTH, DEPTH, color=LIQUID))
    side.add_patch(Rectangle((-half, -RADIUS), LENGTH, 2 * RADIUS, fill=False, ec=STEEL, lw=2))
    for x in (-3.05, -2.1):
        side.add_patch(Circle((x, -2.15), 0.45, fill=False, ec=STEEL, lw=2))
    side.add_patch(Rectangle((-half, -1.55), LENGTH, 0.25, color=STEEL))
    _axes(side, BASE, 'base_link', 'x', 'z')
    _axes(side, (0.0, 0.0), 'tank_link', 'x', 'z')
    _axes(side, (2.0, surface), 'O', 'x', 'z', short=True)
    side.plot([-half, half], [surface, surface], color='#0072B2', ls='--', lw=1.2)
    side.annotate('mean free surface', (-3.4, surface + 0.06), fontsize=9, color='#0072B2')
    side.plot(1.5, -1.42, marker='s', color='#D55E00', ms=9, zorder=4)
    side.annotate('IMU: imu.xyz from base_link', (1.75, -1.5), fontsize=9, color='#D55E00',
                  va='top', xytext=(1.75, -1.75))  # fmt: skip
    side.annotate('', (1.5, -1.42), BASE, arrowprops={'arrowstyle': '->', 'color': '#D55E00'})
    _turn(side, (0.0, 0.0), 'pitch > 0: nose down', clockwise=True)
    side.annotate('forward', (half + 1.3, 0.0), xytext=(half + 0.2, 0.0), fontsize=9,
                  va='center', arrowprops={'arrowstyle': '->'})  # fmt: skip
    side.set_title('from the right (O lies under tank_link; drawn aside)', fontsize=10)
    side.set_xlim(-half - 0.3, half + 1.8)

    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    low = np.linspace(-np.pi - np.arcsin(surface / RADIUS), np.arcsin(surface / RADIUS), 100)
    rear.add_patch(Polygon(RADIUS * np.c_[np.cos(low), np.sin(low)], color=LIQUID))
    rear.plot(RADIUS * np.cos(angle), RADIUS * np.sin(angle), color=STEEL, lw=2)
    width = np.sqrt(RADIUS**2 - surface**2)
    rear.plot([-width, width], [surface, surface], color='#0072B2', ls='--', lw=1.2)
    rear.add_patch(Rectangle((-1.0, -1.55), 2.0, 0.25, color=STEEL))
    for y in (-1.55, 1.25):
        rear.add_patch(Rectangle((y, -2.6), 0.3, 0.9, fill=False, ec=STEEL, lw=2))
    _axes(rear, (0.0, 0.0), 'tank_link', 'y', 'z', left=True)
    _axes(rear, (0.0, BASE[1]), 'base_link', 'y', 'z', left=True)
    rear.plot(0.0, surface, 'ko', ms=6, zorder=5)
    rear.annotate('O', (0.1, surface - 0.07), fontsize=9, weight='bold', va='top')
    _turn(rear, (0.0, 0.0), 'roll > 0: left side up', clockwise=True)
    rear.set_title('from behind: left is left', fontsize=10)
    rear.set_xlim(-3.2, 3.2)
    for axis in (side, rear):
        axis.set_aspect('equal')
        axis.set_ylim(-2.75, 1.75)
        axis.axis('off')
    figure.savefig(IMAGES / 'frames.png', dpi=120)


def _axes(axis: Axes, at: tuple[float, float], name: str, across: str, up: str,
          *, left: bool = False, short: bool = False) -> None:  # fmt: skip
    size = 0.45 if short else 0.8
    for dx, dz, label in ((-size if left else size, 0.0, across), (0.0, size, up)):
        axis.annotate('', (at[0] + dx, at[1] + dz), at, zorder=5,
                      arrowprops={'arrowstyle': '-|>', 'color': FRAME, 'lw': 1.4,
                                  'shrinkA': 0, 'shrinkB': 0})  # fmt: skip
        axis.annotate(label, (at[0] + 1.16 * dx, at[1] + 1.16 * dz), fontsize=9, ha='center',
                      va='center')  # fmt: skip
    axis.annotate(name, (at[0] + (0.1 if left else -0.1), at[1] - 0.07), fontsize=9,
                  weight='bold', ha='left' if left else 'right', va='top')  # fmt: skip


def _turn(axis: Axes, at: tuple[float, float], name: str, *, clockwise: bool) -> None:
    size = 1.36 * RADIUS
    axis.add_patch(Arc(at, 2 * size, 2 * size, theta1=35.0, theta2=75.0, lw=1.4))
    end = np.radians(35.0 if clockwise else 75.0)
    tip = np.array(at) + size * np.array([np.cos(end), np.sin(end)])
    along = np.array([np.sin(end), -np.cos(end)]) * (1.0 if clockwise else -1.0)
    axis.annotate('', tip + 0.08 * along, tip - 0.04 * along,
                  arrowprops={'arrowstyle': '-|>', 'lw': 1.4, 'color': 'black'})  # fmt: skip
    axis.annotate(name, (at[0] + 0.85 * size, at[1] + 0.82 * size), fontsize=9)


def modes() -> None:
    """Draw the first modes of the half-full tanker."""
    config = SloshConfig.from_file(HERE.parent / 'config' / 'half_full_tanker.yaml')
    tank = config.tanks[0]
    plot_modes('half-full tanker', tank.coefficients(), IMAGES / 'mode_shapes.png')


def fill() -> None:
    """Draw what sloshes over the fill of the tanker: periods, and shares of the liquid's mass."""
    tank = cylinder_x(radius=1.125, length=14.0)
    ratios = np.linspace(0.05, 0.95, 37)
    found = [coefficients_of(tank, tank.depth(ratio), 1000.0, 24) for ratio in ratios]
    panels = []
    for name, row in (
        ('natural period [s]', lambda c, j, k: 2.0 * np.pi / c.omega[j]),
        ('sloshing mass of the mode [t]', lambda c, j, k: c.coupling[j, k] ** 2 / c.mu[j] / 1e3),
    ):
        curves = []
        for mode, k, told in (('x1', 0, 'fore and aft, x1'), ('y1', 1, 'sideways, y1')):
            values = [row(c, c.names.index(mode), k) for c in found]
            curves.append(Curve(told, ratios, values))
        panels.append(Panel(name, curves))
    figure = picture('Horizontal cylinder, R = 1.125 m, L = 14 m, water', 'fill ratio [-]', panels)
    figure.savefig(IMAGES / 'fill.png', dpi=120)


def paper() -> None:
    """Draw what `slosh paper` does: limits of linear theory, braking and pressure against data."""
    for name, find in (
        ('validity', expectations), ('paper_braking', cylinder), ('paper_pressure', akyildiz),
    ):  # fmt: skip
        (drawing,) = find().drawings
        drawing.figure.savefig(IMAGES / f'{name}.png', dpi=120)


if __name__ == '__main__':
    frames()
    modes()
    fill()
    paper()
