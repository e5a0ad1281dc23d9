"""What a column map may have to say: signs, zeros, units, a clock, columns that were exchanged."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples
from residual.gap.preparation.convention import (
    Convention,
    as_said,
    of_input,
    of_states,
    reversed_sign,
)
from residual.gap.preparation.other_units import in_another_unit, states_in_other_units
from residual.logs.units import other_units
from sims.host import HostSimulator
from sims.simulator import UNDECLARED, Channel

Array = NDArray[np.float64]

#: Zeros from which angles are counted, in turns.
QUARTERS = (0.0, 0.25, 0.5, -0.25)
#: Control periods in a sample, or samples in one, that a slip of the clock makes, and how nearly.
SLIPS, SLIPPED = (10.0, 60.0, 100.0, 1000.0), 0.15
#: Units of time, one in the other, and control periods in a sample from which on one is far; the
#: largest command likewise, over a share of it.
TIMES, FAR = (60.0, 1000.0, 3600.0), 8.0
#: Ratio of a sample to the control period from which on it may be meant to be that.
PACE = 1.05
#: Ratios of a gear that inputs may lack, and part of their declared sizes that all are below
#: then.
RATIOS, SMALL = np.geomspace(5.0, 320.0, 13), 0.1


def conventions(
    simulator: HostSimulator, samples: Samples, converted: Mapping[str, str]
) -> list[Convention]:
    """What a column map may have to say: signs, zeros of angles, units, other columns.

    Args:
        simulator: Its channels are what columns stand for.
        samples: The measured table.
        converted: Units that columns were in, by channel, where that is not its own.
    """
    found = []
    for place, action in enumerate(simulator.action_channels):
        if _may_be_reversed(action, samples.actions[:, place]):
            found.append(of_input(simulator, reversed_sign(action.name), place, -1.0))
        if 0 <= action.low < action.high < np.inf:
            found.append(_upside_down(simulator, place))
        for says, unit in in_another_unit(action, converted):
            found.append(of_input(simulator, says, place, unit.factor, unit.offset))
        found += _thousandfold(simulator, place)
        found += _as_a_share(simulator, place, samples.actions[:, place])
    found += _before_a_gear(simulator, samples)
    joints = measured_joints(simulator, samples)
    for seen in joints:
        found += _turned(simulator, seen)
    found += states_in_other_units(simulator, joints, converted) + _exchanged(simulator, joints)
    found += _counted_from_the_last(simulator, joints)
    return found + _of_the_clock(simulator, samples, joints)


def _of_the_clock(
    simulator: HostSimulator, samples: Samples, joints: Sequence[Sequence[int]]
) -> list[Convention]:
    """A sample in every control period, where one comes at another pace; or another unit of time,
    where samples are far from the control period as they are said to come and near it in that unit.

    Times may count rows, or be made up from a period that was meant and not kept, whatever the
    control period. A measured rate counts as it is, or it was put on the scale of a position whose
    clock was wrong.
    """
    rare = samples.recorded_step / simulator.dt
    slips = any(abs(ratio / n - 1) < SLIPPED for n in SLIPS for ratio in (rare, 1 / rare))
    near = not slips and 1 / FAR < rare < FAR and bool(abs(np.log(rare)) > np.log(PACE))
    by_rows = slips or near or (samples.recorded_step == 1.0 and rare != 1.0)
    also = f" (`period: {simulator.dt:g}` of a log without times)" if by_rows else ""
    found = []
    for clock in [1 / rare] if by_rows else _units_of_time(rare):
        says = f"`scale: {clock:.6g}` for the time{also}"
        plain, pace = (
            dataclasses.replace(as_said(simulator), says=says, clock=clock, meant=near)
            for _ in range(2)
        )
        for joint in joints:
            pace.states[0, joint[1:]] = 1 / clock
        found += [plain, pace] if any(len(joint) > 1 for joint in joints) else [plain]
    return found


def _units_of_time(rare: float) -> list[float]:
    """Factors by which another unit of time brings samples near the control period, of which they
    are ``rare`` times the length."""
    if 1 / FAR < rare < FAR:
        return []
    return [f for n in TIMES for f in (n, 1 / n) if 1 / FAR < rare * f < FAR]


def measured_joints(simulator: HostSimulator, samples: Samples) -> list[list[int]]:
    """Every position with its rates, as far as they were measured."""
    channels = simulator.physical_channels
    measured = set(samples.measured.tolist())
    joints = []
    for place, channel in enumerate(channels):
        if channel.rate_of in {other.name for other in channels}:
            continue
        joint = [place, *(i for i, other in enumerate(channels) if other.rate_of == channel.name)]
        joints.append([i for i in joint if i in measured])
    return [joint for joint in joints if joint]


def _exchanged(simulator: HostSimulator, joints: Sequence[Sequence[int]]) -> list[Convention]:
    """Two columns in each other's place: inputs of the same unit, or joints with their rates."""
    found = []
    for channels, groups, field in (
        (simulator.physical_channels, joints, "states_from"),
        (
            simulator.action_channels,
            [[i] for i, _ in enumerate(simulator.action_channels)],
            "inputs_from",
        ),
    ):
        for one, other in itertools.combinations(groups, 2):
            units = field == "inputs_from"
            if not _alike(channels, one, other, units):
                continue
            names = [" and ".join(channels[i].name for i in each) for each in (one, other)]
            plain = as_said(simulator)
            getattr(plain, field)[[*one, *other]] = [*other, *one]
            says = f"the columns of {names[0]} and of {names[1]} exchanged (`column:` for each)"
            found.append(dataclasses.replace(plain, says=says))
    return found


