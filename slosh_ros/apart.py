"""
Work in a process of its own, for which no sample waits.

LAPACK does not let go of Python's lock: beside a decomposition in a thread, everything else stands
still. So the work is done by another interpreter, at low priority. It reads on its standard input
what to do and answers on its standard output. It ends with its input, so with its caller, however
that ends; Ctrl-C, which the terminal sends to both, is the caller's matter.

This is not :mod:`multiprocessing`, which would run the main module of the caller once more.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from threading import Thread
from typing import ParamSpec, TypeVar

from slosh_ros.errors import InputError

P = ParamSpec('P')
T = TypeVar('T')

_NICENESS = 10
_CHUNK = 1 << 20  # [bytes]
_ANSWER = b'\n--- answer of slosh_ros ---\n'  # whatever else has come out before
_WORKER = (
    f'import signal; signal.signal({signal.SIGINT:d}, signal.SIG_IGN); '
    f'import {__name__} as apart; apart.work()'
)
_HOUSE = Path(__file__).resolve().parents[1]


def apart(function: Callable[P, T], *arguments: P.args, **keywords: P.kwargs) -> T:
    """
    Call a function in a process of its own, or here if none can be made, and wait for its result.

    Parameters
    ----------
    function : callable
        Of a module, that can be imported from there.
    *arguments, **keywords
        Like its result, they are pickled.

    Raises
    ------
    InputError
        If the function raises one.
    RuntimeError
        If it raises another exception, or the process ends before it returns.
    """
    task = pickle.dumps((function, arguments, keywords))
    # what is found here is found there, and nothing that merely lies about where the user is
    paths = os.pathsep.join(map(os.path.abspath, sys.path))
    try:
        process = subprocess.Popen(
            [sys.executable, '-c', _WORKER],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            cwd=_HOUSE,
            env={**os.environ, 'PYTHONPATH': paths},
        )
    except OSError:
        return function(*arguments, **keywords)
    with process:
        assert process.stdin is not None
        assert process.stdout is not None
        with suppress(BrokenPipeError):  # it has ended, and has said why
            process.stdin.write(task)
            process.stdin.flush()
        # not of the buffered file, whose lock a thread must not hold when Python ends
        read = partial(os.read, process.stdout.fileno(), _CHUNK)
        said, _, answer = b''.join(iter(read, b'')).partition(_ANSWER)
    if not answer:
        last = said.decode(errors='replace').strip().rpartition('\n')[2]
        raise RuntimeError(f'its process ended with code {process.returncode}: {last}')
    result, error = pickle.loads(answer)
    if error is not None:
        raise error
    return result  # type: ignore[no-any-return]


def work() -> None:
    """Do what the standard input says."""
    function, arguments, keywords = pickle.load(sys.stdin.buffer)
    Thread(target=_end_with_caller, daemon=True).start()
    os.nice(_NICENESS)
    result: object = None
    error: Exception | None = None
    try:
        result = function(*arguments, **keywords)
    except InputError as refusal:
        error = refusal
    except Exception as failure:
        error = RuntimeError(f'{type(failure).__name__}: {failure}')
    sys.stdout.buffer.write(_ANSWER + pickle.dumps((result, error)))
    sys.stdout.flush()


def _end_with_caller() -> None:
    while os.read(0, 1):
        pass
    os._exit(0)
