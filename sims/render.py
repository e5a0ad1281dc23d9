"""Pictures of a system's state, for ``rgb_array`` rendering and for videos."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from PIL import Image, ImageDraw

from sims.simulator import Array, Simulator

_SIZE = 240
_OVERSAMPLING = 3
_PAPER, _INK, _ROD, _BOB = "#fbfaf7", "#2b2b2b", "#4a6fa5", "#d1495b"


class Renderer(Protocol):
    """Draws one state of a system."""

    def frame(self, state: Array) -> np.ndarray:
        """RGB picture of a state of shape (n_s,): uint8, shape (height, width, 3)."""
        ...


class PendulumRenderer:
    """A rod and a bob; angle 0 is upright, positive angles lean to the right."""

    def frame(self, state: Array) -> np.ndarray:
        """RGB picture, shape (240, 240, 3); ``state[0]`` is the angle in rad."""
        size = _SIZE * _OVERSAMPLING
        image = Image.new("RGB", (size, size), _PAPER)
        draw = ImageDraw.Draw(image)
        centre, length = size / 2, 0.36 * size
        tip = (centre + length * np.sin(state[0]), centre - length * np.cos(state[0]))
        draw.line([(centre, centre), tip], fill=_ROD, width=size // 40)
        for (x, y), radius, colour in ((tip, size / 18, _BOB), ((centre, centre), size / 60, _INK)):
            draw.ellipse([x - radius, y - radius, x + radius, y + radius], fill=colour)
        return np.asarray(image.resize((_SIZE, _SIZE), Image.Resampling.LANCZOS))


def renderer_for(simulator: Simulator) -> Renderer:
    """The renderer of a simulator: its own ``renderer()`` if it has one.

    Raises:
        ValueError: The simulator does not say how it looks.
    """
    make = getattr(simulator, "renderer", None)
    if make is None:
        raise ValueError(
            f"{simulator.name} cannot be rendered: give it a method renderer() that returns "
            "an object with frame(state)"
        )
    return make()
