"""What one policy returns more than another: in pairs, or their common luck would count twice."""

from __future__ import annotations

import pandas as pd

from studies.learnt.tables import BY_START


def above(one: pd.DataFrame, other: pd.DataFrame) -> list[float]:
    """Returns on the true system of one kind of policy less those of another.

    Args:
        one: Rows of ``tables.policy_rows``, one for each seed.
        other: The same of another kind; rows of other settings do not count.

    Returns:
        Of several seeds one difference for each that both have; of a single one a difference for
        each common start, or of the means if none was kept. Empty without a common seed.
    """
    keys = ["seed", *(["settings"] if "settings" in one and "settings" in other else [])]
    pairs = one.merge(other.drop_duplicates(keys), on=keys)
    if len(pairs) == 1:
        first, second = (pairs[f"{BY_START}_{side}"].iloc[0] for side in ("x", "y"))
        if common := [first[start] - second[start] for start in first if start in second]:
            return common
    return [float(value) for value in pairs["return_true_x"] - pairs["return_true_y"]]


def starts(rows: pd.DataFrame) -> int:
    """From how many starts each policy was tested on the true system."""
    return max([1, *rows[BY_START].map(len)])
