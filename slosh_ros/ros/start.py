"""
The executables of the nodes.

To import ROS and SciPy takes a second, in which Ctrl-C must end a process as quietly as later. So
nothing is imported here before signals are heard.
"""

from __future__ import annotations

import os
import signal
from importlib import import_module


def slosh_node() -> None:
    """Run slosh_node until Ctrl-C or SIGTERM."""
    _run('slosh_node')


def rollover_node() -> None:
    """Run rollover_node until Ctrl-C or SIGTERM."""
    _run('rollover_node')


def vehicle_node() -> None:
    """Run vehicle_node until its manoeuvre is over, Ctrl-C or SIGTERM."""
    _run('vehicle_node')


def _run(name: str) -> None:
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _leave)
    import_module(f'slosh_ros.ros.{name}').main()


def _leave(*_: object) -> None:
    """End the process, in which there is nothing to clean up yet; an exception would tell how."""
    os._exit(0)
