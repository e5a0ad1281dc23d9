"""Figures of one trial, of any system: each with the numbers behind it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, ScalarFormatter

from studies.learnt.words import Results, by_name, grouped, policy_name
from studies.reporting.figures import draw_lines, draw_over_time, new_figure, styled

Drawn = tuple[Figure, pd.DataFrame]

#: So much of an episode is drawn, in s.
SECONDS = 10.0
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
def returns_figure(results: Results) -> Drawn:
    """Return on the true system against the true samples used, and of what it is compared with."""
    figure, axes = new_figure(height=3.8)
    axis = axes[0, 0]
    start = results["policies"][0]
    loop = [start, *by_name(results, "difference")]
    series = {"difference model": [(r["true_samples"], r["return_true"]) for r in loop]}
    if control := by_name(results, "control"):
        # The control uses no true samples: it is drawn where its update is.
        places = [r["true_samples"] for r in loop]
        series["as long without it"] = [(0, start["return_true"])] + [
            (place, r["return_true"]) for place, r in zip(places[1:], control, strict=False)
        ]
    for record in (*by_name(results, "cold"), *by_name(results, "warm")):
        series[policy_name(record)] = [(step, value) for step, value in record["curve"]]
    target, true = results["about"]["target"], by_name(results, "true")
    levels = [("the target", target)] if target is not None else []
    levels += [(policy_name(record), record["return_true"]) for record in true]
    every = [value for points in series.values() for _, value in points]
    factor = scale_of_returns(axis, [*every, *(level for _, level in levels)])
    rows = []
    drawn = {}
    for name, points in series.items():
        x, y = np.array(points, float).T
        drawn[name] = (x, factor * y)
        rows += [{"policy": name, "true_samples": a, "return": b} for a, b in points]
    draw_lines(axis, drawn)
    for words, level in levels:
        reference_line(axis, factor * level, words)
    axis.set_xlabel("true samples")
    axis.xaxis.set_major_locator(MaxNLocator(integer=True))
    figure.legend(loc="outside upper left", ncols=2, handlelength=1.4)
    return figure, pd.DataFrame(rows)


@styled()
def accuracy_figure(results: Results) -> Drawn:
    """One-step error per update and group of channels, where the policy goes and elsewhere."""
    groups = results["about"]["groups"]
    rows = [
        {"true_samples": record["true_samples"], "where": words, "channels": name, "error": error}
        for record in results["accuracy"]
        for where, words in (("visited", "where the policy goes"), ("uniform", "anywhere"))
        if where in record
        for name, error in grouped(record[where]["one_step"], groups).items()
    ]
    table = pd.DataFrame(rows, columns=["true_samples", "where", "channels", "error"])
    names = list(dict.fromkeys(table["channels"])) or ["error"]
    figure, axes = new_figure(len(names), 1, share_x=True, height=1.0 + 1.4 * len(names))
    for axis, name in zip(axes[:, 0], names, strict=True):
        for where, part in table[table["channels"] == name].groupby("where", sort=False):
            axis.plot(part["true_samples"], part["error"], marker="o", label=where)
        axis.set_ylabel(name)
        if (table["error"] > 0).any():
            axis.set_yscale("log")
        axis.set_xticks(sorted(set(table["true_samples"])))
    axes[-1, 0].set_xlabel("true samples")
    handles = axes[0, 0].get_legend_handles_labels()
    figure.legend(*handles, loc="outside upper left", ncols=2, handlelength=1.4)
    return figure, table


@styled()
def curves_figure(results: Results) -> Drawn:
    """Test returns while learning, in what each policy learnt in."""
    series = {
        policy_name(record): tuple(np.array(record["curve"], float).T)
        for record in results["policies"]
        if len(record["curve"]) > 1 and record["name"] not in ("cold", "warm")
    }
    figure, axes = new_figure(height=3.8)
    values = [value for _, y in series.values() for value in y]
    factor = scale_of_returns(axes[0, 0], values or [0.0])
    draw_lines(axes[0, 0], {name: (x, factor * y) for name, (x, y) in series.items()})
    axes[0, 0].set_xlabel("steps of this training")
    if series:
        figure.legend(loc="outside upper left", ncols=2, handlelength=1.4)
    rows = [
        {"policy": name, "steps": a, "return": b}
        for name, (x, y) in series.items()
        for a, b in zip(x, y, strict=True)
    ]
    return figure, pd.DataFrame(rows)


@styled()
def episodes_figure(results: Results, episodes: Mapping[str, Mapping[str, np.ndarray]]) -> Drawn:
    """The channels that the system shows, over the first seconds of each policy's episode.

    Args:
        results: What ``results.json`` holds.
        episodes: ``states`` and ``actions`` by name of the policy.
    """
    about = results["about"]
    names = [channel["name"] for channel in about["states"]]
    steps = round(SECONDS / about["dt"])
    wanted: list[tuple[str, int, dict[str, Any]]] = [
        ("states", names.index(name), about["states"][names.index(name)]) for name in about["shown"]
    ]
    if len(about["actions"]) == 1:
        wanted.append(("actions", 0, about["actions"][0]))
    figure, axes = new_figure(len(wanted), 1, height=1.2 + 1.7 * len(wanted), share_x=True)
    rows, data = {}, []
    for what, column, channel in wanted:
        label = f"{channel['name']} ({channel['unit']})"
        series = {}
        for name, episode in episodes.items():
            values = episode[what][:steps, column]
            if channel.get("angle"):
                # Where the run ends counts as the first turn: no jumps, whatever the turns.
                values = values - 2 * np.pi * np.round(values[-1] / (2 * np.pi))
            time = np.arange(len(values)) * about["dt"]
            series[name] = (time, values)
            data.append(pd.DataFrame({"time_s": time, "policy": name, "channel": channel["name"],
                                      "value": values}))  # fmt: skip
        rows[label] = series
    draw_over_time(figure, axes[:, 0], rows)
    return figure, pd.concat(data, ignore_index=True)
