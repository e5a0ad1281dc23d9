"""The refusal of what breaks its promises: one line that says what and where."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from typing import Any

from sims.simulator import Array, Channel


class Unsound(ValueError):
    """A simulator, an environment or a task that breaks its contract; the user can mend it."""


def cannot_call(function: Callable[..., Any], *given: Any, **named: Any) -> str:
    """Why a function cannot be called with some arguments, empty if it can."""
    try:
        inspect.signature(function).bind(*given, **named)
    except TypeError as error:
        return str(error)
    except ValueError:  # Written in C: it says nothing of its arguments.
        return ""
    return ""


def answered(whose: str, function: Callable[..., Any], *given: Any, **named: Any) -> Any:
    """What somebody else's function returns.

    Args:
        whose: Function it is, in words.
        function: Called with the other arguments.

    Raises:
        Unsound: It raised; the message says whose it is, and the kind and words of its error.
    """
    try:
        return function(*given, **named)
    except Unsound:
        raise
    except Exception as error:
        raise Unsound(f"{whose} raised {type(error).__name__}: {error}") from error


def refuse_not_finite(
    what: str, channels: tuple[Channel, ...], state: Array, step: int, reward: float = 0.0
) -> None:
    """Refuse numbers of a running system that are not finite: nothing could be learnt from them.

    Args:
        what: Whose numbers, in words.
        channels: One per entry of the state.
        state: The state reached, shape (n_s,).
        step: Control periods since the reset, 0 for the start state.
        reward: Of that step.

    Raises:
        Unsound: The message names the channel, or the reward, and the step.
    """
    if math.isfinite(reward) and math.isfinite(float(state.sum())):
        return
    where = f"after step {step}" if step else "at reset"
    for channel, value in zip(channels, state, strict=True):
        if not math.isfinite(value):
            raise Unsound(
                f"{what} gave {channel.name} = {value:g}{channel.unit_text} {where}, expected a "
                "finite number: mend the sensor or the model, or end the episode before that"
            )
    if not math.isfinite(reward):
        reached = ", ".join(f"{c.name} {v:.4g}" for c, v in zip(channels, state, strict=True))
        raise Unsound(
            f"{what}: the task gave the reward {reward:g} {where}, expected a finite number; "
            f"reached was {reached}"
        )
