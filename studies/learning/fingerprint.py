"""What a system is and does, in plain values: a kept result is right only for this.

Its parts count by what they hold and by their code (``described.py``), and the simulators and the
task by what they do on a few drawn rows, too: that shows data behind them that no object tells.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np

from sims.findings import draw
from sims.simulator import Simulator
from sims.system import System
from sims.tasks import Task
from studies.learning.described import Attribute, settings_of
from studies.learning.parts import attributes_of, layers_of, named

_ROWS, _STARTS = 8, 3
_STATE = "changes"
# Every use draws other rows: whoever remembers rows remembers more.
_uses = itertools.count()
# Digits that every processor agrees on.
_DIGITS, _NOTHING = 9, 1e-12
_PARTS = (
    "nominal", "true", "task", "evaluation", "state_of", "measures", "elsewhere",
    "cold_noise_sigma", "measurement",
)  # fmt: skip


def fingerprint(system: System) -> dict[str, Any]:
    """What results of a system depend on.

    Simulators and the task are used, and an environment is reset and stepped once without a push:
    what that changes is state, such as a count or a memory of results, and does not count. What a
    function makes as the true system counts as it was made, beside the function.

    Returns:
        ``parts``, the ``code`` behind them and what the system ``does``, plain values; the same
        in every process.
    """
    parts = {name: getattr(system, name) for name in _PARTS}
    made = _made(system)
    known = [system.nominal, *([made] if isinstance(made, Simulator) else [])]

    def use() -> None:
        for simulator in known:
            behaviour(simulator, system.task, np.random.default_rng([1, next(_uses)]))

    use()  # what the first use alone sets is not mistaken for state
    before = settings_of([parts, made])
    use()
    state = _step(made) if isinstance(made, gymnasium.Env) else frozenset[Attribute]()
    after = settings_of([parts, _made(system)], state)
    code = {
        name: unchanged(told, after["code"][name])
        for name, told in before["code"].items()
        if name in after["code"]
    }
    does = [behaviour(simulator, system.task, np.random.default_rng(0)) for simulator in known]
    return {"parts": unchanged(before["value"], after["value"]), "code": code, "does": does}


def behaviour(simulator: Simulator, task: Task, rng: np.random.Generator) -> dict[str, Any]:
    """What a simulator and a task make of a few rows.

    Args:
        simulator: Stepped.
        task: Shown the channels without hidden memory.
        rng: Draws the rows.

    Returns:
        Next states in scales of the channels, rewards and terminations of them, start states,
        and the values of the parameters.
    """
    channels = simulator.state_channels
    states, actions = draw(simulator, _ROWS, rng)
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
        # Attributes come and go; another mapping that grows is a record.
        if "class" not in before and before.keys() != after.keys():
            return _STATE
        both = [name for name in before if name in after]
        return {name: unchanged(before[name], after[name]) for name in both}
    lists = isinstance(before, list) and isinstance(after, list)
    if lists and len(before) == len(after):
        return [unchanged(one, other) for one, other in zip(before, after, strict=True)]
    # Not a number is the same as itself here.
    return before if before == after or repr(before) == repr(after) else _STATE


def _made(system: System) -> Any:
    """The true system itself."""
    true = system.true
    return true if isinstance(true, Simulator | gymnasium.Env) else true()


def _step(env: gymnasium.Env[Any, Any]) -> frozenset[Attribute]:
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
