"""What a node says in its log, by a clock that is turned by hand."""

from __future__ import annotations

from itertools import pairwise

import pytest

from slosh_ros.ros.news import ERROR, INFO, News


class Ear:
    def __init__(self) -> None:
        self.now = 0.0
        self.heard: list[tuple[float, str]] = []
        self.news = News(self, lambda: self.now)

    def info(self, message: str) -> None:
        self.heard.append((self.now, f'I {message}'))

    def warning(self, message: str) -> None:
        self.heard.append((self.now, f'W {message}'))

    def error(self, message: str) -> None:
        self.heard.append((self.now, f'E {message}'))

    def live(self, seconds: float, subjects: list[str]) -> None:
        """Tell of everything a hundred times a second, for long."""
        for _ in range(round(100 * seconds)):
            self.now += 0.01
            for subject in subjects:
                self.news.tell(subject, f'{subject} at {self.now:.2f}')
        self.news.flush()


def test_never_two_lines_in_a_second_and_none_is_lost():
    ear = Ear()
    ear.live(8.0, ['late', 'nan', 'frame'])
    times = [time for time, _ in ear.heard]
    assert min(b - a for a, b in pairwise(times)) >= 1.0
    assert [line.split()[1] for _, line in ear.heard] == ['late', 'nan', 'frame']


def test_what_repeats_itself_is_said_ever_more_rarely():
    """A month of the same: at 0, 10, 70 s and then every ten minutes."""
    ear = Ear()
    for _ in range(3600):
        ear.now += 1.0
        ear.news.tell('late', 'late')
    times = [time for time, _ in ear.heard]
    assert times == pytest.approx([1.0, 11.0, 71.0, *range(671, 3601, 600)], abs=1.01)


def test_a_state_is_said_when_it_changes_with_its_severity():
    ear = Ear()
    for state, severity in (('waiting', INFO), ('absent', ERROR), ('absent', ERROR), ('ok', INFO)):
        ear.now += 2.0
        ear.news.state(state, state, severity)
    assert [line for _, line in ear.heard] == ['I waiting', 'E absent', 'I ok']


def test_a_newer_line_takes_the_place_of_one_that_waits():
    ear = Ear()
    ear.news.tell('first', 'first')
    ear.news.tell('fill', 'fill is 0.5')
    ear.news.tell('fill', 'fill is 0.6')
    ear.now = 1.0
    ear.news.flush()
    ear.now = 5.0
    ear.news.flush()
    assert [line for _, line in ear.heard] == ['W first', 'W fill is 0.6']
