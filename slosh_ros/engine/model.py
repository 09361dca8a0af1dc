"""
What is constant while the fills are: from motion to the modes, and from the modes to the loads.

All of it is linear in the motion of the sensor if the squares and products of its angular rate
are taken for inputs of their own. So a sample costs a few products with small matrices, of all
tanks at once.

Effective gravity. Where the measured vertical specific force s_z takes the place of g, all
frequencies change with its root, and stiffness, damping and pressure of the waves with them
(THEORY 2.1): a leaning tank settles at the slope s_x/s_z, its moment is that of hydrostatics to
second order in the slope, and heave acts parametrically. It is s_z of the sensor's point, along
the z axis of each tank; angular and centripetal acceleration between sensor and tank are left
out, so that nothing is differentiated. Over an interval its mean acts. The theory stays linear in
the waves, its coefficients are those of a level surface, and gravity does not go through zero:
below `LEAST_GRAVITY` the waves move as under that, and a warning is counted.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.engine.config import TankConfig
from slosh_ros.engine.kinematics import Lever, Pose, centripetal_matrix
from slosh_ros.hydro import ModalCoefficients
from slosh_ros.modal.carried import CarriedLiquid
from slosh_ros.modal.heights import WaveHeights
from slosh_ros.modal.integrator import ModalIntegrator
from slosh_ros.modal.loads import LoadMatrices, wrench_transform
from slosh_ros.modal.pressure import PressureMatrices

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# Motion of the sensor, in its axes: force, velocity, rate, and the products of the rate
FORCE, VELOCITY, RATE, PRODUCTS = (slice(a, b) for a, b in ((0, 3), (3, 6), (6, 9), (9, 15)))
MOTION = 15
# Its acceleration: specific force, angular acceleration, and the products of the rate
ACCELERATION = 12
# Least effective gravity, of the standard one. Below it, in a hop, surface waves are no more what
# holds the liquid together, and linear theory has left; the frequencies stay finite.
LEAST_GRAVITY = 0.05


class TankModel:
    """
    The liquid of one tank, driven by the sensor.

    Parameters
    ----------
    config : TankConfig
        The tank.
    sensor : Pose
        Of the sensor in base_link.
    output_frame : str
        `base_link` or `tank_link`.
    coefficients : ModalCoefficients, optional
        Of the liquid in it, if they are not those of the configured fill.
    share : float
        Which share of the modes has not faded towards an end of the fill.

    Attributes
    ----------
    force, carried_along : array, shape (n, 15)
        Modal forcing per modal mass, and velocity carried along, per motion of the sensor.
    vertical : array, shape (3,)
        Its z axis, in axes of the sensor.
    state : array, shape (6, 2 n)
        Wrench without feed-through per real and imaginary part of the modes' waves. Under another
        gravity, stiffness changes with it and damping with its root, as much as if the waves
        themselves changed with the root; so do those of the pressure.
    feedthrough, weight : array, shape (6, 12)
        Rest of the sloshing wrench, and that of the rigid part, per acceleration of the sensor.
    pressure : array, shape (p, 2 n + 12)
        Pressure at the tank's points per waves and acceleration, but for a constant.
    """

    def __init__(
        self,
        config: TankConfig,
        sensor: Pose,
        output_frame: str,
        coefficients: ModalCoefficients | None = None,
        share: float = 1.0,
    ) -> None:
        self.config = config
        self._output_frame, self.share_left = output_frame, share
        c = self.coefficients = coefficients or config.coefficients()
        self.damping_ratio = config.damping_ratio(c)
        at_surface = config.pose.offset(c.liquid.surface_centre)
        lever = Lever(sensor.seen_from(at_surface))  # of the sensor about O, in tank axes
        turn = lever.rotation
        self.vertical = turn[2]
        centripetal = turn @ centripetal_matrix(turn.T @ lever.arm)

        # lambda^P_k = lambda_k - (r_P x lambda_T)_k: coupling about the sensor's point, THEORY 2.1
        force = c.coupling[:, :3]
        about_sensor = c.coupling[:, 3:] - np.cross(lever.arm, force)
        gain = force / c.mu[:, None]
        self.force = np.zeros((len(c.omega), MOTION))
        self.force[:, FORCE] = gain @ turn
        self.force[:, PRODUCTS] = -gain @ centripetal
        self.carried_along = np.zeros_like(self.force)
        self.carried_along[:, VELOCITY] = gain @ turn
        self.carried_along[:, RATE] = about_sensor / c.mu[:, None] @ turn

        # acceleration of O in tank axes; O lies at -arm from the sensor's point
        acceleration = np.zeros((6, ACCELERATION))
        acceleration[:3, :3] = acceleration[3:, 3:6] = turn
        acceleration[:3, 3:6] = lever.cross @ turn
        acceleration[:3, 6:] = -centripetal

        output = config.pose if output_frame == 'tank_link' else Pose.identity()
        out = at_surface.seen_from(output)
        transform = wrench_transform(out.rotation, out.origin)
        loads = LoadMatrices.of(c, self.damping_ratio).moved(transform)
        self.state = self._of_waves(loads.stiffness, loads.damping)
        self.feedthrough = loads.coupling @ acceleration
        self.weight = loads.rigid @ acceleration

        self.carried = CarriedLiquid.of(c).moved(transform)
        self.surface_centre = out.origin
        self._rest_moment = c.mass * (out.origin + out.rotation @ c.liquid.centroid)
        self._moment = out.rotation @ force.T
        self.rigid = loads.rigid @ transform.T
        tilted = -gain / c.omega[:, None] ** 2  # beta per specific force, at rest
        self.settled = (loads.stiffness @ tilted + loads.coupling[:, :3]) @ out.rotation.T

        points = config.points_of_pressure(c.liquid)
        self.pressure = np.zeros((len(points), 2 * len(c.omega) + ACCELERATION))
        self.pressure_at_rest: Array = np.zeros(len(points))
        if len(points):
            p = PressureMatrices.of(c, self.damping_ratio, points)
            self.pressure = np.hstack(
                [self._of_waves(p.stiffness, p.damping), p.acceleration @ acceleration]
            )
            self.pressure_at_rest = GRAVITY * p.acceleration[:, 2]

    def seen_by(self, sensor: Pose) -> TankModel:
        """Take another sensor in place of this one."""
        return TankModel(
            self.config, sensor, self._output_frame, self.coefficients, self.share_left
        )

    def share(
        self, modes: ModalIntegrator, part: slice, waves: ComplexArray, accelerating: Array
    ) -> None:
        """Tell which part of which modes moves in this tank, and how the sensor accelerates."""
        self._modes, self._part = modes, part
        self._waves, self._accelerating = waves[part], accelerating

    @property
    def beta(self) -> Array:
        """Modal coordinates [m], shape (n,)."""
        return self._modes.beta[self._part]

    @property
    def beta_rate(self) -> Array:
        """Modal velocities [m/s], shape (n,)."""
        return self._modes.beta_rate[self._part]

    @property
    def wrench(self) -> Array:
        """Sloshing wrench of this tank at the sample last taken, in the output frame, (6,)."""
        waves = self._waves.view(float)
        return np.asarray(self.state @ waves + self.feedthrough @ self._accelerating)

    @property
    def mass_moment(self) -> Array:
        """
        Mass times mass centre at the sample last taken, in the output frame, (3,) [kg m].

        The wave carries rho times the integral of (x, y) f_j dS, eqs (11) and (12), per beta_j:
        m c + sum of lambda_T beta. Its second derivative is the sloshing force, reversed.
        """
        return np.asarray(self._rest_moment + self._moment @ self.beta)

    def _of_waves(self, stiffness: Array, damping: Array) -> Array:
        """
        Turn what is per modal coordinate and velocity into what is per wave.

        See :attr:`slosh_ros.modal.ModalIntegrator.wave`: real and imaginary part stand side by
        side, mode by mode.
        """
        zeta = self.damping_ratio
        damped = self.coefficients.omega * np.sqrt(1.0 - zeta**2)
        decay = self.coefficients.omega * zeta
        imaginary = (stiffness - damping * decay) / damped
        return np.stack([damping, imaginary], axis=2).reshape(len(stiffness), -1)


class VehicleModel:
    """
    The liquid of all tanks as one.

    Parameters
    ----------
    config : SloshConfig
        The vehicle.
    tanks : tuple of TankModel
        The tanks of a vehicle.

    Attributes
    ----------
    parts : tuple of slices
        The modes of each tank among those of all.
    omega, damping_ratio : array, shape (n,)
        Of all modes.
    drive : array, shape (4 n, 15)
        Forcing of all modes, velocity carried along, and what drives their amplitudes, real and
        imaginary part side by side, per motion of the sensor.
    output : array, shape (18, 2 n + 12)
        Wrench without feed-through, sloshing wrench and total wrench per waves and acceleration.
    pressure : array, shape (p, 2 n + 12)
        Pressure at the points of all tanks, but for a constant.
    heights : WaveHeights
        Of all tanks.
    vertical : array, shape (k, 3)
        The z axes of the tanks, in axes of the sensor; one if all have the same.
    """

    def __init__(self, tanks: tuple[TankModel, ...]) -> None:
        self.tanks = tanks
        ends = np.cumsum([0, *(len(tank.damping_ratio) for tank in tanks)]).tolist()
        self.parts = tuple(slice(a, b) for a, b in itertools.pairwise(ends))
        n = ends[-1]
        self.omega = np.concatenate([tank.coefficients.omega for tank in tanks])
        self.damping_ratio = np.concatenate([tank.damping_ratio for tank in tanks])
        force = np.vstack([tank.force for tank in tanks])
        carried = np.vstack([tank.carried_along for tank in tanks])
        amplitudes = ModalIntegrator(self.omega, self.damping_ratio).drive_of(force, carried)
        parts = np.stack([amplitudes.real, amplitudes.imag], axis=1).reshape(-1, MOTION)
        self.drive = np.vstack([force, carried, parts])
        self.output = np.zeros((18, 2 * n + ACCELERATION))
        waves, rest = self.output[:, : 2 * n], self.output[:, 2 * n :]
        waves[:6] = waves[6:12] = waves[12:] = np.hstack([tank.state for tank in tanks])
        feedthrough = np.sum([tank.feedthrough for tank in tanks], axis=0)
        rest[6:12] = feedthrough
        rest[12:] = feedthrough + np.sum([tank.weight for tank in tanks], axis=0)
        points = sum(len(tank.pressure) for tank in tanks)
        self.pressure = np.zeros((points, 2 * n + ACCELERATION))
        row = 0
        for part, tank in zip(self.parts, tanks, strict=True):
            rows = slice(row, row := row + len(tank.pressure))
            own = 2 * (part.stop - part.start)
            self.pressure[rows, 2 * part.start : 2 * part.stop] = tank.pressure[:, :own]
            self.pressure[rows, 2 * n :] = tank.pressure[:, own:]
        self.pressure_at_rest = np.concatenate([tank.pressure_at_rest for tank in tanks])
        self.vertical = np.array([tank.vertical for tank in tanks])
        if np.all(np.abs(self.vertical - self.vertical[0]) < 1e-12):
            self.vertical = self.vertical[:1]
        self._counts = [part.stop - part.start for part in self.parts]
        self.heights = WaveHeights([tank.coefficients.surface_shapes for tank in tanks])

    def gravity(self, force: Sequence[float]) -> tuple[float | Array, bool]:
        """
        Return the effective gravity over the standard one, and whether it had to be raised.

        Parameters
        ----------
        force : sequence of 3 floats
            Specific force, in axes of the sensor [m/s^2].

        Returns
        -------
        float or array, shape (n,)
            Of all modes or one a mode; `LEAST_GRAVITY` at least.
        bool
            Whether that is more than measured in one of the tanks.
        """
        measured: list[float] = (self.vertical @ force / GRAVITY).tolist()
        taken = [max(LEAST_GRAVITY, one) for one in measured]
        if len(taken) == 1:
            return taken[0], taken != measured
        return np.repeat(taken, self._counts), taken != measured

    def forcing(self, motion: Array) -> tuple[Array, Array]:
        """Modal forcing and velocity carried along, (n,) each, of a motion of the sensor (15,)."""
        n = len(self.omega)
        driven = self.drive[: 2 * n] @ motion
        return driven[:n], driven[n:]
