"""What a policy sees of a state: plain data that goes with the policy into its file."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
_KEY = "state_columns"


@dataclasses.dataclass(frozen=True)
class Column:
    """One column of a state.

    Args:
        name, unit: What it is.
        scale: The policy sees the column divided by it.
        angle: The policy sees cosine and sine of the column instead, in rad.
        seen: Whether the policy sees it at all.
        memory: Hidden memory of a simulator: such columns come last, and states may lack them.

    Raises:
        ValueError: A value is of another kind, or the scale is no finite size above 0.
    """

    name: str
    unit: str
    scale: float = 1.0
    angle: bool = False
    seen: bool = True
    memory: bool = False

    def __post_init__(self) -> None:
        texts, flags = (self.name, self.unit), (self.angle, self.seen, self.memory)
        kinds = all(type(t) is str for t in texts) and all(type(f) is bool for f in flags)
        if not kinds or type(self.scale) is not float or not 0 < self.scale < math.inf:
            raise ValueError(f"{self} is no column of a state")


@dataclasses.dataclass(frozen=True)
class StateColumns:
    """All columns of a state, in order.

    Args:
        columns: Those that are hidden memory come last.
    """

    columns: tuple[Column, ...]

    def __repr__(self) -> str:
        return ", ".join(f"{c.name} ({c.unit})" for c in self.columns if not c.memory)

    @property
    def observation_size(self) -> int:
        """Number of observations n_o that are made of a state."""
        return sum(1 + column.angle for column in self.columns if column.seen)

    def observe(self, state: ArrayLike) -> Array:
        """What the policy sees of a state.

        Args:
            state: In the units of the columns, shape (n_s,) or (n, n_s), with or without memory.

        Returns:
            Shape (n_o,) or (n, n_o).

        Raises:
            ValueError: The state has other columns, or is not finite.
        """
        x = np.asarray(state, float)
        bare = [column for column in self.columns if not column.memory]
        if x.ndim not in (1, 2) or x.shape[-1] not in (len(bare), len(self.columns)):
            raise ValueError(
                f"state has shape {x.shape}, expected ({len(bare)},) or (n, {len(bare)}): {self!r}"
            )
        rows = np.atleast_2d(x)
        for column, values in zip(self.columns, rows.T, strict=False):
            if column.seen and not np.isfinite(values).all():
                bad = values[~np.isfinite(values)][0]
                raise ValueError(f"state: {column.name} is {bad}, expected finite numbers")
        seen: list[Array] = []
        for column, values in zip(self.columns, rows.T, strict=False):
            if column.seen and column.angle:
                seen += [np.cos(values), np.sin(values)]
            elif column.seen:
                seen.append(values / column.scale)
        found = np.stack(seen, axis=1)
        return found[0] if x.ndim == 1 else found

    def plain(self) -> dict[str, Any]:
        """For the metadata of a file."""
        return {_KEY: [dataclasses.asdict(column) for column in self.columns]}

    @classmethod
    def taken_from(cls, metadata: Mapping[str, Any]) -> Self | None:
        """Read it from the metadata of a file; None if there is none in it.

        Raises:
            TypeError, ValueError: It is damaged.
        """
        if _KEY not in metadata:
            return None
        return cls(tuple(Column(**values) for values in metadata[_KEY]))


def observation_of(state: ArrayLike, columns: StateColumns | None) -> Array:
    """What a policy sees of a state; shapes and errors as in ``StateColumns.observe``.

    Raises:
        ValueError: It is also not known what columns the policy's states have.
    """
    if columns is None:
        raise ValueError(
            "this policy does not know what its observations are made of, since it was not learnt "
            "by the loop, or by an earlier version: give act(observation) what its environment "
            "observes"
        )
    return columns.observe(state)


def finite(observation: ArrayLike) -> NDArray[Any]:
    """An observation as an array.

    Raises:
        ValueError: It is not of finite numbers.
    """
    x = np.asarray(observation)
    if x.dtype.kind not in "fiub":
        raise ValueError(f"observation is {observation!r:.60}, expected real numbers")
    wrong = np.argwhere(~np.isfinite(x))
    if len(wrong):
        where = tuple(wrong[0].tolist())
        raise ValueError(f"observation has {x[where]} at {where}, expected finite numbers")
    return x
