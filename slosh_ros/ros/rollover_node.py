"""`rollover_node`: IMU and sloshing wrench in, load transfer ratio and rollover margin out."""

from __future__ import annotations

import sys

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import InertiaStamped, WrenchStamped
from numpy.typing import NDArray
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import Imu
from std_msgs.msg import Float64

from slosh_ros.constants import GRAVITY
from slosh_ros.engine import MotionSample, SloshConfig, SloshEngine
from slosh_ros.engine.convert import imu_sample, stamp_of
from slosh_ros.engine.parameters import resolved as resolved_tanks
from slosh_ros.monitor import Pairs, RolloverMonitor
from slosh_ros.parameters import resolved
from slosh_ros.ros.latched import LATCHED
from slosh_ros.ros.parameters import declare_all, given_parameters
from slosh_ros.ros.runtime import run
from slosh_ros.vehicle.rollover import FIGURES, GROUP, PARAMETERS, RollVehicle

_FRAME = 'base_link'
# Heard from reliable and best-effort publishers alike; deep enough for a burst after a stall
_SENSOR = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
_REPORT_PERIOD = 1.0  # [s]
_SAME = 0.01  # [-] by which the liquid may differ from that of slosh_node


class RolloverNode(Node):
    """
    A thin shell around :class:`slosh_ros.monitor.RolloverMonitor`.

    It has the parameters of slosh_node, for the liquid and the pose of the IMU, and those of the
    vehicle. A number is published for every Imu that slosh_node has answered, and only then.
    """

    def __init__(self) -> None:
        super().__init__('rollover_node', automatically_declare_parameters_from_overrides=True)
        given = given_parameters(self)
        own = {name for name in given if name.startswith(GROUP)}
        rows, values = resolved_tanks({k: v for k, v in given.items() if k not in own})
        of_vehicle = resolved(PARAMETERS, {k: v for k, v in given.items() if k in own})
        config = SloshConfig.from_parameters(values.by_name)
        self._vehicle = RollVehicle.from_values(of_vehicle)
        engine = SloshEngine(config)
        self._monitor = RolloverMonitor(engine, self._vehicle)
        declare_all(self, rows, values)
        declare_all(self, PARAMETERS, of_vehicle)

        self._pairs = Pairs()
        self._heard = self._judged = self._strange = 0
        self._seen = (0, 0, 0, 0)  # the same, and what was unanswered, at the last report
        self._least = np.inf  # margin since then [g]
        self._said = ''
        self._figures = [self.create_publisher(Float64, f'~/{name}', 10) for name in FIGURES]
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        overriding = QoSOverridingOptions.with_default_policies()
        imu, wrench = (
            self.create_subscription(
                kind, topic, callback, _SENSOR, qos_overriding_options=overriding
            )
            for kind, topic, callback in (
                (Imu, 'imu/data', self._on_imu),
                (WrenchStamped, 'slosh_node/wrench', self._on_wrench),
            )
        )
        self._mass = self._told = engine.mass  # of the liquid, here and in slosh_node [kg]
        self.create_subscription(InertiaStamped, 'slosh_node/liquid', self._on_liquid, LATCHED)
        self._topics = imu.topic_name, wrench.topic_name
        # a steady clock: reports go on while simulated time stands still
        self.create_timer(
            _REPORT_PERIOD, self._report, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )
        balance = self._monitor.balance
        self.get_logger().info(
            f'ready: in a steady turn the vehicle rolls over at '
            f'{balance.threshold_liquid / GRAVITY:.3f} g, with a solid load at '
            f'{balance.threshold_solid / GRAVITY:.3f} g; listening on {" and ".join(self._topics)}'
        )

    def _on_imu(self, message: Imu) -> None:
        self._heard += 1
        self._judge(self._pairs.sample(imu_sample(message)))

    def _on_wrench(self, message: WrenchStamped) -> None:
        if message.header.frame_id != _FRAME:
            self._strange += 1
            return
        force, torque = message.wrench.force, message.wrench.torque
        wrench = np.array([force.x, force.y, force.z, torque.x, torque.y, torque.z])
        self._judge(self._pairs.answer(stamp_of(message.header), wrench))

    def _on_liquid(self, message: InertiaStamped) -> None:
        self._told = message.inertia.m

    def _judge(self, pair: tuple[MotionSample, NDArray[np.float64]] | None) -> None:
        rollover = None if pair is None else self._monitor.take(*pair)
        if rollover is None:
            return
        self._judged += 1
        self._least = min(self._least, float(rollover.margin))
        for publisher, number in zip(self._figures, rollover, strict=True):
            publisher.publish(Float64(data=float(number)))

    def _report(self) -> None:
        level, text = self._verdict()
        values = {
            'samples': self._heard,
            'samples judged': self._judged,
            'samples without a wrench': self._pairs.unanswered,
            f'wrenches not in {_FRAME}': self._strange,
        }
        status = DiagnosticStatus(
            level=level,
            name=f'{self.get_name()}: rollover',
            message=text,
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )
        if self._least < np.inf:
            status.values.append(
                KeyValue(key='least margin of the last second [g]', value=f'{self._least:.4f}')
            )
        self._seen = self._counts
        self._least = np.inf
        message = DiagnosticArray(status=[status])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)
        if level != DiagnosticStatus.OK and text != self._said:
            self.get_logger().warning(text)
        self._said = text

    @property
    def _counts(self) -> tuple[int, int, int, int]:
        return self._heard, self._judged, self._strange, self._pairs.unanswered

    def _verdict(self) -> tuple[bytes, str]:
        """Tell what came since the last report."""
        heard, judged, strange, unanswered = (
            now - before for now, before in zip(self._counts, self._seen, strict=True)
        )
        imu, wrench = self._topics
        if strange:
            return DiagnosticStatus.ERROR, f'{wrench} is not in {_FRAME}: set frames.output to it'
        if not heard:
            if not self._heard:
                return DiagnosticStatus.WARN, f'waiting for data on {imu}'
            return DiagnosticStatus.STALE, f'no sample on {imu} for a second'
        if not judged:
            return (
                DiagnosticStatus.ERROR,
                f'no wrench on {wrench} for the samples on {imu}: nothing is published; '
                'is slosh_node running, and does it accept them?',
            )
        if abs(self._told - self._mass) > _SAME * self._mass:
            return (
                DiagnosticStatus.ERROR,
                f'slosh_node holds {self._told:.0f} kg of liquid, the figures are for '
                f'{self._mass:.0f} kg: start again with the fill that it has now',
            )
        if self._least < self._vehicle.least_margin:
            return (
                DiagnosticStatus.WARN,
                f'the rollover margin is below {self._vehicle.least_margin:g} g',
            )
        if unanswered:
            return (
                DiagnosticStatus.WARN,
                f'some of the samples on {imu} had no wrench on {wrench}',
            )
        return DiagnosticStatus.OK, 'running'


def main(args: list[str] | None = None) -> None:
    """Run rollover_node until Ctrl-C or SIGTERM."""
    sys.exit(run(RolloverNode, args, events=True))


if __name__ == '__main__':
    main()
