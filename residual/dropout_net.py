"""DropoutNet: a fully connected network with dropout, trained with AdaGrad."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray
from sklearn.utils import check_random_state

from residual.estimator import Array, Estimator

if TYPE_CHECKING:
    import torch

_BLOCK = 4
_AVERAGING = 8
_CHUNK = 4096


class DropoutNet(Estimator):
    """Rectified-linear layers with dropout on each, and a linear output layer.

    Defaults are the paper's: three hidden layers of 400, dropout probability 0.3, AdaGrad. What
    differs, because it lowers the error at equal time (docs/deviations.md): inputs and targets
    are standardised, and the weights returned are a running average over the last part
    of training, which removes most of the noise that dropout leaves in the last iterate.

    The mean prediction uses all units. The standard deviation combines two parts: the spread
    of the outputs over ``samples`` networks with units dropped (Gal and Ghahramani, Dropout as
    a Bayesian approximation, ICML 2016), and noise; the factor of the one and the size of the
    other maximise the likelihood of rows held out from training. The dropped units are drawn
    once, in ``fit``, so that ``predict`` is a pure function of its rows.

    Args:
        hidden: Width of each hidden layer.
        dropout: Probability of dropping a hidden unit, from 0 to below 1.
        epochs: Passes over the training rows.
        batch_size: Rows per gradient step.
        learning_rate: AdaGrad's.
        samples: Networks drawn for the standard deviation; with dropout 0 only noise remains.
        validation_fraction: Rows held out, for the standard deviation and for stopping.
        patience: Stop after so many epochs without a lower error on the held-out rows, and
            return the best weights seen; None always trains for ``epochs``.
        random_state: Seed of the initial weights, the order of rows and the dropped units.

    Attributes:
        weights_, biases_: One array per layer, shapes (n_in, n_out) and (n_out,), for
            standardised inputs and targets.
        epochs_: Epochs trained.
        validation_error_: Mean squared error on the held-out rows, standardised, per output.
    """

    _learned: ClassVar[tuple[str, ...]] = (
        "center_", "column_scale_", "weights_", "biases_", "masks_", "spread_factor_", "noise_",
        "epochs_", "validation_error_",
    )  # fmt: skip

    def __init__(
        self,
        hidden: Sequence[int] = (400, 400, 400),
        dropout: float = 0.3,
        epochs: int = 30,
        batch_size: int = 256,
        learning_rate: float = 0.01,
        samples: int = 30,
        validation_fraction: float = 0.1,
        patience: int | None = None,
        random_state: int | np.random.RandomState | None = None,
    ) -> None:
        self.hidden = hidden
        self.dropout = dropout
        self.epochs = epochs
        self.batch_size = batch_size
        self.learning_rate = learning_rate
        self.samples = samples
        self.validation_fraction = validation_fraction
        self.patience = patience
        self.random_state = random_state

    def _fit(self, X: Array, y: Array) -> None:
        self._check_params()
        seed = int(check_random_state(self.random_state).randint(2**31 - 1))
        random = np.random.Generator(np.random.SFC64(seed))
        self.center_, self.column_scale_ = _frame(X)
        inputs = ((X - self.center_) / self.column_scale_).astype(np.float32)
        targets = y.astype(np.float32)
        order = random.permutation(len(X))
        held = max(1, round(self.validation_fraction * len(X)))
        check, train = order[:held], order[held:]
        weights, biases, self.epochs_ = _train(
            inputs[train], targets[train], inputs[check], targets[check], self, random
        )
        self.weights_, self.biases_ = tuple(weights), tuple(biases)
        self.masks_ = tuple(
            (random.random((self.samples, width)) >= self.dropout) for width in self.hidden
        )
        self._prepare()
        error = self._forward(inputs[check]) - y[check]
        self.validation_error_ = np.mean(error**2, axis=0)
        self._calibrate(error, self._spread(inputs[check]))

    def _check_params(self) -> None:
        if not (len(self.hidden) and all(int(width) == width >= 1 for width in self.hidden)):
            raise ValueError(f"hidden={self.hidden!r}: give the width of at least one layer")
        if not 0 <= self.dropout < 1:
            raise ValueError(f"dropout={self.dropout!r}: give a probability from 0 to below 1")
        if not 0 < self.validation_fraction < 1:
            raise ValueError(
                f"validation_fraction={self.validation_fraction!r}: give a fraction between 0 and 1"
            )
        for name in ("epochs", "batch_size", "samples"):
            if not getattr(self, name) >= 1:
                raise ValueError(f"{name}={getattr(self, name)!r}: give a whole number from 1")
        if not self.learning_rate > 0:
            raise ValueError(f"learning_rate={self.learning_rate!r}: give a positive number")

    def _calibrate(self, error: Array, variance: Array) -> None:
        """Choose factor f and noise s so that errors look drawn from N(0, f^2 variance + s^2)."""
        power = np.maximum(np.mean(error**2, axis=0), 1e-12)
        self.spread_factor_, self.noise_ = np.zeros_like(power), np.sqrt(power)
        for k in range(error.shape[1]):
            best = math.inf
            for share in np.linspace(0, 1, 21):
                # The spread explains this share of the squared error, noise explains the rest.
                mean = variance[:, k].mean()
                factor = share * power[k] / mean if mean > 0 else 0.0
                total = factor * variance[:, k] + max(1 - share, 1e-4) * power[k]
                surprise = np.sum(np.log(total) + error[:, k] ** 2 / total)
                if surprise < best:
                    best = surprise
                    self.spread_factor_[k] = np.sqrt(factor)
                    self.noise_[k] = np.sqrt(max(1 - share, 1e-4) * power[k])

    def _predict(self, X: Array, return_std: bool) -> tuple[Array, Array | None]:
        rows = ((X - self.center_) / self.column_scale_).astype(np.float32)
        mean = self._forward(rows)
        if not return_std:
            return mean, None
        return mean, np.sqrt(self.spread_factor_**2 * self._spread(rows) + self.noise_**2)

    def _forward(self, rows: NDArray[np.float32]) -> Array:
        """Outputs with all units, for standardised rows.

        Products are of blocks of always the same number of rows: BLAS rounds a row alike in any
        of these, but not in products of other sizes.
        """
        padded = np.zeros((-(-len(rows) // _BLOCK) * _BLOCK, rows.shape[1]), np.float32)
        padded[: len(rows)] = rows
        values = padded.reshape(-1, _BLOCK, rows.shape[1])
        for weights, biases in zip(self.weights_[:-1], self.biases_[:-1], strict=True):
            values = values @ weights
            values += biases
            np.maximum(values, 0, out=values)
        values = values @ self.weights_[-1] + self.biases_[-1]
        return values.reshape(len(padded), -1)[: len(rows)].astype(float)

    def _spread(self, rows: NDArray[np.float32]) -> Array:
        """Variance of the outputs over the networks with units dropped, shape (n, n_out)."""
        variance = np.zeros((len(rows), self.weights_[-1].shape[1]))
        if not self.dropout:
            return variance
        keep = np.float32(1 / (1 - self.dropout))
        for start in range(0, len(rows), _CHUNK):
            part = rows[start : start + _CHUNK]
            outputs = []
            for sample in range(self.samples):
                values = part
                layers = zip(self.weights_[:-1], self.biases_[:-1], self.masks_, strict=True)
                for weights, biases, masks in layers:
                    values = np.maximum(values @ weights + biases, 0) * (masks[sample] * keep)
                outputs.append(values @ self.weights_[-1])
            variance[start : start + _CHUNK] = np.var(outputs, axis=0)
        return variance


def _frame(X: Array) -> tuple[Array, Array]:
    """Centre and scale that bring every column into [-1, 1].

    A column with both signs keeps its zero. Centring on the mean and dividing by the standard
    deviation instead stretches the cosine of an angle that the data saw a part of, and then the
    network extrapolates worse to the other part.
    """
    low, high = X.min(axis=0), X.max(axis=0)
    center = np.where((low <= 0) & (high >= 0), 0.0, (low + high) / 2)
    reach = np.maximum(high - center, center - low)
    return center, np.where(reach > 1e-13 * np.abs(center), reach, 1.0)


def _train(
    X: NDArray[np.float32],
    y: NDArray[np.float32],
    check_X: NDArray[np.float32],
    check_y: NDArray[np.float32],
    net: DropoutNet,
    random: np.random.Generator,
) -> tuple[list[NDArray[np.float32]], list[NDArray[np.float32]], int]:
    """Minimise the mean squared error; returns weights, biases and the number of epochs.

    Forward and backward pass are written out, on one flat vector of parameters: at this size a
    step through autograd and an optimiser takes twice as long.
    """
    import torch

    sizes = [X.shape[1], *map(int, net.hidden), y.shape[1]]
    hidden = len(sizes) - 2
    flat = torch.empty(sum((a + 1) * b for a, b in zip(sizes[:-1], sizes[1:], strict=True)))
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
    batch = min(net.batch_size, len(X))
    steps = len(X) // batch
    rows, wanted = torch.empty(batch, sizes[0]), torch.empty(batch, sizes[-1])
    units = [torch.empty(batch, width) for width in sizes[1:-1]]
    deltas = [torch.empty_like(unit) for unit in units]
    masks = [torch.empty_like(unit) for unit in units]
    output = torch.empty(batch, sizes[-1])
    uniform = np.empty((batch, sum(sizes[1:-1])), np.float32)
    draws = torch.from_numpy(uniform).split(sizes[1:-1], dim=1)
    keep = 1 / (1 - net.dropout)

    step, best, stale = 0, math.inf, 0
    kept = average
    for epoch in range(1, net.epochs + 1):
        order = torch.from_numpy(random.permutation(len(X)))
        for first in range(0, steps * batch, batch):
            chosen = order[first : first + batch]
            torch.index_select(inputs, 0, chosen, out=rows)
            torch.index_select(targets, 0, chosen, out=wanted)
            values = rows
            if net.dropout:
                random.random(dtype=np.float32, out=uniform)
            for layer, unit in enumerate(units):
                torch.addmm(biases[layer], values, weights[layer], out=unit)
                unit.relu_()
                if net.dropout:
                    torch.ge(draws[layer], net.dropout, out=masks[layer])
                    unit.mul_(masks[layer]).mul_(keep)
                values = unit
            torch.addmm(biases[-1], values, weights[-1], out=output)
            delta = output.sub_(wanted).mul_(2 / output.numel())
            for layer in range(hidden, -1, -1):
                below = units[layer - 1] if layer else rows
                torch.mm(below.t(), delta, out=weight_gradients[layer])
                torch.sum(delta, 0, out=bias_gradients[layer])
                if layer:
                    torch.mm(delta, weights[layer].t(), out=deltas[layer - 1])
                    # A dropped unit is zero, as one that rectification cut: neither passes.
                    delta = deltas[layer - 1].mul_(below > 0)
                    if net.dropout:
                        delta.mul_(keep)
            squares.addcmul_(gradient, gradient)
            torch.sqrt(squares, out=root)
            flat.addcdiv_(gradient, root.add_(1e-10), value=-net.learning_rate)
            step += 1
            average.lerp_(flat, (_AVERAGING + 1) / (step + _AVERAGING))
        if net.patience is not None:
            error = _validation_error(average, sizes, check_X, check_y)
            if error < best:
                best, stale, kept = error, 0, average.clone()
            else:
                stale += 1
            if stale >= net.patience:
                break
    weights, biases = _layers(kept, sizes)
    copy = [[part.numpy().copy() for part in parts] for parts in (weights, biases)]
    return copy[0], copy[1], epoch


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


def _layers(
    flat: torch.Tensor, sizes: list[int]
) -> tuple[list[torch.Tensor], list[torch.Tensor]]:
    """Views of the weights and biases of every layer in one flat vector."""
    weights, biases, start = [], [], 0
    for width, following in zip(sizes[:-1], sizes[1:], strict=True):
        weights.append(flat[start : start + width * following].view(width, following))
        start += width * following
        biases.append(flat[start : start + following])
        start += following
    return weights, biases
