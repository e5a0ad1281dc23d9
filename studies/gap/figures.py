"""The pictures of find_gap's report; each is saved as PNG with its numbers as CSV."""

from __future__ import annotations

import dataclasses
import textwrap
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from residual.gap import GapResult
from residual.gap.fitting.where import Profile
from residual.gap.result import Rollout, Verdict
from sims.effects import Curve
from studies.gap.words import FLOOR, gap_rows, quantity_text, typeset, with_unit
from studies.reporting.figures import (
    AMBER,
    BLUE,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    new_figure,
    save_figure,
    styled,
)

NARROW = 4.0
#: Letters of a name on one line beside a bar.
LONGEST_NAME = 22


@styled()
def shrinking(result: GapResult, path: Path | None = None) -> Drawing:
    """One bar per step from the nominal simulator on, and a line for the noise."""
    gap = result.gap
    rows = [row for row in gap_rows(gap) if row[0] != FLOOR]
    figure, axes = new_figure(height=1.15 + 0.42 * len(rows))
    axis: Axes = axes[0, 0]
    top = max(span.high for _, span in rows)
    for place, (_, span) in enumerate(rows):
        axis.barh(place, span.value, height=0.6, color=ORANGE if place == 0 else BLUE)
        axis.hlines(place, span.low, span.high, color=INK, linewidth=1.3)
        times = span.value / max(gap.noise_floor.value, 1e-300)
        text = f"{quantity_text(span.value, gap.unit)}, {float(f'{times:.3g}'):g} × noise"
        inside = span.low > 0.5 * top
        axis.annotate(
            text, (0 if inside else span.high, place), xytext=(7, 0), textcoords="offset points",
            va="center", color="white" if inside else INK, fontsize=9,
        )  # fmt: skip
    axis.axvline(gap.noise_floor.value, color=GREEN, linestyle=(0, (4, 3)), label="noise floor")
    axis.set_yticks(range(len(rows)), [textwrap.fill(name, LONGEST_NAME) for name, _ in rows])
    axis.set(ylim=(len(rows) - 0.5, -0.5), xlim=(0, 1.06 * top))
    axis.set_xlabel(with_unit(f"error of {gap.channel}", gap.unit))
    axis.grid(axis="y", visible=False)
    axis.tick_params(axis="y", length=0)
    figure.legend(loc="outside upper left", handlelength=1.8)
    steps = [{"step": name, **dataclasses.asdict(span)} for name, span in gap_rows(gap)]
    if path:
        save_figure(figure, path, pd.DataFrame(steps))
    return figure


@styled()
def rollout(result: GapResult, shown: Rollout, path: Path) -> Drawing:
    """One forecast: measured dots, nominal and corrected, noise band around the latter."""
    count = len(result.channels)
    figure, axes = new_figure(count, 1, width=NARROW, height=0.7 + 1.55 * count, share_x=True)
    time = shown.times - shown.times[0]
    data: dict[str, np.ndarray] = {"time_s": time}
    for column, (name, unit) in enumerate(result.channels):
        axis: Axes = axes[column, 0]
        seen, before, after = (a[:, column] for a in (shown.seen, shown.before, shown.after))
        sigma = result.noise[name][0]
        axis.fill_between(time, after - 2 * sigma, after + 2 * sigma, color=BLUE, alpha=0.18,
                          linewidth=0, label="± 2 × noise" if column == 0 else None)  # fmt: skip
        first = column == 0
        if result.effects:
            axis.plot(time, before, color=ORANGE, label="nominal" if first else None)
        own = "corrected" if result.effects else "simulator"
        axis.plot(time, after, color=BLUE, label=own if first else None)
        axis.plot(time, seen, "o", color=INK, markersize=3 if len(time) < 80 else 1.6,
                  label="measured" if first else None)  # fmt: skip
        label = with_unit(name, unit)
        # A panel is as high as some twenty letters.
        axis.set_ylabel(label.replace(" (", "\n(") if len(name) > 10 else label)
        # A nominal forecast that runs away must not flatten all else.
        good = seen[np.isfinite(seen)]
        if len(good):
            span = max(float(np.ptp(good)), 6 * sigma)
            floor, top = good.min() - 0.8 * span, good.max() + 0.8 * span
            bounds = np.nan_to_num(np.array([before.min(), before.max()]))
            axis.set_ylim(
                max(floor, min(bounds[0], good.min(), after.min()) - 0.05 * span),
                min(top, max(bounds[1], good.max(), after.max()) + 0.05 * span),
            )
        data |= {f"{name} measured": seen, f"{name} nominal": before, f"{name} corrected": after}
    axes[-1, 0].set_xlabel("time (s)")
    figure.align_ylabels()
    figure.legend(loc="outside upper left", ncols=2, handlelength=1.2, columnspacing=1.2)
    save_figure(figure, path, data)
    return figure


