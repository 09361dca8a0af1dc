"""Real nodes in processes of their own, and a driver that talks to them over DDS."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType

import psutil
import pytest

rclpy = pytest.importorskip('rclpy', reason='needs the ROS 2 wheels (make venv)')

from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from geometry_msgs.msg import WrenchStamped  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.qos import QoSProfile  # noqa: E402
from sensor_msgs.msg import Imu  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402

TIMEOUT = 20.0  # [s] of anything that must happen; far above what it takes
RESEND = 2.0  # [s]
QOS = QoSProfile(depth=100)
NANOSECONDS = 1_000_000_000


class NodeProcess:
    """A node of the package as a process; ended on leaving the context."""

    def __init__(self, module: str, log: Path, *ros_args: str) -> None:
        self._log = log
        self._file = log.open('w')
        command = [sys.executable, '-m', f'slosh_ros.ros.{module}']
        if ros_args:
            command += ['--ros-args', *ros_args]
        self._process = subprocess.Popen(
            command, stdout=self._file, stderr=subprocess.STDOUT, env=dict(os.environ)
        )

    @property
    def output(self) -> str:
        return self._log.read_text()

    def wait_for(self, text: str, timeout: float = TIMEOUT) -> None:
        """Wait until the node has printed a text."""
        until = time.monotonic() + timeout
        while text not in self.output:
            assert self._process.poll() is None, f'the node ended: {self.output}'
            assert time.monotonic() < until, f'no {text!r} in: {self.output}'
            time.sleep(0.02)

    @property
    def children(self) -> list[psutil.Process]:
        """Processes that it has started and that are not over."""
        return psutil.Process(self._process.pid).children()

    def stop(self, number: int = signal.SIGINT) -> int:
        """Send a signal and return the exit code."""
        self._process.send_signal(number)
        return self.exit_code()

    def exit_code(self) -> int:
        return self._process.wait(TIMEOUT)

    def __enter__(self) -> NodeProcess:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()
        self._file.close()


class Driver:
    """Publishes motion and collects what slosh_node answers."""

    def __init__(self, kind: type = Imu, topic: str = 'imu/data', qos: QoSProfile = QOS) -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = rclpy.create_node('driver', context=self.context)
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)
        self.publisher = self.node.create_publisher(kind, topic, qos)
        self.received: dict[str, list[WrenchStamped]] = {}
        for name in ('wrench', 'wrench_total'):
            messages = self.received[name] = []
            self.node.create_subscription(
                WrenchStamped, f'slosh_node/{name}', messages.append, QOS
            )

    def wait_for_node(self) -> None:
        """Wait until motion and wrenches are connected both ways."""
        self.spin_until(
            lambda: (
                self.publisher.get_subscription_count() > 0
                and all(self.node.count_publishers(f'slosh_node/{name}') for name in self.received)
            )
        )

    def spin_until(self, done: Callable[[], bool], timeout: float = TIMEOUT) -> None:
        until = time.monotonic() + timeout
        while not done():
            assert time.monotonic() < until, 'timed out'
            self._executor.spin_once(timeout_sec=0.05)

    def spin_for(self, seconds: float) -> None:
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left)

    def exchange(self, message: object) -> tuple[WrenchStamped, WrenchStamped]:
        """
        Publish one sample and wait for the wrenches that answer it.

        A best-effort reader that has not yet discovered the driver loses the first sample, and no
        side can see that; so it is sent again. Nor is an answer heard before the node has
        discovered who listens; then the node has to forget the sample before it is sent again.
        """
        count = len(self.received['wrench'])
        sent_until = 0.0

        def answered() -> bool:
            nonlocal sent_until
            if time.monotonic() > sent_until:
                if sent_until and not any(self.received.values()):
                    self._let_forget()
                sent_until = time.monotonic() + RESEND
                self.publisher.publish(message)
            return all(len(m) > count for m in self.received.values())

        self.spin_until(answered)
        return self.received['wrench'][-1], self.received['wrench_total'][-1]

    def _let_forget(self) -> None:
        client = self.node.create_client(Trigger, 'slosh_node/reset')
        if client.service_is_ready():
            self.spin_until(client.call_async(Trigger.Request()).done)
        self.node.destroy_client(client)

    def __enter__(self) -> Driver:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._executor.shutdown()
        self.node.destroy_node()
        self.context.shutdown()


def imu(
    stamp: int, force: tuple[float, ...] = (0.0, 0.0, 9.81), rate: tuple[float, ...] = (0.0,) * 3
) -> Imu:
    """Build an Imu message with the stamp in nanoseconds."""
    message = Imu()
    message.header.frame_id = 'imu_link'
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, NANOSECONDS)
    a, w = message.linear_acceleration, message.angular_velocity
    a.x, a.y, a.z = force
    w.x, w.y, w.z = rate
    return message


def wrench_of(message: WrenchStamped) -> list[float]:
    """Force and moment of a message, six doubles."""
    force, torque = message.wrench.force, message.wrench.torque
    return [force.x, force.y, force.z, torque.x, torque.y, torque.z]


def stamp_of(message: WrenchStamped) -> int:
    """Stamp of a message [ns]."""
    return message.header.stamp.sec * NANOSECONDS + message.header.stamp.nanosec


def call(driver: Driver, kind: type, name: str, request: object) -> object:
    """Call a service and wait for its answer."""
    client = driver.node.create_client(kind, name)
    driver.spin_until(client.service_is_ready)
    future = client.call_async(request)
    driver.spin_until(future.done)
    return future.result()


def diagnostics(driver: Driver) -> dict[str, str]:
    """Values of the next report, with its message."""
    reports: list[DiagnosticArray] = []
    subscription = driver.node.create_subscription(
        DiagnosticArray, '/diagnostics', reports.append, 10
    )
    driver.spin_until(lambda: len(reports) > 1)  # the second began after all that was sent
    driver.node.destroy_subscription(subscription)
    status = reports[-1].status[0]
    return {item.key: item.value for item in status.values} | {'message': status.message}
