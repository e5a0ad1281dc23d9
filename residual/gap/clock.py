"""The budget of processor time of a question, where it went, and how often it is told."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterator

from sims.host import HostSimulator

#: Minutes of the budget if nobody says how many, and of what strikes the ground: a fit takes ten
#: times as long there.
USUAL, AT_IMPACTS = 2.0, 6.0
#: Part of the time budget that the first search may take.
SEARCHING = 0.4
#: Part of it that is kept for weighing and confirming what later searches find, and times what that
#: took first.
KEPT, AGAIN = 0.2, 1.5
#: Part of the time from now to then that a later search may take, and part of the budget below
#: which none is begun.
EACH, LEAST = 0.65, 0.02
#: Part of the budget that is over when a later search is given up.
ENOUGH = 0.85
#: Seconds in which not more than one line tells how a search goes.
OFTEN = 2.0


def usual_minutes(simulator: HostSimulator) -> float:
    """Minutes of the budget if nobody says how many."""
    return AT_IMPACTS if simulator.has_contacts else USUAL


class OutOfTime(Exception):
    """A later search was not weighed and confirmed in time."""


class Clock:
    """Processor time that is left, and seconds by step."""

    def __init__(self, minutes: float = USUAL) -> None:
        self._budget = 60 * minutes
        self._weighing = self._confirming = 0.0
        self._worth_it, self._given_up = False, math.inf
        self.begin()
        self.laps: dict[str, float] = {}
        self._last = time.perf_counter()

    def begin(self, minutes: float | None = None) -> None:
        """Count from now on: a log of a million rows is read in what time that takes."""
        self._budget = self._budget if minutes is None else 60 * minutes
        begin = time.process_time()
        self.search_until = self._first_until = begin + self._budget * SEARCHING
        self.over = begin + self._budget
        self.confirm_until = begin + 2 * self._budget

    @contextlib.contextmanager
    def besides(self) -> Iterator[None]:
        """What is done within this context takes no time from confirming."""
        begin = time.process_time()
        yield
        self.confirm_until += time.process_time() - begin

    @contextlib.contextmanager
    def searching(self) -> Iterator[None]:
        """A search, which weighs rivals however late it is; later ones take as long for that."""
        yield
        self._weighing = max(self._weighing, time.process_time() - self.search_until)

    @contextlib.contextmanager
    def confirming(self) -> Iterator[None]:
        """What is found by later searches takes about as long to confirm as this."""
        begin = time.process_time()
        yield
        self._confirming = max(self._confirming, time.process_time() - begin)

    @contextlib.contextmanager
    def once_more(self, worth_it: bool = False) -> Iterator[None]:
        """What is searched within this context has a share of the time that is left, and is given
        up where it cannot be weighed and confirmed within the budget.

        Args:
            worth_it: Whether it may take the time for confirming, too.
        """
        before = self.search_until, self._worth_it, self._given_up
        self._worth_it = worth_it
        self._given_up = self.confirm_until if worth_it else self.over - (1 - ENOUGH) * self._budget
        self.search_until = max(self._first_until, time.process_time() + EACH * self._left)
        try:
            yield
        finally:
            self.search_until, self._worth_it, self._given_up = before

    def checked(self, tell: Callable[[str], None]) -> Callable[[str], None]:
        """Progress of a search, which ends it when it is to be given up.

        Raises:
            OutOfTime: From what is returned.
        """

        def in_time(text: str) -> None:
            if time.process_time() > self._given_up:
                raise OutOfTime
            tell(text)

        return in_time

    @property
    def searched(self) -> bool:
        """Whether there is no time for another search."""
        late = self._left < self._budget * LEAST
        return late and time.process_time() > self._first_until

    @property
    def _left(self) -> float:
        kept = KEPT * self._budget
        if not self._worth_it:
            kept = max(kept, AGAIN * (self._weighing + self._confirming))
        return self.over - kept - time.process_time()

    @property
    def spare_until(self) -> float:
        """When what only bears on certainty ends, so that records and report come in time."""
        return self.over - KEPT * self._budget

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
