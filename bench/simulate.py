"""What solving each scenario of the library costs, as one system in one process."""

from __future__ import annotations

import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

from slosh_ros.engine import SloshConfig
from slosh_ros.study.tanks import liquids_of
from slosh_ros.vehicle.scenario import Scenario

LIBRARY = Path(__file__).resolve().parents[1] / 'config' / 'scenarios'
REPEATS = 3


def main() -> dict[str, dict[str, float]]:
    """Print and return the best of some runs of every scenario [s]."""
    rows = {}
    table = Table('scenario', 'simulated [s]', 'modes', 'tank [s]', 'solution [s]')
    for file in sorted(LIBRARY.glob('*.yaml')):
        scenario = Scenario.from_file(file)
        tank_time, solve_time = [], []
        for _ in range(REPEATS):
            began = time.perf_counter()
            tanks = [] if scenario.table_4 else liquids_of(SloshConfig.from_file(file))
            solved = time.perf_counter()
            history = scenario.simulate(tanks)
            solve_time.append(time.perf_counter() - solved)
            tank_time.append(solved - began)
        table.add_row(
            file.stem, f'{history.time[-1]:.0f}', f'{len(history.names)}',
            f'{min(tank_time):.3f}', f'{min(solve_time):.3f}',
        )  # fmt: skip
        rows[file.stem] = {
            'simulated_s': float(history.time[-1]),
            'tank_s': min(tank_time),
            'solution_s': min(solve_time),
        }
    Console(width=100).print(table)
    return rows


if __name__ == '__main__':
    main()
