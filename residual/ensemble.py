"""Ensemble: any regressor several times, and a spread from how much they differ."""

from __future__ import annotations

import inspect
from typing import Any, Self

import numpy as np
from sklearn.base import BaseEstimator, clone
from sklearn.linear_model import BayesianRidge
from sklearn.multioutput import MultiOutputRegressor
from sklearn.utils import check_random_state
from sklearn.utils.metaestimators import available_if

from residual.estimator import Array, Estimator, unset_seeds
from sims.simulator import Simulator


class Ensemble(Estimator):
    """n copies of a regressor that differ by their rows or by their seeds.

    The mean is that of the copies. The variance is that of their means, plus the mean of their own
    variances if the regressor has them (Lakshminarayanan et al., Simple and scalable predictive
    uncertainty estimation using deep ensembles, NIPS 2017), or else plus the mean squared error at
    rows that a copy did not see, less the part of it that the copies' disagreement explains.

    ``NamedEffects`` needs rows in order, which cannot be drawn: give it ``bootstrap=False``; the
    copies then differ by their seeds alone.

    Args:
        regressor: Any scikit-learn regressor, ours included; by default
            ``sklearn.linear_model.BayesianRidge()``. Never changed.
        n: Copies, at least 2.
        bootstrap: Fit every copy to rows drawn with replacement (Breiman, Bagging predictors,
            1996); otherwise to all, and only the seeds differ.
        random_state: Seed of the draws, and of every unset ``random_state`` of the copies.

    Attributes:
        members_: The fitted copies.
        noise_: Standard deviation that the copies leave unexplained, per standardised output; 0
            if they tell their own.
    """

    noise_: Array

    def __init__(
        self,
        regressor: BaseEstimator | None = None,
        n: int = 5,
        bootstrap: bool = True,
        random_state: int | None = None,
    ) -> None:
        self.regressor = regressor
        self.n = n
        self.bootstrap = bootstrap
        self.random_state = random_state

    @available_if(lambda self: hasattr(self.regressor, "for_simulator"))
    def for_simulator(self, simulator: Simulator) -> Self:
        """An unfitted copy whose regressor is configured for this simulator's raw rows."""
        regressor: Any = self.regressor
        return clone(self).set_params(regressor=regressor.for_simulator(simulator))

    def _fit(self, X: Array, y: Array) -> None:
        if not self.n >= 2:
            raise ValueError(f"n={self.n!r}: an ensemble needs at least 2 copies")
        random = check_random_state(self.random_state)
        regressor = BayesianRidge() if self.regressor is None else self.regressor
        members, left_out = [], np.ones((self.n, len(X)), dtype=bool)
        for k in range(self.n):
            rows = random.randint(len(X), size=len(X)) if self.bootstrap else np.arange(len(X))
            if len(np.unique(rows)) < 2:
                rows = np.arange(len(X))
            left_out[k, rows] = False
            members.append(_seeded(regressor, y.shape[1], random).fit(X[rows], y[rows]))
        self.members_ = tuple(members)
        self.noise_ = np.zeros(y.shape[1])
        if not _tells_std(members[0]):
            self.noise_ = self._unexplained(X, y, left_out)

    def _unexplained(self, X: Array, y: Array, left_out: np.ndarray) -> Array:
        """Errors at rows not seen, less the variance of the copies there; at least a tenth."""
        means = self._means(X)
        unseen = left_out if left_out.any() else np.ones_like(left_out)
        errors = np.where(unseen[..., None], (means - y) ** 2, 0.0).sum(axis=(0, 1))
        power = errors / unseen.sum()
        return np.sqrt(np.maximum(power - means.var(axis=0, ddof=1).mean(axis=0), 0.1 * power))

    def _means(self, X: Array) -> Array:
        """What every copy predicts, (n_copies, n, n_out)."""
        width = len(self.target_mean_)
        return np.stack(
            [np.asarray(one.predict(X), float).reshape(len(X), width) for one in self.members_]
        )

    def _predict(self, X: Array, return_std: bool) -> tuple[Array, Array | None]:
        if not return_std:
            return self._means(X).mean(axis=0), None
        if not _tells_std(self.members_[0]):
            means = self._means(X)
            return means.mean(axis=0), np.sqrt(means.var(axis=0, ddof=1) + self.noise_**2)
        pairs = [_with_std(one, X, len(self.target_mean_)) for one in self.members_]
        means, stds = (np.stack(part) for part in zip(*pairs, strict=True))
        variance = means.var(axis=0, ddof=1) + (stds**2).mean(axis=0)
        return means.mean(axis=0), np.sqrt(variance)


def _seeded(regressor: Any, outputs: int, random: np.random.RandomState) -> Any:
    copy = clone(regressor)
    copy.set_params(**{name: int(random.randint(2**31 - 1)) for name in unset_seeds(copy)})
    several = copy.__sklearn_tags__().target_tags.multi_output
    return copy if several else MultiOutputRegressor(copy)


def _tells_std(member: Any) -> bool:
    """Whether a copy predicts its own standard deviation."""
    inner = member.estimator if isinstance(member, MultiOutputRegressor) else member
    return "return_std" in inspect.signature(inner.predict).parameters


def _with_std(member: Any, X: Array, outputs: int) -> tuple[Array, Array]:
    if isinstance(member, MultiOutputRegressor):
        pairs = [part.predict(X, return_std=True) for part in member.estimators_]
        mean, std = (np.stack(columns, axis=1) for columns in zip(*pairs, strict=True))
        return mean, std
    mean, std = member.predict(X, return_std=True)
    return mean.reshape(len(X), outputs), std.reshape(len(X), outputs)
