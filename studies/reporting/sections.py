"""A report and its building blocks: frozen dataclasses, each with the template of its name.

``Report("Pendulum", "One update.", [Verdict("It works.", tone="good")]).write(path)``
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar, Literal, Self

import pandas as pd
from matplotlib.figure import Figure as MatplotlibFigure

from simgap_files.atomic import atomic_write_text
from studies.reporting.media import Media, load_media, narrowed, still
from studies.reporting.render import render

Source = MatplotlibFigure | Media | bytes | str | Path
Cell = str | float | int | bool | None
Tone = Literal["good", "warning", "bad", "neutral"]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Section:
    """What every section has: an optional heading, and a template that turns it into HTML.

    A section of your own is a subclass that overrides ``html``; escape what you put in it.
    """

    heading: str = ""
    template: ClassVar[str]

    def html(self) -> str:
        """The section's body, without its heading."""
        return render(self.template, section=self)


@dataclasses.dataclass(frozen=True)
class Verdict(Section):
    """The answer, in a banner.

    Args:
        headline: One sentence a busy reader can act on.
        text: What it rests on; markup as in ``Prose``.
        tone: Colour of the banner; the words in ``label`` say the same.
        label: A word or two above the headline, such as ``"confirmed"``.
    """

    template: ClassVar[str] = "verdict.html"
    headline: str
    text: str = ""
    tone: Tone = "neutral"
    label: str = ""


@dataclasses.dataclass(frozen=True)
class Prose(Section):
    """Text: blank lines part paragraphs, ``- `` starts a list item.

    Inside a line: ``**strong**``, ```` `code` ```` and ``[words](address)``. All else is shown
    as it stands.
    """

    template: ClassVar[str] = "prose.html"
    text: str


@dataclasses.dataclass(frozen=True)
class Picture(Section):
    """What a still and a moving picture share.

    Args:
        source: A matplotlib figure, or the bytes or path of a PNG or GIF.
        alt: What it shows, for those who cannot see it: the finding, not "a plot".
        caption: Text under it; markup as in ``Prose``.
    """

    source: Source
    alt: str
    caption: str = ""

    @property
    def picture(self) -> Media:
        """``source``, ready to be put into the page."""
        return load_media(self.source)

    def small(self) -> Self:
        """The same for a place beside others; by default there is one size."""
        return self


@dataclasses.dataclass(frozen=True)
class Figure(Picture):
    """One picture, see ``Picture``."""

    template: ClassVar[str] = "figure.html"

    @property
    def narrow_picture(self) -> Media | None:
        """A matplotlib figure of one column laid out anew for screens up to 640 px wide."""
        return narrowed(self.source)

    def small(self) -> Self:
        """The same with its narrow picture at any width."""
        return dataclasses.replace(self, source=self.narrow_picture or self.picture)


@dataclasses.dataclass(frozen=True)
class Gallery(Section):
    """Small pictures side by side, as many in a row as fit."""

    template: ClassVar[str] = "gallery.html"
    figures: Sequence[Figure | Animation]
    caption: str = ""


@dataclasses.dataclass(frozen=True)
class Animation(Picture):
    """A moving picture, a GIF (``media.encode_gif``); see ``Picture``.

    Readers who ask their system for less motion see one still of it.
    """

    template: ClassVar[str] = "animation.html"

    @property
    def still(self) -> Media | None:
        """The middle frame."""
        return still(self.picture)


@dataclasses.dataclass(frozen=True)
class Table(Section):
    """A table; on a phone each row of a wide one becomes a small card.

    Args:
        columns: Headings. The first column names the row.
        rows: Cells; numbers are shown to ``digits`` significant digits, None and NaN as a dash.
        caption: Text above it; markup as in ``Prose``.
        highlight: Numbers of rows (from 0) to stress.
        digits: Significant digits of floats; integers are shown in full.

    Raises:
        ValueError: A row has not as many cells as there are columns.
    """

    template: ClassVar[str] = "table.html"
    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    caption: str = ""
    highlight: Sequence[int] = ()
    digits: int = 3

    @classmethod
    def of(cls, frame: pd.DataFrame, heading: str, caption: str, digits: int = 3) -> Table:
        """A data frame without its index."""
        rows = frame.astype(object).values.tolist()
        return cls(list(frame.columns), rows, caption, digits=digits, heading=heading)

    def __post_init__(self) -> None:
        for number, row in enumerate(self.rows):
            if len(row) != len(self.columns):
                raise ValueError(
                    f"row {number} of the table has {len(row)} cells, expected "
                    f"{len(self.columns)}: one for each of {', '.join(self.columns)}"
                )

    @property
    def numeric(self) -> list[bool]:
        """Per column: does it hold numbers only (None apart)?"""
        columns = zip(*self.rows, strict=True) if self.rows else [()] * len(self.columns)
        return [
            any(cell is not None for cell in cells)
            and all(_is_number(cell) for cell in cells if cell is not None)
            for cells in columns
        ]


@dataclasses.dataclass(frozen=True)
class KeyValues(Section):
    """Names and their values.

    Args:
        items: Value by name, in order; a unit belongs into the value's text.
        style: ``"tiles"`` for up to about six headline numbers, ``"list"`` for settings.
    """

    template: ClassVar[str] = "key_values.html"
    items: Mapping[str, Cell]
    style: Literal["list", "tiles"] = "list"


@dataclasses.dataclass(frozen=True)
class Code(Section):
    """Text shown letter by letter (a command, a config), folded under ``summary`` if given."""

    template: ClassVar[str] = "code.html"
    text: str
    summary: str = ""


def _is_number(cell: Cell) -> bool:
    return isinstance(cell, float | int) and not isinstance(cell, bool)


@dataclasses.dataclass(frozen=True)
class Report:
    """One page, read top down: put the verdict first.

    The page carries its pictures and its style inside and, by its content security policy,
    cannot load anything else. It follows the reader's light or dark scheme and fits a phone.

    Args:
        title: What was studied; also the name of the browser's tab.
        subtitle: One sentence under the title.
        sections: In reading order; those with a heading appear in the list of contents.
        footer: How the page was made (command, versions), in small print.
    """

    title: str
    subtitle: str = ""
    sections: Sequence[Section] = ()
    footer: str = ""

    def html(self) -> str:
        """The page as text; the same report gives the same text."""
        bodies = [
            (f"section-{number}", section.heading, section.html())
            for number, section in enumerate(self.sections, start=1)
        ]
        return str(render("report.html", report=self, bodies=bodies))

    def write(self, path: str | Path) -> Path:
        """Write the page to ``path``, whole or not at all, and return the path."""
        atomic_write_text(path, self.html())
        return Path(path)
