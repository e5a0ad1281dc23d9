"""The actor and the critic with their gradients written out as matrix products.

Autograd's bookkeeping is a noticeable share of an update at these sizes. Here every
network is one flat tensor (so that an optimiser step or a target update is one call), a pass
writes into buffers that are allocated once, and no product is computed that is not used: the
actor's step takes from the critic only the gradient with respect to the action.

Both have two hidden layers of rectified linear units. The action enters the critic at the first
layer and not, as in Lillicrap et al. (2016), at the second: two more products per update, and
clearly better swing-ups (docs/deviations.md).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import torch


class Layer(NamedTuple):
    """One layer: sizes, half-width of the uniform distribution its weights start from, memory.

    The gradient of a layer with few inputs is several times faster if it lies transposed.
    """

    inputs: int
    outputs: int
    half_width: float
    has_bias: bool = True
    transposed: bool = False


class Linear:
    """One layer ``x -> x W' + b``: views into a network's flat parameters and gradient.

    Args:
        weight: W, shape (outputs, inputs), and where its gradient goes.
        bias: b, shape (outputs,), and where its gradient goes; None for a layer without.
    """

    def __init__(
        self,
        weight: tuple[torch.Tensor, torch.Tensor],
        bias: tuple[torch.Tensor, torch.Tensor] | None,
    ) -> None:
        self.weight, self._d_weight = weight
        self.bias: torch.Tensor | None
        self._d_bias: torch.Tensor | None
        self.bias, self._d_bias = bias or (None, None)
        self._transposed = self.weight.t()

    def forward(
        self, x: torch.Tensor, out: torch.Tensor, plus: torch.Tensor | None = None
    ) -> torch.Tensor:
        """The outputs for a batch, shape (batch, outputs), in ``out``; ``plus`` replaces b."""
        added = self.bias if plus is None else plus
        assert added is not None, "a layer without bias needs something to add to"
        return torch.addmm(added, x, self._transposed, out=out)

    def backward(self, x: torch.Tensor, d_out: torch.Tensor) -> None:
        """Fill the gradients from the inputs and the gradient of the outputs."""
        torch.mm(d_out.t(), x, out=self._d_weight)
        if self._d_bias is not None:
            torch.sum(d_out, 0, out=self._d_bias)

    def d_input(self, d_out: torch.Tensor, out: torch.Tensor) -> torch.Tensor:
        """The gradient of the inputs, shape (batch, inputs), in ``out``."""
        return torch.mm(d_out, self.weight, out=out)


class FlatNetwork:
    """Layers whose weights lie in one flat tensor, and whose gradients in another.

    Args:
        layers: Sizes and initial ranges; biases start at zero.
        rng: Source of the initial weights.

    Attributes:
        parameters: All parameters, shape (n,), float32.
        gradient: Gradient of the last backward pass, shape (n,).
        layers: The layers, views into both.
    """

    def __init__(self, layers: list[Layer], rng: np.random.Generator) -> None:
        count = sum(layer.outputs * (layer.inputs + layer.has_bias) for layer in layers)
        self.parameters = torch.zeros(count)
        self.gradient = torch.zeros(count)
        self.layers = []
        start = 0
        for layer in layers:
            shape = (layer.outputs, layer.inputs)
            end = start + math.prod(shape)
            weight = self._view(start, end, shape, layer.transposed)
            weight[0].copy_(
                torch.from_numpy(rng.uniform(-layer.half_width, layer.half_width, shape))
            )
            start = end + layer.outputs * layer.has_bias
            bias = self._view(end, start, (layer.outputs,)) if layer.has_bias else None
            self.layers.append(Linear(weight, bias))

    def approach(self, other: FlatNetwork, share: float) -> None:
        """Move the parameters by ``share`` of the way to those of ``other``."""
        self.parameters.lerp_(other.parameters, share)

    def _view(
        self, start: int, end: int, shape: tuple[int, ...], transposed: bool = False
    ) -> tuple[torch.Tensor, torch.Tensor]:
        values, gradients = self.parameters[start:end], self.gradient[start:end]
        if transposed:
            return values.view(shape[::-1]).t(), gradients.view(shape[::-1]).t()
        return values.view(shape), gradients.view(shape)


class Actor(FlatNetwork):
    """Observation -> action in [-1, 1]: two rectified layers, then tanh.

    Args:
        observation_size: n_o.
        action_size: n_a.
        hidden: Widths of the two hidden layers.
        batch: Rows per pass.
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
        first, second = hidden
        layers = [
            Layer(observation_size, first, observation_size**-0.5, transposed=True),
            Layer(first, second, first**-0.5),
            Layer(second, action_size, 3e-3),
        ]
        super().__init__(layers, rng)
        self._hidden1, self._back1 = _buffers(2, batch, first)
        self._hidden2, self._back2 = _buffers(2, batch, second)
        self._action, self._back3 = _buffers(2, batch, action_size)

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        """Actions, shape (batch, n_a); the buffer is overwritten by the next call."""
        layer1, layer2, layer3 = self.layers
        layer1.forward(observations, self._hidden1).relu_()
        layer2.forward(self._hidden1, self._hidden2).relu_()
        return layer3.forward(self._hidden2, self._action).tanh_()

    def backward(self, observations: torch.Tensor, d_actions: torch.Tensor) -> None:
        """Fill ``gradient`` after ``forward`` of the same observations.

        Args:
            observations: shape (batch, n_o).
            d_actions: Gradient of the loss with respect to the actions, (batch, n_a).
        """
        layer1, layer2, layer3 = self.layers
        d3 = torch.ops.aten.tanh_backward.grad_input(
            d_actions, self._action, grad_input=self._back3
        )
        layer3.backward(self._hidden2, d3)
        d2 = _through_relu(layer3.d_input(d3, self._back2), self._hidden2)
        layer2.backward(self._hidden1, d2)
        d1 = _through_relu(layer2.d_input(d2, self._back1), self._hidden1)
        layer1.backward(observations, d1)


