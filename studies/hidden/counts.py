"""Counts and shares of sets, as the tables of hidden_effects show them."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import pandas as pd
from scipy.stats import beta


def share(hits: int, count: int) -> str:
    """A share in per cent with its count and its exact 95 % interval.

    Source: Clopper and Pearson, "The use of confidence or fiducial limits", Biometrika 26 (1934).
    """
    if count == 0:
        return "-"
    low = beta.ppf(0.025, hits, count - hits + 1) if hits else 0.0
    high = beta.ppf(0.975, hits + 1, count - hits) if hits < count else 1.0
    return f"{100 * hits / count:.0f} % ({hits}/{count}; {100 * low:.0f} to {100 * high:.0f})"


def count(hits: int, total: int) -> str:
    """``hits/total``, or a dash if there is nothing to count."""
    return f"{hits}/{total}" if total else "-"


def told(column: pd.Series, form: Callable[[int, int], str] = count) -> str:
    """How often a column holds, where it is known."""
    known = column.dropna()
    return form(int(known.astype(bool).sum()), len(known))


def asked(
    rows: Iterable[tuple[str, str, pd.Series]], seconds: pd.Series, wanted: str
) -> pd.DataFrame:
    """What is asked, how often it should be so, and how often it was.

    Args:
        rows: What, how often, and a column that says of each set whether it is so; without a set
            there is no row.
        seconds: Processor time of each set.
        wanted: What its median and its largest should be.
    """
    found = [(what, often, told(column, share)) for what, often, column in rows if len(column)]
    if len(seconds):
        spent = f"{seconds.median():.1f} and {seconds.max():.1f}"
        found.append(("processor s, median and worst", wanted, spent))
    return pd.DataFrame(found, columns=["what", "wanted", "found"])
