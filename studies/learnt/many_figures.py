"""Figures over many trials, of any system: each with the numbers behind it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.ticker import MaxNLocator

from studies.learnt.figures import Drawn, plain_ticks, reference_line, scale_of_returns
from studies.learnt.statistics import mean
from studies.reporting.figures import PALETTE, new_figure, styled

# Errors below are drawn here, or a model without error would flatten all others.
LEAST_SHOWN = 1e-5


@styled()
def updates_figure(rows: pd.DataFrame) -> Drawn:
    """Return per update by estimator, and of the control; ``rows`` hold every policy once."""
    figure, axes = new_figure(height=3.8)
    axis = axes[0, 0]
    begin = rows[rows["name"] == "idealised"].drop_duplicates("seed")["return_true"].tolist()
    loops = list(rows[rows["name"] == "difference"].groupby("estimator"))
    if len(control := rows[rows["name"] == "control"]):
        loops.append(("no difference model", control))
    true = rows[rows["name"] == "true"].drop_duplicates("seed")["return_true"]
    factor = scale_of_returns(axis, rows["return_true"].tolist())
    numbers = []
    for colour, (label, part) in zip(PALETTE * 2, loops, strict=False):
        means = {0: mean(begin)} | {
            int(group["iteration"].iloc[0]): mean(group["return_true"].tolist())
            for _, group in part.groupby("iteration")
        }
        values = list(means.values())
        axis.plot(list(means), [factor * m.value for m in values], "o-", color=colour, label=label)
        bounds = [[factor * m.low for m in values], [factor * m.high for m in values]]
        axis.fill_between(list(means), *bounds, color=colour, alpha=0.15, linewidth=0)
        numbers += [
            {"method": label, "update": k, "return": m.value, "half_width": m.half_width}
            for k, m in means.items()
        ]
    if len(true):
        reference_line(axis, factor * true.mean(), "learnt on the true system")
    axis.set_xlabel("update")
    axis.xaxis.set_major_locator(MaxNLocator(integer=True))
    figure.legend(loc="outside upper left", ncols=3, handlelength=1.4)
    return figure, pd.DataFrame(numbers)


@styled()
def budgets_figure(
    rows: pd.DataFrame, errors: pd.DataFrame, about: Mapping[str, Any], best: float | None
) -> Drawn:
    """Return and one-step error after one update, against the true samples by estimator."""
    figure, axes = new_figure(2, 1, height=6.4, share_x=True)
    first = rows[(rows["name"] == "difference") & (rows["iteration"] == 1)]
    visited = errors[(errors["where"] == "visited") & (errors["iteration"] == 1)]
    groups = list(first.groupby("estimator", sort=False))
    factor = scale_of_returns(axes[0, 0], first["return_true"].tolist())
    numbers = []
    for place, (colour, (estimator, part)) in enumerate(zip(PALETTE * 2, groups, strict=False)):
        part = part.drop_duplicates(["true_samples", "seed"])
        means = {
            n: mean(group["return_true"].tolist()) for n, group in part.groupby("true_samples")
        }
        # Beside each other, or the intervals hide one another.
        beside = 1.06 ** (place - (len(groups) - 1) / 2)
        axes[0, 0].errorbar(
            [n * beside for n in means], [factor * m.value for m in means.values()],
            [m.half_width for m in means.values()], fmt="o-", color=colour, label=estimator,
            elinewidth=1.2, capsize=2,
        )  # fmt: skip
        own = visited[visited["estimator"] == estimator]
        channels = [f"one_step_{name}" for part in about["groups"].values() for name in part]
        error = own.groupby("samples_per_update")[channels].mean().mean(axis=1)
        axes[1, 0].plot(error.index * beside, np.maximum(error, LEAST_SHOWN), "o-", color=colour)
        numbers += [
            {"estimator": estimator, "true_samples": n, "return": m.value,
             "half_width": m.half_width, "worst": m.worst, "one_step": error.get(n)}
            for n, m in means.items()
        ]  # fmt: skip
    if best is not None:
        reference_line(axes[0, 0], factor * best, "the best possible")
    axes[0, 0].set_xscale("log")
    axes[1, 0].set(
        ylabel=f"one-step error / gap\n(at least {LEAST_SHOWN:g})",
        yscale="log", xlabel="true samples",
    )  # fmt: skip
    axes[1, 0].set_xticks(sorted(first["true_samples"].unique()), minor=False)
    axes[1, 0].set_xticks([], minor=True)
    plain_ticks(axes[1, 0].xaxis)
    figure.legend(loc="outside upper left", ncols=3, handlelength=1.4)
    return figure, pd.DataFrame(numbers)
