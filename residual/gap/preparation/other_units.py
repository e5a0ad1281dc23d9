"""Units that a log may count in, and the simulator does not."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from residual.gap.preparation.convention import Convention, of_states
from residual.logs.units import Unit, find_unit, other_units
from sims.host import HostSimulator
from sims.simulator import Channel

#: Times that a unit differs from another, below which nobody states the one for the other where
#: physics would not do as much: ft/s for mph.
NEXT_TO = 5.0


def in_another_unit(channel: Channel, converted: Mapping[str, str]) -> list[tuple[str, Unit]]:
    """What an input's column may count in, in words and numbers.

    Args:
        channel: The input.
        converted: Units that columns were in, by channel, as a header or a map says, where that
            is not the channel's own.
    """
    others = [
        (f"`unit: {name}` for {channel.name} ({_beside_a_unit(unit)})", unit)
        for name, unit in _others(channel, converted)
    ]
    return [*others, *misread(channel, converted)]


def states_in_other_units(
    simulator: HostSimulator, joints: Sequence[Sequence[int]], converted: Mapping[str, str]
) -> list[Convention]:
    """The same of positions with their rates, one by one and all that share a unit together.

    Args:
        simulator: Its channels are what columns stand for.
        joints: Numbers of a position and of its rate, or of one of them.
        converted: As for an input.
    """
    found = []
    for joint in joints:
        found += _in_other_units(simulator, joint, converted)
        for says, unit in misread(simulator.physical_channels[joint[0]], converted):
            found.append(of_states(simulator, says, joint[:1], unit.factor, unit.offset))
    return found + _all_in_other_units(simulator, joints, converted)


def _others(channel: Channel, converted: Mapping[str, str]) -> list[tuple[str, Unit]]:
    """Units that a column may be in; of one whose unit is stated none that is next to it."""
    stated = channel.name in converted
    return [
        (name, unit)
        for name, unit in other_units(channel.unit)
        if unit.offset or not (stated and 1 / NEXT_TO < unit.factor < NEXT_TO)
    ]


def _in_other_units(
    simulator: HostSimulator, joint: Sequence[int], converted: Mapping[str, str]
) -> list[Convention]:
    """A position and its rate in units that go together."""
    channels = [simulator.physical_channels[i] for i in joint]
    found = []
    for name, unit in _others(channels[0], converted):
        said = [f"`unit: {name}` for {channels[0].name}"]
        for rate in channels[1:]:
            alike = [n for n, u in other_units(rate.unit) if np.isclose(u.factor, unit.factor)]
            said += [f"`unit: {one}` for {rate.name}" for one in alike]
        if len(said) == len(channels):
            says = f"{' and '.join(said)} ({_beside_a_unit(unit)})"
            found.append(of_states(simulator, says, joint, unit.factor, unit.offset))
    return found


def _all_in_other_units(
    simulator: HostSimulator, joints: Sequence[Sequence[int]], converted: Mapping[str, str]
) -> list[Convention]:
    """All states of one unit in another one: who logs one temperature in K logs them all so."""
    alike: dict[tuple[str, ...], list[Sequence[int]]] = {}
    for joint in joints:
        units = tuple(simulator.physical_channels[i].unit for i in joint)
        alike.setdefault(units, []).append(joint)
    found = []
    for group in alike.values():
        each = [_in_other_units(simulator, joint, converted) for joint in group]
        for ones in zip(*each, strict=True) if len(group) > 1 else ():
            states = np.vstack(
                [
                    np.prod([one.states[0] for one in ones], axis=0),
                    np.sum([one.states[1] for one in ones], axis=0),
                ]
            )
            says = " and ".join(one.says for one in ones)
            found.append(dataclasses.replace(ones[0], says=says, states=states))
    return found


def misread(channel: Channel, converted: Mapping[str, str]) -> list[tuple[str, Unit]]:
    """What undoes the conversion of a column from a unit that it is not in, in words and numbers;
    but for what another unit does, too. Where nothing was converted, there is nothing to undo."""
    said = converted.get(channel.name)
    if said is None:
        return []
    unit, others = find_unit(said, channel.unit), other_units(channel.unit)
    back = Unit(1 / unit.factor, -unit.offset / unit.factor)
    if any(np.allclose(back, other) for _, other in others):
        return []
    return [(f"`unit: {channel.unit}` for {channel.name} (not {said})", back)]


def _beside_a_unit(unit: Unit) -> str:
    """The same change of a column whose unit is stated already, and is not what it should be."""
    lines = [f"`scale: {unit.factor:.6g}`"] if unit.factor != 1.0 else []
    lines += [f"`offset: {unit.offset:.6g}`"] if unit.offset else []
    return f"{' and '.join(lines)} if a unit is stated"
