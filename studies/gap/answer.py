"""Each verdict in sentences, and why it is no more certain."""

from __future__ import annotations

from collections.abc import Sequence

from residual.gap import GapResult
from residual.gap.answer.doubts import DOUBTS
from residual.gap.confirmation.certainty import TOO_FEW
from residual.gap.confirmation.rivals import FEW
from residual.gap.preparation.horizon import SAMPLES
from residual.gap.result import OFF, Gap, Verdict
from residual.trajectories import duration_text
from sims.effects import Curve, SensorOffset
from sims.effects.actuator import ActuatorEffect, ActuatorLag, Delay
from studies.gap.numbers import (
    as_commanded,
    as_in_a_unit,
    much_surer,
    numbers_of,
    pace_of,
    shape,
    span,
    spelt,
    times_of,
    values_of,
    worth_telling,
)
from studies.gap.records import on_the_way, repeating
from studies.gap.words import (
    FOOTNOTE,
    KINDS,
    ahead,
    by_place,
    capitalized,
    effect_name,
    known_effects,
    listed,
    minus,
    names_of,
    number_text,
    percent,
    quantities_text,
    quantity_text,
    six_digits,
    titled,
    told,
    unit_text,
)

#: Verdicts that name no effect.
NAMELESS = ("unexplained", "calibrated", "needs_data", "no_gap")
#: Error over that by noise from which on there is a gap, however few blocks of data show it.
PLAINLY = 10.0
#: Residual over noise from which on points of a curve clearly miss the law between them.
COARSE = 2.0


def rivals(verdict: Verdict) -> tuple[str, ...]:
    """Effects of another kind that these data cannot exclude; its own label is another order."""
    known = {*verdict.same_motion, *verdict.form}
    return tuple(label for label in verdict.alternatives if label not in known)


def headline(verdict: Verdict, result: GapResult) -> str:
    """The verdict in one sentence."""
    gap = result.gap
    if verdict.kind == "no_gap":
        return f"The {ahead(gap)} is {quantity_text(gap.before.value, gap.unit)}."
    if verdict.kind == "unexplained" and cannot_tell(result):
        return "These data cannot tell whether there is a gap."
    if verdict.kind == "unexplained":
        return f"{capitalized(percent(verdict.share.value))} of the gap has no name."
    if verdict.kind == "needs_data":
        hidden = by_place([effect_name(label) for label in verdict.alternatives])
        plain = not any(" and " in name for name in hidden)
        first, *_ = verdict.alternatives
        beginning = titled(first)[:1] + hidden[0][1:]
        return (listed if plain else "; ".join)([beginning, *hidden[1:]]) + "."
    if verdict.kind == "calibrated":
        moved = [
            minus(f"{effect_name(name)} {change.value:+.3g}{unit_text(change.unit)}")
            for name, change in verdict.parameters.items()
        ]
        return f"Parameters moved within their tolerance: {listed(moved)}."
    name = titled(verdict.label)
    if verdict.kind == "minor":
        return f"{name}: {percent(verdict.share.value)} of the gap, not added."
    parameter = result.corrected.parameters.get(verdict.where)
    if verdict.effect == verdict.where and parameter is not None:
        (change,) = verdict.parameters.values()
        half = 0.0 if change.at_bound else 0.5 * (change.high - change.low)
        # However wide the interval: it is to be seen from what it is told.
        total = told(float(parameter.value) + change.value, min(half, abs(change.value)))
        return (
            f"{name}: {number_text(change, sign=True)}, so {total}"
            f"{unit_text(change.unit)} in place of {six_digits(float(parameter.value))}."
        )
    effect = known_effects(result)[verdict.label]
    numbers = ", ".join(numbers_of(verdict, effect, result.corrected))
    if verdict.family:
        own = effect_name(verdict.label)
        return f"{capitalized(verdict.family)}, form undecided: as {own}, {numbers}."
    given = "" if isinstance(effect, Curve) else shape(verdict)
    so = times_of(verdict) + pace_of(verdict, result.corrected)
    return f"{name}{given}: {numbers}{so}."


