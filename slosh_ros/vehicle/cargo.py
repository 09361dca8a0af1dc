"""What the truck carries: the liquid once frozen, once sloshing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.errors import InputError
from slosh_ros.hydro.coefficients import ModalCoefficients, surface_grid
from slosh_ros.modal.validity import UNMOVED, Trust, TrustWatch
from slosh_ros.tank import Tank, cylinder_x
from slosh_ros.vehicle.liquid import TABLE_4, LiquidModes

Array = NDArray[np.float64]
Three = tuple[float, float, float]


@dataclass(frozen=True)
class RigidCargo:
    """
    The frozen liquid as a rigid body.

    Attributes
    ----------
    mass : float
        [kg].
    centroid : tuple of float, length 3
        In `base_link` [m].
    inertia : tuple of tuples of float, shape (3, 3)
        About the centroid, axes of `base_link` [kg m^2].
    """

    mass: float
    centroid: Three
    inertia: tuple[Three, ...]

    @classmethod
    def half_full(cls, height: float = 0.65, offset: float = 0.0) -> RigidCargo:
        """
        Give the paper's cargo: 27.8 t of water in a half-full cylinder, R = 1.125 m, L = 14 m.

        Parameters
        ----------
        height, offset : float
            `d_l` above and `l_l` ahead of S [m]. Not in the paper: assumed, see
            `TruckParameters`.
        """
        mass, radius, length = 27832.55, 1.125, 14.0
        depth = 4.0 * radius / (3.0 * np.pi)  # of the centroid below the axis
        about_x = mass * (radius**2 / 2.0 - depth**2)
        about_z = mass * (length**2 / 12.0 + radius**2 / 4.0)
        return cls.principal(mass, (offset, 0.0, height), (about_x, 457050.0, about_z))

    @classmethod
    def principal(cls, mass: float, centroid: Three, inertia: Three) -> RigidCargo:
        """Build a cargo from its moments of inertia about x, y, z [kg m^2]."""
        x, y, z = inertia
        return cls(mass, centroid, ((x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z)))

    @classmethod
    def joined(cls, *parts: RigidCargo) -> RigidCargo:
        """Take several bodies as one."""
        mass = sum(part.mass for part in parts)
        moment = np.array([part.mass * np.array(part.centroid) for part in parts]).sum(axis=0)
        centroid = moment / mass if mass else np.zeros(3)
        inertia = np.zeros((3, 3))
        for part in parts:
            arm = np.array(part.centroid) - centroid
            inertia += np.array(part.inertia) + part.mass * _parallel_axis(arm)
        return cls(mass, _three(centroid), tuple(_three(row) for row in inertia))

    @classmethod
    def none(cls) -> RigidCargo:
        """Give an empty tank."""
        return cls.principal(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@dataclass(frozen=True, eq=False)
class TankLiquid:
    """
    The sloshing liquid of one tank, and where the tank is.

    Attributes
    ----------
    modes : LiquidModes
        About O, the centre of the mean free surface, in tank axes.
    names : tuple of str
        One for each mode.
    origin : array, shape (3,)
        Position of O in `base_link` [m].
    rotation : array, shape (3, 3)
        Takes vectors from tank axes to `base_link`.
    relief : array, shape (3, 3)
        `I_f - J0` in tank axes: by how much the frozen liquid is harder to turn than the real one
        under a closed lid (THEORY 2.2) [kg m^2]. Zero in the paper, which freezes it.
    coefficients : ModalCoefficients, optional
        Where all this comes from; they tell mass, place and surface.
    tank : Tank, optional
        Its shape.
    """

    modes: LiquidModes
    names: tuple[str, ...]
    origin: Array
    rotation: Array
    relief: Array
    coefficients: ModalCoefficients | None = None
    tank: Tank | None = None

    @classmethod
    def of(
        cls,
        coefficients: ModalCoefficients,
        damping_ratio: Array,
        origin: Array,
        rotation: Array | None = None,
        *,
        tank: Tank | None = None,
    ) -> TankLiquid:
        """
        Take the coefficients of this project.

        Parameters
        ----------
        coefficients : ModalCoefficients
            Of the liquid.
        damping_ratio : array, shape (n,)
            Damping ratio of each mode [-].
        origin : array, shape (3,)
            Position in `base_link` of the tank frame, the centre of its bounding box [m].
        rotation : array, shape (3, 3), optional
            From tank axes to `base_link`.
        tank : Tank, optional
            Its shape; without it the surface is not judged.
        """
        c = coefficients
        turn = np.eye(3) if rotation is None else rotation
        return cls(
            modes=LiquidModes(c.omega, c.mu, c.coupling, np.asarray(damping_ratio, dtype=float)),
            names=c.names,
            origin=origin + turn @ c.liquid.surface_centre,
            rotation=turn,
            relief=c.inertia_frozen - c.inertia_stokes_joukowski,
            coefficients=c,
            tank=tank,
        )

    @classmethod
    def paper(cls, origin: Array, damping_ratio: float = 0.0) -> TankLiquid:
        """
        Take the one mode of Table 4: a cosine, and the inertia of the frozen liquid.

        Parameters
        ----------
        origin : array, shape (3,)
            Position of O, here the axis of the half-full tank, in `base_link` [m].
        damping_ratio : float
            [-].
        """
        tank = cylinder_x(1.125, 14.0)
        liquid, density = tank.filled(1.125), 1000.0
        points = surface_grid(tank.length, tank.height)
        coefficients = ModalCoefficients(
            route='Table 4',
            density=density,
            liquid=liquid,
            names=('x1',),
            omega=TABLE_4.omega,
            mu=TABLE_4.mu,
            coupling=TABLE_4.coupling,
            inertia_stokes_joukowski=density * liquid.inertia,
            wall_friction=None,
            surface_points=points,
            surface_shapes=np.cos(np.pi * (points[:, :1] / tank.length + 0.5)),
        )
        return cls.of(coefficients, np.full(1, float(damping_ratio)), origin, tank=tank)

    @property
    def frozen(self) -> RigidCargo:
        """The same liquid, frozen."""
        c, turn = self.coefficients, self.rotation
        assert c is not None
        about_centroid = c.inertia_frozen - c.mass * _parallel_axis(c.liquid.centroid)
        return RigidCargo(
            c.mass,
            _three(self.origin + turn @ c.liquid.centroid),
            tuple(_three(row) for row in turn @ about_centroid @ turn.T),
        )

    def elevation_max(self, beta: Array) -> Array:
        """Greatest height or depth of the waves (N,), NaN if the shapes are not known [m]."""
        if self.coefficients is None:
            return np.full(len(beta), np.nan)
        highest = np.zeros(len(beta))
        for shape in self.coefficients.surface_shapes:  # the product of all would be huge
            np.maximum(highest, np.abs(beta @ shape), out=highest)
        return highest

    def trust(
        self, time: Array, beta: Array, beta_rate: Array, driving: Array, rate: Array
    ) -> list[Trust]:
        """
        Judge linear theory, as slosh_node does, at each of N instants.

        Parameters
        ----------
        time : array, shape (N,)
            [s].
        beta, beta_rate, driving : array, shape (N, n)
            Modal coordinates, their rates, and the specific force on each mode per modal mass
            [m, m/s, m/s^2].
        rate : array, shape (N, 3)
            Angular rate [rad/s].
        """
        c = self.coefficients
        if c is None or self.tank is None:
            return [UNMOVED] * len(time)
        watch, m = TrustWatch([(self.tank, c)]), self.modes
        damped = m.omega * np.sqrt(1.0 - m.damping_ratio**2)
        envelope = np.hypot(beta, (beta_rate + m.damping_ratio * m.omega * beta) / damped)
        steps = np.diff(time, prepend=time[0]).tolist()
        highest = self.elevation_max(beta)[:, np.newaxis].tolist()
        turning = (rate**2).sum(axis=1).tolist()
        rows = zip(highest, envelope, driving, steps, turning, strict=True)
        return [watch.judge(*row) for row in rows]


@dataclass(frozen=True, eq=False)
class SloshingCargo:
    """
    All sloshing liquid aboard, at `base_link`.

    Attributes
    ----------
    modes : LiquidModes
        Of all tanks; the coupling is about `base_link` and in its axes.
    names : tuple of str
        One for each mode.
    relief : array, shape (3, 3)
        Sum of `I_f - J0` [kg m^2].
    reference : array, shape (3,)
        O of the first tank in `base_link` [m]: the point of the wrenches that are reported.
    tanks : tuple of TankLiquid
        The tanks.
    """

    modes: LiquidModes
    names: tuple[str, ...]
    relief: Array
    reference: Array
    tanks: tuple[TankLiquid, ...]

    @classmethod
    def of(cls, *tanks: TankLiquid) -> SloshingCargo:
        """Gather the liquid of some tanks; of none: nothing sloshes."""
        couplings = [np.empty((0, 6))]
        names: list[str] = []
        relief = np.zeros((3, 3))
        for number, tank in enumerate(tanks, start=1):
            turned = np.hstack(
                [tank.modes.coupling[:, :3] @ tank.rotation.T,
                 tank.modes.coupling[:, 3:] @ tank.rotation.T]
            )  # fmt: skip
            turned[:, 3:] += np.cross(tank.origin, turned[:, :3])
            couplings.append(turned)
            prefix = f'{number}_' if len(tanks) > 1 else ''
            names += [prefix + name for name in tank.names]
            relief = relief + tank.rotation @ tank.relief @ tank.rotation.T
        modes = LiquidModes(
            omega=_joined([t.modes.omega for t in tanks]),
            mu=_joined([t.modes.mu for t in tanks]),
            coupling=np.vstack(couplings),
            damping_ratio=_joined([t.modes.damping_ratio for t in tanks]),
        )
        reference = tanks[0].origin if tanks else np.zeros(3)
        return cls(modes, tuple(names), relief, reference, tanks)

    @classmethod
    def none(cls) -> SloshingCargo:
        """Give a solid cargo: nothing sloshes."""
        return cls.of()

    @classmethod
    def settled(cls, surface_moment: Array) -> SloshingCargo:
        """
        Give a liquid of which only the hydrostatic moments are known: right once it has settled.

        Parameters
        ----------
        surface_moment : array, shape (2,)
            As of `surface_moment` [kg m].
        """
        # omega = 1 and lambda = mu: then g lambda^2 / (mu omega^2) is g mu
        there = np.flatnonzero(surface_moment)
        weight = surface_moment[there] / GRAVITY
        n = len(there)
        coupling = np.zeros((n, 6))
        coupling[range(n), there] = weight
        modes = LiquidModes(np.ones(n), weight, coupling, np.zeros(n))
        names = tuple(('surge', 'sway')[k] for k in there)
        return cls(modes, names, np.zeros((3, 3)), np.zeros(3), ())

    @property
    def feed_through(self) -> Array:
        """(6, 6): wrench of `I_f - J0` at `base_link` per acceleration (s, alpha)."""
        matrix = np.zeros((6, 6))
        matrix[3:, 3:] = self.relief
        return matrix

    @property
    def coupling(self) -> Array:
        """
        A (6, 6) at `base_link`: all that an acceleration (s, alpha) feeds through to the wrench.

        `sum lambda lambda^T / mu`, and the relief of the inertia. It goes with the state wrench.
        """
        c = self.modes.coupling
        return np.asarray((c.T / self.modes.mu) @ c + self.feed_through)

    def state_wrench(self, beta: Array, beta_rate: Array) -> Array:
        """Sloshing wrench (..., 6) at `base_link` without what accelerations feed through."""
        m = self.modes
        pull = m.omega**2 * beta + 2.0 * m.damping_ratio * m.omega * beta_rate
        return np.asarray(pull @ m.coupling + beta @ m.tilt)

    @property
    def surface_moment(self) -> Array:
        """
        Hydrostatic moments (2,) of the free surface, about y and about x [kg m].

        `sum g lambda^2 / (mu omega^2)`, that is `rho I_xx` and `rho I_yy` if all modes are kept.
        """
        softening = np.diag(self.modes.softening)
        return softening[[4, 3]] / GRAVITY

    def elevation_max(self, beta: Array) -> Array:
        """
        Greatest height or depth of the waves against the mean level.

        Parameters
        ----------
        beta : array, shape (N, n)
            Modal coordinates [m].

        Returns
        -------
        array, shape (N,)
            NaN where a tank does not tell its mode shapes [m].
        """
        heights = [tank.elevation_max(part) for tank, part in self._parts(beta)]
        return np.max(heights, axis=0) if heights else np.zeros(len(beta))

    def trust(
        self, time: Array, beta: Array, beta_rate: Array, specific_force: Array, rate: Array
    ) -> tuple[Trust, ...]:
        """
        Judge linear theory at each of N instants, in the tank where it is nearest its end.

        Parameters
        ----------
        time : array, shape (N,)
            [s].
        beta, beta_rate : array, shape (N, n)
            Modal coordinates and their rates [m, m/s].
        specific_force, rate : array, shape (N, 3)
            Of `base_link` [m/s^2, rad/s].
        """
        worst = [UNMOVED] * len(time)
        driving = specific_force @ self.modes.coupling[:, :3].T / self.modes.mu
        parts = (self._parts(values) for values in (beta, beta_rate, driving))
        for (tank, here), (_, moving), (_, driven) in zip(*parts, strict=True):
            judged = tank.trust(time, here, moving, driven, rate)
            worst = [max(pair, key=Trust.use) for pair in zip(worst, judged, strict=True)]
        return tuple(worst)

    def _parts(self, beta: Array) -> list[tuple[TankLiquid, Array]]:
        if beta.shape[1] != len(self.modes.omega):
            raise InputError(f'{beta.shape[1]} coordinates for {len(self.modes.omega)} modes')
        ends = np.cumsum([len(tank.modes.omega) for tank in self.tanks])
        parts = np.split(beta, ends, axis=1)[:-1]
        return list(zip(self.tanks, parts, strict=True))


def _parallel_axis(arm: Array) -> Array:
    """Inertia (3, 3) of a unit mass at the end of an arm (3,) [m^2]."""
    return np.asarray(arm @ arm * np.eye(3) - np.outer(arm, arm))


def _three(vector: Array) -> Three:
    x, y, z = vector.tolist()
    return x, y, z


def _joined(parts: Sequence[Array]) -> Array:
    return np.concatenate(parts) if parts else np.empty(0)
