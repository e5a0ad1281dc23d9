"""Lines of progress, and a sign of life in between."""

from __future__ import annotations

import sys
import threading
import time
from typing import Self

#: Seconds without a line after which the last one is repeated.
QUIET = 4.0


class Heartbeat:
    """Tells on stderr what is being done, the time since the start and what is left of a budget."""

    def __init__(self) -> None:
        self._budget: float | None = None
        self._text = ""
        self._lock, self._over = threading.Lock(), threading.Event()
        self._thread = threading.Thread(target=self._beat, daemon=True)

    def __enter__(self) -> Self:
        self._begin = self._spoke = time.perf_counter()
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._over.set()
        self._thread.join()

    def __call__(self, text: str) -> None:
        """Say what is being done or was found."""
        with self._lock:
            self._text = text
            self._say(text)

    def until(self, budget: float) -> None:
        """Tell what is left of so many seconds of processor time from now on; what the search found
        may take as long to confirm."""
        self._budget, self._used = budget, time.process_time()

    def _say(self, text: str) -> None:
        self._spoke = time.perf_counter()
        spent = self._spoke - self._begin
        ahead = ""
        if self._budget is not None:
            used = time.process_time() - self._used
            left, more = self._budget - used, max(2 * self._budget - used, 0.0)
            ahead = f", {left:.0f} s left" if left > 0 else f", {more:.0f} s to confirm"
        print(f"{spent:6.1f} s{ahead}  {text}", file=sys.stderr, flush=True)

    def _beat(self) -> None:
        while not self._over.wait(0.25 * QUIET):
            with self._lock:
                if self._text and time.perf_counter() - self._spoke > 0.75 * QUIET:
                    self._say(f"still working; last: {self._text.strip()}")
