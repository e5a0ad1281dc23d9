"""The estimator contract: scikit-learn's, standardised targets, no number that is not finite."""

from __future__ import annotations

import abc
import warnings
from typing import Any, ClassVar, Literal, Protocol, Self, overload, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, MultiOutputMixin, RegressorMixin, clone
from sklearn.utils import get_tags
from sklearn.utils.validation import check_is_fitted, validate_data

from sims.simulator import Simulator

Array = NDArray[np.float64]
# Of a plane that a regressor is asked to learn before anything else.
_ROWS = 32


@runtime_checkable
class ForSimulator(Protocol):
    """An estimator that wants raw rows of a simulator rather than features."""

    def for_simulator(self, simulator: Simulator) -> Any:
        """An unfitted copy for this simulator."""
        ...


def check_regressor(estimator: object, simulator: Simulator | None = None) -> None:
    """Refuse what cannot learn a difference, before anything is computed for it.

    Args:
        estimator: Of any library.
        simulator: Whose difference it is to learn.

    Raises:
        ValueError: It says of itself that it is no regressor, has no ``fit`` or ``predict``,
            predicts other shapes than it learnt, or values that are not finite, or cannot learn
            the difference of this simulator.
    """
    name = type(estimator).__name__
    if not callable(getattr(estimator, "fit", None)):
        raise ValueError(
            f"estimator is {name}, which has no method fit(X, y); expected a scikit-learn "
            "regressor, such as residual.GaussianProcess"
        )
    kind = get_tags(estimator).estimator_type if isinstance(estimator, BaseEstimator) else None
    if kind not in (None, "regressor") or not callable(getattr(estimator, "predict", None)):
        what = (kind or "it has no predict").replace("_", " ")
        raise ValueError(
            f"estimator is {name}, which is no regressor ({what}); expected one, such as "
            "residual.GaussianProcess or sklearn.ensemble.ExtraTreesRegressor"
        )
    if simulator is not None and isinstance(estimator, ForSimulator):
        estimator.for_simulator(simulator)
    if not isinstance(estimator, Estimator):
        _refuse_predictions(estimator)


def _refuse_predictions(estimator: Any) -> None:
    """Refuse a regressor that predicts something else than it was asked, once it has learnt a
    plane from few rows; one that cannot learn that from so few is judged by its own data."""
    name = type(estimator).__name__
    if hasattr(estimator, "_parameter_constraints"):
        try:
            estimator._validate_params()
        except ValueError as error:  # scikit-learn says which one, and what it takes
            raise ValueError(f"estimator {name}: {error}") from None
    X = np.random.default_rng(0).normal(size=(_ROWS, 4))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = np.asarray(clone(estimator, safe=False).fit(X, X.sum(axis=1)).predict(X))
    except Exception:
        return
    if found.size != _ROWS or len(found) != _ROWS:
        raise ValueError(
            f"estimator {name} predicts shape {found.shape} for {_ROWS} rows of one output, "
            f"expected ({_ROWS},)"
        )
    if not np.isfinite(found.astype(float)).all():
        raise ValueError(f"estimator {name} predicts {found[~np.isfinite(found)][0]} after fit")


def unset_seeds(estimator: BaseEstimator) -> list[str]:
    """Every ``random_state`` that nobody has set, of it and of what is inside, in order."""
    return [
        name
        for name, value in sorted(estimator.get_params().items())
        if name.split("__")[-1] == "random_state" and value is None
    ]


