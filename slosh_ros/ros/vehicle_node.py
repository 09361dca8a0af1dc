"""
`vehicle_node`: a tractor-semitrailer that drives, is measured, and feels its liquid.

Lock-step on simulated time: every step publishes /clock, the Imu and the twist, and waits for the
answer of slosh_node to that very sample. Nothing depends on the wall clock: every run is the same.
Free-running in wall time (`pace: wall`), a step takes what has arrived by then. If slosh_node
falls silent, the vehicle drives on: it holds the last wrench, then freezes its cargo, and frees it
when slosh_node is back.

What comes back is the sloshing wrench *without* feed-through of acceleration; the feed-through is
the latched coupling matrix and is solved for together with the vehicle. A total wrench taken into
a dry vehicle would diverge at any step size.
"""

from __future__ import annotations

import math
import sys
import time
from typing import IO

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import TwistStamped, Vector3, WrenchStamped
from numpy.typing import NDArray
from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import Imu
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import Trigger

from slosh_ros.constants import NANOSECONDS
from slosh_ros.engine.convert import stamp_of
from slosh_ros.errors import InputError
from slosh_ros.parameters import resolved
from slosh_ros.ros.parameters import declare_all, given_parameters
from slosh_ros.ros.runtime import run
from slosh_ros.vehicle import BASE_MOTION, TruckSimulator
from slosh_ros.vehicle.exchange import Link, WrenchExchange
from slosh_ros.vehicle.scenario import PARAMETERS, Scenario

Array = NDArray[np.float64]

FRAME = 'base_link'
CLOCK_START = 1_000_000_000  # [ns] a zero stamp would mean "not set"
_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_RELIABLE = QoSProfile(depth=10)
_POLL = 0.02  # [s] of wall time
_REPORT_PERIOD = 1.0  # [s]
_MIN_PATIENCE = 0.005  # [s] for a slosh_node that has not answered for long
LOG_COLUMNS = (
    'stamp_ns,t,u,ax,z_t,theta_t,z_s,theta_s,fx,my,'
    'fz_1,fz_2,fz_3,fz_4,imu_ax,imu_ay,imu_az,imu_wx,imu_wy,imu_wz'
)


