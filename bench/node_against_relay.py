"""
What a sample costs: slosh_node against a bare node that copies a field, in one run.

Both are processes of their own and get the same Imu messages over DDS, one after the other was
answered. CPU seconds are those of the node's process; round trips include the driver's own time.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

import psutil
import rclpy
from geometry_msgs.msg import WrenchStamped
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Imu

from slosh_ros.engine import MotionSample, SloshConfig, SloshEngine

CONFIG = Path(__file__).resolve().parents[1] / 'config' / 'half_full_tanker.yaml'
QOS = QoSProfile(depth=100)
STEP = 10_000_000  # [ns]
START = 1_000_000_000


class Relay(Node):
    """Copies the stamp and one field, and publishes as many messages as slosh_node."""

    def __init__(self) -> None:
        super().__init__('slosh_node')
        self._publishers_of = [
            self.create_publisher(WrenchStamped, f'~/{name}', 10)
            for name in ('wrench', 'wrench_total', 'wrench_state')
        ]
        self._message = WrenchStamped()
        self.create_subscription(Imu, 'imu/data', self._on_imu, QOS)
        print('ready', file=sys.stderr, flush=True)

    def _on_imu(self, message: Imu) -> None:
        self._message.header.stamp = message.header.stamp
        self._message.wrench.force.x = message.linear_acceleration.x
        for publisher in self._publishers_of:
            publisher.publish(self._message)


def relay() -> None:
    """Run the relay until it is told to end."""
    rclpy.init()
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(Relay())


def measure(command: list[str], samples: int) -> dict[str, float]:
    """Drive a node and return CPU time per message and percentiles of the round trip [us]."""
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node('driver', context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    answered: list[int] = []
    node.create_subscription(
        WrenchStamped,
        'slosh_node/wrench_state',
        lambda m: answered.append(m.header.stamp.sec),
        QOS,
    )
    publisher = node.create_publisher(Imu, 'imu/data', QOS)
    with tempfile.TemporaryFile() as log:
        process = subprocess.Popen(command, stderr=log, stdout=log)
        while not publisher.get_subscription_count():
            executor.spin_once(timeout_sec=0.05)
        time.sleep(1.0)  # the other direction
        message = Imu()
        message.linear_acceleration.z = 9.81
        trips = []
        for k in range(samples + samples // 10):
            if k == samples // 10:  # warm
                before = sum(psutil.Process(process.pid).cpu_times()[:2])
                trips.clear()
            stamp = START + k * STEP
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 1_000_000_000)
            begin = time.perf_counter()
            publisher.publish(message)
            count = len(answered)
            while len(answered) == count:
                executor.spin_once(timeout_sec=1.0)
            trips.append(time.perf_counter() - begin)
        cpu = (sum(psutil.Process(process.pid).cpu_times()[:2]) - before) / samples
        process.terminate()
        process.wait()
    node.destroy_node()
    context.shutdown()
    trips.sort()
    return {
        'cpu_us': 1e6 * cpu,
        'p50_us': 1e6 * statistics.median(trips),
        'p99_us': 1e6 * trips[int(0.99 * len(trips))],
    }


def engine_cost(samples: int) -> float:
    """Cost of one sample in the engine alone [us]."""
    engine = SloshEngine(SloshConfig.from_file(CONFIG))
    begin = time.perf_counter()
    for k in range(samples):
        engine.feed(MotionSample.from_imu(START + k * STEP, [0.1, 0.1, 9.81], [0.0, 0.1, 0.0]))
    return 1e6 * (time.perf_counter() - begin) / samples


def main() -> None:
    """Measure and print a table; write JSON if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--relay', action='store_true', help=argparse.SUPPRESS)
    parser.add_argument('--samples', type=int, default=3000)
    parser.add_argument('--json', type=Path, help='file for the numbers')
    arguments = parser.parse_args()
    if arguments.relay:
        relay()
        return
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ.setdefault('ROS_DOMAIN_ID', '88')
    results = {
        'relay': measure([sys.executable, __file__, '--relay'], arguments.samples),
        'slosh_node': measure(
            [
                sys.executable, '-m', 'slosh_ros.ros.slosh_node', '--ros-args',
                '--params-file', str(CONFIG),
                '-p', 'qos_overrides./imu/data.subscription.reliability:=reliable',
            ],
            arguments.samples,
        ),
    }  # fmt: skip
    ratios = {k: results['slosh_node'][k] / results['relay'][k] for k in results['relay']}
    feed = engine_cost(arguments.samples)
    print(f'{"":12}{"CPU [us]":>10}{"p50 [us]":>10}{"p99 [us]":>10}')
    for name, row in results.items():
        print(f'{name:12}' + ''.join(f'{value:10.0f}' for value in row.values()))
    print(f'{"ratio":12}' + ''.join(f'{value:10.2f}' for value in ratios.values()))
    print(f'engine alone: {feed:.0f} us a sample (8 modes)')
    if arguments.json:
        numbers = {**results, 'ratio': ratios, 'engine_us': feed}
        arguments.json.write_text(json.dumps(numbers, indent=2))


if __name__ == '__main__':
    main()
