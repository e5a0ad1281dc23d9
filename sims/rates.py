"""Whether the rates that a true system reports are the slopes of its positions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sims.simulator import Array, Simulator
from sims.unsound import Unsound

#: Control periods over which ways are compared: noise fades beside the motion.
SPAN = 20
#: Mean way over so long, in scales of the channel, that is motion and not noise.
MOTION = 0.05
#: Part of the way that positions may miss, and that the simulator's own steps may.
TRUE, OWN = 0.4, 0.1
#: Part of the way that is still missed with rates multiplied, up to which only their scale is off.
SCALED = 0.1


def refuse_unrelated_rates(
    what: str, nominal: Simulator, rollouts: Sequence[tuple[Array, Array]]
) -> None:
    """Refuse states whose rates are not the slopes of their positions.

    Columns in another order, another unit or another control period would all be learnt as a
    difference between simulator and truth. The way of a position over 20 periods is compared with
    its rate summed by the trapezoidal rule. Where the simulator's own steps do not obey that rule
    either, since they are long beside the motion or bodies strike, nothing is refused.

    Args:
        what: Whose states, in words.
        nominal: Its channels name the columns, its period is the true system's.
        rollouts: States (T + 1, n_s) and actions (T, n_a) of each.

    Raises:
        Unsound: The message names the position and its rate.
    """
    channels = nominal.state_channels
    names = [channel.name for channel in channels]
    for rate, channel in enumerate(channels):
        if channel.rate_of not in names:
            continue
        position = names.index(channel.rate_of)
        ways = [_ways(states, position, rate, nominal.dt) for states, _ in rollouts]
        missed, length = _missed(ways)
        if missed <= TRUE or length < MOTION * channels[position].scale:
            continue
        steps = (
            _ways(np.stack([now, then]), position, rate, nominal.dt)
            for states, actions in rollouts
            for now, then in zip(
                states, nominal.step(states[: len(actions)], actions), strict=False
            )
        )
        own, _ = _missed(list(steps))
        if own < OWN:
            raise Unsound(
                f"{what}: {names[position]!r} does not move as {names[rate]!r} says, {missed:.0%} "
                f"of the way is missed (by {nominal.name} {own:.0%}): the columns of the state are "
                f"in another order or unit than {', '.join(names)}, or the control period is not "
                f"{nominal.dt:g} s{_perhaps(ways, nominal.dt)}"
            )


def _ways(states: Array, position: int, rate: int, dt: float) -> Array:
    """Way of a position over spans of a rollout, and the same by its rate, (n, 2)."""
    span = min(SPAN, len(states) - 1)
    by_rate = np.cumsum(0.5 * dt * (states[1:, rate] + states[:-1, rate]))
    summed = np.concatenate([[0.0], by_rate])
    ends = [values[span:] - values[:-span] for values in (states[:, position], summed)]
    return np.stack(ends, axis=1) if span else np.zeros((0, 2))


def _perhaps(ways: Sequence[Array], dt: float) -> str:
    """By how much rates or the period would be off, if that were all."""
    moved, by_rate = np.concatenate(ways).T
    times = float(moved @ by_rate / (by_rate @ by_rate))
    if times <= 0 or _missed([np.stack([moved, times * by_rate], axis=1)])[0] > SCALED:
        return ""
    return f" (it moves {times:.3g} times as far, as in periods of {times * dt:.3g} s)"


def _missed(ways: Sequence[Array]) -> tuple[float, float]:
    """Part of the longer way that is missed, and its mean length."""
    moved, by_rate = np.concatenate(ways).T
    if not len(moved):
        return 0.0, 0.0
    longer = max(np.abs(moved).sum(), np.abs(by_rate).sum())
    missed = np.abs(moved - by_rate).sum() / longer if longer > 0 else 0.0
    return float(missed), float(longer / len(moved))
