"""The answer on the terminal: one screen of text."""

from __future__ import annotations

import dataclasses
import textwrap
from collections.abc import Sequence

from residual.gap import GapResult
from residual.gap.answer.table import BESIDE
from residual.gap.result import ChannelGap, Gap
from residual.logs import Finding
from studies.gap import records
from studies.gap.answer import blocks_of, headline, is_footnote, kind_text, notes
from studies.gap.lead import lead, own_errors
from studies.gap.words import CROSS_VALIDATED, ahead, found_once, gap_rows, span_text, unit_text

#: Width of the text, and of the column of kinds.
WIDTH, KIND = 100, 16
#: Findings of the engine that are repeated below the answer.
NOTES = 5


def summary(result: GapResult, tolerance: float | None = None) -> str:
    """Everything that matters, the share of the gap with a name first.

    Args:
        result: What was found.
        tolerance: Forecast error that does not matter.
    """
    lines = [*wrapped(lead(result, tolerance), ""), ""]
    for verdict in result.verdicts:
        if verdict.kind == "no_gap":
            continue  # the first sentence has said so
        text = headline(verdict, result)
        if is_footnote(verdict):
            lines += wrapped(f"{text[:-1]}; {'; '.join(notes(verdict, result))}.", "")
            continue
        lines += paragraph(kind_text(verdict), text, notes(verdict, result))
    if result.unlike:
        lines += paragraph(records.LABEL, records.headline(result), records.notes(result))
    if lines[-1]:
        lines.append("")
    gap = result.gap
    unit = f" in{unit_text(gap.unit)}" if unit_text(gap.unit) else ""
    lines += [f"{ahead(gap)}{unit}, {CROSS_VALIDATED} (95 % interval)", *bars(gap)]
    others = beside(result)
    lines += [f"  {name}: {told}" for name, told in others.items()]
    blocks = blocks_of(gap)
    if gap.folds > 1:
        blocks += f", {gap.folds} groups of them left out in turn"
    if result.effects and gap.no_better:
        of = f" {gap.channel}" if others else ""
        some = "one block" if gap.no_better == 1 else f"{gap.no_better} blocks"
        blocks += f"; in {some} the corrected simulator forecasts{of} no better"
    lines += wrapped(blocks, "  ")
    if result.held_out:
        lines += ["", *held_out(result.held_out)]
    if result.quality:
        lines.append("")
    for found in result.quality[:NOTES]:
        lines += wrapped(found.words, "      ", "note:")
    if len(result.quality) > NOTES:
        lines.append(f"      and {len(result.quality) - NOTES} more in the report")
    return "\n".join(lines)


def paragraph(kind: str, text: str, more: Sequence[str]) -> list[str]:
    """A kind of answer in the margin, what it says, and what there is to know of it."""
    kind = kind.upper()
    if len(kind) >= KIND:
        lines = [kind, *wrapped(text, " " * KIND)]
    else:
        lines = wrapped(text, " " * KIND, kind)
    for note in more:
        lines += wrapped(note, " " * KIND)
    return lines


def wrapped(text: str, indent: str, first: str = "") -> list[str]:
    """Lines of one paragraph."""
    return textwrap.wrap(
        text, WIDTH, initial_indent=first + indent[len(first) :], subsequent_indent=indent,
        break_long_words=False, break_on_hyphens=False,
    )  # fmt: skip


def bars(gap: Gap) -> list[str]:
    """The shrinking gap; parameters that only serve the rest have no row if they take nothing."""
    taking = [s for s in gap.steps if s.added != BESIDE or s.gap.value < gap.before.value]
    rows = gap_rows(dataclasses.replace(gap, steps=tuple(taking)))
    width = max(len(name) for name, _ in rows)
    wide = max(len(span_text(span)) for _, span in rows)
    top = max(span.value for _, span in rows) or 1.0
    full = 24 / top
    return [
        f"  {name:<{width}}  {span_text(span):<{wide}}  {'█' * max(1, round(full * span.value))}"
        for name, span in rows
    ]


def beside(result: GapResult) -> dict[str, str]:
    """Errors of the other channels in a line each."""
    own = own_errors(result)
    return {name: errors(own[name]) for name in own if name != result.gap.channel}


def held_out(gap: Gap) -> list[str]:
    """The table for the records that were set aside."""
    lines = [f"records set aside with --held-out, {ahead(gap).split(' error')[0]} errors"]
    return lines + [f"  {name}: {errors(channel)}" for name, channel in gap.by_channel.items()]


def errors(channel: ChannelGap) -> str:
    """Errors of one channel in a line."""
    spans = {
        "nominal": channel.before, "corrected": channel.after, "noise floor": channel.noise_floor
    }  # fmt: skip
    numbers = ", ".join(f"{word} {span.value:.3g}" for word, span in spans.items())
    return f"{numbers}{unit_text(channel.unit)}"


def found_in_data(findings: Sequence[Finding]) -> list[str]:
    """What stands out in the logs, equal findings of several files in one line."""
    return [f"{where}: {says}" for says, where in found_once((f.says, f.where) for f in findings)]
