"""Where a simulator does not answer to what was recorded: an input or a state that it cuts off."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.nominal import filled
from residual.logs.checks import Finding
from residual.trajectories import Trajectory
from sims.host import HostSimulator
from sims.simulator import Channel

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Samples that are tried, of all runs together.
_TRIED = 600
# A channel is moved by this share of its range, and answers if more than this share of that shows.
_MOVED, _ANSWERS = 1e-3, 1e-9
# It is cut off where no sample beyond answers, at least this many and this share of all, while
# nearly all others do.
_SOME, _SHARE, _NEARLY = 5, 0.02, 0.9
# How often the stretch in which a limit lies is halved.
_HALVED = 30

# What one period makes of samples whose channel has these values, (n,) -> (n, n_physical).
Response = Callable[[Array], Array]


def unanswered(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """Inputs and states beyond which a simulator stays the same, as behind ``np.clip``, and inputs
    that make no difference at all.

    What a simulator leaves out there is made up for by gains and shifts that are not there. A dead
    zone, flat around zero, is nothing to tell; positions, which contacts and stops make flat, are
    not asked.
    """
    if simulator.has_contacts or not simulator.advances_rows_at_once:
        return []
    plain = simulator.with_effects(())
    states, actions = _samples(plain, trajectories)
    if not len(states):
        return []
    found = []
    for column, channel in enumerate(plain.action_channels):

        def driven(values: Array, column: int = column) -> Array:
            moved = np.array(actions)
            moved[:, column] = values
            return plain.step(states, moved)

        given = actions[:, column]
        found += _cut_off(plain, channel, given, _within(channel, given), driven)
        found += _unused(plain, channel, given, driven)
    for column, channel in enumerate(plain.physical_channels):
        if channel.kind == "position":
            continue

        def left(values: Array, column: int = column) -> Array:
            moved = np.array(states)
            moved[:, column] = values
            return plain.step(moved, actions)

        everywhere = np.ones(len(states), bool)
        found += _cut_off(plain, channel, states[:, column], everywhere, left, column)
    return found


def _samples(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> tuple[Array, Array]:
    """Some recorded states and inputs of all runs, none with a hole, (n, n_physical), (n, n_a)."""
    states, actions = [], []
    for run in trajectories:
        own = filled(simulator, run)
        if own is not None:
            states.append(own[:-1])
            actions.append(run.actions)
    if not states:
        return np.zeros((0, len(simulator.physical_channels))), np.zeros((0, 0))
    before, inputs = np.concatenate(states), np.concatenate(actions)
    whole = np.flatnonzero(np.isfinite(before).all(axis=1) & np.isfinite(inputs).all(axis=1))
    rows = (
        whole[np.unique(np.linspace(0, len(whole) - 1, _TRIED).astype(int))]
        if len(whole)
        else whole
    )
    return before[rows], inputs[rows]


def _within(channel: Channel, values: Array) -> Mask:
    """Inputs between the bounds of their actuator, which are another finding's."""
    room = 2 * _MOVED * np.ptp(values)
    return (values > channel.low + room) & (values < channel.high - room)


def _cut_off(
    simulator: HostSimulator,
    channel: Channel,
    values: Array,
    asked: Mask,
    response: Response,
    carried: int | None = None,
) -> list[Finding]:
    """A finding for each side on which no sample answers; ``carried`` is the column of a state,
    which outlasts a period even where nothing follows from it."""
    with np.errstate(all="ignore"):
        answers = _answers(values, response, carried, _MOVED * np.ptp(values))
    if not (answers & asked).any():
        return []
    found = []
    low, high = values[answers & asked].min(), values[answers & asked].max()
    inside = asked & (values >= low) & (values <= high)
    if answers[inside].mean() < _NEARLY:
        return []
    for side, bound, beyond in (("above", high, values > high), ("below", low, values < low)):
        count = int((beyond & asked).sum())
        outward = bound > 0 if side == "above" else bound < 0
        if count < max(_SOME, _SHARE * len(values)) or not outward:
            continue
        first = int(np.flatnonzero(beyond & asked)[0])
        at = _edge(values, response, carried, first, bound)
        says = (
            f"makes no difference to {simulator.name} {side} {at:.3g}{channel.unit_text}, as if it "
            f"were cut off there (np.clip, minimum, maximum), and {count / len(values):.0%} of the "
            "samples go beyond: unless the real system does so too, take that limit out of the "
            "simulator; gains and limits that are found make up for it"
        )
        numbers = {"bound": at, "share": count / len(values)}
        found.append(Finding("unanswered", channel.name, says, numbers, "warning"))
    return found


def _unused(
    simulator: HostSimulator, channel: Channel, values: Array, response: Response
) -> list[Finding]:
    """A finding if an input changes and nothing else does; what a parameter of zero multiplies may
    be what is looked for."""
    range_ = np.ptp(values)
    if not range_ or not all(np.all(p.value) for p in simulator.parameters.values()):
        return []
    with np.errstate(all="ignore"):
        if _answers(values, response, None, range_ / 2).any():
            return []
    says = (
        f"makes no difference to {simulator.name}, although it changes in the log: use it in the "
        "simulator, or leave it there only for parameters that may change with it"
    )
    return [Finding("unused", channel.name, says, {}, "warning")]


def _answers(values: Array, response: Response, carried: int | None, step: float) -> Mask:
    """Which samples come out otherwise if the channel is moved by a step, either way, within what
    was recorded of it: beyond that a simulator may not be asked."""
    answers = np.zeros(len(values), bool)
    now = response(values)
    for move in (step, -step):
        shifted = np.clip(values + move, values.min(), values.max())
        change = response(shifted) - now
        moved = np.abs(change).max(axis=1) > _ANSWERS * step
        if carried is not None:
            change[:, carried] -= shifted - values
            moved &= np.abs(change).max(axis=1) > _ANSWERS * step
        answers |= moved
    return answers


def _edge(values: Array, response: Response, carried: int | None, row: int, inside: float) -> float:
    """Where a sample beyond begins to answer on its way inside."""
    moved, outside = np.array(values), float(values[row])
    step = np.copysign(_MOVED * np.ptp(values), outside - inside)
    for _ in range(_HALVED):
        moved[row] = (inside + outside) / 2
        if _answers(moved, response, carried, abs(step))[row]:
            inside = moved[row]
        else:
            outside = moved[row]
    return float(outside - step)
