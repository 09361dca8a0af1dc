"""`slosh_node`: the vehicle's motion in, force and moment of the sloshing liquid out."""

from __future__ import annotations

import sys
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist, TwistStamped
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu
from std_srvs.srv import SetBool, Trigger

from slosh_ros.engine import SloshConfig, SloshEngine, feed_message
from slosh_ros.engine.cdr import imu_reading
from slosh_ros.engine.convert import IMU, TWIST, TWIST_STAMPED, ImuReading, input_type
from slosh_ros.engine.parameters import resolved
from slosh_ros.ros.calibration import CalibrationService
from slosh_ros.ros.diagnostics import DISABLED, SEVERITY, UNMOUNTED, UNREADABLE, Watch
from slosh_ros.ros.fill import FillInput
from slosh_ros.ros.latched import Latched
from slosh_ros.ros.motion_input import MotionInput
from slosh_ros.ros.mounting import TfMounting
from slosh_ros.ros.news import INFO, News
from slosh_ros.ros.outputs import Outputs
from slosh_ros.ros.parameters import declare_all, given_parameters
from slosh_ros.ros.runtime import run

_INPUTS = {
    IMU: (Imu, 'imu/data'),
    TWIST: (Twist, 'twist'),
    TWIST_STAMPED: (TwistStamped, 'twist'),
}
_REPORT_PERIOD = 1.0  # [s]


class SloshNode(Node):
    """A thin shell around :class:`slosh_ros.engine.SloshEngine`."""

    def __init__(self) -> None:
        super().__init__('slosh_node', automatically_declare_parameters_from_overrides=True)
        rows, values = resolved(given_parameters(self))
        self.engine = SloshEngine(SloshConfig.from_parameters(values.by_name))
        declare_all(self, rows, values)
        self._news = News(self.get_logger())
        self._outputs = Outputs(self, self.engine, values)
        self._latched = Latched(self, self.engine)
        self._latched.tell()
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self.create_service(Trigger, '~/reset', self._on_reset)
        self.create_service(SetBool, '~/set_enabled', self._on_set_enabled)
        kind, topic = _INPUTS[input_type(self.engine)]
        take = {Imu: self._on_imu, Twist: self._on_twist, TwistStamped: self._on_motion}[kind]
        raw = kind is Imu
        self._mounting = TfMounting(self) if values.flag('imu.from_tf') and raw else None
        motion = MotionInput(self, kind, topic, take, self._news, raw=raw)
        self._watch = Watch(self.engine, self.get_name(), motion)
        self._fills = FillInput(self, self.engine, self._news, self._watch)
        # a steady clock: reports go on while simulated time stands still
        self.create_timer(
            _REPORT_PERIOD, self._report, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )
        # last: its thread must not outlive a node that could not be made
        self._calibration = CalibrationService(self, self.engine, values)
        self._tell_damping()
        modes = sum(len(tank.coefficients.omega) for tank in self.engine.tanks)
        mass = sum(tank.coefficients.mass for tank in self.engine.tanks)
        self.get_logger().info(
            f'ready: {mass:.0f} kg of liquid in {len(self.engine.tanks)} tank(s), {modes} modes; '
            f'listening on {motion.topic}'
        )

    def destroy_node(self) -> None:
        """End the calibration's thread as well."""
        self._calibration.close()
        super().destroy_node()

    def _tell_damping(self) -> None:
        """Log what damps the waves of every tank, and what of it is out of its range."""
        for config, tank in zip(self.engine.config.tanks, self.engine.tanks, strict=True):
            damping = config.damping_of(tank.coefficients)
            if not damping.ratio.size:
                continue
            first = damping.ratio[tank.coefficients.omega.argmin()]
            self.get_logger().info(
                f'{config.name}: damping ratio of the lowest mode {first:.3g}: {damping.words}'
            )
            for beyond in damping.beyond:
                self.get_logger().warning(f'{config.name}: damping beyond its range: {beyond}')

    def _on_imu(self, raw: bytes) -> None:
        reading = imu_reading(raw)
        if reading is None:  # big-endian, say
            try:
                reading = ImuReading.of(deserialize_message(raw, Imu))
            except (RuntimeError, UnicodeDecodeError):  # any bytes may come
                self._watch.refuse(UNREADABLE)
                return
        if self._mounting is None or self._mount(self._mounting, reading.frame):
            self._on_motion(reading)

    def _mount(self, mounting: TfMounting, frame: str) -> bool:
        """Take the pose of the IMU from TF once it tells; until then samples are held out."""
        wanted = self.engine.config.imu_frame
        if wanted and frame != wanted:
            return True  # the engine refuses it
        pose = mounting.find(frame)
        if pose is None:
            self._watch.refuse(UNMOUNTED)
            return False
        self.engine.mount(pose)
        self._mounting = None
        xyz, rpy = (', '.join(f'{c:.4f}' for c in part) for part in (pose.origin, pose.rpy))
        self.get_logger().info(f'{frame} is mounted in base_link at xyz [{xyz}], rpy [{rpy}]')
        return True

    def _on_twist(self, message: Twist) -> None:
        self._on_motion(message, self.get_clock().now().nanoseconds)

    def _on_motion(self, message: Any, received: int = 0) -> None:
        if not self._watch.enabled:
            self._watch.refuse(DISABLED)
            return
        self._fills.bring()
        verdict, loads = feed_message(self.engine, message, received)
        if loads is not None:
            if self._fills.changed:
                self._fills.changed = False
                self._latched.tell()
            self._watch.take(loads)
            self._calibration.take(verdict, loads)
            self._outputs.publish(loads)

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.engine.reset()
        response.success = True
        response.message = 'the liquid starts from rest with the next good sample'
        self._news.tell('reset', f'~/reset: {response.message}', INFO)
        return response

    def _on_set_enabled(
        self, request: SetBool.Request, response: SetBool.Response
    ) -> SetBool.Response:
        self._watch.enabled = request.data
        self.engine.reset()  # whatever it has missed, it starts from rest
        response.success = True
        response.message = (
            'enabled: the liquid starts from rest with the next good sample'
            if request.data
            else 'disabled: samples are counted, nothing is published'
        )
        self._news.tell('enabled', f'~/set_enabled: {response.message}', INFO)
        return response

    def _report(self) -> None:
        status, finding = self._watch.look()
        message = DiagnosticArray(status=[status])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)
        # what goes on for long is in the diagnostics; the log tells what needs somebody
        self._news.state(finding.subject, finding.text, SEVERITY[finding.level])
        self._news.flush()
        self._fills.bring()
        self._fills.follow()


def main(args: list[str] | None = None) -> None:
    """Run slosh_node until Ctrl-C or SIGTERM."""
    sys.exit(run(SloshNode, args, events=True))


if __name__ == '__main__':
    main()
