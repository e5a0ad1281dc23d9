"""Which joints stand still now and then in a log: only they start and stop as friction says."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples
from residual.logs.faults import noise
from sims.effects.base import Effect
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Speed that is next to none, as a share of the usual one, and in standard deviations of its noise.
HARDLY, NOISY = 0.1, 2.0
#: Part of the samples with next to no speed, from which on a joint stands still now and then. A
#: sine wave has 5 % of them, a normal distribution 8 %.
OFTEN = 0.2


def stands_still(records: Sequence[Array]) -> bool:
    """Whether something stands still for a part of the time, by its speeds, (n,) for each record.

    What noise hides may stand still, too.
    """
    slow = []
    for speeds in records:
        usual = float(np.sqrt(np.mean(speeds**2)))
        slow.append(np.abs(speeds) <= max(HARDLY * usual, NOISY * noise([speeds])))
    return bool(np.concatenate(slow).mean() > OFTEN)


def may_stick(effect: Effect, simulator: HostSimulator, samples: Samples, nodes: Array) -> bool:
    """Whether an effect holds something still, and that does stand still in the log.

    Args:
        effect: Friction of a joint, a dead zone of an input, or another one.
        simulator: Tells the rate of its joint.
        samples: The measured table.
        nodes: Physical states at every row of it, (n, n_p).
    """
    if not effect.holds_still or effect.enters != "joint":
        return effect.holds_still
    names = [channel.name for channel in simulator.physical_channels]
    rate = next((j.rate for j in simulator.joints if j.name == effect.where), None)
    if rate not in names:
        return True
    speeds = nodes[:, names.index(rate)]
    return stands_still([speeds[start:stop] for start, stop in samples.runs])
