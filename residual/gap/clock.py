"""The budget of processor time of a question, where it went, and how often it is told."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator

#: Part of the time budget after which nothing new is tried.
SEARCHING = 0.5
#: Part of it that a question which is worth more time leaves.
KEPT = 0.2
#: Seconds in which not more than one line tells how a search goes.
OFTEN = 2.0


class Clock:
    """Processor time that is left, and seconds by step."""

    def __init__(self, minutes: float) -> None:
        self._minutes = minutes
        self.begin()
        self.laps: dict[str, float] = {}
        self._last = time.perf_counter()

    def begin(self) -> None:
        """Count from now on: a log of a million rows is read in what time that takes."""
        begin = time.process_time()
        self.search_until = begin + 60 * self._minutes * SEARCHING
        self.over = begin + 60 * self._minutes
        self.confirm_until = begin + 120 * self._minutes

    @contextlib.contextmanager
    def besides(self) -> Iterator[None]:
        """What is done within this context takes no time from confirming."""
        begin = time.process_time()
        yield
        self.confirm_until += time.process_time() - begin

    @contextlib.contextmanager
    def longer(self) -> Iterator[None]:
        """What is searched within this context has time beyond that for searching, too."""
        before = self.search_until
        self.search_until = max(before, self.over - 60 * self._minutes * KEPT)
        try:
            yield
        finally:
            self.search_until = before

    @property
    def searched(self) -> bool:
        """Whether the time for searching is over."""
        return time.process_time() > self.search_until

    @property
    def late(self) -> bool:
        """Whether the time for confirming is over, too."""
        return time.process_time() > self.confirm_until

    def lap(self, step: str) -> None:
        """End of a step."""
        now = time.perf_counter()
        self.laps[step] = now - self._last
        self._last = now


def seldom(tell: Callable[[str], None], seconds: float = OFTEN) -> Callable[[str], None]:
    """The same without lines that come within so many seconds of the last one."""
    last = time.perf_counter()

    def now_and_then(text: str) -> None:
        nonlocal last
        if time.perf_counter() - last >= seconds:
            last = time.perf_counter()
            tell(text)

    return now_and_then