class Critic(FlatNetwork):
    """Observation and action in [-1, 1] -> value, both entering at the first layer.

    Args:
        observation_size: n_o.
        action_size: n_a.
        hidden: Widths of the two hidden layers.
        batch: Rows per pass.
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
        first, second = hidden
        joined = (observation_size + action_size) ** -0.5
        layers = [
            Layer(observation_size, first, joined, transposed=True),
            Layer(action_size, first, joined, has_bias=False, transposed=True),
            Layer(first, second, first**-0.5),
            Layer(second, 1, 3e-3),
        ]
        super().__init__(layers, rng)
        self._hidden1, self._back1, self._observed = _buffers(3, batch, first)
        self._hidden2, self._back2 = _buffers(2, batch, second)
        (self._value,) = _buffers(1, batch, 1)
        (self._d_action,) = _buffers(1, batch, action_size)

    def forward(self, observations: torch.Tensor, actions: torch.Tensor) -> torch.Tensor:
        """Values, shape (batch, 1); the buffer is overwritten by the next call."""
        self.layers[0].forward(observations, self._observed)
        return self._from_observed(actions)

    def backward(
        self, observations: torch.Tensor, actions: torch.Tensor, d_values: torch.Tensor
    ) -> None:
        """Fill ``gradient`` after ``forward`` of the same rows.

        Args:
            observations: shape (batch, n_o).
            actions: shape (batch, n_a).
            d_values: Gradient of the loss with respect to the values, (batch, 1).
        """
        layer1, action_layer, layer2, layer3 = self.layers
        layer3.backward(self._hidden2, d_values)
        d2 = _through_relu(layer3.d_input(d_values, self._back2), self._hidden2)
        layer2.backward(self._hidden1, d2)
        d1 = _through_relu(layer2.d_input(d2, self._back1), self._hidden1)
        layer1.backward(observations, d1)
        action_layer.backward(actions, d1)

    def d_action(self, actions: torch.Tensor, d_values: torch.Tensor) -> torch.Tensor:
        """Gradient with respect to ``actions`` for the observations of the last ``forward``.

        What that pass made of the observations is reused. The hidden layers are overwritten,
        so a ``backward`` has to come first.

        Args:
            actions: shape (batch, n_a).
            d_values: Gradient of the loss with respect to the values, (batch, 1).

        Returns:
            shape (batch, n_a).
        """
        _, action_layer, layer2, layer3 = self.layers
        self._from_observed(actions)
        d2 = _through_relu(layer3.d_input(d_values, self._back2), self._hidden2)
        d1 = _through_relu(layer2.d_input(d2, self._back1), self._hidden1)
        return action_layer.d_input(d1, self._d_action)

    def _from_observed(self, actions: torch.Tensor) -> torch.Tensor:
        _, action_layer, layer2, layer3 = self.layers
        action_layer.forward(actions, self._hidden1, plus=self._observed).relu_()
        layer2.forward(self._hidden1, self._hidden2).relu_()
        return layer3.forward(self._hidden2, self._value)


def _buffers(count: int, batch: int, width: int) -> torch.Tensor:
    # The batch lies along memory, since a product is fastest if its result's rows in memory
    # are long and a multiple of the vector length: batches usually are, widths like 300 or 6 not.
    return torch.empty(count, width, batch).transpose(1, 2)


def _through_relu(gradient: torch.Tensor, output: torch.Tensor) -> torch.Tensor:
    """Zero the gradient, in place, where the rectifier's output is zero."""
    # Several times faster than multiplying by a boolean mask.
    return torch.ops.aten.threshold_backward.grad_input(gradient, output, 0, grad_input=gradient)
