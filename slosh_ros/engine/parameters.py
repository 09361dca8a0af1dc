"""
The one table of parameters: node, offline tools and documentation read it.

A new parameter is one row here. Values follow the typing of ROS 2 parameters: a double is written
with a decimal point, an integer without.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from slosh_ros.errors import InputError

Value = bool | int | float | str | list[float] | list[str]

TANK = '{tank}'  # stands for the name of a tank in the name of a row


@dataclass(frozen=True)
class Parameter:
    """
    One row of the table.

    Attributes
    ----------
    name : str
        Dotted name; `{tank}` stands for the name of each tank.
    kind : str
        `bool`, `int`, `double`, `string`, `double[3]`, `double[]`, `string[]`, or
        `double | double[]`.
    default : Value or None
        None: has no default and may be left out, unless the shape asks for it.
    meaning : str
        What it is, for people.
    unit : str
        Unit, empty for none.
    lower, upper : float
        Closed range of numbers.
    choices : tuple of str
        Admissible strings; empty for any.
    """

    name: str
    kind: str
    default: Value | None
    meaning: str
    unit: str = ''
    lower: float = -math.inf
    upper: float = math.inf
    choices: tuple[str, ...] = ()

    def for_tank(self, tank: str) -> Parameter:
        """Return the row of a named tank."""
        return Parameter(**{**self.__dict__, 'name': self.name.replace(TANK, tank)})

    @property
    def constraints(self) -> str:
        """Range or choices in words; empty if there are none."""
        if self.choices:
            return 'one of ' + ', '.join(self.choices)
        unit = f' {self.unit}' if self.unit else ''
        if math.isfinite(self.lower) and math.isfinite(self.upper):
            return f'from {self.lower:g} to {self.upper:g}{unit}'
        if math.isfinite(self.lower):
            return f'at least {self.lower:g}{unit}'
        return ''

    def checked(self, value: object) -> Value:
        """
        Return the value if it fits this row.

        Raises
        ------
        InputError
            If type, range or choice do not fit; the message names the parameter and the remedy.
        """
        unit = f' [{self.unit}]' if self.unit else ''
        fitting = self._typed(value, unit)
        numbers = fitting if isinstance(fitting, list) else [fitting]
        for number in numbers:
            if isinstance(number, bool | str):
                continue
            if not math.isfinite(number) or not self.lower <= number <= self.upper:
                wanted = self.constraints or 'a finite number'
                raise InputError(f'{self.name} is {number:g}{unit}; it must be {wanted}')
        if self.choices and fitting not in self.choices:
            near = difflib.get_close_matches(str(fitting), self.choices, 1)
            hint = f'; did you mean {near[0]}?' if near else ''
            raise InputError(f"{self.name} is '{fitting}'; it must be {self.constraints}{hint}")
        return fitting

    def _typed(self, value: object, unit: str) -> Value:
        items = list(value) if isinstance(value, list | tuple) else None
        if self.kind == 'double[3]' and items is not None and len(items) != 3:
            raise InputError(f'{self.name} has {len(items)} numbers; it takes 3{unit}')
        if 'double[' in self.kind and items is not None:
            return [self._double(item, unit) for item in items]
        if self.kind == 'string[]' and items and all(isinstance(i, str) for i in items):
            return items
        if self.kind in ('double', 'double | double[]') and items is None:
            return self._double(value, unit)
        if self.kind == 'string' and isinstance(value, str):
            return value
        if self.kind == 'bool' and isinstance(value, bool):
            return value
        if self.kind == 'int' and isinstance(value, int) and not isinstance(value, bool):
            return value
        raise InputError(f'{self.name} is {_shown(value)}; it takes {_KINDS[self.kind]}{unit}')

    def _double(self, value: object, unit: str) -> float:
        if isinstance(value, float):
            return value
        if isinstance(value, int) and not isinstance(value, bool):
            raise InputError(
                f'{self.name} has the integer {value} where ROS 2 wants a double; '
                f'write {value}.0{unit}'
            )
        raise InputError(f'{self.name} has {_shown(value)} where a number is wanted{unit}')


_KINDS = {
    'bool': 'true or false',
    'int': 'an integer',
    'double': 'a number with a decimal point',
    'string': 'a text',
    'double[3]': 'a list of 3 numbers with decimal points',
    'string[]': 'a list of texts, at least one',
    'double | double[]': 'a number with a decimal point, or a list of them',
}


def _shown(value: object) -> str:
    return f"the text '{value}'" if isinstance(value, str) else repr(value)


POSITIVE = 1e-6  # [m] smallest dimension that is taken for one

PARAMETERS: tuple[Parameter, ...] = (
    Parameter(
        'input.source', 'string', 'imu',
        'what drives the liquid: sensor_msgs/Imu on imu/data, or a twist of base_link on twist',
        choices=('imu', 'twist'),
    ),
    Parameter(
        'input.imu_frame', 'string', '',
        'frame_id that the Imu messages must carry; empty: any',
    ),
    Parameter(
        'input.twist_stamped', 'bool', True,
        'twist is a geometry_msgs/TwistStamped; false: a Twist, stamped with its time of arrival',
    ),
    Parameter('imu.xyz', 'double[3]', [0.0, 0.0, 0.0], 'position of the IMU in base_link', 'm'),
    Parameter(
        'imu.rpy', 'double[3]', [0.0, 0.0, 0.0],
        'orientation of the IMU in base_link: roll, pitch, yaw about fixed axes (URDF)', 'rad',
    ),
    Parameter(
        'imu.angular_acceleration_cutoff', 'double', 0.0,
        'corner frequency of the low-pass on differentiated rates, in the loads only; 0: none',
        'Hz', lower=0.0, upper=1e4,
    ),
    Parameter('tanks', 'string[]', ['tank'], 'names of the tanks'),
    Parameter(
        '{tank}.xyz', 'double[3]', [0.0, 0.0, 0.0],
        'position in base_link of the tank frame, the centre of the inner bounding box', 'm',
    ),
    Parameter(
        '{tank}.rpy', 'double[3]', [0.0, 0.0, 0.0],
        'orientation of the tank frame in base_link: roll, pitch, yaw about fixed axes', 'rad',
    ),
    Parameter(
        '{tank}.shape', 'string', None, 'shape of the tank; needed',
        choices=('rectangular', 'cylinder_x'),
    ),
    Parameter(
        '{tank}.length', 'double', None, 'inner length along x', 'm', POSITIVE, 1e3
    ),
    Parameter(
        '{tank}.width', 'double', None, 'inner width along y (rectangular)', 'm', POSITIVE, 1e3
    ),
    Parameter(
        '{tank}.height', 'double', None, 'inner height along z (rectangular)', 'm', POSITIVE, 1e3
    ),
    Parameter(
        '{tank}.radius', 'double', None, 'inner radius (cylinder_x)', 'm', POSITIVE, 1e3
    ),
    Parameter(
        '{tank}.fill_ratio', 'double', None,
        'fraction of the volume that is filled; either this or fill_depth', '', 0.0, 1.0,
    ),
    Parameter(
        '{tank}.fill_depth', 'double', None,
        'greatest depth of the liquid; either this or fill_ratio', 'm', 0.0, 1e3,
    ),
    Parameter(
        '{tank}.modes', 'int', 8, 'number of sloshing modes, from the lowest frequency', '', 1, 128
    ),
    Parameter(
        '{tank}.damping_ratio', 'double | double[]', 0.0,
        'damping ratio of every mode, or one a mode', '', 0.0, 0.99,
    ),
    Parameter('{tank}.density', 'double', 1000.0, 'density of the liquid', 'kg/m^3', 1e-3, 3e4),
    Parameter(
        'frames.output', 'string', 'base_link',
        'frame of the wrenches: base_link, or tank_link of a single tank',
        choices=('base_link', 'tank_link'),
    ),
    Parameter(
        'gate.max_gap', 'double', 0.5,
        'longest interval between samples over which the motion is interpolated; '
        'over a longer one the liquid moves freely', 's', 1e-3, 60.0,
    ),
    Parameter(
        'gate.reset_gap', 'double', 10.0,
        'interval between samples beyond which the liquid starts from rest', 's', 1e-3, 3600.0,
    ),
    Parameter(
        'gate.backward_jump', 'double', 1.0,
        'a stamp older than the last by more than this restarts from rest; by less, it is late',
        's', 0.0, 3600.0,
    ),
    Parameter(
        'gate.max_specific_force', 'double', 200.0,
        'largest specific force per axis that is believed', 'm/s^2', 1.0, 1e4,
    ),
    Parameter(
        'gate.max_angular_rate', 'double', 40.0,
        'largest angular rate per axis that is believed', 'rad/s', 0.1, 1e3,
    ),
    Parameter(
        'gate.max_speed', 'double', 150.0, 'largest speed per axis that is believed', 'm/s',
        1.0, 1e3,
    ),
)  # fmt: skip


def rows_for(tanks: Iterable[str]) -> dict[str, Parameter]:
    """Return all rows by name, those of a tank once for each of the named tanks."""
    rows = {row.name: row for row in PARAMETERS if TANK not in row.name}
    for tank in tanks:
        named = (row.for_tank(tank) for row in PARAMETERS if TANK in row.name)
        rows.update({row.name: row for row in named})
    return rows


def resolved(given: Mapping[str, object]) -> dict[str, Value]:
    """
    Check values against the table and fill in the defaults.

    Parameters
    ----------
    given : mapping
        Values by dotted name.

    Returns
    -------
    dict
        Every parameter that is given or has a default.

    Raises
    ------
    InputError
        On an unknown name, or a value that does not fit its row.
    """
    by_name = {row.name: row for row in PARAMETERS}
    tanks = by_name['tanks'].checked(given.get('tanks', by_name['tanks'].default))
    assert isinstance(tanks, list)
    names = [str(tank) for tank in tanks]
    repeated = {name for name in names if names.count(name) > 1}
    if repeated:
        raise InputError(f'tanks names {", ".join(sorted(repeated))} more than once')
    rows = rows_for(names)
    for name in given:
        if name not in rows:
            near = difflib.get_close_matches(name, rows, 1)
            hint = f'; did you mean {near[0]}?' if near else ''
            raise InputError(f'{name} is not a parameter{hint}')
    values = {name: row.default for name, row in rows.items()} | {
        name: rows[name].checked(value) for name, value in given.items()
    }
    return {name: value for name, value in values.items() if value is not None}
