"""
A long drive: whether memory grows and every sample is answered.

A million samples through the engine and a hundred thousand through slosh_node over DDS, as fast as
they go; a bad one among them now and then. Memory (RSS) after the first tenth is what the end is
held against.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

import psutil
from engine import drive, engine_of

from slosh_ros.engine import MotionSample

CONFIG = Path(__file__).resolve().parents[1] / 'config' / 'half_full_tanker.yaml'
STEP = 10_000_000  # [ns]
BAD_EVERY = 50
UNANSWERED = 8  # samples on their way


def resident(pid: int) -> float:
    """Memory that a process holds [MB]."""
    return float(psutil.Process(pid).memory_info().rss) / 2**20


def through_engine(samples: int) -> dict[str, float]:
    """Feed one engine of two tanks."""
    engine, motion = engine_of(2, 8), drive(1000)
    warm, began, answered = 0.0, time.perf_counter(), 0
    for k in range(samples):
        pattern = motion[k % len(motion)]
        stamp = 1_000_000_000 + k * STEP
        force = [float('nan')] * 3 if k % BAD_EVERY == BAD_EVERY - 1 else pattern.force.tolist()
        sample = MotionSample.from_imu(stamp, force, pattern.rate.tolist())
        _, loads = engine.feed(sample)
        if loads is not None:
            answered += bool(loads.wrench.any()) | bool(loads.total.any())
        if k == samples // 10:
            warm = resident(os.getpid())
    return {
        'samples': samples,
        'good': samples - samples // BAD_EVERY,
        'answered': answered,
        'warm_mb': warm,
        'end_mb': resident(os.getpid()),
        'seconds': time.perf_counter() - began,
    }


def through_node(samples: int) -> dict[str, float]:
    """Drive slosh_node; so few samples are on their way that none need get lost."""
    import rclpy
    from geometry_msgs.msg import WrenchStamped
    from rclpy.serialization import serialize_message
    from sensor_msgs.msg import Imu

    from slosh_ros.ros.runtime import EventsExecutor

    answered = 0

    def count(_: bytes) -> None:
        nonlocal answered
        answered += 1

    with ExitStack() as stack:
        rclpy.init()
        stack.callback(rclpy.try_shutdown)
        driver = rclpy.create_node('soak')
        stack.callback(driver.destroy_node)
        executor = EventsExecutor()
        executor.add_node(driver)
        publisher = driver.create_publisher(Imu, '/soak/imu/data', 100)
        driver.create_subscription(WrenchStamped, '/soak/slosh_node/wrench', count, 100, raw=True)
        log = stack.enter_context(tempfile.TemporaryFile())
        process = subprocess.Popen(
            [
                sys.executable, '-m', 'slosh_ros.ros.slosh_node', '--ros-args',
                '-r', '__ns:=/soak', '--params-file', str(CONFIG),
                '-p', 'qos_overrides./soak/imu/data.subscription.reliability:=reliable',
            ],
            stdout=log, stderr=log,
        )  # fmt: skip
        stack.callback(process.wait)
        stack.callback(process.terminate)
        message = Imu()
        message.linear_acceleration.x, message.linear_acceleration.z = 0.1, 9.81
        good = serialize_message(message)
        message.linear_acceleration.x = float('nan')
        bad = serialize_message(message)
        stamp = 1_000_000_000

        def send(data: bytes) -> None:
            nonlocal stamp
            stamp += STEP
            second, rest = divmod(stamp, 1_000_000_000)
            time_of = second.to_bytes(4, 'little') + rest.to_bytes(4, 'little')
            publisher.publish(data[:4] + time_of + data[12:])

        until = time.monotonic() + 30.0
        while not answered:
            if time.monotonic() > until:
                raise SystemExit('error: slosh_node does not answer')
            send(good)
            executor.spin_once(timeout_sec=0.1)
        for _ in range(20):
            executor.spin_once(timeout_sec=0.05)
        answered, expected, warm, began = 0, 0, 0.0, time.perf_counter()
        for k in range(samples):
            is_bad = k % BAD_EVERY == BAD_EVERY - 1
            send(bad if is_bad else good)
            expected += not is_bad
            until = time.monotonic() + 10.0
            while expected - answered > UNANSWERED and time.monotonic() < until:
                executor.spin_once(timeout_sec=0.1)
            if k == samples // 10:
                warm = resident(process.pid)
        for _ in range(20):
            executor.spin_once(timeout_sec=0.05)
        return {
            'samples': samples,
            'good': expected,
            'answered': answered,
            'warm_mb': warm,
            'end_mb': resident(process.pid),
            'seconds': time.perf_counter() - began,
        }


def main() -> None:
    """Drive both and tell; exit with 1 if samples went unanswered."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--engine', type=int, default=1_000_000, help='samples for the engine')
    parser.add_argument('--node', type=int, default=100_000, help='samples for the node')
    given = parser.parse_args()
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ.setdefault('ROS_DOMAIN_ID', '88')
    complete = True
    for name, soak, samples in (
        ('engine', through_engine, given.engine),
        ('slosh_node', through_node, given.node),
    ):
        if not samples:
            continue
        result = soak(samples)
        complete &= result['answered'] == result['good']
        print(
            f'{name}: {result["answered"]:.0f} of {result["good"]:.0f} good samples answered in '
            f'{result["seconds"]:.0f} s; {result["warm_mb"]:.1f} MB after a tenth, '
            f'{result["end_mb"]:.1f} MB at the end',
            flush=True,
        )
    sys.exit(not complete)


if __name__ == '__main__':
    main()
