"""What a sample costs in the engine, against the number of modes and of tanks."""

from __future__ import annotations

import math
import time

from rich.console import Console
from rich.table import Table

from slosh_ros.engine import MotionSample, SloshConfig, SloshEngine

MODES = (1, 2, 4, 8, 16, 32, 64, 128)
TANKS = (1, 2, 4, 8, 16)
MODES_A_TANK = 8
SAMPLES, REPEATS = 500, 20
STEP = 10_000_000  # [ns]


def engine_of(tanks: int, modes: int) -> SloshEngine:
    """Compartments of a road tanker in a row."""
    names = [f'tank_{k}' for k in range(tanks)]
    given: dict[str, object] = {'tanks': names}
    for k, name in enumerate(names):
        given |= {
            f'{name}.shape': 'rectangular', f'{name}.length': 2.0, f'{name}.width': 1.8,
            f'{name}.height': 1.6, f'{name}.fill_ratio': 0.5, f'{name}.modes': modes,
            f'{name}.damping_ratio': 0.01, f'{name}.xyz': [2.1 * k, 0.0, 1.5],
        }  # fmt: skip
    return SloshEngine(SloshConfig.from_parameters(given))


def drive(samples: int) -> list[MotionSample]:
    """Gentle braking and steering, at even intervals."""
    return [
        MotionSample.from_imu(
            1_000_000_000 + k * STEP,
            [0.3 * math.sin(0.003 * k), 0.2 * math.sin(0.001 * k), 9.81],
            [0.0, 0.0, 0.02 * math.sin(0.001 * k)],
        )
        for k in range(samples)
    ]


def cost_of(engine: SloshEngine, samples: list[MotionSample], repeats: int) -> float:
    """Time of a sample, wrenches included, at its best [us]."""
    best = math.inf
    for _ in range(repeats):
        engine.reset()
        began = time.process_time()
        for sample in samples:
            _, loads = engine.feed(sample)
            assert loads is not None
            _ = loads.wrench, loads.total  # what is not asked for may not be computed
        best = min(best, time.process_time() - began)
    return 1e6 * best / len(samples)


def main(samples: int = SAMPLES, repeats: int = REPEATS) -> dict[str, object]:
    """Measure, print a table and return the numbers."""
    motion = drive(samples)
    by_modes = {modes: cost_of(engine_of(1, modes), motion, repeats) for modes in MODES}
    by_tanks = {tanks: cost_of(engine_of(tanks, MODES_A_TANK), motion, repeats) for tanks in TANKS}
    table = Table('tanks', 'modes of each', 'a sample [us]')
    for modes, cost in by_modes.items():
        table.add_row('1', f'{modes}', f'{cost:.1f}')
    for tanks, cost in by_tanks.items():
        table.add_row(f'{tanks}', f'{MODES_A_TANK}', f'{cost:.1f}')
    Console(width=100).print(table)
    return {'modes_us': by_modes, 'tanks_us': by_tanks}


if __name__ == '__main__':
    main()
