"""
What the coefficients of a tank cost, by route: time for one fill and how well it is converged.

A new route is one row of CASES. A second table shows how the route of any surface grows with the
size of its problem, beside the section route for the same pipe.
"""

from __future__ import annotations

import os
import tempfile
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
from slosh_ros.hydro.section_mesh import DEFAULT, Resolution
from slosh_ros.hydro.section_triangles import TriangleResolution
from slosh_ros.hydro.table_cache import known_table
from slosh_ros.hydro.volume import VolumeResolution, volume_coefficients
from slosh_ros.tank import (
    Capsule,
    LiquidAtRest,
    UniformTank,
    cylinder_x,
    ellipse_x,
    rounded_rectangle_x,
    section_x,
)
from slosh_ros.tank.surface import LiquidSurface

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


class _Pipe(NamedTuple):
    """A pipe with flat ends, as a surface of triangles: the route of any surface against it."""

    tank: UniformTank

    @property
    def height(self) -> float:
        return self.tank.height

    def filled(self, depth: float) -> LiquidAtRest:
        return self.tank.filled(depth)

    def liquid_surface(self, depth: float, size: float) -> LiquidSurface:
        radius, half = self.tank.height / 2.0, self.tank.length / 2.0
        reach = np.arccos(1.0 - depth / radius)
        angle = np.linspace(-reach, reach, 2 * int(np.ceil(reach * radius / size)) + 1)
        y, z = radius * np.sin(angle), radius * (1.0 - np.cos(angle)) - depth
        z[[0, -1]] = 0.0
        x = np.linspace(half, -half, int(np.ceil(2.0 * half / size)) + 1)
        net = np.stack(np.broadcast_arrays(x[:, None], y, z), axis=-1)
        ends = [self._fan(net[0]), self._fan(net[-1])[:, ::-1]]
        return LiquidSurface(
            np.concatenate([self._halves(net), *ends]), self._halves(net[:, [-1, 0]])
        )

    @staticmethod
    def _halves(net: np.ndarray) -> np.ndarray:
        a, b, c, d = net[:-1, :-1], net[1:, :-1], net[1:, 1:], net[:-1, 1:]
        return np.concatenate(
            [np.stack(t, axis=-2).reshape(-1, 3, 3) for t in ((a, b, c), (a, c, d))]
        )

    @staticmethod
    def _fan(outline: np.ndarray) -> np.ndarray:
        middle = np.broadcast_to(outline.mean(axis=0), outline.shape)
        return np.stack([middle, outline, np.roll(outline, -1, axis=0)], axis=1)


def _volume(name: str, tank: _Pipe | Capsule, resolution: VolumeResolution) -> Case:
    fine = VolumeResolution(resolution.cells * 1.3, triangles=4 * resolution.triangles)

    def solve(fill: float, chosen: VolumeResolution = resolution) -> ModalCoefficients:
        whole = tank.tank if isinstance(tank, _Pipe) else tank
        return volume_coefficients(tank, whole.depth(fill), DENSITY, MODES, chosen)

    return Case(name, solve, lambda fill: solve(fill, fine))


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
    _volume('any surface: heads', cylinder_x(1.1, 6.0, 0.5), VolumeResolution()),
)
PIPE = cylinder_x(1.1, 6.0)
SIZES = (1000, 4000, 16000, 64000)  # triangles
SECTIONS = (
    Resolution(4, 4, 5),
    Resolution(5, 4, 6),
    Resolution(6, 4, 6),
    Resolution(8, 5, 8),
    DEFAULT,
)


def _timed(solve: Callable[[float], ModalCoefficients], fill: float) -> float:
    began = time.perf_counter()
    solve(fill)
    return time.perf_counter() - began


def growth(console: Console) -> list[dict[str, object]]:
    """
    Print and return time and error of any surface by its size, against the section route.

    The section route is given the coarsest functions that are as accurate as the surface was.
    """
    depth, pipe = PIPE.depth(0.5), _Pipe(PIPE)
    exact = section_coefficients(PIPE, depth, DENSITY, MODES, FINE_SPLINES)
    table = Table(
        'pipe, half full', 'size', 'first [s]', 'best [s]', 'error in omega', 'estimated'
    )
    rows: list[dict[str, object]] = []

    def row(
        name: str, size: int | str, solve: Callable[[], ModalCoefficients]
    ) -> tuple[float, float]:
        first, *others = (_timed(lambda _: solve(), 0.5) for _ in range(1 + REPEATS))
        best, found = min(others), solve()
        error = float(np.abs(found.omega / exact.omega - 1.0).max())
        estimate = '' if found.error is None else f'{found.error:.0e}'
        table.add_row(name, f'{size}', f'{first:.3f}', f'{best:.4f}', f'{error:.0e}', estimate)
        rows.append({
            'case': f'growth: {name}', 'size': size, 'modes': MODES, 'first_s': first,
            'best_s': best, 'omega_error': error, 'estimated_error': found.error,
        })  # fmt: skip
        return best, error

    surfaces = {
        size: row(
            'any surface, triangles', size,
            lambda size=size: volume_coefficients(
                pipe, depth, DENSITY, MODES, VolumeResolution(triangles=size)
            ),
        )
        for size in SIZES
    }  # fmt: skip
    sections = [
        row(
            'section, spans x degrees', f'{r.spans} x {r.degree} x {r.fan_degree}',
            lambda r=r: section_coefficients(PIPE, depth, DENSITY, MODES, r),
        )
        for r in SECTIONS
    ]  # fmt: skip
    console.print(table)
    times = [best for best, _ in surfaces.values()]
    exponent = float(np.polyfit(np.log(SIZES), np.log(times), 1)[0])
    console.print(f'the time of any surface grows with its triangles to the power {exponent:.2f}')
    rows.append({'case': 'growth: exponent over triangles', 'exponent': exponent})
    for size, (best, error) in surfaces.items():
        equal = min(time for time, other in sections if other <= error)
        console.print(
            f'{size} triangles, error {error:.0e}: {best / equal:.0f} times the time of the '
            'section route of no greater error'
        )
        rows.append({'case': 'growth: over section', 'size': size, 'ratio': best / equal})
    return rows


def cached(console: Console) -> list[dict[str, object]]:
    """Print and return what a fill costs by a table: to build it, to read it, to ask it."""
    names = section_coefficients(PIPE, PIPE.depth(0.5), DENSITY, MODES).names
    table = Table('pipe, 12 modes at any fill', 'time [s]')
    with tempfile.TemporaryDirectory() as folder:
        os.environ['XDG_CACHE_HOME'] = folder
        build = _timed(lambda _: known_table(PIPE, names), 0.5)
        read = min(_timed(lambda _: known_table(PIPE, names), 0.5) for _ in range(REPEATS))
        found = known_table(PIPE, names)
    ask = min(_timed(lambda fill: found.at(fill, DENSITY), fill) for fill in 10 * FILLS)
    what = f'table of {found.solutions} solutions, error {found.error:.0e}'
    for way, cost in ((f'build the {what}', build), ('from disk', read), ('one fill', ask)):
        table.add_row(way, f'{cost:.4f}')
    console.print(table)
    return [{
        'case': 'fill table', 'modes': MODES, 'solutions': found.solutions, 'error': found.error,
        'build_s': build, 'disk_s': read, 'ask_s': ask,
    }]  # fmt: skip


def main() -> list[dict[str, object]]:
    """Print and return first (cold) and best times of every case, and its error in omega."""
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
    console = Console(width=100)
    console.print(table)
    return rows + cached(console) + growth(console)


if __name__ == '__main__':
    main()
