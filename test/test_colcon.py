"""
The package as a ROS 2 user gets it: built by colcon, found by the ament index, started.

`ros2 run slosh_ros NAME` starts lib/slosh_ros/NAME of a prefix in AMENT_PREFIX_PATH whose ament
index lists slosh_ros. That is what these tests look up and start, for `ros2` itself has no wheel.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

pytest.importorskip('colcon_core', reason='colcon is not installed')
pytest.importorskip('rclpy', reason='ROS 2 is not installed')

pytestmark = [pytest.mark.colcon, pytest.mark.timeout(900)]

ROOT = Path(__file__).resolve().parent.parent
READY = 60.0  # [s] a node may take to say that it is ready
STOP = 20.0  # [s] a node may take to end after Ctrl-C


class Workspace:
    """A colcon workspace with a copy of the package in src."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.prefix = root / 'install' / 'slosh_ros'
        self.share = self.prefix / 'share' / 'slosh_ros'
        self.executables = self.prefix / 'lib' / 'slosh_ros'

    def run(self, *command: object, **options: object) -> subprocess.CompletedProcess[str]:
        """Run a command in the workspace and keep what it prints."""
        return subprocess.run(
            [str(part) for part in command],
            cwd=self.root,
            # a user's own colcon settings must not decide what is tested
            env={**os.environ, 'COLCON_DEFAULTS_FILE': os.devnull},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
            **options,
        )

    def colcon(self, *arguments: object) -> str:
        """Run colcon with the Python of the tests: it becomes the one of the executables."""
        done = self.run(sys.executable, '-m', 'colcon', *arguments)
        assert done.returncode == 0, done.stdout
        return done.stdout

    def sourced(self, *command: object) -> list[str]:
        """Make a command run as in a shell where the workspace is sourced."""
        setup = shlex.quote(str(self.root / 'install' / 'setup.bash'))
        return ['bash', '-c', f'source {setup} && exec {shlex.join(map(str, command))}']


def copy_package(target: Path) -> None:
    """Copy what git has or would take; without git, all but what tools leave behind."""
    try:
        listed = subprocess.run(
            ['git', 'ls-files', '-z', '--cached', '--others', '--exclude-standard'],
            cwd=ROOT,
            capture_output=True,
            text=True,
            check=True,
        )
    except (FileNotFoundError, subprocess.CalledProcessError):
        left_behind = shutil.ignore_patterns('.*', '__pycache__', 'build', 'install', 'log')
        shutil.copytree(ROOT, target, ignore=left_behind)
        return
    for name in filter(None, listed.stdout.split('\0')):
        if (ROOT / name).is_file():  # and not deleted since
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, target / name)


@pytest.fixture(scope='module')
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    made = Workspace(tmp_path_factory.mktemp('ws'))
    copy_package(made.root / 'src' / 'slosh_ros')
    made.colcon('build', '--executor', 'sequential')
    return made


@contextmanager
def started(command: list[str], log: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Start a program with its output in a file; it is gone at the end, whatever happens."""
    with log.open('wb') as output:
        process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.wait()


def wait_for(text: str, log: Path, process: subprocess.Popen[bytes]) -> None:
    """Wait until a program has printed a text."""
    deadline = time.monotonic() + READY
    while text not in log.read_text():
        assert process.poll() is None, f'ended with {process.returncode}:\n{log.read_text()}'
        assert time.monotonic() < deadline, f'no {text!r} in {READY} s:\n{log.read_text()}'
        time.sleep(0.05)


def test_colcon_takes_it_for_an_ament_python_package(workspace: Workspace) -> None:
    # an invalid package.xml only makes colcon warn and build a plain Python package
    assert workspace.colcon('list').split() == ['slosh_ros', 'src/slosh_ros', '(ros.ament_python)']


def test_ros2_run_finds_the_executables(workspace: Workspace) -> None:
    assert (workspace.prefix / 'share/ament_index/resource_index/packages/slosh_ros').is_file()
    for name in ('slosh', 'slosh_node', 'vehicle_node', 'rollover_node'):
        assert os.access(workspace.executables / name, os.X_OK), name
    prefixes = workspace.run(*workspace.sourced('printenv', 'AMENT_PREFIX_PATH')).stdout
    assert str(workspace.prefix) in prefixes.strip().split(':')


@pytest.mark.parametrize('folder', ['config', 'launch'])
def test_shared_files_are_installed(workspace: Workspace, folder: str) -> None:
    def files(top: Path) -> set[str]:
        return {
            str(path.relative_to(top))
            for path in (top / folder).rglob('*')
            if path.is_file() and '__pycache__' not in path.parts
        }

    source = files(workspace.root / 'src' / 'slosh_ros')
    assert source
    assert files(workspace.share) == source


def test_installed_code_is_what_runs(workspace: Workspace) -> None:
    where = 'import slosh_ros; print(slosh_ros.__file__)'
    done = workspace.run(*workspace.sourced(sys.executable, '-c', where))
    assert Path(done.stdout.strip()).is_relative_to(workspace.prefix), done.stdout


def test_slosh_command(workspace: Workspace) -> None:
    done = workspace.run(*workspace.sourced(workspace.executables / 'slosh', '--help'))
    assert done.returncode == 0, done.stdout
    assert 'modes' in done.stdout


@pytest.mark.ros
@pytest.mark.parametrize(
    ('name', 'arguments'),
    [
        ('slosh_node', ['--params-file', 'config/half_full_tanker.yaml']),
        ('vehicle_node', ['--params-file', 'config/scenarios/brake_bump.yaml']),
        (
            'rollover_node',
            [
                *('--params-file', 'config/half_full_tanker.yaml'),
                *('--params-file', 'config/rollover.yaml'),
            ],
        ),
    ],
)
def test_node_starts_and_ends_on_ctrl_c(
    workspace: Workspace, tmp_path: Path, name: str, arguments: list[str]
) -> None:
    arguments = [str(workspace.share / word) if '/' in word else word for word in arguments]
    log = tmp_path / 'log'
    command = [workspace.executables / name, '--ros-args', *arguments]
    with started(workspace.sourced(*command), log) as process:
        wait_for('ready', log, process)
        process.send_signal(signal.SIGINT)
        assert process.wait(STOP) == 0, log.read_text()
    assert 'Traceback' not in log.read_text()


def test_colcon_test_finds_every_test_file(workspace: Workspace) -> None:
    # Were pytest named in `tests_require` only, colcon would run unittest, find no test, and be
    # content. What it finds is only listed here, for the suite is running already.
    listed = workspace.colcon(
        'test', '--event-handlers', 'console_direct+', '--pytest-args', '--collect-only', '-q'
    )
    files = {path.name for path in (ROOT / 'test').glob('test_*.py')}
    assert set(re.findall(r'^test/(test_\w+\.py)::', listed, re.M)) == files


def test_colcon_test_runs_and_reports(workspace: Workspace) -> None:
    workspace.colcon('test', '--pytest-args', 'test/test_architecture.py')
    result = workspace.run(
        sys.executable, '-m', 'colcon', 'test-result', '--all', '--verbose'
    ).stdout
    ran = re.search(r'^Summary: (\d+) tests, 0 errors, 0 failures, 0 skipped', result, re.M)
    assert ran, result
    assert int(ran[1]) > 20
