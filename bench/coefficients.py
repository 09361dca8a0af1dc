"""
What the coefficients of a tank cost, by route: time for one fill and how well it is converged.

A new route is one row of CASES.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from slosh_ros.engine import SloshConfig
from slosh_ros.hydro import ModalCoefficients
from slosh_ros.hydro.section import section_coefficients
from slosh_ros.hydro.section_mesh import Resolution
from slosh_ros.hydro.section_triangles import TriangleResolution
from slosh_ros.tank import UniformTank, cylinder_x, ellipse_x, rounded_rectangle_x, section_x

CONFIG = Path(__file__).resolve().parents[1] / 'config' / 'modified_oval.yaml'
MODES = 12
FILLS = (0.05, 0.5, 0.95)
REPEATS = 3
DENSITY = 1000.0

FINE_SPLINES, FINE_TRIANGLES = Resolution(36, 6, 18), TriangleResolution(11, 0.8, 1e-9)
SUMP = [-1.0, -0.5, 0.0, -0.5, 0.0, -1.3, 1.0, -1.3, 1.4, 1.0, -1.3, 1.0]


class Case(NamedTuple):
    """
    A route to the coefficients of a tank.

    Attributes
    ----------
    name : str
        Of route and shape.
    solve : callable
        Coefficients at a fill ratio.
    fine : callable
        The same on a finer mesh, to compare with.
    """

    name: str
    solve: Callable[[float], ModalCoefficients]
    fine: Callable[[float], ModalCoefficients]


def _section(
    name: str, tank: UniformTank, fine: Resolution | TriangleResolution, modes: int = MODES
) -> Case:
    def solve(
        fill: float, resolution: Resolution | TriangleResolution | None = None
    ) -> ModalCoefficients:
        return section_coefficients(tank, tank.depth(fill), DENSITY, modes, resolution)

    return Case(name, solve, lambda fill: solve(fill, fine))


def _circle_of(corners: int) -> UniformTank:
    angle = 2.0 * np.pi * (np.arange(corners) + 0.5) / corners
    points = 1.1 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return section_x(points.ravel().tolist(), 6.0)


OVAL = SloshConfig.from_file(CONFIG).tanks[0].tank
CASES = (
    _section('splines: circle', cylinder_x(1.1, 6.0), FINE_SPLINES),
    _section('splines: ellipse', ellipse_x(2.4, 1.7, 6.0), FINE_SPLINES),
    _section('splines: rounded', rounded_rectangle_x(2.4, 1.7, 0.5, 6.0), FINE_SPLINES),
    _section('triangles: oval, 36 corners', OVAL, FINE_TRIANGLES),
    _section('triangles: oval, 64 modes', OVAL, FINE_TRIANGLES, 64),
    _section('triangles: sump, not symmetric', section_x(SUMP, 6.0), FINE_TRIANGLES),
    _section('triangles: circle, 32 corners', _circle_of(32), FINE_TRIANGLES),
    _section('triangles: circle, 256 corners', _circle_of(256), FINE_TRIANGLES),
)


def _timed(solve: Callable[[float], ModalCoefficients], fill: float) -> float:
    began = time.perf_counter()
    solve(fill)
    return time.perf_counter() - began


def main() -> list[dict[str, object]]:
    """Print and return the first and best time of every case, and its largest error in omega."""
    rows: list[dict[str, object]] = []
    table = Table('route and tank', 'fill', 'modes', 'first [s]', 'best [s]', 'error in omega')
    for case in CASES:
        for fill in FILLS:
            first = _timed(case.solve, fill)
            best = min(_timed(case.solve, fill) for _ in range(REPEATS))
            found, fine = case.solve(fill), case.fine(fill)
            error = float(np.abs(found.omega / fine.omega - 1.0).max())
            table.add_row(
                case.name, f'{fill:.0%}', f'{len(found.names)}', f'{first:.3f}', f'{best:.3f}',
                f'{error:.0e}',
            )  # fmt: skip
            rows.append({
                'case': case.name, 'fill': fill, 'modes': len(found.names), 'first_s': first,
                'best_s': best, 'omega_error': error,
            })  # fmt: skip
    Console(width=100).print(table)
    return rows


if __name__ == '__main__':
    main()
