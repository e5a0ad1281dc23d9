"""The answer in the report: verdicts, their evidence, and what these data cannot tell."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from residual.gap import GapResult
from residual.gap.result import Verdict as Answer
from studies.gap.words import (
    KINDS,
    effect_name,
    experiment,
    headline,
    label_of,
    sentence,
    set_name,
    unlike_and_alike,
)
from studies.reporting import Section, Table, Verdict
from studies.reporting.sections import Cell

# Effects that no motion can tell apart, by label; see ``words.twins``.
Twins = Mapping[str, tuple[str, ...]]
Tone = Literal["good", "warning", "bad", "neutral"]
TONES: dict[str, Tone] = {
    "confirmed": "good",
    "ambiguous": "warning",
    "needs_data": "neutral",
    "unexplained": "bad",
    "no_gap": "good",
}
# Explanations listed.
RIVALS = 10


def banner(answer: Answer, result: GapResult, alike: Twins) -> Verdict:
    """One verdict."""
    text = []
    if answer.effect:
        label = label_of(answer)
        text.append(sentence(label, result))
        ties, same = unlike_and_alike(answer, alike)
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


def apart(result: GapResult, alike: Twins) -> list[Section]:
    """What could not be told apart, and what would tell."""
    rows = []
    for answer in result.verdicts:
        if not answer.effect:
            continue
        label = label_of(answer)
        ties, same = unlike_and_alike(answer, alike)
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
