"""Pictures of a MuJoCo model by MuJoCo's own offscreen renderer."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from sims.simulator import Array

HEIGHT, WIDTH = 240, 320


class MujocoRenderer:
    """Draws states as MuJoCo's viewer shows the model at first.

    Args:
        model: The compiled model.

    Raises:
        ValueError: This machine has no OpenGL context to draw in.
    """

    def __init__(self, model: Any) -> None:
        self._model = model
        self._data = mujoco.MjData(model)
        width = min(WIDTH, int(model.vis.global_.offwidth))
        height = min(HEIGHT, int(model.vis.global_.offheight))
        try:
            self._renderer = mujoco.Renderer(model, height, width)
        except Exception as error:  # each OpenGL platform fails in its own way
            reason = " ".join(str(error).split())
            raise ValueError(
                "MuJoCo cannot draw on this machine; without a display set the environment "
                f"variable MUJOCO_GL to egl or osmesa before Python starts ({reason})"
            ) from None

    def frame(self, state: Array) -> np.ndarray:
        """RGB picture, uint8, shape (240, 320, 3); the state begins with positions."""
        self._data.qpos[:] = state[: self._model.nq]
        mujoco.mj_forward(self._model, self._data)
        self._renderer.update_scene(self._data)
        return np.array(self._renderer.render())
