"""The configuration: a ROS 2 parameter file, checked, in the engine's terms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from slosh_ros.engine.gate import GatePolicy
from slosh_ros.engine.kinematics import Pose
from slosh_ros.engine.parameters import PARAMETERS, resolved
from slosh_ros.engine.sample import MotionSample
from slosh_ros.engine.shapes import tank_of
from slosh_ros.errors import InputError
from slosh_ros.hydro import ModalCoefficients, coefficients_of
from slosh_ros.hydro.damping import Damping, RingBaffles, viscous_damping, with_rings
from slosh_ros.hydro.fill_table import FILL_RANGE
from slosh_ros.parameters import Values, anchored, read_parameter_file
from slosh_ros.tank import KnownLiquid, LiquidAtRest, Tank

Array = NDArray[np.float64]

ROUNDING = 1e-3  # [m] by which a point may lie outside the tank


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
    tank : Tank
        Its shape.
    depth : float
        Depth of the liquid [m].
    density : float
        Of the liquid [kg/m^3].
    modes : int
        Number of modes.
    damping : array, shape (n,) or (1,), or None
        Damping ratio of each mode or of all, as configured.
    kinematic_viscosity : float or None
        Of the liquid [m^2/s], if the damping is to follow from it.
    damping_formula : str
        By which formula.
    baffles : RingBaffles or None
        Rings that add to it.
    pressure_points : dict
        Points of the tank whose pressure is wanted, by name, in the tank frame [m].
    """

    name: str
    pose: Pose
    tank: Tank
    depth: float
    density: float
    modes: int
    damping: Array | None
    kinematic_viscosity: float | None
    damping_formula: str
    baffles: RingBaffles | None
    pressure_points: dict[str, Array]

    def coefficients(self) -> ModalCoefficients:
        """
        Solve for the modal coefficients; takes from a millisecond to a second.

        Raises
        ------
        InputError
            If the liquid cannot be computed; the message names the tank.
        """
        try:
            return coefficients_of(self.tank, self.depth, self.density, self.modes)
        except InputError as error:
            raise InputError(f'{self.name}: {error}') from error

    def points_of_pressure(self, liquid: LiquidAtRest) -> Array:
        """
        Points of pressure about O of a liquid, shape (p, 3) [m].

        What lies above the surface by no more than rounding is put into the liquid.
        """
        points = np.array(list(self.pressure_points.values())).reshape(-1, 3)
        above = points[:, 2] - liquid.surface_height
        for i in np.flatnonzero((above > 0.0) & (above <= ROUNDING) & (liquid.volume > 0.0)):
            points[i] = self.tank.nearest(liquid.depth, points[i])
            points[i, 2] = min(points[i, 2], liquid.surface_height)
        return points - liquid.surface_centre

    def damping_ratio(self, coefficients: ModalCoefficients) -> Array:
        """Damping ratio of every mode, shape (n,)."""
        return self.damping_of(coefficients).ratio

    def damping_of(self, coefficients: ModalCoefficients) -> Damping:
        """
        Damping ratio of every mode, and where it comes from.

        Raises
        ------
        InputError
            If the formula does not fit the tank; the message names the parameter.
        """
        if not len(coefficients.omega):
            return Damping(np.zeros(0), 'none: nothing sloshes')
        if self.damping is not None:
            ratio = np.broadcast_to(self.damping, coefficients.omega.shape)
            return Damping(ratio, 'damping_ratio of the configuration')
        if self.kinematic_viscosity is None:
            nothing = np.zeros(coefficients.omega.shape)
            bare = Damping(nothing, 'none: an ideal liquid, for want of a kinematic_viscosity')
        try:
            if self.kinematic_viscosity is not None:
                bare = viscous_damping(
                    self.tank, coefficients, self.kinematic_viscosity, self.damping_formula
                )
            if self.baffles is not None:
                bare = with_rings(self.tank, coefficients, bare, self.baffles)
        except InputError as error:
            raise InputError(f'{self.name}.{error}') from error
        return bare


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
    force_bias, rate_bias : array, shape (3,)
        What the IMU reads too much, in its own axes [m/s^2], [rad/s].
    high_pass : float
        Corner of the slow high-pass on the IMU [Hz]; 0 for none.
    measured_gravity : bool
        Whether the measured vertical specific force takes the place of g.
    loads_cutoff : float
        Corner of the low-pass on the acceleration in the loads [Hz]; 0 for none.
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
    force_bias: Array
    rate_bias: Array
    high_pass: float
    measured_gravity: bool
    loads_cutoff: float
    tanks: tuple[TankConfig, ...]
    output_frame: str
    gate: GatePolicy

    @property
    def pressure_points(self) -> dict[str, str]:
        """Names of all points of pressure, in the order of the engine's, with their frames."""
        return {
            point: 'tank_link' if len(self.tanks) == 1 else f'{tank.name}_link'
            for tank in self.tanks
            for point in tank.pressure_points
        }

    @property
    def sensor(self) -> Pose:
        """Pose in base_link of what is measured; a twist is base_link's own."""
        return self.imu if self.source == 'imu' else Pose.identity()

    @cached_property
    def bias(self) -> tuple[float, ...] | None:
        """What a sample's values are too large by, if there is any; a twist has none."""
        if self.source != 'imu' or not (self.force_bias.any() or self.rate_bias.any()):
            return None
        return (*self.force_bias.tolist(), 0.0, 0.0, 0.0, *self.rate_bias.tolist())

    def unbiased(self, sample: MotionSample) -> MotionSample:
        """Take the sensor's biases from a sample."""
        if self.bias is None:
            return sample
        pairs = zip(sample.values, self.bias, strict=True)
        return MotionSample.of(sample.stamp, tuple(value - bias for value, bias in pairs))

    @classmethod
    def from_file(cls, path: Path) -> SloshConfig:
        """
        Read a ROS 2 parameter file; files that it names are sought beside it.

        Raises
        ------
        InputError
            If the file cannot be read or a parameter does not fit; the message names both.
        """
        try:
            given = read_parameter_file(path, 'slosh_node')
            return cls.from_parameters(anchored(PARAMETERS, given, [path.parent]))
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
        p = resolved(given)[1]
        points = _pressure_points(p)
        tanks = tuple(_tank(p, name, points[name]) for name in p.strings('tanks'))
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
            twist_stamped=p.flag('input.twist_stamped'),
            imu=Pose.from_xyz_rpy(p.vector('imu.xyz'), p.vector('imu.rpy')),
            force_bias=p.vector('imu.bias.specific_force'),
            rate_bias=p.vector('imu.bias.angular_rate'),
            high_pass=p.number('imu.high_pass'),
            measured_gravity=p.string('model.gravity') == 'measured',
            loads_cutoff=p.number('loads.cutoff'),
            tanks=tanks,
            output_frame=output_frame,
            gate=gate,
        )


