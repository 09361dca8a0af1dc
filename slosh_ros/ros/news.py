"""What a node says in its log: a line a second at most, repetitions ever more rarely."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple, Protocol

INFO, WARNING, ERROR = 'info', 'warning', 'error'

_QUIET = 1.0  # [s] between two lines
_PATIENCE = (10.0, 60.0, 600.0)  # [s] between two lines on the same subject, growing
_FORGOTTEN = 1800.0  # [s] after which a subject is new again


class Logger(Protocol):
    """What is needed of a logger of rclpy."""

    def info(self, message: str) -> object:
        """Say something that needs nobody."""

    def warning(self, message: str) -> object:
        """Say something that somebody should look after."""

    def error(self, message: str) -> object:
        """Say what must not go on."""


class _Said(NamedTuple):
    at: float
    times: int


class News:
    """
    The one mouth of a node.

    Parameters
    ----------
    logger : Logger
        Of the node.
    clock : callable
        Steady time [s].
    """

    def __init__(self, logger: Logger, clock: Callable[[], float] = time.monotonic) -> None:
        self._logger = logger
        self._clock = clock
        self._waiting: dict[str, tuple[str, str]] = {}
        self._said: dict[str, _Said] = {}
        self._last = -_QUIET
        self._state = ''

    def tell(self, subject: str, text: str, severity: str = WARNING) -> None:
        """
        Say a line now, or as soon as there is room; not at all if the subject is stale.

        Parameters
        ----------
        subject : str
            What the line is about; a newer line on it takes the place of one that waits.
        text : str
            The line.
        severity : str
            `INFO`, `WARNING` or `ERROR`.
        """
        said = self._said.get(subject)
        if said is not None:
            quiet = self._clock() - said.at
            if quiet < _PATIENCE[min(said.times, len(_PATIENCE)) - 1]:
                return
            if quiet > _FORGOTTEN:
                del self._said[subject]
        self._waiting[subject] = text, severity
        self.flush()

    def state(self, subject: str, text: str, severity: str = WARNING) -> None:
        """Tell of a state that has just been found, if it is another than the one before."""
        if subject != self._state:
            self._state = subject
            self.tell(subject, text, severity)

    def flush(self) -> None:
        """Say the oldest line that waits, if the last one is a second ago; call it regularly."""
        now = self._clock()
        if not self._waiting or now - self._last < _QUIET:
            return
        subject, (text, severity) = next(iter(self._waiting.items()))
        del self._waiting[subject]
        before = self._said.get(subject)
        self._said[subject] = _Said(now, 1 if before is None else before.times + 1)
        self._last = now
        if severity == ERROR:  # rclpy wants one severity for each line of code
            self._logger.error(text)
        elif severity == WARNING:
            self._logger.warning(text)
        else:
            self._logger.info(text)
