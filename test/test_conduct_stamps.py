"""slosh_node over DDS: what it makes of stamps that are late, doubled, missing or of no sense."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs the ROS 2 wheels (make venv)')

from conduct_rig import SECOND, START, STEP, TANK, conversation, drive, lively
from geometry_msgs.msg import Twist
from ros_rig import Driver, NodeProcess, imu, stamp_of, wrench_of
from rosgraph_msgs.msg import Clock

from slosh_ros.engine import Verdict
from slosh_ros.engine.engine import SloshEngine

pytestmark = [pytest.mark.ros, pytest.mark.timeout(120)]

MAX_GAP, RESET_GAP, BACKWARD = SECOND // 2, 10 * SECOND, SECOND  # defaults of gate.*
BEGIN = drive([START + k * STEP for k in range(10)])
LAST = START + 9 * STEP
ZETA, SURGE = 0.02, 1.5


@pytest.fixture(scope='module')
def talk(tmp_path_factory):
    folder = tmp_path_factory.mktemp('stamps')
    with conversation(folder, tank=TANK + '      modes: 1\n') as talk:
        yield talk


def good(case):
    return [message for message, verdict in case if verdict.accepted]


ODD = {
    'late': ([LAST - 1, LAST - STEP // 2, LAST - SECOND], Verdict.LATE),
    'duplicate': ([LAST], Verdict.DUPLICATE),
    'a burst of equal stamps': ([LAST] * 20, Verdict.DUPLICATE),
    'zero': ([0], Verdict.ZERO_STAMP),
    'negative': ([-1, -5 * SECOND, -(2**31) * SECOND], Verdict.ZERO_STAMP),
}


@pytest.mark.parametrize('name', ODD)
def test_a_stamp_of_no_use_leaves_no_trace(talk, name):
    """Unanswered, and all later numbers are those of an engine that never saw it."""
    stamps, verdict = ODD[name]
    odd = [(imu(stamp, (50.0, -50.0, 5.0), (1.0, 1.0, 1.0)), verdict) for stamp in stamps]
    case = [*BEGIN, *odd, (lively(LAST + STEP, 0.1), Verdict.ACCEPTED)]
    assert talk.tell(case) == talk.as_if(good(case))


def test_a_stamp_beyond_the_end_of_time_leaves_no_trace(talk):
    """More than a second of nanoseconds after the last second: no answer could bear it."""
    odd = imu(0, (50.0, -50.0, 5.0))
    odd.header.stamp.sec, odd.header.stamp.nanosec = 2**31 - 1, 2**32 - 1
    case = [*BEGIN, (odd, Verdict.OUT_OF_RANGE), (lively(LAST + STEP, 0.1), Verdict.ACCEPTED)]
    assert talk.tell(case) == talk.as_if(good(case))


def test_the_first_of_a_burst_with_equal_stamps_counts(talk):
    stamp = LAST + STEP
    burst = [(imu(stamp, (float(k), 0.0, 9.81)), Verdict.DUPLICATE) for k in range(5)]
    burst[0] = burst[0][0], Verdict.ACCEPTED
    case = [*BEGIN, *burst, (lively(stamp + STEP, 0.1), Verdict.ACCEPTED)]
    assert talk.tell(case) == talk.as_if(good(case))


@pytest.mark.parametrize(
    'start',
    [5 * SECOND, 1_700_000_000 * SECOND + 123, 2**31 * SECOND - 11 * STEP],
    ids=['uptime', 'epoch', 'the last second of int32'],
)
def test_only_differences_of_stamps_count(talk, start):
    """The same drive by any clock gives the same numbers, to the last bit."""
    shifted = drive([start + k * STEP for k in range(10)])
    assert talk.tell(shifted) == talk.tell(BEGIN)


@pytest.mark.parametrize('clock', [1_700_000_000 * SECOND, 2**31 * SECOND - 11 * STEP])
def test_a_source_that_changes_its_clock_starts_anew(talk, clock):
    """From uptime to epoch and back: by no step of 50 years is the liquid integrated through."""
    other = drive([clock + k * STEP for k in range(10)])
    case = [
        *BEGIN,
        (other[0][0], Verdict.RESTARTED_GAP), *other[1:],
        (BEGIN[0][0], Verdict.RESTARTED_BACKWARD), *BEGIN[1:],
    ]  # fmt: skip
    first, second, third = np.split(np.array(talk.tell(case)), 3)
    np.testing.assert_array_equal(second, first)
    np.testing.assert_array_equal(third, first)


def test_one_stamp_from_the_future_costs_a_restart_and_no_more(talk):
    future = imu(START + 3600 * SECOND, (0.0, 0.0, 9.81))
    case = [*BEGIN, (future, Verdict.RESTARTED_GAP)]
    case += [(BEGIN[0][0], Verdict.RESTARTED_BACKWARD), *BEGIN[1:]]
    answers = talk.tell(case)
    assert answers[11:] == answers[:10]


def test_a_bag_that_loops_gives_the_same_numbers_each_time(talk):
    loop = drive([START + k * STEP for k in range(150)])
    again = [(loop[0][0], Verdict.RESTARTED_BACKWARD), *loop[1:]]
    first, second, third = np.split(np.array(talk.tell([*loop, *again, *again])), 3)
    np.testing.assert_array_equal(second, first)
    np.testing.assert_array_equal(third, first)


@pytest.mark.parametrize(
    ('interval', 'verdict'),
    [
        (1, Verdict.ACCEPTED),
        (MAX_GAP, Verdict.ACCEPTED),
        (MAX_GAP + 1, Verdict.COASTED),
        (RESET_GAP, Verdict.COASTED),
        (RESET_GAP + 1, Verdict.RESTARTED_GAP),
        (-BACKWARD - 1, Verdict.RESTARTED_BACKWARD),
    ],
)
def test_limits_hold_to_the_nanosecond(talk, interval, verdict):
    case = [*BEGIN, (lively(LAST + interval, 0.1), verdict)]
    answers = talk.tell(case)
    assert np.isfinite(answers).all()
    if verdict.from_rest:
        assert answers[-1] == talk.as_if([case[-1][0]])[0]


@pytest.fixture(scope='module')
def mode(talk):
    c = SloshEngine(talk.config).tanks[0].coefficients
    return c.omega[0], c.coupling[0, 0], c.mu[0]


def free(t, omega, beta, beta_rate):
    """Let a damped oscillator go: its coordinate and velocity in closed form."""
    decay, damped = ZETA * omega, omega * np.sqrt(1.0 - ZETA**2)
    sine = (beta_rate + decay * beta) / damped
    turn, keep = damped * t, np.exp(-decay * t)
    at = keep * (beta * np.cos(turn) + sine * np.sin(turn))
    return at, -decay * at + keep * damped * (sine * np.cos(turn) - beta * np.sin(turn))


def ramped(t, omega, gain, slope):
    """From rest under s_x = slope t: beta'' + 2 zeta omega beta' + omega^2 beta = -gain s_x."""
    steady = -gain * slope / omega**2
    lag = 2.0 * ZETA / omega
    beta, beta_rate = free(t, omega, steady * lag, -steady)
    return beta + steady * (t - lag), beta_rate + steady


