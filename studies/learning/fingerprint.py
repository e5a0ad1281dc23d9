"""What a system is and does, in plain values: a kept result is right only for this.

Its parts count by what they hold and by their code (``described.py``), and the simulators and the
task by what they do on a few drawn rows, too: that shows data behind them that no object tells.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np

from sims.findings import draw
from sims.simulator import Simulator
from sims.system import System
from sims.tasks import Task
from studies.learning.described import Attribute, attributes_of, layers_of, named, settings_of

_ROWS, _STARTS = 8, 3
# Digits that every processor agrees on.
_DIGITS, _NOTHING = 9, 1e-12
_PARTS = (
    "nominal", "true", "task", "evaluation", "state_of", "measures", "elsewhere",
    "cold_noise_sigma", "measurement",
)  # fmt: skip


def fingerprint(system: System) -> dict[str, Any]:
    """What results of a system depend on.

    An environment is reset and stepped once, without a push: what that changes is its state and
    does not count. What a function makes as the true system counts as it was made, beside the
    function.

    Returns:
        ``parts`` and ``does``, plain values; the same in every process.
    """
    parts = {name: getattr(system, name) for name in _PARTS}
    made = _made(system)
    before = settings_of([parts, made])
    state = _use(made) if isinstance(made, gymnasium.Env) else frozenset[Attribute]()
    does = {"nominal": behaviour(system.nominal, system.task)}
    if isinstance(made, Simulator):
        does["true"] = behaviour(made, system.task)
    after = settings_of([parts, _made(system)], state)
    return {"parts": unchanged(before, after), "does": does}


def behaviour(simulator: Simulator, task: Task) -> dict[str, Any]:
    """What a simulator and a task make of a few rows.

    Returns:
        Next states in scales of the channels, rewards and terminations of them, start states,
        and the values of the parameters.
    """
    channels = simulator.state_channels
    states, actions = draw(simulator, _ROWS, np.random.default_rng(0))
    columns = [i for i, channel in enumerate(channels) if channel.kind != "memory"]
    with np.errstate(all="ignore"):
        reached = simulator.step(states, actions)
        before, after = states[:, columns], reached[:, columns]
        rewards = task.reward(before, actions, after)
    starts = [task.start(np.random.default_rng(seed)) for seed in range(_STARTS)]
    parameters = getattr(simulator, "parameters", {})
    return {
        "steps": _rounded(reached / [channel.scale for channel in channels]),
        "rewards": _rounded(rewards),
        "ends": np.asarray(task.terminal(after)).astype(int).tolist(),
        "starts": [_rounded(start) for start in starts],
        "horizon": settings_of(task.horizon),
        "dt": settings_of(simulator.dt),
        "parameters": {name: settings_of(parameters[name].value) for name in parameters},
    }


def unchanged(before: Any, after: Any) -> Any:
    """What two descriptions have in common; values that differ are state and do not count."""
    if isinstance(before, Mapping) and isinstance(after, Mapping):
        both = [name for name in before if name in after]
        return {name: unchanged(before[name], after[name]) for name in both}
    lists = isinstance(before, list) and isinstance(after, list)
    # What grows is a record of what happened.
    if lists and len(before) == len(after):
        return [unchanged(one, other) for one, other in zip(before, after, strict=True)]
    # Not a number is the same as itself here.
    return before if before == after or repr(before) == repr(after) else "changes"


def _made(system: System) -> Any:
    """The true system itself."""
    true = system.true
    return true if isinstance(true, Simulator | gymnasium.Env) else true()


def _use(env: gymnasium.Env[Any, Any]) -> frozenset[Attribute]:
    """Reset and step an environment; returns the attributes that this bound anew."""
    layers, box = layers_of(env), env.action_space
    held = [attributes_of(layer) for layer in layers]
    env.reset(seed=0)
    if isinstance(box, gymnasium.spaces.Box):
        env.step(np.clip(np.zeros(box.shape), box.low, box.high).astype(box.dtype))
    return frozenset(
        (named(type(layer)), name)
        for layer, before in zip(layers, held, strict=True)
        for name, value in attributes_of(layer).items()
        if name not in before or before[name] is not value
    )


def _rounded(values: Any) -> Any:
    """Numbers with as many digits as every processor gives alike, relative to the largest."""
    array = np.asarray(values, float)
    finite = np.abs(array[np.isfinite(array)])
    size = float(finite.max(initial=0.0))
    size = size if size > _NOTHING else 1.0
    return [(np.round(array / size, _DIGITS) + 0.0).tolist(), float(f"{size:.{_DIGITS}g}")]
