"""Whether two simulators are of one system, and one of them seen as policies see the other."""

from __future__ import annotations

import copy
import dataclasses

import numpy as np

from sims.simulator import Simulator


def seen_as(nominal: Simulator, true: Simulator) -> Simulator:
    """A true simulator that policies see in the scales of the one that they learnt on."""
    known = {channel.name: channel for channel in nominal.state_channels}
    channels = tuple(
        dataclasses.replace(c, scale=known[c.name].scale, invariant=known[c.name].invariant)
        if c.name in known
        else c
        for c in true.state_channels
    )
    if channels == true.state_channels:
        return true
    seen = copy.copy(true)
    seen.state_channels = channels
    return seen


def check_same_channels(
    nominal: Simulator, other: Simulator, what: str, memory: bool = False
) -> None:
    """Raise ``ValueError`` unless both have one period and the same channels.

    The same: names in order, units (of actions as far as they have one), which are angles, and
    bounds of actions.

    Args:
        nominal, other: The two.
        what: The other one in words.
        memory: Whether the hidden memory of effects counts.
    """
    for kind in ("state_channels", "action_channels"):
        own, others = (
            [c for c in getattr(one, kind) if memory or c.kind != "memory"]
            for one in (nominal, other)
        )
        if [c.name for c in own] != [c.name for c in others]:
            raise ValueError(
                f"{what} has {kind.replace('_', ' ')} {', '.join(c.name for c in others)}, "
                f"expected {', '.join(c.name for c in own)} as {nominal.name}"
            )
        fields = ("unit", "angle") if kind == "state_channels" else ("unit", "low", "high")
        for expected, found in zip(own, others, strict=True):
            for field in fields:
                wanted, given = getattr(expected, field), getattr(found, field)
                # A command without a unit, as that of a gear of 0.85 in MuJoCo, is one of any.
                unknown = kind == "action_channels" and field == "unit" and "1" in (wanted, given)
                if wanted != given and not unknown:
                    raise ValueError(
                        f"{what} has channel {found.name!r} with {field}={given!r}, expected "
                        f"{wanted!r} as {nominal.name}"
                    )
    if not np.isclose(nominal.dt, other.dt):
        raise ValueError(
            f"{what} has a control period of {other.dt:g} s, expected {nominal.dt:g} s as "
            f"{nominal.name}"
        )
