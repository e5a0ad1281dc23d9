"""Where progress is shown: a bar on a terminal, now and then a line in a file."""

from __future__ import annotations

import sys
import time
from typing import TextIO

#: Seconds between two lines of one step.
EVERY = 30.0


class Lines:
    """A stream for tqdm that writes a bar as whole lines: now and then, and at its end."""

    def __init__(self, stream: TextIO) -> None:
        self._stream, self._held, self._written = stream, "", time.monotonic()

    @property
    def encoding(self) -> str:
        """As the stream's."""
        return self._stream.encoding

    def write(self, text: str) -> None:
        """Refreshes begin with a carriage return, an end is a line feed."""
        if shown := text.strip():
            self._held = shown
        due = time.monotonic() - self._written >= EVERY
        if self._held and (due or text.endswith("\n")):
            self._stream.write(f"{self._held}\n")
            self._stream.flush()
            self._held, self._written = "", time.monotonic()

    def flush(self) -> None:
        """Lines are flushed as they are written."""


def stderr() -> TextIO | Lines:
    """Standard error, as lines if it is no terminal."""
    return sys.stderr if sys.stderr.isatty() else Lines(sys.stderr)
