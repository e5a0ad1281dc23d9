"""The difference model: d(s, a) = s'_true - s'_simulated, learnt from transitions."""

from __future__ import annotations

import inspect
import math
from typing import Any, Literal, Self, overload

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import clone
from sklearn.exceptions import NotFittedError
from sklearn.multioutput import MultiOutputRegressor
from sklearn.utils import get_tags

from residual.estimator import Array, spread
from residual.features import ChannelFeatures
from residual.trajectories import Transitions
from sims.simulator import Channel, Simulator, as_rows, state_difference


class DifferenceModel:
    """What a simulator misses per control period, predicted by an estimator.

    An estimator with a method ``for_simulator`` sees raw rows [states, actions] and learns the
    difference in SI units. Any other scikit-learn regressor sees ``ChannelFeatures`` and
    learns the difference with every channel standardised; one that has a single output is
    fitted once per channel. The estimator given is never changed: a clone is fitted.

    Args:
        estimator: Any regressor with ``fit(X, y)`` and ``predict(X)``.
        simulator: The simulator whose difference to the observed system is learnt.

    Attributes:
        estimator_: The fitted estimator.
        dt: Control period in s of the simulator; the difference holds for no other.
        state_channels, action_channels: Those of the simulator.
        has_std: Whether ``predict`` can return a standard deviation.
        seen_: Lowest and highest states of the data, shape (2, n_s); zeros if that is not known.
    """

    def __init__(self, estimator: Any, simulator: Simulator) -> None:
        self.simulator: Simulator | None = simulator
        self._describe(
            estimator,
            simulator.dt,
            tuple(simulator.state_channels),
            tuple(simulator.action_channels),
        )

    @classmethod
    def from_state(
        cls,
        estimator: Any,
        dt: float,
        state_channels: tuple[Channel, ...],
        action_channels: tuple[Channel, ...],
        mean: Array,
        scale: Array,
        seen: Array | None = None,
    ) -> Self:
        """A fitted model without a simulator, from a fitted estimator and what it was fitted for.

        Args:
            estimator: Fitted on the rows that ``fit`` would give it.
            dt: Control period in s.
            state_channels, action_channels: Of the simulator it was fitted for.
            mean, scale: Of the targets, per state channel, shape (n_s,).
            seen: Lowest and highest states of the data, shape (2, n_s).
        """
        model = cls.__new__(cls)
        model.simulator = None
        model._describe(estimator, dt, state_channels, action_channels)
        model.estimator_, model.mean_, model.scale_ = estimator, mean, scale
        if seen is not None:
            model.seen_ = seen
        return model

    def _describe(
        self,
        estimator: Any,
        dt: float,
        state_channels: tuple[Channel, ...],
        action_channels: tuple[Channel, ...],
    ) -> None:
        self.estimator = estimator
        self.dt = dt
        self.state_channels = state_channels
        self.action_channels = action_channels
        self.raw = hasattr(estimator, "for_simulator")
        width = len(self.state_channels) + len(self.action_channels)
        self.features = ChannelFeatures.for_channels(self.state_channels, self.action_channels)
        self.features.fit(np.zeros((1, width)))
        self._low = np.array([channel.low for channel in self.action_channels])
        self._high = np.array([channel.high for channel in self.action_channels])
        self.seen_ = np.zeros((2, len(self.state_channels)))

    def fit(self, transitions: Transitions) -> Self:
        """Learn from observed transitions of the true system.

        Raises:
            ValueError: No transitions, columns that do not fit the simulator's channels, or no
                simulator because the model was loaded from a file.
        """
        if self.simulator is None:
            raise ValueError(
                "a difference model loaded from a file has no simulator to compare with: "
                "set its attribute simulator before fit"
            )
        if len(transitions) < 2:
            raise ValueError(f"{len(transitions)} transitions: a difference needs at least 2")
        states, actions = self.simulator.check_rows(transitions.states, transitions.actions)
        simulated = self.simulator.step(states, actions)
        y = state_difference(self.state_channels, transitions.next_states, simulated)
        self.fit_difference(states, actions, y)
        return self

    def fit_difference(self, states: ArrayLike, actions: ArrayLike, y: ArrayLike) -> Self:
        """Learn from differences already computed, shapes (n, n_s), (n, n_a) and (n, n_s)."""
        X, y = self._inputs(states, actions), np.asarray(y, float)
        rows = np.asarray(states, float)
        self.seen_ = np.stack([rows.min(axis=0), rows.max(axis=0)])
        estimator: Any
        if self.raw:
            self.mean_, self.scale_ = np.zeros(y.shape[1]), np.ones(y.shape[1])
            estimator = self.estimator.for_simulator(self.simulator)
        else:
            self.mean_, self.scale_ = y.mean(axis=0), spread(y)
            estimator = clone(self.estimator, safe=False)
            if not _many_outputs(estimator):
                estimator = MultiOutputRegressor(estimator)
        self.estimator_ = estimator.fit(X, (y - self.mean_) / self.scale_)
        return self

    def __repr__(self) -> str:
        channels = ", ".join(channel.name for channel in self.state_channels[:6])
        channels = ", ".join(channel.name for channel in self.state_channels[:6])
        return f"DifferenceModel({type(self.estimator).__name__} for {channels})"

    @property
    def name(self) -> str:
        """What was learnt and by what, for reports."""
        return f"{type(self.estimator).__name__} difference"

    def check_fits(self, simulator: Simulator) -> None:
        """Raise ``ValueError`` unless the model holds for this simulator's period and channels."""
        if not math.isclose(self.dt, simulator.dt, rel_tol=1e-9):
            raise ValueError(
                f"the difference model was fitted for a control period of {self.dt:g} s, the "
                f"simulator has {simulator.dt:g} s: fit it again with this simulator"
            )
        for what, own, others in (
            ("state", self.state_channels, simulator.state_channels),
            ("action", self.action_channels, simulator.action_channels),
        ):
            if own != tuple(others):
                names = [", ".join(c.name for c in channels) for channels in (own, others)]
                raise ValueError(
                    f"the difference model was fitted for the {what} channels {names[0]}, the "
                    f"simulator has {names[1]}, or their units, scales or bounds differ: "
                    "fit it again with this simulator"
                )

    def fitted(self) -> Any:
        """The fitted estimator.

        Raises:
            sklearn.exceptions.NotFittedError: ``fit`` was not called.
        """
        if not hasattr(self, "estimator_"):
            raise NotFittedError("this DifferenceModel is not fitted yet: call fit(transitions)")
        return self.estimator_

    @property
    def has_std(self) -> bool:
        """Whether ``predict(..., return_std=True)`` returns a standard deviation."""
        estimator = self.estimator
        return "return_std" in inspect.signature(estimator.predict).parameters

    @overload
    def predict(
        self, states: ArrayLike, actions: ArrayLike, return_std: Literal[False] = False
    ) -> Array: ...

    @overload
    def predict(
        self, states: ArrayLike, actions: ArrayLike, return_std: Literal[True]
    ) -> tuple[Array, Array | None]: ...

    def predict(
        self, states: ArrayLike, actions: ArrayLike, return_std: bool = False
    ) -> Array | tuple[Array, Array | None]:
        """The difference of the next state for every row.

        Args:
            states: shape (n, n_s), in the units of the channels.
            actions: shape (n, n_a); clipped to the bounds of their channels.
            return_std: also return the standard deviation.

        Returns:
            The difference, shape (n, n_s), in SI units, to be added to the simulator's next
            state; with ``return_std`` a pair of it and its standard deviation in that shape,
            or None in place of the latter if the estimator has none.

        Raises:
            sklearn.exceptions.NotFittedError: ``fit`` was not called.
            ValueError: The shapes do not fit the channels.
        """
        estimator = self.fitted()
        X = self._inputs(states, actions)
        if not return_std or not self.has_std:
            mean = self._table(estimator.predict(X)) * self.scale_ + self.mean_
            return (mean, None) if return_std else mean
        if isinstance(estimator, MultiOutputRegressor):
            pairs = [part.predict(X, return_std=True) for part in estimator.estimators_]
            mean, std = (np.stack(columns, axis=1) for columns in zip(*pairs, strict=True))
        else:
            mean, std = map(self._table, estimator.predict(X, return_std=True))
        return mean * self.scale_ + self.mean_, std * self.scale_

    def _table(self, values: Array) -> Array:
        return np.asarray(values, float).reshape(-1, len(self.state_channels))

    def _inputs(self, states: ArrayLike, actions: ArrayLike) -> Array:
        states, actions = as_rows(self.state_channels, self.action_channels, states, actions)
        actions = np.minimum(np.maximum(actions, self._low), self._high)
        rows = np.concatenate([states, actions], axis=1)
        return rows if self.raw else self.features.transform(rows)


def _many_outputs(estimator: Any) -> bool:
    """Whether an estimator fits several outputs at once; one without scikit-learn's tags may."""
    if not hasattr(estimator, "__sklearn_tags__"):
        return True
    tags = get_tags(estimator).target_tags
    return tags.multi_output
