"""
How far a truck is from lifting a wheel: load transfer, rollover thresholds, warnings.

Everything is returned as data; the shells say it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.modal.validity import UNMOVED, Criterion, Trust
from slosh_ros.vehicle.cargo import SloshingCargo
from slosh_ros.vehicle.dynamics import DEVIATIONS, LinearSystem
from slosh_ros.vehicle.general_truck import LATERAL, PHI_S, PLANAR, THETA_S, GeneralTruck, V

Array = NDArray[np.float64]
Kind = Literal['contact', 'liquid', 'articulation']

ARTICULATION_LIMIT = 0.35
"""Articulation up to which its cosine may be taken as one [rad]."""


def load_transfer_ratio(loads: Array) -> Array:
    """
    Load transfer ratio of a group of axles.

    Parameters
    ----------
    loads : array, shape (..., k, 2)
        Loads of left and right wheels of k axles [N].

    Returns
    -------
    array, shape (...)
        `sum(F_R - F_L) / sum(F_R + F_L)`: 0 is even, +1 all on the right, in a left turn; beyond
        one a wheel pulls the road, that is: it has lifted off.
    """
    sides = loads.sum(axis=-2)
    return np.asarray((sides[..., 1] - sides[..., 0]) / sides.sum(axis=-1))


@dataclass(frozen=True, eq=False)
class LoadTransfer:
    """
    Load transfer ratios of a truck over N instants [-].

    Attributes
    ----------
    vehicle, tractor, semitrailer : array, shape (N,)
        Of all axles, of axles 1 and 2, of axles 3 and 4.
    axles : array, shape (N, 4)
        Of each axle.
    """

    vehicle: Array
    tractor: Array
    semitrailer: Array
    axles: Array

    @classmethod
    def of(cls, wheel_loads: Array) -> LoadTransfer:
        """Take the loads of the wheels (N, 4, 2) [N]."""
        return cls(
            vehicle=load_transfer_ratio(wheel_loads),
            tractor=load_transfer_ratio(wheel_loads[..., :2, :]),
            semitrailer=load_transfer_ratio(wheel_loads[..., 2:, :]),
            axles=load_transfer_ratio(wheel_loads[..., np.newaxis, :]),
        )


@dataclass(frozen=True)
class Warn:
    """
    A reason not to believe a result.

    Attributes
    ----------
    kind : str
        `contact`: a wheel has lifted off, which the linear springs do not know; `liquid`: linear
        theory of its motion is left; `articulation`: the units make too large an angle.
    where : str
        Which wheel (`1l` .. `4r`), or by which criterion; empty where there is only one place.
    first : float
        When it first happened [s].
    worst : float
        Lowest wheel load [N], largest value of the criterion [-], largest articulation [rad].
    limit : float
        Of the same.
    share : float
        Share of the time [-].
    """

    kind: Kind
    where: str
    first: float
    worst: float
    limit: float
    share: float


WHEELS = tuple(f'{axle}{side}' for axle in (1, 2, 3, 4) for side in 'lr')
"""Names of the wheels, in the order of the columns of `fz_<wheel>`."""


def warnings_of(
    time: Array, wheel_loads: Array, trust: Sequence[Trust], articulation: Array
) -> tuple[Warn, ...]:
    """
    Find what takes a result out of its theory.

    Parameters
    ----------
    time : array, shape (N,)
        [s].
    wheel_loads : array, shape (N, 4, 2)
        [N].
    trust : sequence of Trust, length N
        In the linear theory of the liquid.
    articulation : array, shape (N,)
        [rad].

    Returns
    -------
    tuple of Warn
    """
    found: list[Warn] = []

    def look(
        kind: Kind, where: str, beyond: NDArray[np.bool_], worst: float, limit: float
    ) -> None:
        if beyond.any():
            first, share = float(time[beyond.argmax()]), float(beyond.mean())
            found.append(Warn(kind, where, first, worst, limit, share))

    for wheel, load in zip(WHEELS, wheel_loads.reshape(len(time), -1).T, strict=True):
        look('contact', wheel, load < 0.0, float(load.min()), 0.0)
    for criterion in Criterion:
        beyond = np.array([t.criterion is criterion and not t.valid for t in trust])
        most = max((t for t in trust if t.criterion is criterion), key=Trust.use, default=UNMOVED)
        look('liquid', criterion.value, beyond, most.value, most.limit)
    angle = np.abs(articulation)
    beyond = angle > ARTICULATION_LIMIT
    look('articulation', '', beyond, float(angle.max()), ARTICULATION_LIMIT)
    return tuple(found)


@dataclass(frozen=True, eq=False)
class SteadyTurn:
    """
    A truck in a steady turn, linear: all is proportional to the lateral acceleration.

    Attributes
    ----------
    lateral_acceleration : float
        `u r` [m/s^2].
    q : array, shape (6,)
        Deviations [m, rad].
    beta : array, shape (n,)
        Modal coordinates [m].
    wheel_loads : array, shape (4, 2)
        [N].
    transfer : LoadTransfer
        Its ratios, shapes (1,) and (1, 4).
    """

    lateral_acceleration: float
    q: Array
    beta: Array
    wheel_loads: Array
    transfer: LoadTransfer

    @property
    def threshold(self) -> float:
        """Lateral acceleration [m/s^2] at which all of one side has lifted off, linearly."""
        return self.lateral_acceleration / float(np.abs(self.transfer.vehicle[0]))

    @property
    def first_lift_off(self) -> float:
        """Lateral acceleration [m/s^2] at which the first wheel lifts off, linearly."""
        return self.lateral_acceleration / float(np.max(np.abs(self.transfer.axles)))


def steady_turn(
    truck: GeneralTruck,
    cargo: SloshingCargo,
    lateral_acceleration: float = 1.0,
    speed: float = 15.0,
) -> SteadyTurn:
    """
    Solve for a steady turn to the left.

    Parameters
    ----------
    truck : GeneralTruck
        The truck, its liquid frozen.
    cargo : SloshingCargo
        The liquid; `SloshingCargo.none()` for a solid cargo.
    lateral_acceleration : float
        `u r` [m/s^2].
    speed : float
        u [m/s]; it hardly matters.

    Returns
    -------
    SteadyTurn
    """
    system = LinearSystem(truck, cargo.modes, cargo.feed_through)
    moving = np.r_[PLANAR : len(system.mass)]
    pushed = -system.mass[moving, V] * lateral_acceleration
    rest = np.linalg.solve(system.stiffness[moving], pushed)
    q, beta = rest[:DEVIATIONS], rest[DEVIATIONS:]
    # side forces: v, gamma and steering hold the planar inertia, whatever the liquid's place
    rate = lateral_acceleration / speed
    steer = truck.steering_for(speed / rate, speed)
    needed = truck.mass[LATERAL, V] * lateral_acceleration
    one, none = np.ones(()), np.zeros(())
    u = speed * one

    def side(v: float, r: float, angle: Array, gamma: Array) -> Array:
        return truck.side_forces(u, angle, np.array([v, r, 0.0]), gamma)

    slip = truck.wheel_slip
    known = side(0.0, rate, steer * one, none)
    columns = [side(1.0, 0.0, none, none), side(0.0, 0.0, none, one)]
    system_2 = np.column_stack([slip.T @ c for c in columns])
    v, gamma = np.linalg.lstsq(system_2, needed - slip.T @ known, rcond=None)[0]
    forces = known + v * columns[0] + gamma * columns[1]
    flat = np.zeros((4, 2))
    loads = truck.wheel_loads(q, np.zeros(DEVIATIONS), flat, flat, forces)
    return SteadyTurn(lateral_acceleration, q, beta, loads, LoadTransfer.of(loads[np.newaxis]))


def rigid_threshold(truck: GeneralTruck, cargo: SloshingCargo | None = None) -> float:
    """
    Rollover threshold without compliance of suspension and tyres.

    `a_y = g (T/2) / h_eff`. Liquid raises the effective height by the hydrostatic moment of its
    surface, `rho I_yy / M`; in a circular section it then acts at the axis, as the pressures are
    radial.

    Parameters
    ----------
    truck : GeneralTruck
        The truck, its liquid frozen.
    cargo : SloshingCargo, optional
        The liquid; by default it stays frozen.

    Returns
    -------
    float
        [m/s^2].
    """
    p, frozen = truck.parameters, truck.cargo
    moment = (
        p.tractor_mass * p.tractor_height
        + p.semitrailer_mass * p.semitrailer_height
        + frozen.mass * (p.semitrailer_height + frozen.centroid[2])
    )
    if cargo is not None:
        moment += float(cargo.surface_moment[1])
    axles = truck.static_wheel_loads.sum(axis=1)
    half_track = float(axles @ np.array(p.track)) / float(axles.sum()) / 2.0
    return GRAVITY * half_track * truck.total_mass / moment


@dataclass(frozen=True)
class Thresholds:
    """
    Lateral accelerations at which a truck rolls over in a steady turn [m/s^2].

    Attributes
    ----------
    rigid_frozen, rigid_liquid : float
        Closed form, without compliance: `rigid_threshold`.
    frozen, liquid : float
        With compliance, all wheels of one side off the road: `SteadyTurn.threshold`.
    lift_off_frozen, lift_off_liquid : float
        With compliance, the first wheel off the road: `SteadyTurn.first_lift_off`.
    """

    rigid_frozen: float
    rigid_liquid: float
    frozen: float
    liquid: float
    lift_off_frozen: float
    lift_off_liquid: float

    @classmethod
    def of(cls, truck: GeneralTruck, cargo: SloshingCargo) -> Thresholds:
        """Set liquid and frozen cargo side by side."""
        solid, sloshing = (steady_turn(truck, c) for c in (SloshingCargo.none(), cargo))
        return cls(
            rigid_frozen=rigid_threshold(truck),
            rigid_liquid=rigid_threshold(truck, cargo),
            frozen=solid.threshold,
            liquid=sloshing.threshold,
            lift_off_frozen=solid.first_lift_off,
            lift_off_liquid=sloshing.first_lift_off,
        )


@dataclass(frozen=True)
class StabilityFigures:
    """
    The figures of a drive on one line, to set liquid and frozen cargo side by side.

    Attributes
    ----------
    load_transfer, tractor, semitrailer : float
        Largest magnitudes of the load transfer ratios of vehicle and units [-].
    axles : tuple of float, length 4
        The same of each axle [-].
    lowest_loads : tuple of float, length 4
        Of the wheels of each axle [N].
    lift_offs : tuple of float, length 4
        When a wheel of each axle first lifted off [s]; infinite if none did.
    roll, pitch : float
        Largest magnitudes of the semitrailer's deviations [rad].
    lateral_acceleration : float
        Largest magnitude [m/s^2].
    """

    load_transfer: float
    tractor: float
    semitrailer: float
    axles: tuple[float, ...]
    lowest_loads: tuple[float, ...]
    lift_offs: tuple[float, ...]
    roll: float
    pitch: float
    lateral_acceleration: float

    @classmethod
    def of(cls, time: Array, wheel_loads: Array, q: Array, lateral: Array) -> StabilityFigures:
        """
        Condense histories.

        Parameters
        ----------
        time : array, shape (N,)
            [s].
        wheel_loads : array, shape (N, 4, 2)
            [N].
        q : array, shape (N, 6)
            Deviations [m, rad].
        lateral : array, shape (N,)
            Lateral acceleration [m/s^2].
        """
        transfer = LoadTransfer.of(wheel_loads)
        lowest = wheel_loads.min(axis=2)
        lifted = lowest < 0.0
        since = np.where(lifted.any(axis=0), time[lifted.argmax(axis=0)], np.inf)
        return cls(
            load_transfer=float(np.abs(transfer.vehicle).max()),
            tractor=float(np.abs(transfer.tractor).max()),
            semitrailer=float(np.abs(transfer.semitrailer).max()),
            axles=tuple(np.abs(transfer.axles).max(axis=0).tolist()),
            lowest_loads=tuple(lowest.min(axis=0).tolist()),
            lift_offs=tuple(since.tolist()),
            roll=float(np.abs(q[:, PHI_S - PLANAR]).max()),
            pitch=float(np.abs(q[:, THETA_S - PLANAR]).max()),
            lateral_acceleration=float(np.abs(lateral).max()),
        )

    @property
    def lift_off(self) -> float:
        """When the first wheel lifted off [s]; infinite if none did."""
        return min(self.lift_offs)


@dataclass
class StabilityWatch:
    """
    Follows a truck instant by instant: its wheels at present, and the figures so far.

    Attributes
    ----------
    ratio : float
        Load transfer ratio of the vehicle at present [-].
    lifted : tuple of str
        Wheels that have lifted off at present.
    articulation : float
        At present [rad].
    load_transfer, load_transfer_at : float
        Largest magnitude of the vehicle's ratio so far [-], and when [s].
    lowest_load, lowest_at : float
        Lowest wheel load so far [N], and when [s].
    lowest_wheel : str
        Whose it was.
    lift_off : float
        When the first wheel lifted off [s]; infinite if none did.
    """

    ratio: float = 0.0
    lifted: tuple[str, ...] = ()
    articulation: float = 0.0
    load_transfer: float = 0.0
    load_transfer_at: float = 0.0
    lowest_load: float = float('inf')
    lowest_at: float = 0.0
    lowest_wheel: str = ''
    lift_off: float = float('inf')

    @property
    def bent(self) -> bool:
        """Whether the articulation is too large for its cosine to be one."""
        return abs(self.articulation) > ARTICULATION_LIMIT

    def look(self, time: float, wheel_loads: Array, articulation: float) -> LoadTransfer:
        """
        Take an instant.

        Parameters
        ----------
        time : float
            [s].
        wheel_loads : array, shape (4, 2)
            [N].
        articulation : float
            [rad].

        Returns
        -------
        LoadTransfer
            Of this instant, shapes () and (4,).
        """
        transfer = LoadTransfer.of(wheel_loads)
        self.ratio = float(transfer.vehicle)
        self.articulation = articulation
        loads = wheel_loads.ravel()
        self.lifted = tuple(WHEELS[k] for k in np.flatnonzero(loads < 0.0))
        if self.lifted:
            self.lift_off = min(self.lift_off, time)
        if abs(self.ratio) > self.load_transfer:
            self.load_transfer, self.load_transfer_at = abs(self.ratio), time
        lowest = int(loads.argmin())
        if loads[lowest] < self.lowest_load:
            self.lowest_load, self.lowest_at = float(loads[lowest]), time
            self.lowest_wheel = WHEELS[lowest]
        return transfer
