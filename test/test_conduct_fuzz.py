"""
What no sensor and no user should send: any doubles, any stamps, any YAML, any bytes of a bag.

A few thousand cases, always the same ones; SLOSH_FUZZ=20 tries twenty times as many new ones.
"""

from __future__ import annotations

import math
import os
import random
import re
import string
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from conftest import REPOSITORY
from drives import SECOND, START, stamps, write_bag
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from test_bad_input import within

from slosh_ros.engine import Loads, MotionSample, SloshConfig, SloshEngine, Verdict, feed_message
from slosh_ros.engine.parameters import PARAMETERS
from slosh_ros.errors import InputError
from slosh_ros.parameters import Parameter

MORE = int(os.environ.get('SLOSH_FUZZ', '0'))
pytestmark = pytest.mark.timeout(300 * max(MORE, 1))


def cases(number: int) -> settings:
    """Try so many examples, and more if asked."""
    return settings(
        max_examples=number * max(MORE, 1),
        derandomize=not MORE,
        database=None,
        deadline=None,
        suppress_health_check=list(HealthCheck),
    )


SPECIAL = (
    0.0, -0.0, 5e-324, 2.2e-308, 1e-9, 1.0, -1.0, 9.81, -9.81, 199.9, 200.0, 200.1, 40.0, -40.0,
    150.0, 32767.0, 1e19, 1e154, 1e155, 1e308, -1.7976931348623157e308,
    float('nan'), float('inf'), float('-inf'),
)  # fmt: skip
JUMPS = (1, 2, 3, SECOND // 2, SECOND // 2 + 1, 10 * SECOND, -1, -SECOND, -SECOND - 1, 0, 2**55)


class Adversary:
    """Whatever a broken sensor and a clock gone mad may send; never the same twice."""

    def __init__(self, seed: int) -> None:
        self._dice = np.random.default_rng(seed)
        self._stamp = START

    def vector(self) -> list[float]:
        """Three doubles: a believable motion, with absurd components now and then."""
        value = self._dice.uniform(-15.0, 15.0, 3)
        if self._dice.random() < 0.3:
            odd = self._dice.random(3) < 0.5
            value[odd] = self._dice.choice(SPECIAL, odd.sum())
        if self._dice.random() < 0.1:  # any bits of a double
            value[self._dice.integers(3)] = np.frombuffer(self._dice.bytes(8))[0]
        return [float(v) for v in value]

    def stamp(self) -> int:
        """Mostly 10 ms on; or a jump, up to the ends of what a stamp can hold [ns]."""
        kind = self._dice.random()
        if kind < 0.6:
            self._stamp += 10_000_000
        elif kind < 0.8:
            self._stamp += int(self._dice.integers(-2 * SECOND, 20 * SECOND))
        elif kind < 0.97:
            self._stamp += int(self._dice.choice(JUMPS))
        else:
            self._stamp = int(self._dice.integers(-(2**31), 2**31)) * SECOND
        lost = self._stamp <= 0 and self._dice.random() < 0.3  # not for long: all are refused
        if lost or not -(2**31) * SECOND < self._stamp < (2**31 - 1) * SECOND:
            self._stamp = START
        return self._stamp

    def sample(self) -> MotionSample:
        return MotionSample(self.stamp(), *(np.array(self.vector()) for _ in range(3)))

    def fill(self, message: Any) -> Any:
        """Fill in the fields of an Imu, all of them."""
        header, stamp = message.header, self.stamp()
        header.stamp.sec, header.stamp.nanosec = divmod(stamp, SECOND)
        if self._dice.random() < 0.05:
            header.stamp.sec = int(self._dice.choice([header.stamp.sec, 2**31 - 1, -(2**31)]))
            header.stamp.nanosec = int(self._dice.integers(2**32))
        header.frame_id = str(self._dice.choice(['imu_link', '', 'ö/☃'], p=[0.9, 0.05, 0.05]))
        for name in ('linear_acceleration', 'angular_velocity'):
            vector = getattr(message, name)
            vector.x, vector.y, vector.z = self.vector()
            covariance = getattr(message, f'{name}_covariance')
            covariance[0] = float(self._dice.choice([0.0, -1.0, np.nan], p=[0.9, 0.05, 0.05]))
        turn = message.orientation
        turn.x, turn.y, turn.z, turn.w = [*self.vector(), 1.0]
        return message


ENGINES = {
    'one tank': {},
    'undamped, many modes': {'tank.damping_ratio': 0.0, 'tank.modes': 40},
    'credulous gate': {'gate.max_specific_force': 1e4, 'gate.max_angular_rate': 1e3},
    'no backward jump': {
        'gate.backward_jump': 0.0,
        'gate.max_gap': 0.001,
        'gate.reset_gap': 0.001,
    },
    'filtered, far IMU': {'loads.cutoff': 1.0, 'imu.xyz': [1e3, -1e3, 1e3], 'imu.rpy': [1.0] * 3},
    'with pressure': {'pressure.front': [4.0, 0.0, -0.7]},
}


def engine_of(name: str, **changes: object) -> SloshEngine:
    tank = {
        'tank.shape': 'rectangular', 'tank.length': 8.0, 'tank.width': 2.0, 'tank.height': 1.6,
        'tank.fill_depth': 0.8, 'tank.damping_ratio': 0.02,
    }  # fmt: skip
    return SloshEngine(SloshConfig.from_parameters(tank | ENGINES[name] | changes))


def numbers(loads: Loads) -> list[float]:
    return [
        *loads.wrench, *loads.total, *loads.state, *loads.pressure,
        loads.elevation_max, loads.trust.value,
    ]  # fmt: skip


class Twins:
    """An engine that gets everything, and one that gets only what the first accepted."""

    def __init__(self, engine: SloshEngine, twin: SloshEngine) -> None:
        self.engine, self.twin = engine, twin

    def feed(self, feed_to: Callable[..., Any], sample: object) -> Verdict:
        verdict, loads = feed_to(self.engine, sample)
        assert (loads is not None) == verdict.accepted
        if loads is not None:
            assert np.isfinite(numbers(loads)).all()
            same, unspoilt = feed_to(self.twin, sample)
            assert same is verdict
            assert numbers(unspoilt) == numbers(loads)
        return verdict

    def restart(self) -> None:
        """Put the liquid to rest: to solve for a tank anew costs more than many samples."""
        self.engine.reset()
        self.twin.reset()


PAIRS = {name: Twins(engine_of(name), engine_of(name)) for name in ENGINES}

NUMBER = st.one_of(st.floats(-15.0, 15.0), st.floats(), st.sampled_from(SPECIAL))
VECTOR = st.tuples(*[NUMBER] * 3).map(np.array)
INTERVAL = st.one_of(st.just(10_000_000), st.integers(-(2**62), 2**62), st.sampled_from(JUMPS))


@cases(60)
@given(
    st.sampled_from(sorted(ENGINES)),
    st.lists(st.tuples(INTERVAL, VECTOR, VECTOR, VECTOR), min_size=3, max_size=8),
)
def test_no_sample_spoils_the_next_good_one(name, drive):
    """No exception, no overflow, nothing but finite numbers, exact recovery; small and varied."""
    twins, stamp = PAIRS[name], START
    twins.restart()
    for interval, *vectors in drive:
        stamp += interval
        twins.feed(SloshEngine.feed, MotionSample(stamp, *vectors))


@pytest.mark.parametrize('name', ENGINES)
def test_ten_thousand_samples_of_an_adversary(name):
    """The same over long drives: 10,000 samples of all engines together."""
    twins, adversary = PAIRS[name], Adversary(len(name) + MORE)
    twins.restart()
    verdicts = {
        twins.feed(SloshEngine.feed, adversary.sample()) for _ in range(1700 * max(MORE, 1))
    }
    assert verdicts >= {Verdict.ACCEPTED, Verdict.NON_FINITE, Verdict.OUT_OF_RANGE}
    assert verdicts >= {Verdict.RESTARTED_BACKWARD, Verdict.RESTARTED_GAP, Verdict.ZERO_STAMP}


INPUTS = {
    'imu': {},
    'imu of one frame': {'input.imu_frame': 'imu_link'},
    'stamped twist': {'input.source': 'twist'},
    'twist': {'input.source': 'twist', 'input.twist_stamped': False},
}


def blank() -> SimpleNamespace:
    """Fields of an Imu, a TwistStamped and a Twist at once; none of the classes is needed."""
    linear, angular = (SimpleNamespace(x=0.0, y=0.0, z=0.0) for _ in range(2))
    return SimpleNamespace(
        header=SimpleNamespace(stamp=SimpleNamespace(sec=0, nanosec=0), frame_id=''),
        orientation=SimpleNamespace(),
        linear_acceleration=linear, linear_acceleration_covariance=[0.0],
        angular_velocity=angular, angular_velocity_covariance=[0.0],
        linear=linear, angular=angular, twist=SimpleNamespace(linear=linear, angular=angular),
    )  # fmt: skip


@pytest.mark.parametrize('name', INPUTS)
def test_ten_thousand_messages_of_an_adversary(name):
    """From the fields of messages, without rclpy: 10,000 of all inputs together."""
    twins = Twins(*(engine_of('one tank', **INPUTS[name]) for _ in range(2)))
    adversary, verdicts = Adversary(len(name) + MORE), set()
    for _ in range(2500 * max(MORE, 1)):
        message, received = adversary.fill(blank()), adversary.stamp()

        def fed(engine: SloshEngine, sent: object, at: int = received) -> tuple[Verdict, Any]:
            return feed_message(engine, sent, at)

        verdicts.add(twins.feed(fed, message))
    assert verdicts >= {Verdict.ACCEPTED, Verdict.NON_FINITE, Verdict.OUT_OF_RANGE}
    assert (Verdict.NO_DATA in verdicts) == name.startswith('imu')
    assert (Verdict.WRONG_FRAME in verdicts) == (name == 'imu of one frame')


TEXTS = st.one_of(
    st.text(max_size=8),
    st.text(string.printable, max_size=12),
    st.sampled_from([
        '1.0', '8', '-8.0', '.nan', '.inf', '-.inf', '1e400', '1.0e+999', '0x1F', '0o17', '0b1',
        '1:30', '2001-01-01', '2001-99-99', '~', 'null', 'true', 'yes', '""', "''", '[]', '{}',
        '[1.0, 2.0, 3.0]', '[1.0, [2.0]]', '[[', '{', '}', '- 1', '&a 1.0', '*a', '*b', '<<: *a',
        '!!binary aGVsbG8=', '!!python/object:os.system x', '!!set {a}', '!!int x', '!!float x',
        '!!timestamp x', '!x y', '!<tag:yaml.org,2002:int> "z"', '? [1, 2]', '? {a: b}',
        '%YAML 1.1', '%YAML 9.9', '---', '...', '|', '>', '|9', '@', '`', '\t', '\x00', '\x07',
        '\ufeff', '\u2028', '\ud7ff', '☃', 'rectangular', 'section_x', 'tank_link', '[tank, tank]',
        "['']", '[1.0, .nan]', '9' * 30, '9' * 5000, '1' + '0' * 400 + '.0',
        '[' * 50, '[' * 300, '{a: ' * 300, '- ' * 700,
    ]),
)  # fmt: skip
CONFIGS = [
    path.read_text(encoding='utf-8') for path in sorted((REPOSITORY / 'config').glob('*.yaml'))
]


@st.composite
def spoilt_file(draw) -> bytes:
    """Take a shipped file and spoil it: a value, a key, an indent, a line, a byte."""
    lines = draw(st.sampled_from(CONFIGS)).splitlines()
    lines = [line for line in lines if line.strip() and not line.lstrip().startswith('#')]
    for _ in range(draw(st.integers(1, 3))):
        at = draw(st.integers(0, len(lines) - 1))
        key, colon, value = lines[at].partition(':')
        text = draw(TEXTS)
        lines[at] = draw(st.sampled_from([
            f'{key}: {text}', f'{key}{colon}{value} {text}', f'{key}{text}:{value}', text, '',
            f'{" " * (len(key) - len(key.lstrip()))}{text}: {value}',
            f' {lines[at]}', lines[at].lstrip(), f'{lines[at]}\n{lines[at]}',
            f'{key}:\n{" " * 12}{text}: {value}', f'{key}: [{value}, {text}]',
        ]))  # fmt: skip
    content = bytearray('\n'.join(lines).encode('utf-8', 'surrogatepass'))
    for _ in range(draw(st.sampled_from([0, 0, 0, 1, 3]))):
        content[draw(st.integers(0, len(content) - 1))] = draw(st.integers(0, 255))
    return bytes(content)


@pytest.fixture(scope='module')
def file(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp('fuzz') / 'tank.yaml'


def checked_in_one_line(file: Path, content: bytes) -> None:
    """`slosh check` finds it good, or says one sentence and exits with 1."""
    file.write_bytes(content)
    code, out, err = within(['check', file])
    if code == 0:
        assert 'good' in out
    else:
        assert (code, out) == (1, '')
        assert err.startswith('error: ')
        assert err.count('\n') == 1, err
        assert len(err) < 1000


@cases(80)
@given(content=spoilt_file())
def test_a_spoilt_parameter_file_is_refused_in_one_line(file, content):
    checked_in_one_line(file, content)


@cases(60)
@given(
    content=st.one_of(st.binary(max_size=200), TEXTS.map(lambda t: t.encode('utf-8', 'ignore')))
)
def test_what_is_no_parameter_file_at_all_is_refused_in_one_line(file, content):
    checked_in_one_line(file, content)


@pytest.mark.parametrize('row', PARAMETERS, ids=lambda row: row.name)
def test_every_parameter_refuses_what_does_not_fit(row):
    """Beyond its range by a rounding, not finite, of another type, or none of its choices."""
    wrong: list[object] = [None, {}, b'1', [[]], [None], object()]
    if row.kind != 'bool':
        wrong += [True, [True]]
    if row.kind not in ('string', 'file'):  # which take any text
        wrong += ['1.0']
    if row.kind != 'string[]':
        wrong += [['1.0']]
    if 'double' in row.kind:
        numbers = [math.nan, math.inf, -math.inf, 1, *_beyond(row)]
        wrong += [[n] * 3 for n in numbers] if '[' in row.kind else numbers
    if row.kind == 'int':
        wrong += [1.0, int(row.lower) - 1, int(row.upper) + 1, 10**400]
    if row.choices:
        wrong += ['', 'no such thing', f'{row.choices[0]} ']
    for value in wrong:
        with pytest.raises(InputError, match=re.escape(row.name)) as refusal:
            row.checked(value)
        assert '\n' not in str(refusal.value)


def _beyond(row: Parameter) -> list[float]:
    within = [row.lower, row.upper]
    return [
        math.nextafter(edge, way) for edge, way in zip(within, (-math.inf, math.inf), strict=True)
        if math.isfinite(edge)
    ]  # fmt: skip


KINDS = ('mcap', 'mcap_zstd', 'sqlite3', 'sqlite3_zstd', 'ros1')
BAGS = 60  # spoilt copies of each kind


def test_a_spoilt_bag_is_refused_or_read_whole(tmp_path):
    """In a process of its own, for rosbags leaves damaged bags open."""
    seed = random.SystemRandom().randrange(10**9) if MORE else 1
    arguments = [str(tmp_path), str(seed), str(BAGS * max(MORE, 1))]
    result = subprocess.run(
        [sys.executable, '-W', 'ignore', __file__, *arguments],
        capture_output=True, text=True, check=False, timeout=250 * max(MORE, 1),
        env=os.environ | {'PYTHONPATH': os.pathsep.join(sys.path)},
    )  # fmt: skip
    assert result.returncode == 0, f'{arguments}: {result.stderr}'
    kinds = result.stdout.splitlines()
    assert len(kinds) == len(KINDS)
    for line in kinds:
        refused, whole = map(int, line.split())
        assert refused + whole == int(arguments[-1])
        assert refused > 0.2 * BAGS
        assert whole > 0


def read_spoilt_bags(folder: Path, kind: str, seed: int, number: int) -> None:
    """Spoil a small bag again and again; print how many were refused and how many read whole."""
    import gc

    from slosh_ros.bag.reader import MotionBag
    from slosh_ros.engine.convert import IMU

    folder.mkdir()
    dice = random.Random(seed)
    path = folder / ('drive.bag' if kind == 'ros1' else 'drive')
    write_bag(path, stamps(0.5, 0.01), lambda t: (t, 0.0, 9.81), kind)
    files = [path] if kind == 'ros1' else sorted(path.iterdir())
    originals = {file: file.read_bytes() for file in files}
    refused = whole = 0
    for k in range(number):
        for file, content in originals.items():
            file.write_bytes(content)
        victim = dice.choice(files)
        victim.write_bytes(spoilt(dice, originals[victim]))
        try:
            with MotionBag(path, IMU) as bag:
                read = [message for message, _ in bag.messages()]
                assert len(read) == bag.count
                assert all(hasattr(message, 'linear_acceleration') for message in read)
            whole += 1
        except InputError as error:
            refused += str(path) in str(error) and '\n' not in str(error)
        except BaseException as error:
            raise AssertionError(f'case {k}: {error!r}') from error
        if k % 20 == 0:
            gc.collect()
    print(refused, whole)


def spoilt(dice: random.Random, content: bytes) -> bytes:
    """Flip, cut, insert or double a few bytes."""
    data = bytearray(content)
    for _ in range(dice.choice((1, 1, 1, 3, 30))):
        at = dice.randrange(len(data)) if data else 0
        size = dice.choice((1, 1, 4, 8, 64, 1000))
        match dice.randrange(6):
            case 0 | 1:
                data[at : at + 1] = bytes([dice.randrange(256)])
            case 2:
                del data[at:]
            case 3:
                del data[at : at + size]
            case 4:
                data[at:at] = dice.randbytes(size)
            case _:
                data[at : at + 8] = dice.choice((b'\xff' * 8, b'\x00' * 8, b'\xff' * 7 + b'\x7f'))
    return bytes(data)


if __name__ == '__main__':
    for kind in KINDS:
        read_spoilt_bags(Path(sys.argv[1]) / kind, kind, int(sys.argv[2]), int(sys.argv[3]))
