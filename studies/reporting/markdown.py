"""Tables as Markdown."""

from __future__ import annotations

import pandas as pd


def markdown(data: pd.DataFrame) -> str:
    """A table with its header, one line a row."""
    rows = [list(data.columns), ["---"] * len(data.columns), *data.astype(str).to_numpy().tolist()]
    return "".join("| " + " | ".join(row) + " |\n" for row in rows)
