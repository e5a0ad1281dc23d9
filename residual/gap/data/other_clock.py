"""What unit a log's times may be in, if its samples come far more often or seldom than a simulator
steps."""

from __future__ import annotations

#: Units of time that are taken for seconds if samples come so many times as often, or nearly so.
_LONGER, _ALMOST = {"min": 60.0, "h": 3600.0}, 0.15
#: Control periods between samples that are no wonder.
_USUAL = 1 + _ALMOST, 50.0
#: What seconds that were taken for milliseconds make of that.
_FINER = 1000.0


def other_clock(times: float) -> str:
    """What to say of the times of a log, perhaps, if samples come so many control periods apart;
    empty if no other clock is likely."""
    for unit, seconds in _LONGER.items():
        if abs(seconds * times - 1) < _ALMOST:
            return times_in(unit)
        if abs(times / seconds - 1) < _ALMOST:
            return f"{times_in('s')}; {_counts_in(unit)}"
    return times_in("s") if abs(_FINER * times - 1) < _ALMOST else ""


def any_other_clock(times: float) -> str:
    """The same where samples come far too seldom, whatever the clock is."""
    if otherwise := other_clock(times):
        return otherwise
    usual = (unit for unit, seconds in _LONGER.items() if _USUAL[0] < times / seconds < _USUAL[1])
    return "; ".join([times_in("ms"), *map(_counts_in, usual)])


def _counts_in(unit: str) -> str:
    """What to set if the simulator counts in another unit of time."""
    scale = f"{{column: time, scale: {1 / _LONGER[unit]:.6g}}}"
    return f"if the simulator counts in {unit}, to {scale}"


def times_in(unit: str) -> str:
    """What to set if times are in a unit that they were not taken to be in."""
    return f"if the times are in {unit}, set columns.time to {{column: time, unit: {unit}}}"
