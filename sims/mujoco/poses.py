"""Random states of a model, to probe it with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from sims.mujoco import elements
from sims.simulator import Array, Channel

#: Parts of the whole range that poses are drawn from until one is free.
REACHES = (1.0, 0.7, 0.5, 0.3, 0.2, 0.1, 0.05, 0.0)


def free_states(model: Any, channels: Sequence[Channel], n: int, rng: np.random.Generator) -> Array:
    """Random states about the reference pose in which no contact and no limit acts.

    Dry friction and couplings may: they are rows of the solver in every pose.

    Args:
        model: The compiled model.
        channels: Its state channels.
        n: How many states.
        rng: Source of the states.

    Returns:
        Positions, velocities and activations, (n, nq + nv + na).
    """
    return np.stack([_drawn(model, channels, rng, REACHES) for _ in range(n)])


def any_states(model: Any, channels: Sequence[Channel], n: int, rng: np.random.Generator) -> Array:
    """The same over the whole range, whatever is in the way there."""
    return np.stack([_drawn(model, channels, rng, REACHES[:1]) for _ in range(n)])


def _drawn(
    model: Any, channels: Sequence[Channel], rng: np.random.Generator, reaches: Sequence[float]
) -> Array:
    """The first free state of these, or the last."""
    data = mujoco.MjData(model)
    for reach in reaches:
        mujoco.mj_resetData(model, data)
        speeds = channels[model.nq : model.nq + model.nv]
        data.qvel[:] = [reach * channel.scale * rng.uniform(-1, 1) for channel in speeds]
        _pose(model, data, reach, rng)
        mujoco.mj_fwdPosition(model, data)
        if data.nefc == data.ne + data.nf:
            break
    return np.concatenate([data.qpos, data.qvel, data.act])


def _pose(model: Any, data: Any, reach: float, rng: np.random.Generator) -> None:
    for j in range(model.njnt):
        at = int(model.jnt_qposadr[j])
        kind = int(model.jnt_type[j])
        if kind not in (elements.HINGE, elements.SLIDE):
            continue
        if model.jnt_limited[j]:
            low, high = model.jnt_range[j]
            middle = 0.5 * (low + high)
            data.qpos[at] = middle + 0.45 * reach * (high - low) * rng.uniform(-1, 1)
        else:
            wide = np.pi if kind == elements.HINGE else 1.0
            data.qpos[at] += reach * wide * rng.uniform(-1, 1)
