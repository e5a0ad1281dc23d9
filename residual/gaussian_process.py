"""GaussianProcess: exact up to a number of rows, by inducing points beyond."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cholesky, solve_triangular
from sklearn.utils import check_random_state

from residual.calibration import FEWEST_ROWS, left_out, neighbourhoods, spread_factor
from residual.estimator import Array, Estimator, spread
from residual.kernels import KERNELS, Kernel, best_noise, correlation, covariance
from residual.likelihood import BOUNDS, maximise_likelihood

_CHUNK = 2048
_CANDIDATES = 5000
_KEPT_BYTES = 2**29
# What hyperparameters leave unexplained of other rows, as a share: less is well, more is nothing.
# Errors count up to the size that this part of the rows has anyway: jumps are no reason to choose.
_WELL, _NOTHING, _ORDINARY = 0.1, 0.95, 0.95
_NOISY = 0.3


class GaussianProcess(Estimator):
    """One Gaussian process per output, with a length scale per input.

    Fit in two steps. The length scales, signal variance and noise variance of each output
    maximise the marginal likelihood (gpytorch, L-BFGS) of at most ``hyper_points`` random rows.
    If they do not predict as many other rows well, the likelihood is maximised again with 30 %
    of the variance or more as noise, and the fit that predicts those rows better is taken; an
    output that neither predicts is all noise. (For a target that jumps, as at impacts, the
    likelihood has a second maximum with next to no noise, at length scales so short that the
    process remembers rows and predicts little.) The process is then conditioned, in double
    precision, on

    * all n rows exactly if n <= ``max_points`` (cost n^3 / 3 per output), else
    * ``inducing`` of the rows that summarise all of them (Titsias, Variational learning of
      inducing variables in sparse Gaussian processes, AISTATS 2009; cost n * inducing^2 per
      output), with the noise variance that maximises that paper's bound, so that what the summary
      loses is counted as noise.

    If all rows are kept, the standard deviation is then scaled for each output so that intervals of
    90 % cover 90 % of whole neighbourhoods that are left out (``residual.calibration``). A
    noise variance at its lower bound only keeps matrices well conditioned; it says nothing about
    observations.

    The default crossover of 4000 rows is where the exact factor of one output takes about a
    second and 128 MB. Factors are needed for the standard deviation only; they are kept while
    they take less than 512 MB together and recomputed on each call beyond.

    Args:
        kernel: ``"rbf"`` or ``"matern"`` (smoothness 5/2).
        max_points: Most rows to be conditioned on exactly.
        inducing: Number of inducing points if there are more rows.
        hyper_points: Rows to learn length scales and variances from.
        max_iter: Most iterations of L-BFGS per output.
        calibrate: Scale the standard deviation by neighbourhoods left out.
        random_state: Seed of the choice of rows.

    Attributes:
        lengthscale_: shape (n_out, n_in), in units of the spread of each input.
        outputscale_: Signal variance, shape (n_out,), in units of each target's variance.
        noise_: Noise variance, shape (n_out,), in the same unit.
        spread_factor_: Factor of the noise-free standard deviation, shape (n_out,).
        points_: The rows or inducing points conditioned on, standardised, shape (m, n_in).
        exact_: Whether ``points_`` are all rows.
        n_iter_: Iterations of L-BFGS for each output, shape (n_out,).
    """

    _learned: ClassVar[tuple[str, ...]] = (
        "center_", "column_scale_", "lengthscale_", "outputscale_", "noise_", "points_",
        "weights_", "exact_", "factors_", "spread_factor_", "n_iter_",
    )  # fmt: skip

    def __init__(
        self,
        kernel: Kernel = "rbf",
        max_points: int = 4000,
        inducing: int = 600,
        hyper_points: int = 600,
        max_iter: int = 60,
        calibrate: bool = True,
        random_state: int | None = None,
    ) -> None:
        self.kernel = kernel
        self.max_points = max_points
        self.inducing = inducing
        self.hyper_points = hyper_points
        self.max_iter = max_iter
        self.calibrate = calibrate
        self.random_state = random_state

    def _fit(self, X: Array, y: Array) -> None:
        if self.kernel not in KERNELS:
            raise ValueError(f"kernel={self.kernel!r}: choose one of {', '.join(KERNELS)}")
        for name in ("max_points", "inducing", "hyper_points", "max_iter"):
            if not getattr(self, name) >= 1:
                raise ValueError(f"{name}={getattr(self, name)!r}: give a whole number from 1")
        random = check_random_state(self.random_state)
        self.center_, self.column_scale_ = X.mean(axis=0), spread(X)
        X = (X - self.center_) / self.column_scale_
        rows = random.permutation(len(X))[: 2 * self.hyper_points]
        some, others = rows[: self.hyper_points], rows[self.hyper_points :]
        found = [
            self._hyperparameters(X[some], column[some], X[others], column[others])
            for column in y.T
        ]
        self.lengthscale_ = np.array([part[0] for part in found])
        self.outputscale_ = np.array([part[1] for part in found])
        self.noise_ = np.array([part[2] for part in found])
        self.n_iter_ = np.array([part[3] for part in found])
        self.exact_ = len(X) <= self.max_points
        self.spread_factor_ = np.ones(y.shape[1])
        if self.exact_:
            self.points_ = X
            self.factors_ = np.zeros((0, 0, 0))
            self._condition(y)
            if self.calibrate and len(X) >= FEWEST_ROWS:
                self._calibrate(random)
        else:
            self.points_ = X[self._choose(X, random)]
            self._summarise(X, y)

    def _hyperparameters(
        self, X: Array, y: Array, other_X: Array, other_y: Array
    ) -> tuple[Array, float, float, int]:
        """Length scales, signal and noise variance, and iterations, of one output."""
        found = maximise_likelihood(X, y, self.kernel, self.max_iter)
        if len(other_y) < FEWEST_ROWS:
            return found

        away = (other_y - other_y.mean()) ** 2
        most = np.quantile(away, _ORDINARY)

        def unexplained(lengthscale: Array, outputscale: float, noise: float, _: int) -> float:
            matrix = covariance(X, X, lengthscale, outputscale, self.kernel)
            matrix[np.diag_indices(len(X))] += noise
            weights = np.linalg.solve(matrix, y)
            cross = covariance(other_X, X, lengthscale, outputscale, self.kernel)
            errors = other_y - cross @ weights
            return float(np.minimum(errors**2, most).sum() / max(away.clip(max=most).sum(), 1e-300))

        share = unexplained(*found)
        if share < _WELL:
            return found
        noisy = maximise_likelihood(X, y, self.kernel, self.max_iter, _NOISY)
        noisy_share = unexplained(*noisy)
        iterations = found[3] + noisy[3]
        if min(share, noisy_share) > _NOTHING:
            return np.ones(X.shape[1]), BOUNDS["outputscale"][0], 1.0, iterations
        better = noisy if noisy_share < share else found
        return (*better[:3], iterations)

    def _condition(self, y: Array) -> None:
        self._kept: dict[int, Array] = {}
        self.weights_ = np.empty((y.shape[1], len(y)))
        for k in range(y.shape[1]):
            factor = self._factor(k)
            half = solve_triangular(factor, y[:, k], lower=True, check_finite=False)
            self.weights_[k] = solve_triangular(
                factor, half, lower=True, trans="T", check_finite=False
            )

    def _calibrate(self, random: np.random.RandomState) -> None:
        folds = neighbourhoods(self._in_length_scales(self.points_), random)
        for k, weights in enumerate(self.weights_):
            errors, variances = left_out(self._factor(k), weights, folds)
            latent = np.maximum(variances - self.noise_[k], 0.0)
            at_bound = self.noise_[k] <= 2 * BOUNDS["noise"][0]
            noise = self.noise_[k] * (0.01 if at_bound else 1.0)
            self.spread_factor_[k] = spread_factor(errors, latent, noise)

    def _factor(self, k: int) -> Array:
        """Lower Cholesky factor of output k's kernel matrix of the points (exact: plus noise)."""
        if k in self._kept:
            return self._kept[k]
        matrix = self._kernel(self.points_, self.points_, k)
        # Inducing points lie closer together than their summary needs: a nugget of its own.
        nugget = self.noise_[k] if self.exact_ else 1e-12 * self.outputscale_[k]
        while True:
            try:
                np.fill_diagonal(matrix, self.outputscale_[k] + nugget)
                factor = cholesky(matrix, lower=True, check_finite=False)
                break
            except LinAlgError:
                nugget *= 10
        if (len(self._kept) + 1) * factor.nbytes <= _KEPT_BYTES:
            self._kept[k] = factor
        return factor

    def _choose(self, X: Array, random: np.random.RandomState) -> NDArray[np.intp]:
        """Spread-out rows: each the farthest, in mean length scales, from those before it."""
        some = random.permutation(len(X))[: max(_CANDIDATES, 2 * self.inducing)]
        scaled = self._in_length_scales(X[some])
        chosen, distance = [0], np.full(len(some), np.inf)
        for _ in range(min(self.inducing, len(some)) - 1):
            offset = scaled - scaled[chosen[-1]]
            np.minimum(distance, np.einsum("ij,ij->i", offset, offset), out=distance)
            chosen.append(int(np.argmax(distance)))
        return some[chosen]

    def _in_length_scales(self, X: Array) -> Array:
        """Rows in units of the length scales' geometric mean over outputs."""
        return X / np.exp(np.log(self.lengthscale_).mean(axis=0))

    def _summarise(self, X: Array, y: Array) -> None:
        self._kept = {}
        outputs, m = y.shape[1], len(self.points_)
        self.weights_ = np.empty((outputs, m))
        self.factors_ = np.empty((outputs, m, m))
        for k in range(outputs):
            factor = self._factor(k)
            gram, moment = np.zeros((m, m)), np.zeros(m)
            for start in range(0, len(X), _CHUNK):
                rows = slice(start, start + _CHUNK)
                cross = self._kernel(self.points_, X[rows], k)
                cross = solve_triangular(factor, cross, lower=True, check_finite=False)
                gram += cross @ cross.T
                moment += cross @ y[rows, k]
            lost = max(len(X) * self.outputscale_[k] - np.trace(gram), 0.0)
            self.noise_[k] = best_noise(gram, moment, float(y[:, k] @ y[:, k]), lost, len(X))
            gram[np.diag_indices(m)] += self.noise_[k]
            inner = cholesky(gram, lower=True, check_finite=False)
            half = solve_triangular(inner, moment, lower=True, check_finite=False)
            half = solve_triangular(inner, half, lower=True, trans="T", check_finite=False)
            self.weights_[k] = solve_triangular(
                factor, half, lower=True, trans="T", check_finite=False
            )
            self.factors_[k] = inner

    def _kernel(self, a: Array, b: Array, k: int) -> Array:
        """Covariances of output k between rows a and rows b, shape (len(a), len(b))."""
        return covariance(a, b, self.lengthscale_[k], self.outputscale_[k], self.kernel)

    def _prepare(self) -> None:
        if "_kept" not in self.__dict__:
            self._kept = {}
        shape, points = (len(self.outputscale_), len(self.center_)), len(self.points_)
        if self.lengthscale_.shape != shape or self.weights_.shape != (shape[0], points):
            raise ValueError("lengthscales, weights and points do not fit together")
        # Of others no kernel matrix has a Cholesky factor, whatever is added to it.
        if min(part.min() for part in (self.noise_, self.outputscale_, self.lengthscale_)) <= 0:
            raise ValueError("noise, output scales and length scales have to be positive")
        inverse = 1 / self.lengthscale_**2
        # |x - p|^2 = x.x + p.p - 2 x.p for the points p of all outputs in one product.
        self._doubled = -2 * (self.points_[None] * inverse[:, None]).reshape(-1, len(self.center_))
        self._squares = np.sum(self.points_**2 * inverse[:, None], axis=2)
        self._inverse = inverse
        self._scaled_weights = self.weights_ * self.outputscale_[:, None]

    def _predict(self, X: Array, return_std: bool) -> tuple[Array, Array | None]:
        X = (X - self.center_) / self.column_scale_
        mean = np.empty((len(X), len(self.outputscale_)))
        # Row by row: it stays in the cache, and no row depends on which others are in the batch.
        for k, row in enumerate(X):
            squared = (self._doubled @ row).reshape(self._squares.shape)
            squared += self._squares
            squared += (self._inverse @ (row * row))[:, None]
            mean[k] = np.einsum("ij,ij->i", correlation(squared, self.kernel), self._scaled_weights)
        return mean, self._std(X) if return_std else None

    def _std(self, X: Array) -> Array:
        variance = np.empty((len(X), len(self.outputscale_)))
        for k in range(variance.shape[1]):
            factor = self._factor(k)
            for start in range(0, len(X), _CHUNK):
                rows = slice(start, start + _CHUNK)
                cross = self._kernel(self.points_, X[rows], k)
                cross = solve_triangular(factor, cross, lower=True, check_finite=False)
                variance[rows, k] = self.outputscale_[k] - np.sum(cross**2, axis=0)
                if not self.exact_:
                    inner = solve_triangular(
                        self.factors_[k], cross, lower=True, check_finite=False
                    )
                    variance[rows, k] += self.noise_[k] * np.sum(inner**2, axis=0)
        variance = np.maximum(variance, 0) * self.spread_factor_**2
        return np.sqrt(variance + self.noise_)
