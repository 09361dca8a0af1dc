"""The configuration: a ROS 2 parameter file, checked, in the engine's terms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from slosh_ros.engine.gate import GatePolicy
from slosh_ros.engine.kinematics import Pose
from slosh_ros.engine.parameters import Value, resolved
from slosh_ros.errors import InputError
from slosh_ros.hydro import ModalCoefficients, coefficients_of
from slosh_ros.tank import UniformTank, cylinder_x, rectangular

Array = NDArray[np.float64]

_DIMENSIONS = {
    'rectangular': ('length', 'width', 'height'),
    'cylinder_x': ('radius', 'length'),
}
_SHAPES = {'rectangular': rectangular, 'cylinder_x': cylinder_x}
_SECTIONS = ('/**', '/**/slosh_node', '/slosh_node', 'slosh_node')
# Nearly empty and nearly full tanks leave both linear theory and the solvers' accuracy.
_FILL_RANGE = (0.01, 0.99)


@dataclass(frozen=True, eq=False)
class TankConfig:
    """
    One tank.

    Attributes
    ----------
    name : str
        Its name.
    pose : Pose
        Of the tank frame in base_link.
    tank : UniformTank
        Its shape.
    depth : float
        Depth of the liquid [m].
    density : float
        Of the liquid [kg/m^3].
    damping_ratio : array, shape (n,)
        Per mode.
    """

    name: str
    pose: Pose
    tank: UniformTank
    depth: float
    density: float
    damping_ratio: Array

    def coefficients(self) -> ModalCoefficients:
        """Solve for the modal coefficients; takes from a millisecond to a second."""
        return coefficients_of(self.tank, self.depth, self.density, len(self.damping_ratio))


@dataclass(frozen=True, eq=False)
class SloshConfig:
    """
    All that the engine needs to know.

    Attributes
    ----------
    source : str
        `imu` or `twist`.
    imu_frame : str
        Expected frame_id of the Imu messages; empty for any.
    twist_stamped : bool
        Whether the twist carries its own stamp.
    imu : Pose
        Of the IMU in base_link.
    angular_acceleration_cutoff : float
        Corner of the low-pass on differentiated rates [Hz]; 0 for none.
    tanks : tuple of TankConfig
        The tanks.
    output_frame : str
        `base_link` or `tank_link`.
    gate : GatePolicy
        Limits of the sample gate.
    """

    source: str
    imu_frame: str
    twist_stamped: bool
    imu: Pose
    angular_acceleration_cutoff: float
    tanks: tuple[TankConfig, ...]
    output_frame: str
    gate: GatePolicy

    @property
    def sensor(self) -> Pose:
        """Pose in base_link of the point and axes that are measured; a twist is base_link's own."""
        return self.imu if self.source == 'imu' else Pose.identity()

    @classmethod
    def from_file(cls, path: Path) -> SloshConfig:
        """
        Read a ROS 2 parameter file.

        Raises
        ------
        InputError
            If the file cannot be read or a parameter does not fit; the message names both.
        """
        try:
            return cls.from_parameters(read_parameter_file(path))
        except InputError as error:
            raise InputError(f'{path}: {error}') from error

    @classmethod
    def from_parameters(cls, given: Mapping[str, object]) -> SloshConfig:
        """
        Check parameters, given by dotted name, and build the configuration.

        Raises
        ------
        InputError
            If a parameter is unknown, missing or does not fit.
        """
        p = _Reader(resolved(given))
        tanks = tuple(_tank(p, name) for name in p.strings('tanks'))
        output_frame = p.string('frames.output')
        if output_frame == 'tank_link' and len(tanks) > 1:
            raise InputError(
                'frames.output is tank_link, which needs a single tank; write base_link'
            )
        gate = GatePolicy(
            *(
                p.number(f'gate.{key}')
                for key in (
                    'max_gap',
                    'reset_gap',
                    'backward_jump',
                    'max_specific_force',
                    'max_angular_rate',
                    'max_speed',
                )
            )
        )
        if gate.reset_gap < gate.max_gap:
            raise InputError(
                f'gate.reset_gap ({gate.reset_gap:g} s) is shorter than gate.max_gap '
                f'({gate.max_gap:g} s); make it longer'
            )
        return cls(
            source=p.string('input.source'),
            imu_frame=p.string('input.imu_frame'),
            twist_stamped=bool(p.values['input.twist_stamped']),
            imu=Pose.from_xyz_rpy(p.vector('imu.xyz'), p.vector('imu.rpy')),
            angular_acceleration_cutoff=p.number('imu.angular_acceleration_cutoff'),
            tanks=tanks,
            output_frame=output_frame,
            gate=gate,
        )


