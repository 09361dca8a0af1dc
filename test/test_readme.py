"""Every `slosh` command of the README and the manual runs as it stands there."""

from __future__ import annotations

import re
import shlex

import pytest
from conftest import REPOSITORY
from test_replay import slosh

import slosh_ros.engine
import slosh_ros.monitor
import slosh_ros.vehicle.rollover

pytestmark = pytest.mark.dear

README = (REPOSITORY / 'README.md').read_text(encoding='utf-8')
BLOCKS = re.findall(r'^```console\n(.*?)^```', README, re.DOTALL | re.MULTILINE)
MANUAL = [path.read_text(encoding='utf-8') for path in sorted(REPOSITORY.glob('docs/*/*.md'))]
COMMANDS = sorted(
    {
        line
        for text in (README, *MANUAL)
        for block in re.findall(r'^```console\n(.*?)^```', text, re.DOTALL | re.MULTILINE)
        for line in block.splitlines()
        if line.startswith('slosh ')
    }
)


@pytest.mark.parametrize('command', COMMANDS)
def test_command_of_readme_and_manual(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for folder in ('config', 'bags'):
        (tmp_path / folder).symlink_to(REPOSITORY / folder)
    result = slosh(*shlex.split(command)[1:])
    assert result.returncode == 0, result.stderr


def test_python_of_the_readme():
    """The lines for a stack of one's own, with files and numbers in place of the user's."""
    (code,) = re.findall(r'^```python\n(.*?)^```', README, re.DOTALL | re.MULTILINE)
    names: dict[str, object] = {
        'tanks': REPOSITORY / 'config/half_full_tanker.yaml',
        'vehicle': REPOSITORY / 'config/rollover.yaml',
        'stamp_ns': 1_000_000_000,
        'specific_force': [0.0, 1.0, 9.81],
        'angular_rate': [0.0, 0.0, 0.0],
    }
    for name, module in (
        ('MotionSample', slosh_ros.engine),
        ('SloshConfig', slosh_ros.engine),
        ('SloshEngine', slosh_ros.engine),
        ('RolloverMonitor', slosh_ros.monitor),
        ('RollVehicle', slosh_ros.vehicle.rollover),
    ):
        names[name] = getattr(module, name)
    exec(code, names)
    assert 0.1 < names['rollover'].load_transfer_ratio < 0.4


def test_the_readme_has_commands_and_its_links_lead_somewhere():
    assert len(COMMANDS) >= 6
    for file in re.findall(r'(?:config|bags)/\S+', '\n'.join(BLOCKS)):
        assert (REPOSITORY / file).exists(), file
    for target in re.findall(r'\]\(([^)#]+)\)', README):
        assert target.startswith('https://') or (REPOSITORY / target).exists(), target
