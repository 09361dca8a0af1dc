"""
`vehicle_node`: a tractor-semitrailer that drives, is measured, and feels its liquid.

The truck is that of the paper or the general one; the node knows both as a `SteppedTruck`.

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
from functools import partial
from typing import IO, Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import (
    Inertia,
    InertiaStamped,
    PointStamped,
    TwistStamped,
    Vector3,
    WrenchStamped,
)
from numpy.typing import NDArray
from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import Imu
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import Trigger

from slosh_ros.constants import GRAVITY, NANOSECONDS
from slosh_ros.engine.convert import stamp_of
from slosh_ros.errors import InputError
from slosh_ros.parameters import resolved
from slosh_ros.ros.news import News
from slosh_ros.ros.parameters import declare_all, given_parameters
from slosh_ros.ros.runtime import run
from slosh_ros.ros.stability import LATCHED, StabilityTopics
from slosh_ros.vehicle import Drive, RigidCargo, SloshingCargo, Thresholds
from slosh_ros.vehicle.exchange import Link, WrenchExchange
from slosh_ros.vehicle.history import columns_of
from slosh_ros.vehicle.scenario import PARAMETERS, Scenario

Array = NDArray[np.float64]

FRAME = 'base_link'
CLOCK_START = 1_000_000_000  # [ns] a zero stamp would mean "not set"
_RELIABLE = QoSProfile(depth=10)
_POLL = 0.02  # [s] of wall time
_REPORT_PERIOD = 1.0  # [s]
_SAME = 0.01  # [-] by which the liquid may change in mid-drive, as it may differ from the cargo
_MIN_PATIENCE = 0.005  # [s] for a slosh_node that has not answered for long
_IMU = tuple(f'imu_{kind}{axis}' for kind in 'aw' for axis in 'xyz')  # columns of the log


class VehicleNode(Node):
    """A thin shell around a :class:`slosh_ros.vehicle.SteppedTruck`."""

    def __init__(self) -> None:
        super().__init__('vehicle_node', automatically_declare_parameters_from_overrides=True)
        values = resolved(PARAMETERS, given_parameters(self))
        declare_all(self, PARAMETERS, values)
        self._news = News(self.get_logger())
        self._scenario = Scenario.from_parameters(values.by_name)
        self._truck = self._scenario.simulator()
        self._told: dict[str, Any] = {}  # what slosh_node has latched, by topic
        self._at_first: dict[str, Any] = {}  # as the drive began
        self._coupling: Array | None = None  # which goes into the equations of motion
        self._modal_coupling: Array = np.zeros((6, 6))  # of the sloshing wrench alone
        self._surface_centre: Array = np.zeros(3)
        self._exchange = WrenchExchange()
        self._present = self._exchange.at(0)
        self._share = 1.0  # of the coupling that the truck holds
        self._driving = False
        self._missed = 0
        self._patience = self._scenario.patience
        self._deadline = math.inf  # [s] on the steady clock, for the answer to the last sample
        self._link = self._present.link
        self._log = self._open_log()
        self._stability = StabilityTopics(self, self._truck)

        self._clock_publisher = self.create_publisher(ClockMessage, '/clock', _RELIABLE)
        self._imu_publisher = self.create_publisher(Imu, 'imu/data', _RELIABLE)
        self._twist_publisher = self.create_publisher(TwistStamped, 'twist', _RELIABLE)
        self._imu = Imu()
        self._imu.header.frame_id = FRAME
        self._imu.orientation_covariance[0] = -1.0  # no orientation is measured
        self._twist = TwistStamped()
        self._twist.header.frame_id = FRAME
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self.create_timer(_REPORT_PERIOD, self._report, clock=steady)
        if self._scenario.solid:
            self._truck.check_coupling(np.zeros((6, 6)), np.zeros((6, 6)))
            self._tell_thresholds(SloshingCargo.none())
            self._starter = self.create_timer(0.0, self._step, clock=steady)
            self.get_logger().info('ready: driving with a solid cargo')
            return
        self.create_subscription(
            WrenchStamped, 'slosh_node/wrench_state', self._on_wrench, _RELIABLE
        )
        self._coupling_topic = 'coupling_exact' if self._scenario.exact_inertia else 'coupling'
        self._latched = {
            self._coupling_topic: Float64MultiArray,
            'coupling': Float64MultiArray,
            'softening': Float64MultiArray,
            'liquid': InertiaStamped,
            'surface_centre': PointStamped,
        }
        for topic, kind in self._latched.items():
            self.create_subscription(
                kind, f'slosh_node/{topic}', partial(self._on_told, topic), LATCHED
            )
        self._starter = self.create_timer(_POLL, self._start, clock=steady)
        self._pacer = self.create_timer(
            self._scenario.step_ns * 1e-9 if self._scenario.free_running else _MIN_PATIENCE,
            self._tick,
            clock=steady,
        )
        self._reset = self.create_client(Trigger, 'slosh_node/reset')
        self.get_logger().info(
            f'ready: waiting for {self.resolve_topic_name("slosh_node")} and its '
            f'~/{self._coupling_topic}'
        )

    def destroy_node(self) -> None:
        """Close the log as well."""
        if self._log is not None:
            self._log.close()
        super().destroy_node()

    def _on_told(self, topic: str, message: Any) -> None:
        """Take what slosh_node has latched; with the last of it, judge it."""
        labelled = isinstance(message, Float64MultiArray)
        frame = message.layout.dim[0].label if labelled else message.header.frame_id
        if FRAME not in frame:
            raise InputError(
                f'slosh_node labels its ~/{topic} "{frame}"; set its frames.output to {FRAME}'
            )
        if self._driving and not _alike(message, self._at_first[topic]):
            raise InputError(
                f'slosh_node tells another ~/{topic} in mid-drive: its fill has changed, but the '
                'truck carries one load all the way; change the fill between two drives'
            )
        self._told[topic] = message
        if self._told.keys() == self._latched.keys():
            self._take_liquid()

    def _take_liquid(self) -> None:
        """Refuse a liquid with which the truck cannot be stable, or which is not its own."""
        coupling, modal, softening = (
            np.reshape(self._told[topic].data, (6, 6))
            for topic in (self._coupling_topic, 'coupling', 'softening')
        )
        self._truck.check_coupling(coupling, softening)
        self._scenario.check_liquid(_frozen(self._told['liquid'].inertia))
        if self._coupling is None:  # not of a slosh_node that has come back
            self._tell_thresholds(SloshingCargo.settled(np.diag(softening)[[4, 3]] / GRAVITY))
        self._truck.set_coupling(self._share * coupling)
        self._coupling, self._modal_coupling = coupling, modal
        centre = self._told['surface_centre'].point
        self._surface_centre = np.array([centre.x, centre.y, centre.z])

    def _tell_thresholds(self, cargo: SloshingCargo) -> None:
        plan = self._scenario.plan
        if isinstance(plan, Drive):  # the paper's truck does not lean
            self._stability.know(Thresholds.of(plan.truck, cargo))

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
            f'slosh_node is there: {self._coupling[0, 0]:.0f} kg slosh fore-aft, '
            f'{self._coupling[1, 1]:.0f} kg sideways; driving'
        )
        self._driving = True
        self._at_first = dict(self._told)
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
            self._report()
            self.get_logger().info(f'the manoeuvre is over: {self._stability.summary()}')
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
            self._news.tell(self._link.value, f't = {now:.2f} s: {self._link.value}')

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
        self._stability.publish(self._imu.header.stamp)
        self._deadline = time.monotonic() + self._patience

    def _report(self) -> None:
        self._news.flush()
        message = DiagnosticArray(status=[self._stability.status()])
        if not self._scenario.solid:
            message.status.append(self._exchange_status())
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)

    def _exchange_status(self) -> DiagnosticStatus:
        live = self._link is Link.LIVE
        return DiagnosticStatus(
            level=DiagnosticStatus.OK if live else DiagnosticStatus.WARN,
            name=f'{self.get_name()}: exchange with slosh_node',
            message=self._link.value if self._driving else 'waiting for slosh_node',
            values=[
                KeyValue(key='unanswered samples', value=str(self._missed)),
                KeyValue(key='share of the sloshing', value=f'{self._share:.2f}'),
                KeyValue(key='simulated time [s]', value=f'{self._truck.time_ns * 1e-9:.2f}'),
            ],
        )

    def _open_log(self) -> IO[str] | None:
        path = self._scenario.log_file
        if path is None:
            return None
        try:
            file = path.open('w', encoding='ascii')
        except OSError as error:
            raise InputError(f'log_file {path} cannot be written: {error.strerror}') from error
        file.write(','.join(('stamp_ns', *self._instant(), *_IMU)) + '\n')
        return file

    def _write_log(self) -> None:
        if self._log is None:
            return
        measured = self._truck.imu(self._present.wrench)
        row = [float(value) for value in self._instant().values()]
        row += [*measured.specific_force.tolist(), *measured.angular_rate.tolist()]
        self._log.write(f'{CLOCK_START + self._truck.time_ns},{",".join(map(repr, row))}\n')

    def _instant(self) -> dict[str, Array]:
        """Name what `slosh simulate` would write of the present, but for the liquid's surface."""
        truck, slosh = self._truck, self._present.wrench
        acceleration = truck.acceleration(slosh)
        forward = truck.forward_acceleration(slosh)
        felt = np.concatenate([truck.imu(slosh).specific_force, acceleration[3:]])
        slosh = slosh + self._share * self._modal_coupling @ felt
        # moment about O, the centre of the mean free surface, as in the paper
        moment = slosh[3:] - np.cross(self._surface_centre, slosh[:3])
        return columns_of(
            np.array(truck.time_ns * 1e-9),
            np.array(truck.speed),
            np.array([forward, acceleration[1]]),
            truck.angular_rate[2],
            truck.q,
            np.concatenate([slosh[:3], moment]),
            truck.wheel_loads(),
        )


def _alike(message: Any, first: Any) -> bool:
    """Whether two messages on a latched topic tell of one mass."""
    if isinstance(message, PointStamped):
        return True  # a place, which follows the mass
    a, b = (
        np.array([m.inertia.m] if isinstance(m, InertiaStamped) else m.data)
        for m in (message, first)
    )
    return bool(np.abs(a - b).max() <= _SAME * np.abs(b).max())


def _frozen(told: Inertia) -> RigidCargo:
    """Read the frozen liquid of slosh_node."""
    inertia = (
        (told.ixx, told.ixy, told.ixz),
        (told.ixy, told.iyy, told.iyz),
        (told.ixz, told.iyz, told.izz),
    )
    return RigidCargo(told.m, (told.com.x, told.com.y, told.com.z), inertia)


def _fill(vector: Vector3, values: Array) -> None:
    vector.x, vector.y, vector.z = values.tolist()


def main(args: list[str] | None = None) -> None:
    """Run vehicle_node until its manoeuvre is over, Ctrl-C or SIGTERM."""
    sys.exit(run(VehicleNode, args))


if __name__ == '__main__':
    main()
