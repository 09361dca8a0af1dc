"""A running slosh_node that is told one case after another, and what must come of each."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest

rclpy = pytest.importorskip('rclpy', reason='needs the ROS 2 wheels (make venv)')

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus  # noqa: E402
from ros_rig import Driver, NodeProcess, imu, stamp_of, wrench_of  # noqa: E402
from sensor_msgs.msg import Imu  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402

from slosh_ros.engine import SloshConfig, SloshEngine, Verdict, feed_message  # noqa: E402

SECOND = 1_000_000_000
START = 100 * SECOND
STEP = 10_000_000
UNANSWERED = 8  # samples on their way; the node keeps ten wrenches for one who reads slowly
# every sample arrives, so that what was counted can be told to the last one
RELIABLE = ('-p', 'qos_overrides./imu/data.subscription.reliability:=reliable')

TANK = """/**:
  ros__parameters:
    tank:
      shape: rectangular
      length: 8.0
      width: 2.0
      height: 1.6
      fill_depth: 0.8
      damping_ratio: 0.02
"""


class Conversation:
    """
    One node and one driver through many cases.

    Every case starts from rest; `expected` is what the node must have counted over all of them.
    """

    def __init__(self, node: NodeProcess, driver: Driver, config: Path) -> None:
        self.node, self.driver = node, driver
        self.config = SloshConfig.from_file(config)
        self.reports: list[DiagnosticStatus] = []
        self._made: list[int] = []  # when the node made them [ns]
        self._told = time.time_ns()
        driver.node.create_subscription(DiagnosticArray, '/diagnostics', self._on_report, 10)
        driver.wait_for_node()
        driver.exchange(imu(START))  # until both ways are open
        self._before = self.counts()
        self.expected: Counter[Verdict] = Counter()

    def _on_report(self, message: DiagnosticArray) -> None:
        self.reports += message.status
        self._made += [stamp_of(message)] * len(message.status)

    def _reports_since(self, moment: int) -> list[DiagnosticStatus]:
        pairs = zip(self.reports, self._made, strict=True)
        return [report for report, made in pairs if made > moment]

    def restart(self) -> None:
        """Let the next good sample find the liquid at rest."""
        client = self.driver.node.create_client(Trigger, 'slosh_node/reset')
        self.driver.spin_until(client.service_is_ready)
        future = client.call_async(Trigger.Request())
        self.driver.spin_until(future.done)
        self.driver.node.destroy_client(client)

    def tell(self, cases: Iterable[tuple[Imu, Verdict]]) -> list[list[float]]:
        """
        Tell the samples of one case and check which of them are answered.

        The last sample of a case must be a good one. Wrenches are those of `wrench` and
        `wrench_total` of every good sample, twelve doubles each.
        """
        cases = list(cases)
        self.restart()
        self._told = time.time_ns()
        for messages in self.driver.received.values():
            messages.clear()
        good = []
        for message, verdict in cases:
            self.driver.publisher.publish(message)
            self.expected[verdict] += 1
            if verdict.accepted:
                good.append(stamp_of(message))
                self._wait_for(len(good) - UNANSWERED)
        self._wait_for(len(good))
        received = self.driver.received
        for messages in received.values():
            assert [stamp_of(m) for m in messages] == good
        return [
            wrench_of(one) + wrench_of(total)
            for one, total in zip(received['wrench'], received['wrench_total'], strict=True)
        ]

    def _wait_for(self, answers: int) -> None:
        received = self.driver.received.values()
        self.driver.spin_until(lambda: all(len(m) >= answers for m in received))

    def as_if(self, samples: Iterable[Imu]) -> list[list[float]]:
        """Wrenches of an engine that sees only these samples, all of them good."""
        engine = SloshEngine(self.config)
        answers = []
        for sample in samples:
            _, loads = feed_message(engine, sample, 0)
            assert loads is not None
            answers.append([*loads.wrench.tolist(), *loads.total.tolist()])
        return answers

    def next_report(self) -> DiagnosticStatus:
        """Return the next report; those that still wait in a queue are older."""
        now = time.time_ns()
        self.driver.spin_until(lambda: bool(self._reports_since(now)))
        return self._reports_since(now)[0]

    def report_of(self, text: str) -> DiagnosticStatus:
        """Return a report with this text since the last case began; wait for three at most."""
        now = time.time_ns()

        def found() -> DiagnosticStatus | None:
            return next((r for r in self._reports_since(self._told) if text in r.message), None)

        self.driver.spin_until(lambda: found() is not None or len(self._reports_since(now)) > 2)
        report = found()
        assert report is not None, [r.message for r in self._reports_since(self._told)]
        return report

    def counts(self) -> Counter[str]:
        """Numbers of the next report."""
        return Counter(
            {v.key: int(v.value) for v in self.next_report().values if v.value.isdigit()}
        )

    def counted(self) -> dict[str, int]:
        """All verdicts since the conversation began, by their words."""
        news = self.counts() - self._before
        return {v.value: news[v.value] for v in Verdict if news[v.value]}


@contextmanager
def conversation(folder: Path, *arguments: str, tank: str = TANK) -> Iterator[Conversation]:
    """Start a node with a driver."""
    config = folder / 'tank.yaml'
    config.write_text(tank)
    with (
        NodeProcess(
            'slosh_node', folder / 'node.log', '--params-file', str(config), *RELIABLE, *arguments
        ) as node,
        Driver() as driver,
    ):
        node.wait_for('ready')
        yield Conversation(node, driver, config)


def drive(stamps: Sequence[int], verdict: Verdict = Verdict.ACCEPTED) -> list[tuple[Imu, Verdict]]:
    """Good samples at these stamps, of a lively drive; the first starts from rest."""
    first = stamps[0]
    return [
        (lively(stamp, (stamp - first) / SECOND), Verdict.STARTED if stamp == first else verdict)
        for stamp in stamps
    ]


def lively(stamp: int, t: float) -> Imu:
    """Surge, sway, pitch and yaw at once, at a time t into the drive [s]."""
    force = (1.0 - 0.5 * t, 0.3 + 0.2 * t, 9.81 + 0.1 * t)
    return imu(stamp, force, (0.02 * t, 0.01, 0.05 - 0.03 * t))
