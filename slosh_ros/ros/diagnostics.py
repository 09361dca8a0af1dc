"""The node's state in words and numbers for /diagnostics."""

from __future__ import annotations

from collections import Counter

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from slosh_ros.engine import Loads, SloshEngine, Verdict
from slosh_ros.modal.validity import UNMOVED, Trust

_UNEVENTFUL = (Verdict.STARTED, Verdict.ACCEPTED)


class Watch:
    """
    Tells what happened to an engine since the last look.

    Parameters
    ----------
    engine : SloshEngine
        The engine.
    name, topic : str
        Names of the node and of its resolved input topic.
    """

    def __init__(self, engine: SloshEngine, name: str, topic: str) -> None:
        self._engine = engine
        self._name = name
        self._topic = topic
        self._counts: Counter[Verdict] = Counter()
        self._warnings: Counter[str] = Counter()
        self._loads: Loads | None = None
        self._highest = 0.0  # [m]
        self._worst = UNMOVED
        self._beyond = self._beyond_before = 0

    def take(self, loads: Loads) -> None:
        """Take new loads; no wave between two looks is missed."""
        self._loads = loads
        self._highest = max(self._highest, loads.elevation_max)
        self._worst = max(self._worst, loads.trust, key=Trust.use)
        self._beyond += not loads.valid

    def look(self) -> DiagnosticStatus:
        """Summarise the engine."""
        engine = self._engine
        news, warnings = engine.gate.counts - self._counts, engine.warnings - self._warnings
        self._counts, self._warnings = engine.gate.counts.copy(), engine.warnings.copy()
        level, message = self._verdict(news, warnings)
        self._beyond_before = self._beyond
        values: dict[str, object] = {v.value: count for v, count in engine.gate.counts.items()}
        values |= dict(engine.warnings)
        if self._loads is not None:
            values['elevation_max [m]'] = f'{self._loads.elevation_max:.4f}'
            values['highest wave so far [m]'] = f'{self._highest:.4f}'
            values['linear theory'] = str(self._loads.trust)
            values['linear theory, worst so far'] = str(self._worst)
            values['samples beyond linear theory'] = self._beyond
        return DiagnosticStatus(
            level=level,
            name=f'{self._name}: sloshing',
            message=message,
            hardware_id=', '.join(tank.config.name for tank in engine.tanks),
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )

    def _verdict(self, news: Counter[Verdict], warnings: Counter[str]) -> tuple[bytes, str]:
        events = Counter({v: n for v, n in news.items() if v not in _UNEVENTFUL})
        if not news:
            if self._loads is None:
                return DiagnosticStatus.WARN, f'waiting for data on {self._topic}'
            return DiagnosticStatus.STALE, f'no sample on {self._topic} for a second'
        if events:
            ((most, count),) = events.most_common(1)
            return (
                DiagnosticStatus.ERROR if events[Verdict.NO_DATA] else DiagnosticStatus.WARN,
                f'{sum(events.values())} of the last {sum(news.values())} samples on '
                f'{self._topic} were not ordinary; {count} {most.value}',
            )
        if warnings:
            ((most_said, count),) = warnings.most_common(1)
            return DiagnosticStatus.WARN, most_said
        if self._beyond > self._beyond_before:
            # without its value, which changes all the time: what is new is said in the log
            beyond = f'{self._worst.criterion.value} beyond {self._worst.limit:.2g}'
            return DiagnosticStatus.WARN, f'linear theory is left: {beyond}'
        return DiagnosticStatus.OK, 'running'
