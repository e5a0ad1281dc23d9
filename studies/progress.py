"""What a study tells its user while it works."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Protocol

from tqdm import tqdm

Advance = Callable[[int, str], None]


class Progress(Protocol):
    """Told of every step that takes a while."""

    def task(self, title: str, total: int) -> AbstractContextManager[Advance]:
        """A context; inside, ``advance(done, note)`` says how far the step is."""
        ...


class Bars:
    """Progress bars on stderr, one line per step; quiet lines where there is no terminal."""

    @contextmanager
    def task(self, title: str, total: int) -> Iterator[Advance]:
        """A bar of ``total`` units."""
        with tqdm(
            total=total, desc=f"{title:<34}", file=sys.stderr, leave=True, mininterval=0.5,
            bar_format="{desc} {percentage:3.0f}% |{bar:20}| {elapsed}<{remaining} {postfix}",
        ) as bar:  # fmt: skip

            def advance(done: int, note: str = "") -> None:
                bar.set_postfix_str(note, refresh=False)
                bar.update(done - bar.n)

            yield advance


class Silent:
    """No output, for workers and tests."""

    @contextmanager
    def task(self, title: str, total: int) -> Iterator[Advance]:
        """Nothing is shown."""

        def ignore(done: int, note: str = "") -> None:
            pass

        yield ignore
