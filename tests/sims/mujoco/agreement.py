"""Does a model file move as a simulator does?"""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from sims.mujoco import MujocoSimulator


def agreement(simulator: MujocoSimulator, path: str | Path, seconds: float = 1.0) -> float:
    """How far plain MuJoCo with a model file is from a simulator, over an open-loop rollout.

    From rest in the reference pose, with smoothly varying controls.

    Args:
        simulator: With scalar values.
        path: The model file.
        seconds: Length of the rollout.

    Returns:
        The largest difference of a position or velocity, in their SI units.
    """
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    count = max(1, round(seconds / simulator.dt))
    times = simulator.dt * np.arange(count)
    controls = (
        np.stack(
            [
                0.4 * c.scale * np.sin(2 * np.pi * (0.7 + 0.3 * k) * times)
                for k, c in enumerate(simulator.action_channels)
            ],
            axis=1,
        )
        if simulator.action_channels
        else np.empty((count, 0))
    )
    width = simulator.model.nq + simulator.model.nv
    start = np.concatenate([simulator.model.qpos0, np.zeros(simulator.model.nv)])
    start = np.append(start, np.zeros(len(simulator.physical_channels) - width))
    ours = simulator.rollout(simulator.augment(start[None])[0], controls)
    worst = 0.0
    for k, control in enumerate(controls):
        data.ctrl[:] = control
        mujoco.mj_step(model, data, simulator.substeps)
        theirs = np.concatenate([data.qpos, data.qvel])
        worst = max(worst, float(np.abs(ours[k + 1, :width] - theirs).max()))
    return worst
