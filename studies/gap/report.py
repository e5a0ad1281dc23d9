"""The report of find_gap: verdict first, then what it rests on."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
import yaml

from residual.gap import GapResult
from residual.gap.result import Rollout
from residual.gap.result import Verdict as Answer
from studies.gap.figures import lags, profile, rollout, shrinking
from studies.gap.words import (
    KINDS,
    effect_name,
    experiment,
    headline,
    label_of,
    quantity_text,
    seconds_text,
    sentence,
    set_name,
    twins,
)
from studies.reporting import (
    Code,
    Figure,
    Gallery,
    KeyValues,
    Prose,
    Report,
    Section,
    Table,
    Verdict,
)
from studies.reporting.sections import Cell

Tone = Literal["good", "warning", "bad", "neutral"]
TONES: dict[str, Tone] = {
    "confirmed": "good",
    "ambiguous": "warning",
    "needs_data": "neutral",
    "unexplained": "bad",
    "no_gap": "good",
}
# Pictures of the same kind beyond these say nothing new.
ROLLOUTS, PROFILES, FINDINGS, RIVALS = 4, 6, 12, 10


def write_report(result: GapResult, record: Mapping[str, Any], folder: Path) -> Path:
    """Figures as PNG with their numbers as CSV, and ``report.html``, into ``folder``.

    Args:
        result: What was found.
        record: What ``gap.json`` holds.
        folder: Where to.
    """
    figures = folder / "figures"
    sections: list[Section] = [
        *(banner(v, result) for v in result.verdicts if v.kind != "needs_data"),
        tiles(result),
        *rollouts(result, figures),
        bars(result, figures),
        *where(result, figures),
        evidence(result),
        *apart(result),
        *blind(result),
        *quality(result, record),
        *provenance(record),
    ]
    logs = record["config"]["logs"]
    names = ", ".join(Path(log).name for log in logs[:3])
    more = f" and {len(logs) - 3} more" if len(logs) > 3 else ""
    report = Report(
        f"Gap report: {result.corrected.name}",
        f"Where the simulator and {names}{more} disagree, and what is missing.",
        sections,
        footer(record),
    )
    return report.write(folder / "report.html")


def banner(answer: Answer, result: GapResult) -> Verdict:
    """One verdict."""
    text = []
    if answer.effect:
        label = label_of(answer)
        text.append(sentence(label, result))
        same = [a for a in answer.alternatives if a in twins(result).get(label, ())]
        ties = [a for a in answer.alternatives if a not in same]
        if ties:
            family = f", all of them {answer.family}" if answer.family else ""
            text.append(f"These data cannot tell it from **{names_of(ties)}**{family}.")
        if same:
            text.append(f"No motion can tell it from **{names_of(same)}**.")
        if answer.kind == "confirmed":
            text.append("Confirmed on held-out data.")
        elif "nothing confirms it" in answer.says:
            text.append("Held-out data do not go where it shows, so nothing confirms it.")
        elif not ties:
            text.append("A remainder is unexplained, so take this as a lead.")
        if "provisional" in answer.says:
            text.append("Provisional: there is one record only, whose end was held out.")
    elif answer.kind == "unexplained" and answer.says.startswith("unexplained: no single"):
        text.append("Together they reach the noise, but so do others: take the names as leads.")
    elif answer.kind == "unexplained":
        text.append(
            "Something is left above the noise that no effect of the library names; the figures "
            "below show where."
        )
    elif answer.kind == "no_gap":
        text.append("The simulator predicts held-out data as well as the noise allows.")
    return Verdict(
        headline(answer, result), " ".join(text), tone=TONES[answer.kind], label=KINDS[answer.kind]
    )


def names_of(labels: list[str]) -> str:
    """Effects in words: ``a, b or c``."""
    words = [effect_name(label) for label in labels]
    return " or ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


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


def evidence(result: GapResult) -> Table:
    """What was tried, best first."""
    rows: list[list[Cell]] = []
    for rival in result.evidence[:RIVALS]:
        judged = "chosen" if rival.chosen else "excluded" if rival.excluded else "not excluded"
        rows.append([set_name(rival.effects), float(rival.ratio), float(rival.excess), judged])
    judged_by = (
        "The score is chi-squared plus a price for each number; an effect had to lower it by "
        f"{result.threshold[0]:.3g}, calibrated on data without a gap."
    )
    if result.robust:
        judged_by = (
            "The score is a robust loss in which every window has one vote; an effect had to lower "
            f"it by {result.threshold[0]:.3g}, the windows that gain and lose most left out."
        )
    return Table(
        ["explanation", "residual / noise", "score above the chosen", "judgement"],
        rows,
        f"Every explanation is refitted in full on the training data. {judged_by}",
        highlight=[i for i, rival in enumerate(result.evidence[:RIVALS]) if rival.chosen],
        heading="Evidence and runners-up",
    )


def apart(result: GapResult) -> list[Section]:
    """What could not be told apart, and what would tell."""
    alike = twins(result)
    rows = []
    for answer in result.verdicts:
        if not answer.effect:
            continue
        label = label_of(answer)
        same = [a for a in answer.alternatives if a in alike.get(label, ())]
        ties = [a for a in answer.alternatives if a not in same]
        for group, exact in ((ties, False), (same, True)):
            if group:
                rows.append([
                    effect_name(label), names_of(group),
                    "the same motion in any data" if exact else "these data",
                    experiment(label, group, result, exact),
                ])  # fmt: skip
    if not rows:
        return []
    return [
        Table(
            ["effect", "cannot be told from", "why", "what would tell"],
            rows,
            heading="What could not be told apart",
        )
    ]


def blind(result: GapResult) -> list[Section]:
    """Effects that this log could hide."""
    if not result.blind:
        return []
    rows = [
        [effect_name(b.effect), f"{b.visible_from:.3g} {b.unit}".removesuffix(" 1"), b.needs]
        for b in result.blind
    ]
    return [
        Table(
            ["effect", "visible from", "what would show it"],
            rows,
            "These effects may be there at a size that matters without this log showing them.",
            heading="What this log cannot show",
        )
    ]


def quality(result: GapResult, record: Mapping[str, Any]) -> list[Section]:
    """Findings about the data, and the noise."""
    places: dict[tuple[str, str], list[str]] = {}
    for found in record["quality"]:
        place = Path(found["where"]).name
        places.setdefault((found["kind"], found["says"]), []).append(place)
    rows = [
        [kind, where[0] + (f" and {len(where) - 1} more" if len(where) > 1 else ""), says]
        for (kind, says), where in places.items()
    ]
    noise = ", ".join(
        f"{name} {sigma:.3g} ± {error:.2g} {dict(result.channels)[name]}".strip()
        for name, (sigma, error) in result.noise.items()
    )
    text = f"Noise found (standard deviation): {noise}."
    if len(rows) > FINDINGS:
        text += f" {len(rows) - FINDINGS} more findings are in `gap.json`."
    if not rows:
        text += " Nothing else stood out in the logs."
    sections: list[Section] = [Prose(text, heading="Data quality")]
    if rows:
        sections.append(Table(["finding", "where", "what"], rows[:FINDINGS]))
    return sections


def provenance(record: Mapping[str, Any]) -> list[Section]:
    """What made the numbers."""
    settings = io.StringIO()
    yaml.safe_dump(record["config"], settings, sort_keys=False)
    return [
        Code(settings.getvalue(), summary="The settings of this run", heading="Settings"),
    ]


def footer(record: Mapping[str, Any]) -> str:
    """Time and versions, in small print."""
    seconds = dict(record["seconds"])
    total = seconds.pop("total")
    stages = ", ".join(f"{stage} {value:.1f}" for stage, value in seconds.items())
    versions = ", ".join(f"{name} {version}" for name, version in record["versions"].items())
    return f"Found in {total:.0f} s ({stages}). {versions[:1].upper()}{versions[1:]}."
