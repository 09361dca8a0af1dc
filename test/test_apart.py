"""Work in a process of its own: what it returns, how it fails, and that it never outlives."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from slosh_ros.apart import apart
from slosh_ros.engine.fill import checked_ratio
from slosh_ros.errors import InputError

CALLER = """
import sys, threading, time
from slosh_ros.apart import apart
threading.Thread(target=apart, args=(time.sleep, 100.0), daemon=True).start()
print('started', flush=True)
if sys.argv[1] == 'ends':
    sys.stdin.read()
else:
    apart(time.sleep, 100.0)
"""


def test_it_is_another_process_of_low_priority_that_answers() -> None:
    assert apart(os.getpid) != os.getpid()
    assert apart(os.nice, 0) >= min(os.nice(0) + 10, 19)
    assert apart(json.loads, '[1, 2]') == [1, 2]
    assert apart(signal.raise_signal, signal.SIGINT) is None  # Ctrl-C is its caller's matter


def test_what_is_printed_meanwhile_is_no_answer() -> None:
    assert apart(print, 'some module', file=None) is None


def test_errors_come_back_in_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match='the fill of rear is 2; it must be a ratio from 0 to 1'):
        apart(checked_ratio, 'rear', 2.0, ['rear'])
    with pytest.raises(RuntimeError, match='JSONDecodeError: Expecting value'):
        apart(json.loads, 'none')
    with pytest.raises(RuntimeError, match='its process ended with code -9'):
        apart(signal.raise_signal, signal.SIGKILL)
    (tmp_path / 'slosh_of_another.py').write_text('def work(): pass\n')
    monkeypatch.syspath_prepend(tmp_path)
    import slosh_of_another

    (tmp_path / 'slosh_of_another.py').unlink()
    with pytest.raises(RuntimeError, match=r'code 1: .*slosh_of_another'):
        apart(slosh_of_another.work)


def test_files_that_lie_about_are_not_modules(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An installed script does not look for modules where the user happens to be."""
    (tmp_path / 'pickle.py').write_text('raise SystemExit(3)\n')
    monkeypatch.setattr(sys, 'path', [path for path in sys.path if path])
    monkeypatch.chdir(tmp_path)
    assert apart(os.getcwd) != str(tmp_path)


def test_where_no_process_can_be_made_it_is_done_here(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, 'executable', '')
    assert apart(os.getpid) == os.getpid()


@pytest.mark.parametrize(
    ('way', 'number'),
    [('ends', 0), ('waits', signal.SIGKILL), ('waits', signal.SIGINT)],
)
def test_no_process_outlives_its_caller(way: str, number: int) -> None:
    """Python's own end, a crash, and Ctrl-C, which the terminal sends to all of them, twice."""
    caller = subprocess.Popen(
        [sys.executable, '-c', CALLER, way],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert caller.stdout is not None
    assert caller.stdout.readline() == 'started\n'
    workers = _children(caller.pid, 1 if way == 'ends' else 2)
    if number == signal.SIGINT:
        os.killpg(caller.pid, number)
        time.sleep(0.05)
        os.killpg(caller.pid, number)
    elif number:
        caller.send_signal(number)
    _, said = caller.communicate(timeout=20.0)
    _, alive = psutil.wait_procs(workers, timeout=10.0)
    assert not alive
    assert 'apart.work()' not in said  # of a worker
    assert 'Fatal' not in said
    assert number or not said


def _children(pid: int, count: int) -> list[psutil.Process]:
    """Wait for the workers of a process, all of which ignore Ctrl-C by now."""
    until = time.monotonic() + 20.0
    while time.monotonic() < until:
        workers = psutil.Process(pid).children()
        if len(workers) == count and all(worker.nice() >= 10 for worker in workers):
            return workers
        time.sleep(0.05)
    raise AssertionError('there are no workers')
