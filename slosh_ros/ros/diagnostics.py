"""The node's state in words and numbers for /diagnostics."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from slosh_ros.engine import Loads, SloshEngine


def rejected(engine: SloshEngine) -> int:
    """Return the number of samples rejected so far."""
    return sum(n for verdict, n in engine.gate.counts.items() if not verdict.accepted)


def status(
    engine: SloshEngine, name: str, topic: str, loads: Loads | None, fresh: bool, news: int
) -> DiagnosticStatus:
    """
    Summarise the engine.

    Parameters
    ----------
    engine : SloshEngine
        The engine.
    name, topic : str
        Names of the node and of its resolved input topic.
    loads : Loads or None
        The last loads.
    fresh : bool
        Whether a sample was accepted since the last report.
    news : int
        Number of samples rejected since the last report.
    """
    if loads is None:
        level, message = DiagnosticStatus.WARN, f'waiting for data on {topic}'
    elif not fresh:
        level, message = DiagnosticStatus.STALE, f'no good sample on {topic} for a second'
    elif news:
        level, message = DiagnosticStatus.WARN, f'{news} samples rejected in the last second'
    elif not loads.valid:
        level, message = DiagnosticStatus.WARN, 'waves too high for linear theory'
    else:
        level, message = DiagnosticStatus.OK, 'running'
    values = {verdict.value: count for verdict, count in engine.gate.counts.items()}
    values |= dict(engine.warnings)
    if loads is not None:
        values['elevation_max [m]'] = f'{loads.elevation_max:.4f}'  # type: ignore[assignment]
    return DiagnosticStatus(
        level=level,
        name=f'{name}: sloshing',
        message=message,
        hardware_id=', '.join(tank.config.name for tank in engine.tanks),
        values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
    )
