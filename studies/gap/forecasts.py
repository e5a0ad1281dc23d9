"""The gap in the report: its size before and after, forecasts, and where it is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure as Drawing

from residual.gap import GapResult
from residual.gap.result import Gap, Rollout, Verdict
from residual.trajectories import duration_text, moment
from sims.effects import Curve, CurveFromZero, ParameterCurve
from studies.gap.figures import curve, drawn, lags, profile, rollout, shrinking
from studies.gap.words import (
    CROSS_VALIDATED,
    ahead,
    capitalized,
    percent,
    quantity_text,
    unit_text,
    with_unit,
)
from studies.reporting.sections import Cell, Figure, Gallery, KeyValues, Prose, Section, Table

# Pictures of the same kind beyond these say nothing new.
ROLLOUTS, PROFILES = 4, 6


def tiles(result: GapResult) -> KeyValues:
    """The headline numbers."""
    gap = result.gap
    items: dict[str, Any] = {}
    if result.effects:
        items["of the gap has a name"] = percent(gap.share.value).replace("more than", ">")
    items[f"{ahead(gap)}, nominal"] = quantity_text(gap.before.value, gap.unit)
    if result.effects:
        items[f"{ahead(gap)}, corrected"] = quantity_text(gap.after.value, gap.unit)
    items["what noise alone would give"] = quantity_text(gap.noise_floor.value, gap.unit)
    return KeyValues(items, style="tiles")


def rollouts(result: GapResult, folder: Path) -> list[Section]:
    """Forecasts before and after."""
    pictures = [
        Figure(
            rollout(result, shown, folder / f"rollout-{number}.png"),
            f"Forecast of {shown.run}: measured dots, nominal and corrected curves.",
            heading=f"{Path(shown.run).name}, from {moment(shown.times[0])}",
        )
        for number, shown in enumerate(spread(result), start=1)
    ]
    if not pictures:
        return []
    return [
        Gallery(
            pictures,
            f"Forecasts over {duration_text(result.gap.horizon_s)} of data that did not fit the "
            "numbers. Each starts from a state fitted to its first samples.",
            heading="Before and after",
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
    in_vain = (
        f" **In {gap.no_better} of the blocks** the corrected simulator forecasts no better than "
        "the nominal one."
        if result.effects and gap.no_better
        else ""
    )
    return Figure(
        shrinking(result, folder / "gap.png"),
        f"{_course(gap)}{unit_text(gap.unit)}; noise alone gives {gap.noise_floor.value:.3g}.",
        f"Root mean square error of {gap.channel} over {duration_text(gap.horizon_s)}, in "
        f"{CROSS_VALIDATED}: {gap.blocks} blocks of the records, dealt over {gap.folds} groups "
        "that are left out in turn; 95 % interval over blocks. **Noise floor**: what the corrected "
        f"simulator would reach on its own data plus noise.{in_vain}",
        heading="The gap, step by step",
    )


def _course(gap: Gap) -> str:
    """What becomes of the error, as far as the digits that are shown tell."""
    before, after = f"{gap.before.value:.3g}", f"{gap.after.value:.3g}"
    if before == after:
        return f"The error stays at {after}"
    course = "falls" if gap.after.value < gap.before.value else "rises"
    return f"The error {course} from {before} to {after}"


def curves(result: GapResult, folder: Path) -> list[Section]:
    """Laws by points, where what was measured follows a curve of its own."""
    return [
        _curve(curve(result, verdict, effect, folder / f"curve-{number}.png"), verdict, effect)
        for number, verdict in enumerate(result.verdicts, start=1)
        for effect in result.effects
        if isinstance(effect, Curve) and str(effect) == verdict.label and verdict.parameters
    ]


def _curve(drawing: Drawing, verdict: Verdict, effect: Curve) -> Figure:
    what = f"{capitalized(drawn(effect))} at {verdict.where} by {effect.by}"
    lacking = f"No law in the library comes near what was measured at {verdict.where}"
    if isinstance(effect, ParameterCurve):
        what = f"Change of {effect.parameter.replace('_', ' ')} with {effect.by}"
        lacking = f"As a constant, {effect.parameter} leaves clearly more than noise"
    zero = " and zero" if isinstance(effect, CurveFromZero) else ""
    return Figure(
        drawing,
        f"{what}: what was found, with 95 % intervals.",
        f"{lacking}: this curve through {len(verdict.parameters)} points{zero} takes most of that "
        "off.",
        heading=what,
    )


def set_aside(result: GapResult) -> list[Section]:
    """Errors on the records that were never used."""
    gap = result.held_out
    if gap is None:
        return []
    return [
        Table(
            ["channel", "nominal", "corrected", "noise floor"],
            _errors(gap),
            f"Root mean square errors over {duration_text(gap.horizon_s)} in the records that were "
            "held out: they had no part in the answer.",
            heading="Records set aside",
        )
    ]


def _errors(gap: Gap) -> list[list[Cell]]:
    """Channel, nominal, corrected, noise floor."""
    return [
        [with_unit(name, of.unit), of.before.value, of.after.value, of.noise_floor.value]
        for name, of in gap.by_channel.items()
    ]


def where(result: GapResult, folder: Path) -> list[Section]:
    """Channel, region and lag."""
    ratios = result.where.by_channel
    rows: list[list[Cell]] = [
        [*errors, float(ratios[name])]
        for name, errors in zip(result.gap.by_channel, _errors(result.gap), strict=True)
    ]
    sections: list[Section] = [
        Table(
            ["channel", "nominal", "corrected", "noise floor", "nominal's residual / noise"],
            rows,
            f"Root mean square errors, {CROSS_VALIDATED}; and the residual of the nominal "
            "simulator over the noise in windows with free start states (1 is noise).",
            heading="Where the nominal simulator fails",
        )
    ]
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
                "By run, the nominal simulator's residual over the noise, of all channels "
                f"together, goes from {low[1]:.3g} ({low[0]}) to {high[1]:.3g} ({high[0]})."
            )
        )
    return sections
