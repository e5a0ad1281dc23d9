"""What a study tells while it works: bars for its user, curves for TensorBoard, or nothing."""

from __future__ import annotations

import contextlib
import re
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Protocol, TextIO

from tqdm.auto import tqdm

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


#: Numbers by name to draw as curves.
Numbers = Mapping[str, float] | None


class Advance(Protocol):
    """Says how far a step is."""

    def __call__(self, done: int, note: str = "", values: Numbers = None) -> None:
        """``done`` units of the step are done.

        Args:
            done: Units done so far.
            note: A few words for the user, such as ``"return -660"``.
            values: To draw as curves over ``done``.
        """
        ...


class Progress(Protocol):
    """Told of every step that takes a while."""

    def task(self, title: str, total: int) -> contextlib.AbstractContextManager[Advance]:
        """A context; inside, ``advance(done, note)`` says how far the step is."""
        ...


class Bars:
    """Progress bars: in a notebook its own, else on stderr, or lines there without a terminal."""

    @contextlib.contextmanager
    def task(self, title: str, total: int) -> Iterator[Advance]:
        """A bar of ``total`` units."""
        with tqdm(
            total=total, desc=f"{title:<34}", file=stderr(), leave=True, mininterval=0.5,
            bar_format="{desc} {percentage:3.0f}% |{bar:20}| {elapsed}<{remaining} {postfix}",
        ) as bar:  # fmt: skip

            def advance(done: int, note: str = "", values: Numbers = None) -> None:
                bar.set_postfix_str(note, refresh=False)
                bar.update(done - bar.n)

            yield advance


class Several:
    """Passes on to several others."""

    def __init__(self, *others: Progress) -> None:
        self.others = others

    @contextlib.contextmanager
    def task(self, title: str, total: int) -> Iterator[Advance]:
        """A task of each."""
        with contextlib.ExitStack() as stack:
            all_of_them = [stack.enter_context(each.task(title, total)) for each in self.others]

            def advance(done: int, note: str = "", values: Numbers = None) -> None:
                for each in all_of_them:
                    each(done, note, values)

            yield advance


class Silent(Several):
    """No output, for ``learn_by_difference(..., progress=Silent())`` in a script."""


class Curves:
    """Progress that logs every number it is told, one run of TensorBoard for each step.

    Args:
        folder: For the runs, such as one trial's; a step that is run again gets another number.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @contextlib.contextmanager
    def task(self, title: str, total: int) -> Iterator[Advance]:
        """A step; its folder is made with the first number."""
        from torch.utils.tensorboard import SummaryWriter

        name = re.sub(r"\W+", "-", title)
        with contextlib.ExitStack() as stack:
            writer: SummaryWriter | None = None

            def advance(done: int, note: str = "", values: Numbers = None) -> None:
                nonlocal writer
                if not values:
                    return
                if writer is None:
                    run = self.folder / f"{name}-{1 + len(list(self.folder.glob(f'{name}-*')))}"
                    writer = SummaryWriter(str(run))
                    stack.callback(writer.close)
                for key, value in values.items():
                    writer.add_scalar(key, value, done)

            yield advance
