"""Tests of a policy on the true system, from starts that all policies of a seed have in common."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np

from policy.evaluate import Policy, Roll, evaluate, rollout
from residual.corrected import CorrectedSimulator
from simgap_files.npz import read_npz, write_npz
from sims.simulator import Array, Simulator
from sims.system import USUAL_STARTS, System
from sims.unsound import Unsound, answered
from studies.learning.streams import stream
from studies.learning.training import ON_TRUTH, Kind, Training, learnt_on, visited

if TYPE_CHECKING:
    from studies.learning.results import Model
    from studies.learning.steps import Steps

SUMMARY, EPISODE = "tests.json", "rollout.npz"


@dataclasses.dataclass(frozen=True)
class Tested:
    """What tests of a policy on the true system leave.

    Attributes:
        summary: ``return_true``; ``tests``, every test with what is measured of it;
            ``tested_steps``, of all of them; ``warnings`` of the true system; ``held`` rows while
            it was tested on the simulator; and ``return_model``, from as many starts there.
        episode: One episode on the true system: ``states``, ``actions`` and ``rewards``.
        key: Of the step that it was kept as.
    """

    summary: dict[str, Any]
    episode: dict[str, Array]
    key: str = ""

    def save(self, folder: Path) -> None:
        """Write it."""
        (folder / SUMMARY).write_text(json.dumps(self.summary))
        write_npz(folder / EPISODE, self.episode)

    @classmethod
    def load(cls, folder: Path, key: str) -> Tested:
        """Read what ``save`` wrote."""
        summary = json.loads((folder / SUMMARY).read_text())
        return cls(summary, read_npz(folder / EPISODE), key)


def tested(
    steps: Steps, kind: Kind, learnt: Training, on: Model | Simulator | None, roll: Roll = rollout
) -> Tested:
    """Test a policy on the true system, and from as many starts on what it learnt on.

    Args:
        steps: Of whom this is one.
        kind: See ``Steps.train``, as the others.
        learnt: The policy.
        on: The difference model added to the simulator, or another simulator.
        roll: Rolls out an episode on the true system.
    """
    system, policy = steps.system, learnt.policy
    # Of no kind and no update: what differs between policies is not where they began.
    starts = stream(steps.seed, "test starts")
    # One of its own: what the filter steps is not what was trained on and held.
    believed, _ = learnt_on(steps, on)
    summary, episode = test_on_truth(system, policy, starts, believed, roll)
    summary["held"] = 0
    count, protocol = len(summary["tests"]), system.evaluation
    if not protocol.final_episodes and count > protocol.episodes and kind not in ON_TRUTH:
        # One start tells little where they differ: from as many as on the true system.
        simulator, task = learnt_on(steps, on)
        returns = evaluate(policy, system.environment(simulator, task), count, starts)
        summary["return_model"] = float(returns.mean())
        summary["held"] = simulator.held if isinstance(simulator, CorrectedSimulator) else 0
    return Tested(summary, episode)


def test_on_truth(
    system: System,
    policy: Policy,
    seed: int,
    believed: Simulator | None = None,
    roll: Roll = rollout,
) -> tuple[dict[str, Any], dict[str, Array]]:
    """Rollouts on the true system, each from a start of its own.

    Args:
        system: Says how many, and what is measured.
        policy: Acts without noise.
        seed: Of the first reset; the others count on from it. Policies tested with one seed begin
            in the same states.
        believed: Makes a state of what the true system's sensors show, see ``System``.
        roll: Rolls out an episode.

    Returns:
        Their mean return, every test, steps and warnings, and the first rollout.
    """
    env = system.true_environment(believed)
    runs = [roll(policy, env, seed + k, None, None) for k in range(_starts(system, env, seed))]
    tests = []
    for run in runs:
        states = visited(system, run)
        test: dict[str, Any] = {"start": states[0].tolist(), "return": run.total}
        tests.append(test | _measures(system, states, run.actions))
    result: dict[str, Any] = {
        "return_true": float(np.mean([run.total for run in runs])),
        "tests": tests,
        "tested_steps": sum(len(run.actions) for run in runs),
        "warnings": list(getattr(env.unwrapped, "said", {}).values()),
    }
    first = runs[0]
    episode = {"states": visited(system, first), "actions": first.actions}
    return result, episode | {"rewards": first.rewards}


def _measures(system: System, states: Array, actions: Array) -> dict[str, Any]:
    """What a system reports of a rollout beside its return.

    Raises:
        Unsound: It raised, or reports something else than numbers by name.
    """
    if system.measures is None:
        return {}
    what = f"system {system.name}: measures"
    found = answered(what, system.measures, states, actions)
    plain = isinstance(found, Mapping) and all(
        isinstance(name, str) and np.ndim(value) == 0 and np.isreal(value)
        for name, value in found.items()
    )
    if not plain:
        raise Unsound(f"{what} returned {found!r:.80}, expected one number for each name")
    return dict(found)


def _starts(system: System, env: gymnasium.Env, seed: int) -> int:
    """How many starts a test on the true system has."""
    if system.evaluation.true_episodes is not None:
        return system.evaluation.true_episodes
    one, other = (env.reset(seed=seed + k)[1]["state"] for k in range(2))
    return 1 if np.array_equal(one, other) else USUAL_STARTS
