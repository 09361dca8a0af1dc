"""All benches in one run: tables for people, JSON for machines. It takes about ten minutes."""

from __future__ import annotations

import argparse
import json
import os
import platform
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import basilisk
import coefficients
import engine
import node_against_relay
import replay
import simulate

RESULTS = Path(__file__).resolve().parents[1] / 'build' / 'bench.json'
REPLAYED, REPLAYS = 100_000, 3  # samples, 17 minutes at 100 Hz, and how often


def machine() -> dict[str, object]:
    """Tell what the numbers were measured on."""
    try:
        lines = Path('/proc/cpuinfo').read_text(encoding='utf-8').splitlines()
        processor = next(line for line in lines if line.startswith('model name')).split(': ')[1]
    except (OSError, StopIteration):
        processor = platform.processor()
    packages = {}
    for name in ('numpy', 'ros-jazzy-rclpy', 'rosbags', 'bsk'):
        try:
            packages[name] = version(name)
        except PackageNotFoundError:
            packages[name] = 'absent'
    return {
        'processor': processor,
        'cores': os.cpu_count(),
        'system': platform.platform(),
        'python': platform.python_version(),
        'packages': packages,
        'load': os.getloadavg()[0],
    }


def replays() -> dict[str, float]:
    """Rates of `slosh replay` over reading the same bag, with a table."""
    result = replay.measure(REPLAYED, REPLAYS)
    for way in ('read', 'replay', 'replay_csv', 'replay_mcap'):
        rate = result.get(f'{way}_rate', 1.0)
        print(f'{way:12s} {result[f"{way}_us"]:8.1f} us a sample, rate {rate:.2f}')
    return result


BENCHES: dict[str, tuple[str, Callable[[], object]]] = {
    'node': ('slosh_node against a relay', node_against_relay.main),
    'replay': ('slosh replay against reading the bag', replays),
    'engine': ('the engine', engine.main),
    'basilisk': ('the engine against Basilisk', basilisk.main),
    'coefficients': ('coefficients of a tank', coefficients.main),
    'simulate': ('scenarios', simulate.main),
}


def main() -> None:
    """Run the benches that are asked for and write what they found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('benches', nargs='*', choices=[[], *BENCHES], help='all, if none is named')
    parser.add_argument('--json', type=Path, default=RESULTS, help='file for the numbers')
    given = parser.parse_args()
    results: dict[str, object] = {'machine': machine()}
    print(results['machine'])
    for name in given.benches or BENCHES:
        title, bench = BENCHES[name]
        print(f'\n{title}')
        results[name] = bench()
    given.json.parent.mkdir(parents=True, exist_ok=True)
    given.json.write_text(json.dumps(results, indent=2), encoding='utf-8')
    print(f'\nwritten to {given.json}')


if __name__ == '__main__':
    main()
