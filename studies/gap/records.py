"""What the records want differently, from one to another or along them, in words."""

from __future__ import annotations

import re

from residual.gap import GapResult
from residual.gap.beside import Changing, Periodic, Unlike
from sims.effects.parameter_curve import FOLLOWING
from studies.gap.words import (
    FOOTNOTE,
    effect_name,
    minus,
    names_of,
    percent,
    quantities_text,
    quantity_text,
    titled,
    unit_text,
)

#: What the terminal and the report call it.
LABEL = "records differ"
#: Part of the largest of some sizes below which another one is none.
NOTHING = 1e-3
#: Records up to which the size in each is told.
FEW = 8


def beside_lead(result: GapResult) -> str:
    """For the first sentence: how much would have a name if records may differ, or what changes
    along them."""
    if not result.unlike:
        if result.changing is None or result.changing.instead or not _open(result):
            return ""
        return f" The rest looks like {_change(result.changing)}."
    first = result.unlike[0]
    name, share = effect_name(first.label), percent(first.share)
    instead = ", and nothing else is added" if first.instead else ""
    return (
        f" The records differ: if {name} may have its own size in each of them{instead}, {share} "
        "of the gap has a name."
    )


def changes_instead(result: GapResult) -> str:
    """Before the first sentence: what takes more off by its change than all that is named."""
    changing = result.changing
    if changing is None or not changing.instead or result.unlike or not _open(result):
        return ""
    taken = f"which would take {percent(changing.taken)} of the squared residual off"
    return f"It all looks like {_change(changing)}, {taken}. If that is not it: "


def _open(result: GapResult) -> bool:
    """Whether something has no name, or what is named is an imitation; what is named to change with
    something is told already."""
    much = any(v.kind == "unexplained" and v.share.value >= FOOTNOTE for v in result.verdicts)
    return much or any(
        "law" in verdict.doubts and verdict.effect not in FOLLOWING for verdict in result.verdicts
    )


def _change(changing: Changing) -> str:
    begin, end, _ = _values(changing)
    along = _over(changing) or "along the records"
    return f"{effect_name(changing.label)} that changes {along}, from about {begin} to {end}"


def headline(result: GapResult) -> str:
    """Sizes by record of the effect that helps most."""
    first = result.unlike[0]
    return f"{titled(first.label)}: {_sizes(first)}."


def notes(result: GapResult) -> list[str]:
    """What that means, each a clause without a full stop."""
    found = [
        "something changed from one record to the next that the simulator does not know (a load, "
        "a slope, a supply, warmth): search the records one by one, or log it as an input; it may "
        "also be another effect that moves alike"
    ]
    if others := [other.label for other in result.unlike[1:]]:
        found.append(f"{names_of(others)} with its own size in each would do nearly as well")
    return found


def on_the_way(changing: Changing) -> str:
    """What would take most of what is left off if it changed, a clause."""
    begin, end, nominal = _values(changing)
    of = f"{percent(changing.taken)} of the squared residual off"
    if changing.instead:
        of += " in place of all that is named"
    if changing.over:
        low, high = (quantity_text(v, changing.over_unit) for v in (changing.low, changing.high))
        return (
            f"it looks as if {effect_name(changing.label)} changed {_over(changing)}, from about "
            f"{begin} at {minus(low)} to {end} at {minus(high)} ({nominal} in the simulator), "
            f"which would take {of}; it is not added: if that may be so, let the simulator "
            "change it"
        )
    return (
        f"it looks as if {effect_name(changing.label)} went from about {begin} where records begin "
        f"to {end} where they end ({nominal} in the simulator), which would take {of}; no effect "
        "depends on time, so it is not added: log it as an input, or let the simulator change it"
    )


def repeating(periodic: Periodic) -> str:
    """What would take most of what is left off if it acted at one frequency, a clause."""
    return (
        f"it looks like {_repeats(periodic)}, which would take "
        f"{percent(periodic.taken)} of the squared residual off: a vibration or a ripple that was "
        "not logged; it is not added: log it as an input, or let the simulator make it"
    )


def repeats_instead(result: GapResult) -> str:
    """Before the first sentence: what repeats in place of a part that is not certain."""
    periodic = result.periodic
    sure = {verdict.label for verdict in result.verdicts if verdict.kind == "confirmed"}
    if periodic is None or not periodic.instead or periodic.instead in sure:
        return ""
    return (
        f"It looks like {_repeats(periodic)}, and was not logged: "
        f"{effect_name(periodic.instead)} stands for whatever swings so. If that is not it: "
    )


def _repeats(periodic: Periodic) -> str:
    size = quantity_text(periodic.size, periodic.unit)
    return (
        f"something that repeats at {periodic.frequency:.3g} Hz and acts on {periodic.joint} with "
        f"an amplitude of about {size}"
    )


def _over(changing: Changing) -> str:
    """With which channel it changes; empty along the records."""
    sized = "the size of " if changing.of_size else ""
    return f"with {sized}{changing.over}" if changing.over else ""


def _values(changing: Changing) -> list[str]:
    """Where records begin, where they end, and in the simulator."""
    sizes = [changing.begin, changing.end, changing.nominal]
    largest = max(map(abs, sizes))
    sizes = [0.0 if abs(size) < NOTHING * largest else size for size in sizes]
    return [minus(text) for text in quantities_text(sizes, changing.unit)]


def _sizes(one: Unlike) -> str:
    """``0.2 N in a, -0.1 N in b``, or the span of many."""
    named = sorted(one.sizes.items(), key=lambda pair: _natural(pair[0]))
    if len(named) > FEW:
        named.sort(key=lambda pair: pair[1])
        (least, low), (most, high) = named[0], named[-1]
        span = f"from {_size(one, low)} in {least} to {_size(one, high)} in {most}"
        return f"{span}, {len(named)} records"
    return ", ".join(f"{_size(one, size)} in {name}" for name, size in named)


def _size(one: Unlike, value: float) -> str:
    sign = "+" if one.effect == one.where else ""  # a parameter's change
    return minus(f"{value:{sign}.3g}{unit_text(one.unit)}")


def _natural(name: str) -> list[tuple[int, str]]:
    """For an order in which run 10 comes after run 9."""
    return [(int(part), "") if part.isdigit() else (0, part) for part in re.split(r"(\d+)", name)]