class VehicleNode(Node):
    """A thin shell around :class:`slosh_ros.vehicle.TruckSimulator`."""

    def __init__(self) -> None:
        super().__init__('vehicle_node', automatically_declare_parameters_from_overrides=True)
        values = resolved(PARAMETERS, given_parameters(self))
        declare_all(self, PARAMETERS, values)
        self._scenario = Scenario.from_parameters(values.by_name)
        self._truck = TruckSimulator(self._scenario.journey)
        self._coupling: Array | None = None
        self._exchange = WrenchExchange()
        self._present = self._exchange.at(0)
        self._share = 1.0  # of the coupling that the truck holds
        self._driving = False
        self._missed = 0
        self._patience = self._scenario.patience
        self._deadline = math.inf  # [s] on the steady clock, for the answer to the last sample
        self._link = self._present.link
        self._log = self._open_log()

        self._clock_publisher = self.create_publisher(ClockMessage, '/clock', _RELIABLE)
        self._imu_publisher = self.create_publisher(Imu, 'imu/data', _RELIABLE)
        self._twist_publisher = self.create_publisher(TwistStamped, 'twist', _RELIABLE)
        self._imu = Imu()
        self._imu.header.frame_id = FRAME
        self._imu.orientation_covariance[0] = -1.0  # no orientation is measured
        self._twist = TwistStamped()
        self._twist.header.frame_id = FRAME
        if self._scenario.solid:
            self._starter = self.create_timer(0.0, self._step)
            self.get_logger().info('ready: driving with a solid cargo')
            return
        self.create_subscription(
            WrenchStamped, 'slosh_node/wrench_state', self._on_wrench, _RELIABLE
        )
        coupling = self.create_subscription(
            Float64MultiArray, 'slosh_node/coupling', self._on_coupling, _LATCHED
        )
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._starter = self.create_timer(_POLL, self._start, clock=steady)
        self._pacer = self.create_timer(
            self._scenario.step_ns * 1e-9 if self._scenario.free_running else _MIN_PATIENCE,
            self._tick,
            clock=steady,
        )
        self._reset = self.create_client(Trigger, 'slosh_node/reset')
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self.create_timer(_REPORT_PERIOD, self._report, clock=steady)
        self.get_logger().info(f'ready: waiting for {coupling.topic_name}')

    def destroy_node(self) -> None:
        """Close the log as well."""
        if self._log is not None:
            self._log.close()
        super().destroy_node()

    def _on_coupling(self, message: Float64MultiArray) -> None:
        label = message.layout.dim[0].label
        if FRAME not in label:
            raise InputError(
                f'the coupling of slosh_node is labelled "{label}"; '
                f'set its frames.output to {FRAME}'
            )
        self._coupling = np.reshape(message.data, (6, 6))
        self._truck.set_coupling(self._share * self._coupling)

    def _start(self) -> None:
        """Drive as soon as slosh_node is connected both ways."""
        connected = self._imu_publisher.get_subscription_count() and self._reset.service_is_ready()
        if self._coupling is None or not connected:
            return
        self._starter.cancel()
        # a slosh_node that has seen an earlier run would take this one's stamps for late
        self._reset.call_async(Trigger.Request()).add_done_callback(lambda _: self._drive())

    def _drive(self) -> None:
        assert self._coupling is not None
        self.get_logger().info(
            f'slosh_node is there: {self._coupling[0, 0]:.0f} kg slosh fore-aft; driving'
        )
        self._driving = True
        self._publish()

    def _on_wrench(self, message: WrenchStamped) -> None:
        force, torque = message.wrench.force, message.wrench.torque
        wrench = np.array([force.x, force.y, force.z, torque.x, torque.y, torque.z])
        stamp = stamp_of(message.header) - CLOCK_START
        self._exchange.receive(stamp, wrench)
        if self._driving and not self._scenario.free_running and stamp == self._truck.time_ns:
            self._patience = self._scenario.patience
            self._step()

    def _tick(self) -> None:
        """Go on without an answer: in free-running always, in lock-step when patience ends."""
        if not self._driving:
            return
        if not self._scenario.free_running:
            if time.monotonic() < self._deadline:
                return
            self._missed += 1
            self._patience = max(self._patience / 2.0, _MIN_PATIENCE)
        self._step()

    def _step(self) -> None:
        """Record the present, advance under the wrench as known, and publish what is measured."""
        self._look()
        self._write_log()
        if self._truck.time_ns >= self._scenario.steps * self._scenario.step_ns:
            self.get_logger().info('the manoeuvre is over')
            raise ExternalShutdownException
        self._truck.advance(self._scenario.step_ns, self._present.wrench, self._present.rate)
        self._look()
        self._publish()

    def _look(self) -> None:
        """Estimate the wrench at present, and say so when the liquid falls silent or returns."""
        if self._coupling is None:
            return  # a solid cargo says nothing, and is not missed
        self._present = self._exchange.at(self._truck.time_ns)
        if self._present.share != self._share:
            self._share = self._present.share
            self._truck.set_coupling(self._share * self._coupling)
        if self._present.link is not self._link:
            self._link = self._present.link
            now = self._truck.time_ns * 1e-9
            self.get_logger().warning(f't = {now:.2f} s: {self._link.value}')

    def _publish(self) -> None:
        stamp = CLOCK_START + self._truck.time_ns
        for header in (self._imu.header, self._twist.header):
            header.stamp.sec, header.stamp.nanosec = divmod(stamp, NANOSECONDS)
        measured = self._truck.imu(self._present.wrench)
        _fill(self._imu.linear_acceleration, measured.specific_force)
        _fill(self._imu.angular_velocity, measured.angular_rate)
        velocity = self._truck.twist()
        _fill(self._twist.twist.linear, velocity.linear)
        _fill(self._twist.twist.angular, velocity.angular)
        self._clock_publisher.publish(ClockMessage(clock=self._imu.header.stamp))
        self._twist_publisher.publish(self._twist)
        self._imu_publisher.publish(self._imu)
        self._deadline = time.monotonic() + self._patience

    def _report(self) -> None:
        live = self._link is Link.LIVE
        status = DiagnosticStatus(
            level=DiagnosticStatus.OK if live else DiagnosticStatus.WARN,
            name=f'{self.get_name()}: exchange with slosh_node',
            message=self._link.value if self._driving else 'waiting for slosh_node',
            values=[
                KeyValue(key='unanswered samples', value=str(self._missed)),
                KeyValue(key='share of the sloshing', value=f'{self._share:.2f}'),
                KeyValue(key='simulated time [s]', value=f'{self._truck.time_ns * 1e-9:.2f}'),
            ],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)

    def _open_log(self) -> IO[str] | None:
        path = self._scenario.log_file
        if path is None:
            return None
        try:
            file = path.open('w', encoding='ascii')
        except OSError as error:
            raise InputError(f'log_file {path} cannot be written: {error.strerror}') from error
        file.write(LOG_COLUMNS + '\n')
        return file

    def _write_log(self) -> None:
        if self._log is None:
            return
        truck = self._truck
        measured = truck.imu(self._present.wrench)
        alpha = BASE_MOTION @ truck.acceleration(self._present.wrench)
        acceleration = np.array([*measured.specific_force, *alpha[3:]])
        slosh = self._present.wrench
        if self._coupling is not None:
            slosh = slosh + self._share * self._coupling @ acceleration
        # moment about O, the centre of the mean free surface, as in the paper
        moment = slosh[3:] - np.cross(truck.truck.parameters.liquid_origin, slosh[:3])
        now = truck.time_ns * 1e-9
        row = [
            now, truck.speed, truck.journey.manoeuvre.motion(now)[2], *truck.q.tolist(),
            float(slosh[0]), float(moment[1]), *truck.axle_loads().tolist(),
            *measured.specific_force.tolist(), *measured.angular_rate.tolist(),
        ]  # fmt: skip
        self._log.write(f'{CLOCK_START + truck.time_ns},' + ','.join(map(repr, row)) + '\n')


def _fill(vector: Vector3, values: Array) -> None:
    vector.x, vector.y, vector.z = values.tolist()


def main(args: list[str] | None = None) -> None:
    """Run vehicle_node until its manoeuvre is over, Ctrl-C or SIGTERM."""
    sys.exit(run(VehicleNode, args))


if __name__ == '__main__':
    main()
