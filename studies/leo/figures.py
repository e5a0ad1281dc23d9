"""Pictures and films of one Leo trial, each figure with its numbers as CSV beside it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Drawing

from sims.leo import Leo
from studies.learning.records import Results, by_name, policy_name
from studies.reporting.figures import draw_lines, draw_over_time, new_figure, save_figure, styled
from studies.reporting.media import encode_gif

CONTROL_PERIOD = 0.03
FILM_SECONDS = 6.0
TESTED = ("idealised", "difference", "control", "corrected", "true")


def film(states: np.ndarray) -> bytes:
    """A walk as a GIF, every second control period shown."""
    draw = Leo().renderer().frame
    steps = min(len(states), round(FILM_SECONDS / CONTROL_PERIOD))
    return encode_gif([draw(state) for state in states[:steps:2]], 2 * CONTROL_PERIOD)


@styled()
def torso_figure(rollouts: Mapping[str, Mapping[str, np.ndarray]], path: Path) -> Drawing:
    """Distance, height and pitch over time."""
    figure, axes = new_figure(3, 1, height=6.0, share_x=True)
    data: dict[str, np.ndarray] = {}
    rows = {}
    for row, label in enumerate(("distance (m)", "height (m)", "pitch (rad)")):
        series = {}
        for name, run in rollouts.items():
            values = run["states"][:, row] - (run["states"][0, row] if row == 0 else 0)
            series[name] = (np.arange(len(values)) * CONTROL_PERIOD, values)
            data[f"{name}, {label}"] = values
        rows[label] = series
    draw_over_time(figure, axes[:, 0], rows)
    save_figure(figure, path, data)
    return figure


@styled()
def updates_figure(results: Results, path: Path) -> Drawing:
    """Return on the true system per update."""
    figure, axes = new_figure()
    start = results["policies"][0]["return_true"]
    rows = []
    series = {}
    for name, label in (("difference", "difference model"), ("control", "no difference model")):
        if records := by_name(results, name):
            points = [(0, start)] + [(r["iteration"], r["return_true"]) for r in records]
            series[label] = tuple(np.array(points, float).T)
            rows += [{"policy": label, "update": a, "return": b} for a, b in points]
    draw_lines(axes[0, 0], series)
    for record in by_name(results, "true"):
        level = record["return_true"]
        axes[0, 0].axhline(level, color="#6e7781", linestyle=(0, (4, 3)))
        axes[0, 0].annotate(
            "learnt on the true system",
            (0.99, level),
            xycoords=("axes fraction", "data"),
            ha="right",
            va="bottom",
            fontsize=9,
        )
    axes[0, 0].set(xlabel="update", ylabel="return on the true Leo")
    axes[0, 0].xaxis.get_major_locator().set_params(integer=True)
    if series:
        axes[0, 0].legend()
    save_figure(figure, path, pd.DataFrame(rows))
    return figure


@styled()
def curves_figure(results: Results, path: Path) -> Drawing:
    """Test returns on the training model while learning."""
    series = {
        policy_name(record): tuple(np.array(record["curve"], float).T)
        for record in results["policies"]
        if record.get("curve") and record["name"] in TESTED
    }
    figure, axes = new_figure(height=3.8)
    draw_lines(axes[0, 0], series)
    axes[0, 0].set(xlabel="steps of this training", ylabel="return on the model")
    figure.legend(loc="outside upper left", ncols=2, handlelength=1.4)
    rows = [
        {"policy": name, "steps": a, "return": b}
        for name, (x, y) in series.items()
        for a, b in zip(x, y, strict=True)
    ]
    save_figure(figure, path, pd.DataFrame(rows))
    return figure
