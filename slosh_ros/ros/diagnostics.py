"""The node's state in words and numbers for /diagnostics."""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from slosh_ros.engine import Loads, SloshEngine, Verdict
from slosh_ros.modal.validity import UNMOVED, Trust
from slosh_ros.ros.motion_input import MotionInput
from slosh_ros.ros.news import ERROR, INFO, WARNING

UNREADABLE = 'rejected: bytes that are no sensor_msgs/msg/Imu'
DISABLED = 'not used: disabled by ~/set_enabled'
UNMOUNTED = 'not used: TF has not told the pose of its frame_id in base_link'
RUNNING = 'running'
SEVERITY = {  # in the log
    DiagnosticStatus.OK: INFO,
    DiagnosticStatus.WARN: WARNING,
    DiagnosticStatus.STALE: WARNING,
    DiagnosticStatus.ERROR: ERROR,
}
_UNEVENTFUL = (Verdict.STARTED, Verdict.ACCEPTED)


class Finding(NamedTuple):
    """
    What is to be said about a node.

    Attributes
    ----------
    level : bytes
        Of a DiagnosticStatus.
    subject : str
        What it is about; the same for as long as nothing new has happened.
    text : str
        In words, with numbers.
    """

    level: bytes
    subject: str
    text: str


class Watch:
    """
    Tells what happened to an engine since the last look.

    Parameters
    ----------
    engine : SloshEngine
        The engine.
    name : str
        Of the node.
    motion : MotionInput
        Where its samples come from.
    """

    def __init__(self, engine: SloshEngine, name: str, motion: MotionInput) -> None:
        self._engine = engine
        self._name = name
        self._motion = motion
        self.enabled = True
        self.extra: dict[str, str] = {}  # further values, by key
        self._refused: Counter[str] = Counter()  # what never reached the engine
        self._before: Counter[str] = Counter()  # all that had happened at the last look
        self._loads: Loads | None = None
        self._highest = 0.0  # [m]
        self._worst = UNMOVED
        self._beyond = self._beyond_before = 0

    def take(self, loads: Loads) -> None:
        """Take new loads; no wave between two looks is missed."""
        self._loads = loads
        if loads.rises_above(self._highest):
            self._highest = loads.elevation_max
        self._worst = max(self._worst, loads.trust, key=Trust.use)
        self._beyond += not loads.valid

    def refuse(self, reason: str) -> None:
        """Count something that was not even shown to the engine."""
        self._refused[reason] += 1

    def look(self) -> tuple[DiagnosticStatus, Finding]:
        """Summarise the node, as a message and in words for the log."""
        engine = self._engine
        counts = {verdict.value: count for verdict, count in engine.gate.counts.items()}
        now = Counter({**counts, **self._refused, **engine.warnings})
        finding = self._finding(now - self._before)
        self._before = now
        self._beyond_before = self._beyond
        values: dict[str, object] = dict(now)
        if self._loads is not None:
            self._worst = max(self._worst, self._loads.trust, key=Trust.use)
            values['elevation_max [m]'] = f'{self._loads.elevation_max:.4f}'
            values['highest wave so far [m]'] = f'{self._highest:.4f}'
            values['linear theory'] = str(self._loads.trust)
            values['linear theory, worst so far'] = str(self._worst)
            values['samples beyond linear theory'] = self._beyond
        for tank in engine.tanks:
            name, books = tank.config.name, engine.books[tank.config.name]
            values[f'{name}.fill_ratio'] = f'{tank.coefficients.liquid.fill_ratio:.4f}'
            values[f'{name}.mass [kg]'] = f'{tank.coefficients.mass:.3f}'
            values[f'{name}.received so far [kg]'] = f'{books.received:.3f}'
            values[f'{name}.released so far [kg]'] = f'{books.released:.3f}'
        values[f'publishers on {self._motion.topic}'] = self._motion.matched
        if self._motion.mismatch:
            values['QoS'] = self._motion.mismatch
        values |= self.extra
        status = DiagnosticStatus(
            level=finding.level,
            name=f'{self._name}: sloshing',
            message=finding.text,
            hardware_id=', '.join(tank.config.name for tank in engine.tanks),
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )
        return status, finding

    def _finding(self, news: Counter[str]) -> Finding:
        """Judge what happened since the last look; the gravest comes first."""
        warn, topic = DiagnosticStatus.WARN, self._motion.topic
        samples = {v: news[v.value] for v in Verdict if news[v.value]}
        if not self.enabled:
            return Finding(warn, 'disabled', 'disabled by ~/set_enabled: no loads are published')
        if news[UNMOUNTED]:
            text = f'samples on {topic} are {UNMOUNTED}; publish it, or give imu.xyz and imu.rpy'
            return Finding(warn, UNMOUNTED, text)
        if count := news[UNREADABLE]:
            return Finding(warn, UNREADABLE, f'{count} messages on {topic} {UNREADABLE}')
        if not samples:
            hint = self._motion.hint()
            why = f'; {hint}' if hint else ''
            if self._loads is None:
                text = f'waiting for data on {topic} ({self._motion.type_name}){why}'
                return Finding(warn, f'waiting; {hint}', text)
            text = f'no sample on {topic} for a second{why}'
            return Finding(DiagnosticStatus.STALE, f'silent; {hint}', text)
        events = Counter({v: n for v, n in samples.items() if v not in _UNEVENTFUL})
        if events:
            absent = events[Verdict.NO_DATA]
            most, count = (Verdict.NO_DATA, absent) if absent else events.most_common(1)[0]
            text = (
                f'{events.total()} of the last {sum(samples.values())} samples on {topic} were '
                f'not ordinary; {count} {most.value}'
            )
            level = DiagnosticStatus.ERROR if absent else DiagnosticStatus.WARN
            return Finding(level, f'samples: {most.value}', text)
        if self._motion.rivals():
            names = ' and '.join(self._motion.rivals())
            text = f'{self._motion.matched} publishers on {topic}: {names}; only one may drive'
            return Finding(warn, text, text)
        if warnings := Counter({k: n for k, n in news.items() if k in self._engine.warnings}):
            ((most_said, count),) = warnings.most_common(1)
            return Finding(warn, most_said, most_said)
        if self._beyond > self._beyond_before:
            # without its value, which changes all the time: what is new is said in the log
            beyond = f'{self._worst.criterion.value} beyond {self._worst.limit:.2g}'
            return Finding(warn, beyond, f'linear theory is left: {beyond}')
        return Finding(DiagnosticStatus.OK, RUNNING, RUNNING)
