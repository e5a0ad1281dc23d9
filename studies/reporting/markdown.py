"""Tables as Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import pandas as pd


def markdown(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table, one line a row; nothing if there are no rows."""
    lines = [head, ["---"] * len(head), *rows]
    text = "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)
    return text if len(lines) > 2 else ""


def filled(records: Iterable[Mapping[str, Any]], columns: Mapping[str, str]) -> str:
    """A table with a row for each record.

    Args:
        records: Values by name.
        columns: By heading, what stands below: a template that a record fills in, such as
            ``"{seconds:.1f}"``; where it lacks a value stands a dash.
    """

    def cell(template: str, record: Mapping[str, Any]) -> str:
        try:
            return template.format_map(record)
        except KeyError:
            return "-"

    rows = [[cell(template, record) for template in columns.values()] for record in records]
    return markdown(list(columns), rows)


def frame_markdown(data: pd.DataFrame) -> str:
    """A data frame without its index."""
    return markdown(list(data.columns), data.astype(str).to_numpy().tolist()) + "\n"
