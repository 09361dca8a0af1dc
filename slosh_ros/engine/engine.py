"""The engine: motion samples in, loads out. The same code live and offline."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.engine.config import SloshConfig, TankConfig
from slosh_ros.engine.gate import SampleGate, Verdict
from slosh_ros.engine.kinematics import AccelerationFilter, Lever, Pose, centripetal
from slosh_ros.engine.sample import MotionSample
from slosh_ros.modal.carried import CarriedLiquid
from slosh_ros.modal.integrator import ModalIntegrator
from slosh_ros.modal.loads import LoadMatrices, wrench_transform
from slosh_ros.modal.pressure import PressureMatrices
from slosh_ros.modal.validity import UNMOVED, Trust, TrustWatch

Array = NDArray[np.float64]

_NOWHERE = np.zeros(0)  # no points of pressure
_AT_REST = np.array([0.0, 0.0, GRAVITY])  # specific force of a level vehicle [m/s^2]
GRAVITY_MEMORY = 1.0  # [s] over which the mean specific force is watched
GRAVITY_TOLERANCE = 4.0  # [m/s^2] more than a truck brakes, less than any wrong mount or unit


@dataclass(frozen=True, eq=False)
class Loads:
    """
    What the liquid does to the tanks at one instant.

    Wrenches are force [N] and moment [N m] stacked, in the axes and about the origin of the
    output frame.

    Attributes
    ----------
    sample : MotionSample
        The sample that led to them, as given; the loads bear its stamp.
    wrench : array, shape (6,)
        Sloshing part, eqs (15)-(20): zero for a frozen liquid.
    total : array, shape (6,)
        Everything: weight, rigid part with the Stokes-Joukowski inertia, sloshing.
    state : array, shape (6,)
        Sloshing part without feed-through of acceleration.
    elevation_max : float
        Largest height or depth of the wave against the mean level [m].
    trust : Trust
        What takes most of the room of linear theory.
    pressure : array, shape (p,)
        Pressure at the points of `SloshConfig.pressure_points`, less the hydrostatic pressure of
        the level tank at rest [Pa].
    """

    sample: MotionSample
    wrench: Array
    total: Array
    state: Array
    elevation_max: float
    trust: Trust
    pressure: Array

    @property
    def stamp(self) -> int:
        """Time of the sample [ns]."""
        return self.sample.stamp

    @property
    def valid(self) -> bool:
        """Whether the motion is mild enough for linear theory."""
        return self.trust.valid


class SloshEngine:
    """
    Integrates the liquid in all tanks of a vehicle, one motion sample at a time.

    Parameters
    ----------
    config : SloshConfig
        The vehicle's tanks and its sensor. The modal coefficients are solved for here.
    """

    def __init__(self, config: SloshConfig) -> None:
        self.config = config
        self.gate = SampleGate(config.gate)
        self.warnings: Counter[str] = Counter()
        self.tanks = tuple(
            TankModel(tank, config.sensor, config.output_frame) for tank in config.tanks
        )
        self._acceleration = AccelerationFilter(config.loads_cutoff)
        self._mean_force = np.zeros(3)  # of an IMU, in base_link
        self._mean_over = 0.0  # [s]

    @property
    def carried(self) -> CarriedLiquid:
        """All liquid, as a simulator of the vehicle has to know it, in the output frame."""
        first, *others = (tank.carried for tank in self.tanks)
        return sum(others, start=first)

    @property
    def surface_centre(self) -> Array:
        """O, the centre of the mean free surface of the first tank, in the output frame [m]."""
        return self.tanks[0].surface_centre

    @property
    def rigid(self) -> Array:
        """Wrench of weight and inertia per acceleration of the output frame, shape (6, 6)."""
        return np.asarray(np.sum([tank.rigid for tank in self.tanks], axis=0))

    @property
    def settled(self) -> Array:
        """Sloshing wrench of a settled liquid per constant specific force, shape (6, 3)."""
        return np.asarray(np.sum([tank.settled for tank in self.tanks], axis=0))

    @property
    def softening(self) -> Array:
        """
        Stiffness that the free surfaces take from a vehicle, shape (6, 6) [N m/rad].

        Sloshing wrench of a settled liquid per small displacement and rotation of the output
        frame, whose tilt is a specific force `g (-pitch, roll)`.
        """
        matrix, settled = np.zeros((6, 6)), self.settled
        matrix[:, 3], matrix[:, 4] = GRAVITY * settled[:, 1], -GRAVITY * settled[:, 0]
        return matrix

    @property
    def centre_of_mass(self) -> Array:
        """
        Mass centre of all liquid as it sloshes, in the output frame (3,) [m]; NaN without liquid.

        To first order in the wave: it moves along the mean free surface only.
        """
        mass = sum(tank.coefficients.mass for tank in self.tanks)
        moment = np.sum([tank.mass_moment for tank in self.tanks], axis=0)
        return moment / mass if mass else np.full(3, np.nan)

    def reset(self) -> None:
        """Forget the motion: the next good sample finds the liquid at rest."""
        self.gate.reset()

    def feed(self, sample: MotionSample) -> tuple[Verdict, Loads | None]:
        """
        Take one sample.

        Parameters
        ----------
        sample : MotionSample
            In sensor axes, of the sensor's point.

        Returns
        -------
        verdict : Verdict
            What the gate decided.
        loads : Loads or None
            Loads at the sample's stamp; None if it was rejected.
        """
        verdict, interval = self.gate.judge(sample)
        if not verdict.accepted:
            return verdict, None
        continuous = verdict is Verdict.ACCEPTED
        given, sample = sample, self.config.unbiased(sample)
        if self.config.source == 'imu':
            self._watch_gravity(sample.force, interval)
        motion = np.stack([sample.force, sample.velocity, sample.rate])
        acceleration = self._acceleration.follow(motion, interval if continuous else 0.0)
        wrench, total, state = np.zeros(6), np.zeros(6), np.zeros(6)
        elevation_max, trust = 0.0, UNMOVED
        pressures = []
        for tank in self.tanks:
            tank.take(motion, interval, verdict)
            at_surface = tank.at_surface(sample.rate, acceleration)
            parts = tank.loads(at_surface)
            wrench, total, state = wrench + parts[0], total + parts[1], state + parts[2]
            pressures.append(tank.pressure(at_surface))
            elevation = tank.elevation_max()
            elevation_max = max(elevation_max, elevation)
            trust = max(trust, tank.trust(elevation, interval, sample.rate), key=Trust.use)
        pressure = pressures[0] if len(pressures) == 1 else np.concatenate(pressures)
        return verdict, Loads(given, wrench, total, state, elevation_max, trust, pressure)

    def _watch_gravity(self, force: Array, interval: float) -> None:
        """Count a warning while the mean specific force is not gravity, upwards."""
        force = self.config.imu.rotation @ force
        if interval == 0.0:
            self._mean_force, self._mean_over = force, 0.0
            return
        keep = math.exp(-interval / GRAVITY_MEMORY)
        self._mean_force = force + keep * (self._mean_force - force)
        self._mean_over += interval
        error = self._mean_force - _AT_REST
        if self._mean_over > GRAVITY_MEMORY and error @ error > GRAVITY_TOLERANCE**2:
            self.warnings[
                'mean specific force far from (0, 0, +9.81) m/s^2 in base_link: the IMU must '
                'include gravity (REP-145), in m/s^2; check imu.rpy'
            ] += 1


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
    """

    def __init__(self, config: TankConfig, sensor: Pose, output_frame: str) -> None:
        self.config = config
        c = self.coefficients = config.coefficients()
        at_surface = config.pose.offset(c.liquid.surface_centre)
        self._lever = Lever(sensor.seen_from(at_surface))  # of the sensor about O, in tank axes

        # lambda^P_k = lambda_k - (r_P x lambda_T)_k: coupling about the sensor's point, THEORY 2.1
        force = c.coupling[:, :3]
        about_sensor = c.coupling[:, 3:] - np.cross(self._lever.arm, force)
        self._force_gain = force / c.mu[:, None]
        self._carried_gain = np.hstack([force, about_sensor]) / c.mu[:, None]

        output = config.pose if output_frame == 'tank_link' else Pose.identity()
        out = at_surface.seen_from(output)
        transform = wrench_transform(out.rotation, out.origin)
        self.damping_ratio = config.damping_ratio(c)
        self._loads = LoadMatrices.of(c, self.damping_ratio).moved(transform)
        self.carried = CarriedLiquid.of(c).moved(transform)
        self.surface_centre = out.origin
        self._rest_moment = c.mass * (out.origin + out.rotation @ c.liquid.centroid)
        self._moment = out.rotation @ force.T
        self.rigid = self._loads.rigid @ transform.T
        tilted = -self._force_gain / c.omega[:, None] ** 2  # beta per specific force, at rest
        self.settled = (
            self._loads.stiffness @ tilted + self._loads.coupling[:, :3]
        ) @ out.rotation.T
        self._modes = ModalIntegrator(c.omega, self.damping_ratio)
        self._watch = TrustWatch(config.tank, c)
        self._driving: Array = np.zeros(len(c.omega))
        self._at_surface: Array = np.zeros(6)
        self._pressure: PressureMatrices | None = None
        if config.pressure_points:
            points = config.points_of_pressure(c.liquid)
            self._pressure = PressureMatrices.of(c, self.damping_ratio, points)

    @property
    def beta(self) -> Array:
        """Modal coordinates [m], shape (n,)."""
        return self._modes.beta

    @property
    def beta_rate(self) -> Array:
        """Modal velocities [m/s], shape (n,)."""
        return self._modes.beta_rate

    def take(self, motion: Array, interval: float, verdict: Verdict) -> None:
        """
        Move the liquid to the instant of a sample.

        Parameters
        ----------
        motion : array, shape (3, 3)
            Force, velocity and rate of the sample, a row each, in sensor axes.
        interval : float
            Time since the last sample [s].
        verdict : Verdict
            How the sample was accepted.
        """
        force, velocity, rate = motion @ self._lever.rotation.T
        driving = self._force_gain @ (force - centripetal(rate, self._lever.arm))
        carried = self._carried_gain @ np.concatenate([velocity, rate])
        self._driving = driving
        if verdict.from_rest:
            self._modes.start(driving, carried)
            self._watch.start()
        elif verdict is Verdict.COASTED:
            self._modes.coast(interval, driving, carried)
        else:
            self._modes.advance(interval, driving, carried)

    def at_surface(self, rate: Array, acceleration: Array) -> Array:
        """
        Specific force and angular acceleration of O in tank axes, shape (6,).

        Parameters
        ----------
        rate : array, shape (3,)
            Angular rate, in sensor axes.
        acceleration : array, shape (2, 3)
            Specific force of the sensor's point and angular acceleration, in sensor axes.
        """
        self._at_surface = self._lever.carried(rate, acceleration)
        return self._at_surface

    @property
    def wrench(self) -> Array:
        """Sloshing wrench of this tank at the sample last taken, in the output frame, (6,)."""
        return self.loads(self._at_surface)[0]

    @property
    def mass_moment(self) -> Array:
        """
        Mass times mass centre at the sample last taken, in the output frame, (3,) [kg m].

        The wave carries rho times the integral of (x, y) f_j dS, eqs (11) and (12), per beta_j:
        m c + sum of lambda_T beta. Its second derivative is the sloshing force, reversed.
        """
        return np.asarray(self._rest_moment + self._moment @ self.beta)

    def loads(self, at_surface: Array) -> tuple[Array, Array, Array]:
        """Wrenches at the sample last taken: sloshing, total, sloshing without feed-through."""
        state = self._loads.state(self.beta, self.beta_rate)
        wrench = state + self._loads.coupling @ at_surface
        return wrench, wrench + self._loads.rigid @ at_surface, state

    def pressure(self, at_surface: Array) -> Array:
        """Pressure at the tank's points at the sample last taken, shape (p,) [Pa]."""
        if self._pressure is None:
            return _NOWHERE
        return self._pressure.at(self.beta, self.beta_rate, at_surface)

    def trust(self, elevation: float, interval: float, rate: Array) -> Trust:
        """
        Judge linear theory at the sample last taken.

        Parameters
        ----------
        elevation : float
            Of `elevation_max` [m].
        interval : float
            Time since the sample before [s].
        rate : array, shape (3,)
            Angular rate [rad/s].
        """
        return self._watch.judge(elevation, self._modes.envelope, self._driving, interval, rate)

    def elevation_max(self) -> float:
        """Largest height or depth of the wave over the mean free surface [m]."""
        heights = np.abs(self.coefficients.surface_shapes @ self.beta)
        return float(heights.max(initial=0.0))
