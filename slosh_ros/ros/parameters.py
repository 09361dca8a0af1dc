"""The parameter table as ROS 2 parameters."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node

from slosh_ros.engine.parameters import PARAMETERS
from slosh_ros.parameters import Parameter, Values, anchored, without_ros_own


def given_parameters(node: Node) -> dict[str, object]:
    """
    Parameters that were given to a node on the command line or in a file, ROS 2's own left out.

    Names of files are relative to the folder of the parameter file.

    The node must declare its overrides automatically, so that a misspelt one is seen, too.
    """
    parameters = node.get_parameters_by_prefix('')
    values = {name: parameter.value for name, parameter in parameters.items()}
    # rclpy gives arrays of doubles as array.array
    plain = {
        name: list(value) if isinstance(value, Sequence) and not isinstance(value, str) else value
        for name, value in without_ros_own(values).items()
    }
    return anchored(PARAMETERS, plain, _parameter_folders(sys.argv))


def _parameter_folders(arguments: Sequence[str]) -> list[Path]:
    """List the folders of the parameter files on a command line, the last given first."""
    files = [Path(value) for option, value in pairwise(arguments) if option == '--params-file']
    return [file.parent for file in reversed(files)]


def declare_all(node: Node, rows: Mapping[str, Parameter], values: Values) -> None:
    """Declare the parameters in use, with descriptors, in place of the automatic declarations."""
    for name, value in values.by_name.items():
        if node.has_parameter(name):
            node.undeclare_parameter(name)
        node.declare_parameter(name, value, descriptor(rows[name]), ignore_override=True)


def descriptor(row: Parameter) -> ParameterDescriptor:
    """Describe a row of the table to `ros2 param describe`."""
    unit = f' [{row.unit}]' if row.unit else ''
    described = ParameterDescriptor(
        name=row.name,
        description=row.meaning + unit,
        additional_constraints=row.constraints,
        read_only=not row.live,
        dynamic_typing='|' in row.kind,
    )
    if row.kind == 'double' and math.isfinite(row.lower):
        described.floating_point_range = [
            FloatingPointRange(from_value=row.lower, to_value=row.upper)
        ]
    if row.kind == 'int':
        described.integer_range = [
            IntegerRange(from_value=int(row.lower), to_value=int(row.upper), step=1)
        ]
    return described
