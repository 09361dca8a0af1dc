"""The exchange of sloshing wrenches with messages late, lost, and a liquid that falls silent."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from conftest import REPOSITORY

from slosh_ros.engine import MotionSample, SloshConfig, SloshEngine
from slosh_ros.study.demo import closed_loop_reference
from slosh_ros.vehicle import TruckSimulator
from slosh_ros.vehicle.exchange import Link, WrenchExchange
from slosh_ros.vehicle.scenario import Scenario

MS = 1_000_000  # [ns]
SCENARIO = REPOSITORY / 'config/scenarios/brake_bump.yaml'
UNIT = np.arange(1.0, 7.0)


def told(until: int) -> WrenchExchange:
    """Heard a wrench that grows linearly, every 10 ms."""
    exchange = WrenchExchange()
    for time in range(0, until + 1, 10 * MS):
        exchange.receive(time, UNIT * time * 1e-9)
        exchange.at(time)
    return exchange


def test_a_linear_wrench_is_extrapolated_exactly():
    exchange = told(100 * MS)
    for age in (0, 3 * MS, 10 * MS, 50 * MS):
        estimate = exchange.at(100 * MS + age)
        np.testing.assert_allclose(estimate.wrench, UNIT * (0.1 + age * 1e-9))
        np.testing.assert_allclose(estimate.rate, UNIT)
        assert estimate.link is Link.LIVE


def test_through_a_gap_the_wrench_is_held():
    exchange = told(100 * MS)
    for age in (60 * MS, 120 * MS, 200 * MS):
        estimate = exchange.at(100 * MS + age)
        np.testing.assert_allclose(estimate.wrench, UNIT * 0.15)
        assert np.all(estimate.rate == 0.0)
        assert (estimate.share, estimate.link) == (1.0, Link.HELD)


def test_silence_freezes_the_cargo_and_an_answer_frees_it():
    exchange = told(100 * MS)
    links, shares = [], []
    for time in range(100 * MS, 3000 * MS, 10 * MS):
        if time > 2000 * MS:
            exchange.receive(time, UNIT)
        estimate = exchange.at(time)
        links.append(estimate.link)
        shares.append(estimate.share)
    seen = list(dict.fromkeys(links))
    assert seen == [Link.LIVE, Link.HELD, Link.FADING, Link.FROZEN, Link.RETURNING]
    assert links[-1] is Link.LIVE
    assert np.abs(np.diff(shares)).max() <= 0.02 + 1e-12  # no jump in the cargo


def test_old_and_repeated_messages_are_ignored():
    exchange = told(100 * MS)
    exchange.receive(100 * MS, 1e9 * UNIT)
    exchange.receive(50 * MS, 1e9 * UNIT)
    np.testing.assert_allclose(exchange.at(110 * MS).wrench, UNIT * 0.11)


def drive(
    delay: int = 0, lost: Callable[[int], bool] = lambda _: False
) -> tuple[np.ndarray, np.ndarray]:
    """Exchange in one process, with a delay [steps] and losses; pitch, and its reference."""
    scenario = Scenario.from_file(SCENARIO)
    engine = SloshEngine(SloshConfig.from_file(SCENARIO))
    truck = TruckSimulator(scenario.journey, engine.coupling)
    exchange, mail, pitch = WrenchExchange(), [], []
    for k in range(scenario.steps + 1):
        present = exchange.at(truck.time_ns)
        measured = truck.imu(present.wrench)
        if not lost(2 * k):
            stamp = 1_000_000_000 + truck.time_ns
            _, loads = engine.feed(
                MotionSample.from_imu(
                    stamp, measured.specific_force.tolist(), measured.angular_rate.tolist()
                )
            )
            if not lost(2 * k + 1):
                mail.append((k + delay, truck.time_ns, loads.state))
        for due, time, wrench in mail:
            if due == k:
                exchange.receive(time, wrench)
        pitch.append(truck.q[3])
        present = exchange.at(truck.time_ns)
        truck.advance(scenario.step_ns, present.wrench, present.rate)
    return np.array(pitch), closed_loop_reference(SCENARIO).q[:, 3]


def error(pitch: np.ndarray, reference: np.ndarray) -> float:
    return float(np.sqrt(np.mean((pitch - reference) ** 2) / np.mean(reference**2)))


def test_nothing_lost_is_second_order_good():
    assert error(*drive()) < 2e-5


def test_twenty_milliseconds_of_delay_cost_less_than_two_percent():
    assert error(*drive(delay=2)) < 0.02


@pytest.mark.parametrize('seed', [1, 2, 3])
def test_one_message_lost_in_a_hundred_costs_less_than_two_percent(seed):
    gone = set(np.random.default_rng(seed).choice(2400, 24, replace=False).tolist())
    assert error(*drive(lost=gone.__contains__)) < 0.02


def test_a_late_and_lossy_link_is_still_stable():
    gone = set(np.random.default_rng(4).choice(2400, 240, replace=False).tolist())
    pitch, reference = drive(delay=4, lost=gone.__contains__)
    assert np.abs(pitch).max() < 1.2 * np.abs(reference).max()
