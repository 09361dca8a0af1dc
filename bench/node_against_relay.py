"""
What slosh_node costs above a bare node: latency from Imu to Wrench, and CPU time per message.

Both nodes run at once, each on topics of its own and with the same executor, QoS and number of
listeners. They are driven by turns, block after block, so that whatever else the machine does hits
both. The driver hands over and takes serialised messages: its own share of a round trip is small.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import psutil
import rclpy
from geometry_msgs.msg import WrenchStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from rich.console import Console
from rich.table import Table
from sensor_msgs.msg import Imu

from slosh_ros.ros.runtime import EventsExecutor, run

CONFIG = Path(__file__).resolve().parents[1] / 'config' / 'half_full_tanker.yaml'
RATES = (100, 200, 500, 1000)  # [Hz]
BLOCK = 1.5  # [s]
ROUNDS = 4
TARGETS = {'p50': 1.15, 'p99': 1.3, 'cpu': 1.3}
_SENSOR = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
_STAMP = slice(4, 12)  # of a header in CDR


class Relay(Node):
    """Copies the stamp and one field of an Imu into a Wrench."""

    def __init__(self) -> None:
        super().__init__('relay')
        self._publisher = self.create_publisher(WrenchStamped, '~/wrench', 10)
        self._message = WrenchStamped()
        self._message.header.frame_id = 'base_link'
        self.create_subscription(Imu, 'imu/data', self._on_imu, _SENSOR)

    def _on_imu(self, message: Imu) -> None:
        self._message.header.stamp = message.header.stamp
        self._message.wrench.force.x = message.linear_acceleration.x
        self._publisher.publish(self._message)


class Side:
    """
    One of the two nodes, and what was measured of it.

    Parameters
    ----------
    driver : Node
        Speaks to it.
    name : str
        Of the node, and of its namespace.
    pid : int
        Of its process.
    """

    def __init__(self, driver: Node, name: str, pid: int) -> None:
        self._process = psutil.Process(pid)
        self.publisher = driver.create_publisher(Imu, f'/{name}/imu/data', _SENSOR)
        self._listener = driver.create_subscription(
            WrenchStamped, f'/{name}/{name}/wrench', self._on_wrench, 100, raw=True
        )
        self._sent: dict[bytes, float] = {}
        self.trips: list[float] = []
        self.cpu, self.messages = 0.0, 0

    @property
    def connected(self) -> bool:
        """Whether samples and wrenches find their way."""
        return self.publisher.get_subscription_count() > 0 and bool(self.trips)

    def send(self, message: bytes) -> None:
        """Send a sample and remember when."""
        self._sent[message[_STAMP]] = time.perf_counter()
        self.publisher.publish(message)

    @contextmanager
    def block(self) -> Iterator[None]:
        """Count the CPU time and the messages of a block."""
        before, answered = sum(self._process.cpu_times()[:2]), len(self.trips)
        yield
        self.cpu += sum(self._process.cpu_times()[:2]) - before
        self.messages += len(self.trips) - answered

    def forget(self) -> None:
        """Begin anew."""
        self.trips.clear()
        self._sent.clear()
        self.cpu, self.messages = 0.0, 0

    def figures(self, sent: int) -> dict[str, float]:
        """Percentiles and CPU time [us], and the share of samples that were not answered."""
        trips = sorted(self.trips)
        return {
            'p50': 1e6 * statistics.median(trips),
            'p99': 1e6 * trips[int(0.99 * len(trips))],
            'cpu': 1e6 * self.cpu / self.messages,
            'lost': 1.0 - len(trips) / sent,
        }

    def _on_wrench(self, message: bytes) -> None:
        sent = self._sent.pop(bytes(message[_STAMP]), None)
        if sent is not None:
            self.trips.append(time.perf_counter() - sent)


class Duel:
    """The two nodes in processes of their own, and the driver."""

    def __init__(self, stack: ExitStack) -> None:
        rclpy.init()
        stack.callback(rclpy.try_shutdown)
        self._driver = rclpy.create_node('bench')
        stack.callback(self._driver.destroy_node)
        self._executor = EventsExecutor()
        self._executor.add_node(self._driver)
        log = stack.enter_context(tempfile.TemporaryFile())  # noqa: SIM115
        commands = {
            'relay': [sys.executable, __file__, '--relay', '--ros-args'],
            'slosh_node': [
                sys.executable, '-m', 'slosh_ros.ros.slosh_node', '--ros-args',
                '--params-file', str(CONFIG),
            ],
        }  # fmt: skip
        self.sides = {}
        for name, command in commands.items():
            process = subprocess.Popen([*command, '-r', f'__ns:=/{name}'], stdout=log, stderr=log)
            stack.callback(process.wait)
            stack.callback(process.terminate)
            self.sides[name] = Side(self._driver, name, process.pid)
        self._stamp = 1_000_000_000
        until = time.monotonic() + 30.0
        while not all(side.connected for side in self.sides.values()):
            if time.monotonic() > until:
                raise SystemExit('error: the nodes do not answer')
            for side in self.sides.values():
                self._drive(side, 20, 2)

    def measure(self, rate: int, block: float, rounds: int) -> dict[str, dict[str, float]]:
        """Drive both by turns at a rate [Hz], in blocks of some length [s]."""
        count = max(round(block * rate), 1)
        for side in self.sides.values():
            self._drive(side, rate, count // 4 + 1)  # warm
            side.forget()
        for turn in range(rounds):
            sides = list(self.sides.values())
            for side in sides if turn % 2 else reversed(sides):
                with side.block():
                    self._drive(side, rate, count)
        return {name: side.figures(count * rounds) for name, side in self.sides.items()}

    def _drive(self, side: Side, rate: int, count: int) -> None:
        message, step = Imu(), 1_000_000_000 // rate
        message.header.frame_id = 'imu_link'
        message.linear_acceleration.x, message.linear_acceleration.z = 0.1, 9.81
        message.angular_velocity.z = 0.02
        data = serialize_message(message)
        due = time.perf_counter()
        for _ in range(count):
            self._stamp += step
            seconds, rest = divmod(self._stamp, 1_000_000_000)
            stamp = seconds.to_bytes(4, 'little') + rest.to_bytes(4, 'little')
            side.send(data[:4] + stamp + data[12:])
            due += 1.0 / rate
            self._spin_until(due)
        self._spin_until(due + 0.05)  # the last answers

    def _spin_until(self, due: float) -> None:
        while (left := due - time.perf_counter()) > 0.0:
            self._executor.spin_once(timeout_sec=left)


def main(block: float = BLOCK, rounds: int = ROUNDS) -> dict[str, object]:
    """Measure at all rates, print a table and return the numbers."""
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ.setdefault('ROS_DOMAIN_ID', '88')
    results: dict[str, object] = {'targets': TARGETS}
    table = Table('rate [Hz]', 'node', 'p50 [us]', 'p99 [us]', 'CPU a message [us]', 'lost')
    with ExitStack() as stack:
        duel = Duel(stack)
        for rate in RATES:
            row = duel.measure(rate, block, rounds)
            for name, f in row.items():
                table.add_row(
                    f'{rate}', name, *(f'{f[key]:.0f}' for key in TARGETS), f'{f["lost"]:.1%}'
                )
            ratio = {key: row['slosh_node'][key] / row['relay'][key] for key in TARGETS}
            table.add_row('', 'ratio', *(f'{value:.2f}' for value in ratio.values()))
            results[str(rate)] = {**row, 'ratio': ratio}
    Console(width=100).print(table)
    return results


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--relay', action='store_true', help=argparse.SUPPRESS)
    parser.add_argument('--block', type=float, default=BLOCK, help='length of a turn [s]')
    parser.add_argument('--rounds', type=int, default=ROUNDS, help='turns of each node')
    given, others = parser.parse_known_args()
    if given.relay:
        sys.exit(run(Relay, [sys.argv[0], *others], events=True))
    main(given.block, given.rounds)
