"""Training of a network with dropout: AdaGrad, with the weights averaged over the last part."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import torch

_AVERAGING = 8


def train(
    X: NDArray[np.float32],
    y: NDArray[np.float32],
    check_X: NDArray[np.float32],
    check_y: NDArray[np.float32],
    random: np.random.Generator,
    *,
    hidden: tuple[int, ...],
    dropout: float,
    epochs: int,
    batch_size: int,
    learning_rate: float,
    patience: int | None,
) -> tuple[list[NDArray[np.float32]], list[NDArray[np.float32]], int]:
    """Minimise the mean squared error by AdaGrad, with dropout on the hidden layers.

    The weights returned are a running average of the iterates that forgets the first of them:
    with t steps done, iterate k counts about as (k / t)^8 (Shamir and Zhang, Stochastic gradient
    descent for non-smooth optimization, ICML 2013, section 4), so that it needs no plan of when
    training ends.

    Forward and backward pass are written out, on one flat vector of parameters: at this size a
    step through autograd and an optimiser takes longer.

    Args:
        X, y: Training rows, shapes (n, n_in) and (n, n_out), of order one.
        check_X, check_y: Rows to judge an epoch by if there is a ``patience``.
        random: Draws initial weights, the order of rows and dropped units.
        hidden, dropout, epochs, batch_size, learning_rate, patience: See ``DropoutNet``.

    Returns:
        Weights and biases of every layer, and the number of epochs trained.
    """
    import torch

    sizes = [X.shape[1], *hidden, y.shape[1]]
    flat = torch.empty(sum((a + 1) * b for a, b in itertools.pairwise(sizes)))
    weights, biases = _layers(flat, sizes)
    for weight, bias in zip(weights, biases, strict=True):
        limit = len(weight) ** -0.5
        for target in (weight, bias):
            start = random.uniform(-limit, limit, target.shape).astype(np.float32)
            target.copy_(torch.from_numpy(start))
    gradient, squares = torch.zeros_like(flat), torch.zeros_like(flat)
    root, average = torch.empty_like(flat), flat.clone()
    weight_gradients, bias_gradients = _layers(gradient, sizes)

    inputs, targets = torch.from_numpy(X), torch.from_numpy(y)
    batch = min(batch_size, len(X))
    steps = len(X) // batch
    rows, wanted = torch.empty(batch, sizes[0]), torch.empty(batch, sizes[-1])
    units = [torch.empty(batch, width) for width in sizes[1:-1]]
    deltas = [torch.empty_like(unit) for unit in units]
    masks = [torch.empty_like(unit) for unit in units]
    output = torch.empty(batch, sizes[-1])
    uniform = np.empty((batch, sum(sizes[1:-1])), np.float32)
    draws = torch.from_numpy(uniform).split(sizes[1:-1], dim=1)
    keep = 1 / (1 - dropout)

    step, trained, best, stale = 0, 0, math.inf, 0
    kept = average
    for _ in range(epochs):
        order = torch.from_numpy(random.permutation(len(X)))
        for first in range(0, steps * batch, batch):
            chosen = order[first : first + batch]
            torch.index_select(inputs, 0, chosen, out=rows)
            torch.index_select(targets, 0, chosen, out=wanted)
            values = rows
            if dropout:
                random.random(dtype=np.float32, out=uniform)
            for layer, unit in enumerate(units):
                torch.addmm(biases[layer], values, weights[layer], out=unit)
                unit.relu_()
                if dropout:
                    torch.ge(draws[layer], dropout, out=masks[layer])
                    unit.mul_(masks[layer]).mul_(keep)
                values = unit
            torch.addmm(biases[-1], values, weights[-1], out=output)
            delta = output.sub_(wanted).mul_(2 / output.numel())
            for layer in reversed(range(len(weights))):
                below = units[layer - 1] if layer else rows
                torch.mm(below.t(), delta, out=weight_gradients[layer])
                torch.sum(delta, 0, out=bias_gradients[layer])
                if layer:
                    torch.mm(delta, weights[layer].t(), out=deltas[layer - 1])
                    # A dropped unit is zero, as one that rectification cut: neither passes.
                    delta = deltas[layer - 1].mul_(below > 0)
                    if dropout:
                        delta.mul_(keep)
            squares.addcmul_(gradient, gradient)
            torch.sqrt(squares, out=root)
            flat.addcdiv_(gradient, root.add_(1e-10), value=-learning_rate)
            step += 1
            average.lerp_(flat, (_AVERAGING + 1) / (step + _AVERAGING))
        trained += 1
        if patience is not None:
            error = _validation_error(average, sizes, check_X, check_y)
            if error < best:
                best, stale, kept = error, 0, average.clone()
            else:
                stale += 1
            if stale >= patience:
                break
    weights, biases = _layers(kept, sizes)
    copy = [[part.numpy().copy() for part in parts] for parts in (weights, biases)]
    return copy[0], copy[1], trained


def _validation_error(
    flat: torch.Tensor, sizes: list[int], X: NDArray[np.float32], y: NDArray[np.float32]
) -> float:
    import torch

    values = torch.from_numpy(X)
    weights, biases = _layers(flat, sizes)
    for weight, bias in zip(weights[:-1], biases[:-1], strict=True):
        values = torch.addmm(bias, values, weight).relu_()
    error = torch.addmm(biases[-1], values, weights[-1]) - torch.from_numpy(y)
    return float(error.square().mean())


def _layers(flat: torch.Tensor, sizes: list[int]) -> tuple[list[torch.Tensor], list[torch.Tensor]]:
    """Views of the weights and biases of every layer in one flat vector."""
    weights, biases, start = [], [], 0
    for width, following in itertools.pairwise(sizes):
        weights.append(flat[start : start + width * following].view(width, following))
        start += width * following
        biases.append(flat[start : start + following])
        start += following
    return weights, biases