@pytest.mark.parametrize('gap', [0.02, 0.1, 0.37, 0.5])
def test_a_short_gap_is_integrated_through_exactly(talk, mode, gap):
    """Samples lost while the acceleration rises evenly are not missed: F1 = -lambda beta''."""
    omega, coupling, mu = mode
    times = [*(0.01 * k for k in range(20)), 0.19 + gap, 0.20 + gap]
    case = [
        (
            imu(START + round(t * SECOND), (SURGE * t, 0.0, 9.81)),
            Verdict.ACCEPTED if t else Verdict.STARTED,
        )
        for t in times
    ]
    answers = talk.tell(case)
    for t, answer in zip(times[1:], answers[1:], strict=True):
        beta, beta_rate = ramped(t, omega, coupling / mu, SURGE)
        acceleration = (
            -(omega**2) * beta - 2 * ZETA * omega * beta_rate - coupling / mu * SURGE * t
        )
        assert answer[0] == pytest.approx(-coupling * acceleration, rel=1e-10)


@pytest.mark.parametrize('gap', [0.6, 2.0, 9.9])
def test_over_a_long_gap_the_liquid_moves_freely_and_decays(talk, mode, gap):
    """Nobody knows what drove it meanwhile: exp(-zeta omega T), at its own frequency."""
    omega, coupling, mu = mode
    pulse = [0.1 * k for k in range(5)]
    forces = [SURGE * t for t in pulse]
    case = [
        (imu(START + round(t * SECOND), (f, 0.0, 9.81)), Verdict.ACCEPTED)
        for t, f in zip(pulse, forces, strict=True)
    ]
    case[0] = case[0][0], Verdict.STARTED
    end = pulse[-1] + gap
    case.append((imu(START + round(end * SECOND)), Verdict.COASTED))
    answer = talk.tell(case)[-1]
    beta, beta_rate = free(gap, omega, *ramped(pulse[-1], omega, coupling / mu, SURGE))
    acceleration = -(omega**2) * beta - 2 * ZETA * omega * beta_rate
    assert answer[0] == pytest.approx(-coupling * acceleration, rel=1e-9)


