"""Training of a network with dropout: AdaGrad on torch.nn, and how it is planned."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import torch

Rows = NDArray[np.float32]


@dataclasses.dataclass(frozen=True)
class Plan:
    """How a network is trained.

    Args:
        hidden: Width of each hidden layer.
        dropout: Probability of dropping a hidden unit.
        steps: Gradient steps.
        batch_size: Rows per step.
        learning_rate: AdaGrad's, until ``decay`` begins.
        accumulator: What AdaGrad's sums of squared gradients begin with.
        fine_tuning: Share of the steps, the last ones, that are trained without dropout and with
            AdaGrad's sums begun anew.
        decay: Share of the steps, the last ones, over which the learning rate falls to zero.
    """

    hidden: tuple[int, ...]
    dropout: float
    steps: int
    batch_size: int
    learning_rate: float
    accumulator: float
    fine_tuning: float
    decay: float


def train(X: Rows, y: Rows, plan: Plan, seed: int) -> tuple[tuple[Rows, ...], tuple[Rows, ...]]:
    """Minimise the mean squared error.

    Args:
        X, y: Rows of order one, shapes (n, n_in) and (n, n_out).
        plan: How.
        seed: Of the initial weights, the order of rows and the dropped units; the process's own
            random state stays as it was.

    Returns:
        Weights (n_in, n_out) and biases (n_out,) of every layer.
    """
    import torch

    inputs, targets = torch.from_numpy(X), torch.from_numpy(y)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        net = _network((X.shape[1], *plan.hidden, y.shape[1]), plan.dropout)
        optimiser = _adagrad(net, plan)
        begin = plan.steps - round(plan.fine_tuning * plan.steps)
        for step, batch in enumerate(_batches(len(X), plan)):
            if step == begin and plan.dropout:
                # Gradients under dropout are large; AdaGrad would divide by them to the end.
                net.eval()
                optimiser = _adagrad(net, plan)
            left = (plan.steps - step) / max(1.0, plan.decay * plan.steps)
            optimiser.param_groups[0]["lr"] = plan.learning_rate * min(1.0, left)
            optimiser.zero_grad()
            loss = torch.nn.functional.mse_loss(net(inputs[batch]), targets[batch])
            loss.backward()
            optimiser.step()
    layers = [layer for layer in net if isinstance(layer, torch.nn.Linear)]
    return (
        tuple(layer.weight.detach().numpy().T.copy() for layer in layers),
        tuple(layer.bias.detach().numpy().copy() for layer in layers),
    )


def _network(sizes: Sequence[int], dropout: float) -> torch.nn.Sequential:
    from torch import nn

    layers: list[nn.Module] = []
    for width, following in itertools.pairwise(sizes[:-1]):
        layers += [nn.Linear(width, following), nn.ReLU(), nn.Dropout(dropout)]
    return nn.Sequential(*layers, nn.Linear(sizes[-2], sizes[-1]))


def _adagrad(net: torch.nn.Module, plan: Plan) -> torch.optim.Adagrad:
    import torch

    return torch.optim.Adagrad(
        net.parameters(),
        plan.learning_rate,
        initial_accumulator_value=plan.accumulator,
        fused=True,
    )


def _batches(n: int, plan: Plan) -> Iterator[torch.Tensor]:
    """As many batches of row numbers as there are steps, all rows once before any comes again."""
    import torch

    passes = (torch.randperm(n).split(plan.batch_size) for _ in itertools.count())
    return itertools.islice(itertools.chain.from_iterable(passes), plan.steps)
