"""Do the numbers of a log fit together? Units and signs, checked before any physics."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from residual.logs.faults import noise
from residual.logs.units import find_unit, units_of
from sims.simulator import Channel, wrap

Array = NDArray[np.float64]

# Spans over which positions are compared, in samples: long ones beat noise, short ones turns.
_SPANS = (1, 2, 4, 8, 16, 32)


@dataclasses.dataclass(frozen=True)
class Finding:
    """Something to know about the data.

    Attributes:
        kind: What it is about, in one word: ``"gap"``, ``"sampling"``, ``"missing"``, ...
        where: File, run or channel it concerns.
        says: One plain sentence.
        numbers: The figures behind it, by name and unit.
        severity: ``"note"``, ``"warning"`` (an answer may suffer), or ``"refuse"`` (no answer
            could mean anything).
        rows: Run and time in s of every sample concerned, where there are single ones.
    """

    kind: str
    where: str
    says: str
    numbers: Mapping[str, float] = dataclasses.field(default_factory=dict)
    severity: Literal["note", "warning", "refuse"] = "note"
    rows: tuple[tuple[str, float], ...] = ()

    @property
    def words(self) -> str:
        """The place and what is said of it, where the one begins the sentence of the other."""
        return f"{self.where} {self.says}".strip()


class Signal(NamedTuple):
    """One channel of all runs, before angles are unwrapped.

    Attributes:
        channel: What was measured.
        column: Where it stands in the files.
        unit: As stated in the config; empty if not stated.
        runs: Times (n,) and values (n,) of every run.
    """

    channel: Channel
    column: str | int
    unit: str
    runs: Sequence[tuple[Array, Array]]


def check_rate(position: Signal, rate: Signal, where: str) -> list[Finding]:
    """Compare the change of a position with the integral of its rate.

    Args:
        position: What the rate is the derivative of.
        rate: Sampled at the same times.
        where: For the finding.

    Returns:
        A finding if they differ by a factor that no unit explains, or are unrelated.

    Raises:
        ValueError: They differ by the factor of a unit, or in sign; the message says which
            column to give which unit.
    """
    changes = {span: _changes(position, rate, span) for span in _SPANS}
    changes = {span: change for span, change in changes.items() if change[0].size >= 25}
    spans = list(changes.values())
    turning = position.channel.angle
    if not spans:
        return []
    as_is = min(_misfit(moved, integral, turning) for moved, integral in spans)
    if as_is > 0.3:
        repairs = _repairs(position, rate)
        for signal, fix, (on_position, on_rate) in repairs:
            mended = min(_misfit(on_position * m, on_rate * i, turning) for m, i in spans)
            if mended < min(0.3, as_is / 3):
                factor = on_rate / on_position
                raise ValueError(
                    f"column {signal.column!r}: {signal.channel.name!r} {_looks(fix)}: set {fix}"
                    f"{_or_other(repairs, signal, factor)}{_or_time(factor)} (the change of "
                    f"{position.channel.name!r} is not the integral of {rate.channel.name!r}, and "
                    "would be then)"
                )
        _refuse_exchanged(position, rate)
    if not math.isfinite(as_is):
        return []
    scaled = [(_scale(m, i, turning), m, i) for m, i in spans]
    misfit, scale = min((_misfit(m, scale * i, turning), scale) for scale, m, i in scaled)
    if not any(_clear(position, rate, span, *changes[span]) for span in changes):
        return []
    if misfit > 0.3:
        says = (
            f"The change of {position.channel.name} does not follow the integral of "
            f"{rate.channel.name} (median misfit {100 * as_is:.0f} %): sampling slower than the "
            "motion, or the wrong columns."
        )
        return [Finding("kinematics", where, says, {"misfit": as_is})]
    # Noise in the rate makes the factor look smaller than it is, by about the misfit.
    if abs(scale - 1) < 0.05 + 2 * misfit:
        return []
    says = (
        f"{position.channel.name} changes by {scale:.3f} times the integral of "
        f"{rate.channel.name}: one of the two sensors is off by that factor (set scale for its "
        "column)."
    )
    return [Finding("kinematics", where, says, {"scale": scale})]


def _refuse_exchanged(position: Signal, rate: Signal) -> None:
    """Refuse two columns of which the second moves as the integral of the first."""
    turned = [_changes(rate, position, span) for span in _SPANS]
    misfits = [_misfit(*change, turning=False) for change in turned if change[0].size >= 25]
    if min(misfits, default=math.inf) < 0.3:
        raise ValueError(
            f"columns {position.column!r} and {rate.column!r} look exchanged: the change of "
            f"{rate.channel.name!r} is the integral of {position.channel.name!r}; say under states "
            "which is which, with --columns FILE"
        )


_WORDS = {
    "deg": "degrees",
    "deg/s": "degrees per second",
    "rad": "radians",
    "rad/s": "radians per second",
}


def _looks(fix: str) -> str:
    unit = fix.removeprefix("unit: ")
    return "has the wrong sign" if unit == fix else f"looks like {_WORDS.get(unit, unit)}"


def _or_other(repairs: Sequence[Repair], blamed: Signal, factor: float) -> str:
    """The fix of the other column that would do the same, if there is one."""
    for signal, fix, (on_position, on_rate) in repairs:
        if signal is not blamed and math.isclose(on_rate / on_position, factor):
            return f", or if that is right set {fix} for column {signal.column!r}"
    return ""


def _or_time(factor: float) -> str:
    """Times in another unit than seconds change the integral of a rate as its own unit does."""
    found = [n for n in units_of("s") if math.isclose(find_unit(n, "s").factor, factor)]
    return f", or unit: {found[0]} for the time" if found and found[0] != "s" else ""


#: What may be wrong: the signal, the fix, and its factors on position and rate.
Repair = tuple[Signal, str, tuple[float, float]]


def _repairs(position: Signal, rate: Signal) -> list[Repair]:
    """What may be wrong, the likeliest first."""
    repairs: list[Repair] = []
    for signal in (position, rate):
        target = signal.channel.unit
        stated = find_unit(signal.unit, target).factor
        for name in units_of(target):
            factor = find_unit(name, target).factor / stated
            if not math.isclose(factor, 1):
                factors = (factor, 1.0) if signal is position else (1.0, factor)
                repairs.append((signal, f"unit: {name}", factors))

    def unlikely(repair: Repair) -> tuple[bool, bool]:
        # The commonest mistake first, since a flipped sign or another unit may come close; and
        # whoever states the unit of one column has forgotten that of the other.
        common = repair[1].startswith(("unit: deg", "unit: rad"))
        return not common, bool(repair[0].unit)

    repairs.sort(key=unlikely)
    turned = (rate, "scale: -1", (1.0, -1.0)), (position, "scale: -1", (-1.0, 1.0))
    return [*repairs, *turned]


def _changes(position: Signal, rate: Signal, span: int) -> tuple[Array, Array]:
    """Change of position over ``span`` samples, and the rate's integral (trapezoids)."""
    moved, integrals = [np.zeros(0)], [np.zeros(0)]
    for (times, x), (_, v) in zip(position.runs, rate.runs, strict=True):
        if len(times) > 4 * span:
            steps = np.diff(times) * (v[1:] + v[:-1]) / 2
            total = np.concatenate([[0.0], np.cumsum(np.nan_to_num(steps))])
            gaps = np.concatenate([[0], np.cumsum(~np.isfinite(steps))])
            change, integral = x[span:] - x[:-span], total[span:] - total[:-span]
            good = np.isfinite(change) & (gaps[span:] == gaps[:-span])
            moved.append(change[good])
            integrals.append(integral[good])
    return np.concatenate(moved), np.concatenate(integrals)


