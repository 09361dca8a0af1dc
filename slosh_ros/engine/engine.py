"""The engine: motion samples in, loads out. The same code live and offline."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY
from slosh_ros.engine.config import SloshConfig
from slosh_ros.engine.fill import Books, LiveFill, carried_over, checked_ratio
from slosh_ros.engine.gate import SampleGate, Verdict
from slosh_ros.engine.kinematics import AccelerationFilter, HighPass, Pose, products
from slosh_ros.engine.loads import Loads, LoadsBlock
from slosh_ros.engine.model import ACCELERATION, LEAST_GRAVITY, MOTION, TankModel, VehicleModel
from slosh_ros.engine.sample import MotionSample
from slosh_ros.errors import InputError
from slosh_ros.modal.carried import CarriedLiquid
from slosh_ros.modal.integrator import ModalIntegrator, each
from slosh_ros.modal.validity import TrustWatch

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# NumPy 1 rounds products of many complex numbers otherwise than those of a few
AT_ONCE = np.lib.NumpyVersion(np.__version__) >= '2.0.0'
_NOWHERE = np.zeros(0)  # no points of pressure
GRAVITY_MEMORY = 1.0  # [s] over which the mean specific force is watched
GRAVITY_TOLERANCE = 4.0  # [m/s^2] more than a truck brakes, less than any wrong mount or unit


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
        self._acceleration = AccelerationFilter(config.loads_cutoff)
        self._turn_to(config.imu)
        self._measured_gravity = config.measured_gravity and config.source == 'imu'
        self._gravity: float | Array = 1.0  # over the standard one, at the last sample
        self._mean_force = (0.0, 0.0, 0.0)
        self._mean_over = 0.0  # [s]
        self._use(
            VehicleModel(
                tuple(TankModel(tank, config.sensor, config.output_frame) for tank in config.tanks)
            )
        )
        self._fills = {
            tank.config.name: LiveFill(tank.config, tank.coefficients) for tank in self.tanks
        }
        # as they are set: through the depth they come back with rounding
        self._ratios = {
            tank.config.name: round(tank.coefficients.liquid.fill_ratio, 12) for tank in self.tanks
        }
        self._wanted: dict[str, TankModel] = {}  # what the next sample finds changed
        self.books = {tank.config.name: Books(tank.coefficients.mass) for tank in self.tanks}

    def _turn_to(self, imu: Pose) -> None:
        """Take the axes of the IMU."""
        self._upwards = (imu.rotation.T @ [0.0, 0.0, GRAVITY]).tolist()
        corner = self.config.high_pass if self.config.source == 'imu' else 0.0
        self._high_pass = HighPass(corner, imu.rotation[2]) if corner else None

    def _use(self, model: VehicleModel) -> None:
        """Take up a model, its liquid at rest."""
        self._model = model
        self._modes = ModalIntegrator(model.omega, model.damping_ratio)
        self._watch = TrustWatch([(tank.config.tank, tank.coefficients) for tank in model.tanks])
        self.tanks = model.tanks
        self._motion: Array = np.zeros(MOTION)
        # waves, and the acceleration of the sensor
        self._moving: Array = np.zeros(2 * len(model.omega) + ACCELERATION)
        self._waves = self._moving[:-ACCELERATION].view(complex)
        self._accelerating = self._moving[-ACCELERATION:]
        for tank, part in zip(model.tanks, model.parts, strict=True):
            tank.share(self._modes, part, self._waves, self._accelerating)

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

    def mount(self, imu: Pose) -> None:
        """Take another pose of the IMU in base_link; the liquid starts from rest."""
        config = self.config = replace(self.config, imu=imu)
        self._turn_to(imu)
        self._use(VehicleModel(tuple(tank.seen_by(config.sensor) for tank in self.tanks)))
        self._wanted = {name: tank.seen_by(config.sensor) for name, tank in self._wanted.items()}
        self.reset()

    @property
    def mass(self) -> float:
        """Mass of the liquid in all tanks [kg]."""
        return sum(tank.coefficients.mass for tank in self.tanks)

    def fill_ratio(self, tank: str) -> float:
        """Fraction of the volume of a tank that is filled, as from the next sample on."""
        return self._ratios[tank]

    def prepare_fills(self) -> None:
        """
        Make :meth:`set_fill` fast in all tanks; takes seconds the first time, in any thread.

        The work is done by a process of its own (`slosh_ros.apart`), so that the
        samples of another thread go on.

        Raises
        ------
        InputError
            If the liquid of a tank cannot be tabulated, as it cannot be computed at some fill;
            :meth:`set_fill` then solves for each fill by itself.
        """
        failures = []
        for fill in self._fills.values():
            if fill.changeable:
                try:
                    fill.prepare(elsewhere=True)
                except InputError as error:
                    failures.append(error)
        if failures:
            raise failures[0]

    def solve_fill(self, tank: str, ratio: float) -> None:
        """
        Make :meth:`set_fill` fast for one fill, before it is so for all; in any thread.

        It takes as long as the start, some seconds at most of many tanks, in a process of its own.

        Raises
        ------
        InputError
            If the liquid cannot be computed there.
        """
        self._fills[tank].solve_alone(ratio)

    def fill_known(self, tank: str, ratio: float) -> bool:
        """Whether :meth:`set_fill` of that fill takes no more than some milliseconds."""
        return self._fills[tank].knows(ratio)

    def fill_errors(self) -> dict[str, tuple[float, float]]:
        """
        Return how far coefficients at other fills are known, of tanks that are interpolated.

        Returns
        -------
        dict
            By the name of the tank, largest relative error of the interpolation against solutions,
            and of these as far as they tell (else 0); nothing before :meth:`prepare_fills`.
        """
        return {
            name: (fill.error, fill.solution_error)
            for name, fill in self._fills.items()
            if fill.error
        }

    def checked_fill(self, tank: str, ratio: object) -> float:
        """
        Return a fill that :meth:`set_fill` takes.

        Raises
        ------
        InputError
            If there is no such tank, the ratio is none, or the tank can only have one fill.
        """
        checked = checked_ratio(tank, ratio, list(self._fills))
        fill = self._fills[tank]
        if checked != self._ratios[tank] and not fill.changeable:
            fill.prepare()  # tells why
        return checked

    def set_fill(self, tank: str, ratio: float) -> bool:
        """
        Fill or drain a tank; the next sample finds it so.

        The liquid goes on moving: see :mod:`slosh_ros.engine.fill`. Without
        :meth:`prepare_fills`, the first change may take seconds. To set the fill that it has
        makes it as tabulated where it was solved for by :meth:`solve_fill`.

        Parameters
        ----------
        tank : str
            Its name.
        ratio : float
            Fraction of its volume, 0 (empty) to 1 (full).

        Returns
        -------
        bool
            Whether that changes anything.

        Raises
        ------
        InputError
            If there is no such tank, the ratio is none, or the tank can only have one fill.
        """
        ratio = self.checked_fill(tank, ratio)
        fill, config = self._fills[tank], self.config
        if ratio == self._ratios[tank] and not fill.outdated:
            return False
        coefficients, share = fill.at(ratio)
        self._wanted[tank] = TankModel(
            fill.config, config.sensor, config.output_frame, coefficients, share
        )
        self._ratios[tank] = ratio
        return True

    def _refill(self) -> None:
        """Bring about the fills that are wanted, between two samples."""
        changed = [self._wanted.get(tank.config.name, tank) for tank in self.tanks]
        model, motion = VehicleModel(tuple(changed)), self._motion
        force, carried = model.forcing(motion)
        gravity = self._gravity
        if self._measured_gravity:
            gravity = self._gravity = model.gravity(motion[:3].tolist())[0]
        settled = -force / (gravity * model.omega**2)
        waves = [
            carried_over(old, new, settled[part])
            for old, new, part in zip(self.tanks, changed, model.parts, strict=True)
        ]
        beta, beta_rate = np.concatenate(waves, axis=1)
        for old, new in zip(self.tanks, changed, strict=True):
            change = new.coefficients.mass - old.coefficients.mass
            self.books[old.config.name].enter(change)
        watch = self._watch
        self._use(model)
        self._watch.resume(watch)
        self._motion[:] = motion
        self._modes.under(gravity)
        self._modes.put(beta, beta_rate, force, carried)
        self._wanted = {}

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
        motion = self.config.unbiased(sample).values
        if self.config.source == 'imu':
            self._watch_gravity((motion[:3],), (interval,))
        turning: tuple[float, ...] = products(*motion[6:])
        spin = turning[0] + turning[1] + turning[2]
        if self._high_pass is not None:
            passed = self._high_pass.follow(motion + turning, interval)
            motion, turning = tuple(passed[:9]), tuple(passed[9:])
        followed = self._acceleration.follow(
            motion, interval if verdict is Verdict.ACCEPTED else 0.0
        )
        if self._wanted:
            self._refill()
        self._motion[:] = motion + turning
        self._accelerating[:] = followed + turning

        model, modes, watch, n = self._model, self._modes, self._watch, len(self._model.omega)
        drive = np.matmul(model.drive, self._motion)
        force, carried = drive[:n], drive[n : 2 * n]
        amplitudes: ComplexArray | None = drive[2 * n :].view(complex)
        if self._measured_gravity:
            before, self._gravity = self._gravity, self._effective_gravity(motion)
            # over the interval its mean acts: of second order in the interval, as all else
            modes.under((before + self._gravity) / 2.0 if interval else self._gravity)
            amplitudes = None
        if verdict.from_rest:
            modes.start(force, carried)
            watch.start()
        elif verdict is Verdict.COASTED:
            modes.coast(interval, force, carried)
        else:
            modes.advance(interval, force, carried, amplitudes)
        if self._measured_gravity:
            modes.under(self._gravity)

        waves = self._waves
        waves[:] = modes.wave
        envelope = np.abs(waves) / modes.damped
        beta = waves.imag / modes.damped
        if self._measured_gravity:
            waves *= modes.root
            force = force / self._gravity
        wrenches = np.matmul(model.output, self._moving)
        pressure = _NOWHERE
        if len(model.pressure):
            pressure = np.matmul(model.pressure, self._moving) - model.pressure_at_rest
        rest = watch.follow(envelope, force, interval, spin)
        return verdict, Loads(sample, wrenches, pressure, beta, model.heights, watch, rest)

    def feed_all(self, stamps: Sequence[int], values: Array) -> LoadsBlock | None:
        """
        Take many samples at once, bit for bit as `feed` would one by one.

        Matrices meet each sample in a product of its own, as there, and the modes are advanced
        by the same operations; only what stands around them is done for all samples together.

        Parameters
        ----------
        stamps : sequence of k ints
            Times of the samples [ns].
        values : array, shape (k, 9)
            Force, velocity and rate of each, as :attr:`MotionSample.values`.

        Returns
        -------
        LoadsBlock or None
            Of k samples; None, with nothing done, if not all of them follow each other without a
            gap or anything else to decide on: then they are to be fed one by one.
        """
        model, modes, n = self._model, self._modes, len(self._model.omega)
        one_by_one = self._high_pass is not None or self._measured_gravity or self._wanted
        if one_by_one or not n or not AT_ONCE:
            return None
        intervals = self.gate.judge_all(stamps, values, modes.longest)
        if intervals is None:
            return None
        given, bias = values, self.config.bias
        if bias is not None:
            values = values - np.array(bias)
        if self.config.source == 'imu':
            self._watch_gravity(values[:, :3].tolist(), intervals)
        turning = np.stack(products(*values.T[6:]), axis=1)
        motion = np.hstack([values, turning])
        followed = self._acceleration.follow_all(values, intervals)

        drive = each(model.drive, motion)
        force, carried = drive[:, :n], drive[:, n : 2 * n]
        waves = modes.advance_through(intervals, force, carried, drive[:, 2 * n :].view(complex))
        moving = np.hstack([waves.view(float), followed, turning])
        envelope = np.abs(waves) / modes.damped
        beta = waves.imag / modes.damped
        wrenches, pressure = each(model.output, moving), each(model.pressure, moving)
        pressure = pressure - model.pressure_at_rest
        self._motion[:], self._moving[:] = motion[-1], moving[-1]
        spin = turning[:, 0] + turning[:, 1] + turning[:, 2]
        rest = self._watch.follow_all(envelope, force, intervals, spin)
        return LoadsBlock(
            stamps, given, wrenches, pressure, beta, model.heights, self._watch, rest, rest.mild
        )

    def _effective_gravity(self, motion: Sequence[float]) -> float | Array:
        """Return the gravity over the standard one that pulls the waves back at this instant."""
        gravity, raised = self._model.gravity(motion[:3])
        if raised:
            self.warnings[
                f'vertical specific force below {LEAST_GRAVITY:g} g: waves move as under that'
            ] += 1
        return gravity

    def _watch_gravity(
        self, forces: Sequence[Sequence[float]], intervals: Sequence[float]
    ) -> None:
        """Count a warning while the mean specific force is not gravity, upwards."""
        (mx, my, mz), over = self._mean_force, self._mean_over
        ux, uy, uz = self._upwards
        wrong = 0
        for (x, y, z), interval in zip(forces, intervals, strict=True):
            if interval == 0.0:
                mx, my, mz, over = x, y, z, 0.0
                continue
            keep = math.exp(-interval / GRAVITY_MEMORY)
            mx, my, mz = x + keep * (mx - x), y + keep * (my - y), z + keep * (mz - z)
            over += interval
            if over > GRAVITY_MEMORY:
                error = (mx - ux) ** 2 + (my - uy) ** 2 + (mz - uz) ** 2
                wrong += error > GRAVITY_TOLERANCE**2
        self._mean_force, self._mean_over = (mx, my, mz), over
        if wrong:
            self.warnings[
                'mean specific force far from (0, 0, +9.81) m/s^2 in base_link: the IMU must '
                'include gravity (REP-145), in m/s^2; check imu.rpy'
            ] += wrong
