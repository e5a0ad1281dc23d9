"""How policies are tested, and along which states a difference model is judged."""

from __future__ import annotations

import dataclasses
from numbers import Real
from typing import Any

import numpy as np

# What may be zero.
_MAY_BE_ZERO = ("noisy", "final_episodes")


@dataclasses.dataclass(frozen=True)
class EvaluationProtocol:
    """How policies are tested while they learn and afterwards, and where accuracy is measured.

    Tests on a simulator are free. Tests on the true system are not counted as samples, as in the
    paper.

    Args:
        every: Steps of learning on a simulator between tests.
        every_true: The same on the true system.
        episodes: Rollouts without noise per test, each from its own start state.
        noisy: Rollouts with a little noise per test on a model; they keep a policy from being
            chosen for one lucky path through the model's errors.
        finalists: How many of the best policies of a training are tested once more at its end.
        final_episodes: Rollouts of each of them, from other starts; 0 for no final.
        true_episodes: Rollouts of the policy kept on the true system: the result. All policies of
            a seed begin in the same states. None: 5, or 1 where every reset gives the same state.
        visited_seconds: Accuracy is measured over this many first seconds of fresh rollouts, at
            least 20 control periods; None: over all of them.
        visited_rollouts: How many of those.
        visited_stride: Open-loop predictions start at every n-th state of them, this being n; None:
            at a thousand states at most.
    """

    every: int = 500
    every_true: int = 250
    episodes: int = 1
    noisy: int = 3
    finalists: int = 1
    final_episodes: int = 0
    true_episodes: int | None = None
    visited_seconds: float | None = None
    visited_rollouts: int = 5
    visited_stride: int | None = None

    def __post_init__(self) -> None:
        if (span := self.visited_seconds) is not None and not _is_number(span, above=0.0):
            raise ValueError(
                f"EvaluationProtocol: visited_seconds is {span!r}, expected seconds above 0, "
                "or None for whole rollouts"
            )
        for field in dataclasses.fields(self):
            value, least = getattr(self, field.name), 0 if field.name in _MAY_BE_ZERO else 1
            if field.name == "visited_seconds" or (value is None and field.default is None):
                continue
            whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
            if not whole or value < least:
                raise ValueError(
                    f"EvaluationProtocol: {field.name} is {value!r}, expected a whole number from "
                    f"{least}"
                )

    def __repr__(self) -> str:
        # What is as by default tells nothing.
        values = ((f.name, getattr(self, f.name), f.default) for f in dataclasses.fields(self))
        changed = ", ".join(f"{name}={now!r}" for name, now, usual in values if now != usual)
        return f"{type(self).__name__}({changed})"


def _is_number(value: Any, above: float) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool) and float(value) > above
