"""The answer in the report: verdicts, their evidence, and what these data cannot tell."""

from __future__ import annotations

from collections.abc import Sequence

from residual.gap import GapResult
from residual.gap.result import Verdict as Answer
from studies.gap import records
from studies.gap.answer import (
    experiment,
    headline,
    is_footnote,
    kind_text,
    notes,
    rivals,
    sentence,
)
from studies.gap.lead import lead, unborne
from studies.gap.words import capitalized, effect_name, names_of, set_name, unit_text
from studies.reporting.sections import Cell, Prose, Section, Table, Tone, Verdict

TONES: dict[str, Tone] = {
    "confirmed": "good",
    "ambiguous": "warning",
    "calibrated": "neutral",
    "unexplained": "bad",
    "no_gap": "good",
}
#: Verdicts that have a banner of their own.
BANNERS = ("confirmed", "ambiguous", "calibrated", "unexplained")
#: Explanations listed.
RIVALS = 12
#: Sets of effects listed that make the same motion together.
TOGETHER = 2


def banners(result: GapResult, tolerance: float | None) -> list[Section]:
    """The first sentence, one banner per verdict, and what is too small for one."""
    worst = {verdict.kind for verdict in result.verdicts if not is_footnote(verdict)}
    tone: Tone = "good"
    first = result.conventions is not None or (result.cut_off and result.effects)
    if first or (not result.effects and "unexplained" in worst):
        tone = "bad"
    elif (result.effects and worst & {"ambiguous", "unexplained"}) or unborne(result):
        tone = "warning"
    sections: list[Section] = [Verdict(lead(result, tolerance), tone=tone, label="answer")]
    small = []
    for verdict in result.verdicts:
        if verdict.kind in BANNERS and not is_footnote(verdict):
            sections.append(banner(verdict, result))
        elif verdict.kind == "minor" or is_footnote(verdict):
            says = headline(verdict, result)
            small.append("; ".join([says[:-1], *notes(verdict, result)]) + ".")
    if result.unlike:
        sections.append(
            Verdict(
                records.headline(result), _sentences(records.notes(result)), tone="warning",
                label=records.LABEL,
            )
        )  # fmt: skip
    if small:
        minor = any(verdict.kind == "minor" for verdict in result.verdicts)
        why = (
            " Minor effects take less than a fifth off what remains without them, so they are "
            "not in the corrected simulator."
            if minor
            else ""
        )
        sections.append(Prose(" ".join(small) + why))
    return sections


def banner(answer: Answer, result: GapResult) -> Verdict:
    """One verdict."""
    text = [sentence(answer.label, result)] if answer.effect else []
    text.append(_sentences(notes(answer, result)))
    return Verdict(
        headline(answer, result), " ".join(filter(None, text)), tone=TONES[answer.kind],
        label=kind_text(answer),
    )  # fmt: skip


def _sentences(clauses: Sequence[str]) -> str:
    return " ".join(f"{capitalized(clause)}." for clause in clauses)


def evidence(result: GapResult) -> Table:
    """What was tried: the chosen set, then by error."""
    # Of orders of a cogging, and the like, only the best is listed.
    named = {rival.effects: rival for rival in reversed(result.evidence)}
    shown = [rival for rival in result.evidence if rival is named[rival.effects]][:RIVALS]
    if not any(not rival.effects for rival in shown):
        shown += [rival for rival in result.evidence if not rival.effects][:1]
    rows: list[list[Cell]] = [
        [set_name(rival.effects), float(rival.error), "chosen" if rival.chosen else rival.reason]
        for rival in shown
    ]
    more = len(result.evidence) - len(shown)
    return Table(
        ["explanation", "error / nominal", "why not"],
        rows,
        "Every explanation is fitted in full; 0 is a perfect forecast, 1 is as bad as the nominal "
        "simulator, always on data that did not fit the numbers, all channels together. The "
        "smallest set that is good enough is chosen: each effect has to take a fifth off what "
        "remains without it, or three tenths at one joint; where only noise is left, chance "
        "decides." + (f" {more} more are in `gap.json`." if more > 0 else ""),
        highlight=[i for i, rival in enumerate(shown) if rival.chosen],
        heading="Evidence and runners-up",
    )


def apart(result: GapResult) -> list[Section]:
    """What could not be told apart, and what would tell."""
    rows: list[list[Cell]] = []
    for answer in result.verdicts:
        if answer.kind not in ("confirmed", "ambiguous"):
            continue
        label = answer.label
        together = tuple(" with ".join(names) for names in answer.together[:TOGETHER])
        in_any = "the same motion in any data"
        whole = (" with ".join(answer.instead),) if answer.instead else ()
        groups = (
            ([name for name in rivals(answer) if name != label], "these data", False),
            (answer.form, "these data, and it is of the same family", False),
            ([n for n in answer.same_motion if n not in answer.resized], in_any, True),
            (answer.resized, f"{in_any}, with other sizes of what else is named", True),
            (together, f"{in_any}, in one exact proportion", True),
            (whole, "these data, in place of all that is named", False),
        )
        rows += [
            [effect_name(label), names_of(group), why, experiment(label, group, result, same)]
            for group, why, same in groups
            if group
        ]
    columns = ["effect", "cannot be told from", "why", "what would tell"]
    return [Table(columns, rows, heading="What could not be told apart")] if rows else []


def blind(result: GapResult) -> list[Section]:
    """Effects that this log could hide; one of several orders is seen, whichever it is, from the
    largest strength on."""
    if not result.blind:
        return []
    least = {b.effect: b for b in sorted(result.blind, key=lambda b: b.visible_from)}
    rows: list[list[Cell]] = [
        [effect_name(b.effect), f"{b.visible_from:.3g}{unit_text(b.unit)}", b.needs]
        for b in (least[name] for name in dict.fromkeys(b.effect for b in result.blind))
    ]
    return [
        Table(
            ["effect", "visible from", "what would show it"],
            rows,
            "These effects may be there at a size that matters without this log showing them.",
            heading="What this log cannot show",
        )
    ]
