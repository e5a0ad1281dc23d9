"""Features of rows of channels: cosine and sine of angles, everything else in its scale."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, TransformerMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from residual.estimator import Array
from sims.simulator import Channel, Simulator, wrap


class ChannelFeatures(TransformerMixin, BaseEstimator):
    """What networks and kernels see of a simulator's raw rows [states, actions].

    An angle becomes its cosine and sine, so that turns do not matter; any other column is
    divided by its scale. Output columns: cosines of all angles, sines of all angles, then the
    other columns in their order. Learns nothing: ``fit`` only checks its input.

    Args:
        angles: Columns that are angles, in rad.
        scales: One typical magnitude per column, in its unit (ignored for angles); None for 1.
            An infinite scale makes its column zero: the features no longer depend on it.
    """

    def __init__(self, angles: Sequence[int] = (), scales: Sequence[float] | None = None) -> None:
        self.angles = angles
        self.scales = scales

    @classmethod
    def for_simulator(cls, simulator: Simulator) -> Self:
        """Features for rows of a simulator's states followed by its actions."""
        return cls.for_channels(simulator.state_channels, simulator.action_channels)

    @classmethod
    def for_channels(cls, states: Sequence[Channel], actions: Sequence[Channel]) -> Self:
        """Features for rows of these state channels followed by these action channels."""
        return cls(*angles_and_scales(states, actions))

    def fit(self, X: ArrayLike, y: ArrayLike | None = None) -> Self:
        """Check the width of X, shape (n, n_in); nothing is learnt.

        Raises:
            ValueError: The angles or scales do not fit the number of columns.
        """
        self._columns(validate_data(self, X, dtype=np.float64).shape[1])
        return self

    def transform(self, X: ArrayLike) -> Array:
        """Features of raw rows.

        Args:
            X: shape (n, n_in).

        Returns:
            Shape (n, n_in + number of angles).

        Raises:
            ValueError: The width does not fit, or a value is not finite.
        """
        if not (type(X) is np.ndarray and X.dtype == np.float64 and X.ndim == 2 and X.size) or (
            X.shape[1] != self.__dict__.get("n_features_in_")
            or "feature_names_in_" in self.__dict__
            or not np.isfinite(X.sum())
        ):
            check_is_fitted(self)
            X = validate_data(self, X, dtype=np.float64, reset=False)
        rows = np.asarray(X, float)
        angles, others, factors = self._columns(rows.shape[1])
        if not len(angles):
            return rows * factors
        turned = rows[:, angles]
        return np.concatenate(
            [np.cos(turned), np.sin(turned), rows[:, others] * factors],
            axis=1,
        )

    def wrapped(self, X: Array) -> Array:
        """Rows with angles folded into [-pi, pi) and other columns divided by their scale."""
        angles, others, factors = self._columns(X.shape[1])
        rows = np.empty_like(X)
        rows[:, angles] = wrap(X[:, angles])
        rows[:, others] = X[:, others] * factors
        return rows

    def _columns(self, width: int) -> tuple[NDArray, NDArray, Array]:
        key = (width, tuple(self.angles), None if self.scales is None else tuple(self.scales))
        cached = self.__dict__.get("_cached")
        if cached is not None and cached[0] == key:
            return cached[1]
        scales = np.ones(width) if self.scales is None else np.asarray(self.scales, float)
        angles = np.asarray(self.angles, int).reshape(-1)
        if scales.shape != (width,) or not (scales > 0).all():
            raise ValueError(
                f"scales={self.scales!r} does not fit X with {width} columns: "
                "give one positive number per column, or None"
            )
        if len(set(self.angles)) != len(angles) or ((angles < 0) | (angles >= width)).any():
            raise ValueError(
                f"angles={self.angles!r} does not fit X with {width} columns: "
                f"give distinct column numbers from 0 to {width - 1}"
            )
        others = np.setdiff1d(np.arange(width), angles)
        columns = angles, others, 1 / scales[others]
        self._cached = key, columns
        return columns


def angles_and_scales(
    states: Sequence[Channel], actions: Sequence[Channel]
) -> tuple[tuple[int, ...], tuple[float, ...]]:
    """Angle columns and column scales of raw rows [states, actions].

    A state is scaled by ``Channel.scale``, one that the motion does not depend on by infinity;
    an action by the larger of its bounds, or by ``Channel.scale`` if it is not bounded.
    """
    bounds = [max(abs(channel.low), abs(channel.high)) for channel in actions]
    scales = [np.inf if channel.invariant else channel.scale for channel in states] + [
        bound if 0 < bound < np.inf else channel.scale
        for bound, channel in zip(bounds, actions, strict=True)
    ]
    angles = [column for column, channel in enumerate((*states, *actions)) if channel.angle]
    return tuple(angles), tuple(float(scale) for scale in scales)
