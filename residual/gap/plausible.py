"""Numbers too large to be believed: effects that switch the system off instead of explaining it.

Where the nominal simulator is far off, whatever stops the motion takes most of the error away: a
gain of a hundredth, a dead zone wider than the input, an inertia a thousand times too large.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from residual.gap.model import Model
from residual.gap.samples import Samples
from sims.effects.parameter import ParameterChange

Array = NDArray[np.float64]

#: Largest factor between a parameter and its nominal value, either way.
FACTOR = 10.0
#: Least part of the input's variation that its way to the actuator leaves.
THROUGH = 0.1


def absurd(model: Model, theta: Array, samples: Samples) -> str:
    """Why a set of effects cannot be right, or an empty string.

    Args:
        model: Simulator with the effects.
        theta: Their numbers, (p,).
        samples: The measured table.
    """
    host = model.bind(theta)
    for effect in host.effects[len(model.simulator.effects) :]:
        if not isinstance(effect, ParameterChange):
            continue
        nominal = float(np.mean(host.parameters[effect.parameter].value))
        if nominal == 0:
            continue
        ratio = (nominal + float(effect.change)) / nominal
        if not 1 / FACTOR <= ratio <= FACTOR:
            return f"{effect.parameter} would be {ratio:.3g} times its nominal value"
    given = model.simulator.with_effects(())
    before = Model(given).inputs(samples, np.zeros((1, 0)))[0]
    after = model.inputs(samples, theta[None])[0]
    for j, channel in enumerate(host.action_channels):
        usual = float(before[..., j, 0].std())
        left = float(after[..., j, 0].std())
        if usual > 0 and not THROUGH <= left / usual <= 1 / THROUGH:
            return f"{channel.name} would have {left / usual:.2g} of its strength"
    return ""
