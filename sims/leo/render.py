"""Pictures of Leo: a camera goes along, marks on the ground show how far it has come."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw

from sims.leo.body import ANKLE, GROUND, HAND, HEEL, HIP, KNEE, SHOULDER, TOE, WHEEL, frames, turned
from sims.simulator import Array

_SIZE = 240
_OVERSAMPLING = 3
_METRES = 0.9  # that the picture is wide
_GROUND_AT = 0.86  # share of the height
_MARK = 0.25  # m between marks on the ground
_PAPER, _INK, _FAR_LEG, _NEAR_LEG, _TORSO, _ARM = (
    "#fbfaf7",
    "#2b2b2b",
    "#a9bbd6",
    "#4a6fa5",
    "#d1495b",
    "#e3929c",
)


class LeoRenderer:
    """Seen from its right side, walking to the right; the right leg is in front."""

    def frame(self, state: Array) -> np.ndarray:
        """RGB picture, shape (240, 240, 3), of a state whose first nine are positions."""
        positions = np.asarray(state, float)[None, :9]
        angles, origins = frames(positions)
        size = _SIZE * _OVERSAMPLING
        scale = size / _METRES
        middle = positions[0, 0]
        image = Image.new("RGB", (size, size), _PAPER)
        draw = ImageDraw.Draw(image)

        def place(point: Array) -> tuple[float, float]:
            x = size / 2 + scale * (point[0] - middle)
            return float(x), float(size * _GROUND_AT - scale * (point[1] - GROUND))

        def of(link: int, point: tuple[float, float]) -> Array:
            return origins[0, link] + turned(angles[:, link], point)[0]

        def bone(a: Array, b: Array, width: float, colour: str) -> None:
            ends, radius = [place(a), place(b)], 0.5 * width * scale
            draw.line(ends, fill=colour, width=round(2 * radius))
            for x, y in ends:
                draw.ellipse([x - radius, y - radius, x + radius, y + radius], fill=colour)

        def leg(thigh: int, colour: str) -> None:
            shank, foot = thigh + 2, thigh + 4
            bone(origins[0, thigh], of(thigh, KNEE), 0.034, colour)
            bone(origins[0, shank], of(shank, ANKLE), 0.028, colour)
            heel, toe = of(foot, HEEL), of(foot, TOE)
            bone(origins[0, foot], heel, 0.02, colour)
            bone(origins[0, foot], toe, 0.02, colour)
            bone(heel, toe, 2 * WHEEL, colour)

        floor = size * _GROUND_AT
        draw.line([(0, floor), (size, floor)], fill=_INK, width=size // 120)
        first = int(np.floor((middle - 0.5 * _METRES) / _MARK))
        for mark in range(first, first + round(_METRES / _MARK) + 3):
            x, y = place(np.array([mark * _MARK, GROUND]))
            long = 0.045 if mark % 4 == 0 else 0.02
            draw.line([(x, y), (x, y + long * size)], fill=_INK, width=size // 160)
        leg(1, _FAR_LEG)
        bone(of(0, HIP), of(0, (SHOULDER[0], 0.1)), 0.075, _TORSO)
        bone(of(0, SHOULDER), of(0, HAND), 0.025, _ARM)
        leg(2, _NEAR_LEG)
        return np.asarray(image.resize((_SIZE, _SIZE), Image.Resampling.LANCZOS))
