"""Effects of actuators of which the commands in a log cannot tell."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples
from sims.drive import shaped
from sims.effects.actuator import (
    ActuatorEffect,
    Delay,
    Saturation,
    StaticActuatorEffect,
)
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Part of the changes of an input up to which too few come in time.
ARRIVING = 0.5


def by_commands(host: HostSimulator, samples: Samples, own: int) -> tuple[int, str] | None:
    """Which effect of an actuator the commands tell nothing of, and why; None if there is none.

    Args:
        host: The simulator with a fitted set behind its own effects.
        samples: The measured table.
        own: How many effects are its own.
    """
    return _static(host, samples, own) or _late(host, samples, own)


def _static(host: HostSimulator, samples: Samples, own: int) -> tuple[int, str] | None:
    """Which effect of an actuator shows in a single stretch of the data, or always, and why that
    tells nothing of it; None if there is none.

    What happens beyond the end of all other data can be fitted, but not forecast; and a saturation
    that cuts all that was commanded is a weaker actuator.
    """
    inputs = [channel.name for channel in host.action_channels]
    for number, effect in enumerate(host.effects[own:]):
        if not isinstance(effect, StaticActuatorEffect):
            continue
        shown = [
            effect.shows(_coming_in(effect, host.actuator_effects(name), commands))
            for run in samples.recorded
            for name, commands in zip(inputs, run.actions.T, strict=True)
            if name in effect.actuators
        ]
        always = all(s.all() for s in shown)
        stretches = sum(int(s[0]) + int((s[1:] & ~s[:-1]).sum()) for s in shown)
        if stretches == 1 and not always:
            return number, "the input reaches where it acts only once, so that nothing confirms it"
        if always and isinstance(effect, Saturation):
            return number, "the input is always beyond it, so that it would be a weaker actuator"
    return None


def _late(host: HostSimulator, samples: Samples, own: int) -> tuple[int, str] | None:
    """Which effect delays most changes of its input to beyond the end of their records, if any.

    So what records that begin with their only step would have without that step is a delay.
    """
    inputs = [channel.name for channel in host.action_channels]
    for number, effect in enumerate(host.effects[own:]):
        if not isinstance(effect, Delay):
            continue
        columns = [inputs.index(name) for name in effect.actuators]
        arrive = []
        for run in samples.recorded:
            held = np.vstack([run.first, run.actions])[:, columns]
            changes = np.flatnonzero((np.diff(held, axis=0) != 0).any(axis=1))
            left = np.cumsum(run.durations[::-1])[::-1][changes]
            arrive.append(left > effect.time)
        in_time = np.concatenate([[], *arrive])
        if in_time.size and in_time.mean() <= ARRIVING:
            return number, "most of what is commanded would come after its record has ended"
    return None


def _coming_in(effect: ActuatorEffect, others: Sequence[ActuatorEffect], commands: Array) -> Array:
    """What an effect gets of the commands (T,): what those before it leave."""
    return shaped(commands[None], [one for one in others if one.stage < effect.stage])[0]
