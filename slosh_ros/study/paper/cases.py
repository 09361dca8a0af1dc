"""The tanks of the paper and of the experiments, and their drive through the engine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.engine import MotionSample, SloshConfig, SloshEngine
from slosh_ros.engine.config import TankConfig
from slosh_ros.hydro import ModalCoefficients, coefficients_of
from slosh_ros.hydro.added_mass import AddedMass
from slosh_ros.hydro.frequency import rectangular_wall_ratio, total_added_mass
from slosh_ros.tank import cylinder_x, rectangular

Array = NDArray[np.float64]

TABLE_1_TANK = rectangular(8.0, 2.0, 1.6)
TABLE_1_DEPTH = 0.8
TABLE_1_DENSITY = 850.0  # not stated; found from the printed numbers, see table1
PAPER_GRID: Array = 0.05 + 0.1 * np.arange(50.0)  # on which the paper's peaks lie [rad/s]
INFINITE = 50.0  # the paper's infinite frequency [rad/s]
EPSILON = 0.02  # of eq (36); the paper does not state its own
BRAKED_TANK = cylinder_x(1.2, 5.75)
TRUCK_TANK = cylinder_x(1.125, 14.0)
TURNED_TANK = cylinder_x(1.5, 15.5)


@cache
def table_1(modes: int = 250) -> ModalCoefficients:
    """Solve the rectangular tank of section 4.2."""
    return coefficients_of(TABLE_1_TANK, TABLE_1_DEPTH, TABLE_1_DENSITY, modes)


@cache
def braked(fill: float, modes: int = 400) -> ModalCoefficients:
    """Solve the cylinder of section 4.3, `fill` radii deep, water."""
    return coefficients_of(BRAKED_TANK, fill * 1.2, 1000.0, modes)


@cache
def truck_liquid(modes: int = 400) -> ModalCoefficients:
    """Solve the cylinder of section 5, half full of water."""
    return coefficients_of(TRUCK_TANK, 1.125, 1000.0, modes)


@cache
def turned(modes: int = 400) -> ModalCoefficients:
    """Solve the cylinder of section 4.4, half full of gasoline."""
    return coefficients_of(TURNED_TANK, 1.5, 820.0, modes)


@cache
def table_1_sweep() -> AddedMass:
    """Sweep the tank of section 4.2 as the paper does: damped, on its grid."""
    c = table_1()
    ratio = rectangular_wall_ratio(TABLE_1_TANK, TABLE_1_DEPTH, c.names)
    matrix = total_added_mass(c, PAPER_GRID, EPSILON, ratio)
    return AddedMass(PAPER_GRID, matrix, c.density, np.zeros(3), source='modes of the closed form')


def with_infinity(sweep: AddedMass, c: ModalCoefficients) -> AddedMass:
    """Add the paper's infinite frequency, undamped: modes tell the damping near resonance only."""
    return replace(
        sweep,
        omega=np.append(sweep.omega, INFINITE),
        matrix=np.concatenate([sweep.matrix, total_added_mass(c, INFINITE)]),
    )


def at_infinity(c: ModalCoefficients) -> tuple[float, float, float, float]:
    """A_11, A_15, A_22, A_24 of the sloshing modes at infinite frequency [kg, kg m]."""
    lam = c.coupling.T
    return tuple(
        -float(np.sum(lam[i] * lam[k] / c.mu)) for i, k in ((0, 0), (0, 4), (1, 1), (1, 3))
    )  # type: ignore[return-value]


def mode(c: ModalCoefficients, name: str) -> int:
    """Place of a mode."""
    return c.names.index(name)


def only(c: ModalCoefficients, *names: str) -> ModalCoefficients:
    """Keep some modes of a tank; no pressure can be had of them."""
    j = [mode(c, name) for name in names]
    return replace(
        c,
        names=names,
        omega=c.omega[j],
        mu=c.mu[j],
        coupling=c.coupling[j],
        wall_friction=None if c.wall_friction is None else c.wall_friction[j],
        surface_shapes=c.surface_shapes[:, j],
        potentials=None,
    )


