"""A deterministic policy as plain numpy: small enough to save, share and run anywhere."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from policy.files import content_of, read_arrays, write_arrays
from policy.observations import StateColumns, finite, observation_of
from policy.scaling import Scaling

FORMAT = "simgap.policy.1"


@dataclasses.dataclass(frozen=True)
class MlpPolicy:
    """Observation -> action: two layers of rectified units, tanh, scaled to the action's bounds.

    Args:
        weights: ``weight1`` (n_1, n_o), ``bias1``, ``weight2`` (n_2, n_1), ``bias2``,
            ``weight3`` (n_a, n_2), ``bias3``; float32.
        low: Lowest action, shape (n_a,).
        high: Highest action, shape (n_a,).
        scaling: Of observations, before the first layer; by default none.
        columns: Of the states that observations are made of; without them ``act_on`` refuses.

    Raises:
        ValueError: The columns give another number of observations.
    """

    weights: dict[str, NDArray[np.float32]]
    low: NDArray[np.float32]
    high: NDArray[np.float32]
    scaling: Scaling | None = None
    columns: StateColumns | None = None

    def __post_init__(self) -> None:
        # One layout, whether learnt, copied or loaded: another one would round differently.
        for name, value in self.weights.items():
            self.weights[name] = (np.asfortranarray if name == "weight1" else np.ascontiguousarray)(
                value
            )
        if self.columns and self.columns.observation_size != self.observation_size:
            raise ValueError(
                f"the columns {self.columns!r} make {self.columns.observation_size} observations, "
                f"but the policy takes {self.observation_size}"
            )

    def __repr__(self) -> str:
        sizes = [self.observation_size, *(len(self.weights[f"bias{k}"]) for k in (1, 2, 3))]
        on = f"; acts on {self.columns!r}" if self.columns else ""
        return f"MlpPolicy({' -> '.join(map(str, sizes))}{on})"

    @property
    def observation_size(self) -> int:
        """Number of observations n_o."""
        return int(self.weights["weight1"].shape[1])

    def act_on(self, state: ArrayLike) -> NDArray[np.float32]:
        """Action(s) for what the system's state is, in the units of its channels.

        Args:
            state: One state, shape (n_s,), or a batch, shape (n, n_s).

        Returns:
            Within the bounds, in the units of the action channels: shape (n_a,) or (n, n_a),
            float32.

        Raises:
            ValueError: The state has another number of columns or is not finite, or the policy
                was not learnt by the loop, so that its columns are not known.
        """
        return self.act(observation_of(state, self.columns))

    def act(self, observation: ArrayLike) -> NDArray[np.float32]:
        """Action(s) for what the environment learnt in observes; for a state take ``act_on``.

        An environment of ``sims`` observes every channel divided by its scale, and an angle as
        cosine and sine.

        Args:
            observation: One observation, shape (n_o,), or a batch, shape (n, n_o).

        Returns:
            Within the bounds, shape (n_a,) or (n, n_a), float32.

        Raises:
            ValueError: The observation has another number of columns, or is not finite.
        """
        return self.to_action(self.normalised(finite(observation)))

    def normalised(self, observation: ArrayLike) -> NDArray[np.float32]:
        """Action(s) in [-1, 1]; arguments as in ``act``, but not finite ones pass."""
        x = np.asarray(observation)
        w = self.weights
        if x.ndim not in (1, 2) or x.shape[-1] != self.observation_size:
            raise ValueError(
                f"observation has shape {x.shape}, expected ({self.observation_size},) "
                f"or (n, {self.observation_size})"
            )
        x = np.asarray(self.scaling.seen(x) if self.scaling else x, np.float32)
        x = x @ w["weight1"].T
        x += w["bias1"]
        np.maximum(x, 0, out=x)
        x = x @ w["weight2"].T
        x += w["bias2"]
        np.maximum(x, 0, out=x)
        x = x @ w["weight3"].T
        x += w["bias3"]
        return np.tanh(x, out=x)

    def to_action(self, normalised: ArrayLike) -> NDArray[np.float32]:
        """Map [-1, 1] onto the action's bounds; values outside are clipped to them."""
        share = (np.asarray(normalised, np.float32) + 1) / 2
        action = self.low + share * (self.high - self.low)
        return np.minimum(np.maximum(action, self.low), self.high)

    def copy(self) -> MlpPolicy:
        """The same policy with weights of its own."""
        weights = {name: value.copy(order="K") for name, value in self.weights.items()}
        return MlpPolicy(weights, self.low.copy(), self.high.copy(), self.scaling, self.columns)

    def save(self, path: str | Path) -> None:
        """Write a safetensors file; it appears whole or not at all."""
        tensors = {**self.weights, "low": self.low, "high": self.high}
        tensors |= self.scaling.arrays() if self.scaling else {}
        write_arrays(path, FORMAT, tensors, self.columns.plain() if self.columns else {})

    @classmethod
    def load(cls, path: str | Path) -> MlpPolicy:
        """Read a file written by ``save``; nothing in it is executed.

        Raises:
            FileNotFoundError: There is no such file.
            ValueError: The file is damaged or holds something else.
        """
        arrays, metadata = read_arrays(path, FORMAT)
        with content_of(path, "policy"):
            if empty := [name for name, array in arrays.items() if not array.size]:
                # Without entries a shape may claim any length.
                raise ValueError(f"its array {empty[0]!r} is empty")
            low, high = arrays.pop("low"), arrays.pop("high")
            scaling = Scaling.taken_from(arrays, arrays["weight1"].shape[-1])
            _check_shapes(arrays, low, high)
            return cls(arrays, low, high, scaling, StateColumns.taken_from(metadata))


def _check_shapes(
    weights: dict[str, NDArray[np.float32]], low: NDArray[np.float32], high: NDArray[np.float32]
) -> None:
    first, second = len(weights["bias1"]), len(weights["bias2"])
    expected = {
        "weight1": (first, weights["weight1"].shape[-1]), "bias1": (first,),
        "weight2": (second, first), "bias2": (second,),
        "weight3": (len(low), second), "bias3": (len(low),),
    }  # fmt: skip
    given = {name: array.shape for name, array in weights.items()}
    if given != expected or low.shape != (len(low),) or high.shape != low.shape:
        raise ValueError(f"its layers have shapes {given}, which do not fit together")
    if any(array.dtype != np.float32 for array in (*weights.values(), low, high)):
        raise ValueError("its arrays are not of float32")
    if not np.all(low <= high):
        raise ValueError("the lowest action is above the highest")
