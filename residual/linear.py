"""Linear: Bayesian ridge regression on raw, quadratic or trigonometric features."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray

from residual.estimator import Array, Estimator, spread
from residual.features import ChannelFeatures, angles_and_scales
from sims.simulator import Simulator

_KINDS = ("raw", "quadratic", "trigonometric")
_MOST_COLUMNS = 1000
_TOO_MANY_COLUMNS = 10_000
_CHUNK = 4096


class Linear(Estimator):
    """Ridge regression on features, with a predictive standard deviation.

    It sees raw columns. ``for_simulator`` fills in which of them are angles and their scales;
    without angles and scales the features are polynomials of standardised columns.

    The posterior of the weights w under y = Phi w + noise, with prior variance s^2 / alpha and
    noise variance s^2, gives mean and standard deviation (Bishop, Pattern Recognition and
    Machine Learning, 2006, section 3.3). By default alpha and s^2 maximise the evidence of the
    training data for each output by itself (section 3.5), so that 40 rows and 10^5 rows both
    get a fitting amount of shrinkage. The deviation accounts for noise and few data, not for
    a true function outside the span of the features.

    Memory grows with the square of the number of features, not with the number of rows.

    Args:
        features: ``"raw"`` (the columns, angles wrapped), ``"quadratic"`` (polynomial of degree
            2 of those) or ``"trigonometric"`` (polynomial of cosine and sine of the angles
            and the other columns).
        degree: Degree of the trigonometric polynomial; None takes the highest of 3, 2 and 1
            that has at most 1000 columns.
        alpha: Ridge penalty |y - Phi w|^2 + alpha |w|^2 on standardised features and targets;
            None chooses it for each output by the evidence.
        angles: Columns of X that are angles, in rad.
        scales: One typical magnitude per column of X; None uses the training data's spread.

    Attributes:
        degree_: Degree of the polynomial in use.
        alpha_: Penalty of each output, shape (n_out,).
        coef_: Weights of the features, shape (n_features, n_out), for standardised targets.
        noise_: Standard deviation s of each output's noise, in units of its spread.
    """

    _learned: ClassVar[tuple[str, ...]] = (
        "degree_", "center_", "column_scale_", "alpha_", "noise_", "coef_", "intercept_",
        "basis_", "feature_mean_", "posterior_", "n_rows_",
    )  # fmt: skip

    def __init__(
        self,
        features: Literal["raw", "quadratic", "trigonometric"] = "trigonometric",
        degree: int | None = None,
        alpha: float | None = None,
        angles: Sequence[int] = (),
        scales: Sequence[float] | None = None,
    ) -> None:
        self.features = features
        self.degree = degree
        self.alpha = alpha
        self.angles = angles
        self.scales = scales

    def for_simulator(self, simulator: Simulator) -> Self:
        """An unfitted copy that knows the angles and scales of [states, actions]."""
        angles, scales = angles_and_scales(simulator.state_channels, simulator.action_channels)
        params = self.get_params() | {"angles": angles, "scales": scales}
        return type(self)(**params)

    def _fit(self, X: Array, y: Array) -> None:
        if self.features not in _KINDS:
            raise ValueError(f"features={self.features!r}: choose one of {', '.join(_KINDS)}")
        if self.degree is not None and (self.degree != int(self.degree) or self.degree < 1):
            raise ValueError(f"degree={self.degree!r}: give a whole number from 1, or None")
        if self.alpha is not None and not self.alpha > 0:
            raise ValueError(f"alpha={self.alpha!r}: give a positive number, or None")
        self.center_ = np.zeros(X.shape[1])
        self.column_scale_ = np.ones(X.shape[1])
        if self.scales is None:
            plain = np.setdiff1d(np.arange(X.shape[1]), np.asarray(self.angles, int))
            self.center_[plain] = X[:, plain].mean(axis=0)
            self.column_scale_[plain] = spread(X)[plain]
        self.n_rows_ = len(X)
        self.degree_ = self._choose_degree(X.shape[1])
        self._prepare()

        mean, scale = self._feature_moments(X)
        gram = np.zeros((len(mean), len(mean)))
        moment = np.zeros((len(mean), y.shape[1]))
        for start in range(0, len(X), _CHUNK):
            phi = (self._features(X[start : start + _CHUNK]) - mean) / scale
            gram += phi.T @ phi
            moment += phi.T @ y[start : start + _CHUNK]
        eigenvalues, vectors = np.linalg.eigh(gram)
        # Below rounding error a direction was not seen: its moment is noise of the arithmetic.
        seen = eigenvalues > len(mean) * np.finfo(float).eps * max(eigenvalues[-1], 1.0)
        eigenvalues = np.where(seen, eigenvalues, 0.0)
        projected = np.where(seen[:, None], vectors.T @ moment, 0.0)

        energy = np.sum(y**2, axis=0)
        self.alpha_, variance = _evidence(eigenvalues, projected, energy, len(X), self.alpha)
        self.noise_ = np.sqrt(variance)
        shrunk = eigenvalues[:, None] + self.alpha_
        self.coef_ = vectors @ (projected / shrunk) / scale[:, None]
        self.intercept_ = -mean @ self.coef_
        self.feature_mean_ = mean
        self.basis_ = vectors / scale[:, None]
        self.posterior_ = 1 / shrunk

    def _predict(self, X: Array, return_std: bool) -> tuple[Array, Array | None]:
        phi = self._features(X)
        # One product per row: BLAS may round a row differently in another batch.
        mean = np.matmul(phi[:, None, :], self.coef_)[:, 0] + self.intercept_
        if not return_std:
            return mean, None
        std = np.empty_like(mean)
        for start in range(0, len(X), _CHUNK):
            rows = slice(start, start + _CHUNK)
            leverage = ((phi[rows] - self.feature_mean_) @ self.basis_) ** 2 @ self.posterior_
            std[rows] = self.noise_ * np.sqrt(1 + 1 / self.n_rows_ + leverage)
        return mean, std

    def _prepare(self) -> None:
        width = len(self.center_)
        self._channels = ChannelFeatures(self.angles, self.scales).fit(np.zeros((1, width)))
        self._table = self._monomials(width, self.degree_)

    def _choose_degree(self, width: int) -> int:
        if self.features != "trigonometric":
            return 1 if self.features == "raw" else 2
        if self.degree is not None:
            return int(self.degree)
        columns = width + len(self.angles)
        fitting = (d for d in (3, 2) if math.comb(columns + d, d) <= _MOST_COLUMNS)
        return next(fitting, 1)

    def _monomials(self, width: int, degree: int) -> NDArray[np.intp]:
        """Columns to multiply for each feature, shape (degree, n_features); 0 stands for one."""
        angles = len(self.angles) if self.features == "trigonometric" else 0
        if degree > 100 or math.comb(width + angles + degree, degree) > _TOO_MANY_COLUMNS:
            raise ValueError(
                f"a polynomial of degree {degree} in {width + angles} columns has more than "
                f"{_TOO_MANY_COLUMNS} features: choose a lower degree"
            )
        sines = range(angles + 1, 2 * angles + 1)
        products = [
            product
            for product in itertools.combinations_with_replacement(
                range(width + angles + 1), degree
            )
            # sin^2 = 1 - cos^2 adds nothing to the span.
            if any(product) and all(product.count(sine) < 2 for sine in sines)
        ]
        return np.array(products, dtype=np.intp).T

    def _features(self, X: Array) -> Array:
        if self.scales is None:
            X = (X - self.center_) / self.column_scale_
        if self.features == "trigonometric":
            columns = self._channels.transform(X)
        else:
            columns = self._channels.wrapped(X)
        padded = np.ones((len(X), columns.shape[1] + 1))
        padded[:, 1:] = columns
        phi = padded.take(self._table[0], axis=1)
        for factor in self._table[1:]:
            phi *= padded.take(factor, axis=1)
        return phi

    def _feature_moments(self, X: Array) -> tuple[Array, Array]:
        chunks = range(0, len(X), _CHUNK)
        mean = sum(self._features(X[k : k + _CHUNK]).sum(axis=0) for k in chunks) / len(X)
        squares = sum(((self._features(X[k : k + _CHUNK]) - mean) ** 2).sum(axis=0) for k in chunks)
        deviation = np.sqrt(squares / len(X))
        return mean, np.where(deviation > 1e-13 * np.maximum(np.abs(mean), 1.0), deviation, 1.0)


def _evidence(
    eigenvalues: Array, projected: Array, energy: Array, rows: int, alpha: float | None
) -> tuple[Array, Array]:
    """Penalty and noise variance of each output that maximise the evidence.

    With y ~ N(0, s^2 (I + Phi Phi^T / alpha)), s^2 has a closed form for given alpha, which
    leaves a search over alpha alone; it is done on a fine logarithmic grid.

    Args:
        eigenvalues: of Phi^T Phi, shape (p,).
        projected: Phi^T y in the eigenbasis, shape (p, n_out).
        energy: y^T y, shape (n_out,).
        rows: Number of rows of Phi.
        alpha: A penalty to use instead, or None.
    """
    grid = rows * 10.0 ** np.linspace(-16, 4, 161) if alpha is None else np.array([alpha])
    # y^T (I + Phi Phi^T / alpha)^-1 y without forming it: y^T y - b^T (Phi^T Phi + alpha)^-1 b.
    explained = (1 / (eigenvalues + grid[:, None])) @ projected**2
    floor = rows * np.finfo(float).eps * energy
    variance = np.maximum(energy - explained, np.maximum(floor, np.finfo(float).tiny)) / rows
    volume = np.log1p(eigenvalues / grid[:, None]).sum(axis=1)
    best = np.argmin(rows * np.log(variance) + volume[:, None], axis=0)
    return grid[best], variance[best, np.arange(len(energy))]
