"""Errors of Leo's 18 channels, told by group: torso and joints, positions and rates."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

GROUPS = ("base", "joint angles", "base rates", "joint rates")


def group(channel: str) -> str:
    """The group of a state channel: base or joints, positions or rates."""
    joint = any(part in channel for part in ("hip", "knee", "ankle"))
    rate = channel.endswith("rate")
    return {
        (False, False): "base",
        (True, False): "joint angles",
        (False, True): "base rates",
        (True, True): "joint rates",
    }[joint, rate]


def grouped(errors: Mapping[str, float]) -> dict[str, float]:
    """Errors by channel, averaged within each group; a channel without a gap is left out."""
    table = pd.Series({name: error for name, error in errors.items() if np.isfinite(error)})
    means = table.groupby([group(name) for name in table.index]).mean()
    return {name: float(means[name]) for name in GROUPS if name in means}


def overall(errors: Mapping[str, float]) -> float | None:
    """The mean over the groups; None without errors."""
    return float(np.mean(list(grouped(errors).values()))) if errors else None
