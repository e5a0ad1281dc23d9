"""Whether an angle, or its rate, of an unstated unit moves as what it should be."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from residual.logs.checks import Signal

Array = NDArray[np.float64]

# Speed that no joint of an unstated unit is believed to reach, in rad/s (570 rpm), and the
# multiple of its channel's declared scale: slow motion in deg/s is already beyond both.
_FASTEST, _TIMES_SCALE = 60.0, 20.0


def check_plausible(signal: Signal, rate_scale: float | None) -> None:
    """Look for degrees in an angle, or its rate, whose unit the config does not state.

    Args:
        signal: An angle in rad or a rate in rad/s.
        rate_scale: Typical rate in rad/s, if the simulator declares one.

    Raises:
        ValueError: The values look like degrees.
    """
    unit = signal.channel.unit
    if signal.unit or unit not in ("rad", "rad/s") or not signal.runs:
        return
    others, units = ("degrees", "unit: deg") if unit == "rad" else (
        "degrees per second or revolutions per minute", "unit: deg/s or unit: rpm"
    )  # fmt: skip
    advice = f"looks like {others}: set {units} (or unit: {unit} if that is right)"
    name = f"column {signal.column!r}: the channel {signal.channel.name!r}"
    if unit == "rad" and _jumps_by_360(signal):
        raise ValueError(f"{name} jumps by about 360, as a compass does; {advice}")
    speeds = [
        np.abs(values) if unit == "rad/s" else _speeds(times, values)
        for times, values in signal.runs
    ]
    speed = np.concatenate(speeds)
    speed = speed[np.isfinite(speed)]
    limit = _TIMES_SCALE * rate_scale if rate_scale else _FASTEST
    fast = float(np.quantile(speed, 0.95)) if speed.size else 0.0
    if fast > limit:
        moves = "reaches" if unit == "rad/s" else "turns by up to"
        raise ValueError(
            f"{name} {moves} {fast:.3g} rad/s, expected at most about {limit:.3g}; {advice}"
        )


def _jumps_by_360(signal: Signal) -> bool:
    steps = np.concatenate([np.diff(values) for _, values in signal.runs])
    steps = np.abs(steps[np.isfinite(steps)])
    jumps = (steps > 300) & (steps < 361)
    return int(jumps.sum()) >= 2 and float(np.quantile(steps[~jumps], 0.95)) < 100


def _speeds(times: Array, values: Array, span: int = 3) -> Array:
    """Mean speeds over ``span`` samples: noise counts less, and a fast swing still shows.

    Time stamps that come late, and then in a bunch, make nothing fast, and neither does an angle
    that is cut at half a turn, or at a whole one as a compass is.
    """
    good = np.isfinite(values)
    times, values = times[good], values[good]
    if values.size and np.ptp(values) < 1.01 * 2 * np.pi:
        values = np.unwrap(values)
    span = min(span, max(1, len(times) // 4))
    passed = times[span:] - times[:-span]
    passed = np.maximum(passed, np.median(passed)) if len(passed) else passed
    return np.abs(values[span:] - values[:-span]) / passed
