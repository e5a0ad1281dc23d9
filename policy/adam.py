"""Adam on one flat parameter array, with a slowly following copy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from policy.compiled import compiled
from policy.memory import zeros

Array = NDArray[np.float32]
MEAN_KEPT, SQUARE_KEPT, TINY = 0.9, 0.999, 1e-8
#: Moments below this move no parameter by as much as 1e-22 of a step size and count as zero. Those
#: of units that have died would decay into denormal numbers, with which the pass takes half as
#: long again.
LEAST = 1e-30


class Adam:
    """Adam (Kingma and Ba, 2015) with the paper's defaults.

    Args:
        parameters: Flat array, changed in place by ``step``.
        gradient: Its gradient, same shape, read by ``step``.
        target: A copy of the parameters that follows them slowly, same shape.
        learning_rate: Step size.
        weight_decay: Factor of the parameters added to the gradient: the gradient of
            ``weight_decay / 2 |parameters|^2``.
    """

    def __init__(
        self,
        parameters: Array,
        gradient: Array,
        target: Array,
        learning_rate: float,
        weight_decay: float = 0.0,
    ) -> None:
        self.learning_rate = learning_rate
        self.weight_decay = weight_decay
        self.mean = zeros(*parameters.shape)
        self.square = zeros(*parameters.shape)
        self.steps = np.zeros((), np.float32)
        self._parameters = parameters
        self._gradient = gradient
        self._target = target

    def step(self, share: float = 0.0) -> None:
        """Move the parameters against the gradient, then the target ``share`` of the way to them.

        One pass does both, since reading the parameters from memory takes most of the time.
        """
        self.steps += 1
        steps = float(self.steps)
        mean_seen, square_seen = 1 - MEAN_KEPT**steps, 1 - SQUARE_KEPT**steps
        _step(
            (self._parameters, self._gradient, self.mean, self.square, self._target),
            np.float32(self.weight_decay),
            np.float32(self.learning_rate / mean_seen),
            np.float32(square_seen**-0.5),
            np.float32(share),
        )

    def reset(self) -> None:
        """Forget both moments and the step count."""
        for array in self.state().values():
            array.fill(0)

    def state(self) -> dict[str, Array]:
        """The arrays that make up the optimiser's memory, not copied."""
        return {"mean": self.mean, "square": self.square, "steps": self.steps}


@compiled
def _step(
    arrays: tuple[Array, Array, Array, Array, Array],
    decay: np.float32,
    rate: np.float32,
    square_scale: np.float32,
    share: np.float32,
) -> None:
    parameters, gradient, mean, square, target = arrays
    mean_kept, square_kept = np.float32(MEAN_KEPT), np.float32(SQUARE_KEPT)
    one, tiny, least, zero = np.float32(1), np.float32(TINY), np.float32(LEAST), np.float32(0)
    for i in range(parameters.size):
        slope = gradient[i] + decay * parameters[i]
        new_mean = mean_kept * mean[i] + (one - mean_kept) * slope
        new_square = square_kept * square[i] + (one - square_kept) * slope * slope
        mean[i] = zero if abs(new_mean) < least else new_mean  # NaN stays
        square[i] = zero if new_square < least else new_square
        parameters[i] -= rate * mean[i] / (np.sqrt(square[i]) * square_scale + tiny)
        target[i] += share * (parameters[i] - target[i])
