"""
How fast `slosh replay` is: against reading and deserialising the same bag, in one run.

The engine has 8 modes, the stamps jitter as those of a real recording. All ways through the bag
take turns; of each the fastest counts.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from slosh_ros.bag import MotionBag, Peaks, replay, writer_for
from slosh_ros.engine import SloshConfig, SloshEngine
from slosh_ros.engine.convert import IMU

CONFIG = """\
/**:
  ros__parameters:
    tank:
      shape: cylinder_x
      radius: 1.125
      length: 14.0
      fill_ratio: 0.5
      modes: 8
      damping_ratio: 0.01
"""
STORE = get_typestore(Stores.ROS2_JAZZY)
KIND = 'sensor_msgs/msg/Imu'
STEP, JITTER = 10_000_000, 300_000  # [ns]
TOPIC = '/imu/data'

# prints how much memory the process has held at most [kB]
RESIDENT = """\
import resource, sys
from slosh_ros.cli import app
app(sys.argv[1:], standalone_mode=False)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


def write_bag(path: Path, samples: int) -> Path:
    """Write a drive of gentle braking and steering as an MCAP bag."""
    types, rng = STORE.types, np.random.default_rng(1)
    vector, unknown = types['geometry_msgs/msg/Vector3'], np.zeros(9)
    level = types['geometry_msgs/msg/Quaternion'](0.0, 0.0, 0.0, 1.0)
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection(TOPIC, KIND, typestore=STORE)
        for k in range(samples):
            t = k * STEP / 1e9
            stamp = 10**18 + k * STEP + int(rng.integers(JITTER))
            message = types[KIND](
                header=types['std_msgs/msg/Header'](
                    stamp=types['builtin_interfaces/msg/Time'](*divmod(stamp, 10**9)),
                    frame_id='imu_link',
                ),
                orientation=level,
                orientation_covariance=unknown,
                angular_velocity=vector(0.0, 0.0, 0.02 * np.sin(0.1 * t)),
                angular_velocity_covariance=unknown,
                linear_acceleration=vector(0.3 * np.sin(0.3 * t), 0.2 * np.sin(0.1 * t), 9.81),
                linear_acceleration_covariance=unknown,
            )
            writer.write(connection, stamp, STORE.serialize_cdr(message, KIND))
    return path


def read(bag: Path) -> None:
    """Read and deserialise, no more: the measure of it all."""
    with AnyReader([bag], default_typestore=STORE) as reader:
        for connection, _, raw in reader.messages():
            reader.deserialize(raw, connection.msgtype)


def replayed(bag: Path, config: SloshConfig, out: Path | None = None) -> None:
    """Replay as the command does."""
    engine = SloshEngine(config)
    writers = [Peaks(engine)] + ([writer_for(out, config)] if out else [])
    with MotionBag(bag, IMU, TOPIC) as source:
        replay(source, engine, writers)


def measure(samples: int = 100_000, repeats: int = 3) -> dict[str, float]:
    """
    Compare the ways through a bag.

    Returns
    -------
    dict
        Microseconds a sample of each, and their rates over that of reading and deserialising.
    """
    with tempfile.TemporaryDirectory() as folder:
        bag = write_bag(Path(folder) / 'bag', samples)
        file = Path(folder) / 'tank.yaml'
        file.write_text(CONFIG)
        config = SloshConfig.from_file(file)
        ways: dict[str, Callable[[], None]] = {
            'read': lambda: read(bag),
            'replay': lambda: replayed(bag, config),
            'replay_csv': lambda: replayed(bag, config, Path(folder) / 'loads.csv'),
            'replay_mcap': lambda: replayed(bag, config, Path(folder) / 'loads.mcap'),
        }
        best = dict.fromkeys(ways, float('inf'))
        for _ in range(repeats):
            for name, way in ways.items():
                start = time.process_time()
                way()
                best[name] = min(best[name], (time.process_time() - start) / samples * 1e6)
    result = {f'{name}_us': cost for name, cost in best.items()}
    result |= {f'{name}_rate': best['read'] / best[name] for name in list(ways)[1:]}
    return result


def resident(samples: int) -> float:
    """Return the memory that the command holds at most while it replays a bag [MB]."""
    with tempfile.TemporaryDirectory() as folder:
        bag = write_bag(Path(folder) / 'bag', samples)
        file = Path(folder) / 'tank.yaml'
        file.write_text(CONFIG)
        command = [sys.executable, '-c', RESIDENT, 'replay', str(bag), '--config', str(file)]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
    return int(done.stdout.split()[-1]) / 1024.0


def main() -> None:
    """Print a table, and JSON for machines."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--samples', type=int, default=100_000)
    parser.add_argument('--repeats', type=int, default=3)
    parser.add_argument('--memory', type=int, nargs='*', default=[], help='samples of more bags')
    given = parser.parse_args()
    result = measure(given.samples, given.repeats)
    for name in ('read', 'replay', 'replay_csv', 'replay_mcap'):
        rate = result.get(f'{name}_rate', 1.0)
        print(f'{name:12s} {result[f"{name}_us"]:8.1f} us a sample, rate {rate:.2f}')
    for samples in given.memory:
        result[f'resident_{samples}_mb'] = resident(samples)
        print(f'{samples} samples: at most {result[f"resident_{samples}_mb"]:.0f} MB')
    print(json.dumps(result))


if __name__ == '__main__':
    main()