def _tank(p: Values, name: str, points: dict[str, str]) -> TankConfig:
    tank = tank_of(p, name)
    if isinstance(tank, KnownLiquid):
        depth = _only_depth(p, name, tank, points)
    else:
        depth = _depth(p, name, tank)
    try:
        tank.filled(depth)
    except InputError as error:
        raise InputError(f'{name}: {error}') from error
    modes = int(p.number(f'{name}.modes'))
    damping_key, viscosity_key = f'{name}.damping_ratio', f'{name}.kinematic_viscosity'
    damping = np.atleast_1d(p.vector(damping_key)) if damping_key in p else None
    if damping is not None and damping.size not in (1, modes):
        raise InputError(
            f'{damping_key} has {damping.size} numbers for {modes} modes; '
            'give one for all or one for each'
        )
    return TankConfig(
        name=name,
        pose=Pose.from_xyz_rpy(p.vector(f'{name}.xyz'), p.vector(f'{name}.rpy')),
        tank=tank,
        depth=depth,
        density=p.number(f'{name}.density'),
        modes=modes,
        damping=damping,
        kinematic_viscosity=p.number(viscosity_key) if viscosity_key in p else None,
        damping_formula=p.string(f'{name}.damping_formula'),
        baffles=_baffles(p, name),
        pressure_points={
            point: _inside(tank, key, p.vector(key)) for point, key in points.items()
        },
    )


