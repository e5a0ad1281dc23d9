"""The actor and the critic with their gradients written out as matrix products.

Autograd's bookkeeping is a noticeable share of an update at these sizes. Here every network is
one flat array (so that an optimiser step is one call), a pass writes into buffers that are
allocated once, and no product is computed that is not used: the actor's step takes from the
critic only the gradient with respect to the action.

Both have two hidden layers of rectified linear units. Where the action enters the critic is a
choice: docs/deviations.md says what each brings.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from policy import passes
from policy.memory import zeros

Array = NDArray[np.float32]
LAST_HALF_WIDTH = 3e-3
#: Output of the actor before tanh beyond which it is saturated.
SATURATED = np.float32(2)


class Inputs:
    """Columns [observation, 1, action]: what the critic reads, and but for the action the actor.

    The constant brings the first layer's bias into its product.

    Args:
        observation_size: n_o.
        action_size: n_a.
        columns: Number of columns n.

    Attributes:
        all: shape (n_o + 1 + n_a, n).
        observed: Observations and constant, shape (n_o + 1, n), a view.
        observations: shape (n_o, n), a view.
        actions: shape (n_a, n), a view.
    """

    def __init__(self, observation_size: int, action_size: int, columns: int) -> None:
        self.all = zeros(observation_size + 1 + action_size, columns)
        self.all[observation_size] = 1
        self.observations = self.all[:observation_size]
        self.observed = self.all[: observation_size + 1]
        self.actions = self.all[observation_size + 1 :]


class FlatNetwork:
    """Three layers whose weights lie in one flat array, and whose gradients in another.

    Args:
        inputs: Number of inputs, the constant included.
        hidden: Widths of the two hidden layers.
        outputs: Number of outputs.
        batch: Columns per pass.
        late: Number of inputs of the second hidden layer beside the first one.

    Attributes:
        parameters: All parameters, shape (n,), float32; biases start at zero.
        gradient: Gradient of the last backward pass, shape (n,).
        weights: Views into ``parameters``.
        d_weights: Views into ``gradient``.
    """

    def __init__(
        self, inputs: int, hidden: tuple[int, int], outputs: int, batch: int, late: int = 0
    ) -> None:
        sizes = (inputs, hidden, outputs, late)
        self.parameters = zeros(passes.Weights.size(*sizes))
        self.gradient = zeros(*self.parameters.shape)
        self.weights = passes.Weights.of(self.parameters, *sizes)
        self.d_weights = passes.Weights.of(self.gradient, *sizes)
        self._buffers = passes.Buffers.empty(hidden, outputs, batch, late)

    def _start(self, rng: np.random.Generator, *entries: Array) -> None:
        """Weights uniform within 1/sqrt(inputs), the last ones within 3e-3; biases stay zero.

        Args:
            rng: Their source.
            entries: Rows of ``weights.entry`` that take inputs other than the constant.
        """
        _, weight2, _, weight3, _ = self.weights
        half_width = sum(len(rows) for rows in entries) ** -0.5
        for rows in entries:
            rows[:] = _uniform(rng, rows.T.shape, half_width).T
        weight2[:] = _uniform(rng, weight2.shape, weight2.shape[1] ** -0.5)
        weight3[:] = _uniform(rng, weight3.shape, LAST_HALF_WIDTH)


class Actor(FlatNetwork):
    """Observation -> action in [-1, 1]: two rectified layers, then tanh.

    Args:
        observation_size: n_o.
        action_size: n_a.
        hidden: Widths of the two hidden layers.
        batch: Columns per pass.
        rng: Source of the initial weights: uniform within 1/sqrt(inputs), output within 3e-3.
    """

    def __init__(
        self,
        observation_size: int,
        action_size: int,
        hidden: tuple[int, int],
        batch: int,
        rng: np.random.Generator,
    ) -> None:
        super().__init__(observation_size + 1, hidden, action_size, batch)
        self._start(rng, self.weights.entry[:-1])

    def layers(self) -> dict[str, Array]:
        """``weight1`` (h_1, n_o), ``bias1`` and so on, as ``MlpPolicy`` wants them: live views."""
        entry, *others = self.weights
        names = self.weights._fields[1:]
        first = {"weight1": entry[:-1].T, "bias1": entry[-1]}
        return first | dict(zip(names, others, strict=True))

    def forward(self, inputs: Inputs) -> None:
        """Put the actions for the observations of ``inputs`` where its actions are."""
        passes.forward(self.weights, inputs.observed, self._buffers)
        np.tanh(self._buffers.output, out=inputs.actions)

    def backward(self, inputs: Inputs, d_actions: Array, penalty: float = 0.0) -> None:
        """Fill ``gradient`` after ``forward`` of the same columns.

        Args:
            inputs: n columns.
            d_actions: Gradient of the loss with respect to the actions, (n_a, n).
            penalty: Added to the loss times the mean over columns of the squared part of the
                outputs before tanh that is beyond ``SATURATED``.
        """
        d_output = d_actions * (1 - inputs.actions**2)
        if penalty:
            output = self._buffers.output
            beyond = output - np.clip(output, -SATURATED, SATURATED)
            d_output += np.float32(2 * penalty / output.shape[1]) * beyond
        passes.backward(self.weights, d_output, self._buffers)
        passes.weight_gradients(self.d_weights, inputs.observed, d_output, self._buffers)


class Critic(FlatNetwork):
    """Observation and action in [-1, 1] -> value.

    Args:
        observation_size: n_o.
        action_size: n_a.
        hidden: Widths of the two hidden layers.
        batch: Columns per pass.
        rng: Source of the initial weights: uniform within 1/sqrt(inputs), output within 3e-3.
        action_layer: Hidden layer that the action enters: 1, or 2 as in Lillicrap et al. (2016).
    """

    def __init__(
        self,
        observation_size: int,
        action_size: int,
        hidden: tuple[int, int],
        batch: int,
        rng: np.random.Generator,
        action_layer: int = 1,
    ) -> None:
        self._late = action_layer == 2
        early, late = (0, action_size) if self._late else (action_size, 0)
        super().__init__(observation_size + 1 + early, hidden, 1, batch, late)
        entry = self.weights.entry
        self._action_entry = entry[observation_size + 1 :]
        self._start(rng, entry[:observation_size], self._action_entry)
        self._late_actions = self._buffers.hidden1[hidden[0] :]
        self._d_actions = (
            self._buffers.back1[hidden[0] :] if self._late else zeros(action_size, batch)
        )

    def forward(self, inputs: Inputs) -> Array:
        """Values, shape (1, n); the buffer is overwritten by the next call."""
        if self._late:
            self._late_actions[:] = inputs.actions
        passes.forward(self.weights, self._entering(inputs), self._buffers)
        return self._buffers.output

    def backward(self, inputs: Inputs, d_values: Array) -> None:
        """Fill ``gradient`` after ``forward`` of the same columns.

        Args:
            inputs: n columns.
            d_values: Gradient of the loss with respect to the values, (1, n).
        """
        passes.backward(self.weights, d_values, self._buffers)
        entering = self._entering(inputs)
        passes.weight_gradients(self.d_weights, entering, d_values, self._buffers)

    def d_actions(self, d_values: Array) -> Array:
        """Gradient with respect to the actions of the last ``forward``, shape (n_a, n).

        The buffer is overwritten by the next call, or by ``backward``.

        Args:
            d_values: Gradient of the loss with respect to the values, (1, n).
        """
        passes.backward(self.weights, d_values, self._buffers)
        if not self._late:
            passes.product(self._action_entry, self._buffers.back1, self._d_actions)
        return self._d_actions

    def _entering(self, inputs: Inputs) -> Array:
        return inputs.observed if self._late else inputs.all


def _uniform(rng: np.random.Generator, shape: tuple[int, ...], half_width: float) -> Array:
    return rng.uniform(-half_width, half_width, shape).astype(np.float32)