@styled()
def curve(result: GapResult, verdict: Verdict, effect: Curve, path: Path) -> Drawing:
    """A law by points, with their intervals; of an actuator what comes out, by the command."""
    measures = effect.measures(result.corrected)
    figure, axes = new_figure(height=3.0)
    axis: Axes = axes[0, 0]
    low, high = effect.reach
    along = np.linspace(low, high, 121)
    out = effect.along == "input"
    values = effect.at(along) + (along if out else 0.0)
    axis.axhline(0, color=MUTED, linewidth=0.9)
    if out:
        axis.plot(along, along, "--", color=MUTED, label="nominal: in proportion")
    axis.plot(along, values, color=BLUE, label="found")
    for field, number in verdict.parameters.items():
        x, _ = effect.point_of(field) or (np.nan, "")
        base = x if out else 0.0
        axis.plot([x], [base + number.value], "o", color=BLUE, markersize=4.5)
        axis.vlines(x, base + number.low, base + number.high, color=INK, linewidth=1.3)
    axis.set(xlim=(low, None))
    if effect.along == "rate":
        axis.set_ylim(0, None)
    if out:
        figure.legend(loc="outside upper left", ncols=2)
    unit = next(iter(verdict.parameters.values())).unit
    gives = drawn(effect)
    axis.set_xlabel(with_unit(effect.by, measures[effect.along][0]))
    axis.set_ylabel(with_unit(gives, unit.replace("/s/s", "/s^2")))
    save_figure(figure, path, {effect.by: along, gives: values})
    return figure


def drawn(effect: Curve) -> str:
    """What its figure shows, in words."""
    return "output" if effect.along == "input" else effect.gives


@styled()
def profile(found: Profile, path: Path) -> Drawing:
    """Missing acceleration against one state or input."""
    figure, axes = new_figure(width=NARROW, height=2.5)
    axis: Axes = axes[0, 0]
    axis.axhline(0, color=MUTED, linewidth=0.9)
    axis.fill_between(found.centres, found.low, found.high, color=BLUE, alpha=0.2, linewidth=0)
    axis.plot(found.centres, found.mean, "o-", color=BLUE, markersize=4.5)
    axis.set_xlabel(with_unit(found.variable, found.unit))
    unit = found.target_unit.replace("/s/s", "/s²")
    axis.set_ylabel(f"missing change of\n{found.target} ({typeset(unit)})")
    save_figure(
        figure, path,
        {"centre": found.centres, "mean": found.mean, "low": found.low, "high": found.high},
    )  # fmt: skip
    return figure


@styled()
def lags(result: GapResult, path: Path) -> Drawing | None:
    """Correlation of what is missing with the inputs of some time ago."""
    where = result.where
    if not where.lag_correlation:
        return None
    figure, axes = new_figure(width=NARROW, height=2.5)
    axis: Axes = axes[0, 0]
    axis.axhline(0, color=MUTED, linewidth=0.9)
    colours = (BLUE, ORANGE, GREEN, AMBER)
    for number, (name, values) in enumerate(where.lag_correlation.items()):
        axis.plot(where.lags_s, values, "o-", color=colours[number % 4], markersize=4.5, label=name)
    axis.set(xlabel="lag of the input (s)", ylabel="correlation", ylim=(-1.05, 1.05))
    if len(where.lag_correlation) > 1:
        figure.legend(loc="outside upper left", ncols=2)
    save_figure(figure, path, {"lag_s": where.lags_s, **where.lag_correlation})
    return figure
