"""Names, numbers and errors in words, for the report and for the terminal."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from residual.gap import GapResult
from residual.gap.result import Gap, Number, Span
from residual.trajectories import duration_text
from sims.effects.base import Effect
from sims.effects.library import library
from sims.effects.parameter_curve import FOLLOWING

KINDS = {
    "confirmed": "confirmed",
    "ambiguous": "not certain",
    "calibrated": "calibrated",
    "minor": "minor",
    "needs_data": "this log cannot show",
    "unexplained": "unexplained",
    "no_gap": "no gap",
}
#: Share of the gap without a name that is a footnote.
FOOTNOTE = 0.02
#: Row of the shrinking gap that is no step.
FLOOR = "noise floor"
#: What the errors are errors of.
CROSS_VALIDATED = "forecasts of data that did not fit the numbers"
#: Digits of a power.
RAISED = str.maketrans(
    "-0123456789", "\u207b\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079"
)
#: Units that begin with one of which a thousandth has a name.
DIVIDED = re.compile(r"(rad|[mVKNA])(?![\w^])")
#: Below it a number is told in thousandths of such a unit.
THOUSANDTHS = 1e-2
#: Names of people, in the names of effects.
PEOPLE = ("Coulomb", "Stribeck")
#: Pairs of words with a hyphen, in the names of effects.
PAIRS = ("load-dependent",)
#: Times its value that an end of an interval may be, beyond which it is none.
OPEN = 1e6
#: Part of half an interval that its near side is, below which the far end has digits of its own.
LOPSIDED = 0.01
#: Letters of a parameter's name up to which it reads as none.
SHORT = 2
#: Effects that act between two places.
BETWEEN = (
    "exchange", "coupling_spring", "coupling_damper", "asymmetric_coupling_damping",
)  # fmt: skip


def effect_name(label: str) -> str:
    """``viscous_friction@pivot`` as ``viscous friction at pivot``."""
    if " with " in label:
        return " with ".join(map(effect_name, label.split(" with ")))
    name, _, where = label.partition("@")
    if not where and len(name) <= SHORT:
        return f"parameter {name}"
    if name in FOLLOWING:
        parameter, _, channel = where.partition(" over ")
        return f"{parameter.replace('_', ' ')} that changes with {channel}"
    words = name.replace("_", " ")
    for person in PEOPLE:
        words = words.replace(person.lower(), person)
    for pair in PAIRS:
        words = words.replace(pair.replace("-", " "), pair)
    at = "between" if name in BETWEEN else "at"
    return words + (f" {at} {where.replace('_', ' ')}" if where else "")


def set_name(labels: Sequence[str]) -> str:
    """A set of effects in words; the empty set is the nominal simulator."""
    return " + ".join(map(effect_name, labels)) or "nominal simulator"


def listed(words: Sequence[str], last: str = "and") -> str:
    """``a, b and c``."""
    if len(words) < 2:
        return "".join(words)
    return f"{', '.join(words[:-1])} {last} {words[-1]}"


def capitalized(text: str) -> str:
    """A text as the beginning of a sentence, the rest of it as it is."""
    return text[:1].upper() + text[1:]


def titled(label: str) -> str:
    """An effect in words as the beginning of a line; what a user gave a name keeps its letters."""
    name = effect_name(label)
    kind, _, where = label.partition("@")
    return capitalized(name) if where and kind not in FOLLOWING else name


def names_of(labels: Sequence[str], last: str = "or") -> str:
    """Effects in words: ``a, b or c``."""
    return listed([effect_name(label) for label in labels], last)


def by_place(names: Sequence[str]) -> list[str]:
    """``friction at a`` and ``friction at b`` as ``friction at a and b``, each once."""
    places: dict[str, list[str]] = {}
    for name in dict.fromkeys(names):
        what, _, place = name.partition(" at ")
        places.setdefault(what, []).append(place)
    return [f"{what} at {listed(found)}" if all(found) else what for what, found in places.items()]


def found_once(findings: Iterable[tuple[Any, str]]) -> list[tuple[Any, str]]:
    """What was found in places, equal findings as one: of ``run.csv and 2 more``."""
    places: dict[Any, dict[str, str]] = {}
    for what, where in findings:
        places.setdefault(what, {})[where] = Path(where).name
    named = [(what, list(names.values())) for what, names in places.items()]
    return [
        (what, names[0] + (f" and {len(names) - 1} more" if len(names) > 1 else ""))
        for what, names in named
    ]


def rounded(value: float, half: float) -> str:
    """A value to the second digit of its uncertainty."""
    if value == 0 or not math.isfinite(value):
        return f"{value:g}"
    size = abs(half) if half > 0 and math.isfinite(half) else 1e-3 * abs(value)
    places = 1 - math.floor(math.log10(size))
    if places > 7 or places < -4:
        digits = max(2, places + 1 + math.floor(math.log10(abs(value))))
        return f"{value:.{min(digits, 8)}g}"
    # Adding zero takes the sign off a zero.
    return f"{round(value, places) + 0.0:.{max(places, 0)}f}"


def told(value: float, half: float) -> str:
    """A value to the second digit of its uncertainty, or to its own second if it is less."""
    text = rounded(value, half)
    return f"{value:.2g}" if value and not float(text) else text


def six_digits(value: float) -> str:
    """A number to six digits, and never as a power of ten where ``rounded`` writes zeros."""
    text = f"{value:g}"
    if "e-" in text and abs(value) > 1e-7:
        return f"{value:.{5 - math.floor(math.log10(abs(value)))}f}".rstrip("0")
    return text


def typeset(unit: str) -> str:
    """``kg m^2`` as ``kg m\u00b2``."""
    return re.sub(r"\^(-?\d+)", lambda power: power[1].translate(RAISED), unit)


def unit_text(unit: str) -> str:
    """A unit to be set behind a number; a share has none."""
    return "" if unit in ("", "1") else f" {typeset(unit)}"


def minus(text: str) -> str:
    """A text of numbers with true minus signs."""
    return text.replace("-", "\u2212")


def with_unit(name: str, unit: str) -> str:
    """``angle (rad)``; what has no unit stands alone."""
    return f"{name} ({typeset(unit)})" if unit else name


def number_text(number: Number, sign: bool = False) -> str:
    """Value and 95 % interval with the unit; of a number at its bound no interval is known."""
    plus = "+" if sign and number.value > 0 else ""
    unit = unit_text(number.unit)
    if number.at_bound:
        return minus(f"{plus}{number.value:.3g}{unit} (at its bound)")
    if max(abs(number.low), abs(number.high)) > OPEN * abs(number.value) > 0:
        return minus(f"{plus}{number.value:.3g}{unit} (nothing tells how large)")
    # Of a lopsided interval the near side says how well the value is known.
    half = 0.5 * (number.high - number.low)
    near = min(number.high - number.value, number.value - number.low)
    known = near if 0 < near < LOPSIDED * half else half
    if 0 < near < 0.3 * half:
        known = max(near, 0.05 * known)
    value, low, high = (
        rounded(x, max(known, 0.05 * abs(x)) if abs(x - number.value) > half else known)
        for x in (number.value, number.low, number.high)
    )
    return minus(f"{plus}{value}{unit} ({low} to {high})")


def span_text(span: Span) -> str:
    """A forecast error with its interval."""
    if span.low == span.high:  # one block has no spread
        return f"{span.value:.3g}"
    return f"{span.value:.3g} ({span.low:.3g} to {span.high:.3g})"


def quantity_text(value: float, unit: str) -> str:
    """A number with its unit, in thousandths of it if it is small."""
    if DIVIDED.match(unit) and 1e-6 <= abs(value) < THOUSANDTHS:
        return f"{1e3 * value:.3g} m{typeset(unit)}"
    return f"{value:.3g}{unit_text(unit)}"


def quantities_text(values: Sequence[float], unit: str) -> list[str]:
    """Numbers that are read beside each other, all in one unit."""
    if max(map(abs, values), default=0.0) < THOUSANDTHS:
        return [quantity_text(value, unit) for value in values]
    return [f"{value:.3g}{unit_text(unit)}" for value in values]


def percent(share: float) -> str:
    """A share as ``12 %``, with more digits where it is close to nothing or to all."""
    hundredths = 100 * min(max(share, 0.0), 1.0)
    if not math.isfinite(hundredths):
        return "an unknown part"
    if 0 < hundredths < 0.1:
        return "less than 0.1 %"
    if 99.9 < hundredths < 100:
        return "more than 99.9 %"
    close = hundredths < 2 or hundredths > 99
    return f"{hundredths:.1f}".removesuffix(".0") + " %" if close else f"{hundredths:.0f} %"


def ahead(gap: Gap) -> str:
    """``1 s error of angle``."""
    return f"{duration_text(gap.horizon_s)} error of {gap.channel}"


def known_effects(result: GapResult) -> dict[str, Effect]:
    """Every effect that can be talked about, by label."""
    found = {str(effect): effect for effect in library(result.corrected)}
    return found | {str(effect): effect for effect in result.effects}


def gap_rows(gap: Gap) -> list[tuple[str, Span]]:
    """The shrinking gap: nominal, one more effect each time, noise floor."""
    rows = [
        (f"+ {effect_name(step.added)}" if step.added else "nominal", step.gap)
        for step in gap.steps
    ]
    return [*rows, (FLOOR, gap.noise_floor)]
