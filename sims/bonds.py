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

    def filled(self, states: Array, told: NDArray[np.bool_]) -> Array:
        """A path, (n, n_p), with what is told where it opens the bonds least.

        Each row begins where the one before ended; one that leads nowhere stays as it is. Rates
        stay as they are.
        """