def notes(verdict: Verdict, result: GapResult) -> list[str]:
    """What else there is to know of a verdict, each a clause without a full stop."""
    if verdict.kind == "unexplained":
        return _remainder_notes(verdict, result)
    if verdict.kind == "calibrated":
        taken, more = "nothing off: what is named fits better beside them", ""
        if verdict.share.value > 0:
            taken = f"{percent(verdict.share.value)} of the gap off"
            more = ", and what else is missing may hide behind them"
        return [f"alone they take {taken}; which of them is off is not known{more}"]
    if verdict.kind not in ("confirmed", "ambiguous"):
        return []
    found = [f"without it, {percent(verdict.share.value)} of the gap would be back"]
    effect = known_effects(result)[verdict.label]
    curved = isinstance(effect, Curve)
    shown = worth_telling(verdict, effect)
    surer = {f: n for f, n in shown.items() if much_surer(n) and not curved}
    if surer:
        single = len(verdict.parameters) == 1
        spans = [("" if single else f"{spelt(f)} ") + span(n) for f, n in surer.items()]
        found.append(f"{', '.join(spans)} if all else in the simulator is exact")
    if curved and not result.adequate and result.gap.windows_after > COARSE:
        found.append(
            "the law may depart from these points by more than the intervals of the points"
        )
    told = as_in_a_unit(verdict, result.corrected), as_commanded(verdict, result)
    found += [one for one in told if one]
    for field, n in verdict.parameters.items():
        if n.along is not None and not result.changing:
            begin, end = quantities_text(n.along, n.unit)
            name = f"{spelt(field)} " if len(verdict.parameters) > 1 else ""
            found.append(
                f"{name}no constant: about {begin} where records begin and {end} where they end"
            )
    # What would do in its place is told by name.
    doubts = [DOUBTS[one] for one in verdict.doubts if one not in ("rivals", "instead")]
    own = verdict.label
    if own in rivals(verdict):
        found.append("of another order it would do nearly as well")
    others = [label for label in rivals(verdict) if label != own]
    if others:
        found.append(f"one of {names_of((own, *others))}: these data cannot tell which")
    if verdict.instead:
        together = listed([effect_name(name) for name in verdict.instead])
        found.append(f"not certain: {together} would do as well as all that is named here")
    if doubts:
        # A reason has commas of its own.
        found.append(f"not certain: {'; '.join(doubts)}")
    if verdict.form:
        found.append(f"of the same family, {names_of(verdict.form)} would do as well")
    if verdict.same_motion:
        known = {o.effect: f" ({values_of(o)})" for o in verdict.meant}
        alone = [name for name in verdict.same_motion if name not in verdict.resized]
        names = [f"{effect_name(name)}{known.get(name, '')}" for name in alone]
        if names:
            found.append(f"no motion can tell it from {listed(names, 'or')}")
        if verdict.resized:
            moved = listed([effect_name(name) for name in verdict.resized], "or")
            found.append(f"with other sizes of what else is named, {moved} moves exactly alike")
    if effect.looks_like and isinstance(effect, ActuatorEffect):
        # Sensors that are all late look exactly like inputs that are all late.
        if len(effect.actuators) == len(result.corrected.action_channels):
            found.append(f"{effect.looks_like} would look the same")
        elif verdict.label in result.nearly_late:
            found.append(f"{effect.looks_like} would look nearly the same")
    if isinstance(effect, Delay) and not result.adequate and _beside_a_lag(effect, result):
        found.append("together with the lag beside it, it may as well be two lags in a row")
    if isinstance(effect, SensorOffset) and _against_a_medium(effect, result):
        found.append("a current or a wind of that speed would look the same")
    for other in verdict.beside:
        twin = next((v for v in result.verdicts if is_meant(other.effect, v)), None)
        named = f", not {effect_name(twin.label)}" if twin else ""
        found.append(f"{values_of(other)} if {effect_name(other.effect)} is meant{named}")
    if verdict.provisional:
        found.append(provisional(result))
    return found


def _beside_a_lag(delay: Delay, result: GapResult) -> bool:
    """Whether a lag of what it delays is named, too."""
    return any(isinstance(e, ActuatorLag) and e.where == delay.where for e in result.effects)


