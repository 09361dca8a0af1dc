"""Every `slosh` command of the README runs as it stands there."""

from __future__ import annotations

import re
import shlex

import pytest
from conftest import REPOSITORY
from test_replay import slosh

README = (REPOSITORY / 'README.md').read_text(encoding='utf-8')
BLOCKS = re.findall(r'^```console\n(.*?)^```', README, re.DOTALL | re.MULTILINE)
COMMANDS = [line for block in BLOCKS for line in block.splitlines() if line.startswith('slosh ')]


@pytest.mark.parametrize('command', COMMANDS)
def test_command_of_the_readme(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for folder in ('config', 'bags'):
        (tmp_path / folder).symlink_to(REPOSITORY / folder)
    result = slosh(*shlex.split(command)[1:])
    assert result.returncode == 0, result.stderr


def test_the_readme_has_commands_and_its_links_lead_somewhere():
    assert len(COMMANDS) >= 6
    for target in re.findall(r'\]\(([^)#]+)\)', README):
        assert target.startswith('https://') or (REPOSITORY / target).exists(), target
