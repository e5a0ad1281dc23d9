"""Positions that a system binds to each other, as in a closed chain."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sims.simulator import Array


class Bonds(Protocol):
    """What a system's bonds leave possible of its physical states."""

    def told(self, states: Array, unknown: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Which of the unknown positions all others leave no choice, and their rates, (n_p,).

        Args:
            states: A path, (n, n_p), zero or near where nothing is known.
            unknown: Channels of which nothing was measured, (n_p,).
        """

    def closed(self, states: Array, told: NDArray[np.bool_]) -> Array:
        """A path, (n, n_p), with positions that keep the bonds, as near as can be.

        What was told moves first, from where it was in the row before; other positions move as
        little as closes the bonds. Rows whose bonds cannot be closed stay as they are.
        """
