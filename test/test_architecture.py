"""The floors of the house: what knows ROS, what imports what, and what may speak."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import pytest

import slosh_ros

ROOT = Path(__file__).resolve().parent.parent

# The rooms from the ground up; one imports only from those on lower lines.
HOUSE = (
    ('constants', 'errors'),
    ('apart', 'parameters', 'tank'),
    ('hydro',),
    ('modal',),
    ('engine', 'vehicle'),
    ('monitor',),
    ('ros', 'bag'),
    ('study',),
    ('cli',),
)
FLOORS = {name: floor for floor, names in enumerate(HOUSE) for name in names}


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix('').parts
    return '.'.join(parts[:-1] if parts[-1] == '__init__' else parts)


def room(module: str) -> str | None:
    """Name the room of a module; None for the package itself, which holds only its version."""
    return module.split('.')[1] if '.' in module else None


MODULES = {module_name(path): path for path in sorted((ROOT / 'slosh_ros').rglob('*.py'))}
FURNISHED = {name: path for name, path in MODULES.items() if room(name)}


def imported(path: Path) -> Iterator[str]:
    """List what a file imports anywhere in it; `from a import b` gives a and a.b."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f'{path}:{node.lineno}: relative import'
            yield node.module
            yield from (f'{node.module}.{alias.name}' for alias in node.names)


@pytest.mark.parametrize('name', FURNISHED)
def test_imports_point_down(name: str) -> None:
    own = room(name)
    assert own in FLOORS, f'give {own} its place in HOUSE'
    neighbours = {
        room(other) for other in imported(FURNISHED[name]) if other.startswith('slosh_ros.')
    }
    upward = {
        other
        for other in neighbours & set(FLOORS)  # the rest are names in slosh_ros/__init__.py
        if other != own and FLOORS[other] >= FLOORS[own]
    }
    assert not upward, f'{name} imports from {sorted(upward)}, not below {own}'


def test_only_the_ros_shell_needs_ros() -> None:
    """Everything else imports on a machine where no ROS package can be imported."""
    script = """
import importlib, re, sys

class NoRos:
    def find_spec(self, name, path=None, target=None):
        if re.fullmatch(r'rclpy|rpyutils|launch(_ros)?|ament_.*|tf2_.*|.*_(msgs|interfaces|srvs)',
                        name.partition('.')[0]):
            raise ModuleNotFoundError(f'{name} is not here, as on a machine without ROS')

sys.meta_path.insert(0, NoRos())
for module in sys.argv[1:]:
    importlib.import_module(module)
"""
    without_ros = [name for name in MODULES if room(name) != 'ros']
    assert {room(name) for name in without_ros} >= set(FLOORS) - {'ros'}  # the walk saw the house
    done = subprocess.run(
        [sys.executable, '-c', script, *without_ros],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == ''


HEAVY = {'scipy.interpolate', 'scipy.optimize', 'matplotlib', 'trimesh', 'capytaine', 'xarray'}
SHELLS = {
    'slosh_ros.cli': HEAVY | {'scipy.linalg', 'scipy.spatial', 'scipy.special', 'rclpy'},
    'slosh_ros.ros.slosh_node': HEAVY | {'rosbags', 'rich', 'typer'},
    'slosh_ros.ros.rollover_node': HEAVY | {'rosbags', 'rich', 'typer', 'scipy.spatial'},
}


@pytest.mark.parametrize('name', SHELLS)
def test_a_start_imports_only_what_it_needs(name: str) -> None:
    """
    Half the time of a start would be imports that most never use.

    A tank of upright walls is solved without them, too; and nothing heavy is imported later,
    while samples wait: not with the first of them, nor with the first fill.
    """
    if '.ros.' in name:
        pytest.importorskip('rclpy', reason='needs the ROS 2 wheels (make venv)')
    script = f"""
import sys
import {name}
from slosh_ros.engine import MotionSample, SloshConfig, SloshEngine
box = {{'tank.shape': 'rectangular', 'tank.length': 4.0, 'tank.width': 2.0, 'tank.height': 1.5}}
engine = SloshEngine(SloshConfig.from_parameters(box | {{'tank.fill_ratio': 0.0}}))
engine.prepare_fills()
known = set(sys.modules)
for k, fill in enumerate((0.0, 0.4, 0.7)):
    engine.set_fill('tank', fill)
    _, loads = engine.feed(MotionSample.from_imu(10**9 + k * 10**7, [1.0, 1.0, 9.81], [0.1] * 3))
    loads.trust, loads.elevation_max
print(*known)
print(*(set(sys.modules) - known))
"""
    done = subprocess.run(
        [sys.executable, '-c', script], cwd=ROOT, capture_output=True, text=True, check=True
    )
    at_start, later = (set(line.split()) for line in done.stdout.split('\n')[:2])
    assert name in at_start
    assert not at_start & SHELLS[name]
    assert not {module for module in later if module.startswith(('scipy', 'slosh_ros'))}


CORE = [name for name in FURNISHED if FLOORS.get(room(name), 0) <= FLOORS['monitor']]


@pytest.mark.parametrize('name', CORE)
def test_core_does_not_speak(name: str) -> None:
    """The core returns verdicts and results; what is said about them is the shells' matter."""
    path = FURNISHED[name]
    assert not {'logging', 'rich', 'typer'} & set(imported(path))
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            assert node.func.id not in {'print', 'input'}, f'{path}:{node.lineno}'


def test_versions_agree() -> None:
    manifest = ElementTree.parse(ROOT / 'package.xml')
    assert slosh_ros.__version__ == manifest.findtext('version')
