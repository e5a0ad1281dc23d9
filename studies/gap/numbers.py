"""The numbers of a verdict in words."""

from __future__ import annotations

from collections.abc import Mapping

from scipy.optimize import brentq

from residual.gap import GapResult
from residual.gap.result import Meant, Number, Verdict
from residual.logs.units import other_units
from sims.effects import Curve, SlewLimit
from sims.effects.actuator import AND, Saturation, StaticActuatorEffect
from sims.effects.base import Effect
from sims.host import HostSimulator
from studies.gap.words import minus, number_text, quantity_text, rounded, unit_text

#: Part of an interval below which one with an exact simulator is worth a line.
MUCH = 0.7
#: Times its level that a command is looked for at which a limit is reached.
FARTHEST = 1e3
#: Upper over lower end of a share up to which it may say a unit.
NARROW = 1.3
#: Parts of one size that are all told.
MANY = 2
#: Of what a share is one more: actuators receive, and sensors read.
SHARES = {"gain": "the command", "scale": "what is there"}
#: The same of every number that is a share more.
TIMES = {
    **SHARES, "back": "as fast on the way back", "backward": "the command below zero",
}  # fmt: skip


def numbers_of(verdict: Verdict, effect: Effect, simulator: HostSimulator) -> list[str]:
    """Each number with its name, or where it holds if a curve is given by them."""
    if isinstance(effect, Curve):
        return _points(verdict, effect, simulator)
    shown = worth_telling(verdict, effect)
    texts = [f"{spelt(field)} {number_text(n)}" for field, n in shown.items()]
    return texts if len(shown) == len(verdict.parameters) else [*texts, "the others may be zero"]


def worth_telling(verdict: Verdict, effect: Effect) -> Mapping[str, Number]:
    """The numbers of a verdict; of one size that has many parts, those that cannot be zero."""
    numbers = verdict.parameters
    if not effect.compound or len(numbers) <= MANY:
        return numbers
    return {f: n for f, n in numbers.items() if n.low > 0 or n.high < 0} or numbers


def _points(verdict: Verdict, curve: Curve, simulator: HostSimulator) -> list[str]:
    """Values of a curve with their intervals, and where they hold."""
    along = curve.measures(simulator)[curve.along][0]
    texts = []
    for field, number in verdict.parameters.items():
        at, _ = curve.point_of(field) or (float("nan"), "")
        texts.append(f"{number_text(number)} at {quantity_text(at, along)}")
    return [f"{curve.gives} {texts[0]}", *texts[1:]]


def times_of(verdict: Verdict) -> str:
    """``, so 1.62 times the command`` of a gain, which is a share more."""
    found = [(f, n) for f, n in verdict.parameters.items() if f in TIMES and n.unit == "1"]
    return minus("".join(f", so {1 + n.value:.3g} times {TIMES[f]}" for f, n in found))


def pace_of(verdict: Verdict, simulator: HostSimulator) -> str:
    """``, so at most 4.6 rad/s`` of a limited pace, which is counted as a time."""
    full, time = verdict.shape.get("full"), verdict.parameters.get("time")
    if verdict.effect != SlewLimit.name or not full or time is None or not time.value > 0:
        return ""
    units = {channel.name: channel.unit for channel in simulator.action_channels}
    unit = units[verdict.where.split(AND)[0]]
    return f", so at most {full / time.value:.3g}{unit_text(unit)}/s"


def spelt(field: str) -> str:
    """The name of a number in words."""
    return field.replace("_", " ")


def shape(verdict: Verdict) -> str:
    """Numbers that were chosen rather than fitted, such as the order of a cogging."""
    words = [f"{spelt(name)} {value:.4g}" for name, value in verdict.shape.items()]
    return f" ({', '.join(words)})" if words else ""


def values_of(meant: Meant) -> str:
    """Numbers without an interval, named where there are several."""
    texts = {
        field: minus(f"{value:{'+' if field == 'change' else ''}.3g}{unit_text(unit)}")
        for field, (value, unit) in meant.numbers.items()
    }
    if len(texts) == 1:
        return texts.popitem()[1]
    return ", ".join(f"{spelt(field)} {text}" for field, text in texts.items())


def much_surer(number: Number) -> bool:
    """Whether a number would be much better known if all else in the simulator were exact."""
    low, high = number.if_exact or (number.low, number.high)
    return not number.at_bound and high - low < MUCH * (number.high - number.low)


def span(number: Number) -> str:
    """Between what a number is if all else in the simulator is exact."""
    assert number.if_exact is not None
    low, high = number.if_exact
    half = 0.5 * (high - low)
    return minus(f"{rounded(low, half)} to {rounded(high, half)}{unit_text(number.unit)}")


def as_commanded(verdict: Verdict, result: GapResult) -> str:
    """The command at which a limit is reached, where other effects act on it before; or nothing.

    A limit is one of what comes out of the actuator: 85 after a gain of 8 is 10.6 in the log.
    """
    effects = [e for e in result.effects if isinstance(e, StaticActuatorEffect)]
    limit = next((e for e in effects if str(e) == verdict.label), None)
    if not isinstance(limit, Saturation):
        return ""
    before = [e for e in effects if e.stage < limit.stage and e.meets(limit)]
    level = float(limit.level)

    def missing(command: float) -> float:
        for effect in sorted(before, key=lambda one: one.stage):
            command = float(effect.shape(command))
        return command - level

    most = FARTHEST * level
    if not before or missing(0.0) >= 0 or missing(most) <= 0:
        return ""
    command = brentq(missing, 0.0, most)
    unit = verdict.parameters["level"].unit
    return f"reached at {quantity_text(command, unit)} of the command as logged"


def as_in_a_unit(verdict: Verdict, simulator: HostSimulator) -> str:
    """The unit that a command would be in, if that is all that a gain or a scale says; or nothing.

    9.7 times the newtons that were commanded are kilograms-force.
    """
    channels = {c.name: c for c in (*simulator.physical_channels, *simulator.action_channels)}
    channel = channels.get(verdict.where)
    shares = [n for f, n in verdict.parameters.items() if f in SHARES and n.unit == "1"]
    if channel is None or not shares:
        return ""
    (share,) = shares
    # An actuator gives a multiple of what was logged, a sensor logs one of what is there.
    way = 1 if "gain" in verdict.parameters else -1
    ends = sorted((1 + end) ** way for end in (share.low, share.high) if end > -1)
    if len(ends) < 2 or ends[1] > NARROW * ends[0]:
        return ""
    units = [
        name
        for name, unit in other_units(channel.unit)
        if ends[0] <= unit.factor <= ends[1] and unit.factor != 1.0
    ]
    return f"as if {channel.name} were logged in {' or '.join(units)}" if units else ""
