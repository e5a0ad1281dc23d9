"""The gap in the report: its size before and after, forecasts, and where it is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from residual.gap import GapResult
from residual.gap.result import Rollout
from studies.gap.figures import lags, profile, rollout, shrinking
from studies.gap.words import quantity_text, seconds_text
from studies.reporting import Figure, Gallery, KeyValues, Prose, Section, Table
from studies.reporting.sections import Cell

# Pictures of the same kind beyond these say nothing new.
ROLLOUTS, PROFILES = 4, 6


def tiles(result: GapResult) -> KeyValues:
    """The headline numbers."""
    gap = result.gap
    ahead = f"{seconds_text(gap.horizon_s)} error of {gap.channel}"
    items: dict[str, Any] = {f"{ahead}, nominal": quantity_text(gap.before.value, gap.unit)}
    if result.effects:
        items[f"{ahead}, corrected"] = quantity_text(gap.after.value, gap.unit)
    items["what noise alone would give"] = quantity_text(gap.noise_floor.value, gap.unit)
    if gap.ceiling is not None:
        items["with a flexible estimator instead"] = quantity_text(gap.ceiling.value, gap.unit)
    return KeyValues(items, style="tiles")


def rollouts(result: GapResult, folder: Path) -> list[Section]:
    """Held-out forecasts, before and after."""
    pictures = [
        Figure(
            rollout(result, shown, folder / f"rollout-{number}.png"),
            f"Forecast of {shown.run}: measured dots, nominal and corrected curves.",
            heading=f"{Path(shown.run).name}, from {seconds_text(shown.times[0])}",
        )
        for number, shown in enumerate(spread(result), start=1)
    ]
    if not pictures:
        return []
    return [
        Gallery(
            pictures,
            f"Forecasts over {seconds_text(result.gap.horizon_s)} on data that were not used to "
            "find the answer. Each starts from a state fitted to the samples before it.",
            heading="Before and after, on held-out data",
        )
    ]


def spread(result: GapResult) -> list[Rollout]:
    """A few rollouts, from the first to the last."""
    found = result.rollouts
    chosen = np.unique(np.linspace(0, len(found) - 1, min(ROLLOUTS, len(found))).astype(int))
    return [found[i] for i in chosen]


def bars(result: GapResult, folder: Path) -> Figure:
    """The gap, shrinking."""
    gap = result.gap
    left_out = (
        f" {100 * gap.left_out:.0f} % of the forecasts were left out, since no model could make "
        "them from a noisy start."
        if gap.left_out > 0.005
        else ""
    )
    error = "Root mean square error"
    if result.robust:
        error = "Median over forecasts of the root mean square error"
    return Figure(
        shrinking(result, folder / "gap.png"),
        f"The error falls from {gap.before.value:.3g} to {gap.after.value:.3g} {gap.unit}; noise "
        f"alone gives {gap.noise_floor.value:.3g}.",
        f"{error} of {gap.channel} over {seconds_text(gap.horizon_s)} on held-out "
        "data, with the 95 % interval over forecasts. **Noise floor**: what the corrected "
        f"simulator would reach on its own data plus noise. **Flexible estimator**: the nominal "
        f"simulator plus a learnt correction without physics.{left_out}",
        heading="The gap, step by step",
    )


def where(result: GapResult, folder: Path) -> list[Section]:
    """Channel, region and lag."""
    gap = result.gap
    rows: list[list[Cell]] = []
    for name, ratio in result.where.by_channel.items():
        of = gap.by_channel[name]
        rows.append([
            f"{name} ({of.unit})" if of.unit else name, float(ratio), of.before.value,
            of.after.value, of.noise_floor.value, of.ceiling.value if of.ceiling else None,
        ])  # fmt: skip
    sections: list[Section] = [
        Table(
            ["channel", "residual / noise", "nominal", "corrected", "noise floor",
             "flexible estimator"],
            rows,
            "Residual of the nominal simulator in training windows over the noise (1 is noise), "
            "and held-out forecast errors.",
            heading="Where the nominal simulator fails",
        )
    ]  # fmt: skip
    pictures = [
        Figure(
            profile(found, folder / f"missing-{number}.png"),
            f"Missing rate of change of {found.target} against {found.variable}.",
            heading=f"against {found.variable}",
        )
        for number, found in enumerate(result.where.profiles[:PROFILES], start=1)
    ]
    delayed = lags(result, folder / "lags.png")
    if delayed is not None:
        pictures.append(Figure(delayed, "Correlation with past inputs.", heading="against lag"))
    if pictures:
        sections.append(
            Gallery(
                pictures,
                "What the nominal simulator's equation lacks, estimated without any effect: mean "
                "and 95 % band. Zero everywhere means that nothing is missing there. A single "
                "effect may show in several of them, since states go together.",
            )
        )
    worst = sorted(result.where.run_ratio.items(), key=lambda item: -item[1])
    if len(worst) > 1:
        high, low = worst[0], worst[-1]
        sections.append(
            Prose(
                f"By run, residual over noise goes from {low[1]:.3g} ({low[0]}) to {high[1]:.3g} "
                f"({high[0]})."
            )
        )
    return sections
