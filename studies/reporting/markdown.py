"""Tables as Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import pandas as pd


def markdown(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table, one line a row; nothing if there are no rows."""
    lines = [head, ["---"] * len(head), *rows]
    text = "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)
    return text if len(lines) > 2 else ""


def frame_markdown(data: pd.DataFrame) -> str:
    """A data frame without its index."""
    return markdown(list(data.columns), data.astype(str).to_numpy().tolist()) + "\n"
