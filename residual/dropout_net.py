"""DropoutNet: a fully connected network with dropout, trained with AdaGrad."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from sklearn.utils import check_random_state

from residual.dropout_training import Plan, train
from residual.estimator import Array, Estimator

_BLOCK = 4
_CHUNK = 4096
#: Gradient steps of any training: few rows need more than some passes, very many rows fewer.
_FEWEST, _MOST = 600, 8000


class DropoutNet(Estimator):
    """Rectified-linear layers with dropout on each, and a linear output layer.

    Defaults are the paper's: three hidden layers of 400, dropout probability 0.3, AdaGrad. What
    differs, because the error then falls with more data (docs/deviations.md has the numbers): the
    last part of training is without dropout, begins AdaGrad's sums anew and lets its learning
    rate fall to zero.

    The mean prediction uses all units. The standard deviation combines two parts: the spread
    of the outputs over ``samples`` networks with units dropped (Gal and Ghahramani, Dropout as
    a Bayesian approximation, ICML 2016), and noise; the factor of the one and the size of the
    other maximise the likelihood of rows held out from training. Those rows are like the
    training rows, so away from them the intervals rest on the spread growing as the error does.
    The dropped units are drawn once, in ``fit``, so that ``predict`` is a pure function.

    Args:
        hidden: Width of each hidden layer.
        dropout: Probability of dropping a hidden unit, from 0 to below 1.
        epochs: Passes over the training rows; more if they are fewer than 600 gradient steps,
            fewer if they are more than 8000.
        batch_size: Rows per gradient step.
        learning_rate: AdaGrad's; it falls to zero over the last 30 % of training. Chosen for layers
            of 400; narrow ones take 0.01.
        fine_tuning: Share of training, its end, without dropout. With 0 dropout stays on to the
            end: the net then predicts too little, more so the more data there are.
        samples: Networks drawn for the standard deviation; with dropout 0 only noise remains.
        validation_fraction: Rows held out, for the standard deviation.
        paper: Train as the authors did, whatever the settings above but ``hidden`` and
            ``dropout`` say: 300 epochs with batches of 32, AdaGrad of 0.02 that begins its sums
            at 0.1, dropout to the end.
        random_state: Seed of the initial weights, the order of rows and the dropped units.

    Attributes:
        weights_, biases_: One array per layer, shapes (n_in, n_out) and (n_out,), for
            standardised inputs and targets.
        validation_error_: Mean squared error on the held-out rows, standardised, per output.
    """

    _learned: ClassVar[tuple[str, ...]] = (
        "center_", "column_scale_", "weights_", "biases_", "masks_", "spread_factor_", "noise_",
        "validation_error_",
    )  # fmt: skip

    def __init__(
        self,
        hidden: Sequence[int] = (400, 400, 400),
        dropout: float = 0.3,
        epochs: int = 30,
        batch_size: int = 32,
        learning_rate: float = 0.002,
        fine_tuning: float = 0.8,
        samples: int = 30,
        validation_fraction: float = 0.1,
        paper: bool = False,
        random_state: int | None = None,
    ) -> None:
        self.hidden = hidden
        self.dropout = dropout
        self.epochs = epochs
        self.batch_size = batch_size
        self.learning_rate = learning_rate
        self.fine_tuning = fine_tuning
        self.samples = samples
        self.validation_fraction = validation_fraction
        self.paper = paper
        self.random_state = random_state

    def _fit(self, X: Array, y: Array) -> None:
        self._check_params()
        seed = int(check_random_state(self.random_state).randint(2**31 - 1))
        random = np.random.default_rng(seed)
        self.center_, self.column_scale_ = _frame(X)
        inputs = ((X - self.center_) / self.column_scale_).astype(np.float32)
        order = random.permutation(len(X))
        held = max(1, round(self.validation_fraction * len(X)))
        check, rest = order[:held], order[held:]
        plan = self._plan(len(rest))
        self.weights_, self.biases_ = train(inputs[rest], y[rest].astype(np.float32), plan, seed)
        self.masks_ = tuple(
            (random.random((self.samples, width)) >= self.dropout) for width in self.hidden
        )
        error = self._forward(inputs[check]) - y[check]
        self.validation_error_ = np.mean(error**2, axis=0)
        self._calibrate(error, self._spread(inputs[check]))

    def _plan(self, rows: int) -> Plan:
        hidden = tuple(map(int, self.hidden))
        if self.paper:
            # 300 epochs with batches of 32: facts of the authors' code (docs/deviations.md).
            steps = 300 * math.ceil(rows / 32)
            return Plan(hidden, self.dropout, steps, 32, 0.02, 0.1, fine_tuning=0.0, decay=0.0)
        steps = int(self.epochs) * math.ceil(rows / self.batch_size)
        return Plan(
            hidden,
            self.dropout,
            min(max(steps, _FEWEST), _MOST),
            int(self.batch_size),
            self.learning_rate,
            accumulator=0.0,
            fine_tuning=self.fine_tuning,
            decay=0.3,
        )

    def _check_params(self) -> None:
        if not (len(self.hidden) and all(int(width) == width >= 1 for width in self.hidden)):
            raise ValueError(f"hidden={self.hidden!r}: give the width of at least one layer")
        if not 0 <= self.dropout < 1:
            raise ValueError(f"dropout={self.dropout!r}: give a probability from 0 to below 1")
        if not 0 <= self.fine_tuning <= 1:
            raise ValueError(f"fine_tuning={self.fine_tuning!r}: give a share from 0 to 1")
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
        """Choose factor f and noise s so that errors look drawn from N(0, f^2 variance + s^2).

        Among rows like the training rows, noise alone often explains the errors best; the
        spread, which grows away from them, is made to explain half of the squared error at least.
        """
        power = np.maximum(np.mean(error**2, axis=0), 1e-12)
        self.spread_factor_, self.noise_ = np.zeros_like(power), np.sqrt(power)
        for k in range(error.shape[1]):
            best, mean = math.inf, variance[:, k].mean()
            if not mean > 0:
                continue
            for share in np.linspace(0.5, 1, 11):
                # The spread explains this share of the squared error, noise explains the rest.
                factor = share * power[k] / mean
                noise = max(1 - share, 1e-4) * power[k]
                total = factor * variance[:, k] + noise
                surprise = np.sum(np.log(total) + error[:, k] ** 2 / total)
                if surprise < best:
                    best = surprise
                    self.spread_factor_[k], self.noise_[k] = np.sqrt(factor), np.sqrt(noise)

    def _predict(self, X: Array, return_std: bool) -> tuple[Array, Array | None]:
        rows = ((X - self.center_) / self.column_scale_).astype(np.float32)
        mean = self._forward(rows)
        if not return_std:
            return mean, None
        return mean, np.sqrt(self.spread_factor_**2 * self._spread(rows) + self.noise_**2)

    def _forward(self, rows: NDArray[np.float32]) -> Array:
        """Outputs with all units, for standardised rows.

        Products are of blocks of always the same number of rows: BLAS rounds a row alike in any
        of these, but not in products of other sizes. One row takes 50 µs of a processor's time so,
        and 70 µs through torch.nn.
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
        # Chosen units are worth more, so that a layer's mean stays. Shape (samples, 1, width).
        factors = [mask[:, None] * np.float32(1 / (1 - self.dropout)) for mask in self.masks_]
        # One product for all networks: a loop over them would read the weights for each.
        chunk = max(1, _CHUNK // len(factors[0]))
        for start in range(0, len(rows), chunk):
            values = rows[start : start + chunk]
            for weights, biases, factor in zip(
                self.weights_[:-1], self.biases_[:-1], factors, strict=True
            ):
                values = np.maximum(_product(values, weights) + biases, 0) * factor
            variance[start : start + chunk] = _product(values, self.weights_[-1]).var(axis=0)
        return variance


def _product(values: NDArray[np.float32], weights: NDArray[np.float32]) -> NDArray[np.float32]:
    """Matrix product over the last axis, as one product and not one for each leading index."""
    flat = values.reshape(-1, values.shape[-1]) @ weights
    return flat.reshape(*values.shape[:-1], -1)


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
