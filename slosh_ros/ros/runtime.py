"""Start and end of a node's process."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable

import rclpy
from rclpy.exceptions import InvalidParameterException, ROSInterruptException
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

from slosh_ros.errors import InputError

try:  # the module of rcl's own errors has no public name
    from rclpy._rclpy_pybind11 import RCLError, UnknownROSArgsError
except ImportError:  # pragma: no cover
    RCLError = UnknownROSArgsError = RuntimeError


def run(make_node: Callable[[], Node], args: list[str] | None = None) -> int:
    """
    Make a node, spin it until Ctrl-C or SIGTERM, and return the exit code of the process.

    A configuration that does not fit ends in one line on stderr and exit code 1.
    """
    node: Node | None = None
    started = False
    try:
        rclpy.init(args=args)
        started = True
        node = _made(make_node)
        rclpy.spin(node)
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


def _made(make_node: Callable[[], Node]) -> Node:
    """Make the node; what rclpy itself objects to in a parameter is bad input as well."""
    try:
        return make_node()
    except (InputError, RCLError):
        raise
    except (ValueError, RuntimeError) as error:
        raise InputError(f'the parameters do not fit: {error}') from error
