"""The launch files. `launch` has no wheel: without a full ROS 2 they are only compiled."""

from __future__ import annotations

import importlib.util
import runpy
from pathlib import Path

import pytest

LAUNCH = Path(__file__).resolve().parent.parent / 'launch'
COMMON = {'namespace', 'params_file', 'use_sim_time', 'imu_topic', 'twist_topic'}
ARGUMENTS = {
    'slosh': COMMON,
    'closed_loop': COMMON | {'scenario'},
    'replay': COMMON | {'bag'},
    'rollover': COMMON | {'vehicle_file'},
}


def test_every_launch_file_is_tested() -> None:
    assert {path.name.partition('.')[0] for path in LAUNCH.glob('*.py')} == set(ARGUMENTS)


@pytest.mark.parametrize('name', ARGUMENTS)
def test_compiles(name: str) -> None:
    path = LAUNCH / f'{name}.launch.py'
    code = compile(path.read_text(), path, 'exec')
    assert 'generate_launch_description' in code.co_names


@pytest.mark.parametrize('name', ARGUMENTS)
def test_takes_the_documented_arguments(name: str) -> None:
    # not importorskip('launch'): that name on PyPI is another project
    if importlib.util.find_spec('launch_ros') is None:
        pytest.skip('launch_ros is not installed')
    module = runpy.run_path(str(LAUNCH / f'{name}.launch.py'))
    description = module['generate_launch_description']()
    assert {argument.name for argument in description.get_launch_arguments()} == ARGUMENTS[name]
