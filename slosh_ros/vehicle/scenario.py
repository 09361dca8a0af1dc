"""A scenario: truck, manoeuvre and road from a ROS 2 parameter file."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from slosh_ros.errors import InputError
from slosh_ros.parameters import Parameter, Values, read_parameter_file, resolved
from slosh_ros.vehicle.cargo import RigidCargo, SloshingCargo, TankLiquid
from slosh_ros.vehicle.closed_loop import simulate
from slosh_ros.vehicle.dynamics import Control, Drive
from slosh_ros.vehicle.general_loop import simulate_general
from slosh_ros.vehicle.general_simulator import GeneralSimulator
from slosh_ros.vehicle.general_truck import GeneralParameters, GeneralTruck
from slosh_ros.vehicle.history import History
from slosh_ros.vehicle.journey import Journey
from slosh_ros.vehicle.liquid import CALIBRATED_DAMPING_RATIO
from slosh_ros.vehicle.manoeuvre import Manoeuvre
from slosh_ros.vehicle.road import ROUGHNESS, Bump, Profile, Road, Track, random_road
from slosh_ros.vehicle.simulator import TruckSimulator
from slosh_ros.vehicle.steering import SineSteering, Steering, SteeringKnots
from slosh_ros.vehicle.stepped import SteppedTruck
from slosh_ros.vehicle.truck import Truck, TruckParameters

Array = NDArray[np.float64]

_TRUCKS = {
    'corrected': TruckParameters.corrected,
    'calibrated': TruckParameters.calibrated,
    'paper_as_printed': TruckParameters.paper_as_printed,
}
_CHASSIS = 'chassis.'  # before the names of GeneralParameters
# tanks and truck carry the same liquid if masses and inertias [-] and centroids [m] agree so far
_SAME, _SAME_PLACE = 0.01, 0.05

_COMMON = (
    Parameter(
        'vehicle', 'string', 'paper',
        'paper: heave and pitch, driving straight, section 5; general: in space, with steering',
        choices=('paper', 'general'),
    ),
    Parameter(
        'cargo', 'string', 'liquid',
        'liquid: sloshing, its loads come from slosh_node; solid: the same mass, frozen',
        choices=('liquid', 'solid'),
    ),
    Parameter(
        'coefficients', 'string', 'tank',
        'of the liquid where one process solves it all: tank, those of the tank of slosh_node; '
        'table_4, the one mode of the paper', choices=('tank', 'table_4'),
    ),
    Parameter(
        'manoeuvre', 'string', 'brake',
        'brake to a halt with ramps (Fig. 11), accelerate at a constant rate, or cruise',
        choices=('brake', 'accelerate', 'cruise'),
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
    Parameter(
        'pace', 'string', 'lockstep',
        'lockstep: every step waits for the answer of slosh_node, and all runs are the same; '
        'wall: steps follow the wall clock and take what has arrived',
        choices=('lockstep', 'wall'),
    ),
    Parameter(
        'patience', 'double', 2.0,
        'wall time that a step in lock-step waits for an answer before it goes on without', 's',
        0.001, 60.0,
    ),
    Parameter('log_file', 'string', '', 'CSV file for the history; empty: none'),
)  # fmt: skip

_PAPER = (
    Parameter(
        'truck', 'string', 'corrected',
        'parameters of the tractor-semitrailer of section 5', choices=tuple(_TRUCKS),
    ),
)  # fmt: skip

_GENERAL = (
    Parameter(
        'control', 'string', 'acceleration',
        'acceleration: the driver holds it, whatever the liquid does; force: the wheels give the '
        'force that would accelerate the rigid truck so', choices=('acceleration', 'force'),
    ),
    Parameter(
        'liquid_inertia', 'string', 'exact',
        'exact: the liquid turns with its Stokes-Joukowski inertia; frozen: as a solid, as in '
        'the paper', choices=('exact', 'frozen'),
    ),
    Parameter(
        'liquid.mass', 'double', 27832.55, 'of the liquid, as of the tank of slosh_node', 'kg',
        0.0, 1e6,
    ),
    Parameter(
        'liquid.xyz', 'double[3]', [0.0, 0.0, 0.65],
        'centroid of the liquid in base_link', 'm',
    ),
    Parameter(
        'liquid.inertia', 'double[3]', list(np.diag(RigidCargo.half_full().inertia).tolist()),
        'of the frozen liquid about x, y, z through its centroid', 'kg m^2', 0.0,
    ),
    Parameter(
        'steering.kind', 'string', 'straight',
        'step: to the angle, and hold; lane_change: one sine, ISO 14791; turn: in and out of a '
        'bend; roundabout: swerve in, circulate, swerve out',
        choices=('straight', 'step', 'lane_change', 'turn', 'roundabout'),
    ),
    Parameter(
        'steering.angle', 'double', 0.02, 'of axle 1, positive to the left', 'rad', -0.7, 0.7
    ),
    Parameter(
        'steering.radius', 'double', None,
        'of the path instead of the angle, positive to the left; at the initial speed', 'm',
    ),
    Parameter('steering.start', 'double', 1.0, 'when it begins', 's', 0.0, 3600.0),
    Parameter('steering.rise', 'double', 0.2, 'time for each swing of the wheel', 's', 0.0, 60.0),
    Parameter(
        'steering.hold', 'double', 5.0, 'time in the bend or on the circle', 's', 0.0, 3600.0
    ),
    Parameter('steering.frequency', 'double', 0.4, 'of the lane change', 'Hz', 0.01, 5.0),
    Parameter(
        'bump.side', 'string', 'both', 'wheels that meet the bump',
        choices=('both', 'left', 'right'),
    ),
    Parameter(
        'road.kind', 'string', 'bump',
        'bump: flat, with the bump; random: of a class of ISO 8608; profile: measured',
        choices=('bump', 'random', 'profile'),
    ),
    Parameter(
        'road.class', 'string', 'C', 'ISO 8608, of the random road', choices=tuple(ROUGHNESS)
    ),
    Parameter('road.seed', 'int', 0, 'of the random road: same seed, same road', '', 0, 1e9),
    Parameter(
        'road.position', 'double | double[]', None,
        'rising points of the profile, ahead of the front axle', 'm',
    ),
    Parameter('road.left', 'double | double[]', None, 'heights there, left wheels', 'm'),
    Parameter(
        'road.right', 'double | double[]', None, 'heights there, right wheels; default: as left',
        'm',
    ),
)  # fmt: skip


def _chassis_rows() -> list[Parameter]:
    """Make a row of each parameter of the general truck."""
    rows = []
    default = GeneralParameters()
    for name, told in GeneralParameters.told().items():
        value = getattr(default, name)
        several = isinstance(value, tuple)
        kind = 'bool' if isinstance(value, bool) else 'double'
        if several:
            kind = 'double[3]' if len(value) == 3 else 'double | double[]'
        meaning = f'{told.meaning} ({told.source})'
        rows.append(
            Parameter(
                _CHASSIS + name, kind, list(value) if several else value, meaning, told.unit, 0.0
            )
        )
    return rows


_GENERAL_ROWS = (*_GENERAL, *_chassis_rows())

PARAMETERS: dict[str, Parameter] = {row.name: row for row in (*_PAPER, *_COMMON, *_GENERAL_ROWS)}
"""The one table of parameters of scenarios: node, offline tools and documentation read it."""


@dataclass(frozen=True, eq=False)
class Scenario:
    """
    What the vehicle does, and for how long.

    Attributes
    ----------
    plan : Journey or Drive
        Truck, manoeuvre and road: of the paper's truck, or of the general one.
    solid : bool
        Whether the cargo is frozen.
    table_4 : bool
        Whether `simulate` takes the mode of the paper in place of those of the tank.
    exact_inertia : bool
        Whether the liquid turns with its Stokes-Joukowski inertia; never with the paper's truck.
    steps : int
        Number of exchanges.
    step_ns : int
        Time between them [ns].
    free_running : bool
        Whether steps follow the wall clock instead of the answers of slosh_node.
    patience : float
        Wall time that a step waits for an answer [s].
    log_file : Path or None
        Where the history goes.
    """

    plan: Journey | Drive
    solid: bool
    table_4: bool
    exact_inertia: bool
    steps: int
    step_ns: int
    free_running: bool
    patience: float
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
        general = p.string('vehicle') == 'general'
        _refuse_strangers(p, general)
        log_file = p.string('log_file')
        return cls(
            plan=_drive(p) if general else _journey(p),
            solid=p.string('cargo') == 'solid',
            table_4=p.string('coefficients') == 'table_4',
            exact_inertia=general and p.string('liquid_inertia') == 'exact',
            steps=round(duration / step),
            step_ns=round(step * 1e9),
            free_running=p.string('pace') == 'wall',
            patience=p.number('patience'),
            log_file=Path(log_file) if log_file else None,
        )

    @property
    def liquid_origin(self) -> Array:
        """Position of O in `base_link` (3,) with the paper's tank, half full [m]."""
        if isinstance(self.plan, Journey):
            return np.array(self.plan.truck.parameters.liquid_origin)
        x, y, z = self.plan.truck.cargo.centroid
        return np.array([x, y, z + TruckParameters.corrected().surface_height])

    @property
    def label(self) -> str:
        """What the cargo is, in words that tell the variants apart."""
        if self.solid:
            return 'solid cargo'
        if self.table_4:
            return 'Table 4'
        if isinstance(self.plan, Journey):
            return 'exact coefficients'
        return 'exact inertia' if self.exact_inertia else 'frozen inertia'

    @property
    def variants(self) -> dict[str, Scenario]:
        """
        The same drive with other cargoes, to set side by side: by label, itself first.

        Beside the coefficients of Table 4 those of the tank, beside one inertia of the liquid the
        other, and the solid cargo.
        """
        liquid = replace(self, solid=False)
        others = [liquid]
        if self.table_4:
            others.append(replace(liquid, table_4=False))
        elif isinstance(self.plan, Drive):
            others.append(replace(liquid, exact_inertia=not self.exact_inertia))
        others.append(replace(self, solid=True))
        return {variant.label: variant for variant in (self, *others)}

    def sloshing(self, tanks: Sequence[TankLiquid]) -> SloshingCargo:
        """
        Choose what sloshes.

        Parameters
        ----------
        tanks : sequence of TankLiquid
            The tanks of slosh_node, with their exact inertia; not needed for a solid cargo and
            for Table 4.

        Raises
        ------
        InputError
            If the tanks do not hold the liquid that the truck carries.
        """
        if self.solid:
            return SloshingCargo.none()
        if self.table_4:
            return SloshingCargo.of(self._paper_liquid())
        self.check_liquid(RigidCargo.joined(*(tank.frozen for tank in tanks)))
        if self.exact_inertia:
            return SloshingCargo.of(*tanks)
        return SloshingCargo.of(*(replace(tank, relief=np.zeros((3, 3))) for tank in tanks))

    def _paper_liquid(self) -> TankLiquid:
        """Give Table 4's mode; the calibration of the truck goes with a damping of its own."""
        calibrated = (
            isinstance(self.plan, Journey)
            and self.plan.truck.parameters == TruckParameters.calibrated()
        )
        damping_ratio = CALIBRATED_DAMPING_RATIO if calibrated else 0.0
        return TankLiquid.paper(self.liquid_origin, damping_ratio)

    def check_liquid(self, found: RigidCargo) -> None:
        """
        Refuse tanks whose liquid is not the one that the truck carries.

        Parameters
        ----------
        found : RigidCargo
            All liquid of the tanks, frozen.

        Raises
        ------
        InputError
            If mass, place or, of the general truck, inertia differ; the message holds the remedy.
        """
        carried, general = self.plan.truck.cargo, isinstance(self.plan, Drive)
        inertia, wanted = np.diag(carried.inertia), np.diag(found.inertia)
        apart = float(np.linalg.norm(np.subtract(found.centroid, carried.centroid)))
        if (
            abs(found.mass - carried.mass) <= _SAME * found.mass
            and apart <= _SAME_PLACE
            and (not general or np.all(np.abs(inertia - wanted) <= _SAME * wanted))
        ):
            return
        remedy = 'give slosh_node the half-full tank of section 5 there, or drive vehicle: general'
        if general:
            place, about = (
                [round(float(x), digits) + 0.0 for x in values]
                for values, digits in ((found.centroid, 4), (wanted, 1))
            )
            remedy = (
                f'for these tanks write liquid.mass: {round(found.mass, 2)}, liquid.xyz: {place}, '
                f'liquid.inertia: {about}'
            )
        raise InputError(
            f'slosh_node holds {_told(found)}, but the truck carries {_told(carried)}; {remedy}'
        )

    def simulator(self) -> SteppedTruck:
        """Set the truck up for an exchange of wrenches, step by step."""
        if isinstance(self.plan, Journey):
            return TruckSimulator(self.plan)
        return GeneralSimulator(self.plan)

    def simulate(
        self,
        tanks: Sequence[TankLiquid],
        step: float | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> History:
        """
        Solve truck and liquid as one system: the ground truth.

        Parameters
        ----------
        tanks : sequence of TankLiquid
            The tanks of slosh_node.
        step : float, optional
            Spacing of the result [s]; by default that of the exchange.
        progress : callable, optional
            Told the present time now and then [s].

        Returns
        -------
        History
        """
        cargo = self.sloshing(tanks)
        spacing = self.step_ns * 1e-9 if step is None else step
        duration = self.steps * self.step_ns * 1e-9
        if isinstance(self.plan, Drive):
            return simulate_general(self.plan, cargo, duration, spacing, progress=progress)
        result = simulate(self.plan, cargo.modes, duration, spacing, origin=np.zeros(3))
        if progress is not None:
            progress(duration)
        under = result.distance[:, np.newaxis] - self.plan.truck.parameters.wheel_offsets
        return History.of_paper(result, cargo, self.plan.road.elevation(under))


def _told(liquid: RigidCargo) -> str:
    place, inertia = (
        ', '.join(f'{x:.4g}' for x in values)
        for values in (liquid.centroid, np.diag(liquid.inertia))
    )
    return f'{liquid.mass:.6g} kg of liquid at ({place}) m, inertia ({inertia}) kg m^2'


def _refuse_strangers(p: Values, general: bool) -> None:
    """Refuse settings of the other truck: they would do nothing."""
    rows = _PAPER if general else _GENERAL_ROWS
    for row in rows:
        default = row.default
        if row.name in p and p.by_name[row.name] != default:
            kind, other = ('general', 'paper') if general else ('paper', 'general')
            raise InputError(
                f'{row.name} says nothing to vehicle {kind}; remove it, or write vehicle: {other}'
            )


def _journey(p: Values) -> Journey:
    return Journey(Truck(_TRUCKS[p.string('truck')]()), _manoeuvre(p), _bump(p))


def _drive(p: Values) -> Drive:
    values: dict[str, object] = {}
    for name in GeneralParameters.told():
        value = p.by_name[_CHASSIS + name]
        if isinstance(getattr(GeneralParameters(), name), tuple):
            numbers = np.atleast_1d(p.vector(_CHASSIS + name))
            wanted = len(getattr(GeneralParameters(), name))
            if numbers.size not in (1, wanted):
                raise InputError(
                    f'{_CHASSIS}{name} has {numbers.size} numbers for {wanted} axles; '
                    'give one for all or one for each'
                )
            value = np.broadcast_to(numbers, wanted).tolist()
        values[name] = tuple(value) if isinstance(value, list) else value
    x, y, z = p.vector('liquid.xyz').tolist()
    about_x, about_y, about_z = p.vector('liquid.inertia').tolist()
    cargo = RigidCargo.principal(p.number('liquid.mass'), (x, y, z), (about_x, about_y, about_z))
    truck = GeneralTruck(GeneralParameters(**values), cargo)  # type: ignore[arg-type]
    control: Control = 'force' if p.string('control') == 'force' else 'acceleration'
    return Drive(truck, _manoeuvre(p), _steering(p, truck), _road(p), control)


def _manoeuvre(p: Values) -> Manoeuvre:
    speed, acceleration = p.number('speed'), p.number('acceleration')
    kind = p.string('manoeuvre')
    if kind == 'brake':
        return Manoeuvre.braking(speed, acceleration, p.number('ramp'))
    if kind == 'cruise':
        return Manoeuvre.from_knots(speed, (0.0,), (0.0,))
    return Manoeuvre.accelerating(acceleration, speed)


def _steering(p: Values, truck: GeneralTruck) -> Steering:
    kind, angle = p.string('steering.kind'), p.number('steering.angle')
    start, rise, hold = (p.number(f'steering.{key}') for key in ('start', 'rise', 'hold'))
    if 'steering.radius' in p:
        radius, speed = p.number('steering.radius'), p.number('speed')
        if abs(radius) < 5.0 or speed == 0.0:
            raise InputError(
                f'steering.radius is {radius:g} m at {speed:g} m/s; it must be 5 m or more, to '
                'the left (positive) or right, of a truck that moves'
            )
        angle = truck.steering_for(radius, speed)
    if kind == 'step':
        return SteeringKnots.step(angle, start, rise)
    if kind == 'lane_change':
        return SineSteering(angle, p.number('steering.frequency'), start)
    if kind == 'turn':
        return SteeringKnots.turn(angle, start, rise, hold)
    if kind == 'roundabout':
        return SteeringKnots.roundabout(angle, start, rise, hold)
    return SteeringKnots.straight()


def _bump(p: Values) -> Bump:
    return Bump(p.number('bump.height'), p.number('bump.span'), p.number('bump.start'))


def _road(p: Values) -> Road:
    kind = p.string('road.kind')
    if kind == 'random':
        # as long as it may take, from where the truck stands to where it gets
        length = 20.0 + p.number('duration') * (
            p.number('speed') + p.number('acceleration') * p.number('duration')
        )
        return random_road(p.string('road.class'), length, int(p.number('road.seed')))
    if kind == 'profile':
        for key in ('road.position', 'road.left'):
            if key not in p:
                raise InputError(f'{key} is missing; a measured profile needs it')
        position = np.atleast_1d(p.vector('road.position'))
        left = Profile(position, np.atleast_1d(p.vector('road.left')))
        if 'road.right' not in p:
            return Road.even(left)
        return Road(left, Profile(position, np.atleast_1d(p.vector('road.right'))))
    bump: Track = _bump(p)
    side, level = p.string('bump.side'), Bump(0.0)
    return Road(bump if side != 'right' else level, bump if side != 'left' else level)