def _clear(position: Signal, rate: Signal, span: int, moved: Array, integral: Array) -> bool:
    """True if both move far more than their noise, so that they ought to agree."""
    moved, integral = _moving(moved, integral, position.channel.angle)
    period = float(np.median(np.concatenate([np.diff(times) for times, _ in rate.runs])))
    blur = _noise(rate) * period * math.sqrt(span)
    return bool(
        moved.size >= 10
        and np.median(np.abs(moved)) > 5 * _noise(position)
        and np.median(np.abs(integral)) > 5 * blur
    )


def _noise(signal: Signal) -> float:
    return noise([values for _, values in signal.runs])


def _misfit(moved: Array, integral: Array, turning: bool) -> float:
    """Median of |change - integral| relative to the integral, where there is motion; 0 is best."""
    moved, integral = _moving(moved, integral, turning)
    if moved.size < 10:
        return math.inf
    error = wrap(moved - integral) if turning else moved - integral
    size = float(np.median(np.abs(integral)))
    return float(np.median(np.abs(error))) / size if size > 0 else math.inf


def _scale(moved: Array, integral: Array, turning: bool) -> float:
    moved, integral = _moving(moved, integral, turning)
    ratios = (wrap(moved) if turning else moved) / integral
    return float(np.median(ratios)) if ratios.size else math.nan


def _moving(moved: Array, integral: Array, turning: bool) -> tuple[Array, Array]:
    """Only the fast two fifths; of an angle, only what is well below half a turn."""
    size = np.abs(integral)
    chosen = (size < 2.0) if turning else np.isfinite(size)
    if chosen.any():
        chosen &= (size >= np.quantile(size[chosen], 0.6)) & (size > 0)
    return moved[chosen], integral[chosen]
