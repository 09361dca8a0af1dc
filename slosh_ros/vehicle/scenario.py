"""A scenario: truck, manoeuvre and road from a ROS 2 parameter file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from slosh_ros.errors import InputError
from slosh_ros.parameters import Parameter, Values, read_parameter_file, resolved
from slosh_ros.vehicle.journey import Journey
from slosh_ros.vehicle.manoeuvre import Manoeuvre
from slosh_ros.vehicle.road import Bump
from slosh_ros.vehicle.truck import Truck, TruckParameters

_TRUCKS = {
    'corrected': TruckParameters.corrected,
    'calibrated': TruckParameters.calibrated,
    'paper_as_printed': TruckParameters.paper_as_printed,
}

PARAMETERS: dict[str, Parameter] = {
    row.name: row
    for row in (
        Parameter(
            'truck', 'string', 'corrected',
            'parameters of the tractor-semitrailer of section 5', choices=tuple(_TRUCKS),
        ),
        Parameter(
            'cargo', 'string', 'liquid',
            'liquid: sloshing, its loads come from slosh_node; solid: the same mass, frozen',
            choices=('liquid', 'solid'),
        ),
        Parameter(
            'manoeuvre', 'string', 'brake',
            'brake to a halt with ramps (Fig. 11), or accelerate at a constant rate',
            choices=('brake', 'accelerate'),
        ),
        Parameter('speed', 'double', 10.0, 'initial speed', 'm/s', 0.0, 60.0),
        Parameter(
            'acceleration', 'double', 0.98,
            'magnitude of the deceleration on its plateau, or of the constant acceleration',
            'm/s^2', 0.01, 10.0,
        ),
        Parameter(
            'ramp', 'double', 1.0, 'time in which a deceleration rises, and falls', 's', 0.01, 60.0
        ),
        Parameter(
            'bump.height', 'double', 0.0,
            'height of the parabolic bump, eq (39); negative: a pit; 0: flat road',
            'm', -1.0, 1.0,
        ),
        Parameter(
            'bump.start', 'double', 10.0, 'distance of the bump ahead of the front axle', 'm',
            0.0, 1e5,
        ),
        Parameter('bump.span', 'double', 3.7, 'length of the bump', 'm', 0.1, 100.0),
        Parameter('duration', 'double', 12.0, 'simulated time', 's', 0.001, 3600.0),
        Parameter(
            'step', 'double', 0.01, 'simulated time between two exchanges with slosh_node', 's',
            1e-4, 0.1,
        ),
        Parameter('log_file', 'string', '', 'CSV file for the history; empty: none'),
    )
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Scenario:
    """
    What the vehicle does, and for how long.

    Attributes
    ----------
    journey : Journey
        Truck, manoeuvre and road.
    solid : bool
        Whether the cargo is frozen.
    steps : int
        Number of exchanges.
    step_ns : int
        Time between them [ns].
    log_file : Path or None
        Where the history goes.
    """

    journey: Journey
    solid: bool
    steps: int
    step_ns: int
    log_file: Path | None

    @classmethod
    def from_file(cls, path: Path) -> Scenario:
        """
        Read the sections of a ROS 2 parameter file that concern vehicle_node.

        Raises
        ------
        InputError
            If the file cannot be read or a parameter does not fit; the message names both.
        """
        try:
            return cls.from_parameters(read_parameter_file(path, 'vehicle_node'))
        except InputError as error:
            raise InputError(f'{path}: {error}') from error

    @classmethod
    def from_parameters(cls, given: Mapping[str, object]) -> Scenario:
        """
        Check parameters, given by dotted name, and build the scenario.

        Raises
        ------
        InputError
            If a parameter is unknown or does not fit.
        """
        p = resolved(PARAMETERS, given)
        step, duration = p.number('step'), p.number('duration')
        if step > duration:
            raise InputError(f'step ({step:g} s) is longer than duration ({duration:g} s)')
        truck = Truck(_TRUCKS[p.string('truck')]())
        road = Bump(p.number('bump.height'), p.number('bump.span'), p.number('bump.start'))
        log_file = p.string('log_file')
        return cls(
            journey=Journey(truck, _manoeuvre(p), road),
            solid=p.string('cargo') == 'solid',
            steps=round(duration / step),
            step_ns=round(step * 1e9),
            log_file=Path(log_file) if log_file else None,
        )


def _manoeuvre(p: Values) -> Manoeuvre:
    speed, acceleration = p.number('speed'), p.number('acceleration')
    if p.string('manoeuvre') == 'brake':
        return Manoeuvre.braking(speed, acceleration, p.number('ramp'))
    return Manoeuvre.accelerating(acceleration, speed)