def _baffles(p: Values, name: str) -> RingBaffles | None:
    keys = [f'{name}.baffle_{part}' for part in ('width', 'heights', 'wave')]
    given = [key for key in keys if key in p]
    if not given:
        return None
    if len(given) < len(keys):
        missing = next(key for key in keys if key not in p)
        raise InputError(f'{given[0]} is given, but {missing} is missing; rings need all three')
    width, heights, wave = keys
    return RingBaffles(p.number(width), tuple(p.vector(heights)), p.number(wave))


def _pressure_points(p: Values) -> dict[str, dict[str, str]]:
    """Keys of the points of pressure, by tank and by their own name, both sorted."""
    tanks = p.strings('tanks')
    points: dict[str, dict[str, str]] = {tank: {} for tank in tanks}
    used: dict[str, str] = {}
    for key in sorted(p.by_name):
        group, _, point = key.rpartition('.')
        tank, _, last = group.rpartition('.')
        if last != 'pressure':
            continue
        if not tank and len(tanks) > 1:
            raise InputError(
                f'{key} does not tell its tank; write '
                + ' or '.join(f'{name}.{key}' for name in tanks)
            )
        if point in used:
            raise InputError(f'{used[point]} and {key} have the same name; rename one of them')
        used[point] = key
        points[tank or tanks[0]][point] = key
    return points


def _inside(tank: Tank, key: str, point: Array) -> Array:
    """Return the point, on the wall if it is outside of the tank by no more than rounding."""
    nearest = tank.nearest(tank.height, point)
    if (outside := float(np.linalg.norm(point - nearest))) > ROUNDING:
        raise InputError(
            f'{key} is ({", ".join(f"{c:g}" for c in point)}) m in the tank frame, '
            f'{outside:.3g} m outside of the tank; its nearest wall is at '
            f'({", ".join(f"{c:.4g}" for c in nearest)}) m'
        )
    return nearest


def _only_depth(p: Values, name: str, tank: KnownLiquid, points: dict[str, str]) -> float:
    """Depth of a liquid that is known at one fill, without its walls and potentials."""
    for key in (f'{name}.fill_ratio', f'{name}.fill_depth'):
        if key in p:
            raise InputError(
                f'{key} is given, but the added mass of {name}.added_mass_file is that of one '
                'fill; remove it'
            )
    for key in points.values():
        raise InputError(
            f'{key} is given, but added mass tells nothing of the pressure at a point; remove it'
        )
    return tank.liquid.depth


def _depth(p: Values, name: str, tank: Tank) -> float:
    ratio_key, depth_key = f'{name}.fill_ratio', f'{name}.fill_depth'
    if (ratio_key in p) == (depth_key in p):
        problem = 'are both given' if ratio_key in p else 'are both missing'
        raise InputError(f'{ratio_key} and {depth_key} {problem}; give exactly one of them')
    if depth_key in p:
        depth = p.number(depth_key)
        if depth > tank.height * (1.0 + 1e-9):
            raise InputError(
                f'{depth_key} is {depth:g} m; the tank is {tank.height:g} m high, '
                'so it must lie from 0 to that'
            )
        depth = min(depth, tank.height)
        ratio, key = (
            tank.fill_ratio(depth) if 0.0 < depth < tank.height else float(depth > 0.0),
            depth_key,
        )
    else:
        ratio, key = p.number(ratio_key), ratio_key
    low, high = FILL_RANGE
    if not (low <= ratio <= high or ratio in (0.0, 1.0)):
        raise InputError(
            f'{key} fills {ratio:.2%} of the tank; it must fill from {low:.0%} to {high:.0%}, '
            'or be empty or full: no waves are computed of a film or around a bubble; a node may '
            'pass through while it is filled or drained, and lets those of the last fill fade'
        )
    return depth if key == depth_key else tank.depth(ratio)