def _against_a_medium(effect: SensorOffset, result: GapResult) -> bool:
    """Whether what is read is a speed, and no position with it: drag may be against what flows."""
    channels = {channel.name: channel for channel in result.corrected.physical_channels}
    read = channels[effect.channel]
    return read.kind == "rate" and not read.rate_of and read.unit == "m/s"


def is_meant(twin: str, verdict: Verdict) -> bool:
    """Whether a twin, by label, may be meant in place of the effect of a verdict."""
    return twin in verdict.same_motion or twin in (one.effect for one in verdict.meant)


def _remainder_notes(verdict: Verdict, result: GapResult) -> list[str]:
    gap = result.gap
    found = [f"residuals of the fit are {gap.windows_after:.3g} times the noise"]
    few = gap.blocks < TOO_FEW and all(v.kind in NAMELESS for v in result.verdicts)
    if result.adequate:
        times = gap.after.value / max(gap.noise_floor.value, 1e-300)
        by = f"forecasts err {times:.3g} times as by noise"
        other = "other " * any(v.kind == "confirmed" for v in result.verdicts)
        found = [by if few else f"no {other}effect of the library is established: {by}"]
    if few:
        more = duration_text((TOO_FEW - gap.blocks) * gap.horizon_s)
        # Of one or two, shorter ones may have shown nothing.
        shorter = gap.blocks > 2 and any(len(one.times) > SAMPLES for one in result.rollouts)
        found.append(
            f"nothing is named from {blocks_of(gap)}, {TOO_FEW} are needed: "
            f"log some {more} more{', or set a shorter --horizon' * shorter}"
        )
    if result.changing:
        found.append(on_the_way(result.changing))
    if result.periodic and not result.periodic.instead:
        found.append(repeating(result.periodic))
    if verdict.follows and not result.periodic:
        found.append(f"it looks like something that follows {verdict.follows}")
    if verdict.alternatives:
        found.append(
            f"{names_of(verdict.alternatives, 'and')} would take some of it, and so would many "
            "others"
        )
    return found


def cannot_tell(result: GapResult) -> bool:
    """Whether too few data, or drowned in noise, err by no more than that, so that there may be a
    gap or none."""
    gap = result.gap
    plain = gap.exceeds_noise(OFF) or gap.before.value > PLAINLY * gap.noise_floor.value
    return (gap.blocks < TOO_FEW or gap.drowned) and not plain and not result.effects


def provisional(result: GapResult) -> str:
    """Why an answer is provisional, and what would do."""
    gap = result.gap
    more = duration_text((FEW - gap.blocks) * gap.horizon_s)
    return (
        f"provisional: there are {blocks_of(gap)} to confirm it, {FEW} would do (some {more} more)"
    )


def blocks_of(gap: Gap) -> str:
    """``"2 blocks of data"``."""
    return f"{gap.blocks} {'block' if gap.blocks == 1 else 'blocks'} of data"


def is_footnote(verdict: Verdict) -> bool:
    """Whether a remainder is too small to be more than mentioned."""
    return verdict.kind == "unexplained" and verdict.share.value < FOOTNOTE


def sentence(label: str, result: GapResult) -> str:
    """What an effect is."""
    effect = known_effects(result).get(label)
    parameter = result.corrected.parameters.get(label)
    if parameter is not None:
        told = parameter.meaning and parameter.meaning != label.replace("_", " ")
        meaning = f" ({parameter.meaning})" if told else ""
        return f"The parameter {label}{meaning} differs from what the simulator says."
    return effect.sentence if effect else ""


def experiment(label: str, others: Sequence[str], result: GapResult, same: bool) -> str:
    """What would tell an effect from others."""
    if same:
        return (
            "No log of this system can tell. Measure one of them directly, or change "
            f"{effect_name(label)} by a known amount and log again."
        )
    known = known_effects(result)
    needs = list(dict.fromkeys(known[name].needs for name in (label, *others) if name in known))
    # "Sudden changes, then rest" asks for sudden changes, too.
    most = [one for one in needs if not any(one != other and one in other for other in needs)]
    return f"Log {'; '.join(most)}." if most else ""


def kind_text(verdict: Verdict) -> str:
    """The kind in words, provisional ones marked."""
    return KINDS[verdict.kind] + (", provisional" if verdict.provisional else "")
