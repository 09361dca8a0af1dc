"""Start and end of a node's process."""

from __future__ import annotations

import gc
import signal
import sys
from collections.abc import Callable

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import InvalidParameterException, ROSInterruptException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from slosh_ros.errors import InputError

try:  # the module of rcl's own errors has no public name
    from rclpy._rclpy_pybind11 import RCLError, UnknownROSArgsError
except ImportError:  # pragma: no cover
    RCLError = UnknownROSArgsError = RuntimeError


try:  # takes half the time a message of the SingleThreadedExecutor (bench/)
    from rclpy.experimental import EventsExecutor
except ImportError:  # pragma: no cover
    EventsExecutor = SingleThreadedExecutor

_LOOK = 0.1  # [s] after which an idle node looks for signals


def run(
    make_node: Callable[[], Node], args: list[str] | None = None, *, events: bool = False
) -> int:
    """
    Make a node, spin it until Ctrl-C or SIGTERM, and return the exit code of the process.

    A configuration that does not fit ends in one line on stderr and exit code 1.

    Parameters
    ----------
    make_node : callable
        Makes the node.
    args : list of str or None
        Of the command line; None for the process's own.
    events : bool
        Whether an EventsExecutor spins the node, where there is one. It writes a line on stderr
        when a callback raises, so it is not for nodes that end themselves by that.
    """
    node: Node | None = None
    started = False
    try:
        stop = _Stop()
        # rclpy's own handlers would shut ROS down in the middle of a callback
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        started = True
        node = _made(make_node)
        stop.calmly = True
        # what is there now stays: collecting garbage among it would delay samples by milliseconds
        gc.collect()
        gc.freeze()
        if events:
            executor, patience = EventsExecutor(), _LOOK
        else:  # which would make a timer of its own at every message for a patience
            executor, patience = SingleThreadedExecutor(), None
            node.create_timer(_LOOK, _look, clock=Clock(clock_type=ClockType.STEADY_TIME))
        executor.add_node(node)
        # the EventsExecutor's own spin() of rclpy 7.1.6 dispatches nothing
        while rclpy.ok() and not stop.wanted:
            executor.spin_once(timeout_sec=patience)
    except (KeyboardInterrupt, ExternalShutdownException, ROSInterruptException):
        pass
    except (InputError, InvalidParameterException, RCLError, UnknownROSArgsError) as error:
        if started and not rclpy.ok():
            return 0  # a signal shut ROS down in the middle of start-up or of a callback
        # rcl repeats itself over several lines; the first says it
        text = str(error).splitlines()[0]
        unknown = isinstance(error, UnknownROSArgsError)
        print(f'error: {"unknown arguments " if unknown else ""}{text}', file=sys.stderr)
        return 1
    finally:
        # `ros2 launch` signals twice; the second must not interrupt the clean-up
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    return 0


def _look() -> None:
    """Let Python take a signal."""


class _Stop:
    """Ctrl-C or SIGTERM: ends a start-up at once, a running node between two callbacks."""

    def __init__(self) -> None:
        self.wanted = self.calmly = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._on_signal)

    def _on_signal(self, *_: object) -> None:
        self.wanted = True
        if not self.calmly:
            raise KeyboardInterrupt


def _made(make_node: Callable[[], Node]) -> Node:
    """Make the node; what rclpy itself objects to in a parameter is bad input as well."""
    try:
        return make_node()
    except (InputError, RCLError):
        raise
    except (ValueError, RuntimeError) as error:
        raise InputError(f'the parameters do not fit: {error}') from error
