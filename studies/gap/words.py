"""What find_gap found, in words: for the report and for the terminal."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from residual.gap import GapResult
from residual.gap.confirm import Span
from residual.gap.result import Number, Verdict
from sims.effects.base import Effect
from sims.effects.library import exact_aliases, library

KINDS = {
    "confirmed": "confirmed",
    "ambiguous": "not certain",
    "needs_data": "this log cannot show",
    "unexplained": "unexplained",
    "no_gap": "no gap",
}

#: Rows of the shrinking gap that are no steps.
FLOOR, CEILING = "noise floor", "flexible estimator"


def effect_name(label: str) -> str:
    """``viscous_friction@pivot`` as ``viscous friction at pivot``."""
    if " with " in label:
        return " with ".join(map(effect_name, label.split(" with ")))
    name, _, where = label.partition("@")
    return name.replace("_", " ") + (f" at {where.replace('_', ' ')}" if where else "")


def set_name(labels: Sequence[str]) -> str:
    """A set of effects in words; the empty set is the nominal simulator."""
    return " + ".join(map(effect_name, labels)) or "nominal simulator"


def rounded(value: float, half: float) -> str:
    """A value to the second digit of its uncertainty."""
    if value == 0 or not math.isfinite(value):
        return f"{value:g}"
    size = abs(half) if half > 0 and math.isfinite(half) else 1e-3 * abs(value)
    places = 1 - math.floor(math.log10(size))
    if places > 7 or places < -4:
        digits = max(2, places + 1 + math.floor(math.log10(abs(value))))
        return f"{value:.{min(digits, 8)}g}"
    return f"{round(value, places):.{max(places, 0)}f}"


def unit_text(unit: str) -> str:
    """A unit to be set behind a number; a share has none."""
    return "" if unit in ("", "1") else f" {unit}"


def number_text(number: Number, sign: bool = False) -> str:
    """Value and 95 % interval with the unit."""
    half = 0.5 * (number.high - number.low)
    value, low, high = (rounded(x, half) for x in (number.value, number.low, number.high))
    plus = "+" if sign and number.value > 0 else ""
    return f"{plus}{value}{unit_text(number.unit)} ({low} to {high})".replace("-", "\u2212")


def span_text(span: Span, unit: str = "") -> str:
    """A forecast error with its interval."""
    return f"{span.value:.3g}{unit_text(unit)} ({span.low:.3g} to {span.high:.3g})"


def quantity_text(value: float, unit: str) -> str:
    """A number with its unit, in thousandths of it if it is small."""
    if unit[:1] in ("r", "m", "V", "K", "N", "A") and 1e-6 <= abs(value) < 1e-2:
        return f"{1e3 * value:.3g} m{unit}"
    return f"{value:.3g}{unit_text(unit)}"


def seconds_text(seconds: float) -> str:
    """A forecast length: ``1 s``."""
    return f"{float(f'{seconds:.3g}'):g} s"


def headline(verdict: Verdict, result: GapResult) -> str:
    """The verdict in one sentence."""
    if not verdict.effect:
        says = verdict.says.removeprefix(f"{verdict.kind}: ")
        return says[:1].upper() + says[1:] + "."
    name = effect_name(label_of(verdict))
    parameter = result.corrected.parameters.get(verdict.where)
    if verdict.effect == verdict.where and parameter is not None:
        (change,) = verdict.parameters.values()
        total = rounded(float(parameter.value) + change.value, 0.5 * (change.high - change.low))
        return (
            f"{name.capitalize()}: {number_text(change, sign=True)}, so {total}"
            f"{unit_text(change.unit)} in place of {float(parameter.value):g}."
        )
    numbers = ", ".join(
        f"{field.replace('_', ' ')} {number_text(number)}"
        for field, number in verdict.parameters.items()
    )
    return f"{name[:1].upper()}{name[1:]}{shape(verdict, result)}: {numbers}."


def shape(verdict: Verdict, result: GapResult) -> str:
    """Numbers that were chosen rather than fitted, such as the order of a cogging."""
    for effect in result.effects:
        fitted = {name: number.value for name, number in verdict.parameters.items()}
        if str(effect) == label_of(verdict) and all(
            getattr(effect, name) == value for name, value in fitted.items()
        ):
            known = effect.quantities(result.corrected)
            words = [
                f"{name} {getattr(effect, name):g}{unit_text(quantity.unit)}"
                for name, quantity in known.items()
                if name not in fitted and quantity.role == "shape"
            ]
            return f" ({', '.join(words)})" if words else ""
    return ""


def label_of(verdict: Verdict) -> str:
    """``name@where``, or the name alone of a parameter."""
    same = verdict.effect == verdict.where
    return verdict.effect if same else f"{verdict.effect}@{verdict.where}"


def known_effects(result: GapResult) -> dict[str, Effect]:
    """Every effect that can be talked about, by label."""
    found = {str(effect): effect for effect in library(result.corrected)}
    return found | {str(effect): effect for effect in result.effects}


def sentence(label: str, result: GapResult) -> str:
    """What an effect is."""
    effect = known_effects(result).get(label)
    parameter = result.corrected.parameters.get(label)
    if parameter is not None:
        return f"The {parameter.meaning} differs from what the simulator says."
    return effect.sentence if effect else ""


def twins(result: GapResult) -> dict[str, tuple[str, ...]]:
    """Effects that no motion can tell apart, by label, if a verdict leaves alternatives."""
    found: dict[str, tuple[str, ...]] = {}
    if not any(verdict.effect and verdict.alternatives for verdict in result.verdicts):
        return found  # the search below takes seconds for a walking robot
    for alias in exact_aliases(result.corrected):
        if not alias.combination:
            found.update({name: alias.effects for name in alias.effects})
    return found


def unlike_and_alike(
    verdict: Verdict, alike: Mapping[str, Sequence[str]]
) -> tuple[list[str], list[str]]:
    """Alternatives that these data cannot tell from an effect, and those that no motion can.

    Args:
        verdict: Names the effect and its alternatives.
        alike: See ``twins``.
    """
    same = alike.get(label_of(verdict), ())
    return (
        [name for name in verdict.alternatives if name not in same],
        [name for name in verdict.alternatives if name in same],
    )


def experiment(label: str, rivals: Sequence[str], result: GapResult, same: bool) -> str:
    """What would tell an effect from its rivals."""
    if same:
        return (
            f"No log of this motion can tell. Measure one of them directly, or change "
            f"{effect_name(label)} by a known amount, such as a known payload, and log again."
        )
    known = known_effects(result)
    needs = [known[name].needs for name in (label, *rivals) if name in known]
    return "Log " + ", and ".join(dict.fromkeys(needs)) + "." if needs else ""


def summary(result: GapResult) -> str:
    """One screen of text."""
    alike = twins(result)
    lines = []
    for verdict in result.verdicts:
        if verdict.kind == "needs_data":
            names = ", ".join(map(effect_name, verdict.alternatives))
            lines.append(f"{'THIS LOG CANNOT SHOW':<16} {names}")
            continue
        lines.append(f"{KINDS[verdict.kind].upper():<16} {headline(verdict, result)}")
        if "provisional" in verdict.says:
            lines.append(f"{'':<16} provisional: there is one record only")
        if verdict.effect and verdict.alternatives:
            ties, same = unlike_and_alike(verdict, alike)
            if same:
                words = ", ".join(map(effect_name, same))
                lines.append(f"{'':<16} no motion can tell it from: {words}")
            if ties:
                words = ", ".join(map(effect_name, ties))
                lines.append(f"{'':<16} these data cannot tell it from: {words}")
    gap = result.gap
    rows = gap_rows(result)
    width = max(len(name) for name, _ in rows)
    top = max(span.value for _, span in rows) or 1.0
    unit = f" in {gap.unit}" if gap.unit else ""
    ahead = f"error of a {seconds_text(gap.horizon_s)} forecast of {gap.channel}{unit}"
    lines += ["", f"{ahead}, held-out data (95 % interval)"]
    for name, span in rows:
        bar = "█" * max(1, round(24 * span.value / top))
        lines.append(f"  {name:<{width}}  {span_text(span):<28} {bar}")
    return "\n".join(lines)


def gap_rows(result: GapResult) -> list[tuple[str, Span]]:
    """The shrinking gap: nominal, one more effect each time, noise floor, ceiling."""
    gap = result.gap
    rows = [
        (f"+ {effect_name(step.added)}" if step.added else "nominal", step.gap)
        for step in gap.steps
    ]
    rows.append((FLOOR, gap.noise_floor))
    if gap.ceiling is not None:
        rows.append((CEILING, gap.ceiling))
    return rows
