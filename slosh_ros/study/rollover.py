"""
The worked example of a stability stack, against a truth that knows every wheel load.

A simulated truck drives through a scenario. All that leaves it is what an IMU at `base_link` would
measure; engine and monitor make of it what slosh_node and rollover_node make of `imu/data`:

    _, loads = engine.feed(sample)
    rollover = monitor.take(sample, loads.wrench)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from slosh_ros.constants import GRAVITY, NANOSECONDS
from slosh_ros.engine import MotionSample, SloshConfig, SloshEngine
from slosh_ros.monitor import RolloverMonitor
from slosh_ros.study.tanks import liquids_of
from slosh_ros.vehicle import Drive, GeneralTruck, History, Thresholds
from slosh_ros.vehicle.general_truck import PHI_S, PLANAR, THETA_S, Z_S
from slosh_ros.vehicle.rollover import Rollover, RollVehicle
from slosh_ros.vehicle.scenario import Scenario

Array = NDArray[np.float64]

START = NANOSECONDS  # [ns] a zero stamp would mean "not set"


@dataclass(frozen=True, eq=False)
class RolloverStudy:
    """
    A scenario on N instants, judged from the truck's IMU.

    Attributes
    ----------
    name : str
        Of the scenario.
    truth : History
        What the truck did; its wheel loads are the truth.
    thresholds : Thresholds
        Of the truck in steady turns.
    liquid, solid : Rollover
        Figures from the IMU, arrays (N,): with the sloshing wrench, and with none, as if the load
        were solid.
    """

    name: str
    truth: History
    thresholds: Thresholds
    liquid: Rollover
    solid: Rollover

    @classmethod
    def of(cls, scenario_file: Path, vehicle: RollVehicle | None = None) -> RolloverStudy:
        """
        Drive a scenario of the general truck.

        Parameters
        ----------
        scenario_file : Path
            Parameter file of vehicle_node and slosh_node.
        vehicle : RollVehicle, optional
            What the monitor knows of the truck; by default all there is to know.
        """
        scenario = Scenario.from_file(scenario_file)
        config = SloshConfig.from_file(scenario_file)
        drive = scenario.plan
        assert isinstance(drive, Drive)
        tanks = liquids_of(config)
        truth = scenario.simulate(tanks)
        engine = SloshEngine(config)
        known = vehicle or RollVehicle.of(drive.truck)
        with_wrench, without = (RolloverMonitor(engine, known) for _ in range(2))
        liquid, solid = [], []
        for sample in imu_samples(truth, drive.truck):
            _, loads = engine.feed(sample)
            assert loads is not None
            liquid.append(with_wrench.take(sample, loads.wrench))
            solid.append(without.take(sample, np.zeros(6)))
        return cls(
            scenario_file.stem,
            truth,
            Thresholds.of(drive.truck, scenario.sloshing(tanks)),
            *(Rollover(*np.array(judged, dtype=float).T) for judged in (liquid, solid)),
        )

    @property
    def true_margin(self) -> Array:
        """Margin by the true wheel loads and the truck's own threshold, (N,) [g]."""
        ratio = np.abs(self.truth.transfer.vehicle)
        return np.asarray((1.0 - ratio) * self.thresholds.frozen / GRAVITY)

    def error(self, judged: Rollover) -> tuple[float, float]:
        """Error of the load transfer ratio, rms and greatest [-]."""
        error = judged.load_transfer_ratio - self.truth.transfer.vehicle
        return float(np.sqrt(np.mean(error**2))), float(np.abs(error).max())


def imu_samples(history: History, truck: GeneralTruck) -> Iterator[MotionSample]:
    """Measure specific force and angular rate at `base_link`, to first order in the angles."""
    p = truck.parameters
    pitch, roll, heave = (k - PLANAR for k in (THETA_S, PHI_S, Z_S))
    above_hitch = p.semitrailer_height - p.hitch_height
    surge = history.acceleration[:, 0] + above_hitch * history.q_acceleration[:, pitch]
    force = np.column_stack(
        [
            surge - GRAVITY * history.q[:, pitch],
            history.acceleration[:, 1] + GRAVITY * history.q[:, roll],
            history.q_acceleration[:, heave] + GRAVITY,
        ]
    )
    rate = np.column_stack([history.q_rate[:, [roll, pitch]], history.yaw_rate])
    for t, s, omega in zip(history.time.tolist(), force, rate, strict=True):
        yield MotionSample(START + round(t * NANOSECONDS), s, np.zeros(3), omega)
