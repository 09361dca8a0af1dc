"""`slosh_node`: the vehicle's motion in, force and moment of the sloshing liquid out."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import InertiaStamped, PointStamped, Twist, TwistStamped, WrenchStamped
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import FluidPressure, Imu
from std_msgs.msg import Float64MultiArray, Header, MultiArrayDimension
from std_srvs.srv import Trigger

from slosh_ros.engine import SloshConfig, SloshEngine, feed_message
from slosh_ros.engine.convert import IMU, TWIST, TWIST_STAMPED, input_type
from slosh_ros.engine.parameters import resolved
from slosh_ros.ros.diagnostics import Watch
from slosh_ros.ros.parameters import declare_all, given_parameters
from slosh_ros.ros.runtime import run

_INPUTS = {
    IMU: (Imu, 'imu/data'),
    TWIST: (Twist, 'twist'),
    TWIST_STAMPED: (TwistStamped, 'twist'),
}
# Heard from reliable and best-effort sensors alike; deep enough for a burst after a stall
_SENSOR = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_REPORT_PERIOD = 1.0  # [s]


class SloshNode(Node):
    """A thin shell around :class:`slosh_ros.engine.SloshEngine`."""

    def __init__(self) -> None:
        super().__init__('slosh_node', automatically_declare_parameters_from_overrides=True)
        rows, values = resolved(given_parameters(self))
        self.engine = SloshEngine(SloshConfig.from_parameters(values.by_name))
        declare_all(self, rows, values)

        self._said = ''
        self._wrench, self._total, self._state = (
            self.create_publisher(WrenchStamped, f'~/{name}', 10)
            for name in ('wrench', 'wrench_total', 'wrench_state')
        )
        self._message = WrenchStamped()
        self._message.header.frame_id = self.engine.config.output_frame
        self._pressures = [
            (
                self.create_publisher(FluidPressure, f'~/pressure/{point}', 10),
                FluidPressure(header=Header(frame_id=frame)),
            )
            for point, frame in self.engine.config.pressure_points.items()
        ]
        self._tell_simulators()
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self.create_service(Trigger, '~/reset', self._on_reset)
        # a steady clock: reports go on while simulated time stands still
        self.create_timer(
            _REPORT_PERIOD, self._report, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )
        kind, topic = _INPUTS[input_type(self.engine)]
        subscription = self.create_subscription(
            kind,
            topic,
            self._on_motion,
            _SENSOR,
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )
        topic = subscription.topic_name
        self._watch = Watch(self.engine, self.get_name(), topic)
        modes = sum(len(tank.coefficients.omega) for tank in self.engine.tanks)
        mass = sum(tank.coefficients.mass for tank in self.engine.tanks)
        self.get_logger().info(
            f'ready: {mass:.0f} kg of liquid in {len(self.engine.tanks)} tank(s), {modes} modes; '
            f'listening on {topic}'
        )

    def _on_motion(self, message: Any) -> None:
        _, loads = feed_message(self.engine, message, self.get_clock().now().nanoseconds)
        if loads is None:
            return
        self._watch.take(loads)
        stamp = self._message.header.stamp
        stamp.sec, stamp.nanosec = divmod(loads.stamp, 1_000_000_000)
        for publisher, wrench in (
            (self._wrench, loads.wrench),
            (self._total, loads.total),
            (self._state, loads.state),
        ):
            force, torque = self._message.wrench.force, self._message.wrench.torque
            force.x, force.y, force.z, torque.x, torque.y, torque.z = wrench.tolist()
            publisher.publish(self._message)
        for (publisher, message), pressure in zip(self._pressures, loads.pressure, strict=True):
            if publisher.get_subscription_count():
                message.header.stamp = stamp
                message.fluid_pressure = float(pressure)
                publisher.publish(message)

    def _tell_simulators(self) -> None:
        """Latch what a simulator of the vehicle has to know of the liquid it carries."""
        carried, frame = self.engine.carried, self.engine.config.output_frame
        wrench = f'wrench in {frame}: fx fy fz mx my mz'
        acceleration = f'acceleration of {frame}: sx sy sz ax ay az'
        exact = wrench.replace(':', ', the liquid turning with its Stokes-Joukowski inertia:')
        for topic, matrix, row, column in (
            ('coupling', carried.coupling, wrench, acceleration),
            ('coupling_exact', carried.coupling_exact, exact, acceleration),
            (
                'softening',
                self.engine.softening,
                wrench,
                f'displacement of {frame}: x y z rx ry rz',
            ),
        ):
            message = Float64MultiArray(data=matrix.ravel().tolist())
            message.layout.dim = [
                MultiArrayDimension(label=row, size=6, stride=36),
                MultiArrayDimension(label=column, size=6, stride=6),
            ]
            self.create_publisher(Float64MultiArray, f'~/{topic}', _LATCHED).publish(message)
        liquid = InertiaStamped()
        liquid.header.frame_id = frame
        told, inertia = liquid.inertia, carried.inertia_at_centroid
        told.m = carried.mass
        told.com.x, told.com.y, told.com.z = carried.centroid.tolist()
        told.ixx, told.iyy, told.izz = np.diag(inertia).tolist()
        told.ixy, told.ixz, told.iyz = (float(inertia[k]) for k in ((0, 1), (0, 2), (1, 2)))
        self.create_publisher(InertiaStamped, '~/liquid', _LATCHED).publish(liquid)
        centre = PointStamped()
        centre.header.frame_id = frame
        centre.point.x, centre.point.y, centre.point.z = self.engine.surface_centre.tolist()
        self.create_publisher(PointStamped, '~/surface_centre', _LATCHED).publish(centre)

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.engine.reset()
        response.success = True
        response.message = 'the liquid starts from rest with the next good sample'
        return response

    def _report(self) -> None:
        status = self._watch.look()
        message = DiagnosticArray(status=[status])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)
        # what goes on for long is in the diagnostics; the log tells what needs somebody
        if status.message != self._said:
            if status.level == DiagnosticStatus.ERROR:
                self.get_logger().error(status.message)
            elif status.level == DiagnosticStatus.WARN:
                self.get_logger().warning(status.message)
        self._said = status.message


def main(args: list[str] | None = None) -> None:
    """Run slosh_node until Ctrl-C or SIGTERM."""
    sys.exit(run(SloshNode, args))


if __name__ == '__main__':
    main()