class Estimator(MultiOutputMixin, RegressorMixin, BaseEstimator, abc.ABC):
    """Base of our own estimators: what any estimator of a difference model must offer, and more.

    The contract is scikit-learn's, so any of its regressors serves as well:
    ``fit(X, y)`` and ``predict(X)`` with X of shape (n, n_in) and y of shape (n, n_out),
    ``get_params``, ``set_params`` and ``clone``. ``__init__`` only stores its arguments and
    everything learnt ends in ``_``. A y of shape (n,) gives predictions of shape (n,).

    Beyond that, ours

    * standardise inputs and targets themselves, so columns may have any units;
    * return the standard deviation of a new observation (model uncertainty and noise) with
      ``return_std=True``;
    * predict row by row: a row's prediction has the same bits alone, in any batch and in any
      order, so that a simulator corrected by it stays a pure function;
    * predict one row in well under a millisecond (a float64 array of the right width skips
      scikit-learn's slow input checks, and everything else goes through them);
    * can be saved without pickle (``residual.persistence``).

    An estimator that wants raw states and actions rather than ``ChannelFeatures`` adds a method
    ``for_simulator(simulator)`` that returns an unfitted copy configured for its channels. If
    what it learns is a simulator itself, ``corrected()`` returns that.

    One that is at home with noisy rows that follow each other sets ``reads_noise = True`` and is
    then fitted to what was measured, not to smoothed paths (``residual.measured``). If it has a
    parameter ``noisy``, that is true then.

    A subclass names the attributes it learns in ``_learned`` and implements ``_fit`` and
    ``_predict``.
    """

    reads_noise: ClassVar[bool] = False
    _learned: ClassVar[tuple[str, ...]] = ()

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Learn from n rows.

        Args:
            X: inputs, shape (n, n_in).
            y: targets, shape (n, n_out) or (n,).

        Raises:
            ValueError: The shapes do not fit, a value is not finite, or values are so large that
                their spread overflows.
        """
        # scikit-learn sums the values up, which overflows before their spread is looked at.
        with np.errstate(over="ignore", invalid="ignore"):
            rows, targets = validate_data(
                self, X, y, dtype=np.float64, multi_output=True, y_numeric=True,
                ensure_min_samples=2,
            )  # fmt: skip
        targets = np.asarray(targets, float)
        self.flat_ = targets.ndim == 1
        targets = targets.reshape(len(targets), -1)
        _check_spread(rows, "X")
        _check_spread(targets, "y")
        self.target_mean_ = targets.mean(axis=0)
        self.target_scale_ = spread(targets)
        self._fit(rows, (targets - self.target_mean_) / self.target_scale_)
        self._prepare()
        return self

    @overload
    def predict(self, X: ArrayLike, return_std: Literal[False] = False) -> Array: ...

    @overload
    def predict(self, X: ArrayLike, return_std: Literal[True]) -> tuple[Array, Array]: ...

    def predict(self, X: ArrayLike, return_std: bool = False) -> Array | tuple[Array, Array]:
        """Predict n rows.

        Args:
            X: inputs, shape (n, n_in).
            return_std: also return the standard deviation of a new observation.

        Returns:
            The mean, shape (n, n_out), or (n,) after a fit with y of shape (n,); with
            ``return_std`` a pair of the mean and the standard deviation in that shape.

        Raises:
            sklearn.exceptions.NotFittedError: ``fit`` was not called.
            ValueError: X has another width than in ``fit``, or a value is not finite.
            NotFinite: X lies so far from the data that the prediction is not finite.
        """
        rows = self._rows(X)
        with np.errstate(over="ignore", invalid="ignore"):
            mean, std = self._predict(rows, return_std)
            mean = mean * self.target_scale_ + self.target_mean_
        # The sum is finite only if all are; looking at each costs more for one row.
        if not np.isfinite(mean.sum()) and not np.isfinite(mean).all():
            raise NotFinite(_far(type(self).__name__, rows, mean))
        if self.flat_:
            mean = mean[:, 0]
        if std is None:
            return mean
        std = std * self.target_scale_
        return mean, std[:, 0] if self.flat_ else std

    @abc.abstractmethod
    def _fit(self, X: Array, y: Array) -> None:
        """Learn from X of shape (n, n_in) and standardised targets y of shape (n, n_out)."""

    @abc.abstractmethod
    def _predict(self, X: Array, return_std: bool) -> tuple[Array, Array | None]:
        """Mean and, if asked for, standard deviation of the standardised targets, row by row."""

    def _prepare(self) -> None:
        """Derive from the learnt attributes what makes prediction fast."""

    def _rows(self, X: ArrayLike) -> Array:
        learnt = self.__dict__
        if (
            type(X) is np.ndarray
            and X.dtype == np.float64
            and X.ndim == 2
            and X.shape[1] == learnt.get("n_features_in_")
            and len(X)
            and "feature_names_in_" not in learnt
            and np.isfinite(X.sum())
        ):
            return X
        check_is_fitted(self)
        return validate_data(self, X, dtype=np.float64, reset=False)

    def state_arrays(self) -> dict[str, NDArray]:
        """Everything learnt, as arrays by name; ``from_state`` is the inverse.

        A tuple of arrays becomes one entry per item, ``name.0``, ``name.1`` and so on.
        """
        check_is_fitted(self)
        arrays: dict[str, NDArray] = {}
        for name in _COMMON + self._learned:
            value = getattr(self, name)
            if isinstance(value, tuple):
                arrays |= {f"{name}.{k}": np.asarray(item) for k, item in enumerate(value)}
            else:
                arrays[name] = np.asarray(value)
        return arrays

    @classmethod
    def from_state(cls, params: dict, arrays: dict[str, NDArray]) -> Self:
        """A fitted estimator from constructor arguments and ``state_arrays()``.

        Raises:
            KeyError, TypeError, ValueError: The parameters or arrays are not of this class.
        """
        estimator = cls(**params)
        for name in _COMMON + cls._learned:
            if f"{name}.0" in arrays:
                count = sum(key.startswith(f"{name}.") for key in arrays)
                value: object = tuple(arrays[f"{name}.{k}"] for k in range(count))
            else:
                value = arrays[name] if arrays[name].ndim else arrays[name].item()
            setattr(estimator, name, value)
        estimator._prepare()
        return estimator


_COMMON = ("n_features_in_", "flat_", "target_mean_", "target_scale_")


class NotFinite(ValueError):
    """A prediction that would not be finite; it is never returned."""


def _far(name: str, rows: Array, mean: Array) -> str:
    bad = np.flatnonzero(~np.isfinite(mean).all(axis=1))
    largest = np.abs(rows[bad[0]]).max()
    return (
        f"{name} predicts no finite number for {len(bad)} of {len(rows)} rows, the first with "
        f"inputs up to {largest:.3g}: stay near the data, since networks compute in float32, "
        "whose range ends at 3e38, and powers of inputs overflow sooner"
    )


def _check_spread(columns: Array, name: str) -> None:
    """Raise ``ValueError`` if columns cannot be standardised."""
    with np.errstate(over="ignore", invalid="ignore"):
        deviation = columns.std(axis=0)
    bad = np.flatnonzero(~np.isfinite(deviation))
    if bad.size:
        column = columns[:, bad[0]]
        raise ValueError(
            f"column {bad[0]} of {name} runs from {column.min():.3g} to {column.max():.3g}, whose "
            "spread overflows: expected values up to about 1e150; look for wild samples, or scale"
        )


def spread(columns: Array) -> Array:
    """Standard deviation of every column, and 1 for a column that is constant."""
    deviation = columns.std(axis=0)
    rounding = 1e-13 * np.abs(columns).max(axis=0)
    return np.where(deviation > rounding, deviation, 1.0)
