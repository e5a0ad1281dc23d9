"""What comes back every turn: a sum of ``sine_n sin(n x) + cosine_n cos(n x)``."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sims.effects.joint import Value

#: Order, sine and cosine of every wave.
Waves = Sequence[tuple[int, Value, Value]]


def sum_of(waves: Waves, x: Value) -> Value:
    """Their sum at an angle in rad, by row."""
    return sum(sine * np.sin(n * x) + cosine * np.cos(n * x) for n, sine, cosine in waves)


def slope_of(waves: Waves, x: Value) -> Value:
    """How that changes per rad, by row."""
    return sum(n * (sine * np.cos(n * x) - cosine * np.sin(n * x)) for n, sine, cosine in waves)
