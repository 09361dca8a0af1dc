"""
What a vehicle knows of its liquid's state wrench, from messages that may be late or missing.

Fresh messages are extrapolated linearly; through a gap the last value is held; when the liquid's
side stays silent its share fades away, which leaves the vehicle with a frozen cargo, and when it
speaks again the share comes back.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

HOLD_AFTER = 50_000_000  # [ns] age of the last message from which its wrench is held
FREEZE_AFTER = 200_000_000  # [ns] age from which the liquid's share fades
FADE = 500_000_000  # [ns] time for the whole share to fade or to come back


class Link(Enum):
    """State of the exchange; the value says it to people."""

    LIVE = 'the liquid answers'
    HELD = 'no answer: the last sloshing wrench is held'
    FADING = 'no answer for long: the cargo is being frozen'
    FROZEN = 'no liquid: the cargo is frozen'
    RETURNING = 'the liquid answers again: the cargo is being freed'


class Estimate(NamedTuple):
    """
    The state wrench at some time and its trend.

    Attributes
    ----------
    wrench, rate : array, shape (6,)
        State wrench [N, N m] and its time derivative, the share counted in.
    share : float
        Part of the sloshing that acts, 0 (frozen cargo) to 1; the coupling is to be scaled by it.
    link : Link
        Where the estimate comes from.
    """

    wrench: Array
    rate: Array
    share: float
    link: Link


class WrenchExchange:
    """Follows the messages of the liquid's side, and tells the wrench at any later time."""

    def __init__(self) -> None:
        self._last: tuple[int, Array] | None = None
        self._slope: Array = np.zeros(6)
        self._share = 1.0
        self._time: int | None = None

    def receive(self, stamp: int, wrench: Array) -> None:
        """
        Take a message.

        Parameters
        ----------
        stamp : int
            Time that the wrench belongs to [ns]; one that is not newer than the last is ignored.
        wrench : array, shape (6,)
            State wrench [N, N m].
        """
        if self._last is not None:
            before, old = self._last
            if stamp <= before:
                return
            interval = stamp - before
            steady = interval <= HOLD_AFTER
            self._slope = (wrench - old) / (interval * 1e-9) if steady else np.zeros(6)
        self._last = (stamp, wrench)

    def at(self, time: int) -> Estimate:
        """
        Estimate the state wrench.

        Parameters
        ----------
        time : int
            Time [ns], never before that of an earlier call.
        """
        passed = 0 if self._time is None else time - self._time
        self._time = time
        stamp, wrench = self._last or (0, np.zeros(6))  # at rest nothing sloshes
        age = time - stamp
        silent = age > FREEZE_AFTER
        change = passed / FADE
        self._share = max(0.0, self._share - change) if silent else min(1.0, self._share + change)
        held = age > HOLD_AFTER
        now = wrench + self._slope * (min(age, HOLD_AFTER) * 1e-9)
        rate = np.zeros(6) if held else self._slope
        if silent:
            link = Link.FADING if self._share > 0.0 else Link.FROZEN
        elif self._share < 1.0:
            link = Link.RETURNING
        else:
            link = Link.HELD if held else Link.LIVE
        return Estimate(self._share * now, self._share * rate, self._share, link)
