"""What a study tells while it works: bars for its user, or nothing."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager
from typing import Protocol

from tqdm.auto import tqdm

from studies.running.stream import stderr


class Advance(Protocol):
    """Says how far a step is."""

    def __call__(
        self, done: int, note: str = "", values: Mapping[str, float] | None = None
    ) -> None:
        """``done`` units of the step are done.

        Args:
            done: Units done so far.
            note: A few words for the user, such as ``"return -660"``.
            values: Numbers by name to draw as curves over ``done``.
        """
        ...


class Progress(Protocol):
    """Told of every step that takes a while."""

    def task(self, title: str, total: int) -> AbstractContextManager[Advance]:
        """A context; inside, ``advance(done, note)`` says how far the step is."""
        ...


class Bars:
    """Progress bars: in a notebook its own, else on stderr, or lines there without a terminal."""

    @contextmanager
    def task(self, title: str, total: int) -> Iterator[Advance]:
        """A bar of ``total`` units."""
        with tqdm(
            total=total, desc=f"{title:<34}", file=stderr(), leave=True, mininterval=0.5,
            bar_format="{desc} {percentage:3.0f}% |{bar:20}| {elapsed}<{remaining} {postfix}",
        ) as bar:  # fmt: skip

            def advance(
                done: int, note: str = "", values: Mapping[str, float] | None = None
            ) -> None:
                bar.set_postfix_str(note, refresh=False)
                bar.update(done - bar.n)

            yield advance


class Several:
    """Passes on to several others."""

    def __init__(self, *others: Progress) -> None:
        self.others = others

    @contextmanager
    def task(self, title: str, total: int) -> Iterator[Advance]:
        """A task of each."""
        with ExitStack() as stack:
            all_of_them = [stack.enter_context(each.task(title, total)) for each in self.others]

            def advance(
                done: int, note: str = "", values: Mapping[str, float] | None = None
            ) -> None:
                for each in all_of_them:
                    each(done, note, values)

            yield advance


class Silent(Several):
    """No output, for ``learn_by_difference(..., progress=Silent())`` in a script."""
