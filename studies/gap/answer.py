"""The answer in sentences: what the gap is, each verdict, and why it is no more certain."""

from __future__ import annotations

from collections.abc import Sequence

from residual.gap import GapResult
from residual.gap.confirmation import FEW, TOO_FEW
from residual.gap.result import Doubt, Gap, Number, Verdict
from studies.gap.words import (
    KINDS,
    ahead,
    effect_name,
    known_effects,
    label_of,
    listed,
    names_of,
    number_text,
    percent,
    quantity_text,
    rounded,
    unit_text,
)

#: Share of the gap without a name that is a footnote.
FOOTNOTE = 0.02
#: Part of an interval below which one with an exact simulator is worth a line.
MUCH = 0.7
#: Rivals that are listed in the first sentence.
FEW_RIVALS = 2

DOUBTS: dict[Doubt, str] = {
    "not_needed": "forecasts are not clearly worse without it",
    "unsteady": "its size differs between parts of the data",
    "numerics": "its size changes with the integration step or with how the input is held",
    "at_bound": "its size lies at its bound",
    "clock": "late time stamps or a filter in a sensor, of half a sample or less, would do as well",
    "may_be_zero": "its interval holds zero",
    "calibration": "parameters that are a few percent off would do nearly as well",
    "rivals": "an effect of another kind does nearly as well",
}


def lead(result: GapResult, tolerance: float | None = None) -> str:
    """The first sentence: the share of the gap that has a name.

    Args:
        result: What was found.
        tolerance: Forecast error that does not matter.
    """
    gap = result.gap
    before = quantity_text(gap.before.value, gap.unit)
    if tolerance is not None and gap.before.value <= tolerance:
        allowed = quantity_text(tolerance, gap.unit)
        smaller = " What is named below is smaller than that." if result.effects else ""
        return f"Nothing that matters: the {ahead(gap)} is {before}, allowed is {allowed}.{smaller}"
    kinds = {verdict.kind for verdict in result.verdicts}
    if kinds & {"confirmed", "ambiguous", "calibrated"}:
        return f"{_first(percent(gap.share.value))} of the gap is {_what(result)}."
    if "unexplained" in kinds:
        return f"The gap has no name: the {ahead(gap)} is {before}."
    floor = quantity_text(gap.noise_floor.value, gap.unit)
    return f"No gap above the noise: the {ahead(gap)} is {before}, noise alone makes {floor}."


def _what(result: GapResult) -> str:
    """What the gap is made of, certain names first."""
    certain = [v for v in result.verdicts if v.kind == "confirmed"]
    others = [v for v in result.verdicts if v.kind == "ambiguous"]
    words = _by_place([_briefly(verdict, result) for verdict in certain])
    if any(verdict.kind == "calibrated" for verdict in result.verdicts):
        words.append("parameters that are off within their tolerance")
    sure = listed(words)
    if not others:
        return sure
    if len(others) == 1:
        doubtful = _with_rivals(others[0], result)
    else:
        doubtful = "perhaps " + listed(_by_place([_briefly(v, result) for v in others]))
    return f"{sure} and {doubtful}" if sure else doubtful


def _briefly(verdict: Verdict, result: GapResult) -> str:
    """The family if the form is undecided, else the effect."""
    if not verdict.family:
        return effect_name(_short(verdict, result))
    _, at, place = effect_name(_short(verdict, result)).partition(" at ")
    return f"{verdict.family}{at}{place}"


def _with_rivals(verdict: Verdict, result: GapResult) -> str:
    name = _briefly(verdict, result)
    others = [label for label in rivals(verdict) if label != label_of(verdict)]
    if not others:
        return f"perhaps {name}"
    if len(others) <= FEW_RIVALS:
        return f"{name} or {names_of(others)}"
    return f"{name} or one of {len(others)} others"


