"""A report: a title, a subtitle and sections, written as one HTML file that needs nothing else."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from simgap_files import atomic_write_text
from studies.reporting.render import render
from studies.reporting.sections import Section


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
