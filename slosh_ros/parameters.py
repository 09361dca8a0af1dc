"""
Parameters of ROS 2, without ROS: rows of a table, checked values, parameter files.

Values follow the typing of ROS 2 parameters: a double is written with a decimal point, an integer
without.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from ruamel.yaml.events import AliasEvent

from slosh_ros.errors import InputError

Value = bool | int | float | str | list[float] | list[str]


_ROS_OWN = ('use_sim_time', 'start_type_description_service')


@dataclass(frozen=True)
class Parameter:
    """
    One row of the table.

    Attributes
    ----------
    name : str
        Dotted name.
    kind : str
        `bool`, `int`, `double`, `string`, `file`, `double[3]`, `double[]`, `string[]`, or
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
    live : bool
        Whether a running node lets itself be told another value.
    """

    name: str
    kind: str
    default: Value | None
    meaning: str
    unit: str = ''
    lower: float = -math.inf
    upper: float = math.inf
    choices: tuple[str, ...] = ()
    live: bool = False

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
            # the range comes first: an integer may be too large for a float
            if not self.lower <= number <= self.upper or not math.isfinite(number):
                wanted = self.constraints or 'a finite number'
                found = f'{number:g}' if isinstance(number, float) else _shown(number)
                raise InputError(f'{self.name} is {found}{unit}; it must be {wanted}')
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
        if self.kind in ('string', 'file') and isinstance(value, str):
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
                f'{self.name} has the integer {_shown(value)} where ROS 2 wants a double; '
                f'write {_shown(value)}.0{unit}'
            )
        raise InputError(f'{self.name} has {_shown(value)} where a number is wanted{unit}')


_KINDS = {
    'bool': 'true or false',
    'int': 'an integer',
    'double': 'a number with a decimal point',
    'string': 'a text',
    'file': 'the name of a file',
    'double[3]': 'a list of 3 numbers with decimal points',
    'string[]': 'a list of texts, at least one',
    'double[]': 'a list of numbers with decimal points',
    'double | double[]': 'a number with a decimal point, or a list of them',
}

_SHOWN = 80  # characters of a value in a message


def _shown(value: object) -> str:
    text = f"the text '{value}'" if isinstance(value, str) else repr(value)
    text = ' '.join(text.split())
    return text if len(text) <= _SHOWN else f'{text[:_SHOWN]} ...'


def resolved(rows: Mapping[str, Parameter], given: Mapping[str, object]) -> Values:
    """
    Check values against their rows and fill in the defaults.

    Parameters
    ----------
    rows : mapping
        Rows by name.
    given : mapping
        Values by dotted name.

    Returns
    -------
    Values
        Every parameter that is given or has a default.

    Raises
    ------
    InputError
        On an unknown name, or a value that does not fit its row.
    """
    for name in given:
        if name not in rows:
            near = difflib.get_close_matches(name, rows, 1)
            hint = f'; did you mean {near[0]}?' if near else ''
            raise InputError(f'{name} is not a parameter{hint}')
    values = {name: row.default for name, row in rows.items()} | {
        name: rows[name].checked(value) for name, value in given.items()
    }
    return Values({name: value for name, value in values.items() if value is not None})


@dataclass(frozen=True)
class Values:
    """Typed access to values that have been checked."""

    by_name: dict[str, Value]

    def __contains__(self, name: str) -> bool:
        """Tell whether a parameter has a value."""
        return name in self.by_name

    def number(self, name: str) -> float:
        """Return an integer or a double."""
        value = self.by_name[name]
        assert isinstance(value, int | float)
        return float(value)

    def flag(self, name: str) -> bool:
        """Return a bool."""
        return self.by_name[name] is True

    def string(self, name: str) -> str:
        """Return a text."""
        return str(self.by_name[name])

    def strings(self, name: str) -> list[str]:
        """Return a list of texts."""
        value = self.by_name[name]
        assert isinstance(value, list)
        return [str(item) for item in value]

    def vector(self, name: str) -> NDArray[np.float64]:
        """Return a list of doubles, or a double, as an array."""
        return np.array(self.by_name[name], dtype=float)


def read_parameter_file(path: Path, node: str) -> dict[str, object]:
    """
    Flatten the sections of a ROS 2 parameter file that concern a node.

    Parameters
    ----------
    path : Path
        The YAML file, with `/**:` or the node's name over `ros__parameters:`.
    node : str
        Name of the node.

    Returns
    -------
    dict
        Values by dotted name; ROS 2's own parameters are left out.

    Raises
    ------
    InputError
        If the file cannot be read or is not a parameter file.
    """
    sections = ('/**', *_own_sections(node))  # from general to specific
    document = _load(path)
    if not any(key in document for key in sections):
        raise InputError(
            f"is not a parameter file for {node}; begin it with '/**:' and, "
            "indented below, 'ros__parameters:'"
        )
    found: dict[str, object] = {}
    for section in sections:
        body = document.get(section)
        if body is None:
            continue
        if not isinstance(body, dict) or not isinstance(body.get('ros__parameters'), dict):
            raise InputError(f"has no 'ros__parameters:' with entries under '{section}:'")
        pairs = _flatten(body['ros__parameters'])
        names = [name for name, _ in pairs]
        twice = {name for name in names if names.count(name) > 1}
        if twice:
            raise InputError(f"gives {', '.join(sorted(twice))} twice under '{section}:'")
        found.update(pairs)  # a later section is the more specific one
    return without_ros_own(found)


def without_ros_own(parameters: Mapping[str, object]) -> dict[str, object]:
    """Leave out the parameters that every ROS 2 node has."""
    return {
        name: value
        for name, value in parameters.items()
        if name not in _ROS_OWN and not name.startswith('qos_overrides.')
    }


def anchored(
    rows: Iterable[Parameter], given: Mapping[str, object], folders: Sequence[Path]
) -> dict[str, object]:
    """
    Let names of files be relative to the folder of the parameter file, not to that of the process.

    Parameters
    ----------
    rows : iterable of Parameter
        Those of kind `file` tell the last part of the names that are meant.
    given : mapping
        Values by dotted name.
    folders : sequence of Path
        Of the parameter files; the first that holds the file is meant.
    """
    files = {row.name.rpartition('.')[2] for row in rows if row.kind == 'file'}
    found = dict(given)
    for name, value in given.items():
        if name.rpartition('.')[2] in files and isinstance(value, str) and value and folders:
            places = [folder / value for folder in folders]
            found[name] = str(next((p for p in places if p.exists()), places[0]))
    return found


def names_node(path: Path, node: str) -> bool:
    """Tell whether a parameter file, which an error names, has a section of that node's own."""
    try:
        return any(section in _load(path) for section in _own_sections(node))
    except InputError as error:
        raise InputError(f'{path}: {error}') from error