def _by_place(names: Sequence[str]) -> list[str]:
    """``friction at a`` and ``friction at b`` as ``friction at a and b``."""
    places: dict[str, list[str]] = {}
    for name in names:
        what, _, place = name.partition(" at ")
        places.setdefault(what, []).append(place)
    return [f"{what} at {listed(found)}" if all(found) else what for what, found in places.items()]


def _short(verdict: Verdict, result: GapResult) -> str:
    """Name and place; of a system with a single joint the place goes without saying."""
    joints = [joint.name for joint in result.corrected.joints]
    return verdict.effect if joints == [verdict.where] else label_of(verdict)


def rivals(verdict: Verdict) -> tuple[str, ...]:
    """Effects of another kind that these data cannot exclude; its own label is another order."""
    known = {*verdict.same_motion, *verdict.form}
    return tuple(label for label in verdict.alternatives if label not in known)


def headline(verdict: Verdict, result: GapResult) -> str:
    """The verdict in one sentence."""
    gap = result.gap
    if verdict.kind == "no_gap":
        return f"The {ahead(gap)} is {quantity_text(gap.before.value, gap.unit)}."
    if verdict.kind == "unexplained":
        return f"{_first(percent(verdict.share.value))} of the gap has no name."
    if verdict.kind == "needs_data":
        return _first(names_of(verdict.alternatives, "and")) + "."
    if verdict.kind == "calibrated":
        return f"Parameters moved within their tolerance: {_changes(verdict)}."
    name = _first(effect_name(label_of(verdict)))
    if verdict.kind == "minor":
        return f"{name}: {percent(verdict.share.value)} of the gap, not added."
    parameter = result.corrected.parameters.get(verdict.where)
    if verdict.effect == verdict.where and parameter is not None:
        (change,) = verdict.parameters.values()
        half = 0.0 if change.at_bound else 0.5 * (change.high - change.low)
        total = rounded(float(parameter.value) + change.value, half)
        return (
            f"{name}: {number_text(change, sign=True)}, so {total}"
            f"{unit_text(change.unit)} in place of {float(parameter.value):g}."
        )
    numbers = ", ".join(_named(field, number) for field, number in verdict.parameters.items())
    if verdict.family:
        return f"{_first(verdict.family)}, form undecided: as {_lower(name)}, {numbers}."
    return f"{name}{shape(verdict)}: {numbers}."


def _changes(verdict: Verdict) -> str:
    """By how much parameters were moved."""
    return listed(
        [
            f"{effect_name(name)} {change.value:+.3g}{unit_text(change.unit)}".replace(
                "-", "\u2212"
            )
            for name, change in verdict.parameters.items()
        ]
    )


def _named(field: str, number: Number) -> str:
    return f"{_spelt(field)} {number_text(number)}"


def _spelt(field: str) -> str:
    return field.replace("_", " ")


def shape(verdict: Verdict) -> str:
    """Whole numbers that were chosen rather than fitted, such as the order of a cogging."""
    words = [f"{name} {value:g}" for name, value in verdict.shape.items()]
    return f" ({', '.join(words)})" if words else ""


def notes(verdict: Verdict, result: GapResult) -> list[str]:
    """What else there is to know of a verdict, each a clause without a full stop."""
    if verdict.kind == "unexplained":
        return _remainder_notes(verdict, result)
    if verdict.kind == "calibrated":
        return [
            f"alone they take {percent(verdict.share.value)} of the gap off; which of them is off "
            "is not known, and what else is missing may hide behind them"
        ]
    if verdict.kind not in ("confirmed", "ambiguous"):
        return []
    found = [f"without it, {percent(verdict.share.value)} of the gap would be back"]
    surer = {field: n for field, n in verdict.parameters.items() if much_surer(n)}
    if surer:
        single = len(verdict.parameters) == 1
        spans = [("" if single else f"{_spelt(f)} ") + span(n) for f, n in surer.items()]
        found.append(f"{', '.join(spans)} if all else in the simulator is exact")
    doubts = [DOUBTS[doubt] for doubt in verdict.doubts if doubt != "rivals"]
    own = label_of(verdict)
    if own in rivals(verdict):
        found.append("not certain: of another order it would do nearly as well")
    others = [label for label in rivals(verdict) if label != own]
    if others:
        found.append(f"one of {names_of((own, *others))}: these data cannot tell which")
    if doubts:
        found.append(f"not certain: {listed(doubts)}")
    if verdict.form:
        found.append(f"of the same family, {names_of(verdict.form)} would do as well")
    if verdict.same_motion:
        found.append(f"no motion can tell it from {names_of(verdict.same_motion)}")
    if verdict.provisional:
        found.append(provisional(result))
    return found