def _alike(
    channels: Sequence[Channel], one: Sequence[int], other: Sequence[int], units: bool = True
) -> bool:
    """Whether channels at some places are of the same kinds, and units, as those at others."""
    first, second = (
        [(channels[i].unit if units else "", channels[i].kind) for i in each]
        for each in (one, other)
    )
    return first == second


def _counted_from_the_last(
    simulator: HostSimulator, joints: Sequence[Sequence[int]]
) -> list[Convention]:
    """Angles of a chain that a log counts from outside, and the simulator from the joint before, or
    the other way round."""
    channels, found = simulator.physical_channels, []
    for before, joint in itertools.pairwise(joints):
        if not _alike(channels, before, joint) or channels[joint[0]].turn is None:
            continue
        first, own = channels[before[0]].name, channels[joint[0]].name
        also = " (rates likewise)" if len(joint) > 1 else ""
        for times, word in ((-1.0, "less"), (1.0, "plus")):
            relative = tuple((i, j, times) for i, j in zip(joint, before, strict=True))
            says = f"{own} {word} {first} in place of {own}{also}"
            found.append(dataclasses.replace(as_said(simulator), says=says, relative=relative))
    return found


def _turned(simulator: HostSimulator, joint: Sequence[int]) -> list[Convention]:
    """Counted the other way round, or from a quarter or half turn away."""
    channels = [simulator.physical_channels[i] for i in joint]
    first = channels[0]
    turn = first.turn if first.kind == "position" else None
    found = []
    for sign, share in itertools.product((1.0, -1.0), QUARTERS[: 1 if turn is None else None]):
        zero = share * (turn or 0.0)
        changes = [f"`offset: {zero:.6g}`"] if zero else []
        changes += ["`scale: -1`"] if sign < 0 else []
        names = [channel.name for channel in (channels if sign < 0 else channels[:1])]
        if changes:
            says = f"{' and '.join(changes)} for {' and '.join(names)}"
            plain = of_states(simulator, says, joint, sign, zero)
            found.append(dataclasses.replace(plain, turned=bool(zero)))
    return found


def _thousandfold(simulator: HostSimulator, place: int) -> list[Convention]:
    """An input a thousand times as large or as small, where no unit of it is known that could say
    so: tonnes of something, parts, counts."""
    action = simulator.action_channels[place]
    if any(name != "%" for name, _ in other_units(action.unit)):
        return []
    return [
        of_input(simulator, f"`scale: {factor:g}` for {action.name}", place, factor)
        for factor in (1000.0, 0.001)
    ]


def _as_a_share(simulator: HostSimulator, place: int, values: Array) -> list[Convention]:
    """A command logged as a share of the largest one: a duty of 0 to 1 for one of 0 to 255."""
    action = simulator.action_channels[place]
    full = action.high if np.isfinite(action.high) else -action.low
    if not (np.isfinite(full) and full >= FAR and np.abs(values).max(initial=0.0) <= 1.0):
        return []
    return [of_input(simulator, f"`scale: {full:g}` for {action.name}", place, full)]


def _before_a_gear(simulator: HostSimulator, samples: Samples) -> list[Convention]:
    """All inputs times the ratio of a gear, where each is far smaller than declared: torques of
    motors in place of those of joints."""
    channels = simulator.action_channels
    largest = np.abs(samples.actions).max(axis=0, initial=0.0)
    declared = [channel.scale for channel in channels if channel.scale != UNDECLARED]
    small = len(declared) == len(channels) > 0 and (largest <= SMALL * np.array(declared)).all()
    if not small or not largest.any():
        return []
    names, found = " and ".join(channel.name for channel in channels), []
    for ratio in RATIOS:
        says = f"about `scale: {ratio:.2g}` for {names} (before a gear?)"
        plain = as_said(simulator)
        plain.inputs[0] = ratio
        found.append(dataclasses.replace(plain, says=says))
    return found


def _may_be_reversed(channel: Channel, values: Array) -> bool:
    """Whether commands are within their bounds the other way round as well: one that is cut off
    there does nothing, which may be less wrong than what it did."""
    inside = (values >= channel.low) & (values <= channel.high)
    reversed_ = (-values >= channel.low) & (-values <= channel.high)
    return bool(reversed_.sum() >= inside.sum())


def _upside_down(simulator: HostSimulator, place: int) -> Convention:
    """A command counted from its other end, as that of a relay that is on at zero."""
    action = simulator.action_channels[place]
    ends = action.low + action.high
    says = f"`scale: -1` and `offset: {ends:g}` for {action.name}"
    return of_input(simulator, says, place, -1.0, ends)
