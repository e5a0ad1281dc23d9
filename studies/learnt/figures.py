"""Figures of one trial or many, of any system: each with the numbers behind it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, ScalarFormatter

from studies.learnt.statistics import mean
from studies.learnt.words import POLICY_WORDS, Results, policy_name
from studies.reporting.figures import (
    AMBER,
    BLUE,
    GREEN,
    INK,
    ORANGE,
    PALETTE,
    PINK,
    SKY,
    draw_lines,
    legend_above,
    new_figure,
    styled,
)

Drawn = tuple[Figure, pd.DataFrame]

# So much of an episode is drawn, in s, and of a slow system at least so many control periods.
_SECONDS, _LEAST_STEPS = 10.0, 100
#: Actions that are drawn under the states, if there are no more.
MOST_ACTIONS = 3
#: Errors below are drawn here, or a model without error would flatten all others.
LEAST_SHOWN = 1e-5
#: Colours of the first policy of each kind, in every figure.
_KINDS = {"idealised": BLUE, "difference": ORANGE, "control": GREEN, "corrected": PINK}
_DASHED: Any = {"color": "#6e7781", "linestyle": (0, (4, 3)), "linewidth": 1.2}


def reference_line(axis: Axes, level: float, words: str) -> None:
    """A dashed line across, with words on it."""
    axis.axhline(level, **_DASHED)
    axis.annotate(
        words, (0.99, level), xycoords=("axes fraction", "data"), ha="right", va="bottom",
        fontsize=9,
    )  # fmt: skip


def scale_of_returns(axis: Axes, returns: list[float]) -> float:
    """Label the axis of returns: minus the return and logarithmic where all are losses.

    Returns:
        Factor to draw returns with.
    """
    if max(returns) < 0:
        axis.set(ylabel="minus the return", yscale="log")
        if min(returns) > 10 * max(returns):
            plain_ticks(axis.yaxis)
        return -1.0
    axis.set_ylabel("return")
    return 1.0


def plain_ticks(axis: Axis) -> None:
    """Numbers in place of powers of ten, where a logarithmic axis covers few of them."""
    axis.set_major_formatter(ScalarFormatter())
    axis.set_minor_formatter(ScalarFormatter())


@styled()
def curves_figure(results: Results) -> Drawn:
    """Test returns while learning, in what each policy learnt in."""
    series = {
        policy_name(record): tuple(np.array(record["curve"], float).T)
        for record in results["policies"]
        if len(record["curve"]) > 1
    }
    figure, axes = new_figure(height=3.8)
    values = [value for _, y in series.values() for value in y]
    factor = scale_of_returns(axes[0, 0], values or [0.0])
    kinds = [str(r["name"]) for r in results["policies"] if policy_name(r) in series]
    axes[0, 0].set_prop_cycle(color=_by_kind(kinds) or PALETTE)
    draw_lines(axes[0, 0], {name: (x, factor * y) for name, (x, y) in series.items()})
    axes[0, 0].set_xlabel("steps of this training")
    if series:
        figure.legend(loc="outside upper left", ncols=2, handlelength=1.4)
    rows = [
        pd.DataFrame({"policy": name, "steps": x, "return": y}) for name, (x, y) in series.items()
    ]
    return figure, pd.concat(rows) if rows else pd.DataFrame()


def drawn_steps(dt: float) -> int:
    """How many steps of an episode are drawn over time."""
    return max(round(_SECONDS / dt), _LEAST_STEPS)


@styled()
def episodes_figure(
    about: Mapping[str, Any], episodes: Mapping[str, Mapping[str, np.ndarray]]
) -> Drawn:
    """The channels that the system shows, over the first seconds of each policy's episode.

    Args:
        about: The system.
        episodes: ``states`` and ``actions`` by name of the policy.
    """
    steps = drawn_steps(about["dt"])
    wanted: list[tuple[str, int, dict[str, Any]]] = [
        ("states", column, channel)
        for name in about["shown"]
        for column, channel in enumerate(about["states"])
        if channel["name"] == name
    ]
    if len(about["actions"]) <= MOST_ACTIONS:
        wanted += [("actions", column, one) for column, one in enumerate(about["actions"])]
    figure, axes = new_figure(len(wanted), 1, height=1.2 + 1.7 * len(wanted), share_x=True)
    data = []
    for axis, (what, column, channel) in zip(axes[:, 0], wanted, strict=True):
        series: dict[str, tuple[np.ndarray, np.ndarray]] = {}
        for name, episode in episodes.items():
            values = episode[what][:steps, column]
            if channel.get("angle"):
                # Whole turns off, so that all begin within half a turn of the first one's begin.
                near = next(iter(series.values()))[1][0] if series else 0.0
                values = values - 2 * np.pi * np.round((values[0] - near) / (2 * np.pi))
            time = np.arange(len(values)) * about["dt"]
            series[name] = (time, values)
            columns = {"time_s": time, "policy": name, "channel": channel["name"], "value": values}
            data.append(pd.DataFrame(columns))
        draw_lines(axis, series)
        axis.set_ylabel(f"{channel['name']} ({channel['unit']})")
    axes[-1, 0].set_xlabel("time (s)")
    legend_above(figure, axes[0, 0])
    return figure, pd.concat(data, ignore_index=True)


@styled()
def path_figure(
    about: Mapping[str, Any], episodes: Mapping[str, Mapping[str, np.ndarray]]
) -> Drawn:
    """The way of the place that the system shows, of one whole episode of each policy.

    Args:
        about: The system.
        episodes: ``states`` by name of the policy.
    """
    names = [channel["name"] for channel in about["states"]]
    columns = [names.index(name) for name in about["path"]]
    labels = [f"{names[c]} ({about['states'][c]['unit']})" for c in columns]
    figure, axes = new_figure(len(episodes), 1, height=0.8 + 1.3 * len(episodes), share_x=True)
    data = []
    for axis, colour, (name, episode) in zip(
        axes[:, 0], PALETTE * len(episodes), episodes.items(), strict=False
    ):
        along, up = (episode["states"][:, column] for column in columns)
        axis.plot(along, up, color=colour, linewidth=1.2)
        axis.set(title=name, ylabel=labels[1])
        axis.sharey(axes[0, 0])
        data.append(pd.DataFrame({"policy": name, about["path"][0]: along, about["path"][1]: up}))
    axes[-1, 0].set_xlabel(labels[0])
    return figure, pd.concat(data, ignore_index=True)


@styled()
def updates_figure(rows: pd.DataFrame) -> Drawn:
    """Return per update by estimator, and of the control and the baselines.

    Args:
        rows: Every policy once. Cold and warm start, learnt on the true system from as many
            samples as they say, stand where the last update is.
    """
    figure, axes = new_figure(height=3.8)
    axis = axes[0, 0]
    begin = rows[rows["name"] == "idealised"].drop_duplicates("seed")["return_true"].tolist()
    loops = list(rows[rows["name"] == "difference"].groupby("estimator"))
    if len(control := rows[rows["name"] == "control"]):
        loops.append(("no difference model", control))
    true = rows[rows["name"] == "true"].drop_duplicates("seed")["return_true"]
    factor = scale_of_returns(axis, rows["return_true"].tolist())
    numbers: list[tuple[str, int, float, float]] = []
    # Of estimators, and of the control, as in the other figures: blue is before.
    colours = _by_kind([str(part["name"].iloc[0]) for _, part in loops])
    for colour, (label, part) in zip(colours, loops, strict=True):
        means = {0: mean(begin)} | {
            int(group["iteration"].iloc[0]): mean(group["return_true"].tolist())
            for _, group in part.groupby("iteration")
        }
        values = list(means.values())
        axis.plot(list(means), [factor * m.value for m in values], "o-", color=colour, label=label)
        bounds = [[factor * m.low for m in values], [factor * m.high for m in values]]
        axis.fill_between(list(means), *bounds, color=colour, alpha=0.15, linewidth=0)
        numbers += [(str(label), at, found.value, found.half_width) for at, found in means.items()]
    last = int(rows["iteration"].max())
    for beside, name, mark in ((0.08, "cold", "v"), (0.16, "warm", "^")):
        for samples, part in rows[rows["name"] == name].groupby("true_samples"):
            found = mean(part.drop_duplicates("seed")["return_true"].tolist())
            label = f"{POLICY_WORDS[name]}, {samples} true samples"
            axis.errorbar(
                last + beside, factor * found.value, np.nan_to_num(found.half_width), fmt=mark,
                color=INK, capsize=3, label=label,
            )  # fmt: skip
            numbers.append((label, last, found.value, found.half_width))
    if len(true):
        reference_line(axis, factor * true.mean(), "learnt on the true system")
    axis.set_xlabel("update")
    axis.xaxis.set_major_locator(MaxNLocator(integer=True))
    figure.legend(loc="outside upper left", ncols=2, handlelength=1.4)
    return figure, pd.DataFrame(numbers, columns=["method", "update", "return", "half_width"])


def _by_kind(kinds: Sequence[str]) -> list[str]:
    """A colour for each policy in a row: its kind's, and then those that no kind has."""
    spare = iter([AMBER, SKY, PINK, GREEN, BLUE] * len(kinds))
    seen: set[str] = set()
    colours = []
    for kind in kinds:
        colours.append(next(spare) if kind in seen else _KINDS.get(kind, INK))
        seen.add(kind)
    return colours


@styled()
def budgets_figure(rows: pd.DataFrame, errors: pd.DataFrame, about: Mapping[str, Any]) -> Drawn:
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
    if (best := about.get("best")) is not None:
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
