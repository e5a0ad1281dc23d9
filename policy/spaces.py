"""Which spaces an agent takes, and whether an environment has those that it was made for."""

from __future__ import annotations

from typing import Any

import gymnasium


def one_box(name: str, space: gymnasium.Space[Any]) -> gymnasium.spaces.Box:
    """A space as the box that it has to be.

    Raises:
        ValueError: It is no one-dimensional box; the message says ``name``.
    """
    if not isinstance(space, gymnasium.spaces.Box) or len(space.shape) != 1:
        raise ValueError(f"{name} is {space}, expected a one-dimensional Box")
    return space


def check_spaces(env: gymnasium.Env[Any, Any], observations: int, actions: int) -> None:
    """Raise ``ValueError`` unless an environment has so many observations and actions."""
    for name, space, size in (
        ("observation", env.observation_space, observations),
        ("action", env.action_space, actions),
    ):
        if space.shape != (size,):
            raise ValueError(
                f"the environment's {name} space is {space}, but the agent was made for "
                f"{size} {name}(s): make a new agent, or wrap the environment"
            )