def along(c: ModalCoefficients, count: int) -> ModalCoefficients:
    """Keep the lowest modes that couple with surge."""
    names = [n for n, row in zip(c.names, c.coupling, strict=True) if row[0] != 0.0]
    return only(c, *names[:count])


def across(c: ModalCoefficients, count: int) -> ModalCoefficients:
    """Keep the lowest modes that couple with sway."""
    names = [n for n, row in zip(c.names, c.coupling, strict=True) if row[1] != 0.0]
    return only(c, *names[:count])


@dataclass(frozen=True, eq=False)
class _Given(TankConfig):
    """A tank whose coefficients are known already."""

    given: ModalCoefficients

    def coefficients(self) -> ModalCoefficients:
        return self.given


@dataclass(frozen=True, eq=False)
class Run:
    """
    What the engine made of a motion; wrenches about O in tank axes.

    Attributes
    ----------
    time : array, shape (n,)
        [s].
    beta : array, shape (n, m)
        Modal coordinates [m].
    slosh, total : array, shape (n, 6)
        Sloshing wrench, and the whole one [N, N m].
    elevation_max : array, shape (n,)
        Largest wave height or depth [m].
    use : array, shape (n,)
        How much of the room of linear theory is used up; beyond 1 it is left [-].
    pressure : array, shape (n, p)
        At the points, less that of the level tank at rest [Pa].
    """

    time: Array
    beta: Array
    slosh: Array
    total: Array
    elevation_max: Array
    use: Array
    pressure: Array


def drive(
    tank: Mapping[str, object],
    c: ModalCoefficients,
    time: Array,
    force: Array,
    rate: Array | None = None,
    imu_height: float = 0.0,
    damping: float = 0.0,
    points: Mapping[str, Array] | None = None,
) -> Run:
    """
    Feed a motion to the engine, sample by sample, as slosh_node would.

    Parameters
    ----------
    tank : mapping
        Shape and fill, keys as in the configuration of a tank.
    c : ModalCoefficients
        The modes to use.
    time : array, shape (n,)
        [s].
    force : array, shape (n, 3)
        Specific force of the IMU [m/s^2].
    rate : array, shape (n, 3), optional
        Angular rate [rad/s].
    imu_height : float
        Of the IMU over O [m].
    damping : float
        Damping ratio of all modes.
    points : mapping, optional
        Where the pressure is wanted, about O in tank axes, by name [m].
    """
    given = {
        **{f'tank.{key}': value for key, value in tank.items()},
        'tank.modes': len(c.mu),
        'tank.damping_ratio': damping,
        'tank.xyz': (-c.liquid.surface_centre).tolist(),  # base_link is O
        'imu.xyz': [0.0, 0.0, imu_height],
        'tank.density': c.density,
        **{
            f'pressure.{name}': (point + c.liquid.surface_centre).tolist()
            for name, point in (points or {}).items()
        },
    }
    config = SloshConfig.from_parameters(given)
    (configured,) = config.tanks
    engine = SloshEngine(replace(config, tanks=(_Given(**vars(configured), given=c),)))
    turning = np.zeros_like(force) if rate is None else rate
    stamps = np.round((time + 1.0) * 1e9).astype(np.int64).tolist()
    beta, loads = [], []
    for stamp, f, w in zip(stamps, force, turning, strict=True):
        verdict, result = engine.feed(MotionSample(stamp, f, np.zeros(3), w))
        if result is None:
            raise RuntimeError(f'the engine refused a sample of a study: {verdict.value}')
        loads.append(result)
        beta.append(engine.tanks[0].beta)
    return Run(
        time=time,
        beta=np.array(beta),
        slosh=np.array([one.wrench for one in loads]),
        total=np.array([one.total for one in loads]),
        elevation_max=np.array([one.elevation_max for one in loads]),
        use=np.array([one.trust.use() for one in loads]),
        pressure=np.array([one.pressure for one in loads]),
    )


def level(time: Array, surge: Array | float = 0.0, sway: Array | float = 0.0) -> Array:
    """Specific force (n, 3) of a level tank that accelerates."""
    return np.column_stack(
        [np.broadcast_to(surge, time.shape), np.broadcast_to(sway, time.shape),
         np.full(time.shape, GRAVITY)]
    )  # fmt: skip
