"""The budget of processor time of a question, and where it went."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator

#: Part of the time budget after which nothing new is tried.
SEARCHING = 0.6


class Clock:
    """Processor time that is left, and seconds by step."""

    def __init__(self, minutes: float) -> None:
        begin = time.process_time()
        self.search_until = begin + 60 * minutes * SEARCHING
        self.over = begin + 60 * minutes
        self.confirm_until = begin + 120 * minutes
        self.laps: dict[str, float] = {}
        self._last = time.perf_counter()

    @contextlib.contextmanager
    def besides(self) -> Iterator[None]:
        """What is done within this context takes no time from confirming."""
        begin = time.process_time()
        yield
        self.confirm_until += time.process_time() - begin

    @property
    def late(self) -> bool:
        """Whether the time for confirming is over, too."""
        return time.process_time() > self.confirm_until

    def lap(self, step: str) -> None:
        """End of a step."""
        now = time.perf_counter()
        self.laps[step] = now - self._last
        self._last = now
