"""The errors of difference models, out of the tables over trials."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

# A step of the true system that differs by less, as a share of what the step changes, does not.
_NO_GAP = 1e-4
# What is left of a gap of which no interval is worth a word.
_EXACT = 1e-3
#: Prefixes of the columns with the ends of the one-step error's interval over rollouts.
ENDS = ("low95", "high95")


def model_errors(errors: pd.DataFrame, estimator: str, samples: int, update: int) -> pd.DataFrame:
    """The errors of one difference model where the policy goes, one row for each seed."""
    if errors.empty:
        return errors
    wanted = {"where": "visited", "estimator": estimator, "true_samples": samples,
              "iteration": update}  # fmt: skip
    return errors[(errors[list(wanted)] == pd.Series(wanted)).all(axis=1)]


def by_group(errors: pd.DataFrame, prefix: str, about: Mapping[str, Any]) -> pd.DataFrame:
    """Errors by group of channels, one row per trial and update.

    Args:
        errors: Rows of ``tables.accuracy_rows``.
        prefix: ``"one_step"``, of which channels without a gap are left out, or a horizon.
        about: The system.
    """
    part = by_channel(errors) if prefix == "one_step" else _measured(errors, prefix)
    groups = {name: part.reindex(columns=list(own)) for name, own in about["groups"].items()}
    return pd.DataFrame({name: own.mean(axis=1) for name, own in groups.items()})


def by_channel(errors: pd.DataFrame) -> pd.DataFrame:
    """One-step errors by channel, without those of channels that have no gap."""
    part = _measured(errors, "one_step")
    gaps = _measured(errors, "gap").reindex(columns=part.columns)
    return part.mask(gaps <= _NO_GAP)


def over_rollouts(
    errors: pd.DataFrame, group: str, about: Mapping[str, Any]
) -> tuple[float, float] | None:
    """Interval of a group's one-step error over the rollouts of one trial, mean over its channels.

    None of several trials, whose spread tells more, where there is none of a channel, and where
    next to nothing is left.
    """
    if len(errors) != 1:
        return None
    there = by_channel(errors).iloc[0].reindex(list(about["groups"][group])).dropna()
    channels = list(there.index)
    wanted = [[f"{end}_{channel}" for channel in channels] for end in ENDS]
    if not channels or not {*wanted[0], *wanted[1]} <= set(errors.columns):
        return None
    low, high = (float(errors[names].iloc[0].astype(float).mean(skipna=False)) for names in wanted)
    return (low, high) if np.isfinite([low, high]).all() and high > _EXACT else None


def _measured(errors: pd.DataFrame, prefix: str) -> pd.DataFrame:
    """One kind of measurement by channel; what is beyond all bounds is not known."""
    part = errors.filter(regex=f"^{re.escape(prefix)}_").astype(float)
    part = part.replace([np.inf, -np.inf], np.nan)
    return part.rename(columns=lambda name: name.removeprefix(f"{prefix}_"))


def no_gap(errors: pd.DataFrame) -> bool:
    """Whether the true system did what the simulator does in all that was measured."""
    gaps = _measured(errors, "gap")
    # Where a gap is not known, or is beyond all bounds, it is not nothing.
    return bool(gaps.size and (gaps <= _NO_GAP).all(axis=None))