def much_surer(number: Number) -> bool:
    """Whether a number would be much better known if all else in the simulator were exact."""
    if number.if_exact is None or number.at_bound:
        return False
    low, high = number.if_exact
    return high - low < MUCH * (number.high - number.low)


def span(number: Number) -> str:
    """Between what a number is if all else in the simulator is exact."""
    assert number.if_exact is not None
    low, high = number.if_exact
    half = 0.5 * (high - low)
    text = f"{rounded(low, half)} to {rounded(high, half)}{unit_text(number.unit)}"
    return text.replace("-", "\u2212")


def _remainder_notes(verdict: Verdict, result: GapResult) -> list[str]:
    found = [f"{result.gap.windows_after:.3g} times the noise is left"]
    gap = result.gap
    if gap.blocks < TOO_FEW and not result.effects:
        more = quantity_text((TOO_FEW - gap.blocks) * gap.horizon_s, "s")
        found.append(
            f"nothing is named from {gap.blocks} {_blocks(gap)} of data, {TOO_FEW} are needed: "
            f"log some {more} more, or set a shorter --horizon"
        )
    if verdict.follows:
        found.append(f"it looks like a force that follows {verdict.follows}")
    if verdict.alternatives:
        found.append(
            f"{names_of(verdict.alternatives, 'and')} would take some of it, and so would many "
            "others"
        )
    return found


def provisional(result: GapResult) -> str:
    """Why an answer is provisional, and what would do."""
    gap = result.gap
    more = quantity_text((FEW - gap.blocks) * gap.horizon_s, "s")
    return (
        f"provisional: there are {gap.blocks} {_blocks(gap)} of data to confirm it, {FEW} would "
        f"do (some {more} more)"
    )


def _blocks(gap: Gap) -> str:
    return "block" if gap.blocks == 1 else "blocks"


def is_footnote(verdict: Verdict) -> bool:
    """Whether a remainder is too small to be more than mentioned."""
    return verdict.kind == "unexplained" and verdict.share.value < FOOTNOTE


def sentence(label: str, result: GapResult) -> str:
    """What an effect is."""
    effect = known_effects(result).get(label)
    parameter = result.corrected.parameters.get(label)
    if parameter is not None:
        return f"The {parameter.meaning} differs from what the simulator says."
    return effect.sentence if effect else ""


def experiment(label: str, others: Sequence[str], result: GapResult, same: bool) -> str:
    """What would tell an effect from others."""
    if same:
        return (
            f"No log of this motion can tell. Measure one of them directly, or change "
            f"{effect_name(label)} by a known amount, such as a known payload, and log again."
        )
    known = known_effects(result)
    needs = [known[name].needs for name in (label, *others) if name in known]
    return "Log " + ", and ".join(dict.fromkeys(needs)) + "." if needs else ""


def kind_text(verdict: Verdict) -> str:
    """The kind in words, provisional ones marked."""
    return KINDS[verdict.kind] + (", provisional" if verdict.provisional else "")


def _first(text: str) -> str:
    return text[:1].upper() + text[1:]


def _lower(text: str) -> str:
    return text if text.startswith(("Coulomb", "Stribeck")) else text[:1].lower() + text[1:]