def test_a_very_long_gap_starts_from_rest(talk):
    later = drive([LAST + 3600 * SECOND + k * STEP for k in range(10)])
    case = [*BEGIN, (later[0][0], Verdict.RESTARTED_GAP), *later[1:]]
    answers = talk.tell(case)
    assert answers[10:] == talk.as_if([message for message, _ in later])


def test_every_verdict_of_these_cases_was_counted(talk):
    assert talk.expected
    assert talk.counted() == {v.value: n for v, n in talk.expected.items()}


class Simulation:
    """A /clock, and a Twist that only the clock stamps."""

    def __init__(self, driver: Driver) -> None:
        self._driver = driver
        self._clock = driver.node.create_publisher(Clock, '/clock', 10)

    def set(self, time: int) -> None:
        """Tell the time [ns] and wait until the node must have heard it."""
        message = Clock()
        message.clock.sec, message.clock.nanosec = divmod(time, SECOND)
        self._driver.spin_until(lambda: self._clock.get_subscription_count() > 0)
        for _ in range(3):  # the node hears it best-effort
            self._clock.publish(message)
            self._driver.spin_for(0.03)

    def move(self, speed: float) -> None:
        message = Twist()
        message.linear.x = speed
        self._driver.publisher.publish(message)
        self._driver.spin_for(0.1)


def test_simulated_time_from_before_its_first_message_to_a_jump_back(tmp_path):
    """A Twist is stamped by the clock: not before it runs, not while it stands, never twice."""
    (tmp_path / 'tank.yaml').write_text(TANK)
    with (
        NodeProcess(
            'slosh_node', tmp_path / 'node.log', '--params-file', str(tmp_path / 'tank.yaml'),
            '-p', 'use_sim_time:=true', '-p', 'input.source:=twist',
            '-p', 'input.twist_stamped:=false',
            '-p', 'qos_overrides./twist.subscription.reliability:=reliable',
        ) as node,
        Driver(Twist, 'twist') as driver,
    ):  # fmt: skip
        node.wait_for('ready')
        driver.wait_for_node()
        answers = driver.received['wrench']
        # the watchdog's clock is steady: it speaks although simulated time has not begun
        node.wait_for('waiting for data on /twist')
        world = Simulation(driver)
        for speed in (9.0, 8.9):
            world.move(speed)
        assert not answers  # no time yet
        world.set(START)
        world.move(9.0)
        driver.spin_until(lambda: len(answers) == 1)
        world.move(8.9)  # paused
        world.move(8.8)
        assert len(answers) == 1
        world.set(START + SECOND // 10)
        world.move(8.9)
        driver.spin_until(lambda: len(answers) == 2)
        moving = wrench_of(answers[-1])
        assert moving[0] != 0.0
        world.set(START + 3600 * SECOND)  # a jump ahead
        world.move(8.0)
        driver.spin_until(lambda: len(answers) == 3)
        assert wrench_of(answers[-1]) == [0.0] * 6  # from rest, at constant speed
        world.set(START)  # and back, as a bag does that is played in a loop
        world.move(9.0)
        driver.spin_until(lambda: len(answers) == 4)
        world.set(START + SECOND // 10)
        world.move(8.9)
        driver.spin_until(lambda: len(answers) == 5)
        assert wrench_of(answers[-1]) == moving
        later = [START, START + SECOND // 10, START + 3600 * SECOND]
        assert [stamp_of(m) for m in answers] == [*later, *later[:2]]
        node.wait_for('zero stamp')
