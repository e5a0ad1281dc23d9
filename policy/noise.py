"""Exploration noise with memory: a discrete Ornstein-Uhlenbeck process."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


class OrnsteinUhlenbeck:
    """Noise ``n <- n - theta n + sigma N(0, 1)``, one value per action, zero after a reset.

    The form of Lillicrap et al. (2016) with the time step absorbed in ``theta`` and ``sigma``.
    Its stationary standard deviation is ``sigma / sqrt(theta (2 - theta))`` and the
    correlation over k steps is ``(1 - theta)^k``. Values are in units of an action
    normalised to [-1, 1].

    Args:
        size: Number of actions.
        sigma: Standard deviation of one step's increment.
        theta: Share of the noise forgotten in each step, in (0, 1].
        rng: Source of randomness, or a seed for one.

    Raises:
        ValueError: ``sigma`` is negative or ``theta`` outside (0, 1].
    """

    def __init__(
        self,
        size: int,
        sigma: float = 0.12,
        theta: float = 0.15,
        rng: np.random.Generator | int = 0,
    ) -> None:
        if sigma < 0:
            raise ValueError(f"sigma is {sigma}, expected a standard deviation of at least 0")
        if not 0 < theta <= 1:
            raise ValueError(
                f"theta is {theta}, expected a share in (0, 1]; 1 makes the noise white"
            )
        self.sigma = sigma
        self.theta = theta
        self.value: NDArray[np.float64] = np.zeros(size)
        self._rng = np.random.default_rng(rng)

    def __repr__(self) -> str:
        size, sigma, theta = self.value.size, self.sigma, self.theta
        return f"{type(self).__name__}({size}, sigma={sigma:g}, theta={theta:g})"

    @property
    def state(self) -> dict[str, Any]:
        """Where its random numbers are, plain values; set it to go on from there."""
        return dict(self._rng.bit_generator.state)

    @state.setter
    def state(self, state: dict[str, Any]) -> None:
        self._rng.bit_generator.state = state

    def reset(self) -> None:
        """Forget the past: the next value starts from zero."""
        self.value = np.zeros_like(self.value)

    def __call__(self) -> NDArray[np.float64]:
        """The next value, shape (size,)."""
        step = self._rng.standard_normal(self.value.size)
        self.value = (1 - self.theta) * self.value + self.sigma * step
        return self.value