@dataclass(frozen=True)
class _Reader:
    """Typed access to values that the table has already checked."""

    values: dict[str, Value]

    def number(self, name: str) -> float:
        value = self.values[name]
        assert isinstance(value, int | float)
        return float(value)

    def string(self, name: str) -> str:
        return str(self.values[name])

    def strings(self, name: str) -> list[str]:
        value = self.values[name]
        assert isinstance(value, list)
        return [str(item) for item in value]

    def vector(self, name: str) -> Array:
        return np.array(self.values[name], dtype=float)


def _tank(p: _Reader, name: str) -> TankConfig:
    if f'{name}.shape' not in p.values:
        raise InputError(f'{name}.shape is missing; write one of {", ".join(_DIMENSIONS)}')
    shape = p.string(f'{name}.shape')
    wanted = _DIMENSIONS[shape]
    for dimension in sorted({d for dims in _DIMENSIONS.values() for d in dims}):
        key = f'{name}.{dimension}'
        if dimension in wanted and key not in p.values:
            raise InputError(f'{key} is missing; a {shape} tank needs {", ".join(wanted)} [m]')
        if dimension not in wanted and key in p.values:
            raise InputError(
                f'{key} is given, but a {shape} tank takes {", ".join(wanted)}; remove it'
            )
    tank = _SHAPES[shape](**{d: p.number(f'{name}.{d}') for d in wanted})
    modes = int(p.number(f'{name}.modes'))
    damping = np.atleast_1d(p.vector(f'{name}.damping_ratio'))
    if damping.size not in (1, modes):
        raise InputError(
            f'{name}.damping_ratio has {damping.size} numbers for {modes} modes; '
            'give one for all or one for each'
        )
    return TankConfig(
        name=name,
        pose=Pose.from_xyz_rpy(p.vector(f'{name}.xyz'), p.vector(f'{name}.rpy')),
        tank=tank,
        depth=_depth(p, name, tank),
        density=p.number(f'{name}.density'),
        damping_ratio=np.broadcast_to(damping, (modes,)),
    )


def _depth(p: _Reader, name: str, tank: UniformTank) -> float:
    ratio_key, depth_key = f'{name}.fill_ratio', f'{name}.fill_depth'
    if (ratio_key in p.values) == (depth_key in p.values):
        problem = 'are both given' if ratio_key in p.values else 'are both missing'
        raise InputError(f'{ratio_key} and {depth_key} {problem}; give exactly one of them')
    if depth_key in p.values:
        depth = p.number(depth_key)
        if not 0.0 < depth < tank.height:
            raise InputError(
                f'{depth_key} is {depth:g} m; the tank is {tank.height:g} m high, '
                'so it must lie between 0 and that'
            )
        ratio, key = tank.fill_ratio(depth), depth_key
    else:
        ratio, key = p.number(ratio_key), ratio_key
    low, high = _FILL_RANGE
    if not low <= ratio <= high:
        raise InputError(
            f'{key} fills {ratio:.2%} of the tank; it must fill from {low:.0%} to {high:.0%}'
        )
    return depth if key == depth_key else tank.depth(ratio)


def read_parameter_file(path: Path) -> dict[str, object]:
    """
    Flatten the sections of a ROS 2 parameter file that concern slosh_node.

    Parameters
    ----------
    path : Path
        The YAML file, with `/**:` or `slosh_node:` over `ros__parameters:`.

    Returns
    -------
    dict
        Values by dotted name; ROS 2's own parameters are left out.

    Raises
    ------
    InputError
        If the file cannot be read or is not a parameter file.
    """
    try:
        document = YAML(typ='safe', pure=True).load(path.read_text(encoding='utf-8'))
    except OSError as error:
        raise InputError(f'cannot be read: {error.strerror}') from error
    except (YAMLError, UnicodeDecodeError, ValueError) as error:
        raise InputError(f'is not valid YAML: {_one_line(error)}') from error
    if not isinstance(document, dict) or not any(key in document for key in _SECTIONS):
        raise InputError(
            "is not a parameter file for slosh_node; begin it with '/**:' and, "
            "indented below, 'ros__parameters:'"
        )
    found: dict[str, object] = {}
    for section in _SECTIONS:
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
    return {
        key: value
        for key, value in found.items()
        if key != 'use_sim_time' and not key.startswith('qos_overrides.')
    }


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