def _own_sections(node: str) -> tuple[str, str, str]:
    return f'/**/{node}', f'/{node}', node


def _load(path: Path) -> dict[object, object]:
    try:
        text = path.read_text(encoding='utf-8')
        if any(isinstance(event, AliasEvent) for event in YAML().parse(text)):
            raise InputError('has an alias (*name), which ROS 2 does not read; write it out')
        document = YAML(typ='safe', pure=True).load(text)
    except OSError as error:
        raise InputError(f'cannot be read: {error.strerror}') from error
    except InputError:
        raise
    except RecursionError as error:
        raise InputError('is nested too deeply for a parameter file') from error
    except TypeError as error:  # ruamel.yaml looks it up
        raise InputError('has a list or a mapping as a key, where a name is wanted') from error
    except (YAMLError, UnicodeDecodeError, ValueError) as error:
        raise InputError(f'is not valid YAML: {_one_line(error)}') from error
    return document if isinstance(document, dict) else {}


def _flatten(tree: Mapping[object, object], prefix: str = '') -> list[tuple[str, object]]:
    pairs: list[tuple[str, object]] = []
    for key, value in tree.items():
        if isinstance(value, dict):
            pairs += _flatten(value, f'{prefix}{key}.')
        else:
            pairs.append((f'{prefix}{key}', value))
    return pairs


def _one_line(error: Exception) -> str:
    mark = getattr(error, 'problem_mark', None)
    where = f' (line {mark.line + 1})' if mark is not None else ''
    problem = getattr(error, 'problem', None) or str(error)
    return ' '.join(problem.split()) + where
