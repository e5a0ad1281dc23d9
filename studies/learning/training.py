"""One training: learn, keep the best policy, and test it on the true system."""

from __future__ import annotations

import dataclasses
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from policy.evaluate import Policy, Rollout, evaluate, rollout
from policy.learner import Algorithm, Learner
from policy.noise import OrnsteinUhlenbeck
from policy.selection import Point, learn_and_select
from residual.trajectories import Transitions
from simgap_npz import read_npz, write_npz
from sims.simulator import Array, Simulator
from sims.system import USUAL_STARTS, System
from studies.learning.streams import stream
from studies.learning.warm_start import Simulated

AGENT, CURVE, SUMMARY, EPISODE, SIMULATED = (
    "agent.safetensors",
    "curve.json",
    "summary.json",
    "rollout.npz",
    "simulated.npz",
)


@dataclasses.dataclass(frozen=True)
class Training:
    """What a training leaves.

    Attributes:
        learner: With the networks of the policy that was kept.
        curve: Tests while it learnt, in the environment that it learnt in.
        summary: ``simulated_steps``, ``updates``, ``return_model``, ``seconds``, ``return_true``,
            and ``tests``, every test on the true system with what is measured of it.
        episode: One episode on the true system: ``states``, ``actions`` and ``rewards``.
        simulated: The transitions it learnt from, if they are to be learnt from again.
        key: Of the step that it was kept as.
    """

    learner: Learner
    curve: tuple[Point, ...]
    summary: dict[str, Any]
    episode: dict[str, Array]
    simulated: Simulated | None = None
    key: str = ""

    def __repr__(self) -> str:
        told = {k: round(v, 3) for k, v in self.summary.items() if isinstance(v, int | float)}
        return f"Training({told})"[:180]

    @property
    def policy(self) -> Policy:
        """The policy kept."""
        return self.learner.policy

    def save(self, folder: Path) -> None:
        """Write it; no file holds code."""
        self.learner.save(folder / AGENT, replay=False)
        points = [dataclasses.asdict(point) for point in self.curve]
        (folder / CURVE).write_text(json.dumps(points))
        (folder / SUMMARY).write_text(json.dumps(self.summary))
        write_npz(folder / EPISODE, self.episode)
        if self.simulated:
            write_npz(folder / SIMULATED, vars(self.simulated), compress=False)

    @classmethod
    def load(cls, folder: Path, key: str, algorithm: Algorithm, env: gymnasium.Env) -> Training:
        """Read what ``save`` wrote."""
        simulated = folder / SIMULATED
        return cls(
            algorithm.load(folder / AGENT, env),
            tuple(Point(**point) for point in json.loads((folder / CURVE).read_text())),
            json.loads((folder / SUMMARY).read_text()),
            read_npz(folder / EPISODE),
            Simulated(**read_npz(simulated)) if simulated.exists() else None,
            key,
        )


def train(
    system: System,
    learner: Learner,
    env: gymnasium.Env,
    tested: gymnasium.Env,
    steps: int,
    seed: int,
    starts: int,
    tell: Callable[[Point], None],
    on_true: bool = False,
    random_steps: int = 0,
    believed: Simulator | None = None,
) -> Training:
    """Learn, and keep the policy that is best in the environment learnt in.

    Args:
        system: Says how policies are tested.
        learner: Learns on from where it stands; ends with the networks of the policy kept.
        env: To learn in.
        tested: Another one like it.
        steps: Of the environment.
        seed: Of the tests while it learns.
        starts: Of the starts on the true system, the same for policies that are to be compared.
        tell: Told every test.
        on_true: Whether the environment is the true system: then the test is the measure itself.
        random_steps: The first so many actions are random.
        believed: Makes a state of what the true system's sensors show, see ``System``.
    """
    protocol, updates, begin = system.evaluation, learner.updates, time.perf_counter()
    selection = learn_and_select(
        learner,
        env,
        tested,
        steps,
        every=protocol.every_true if on_true else protocol.every,
        noisy=0 if on_true else protocol.noisy,
        seed=seed,
        callback=tell,
        random_steps=random_steps,
        episodes=protocol.episodes,
        finalists=protocol.finalists,
        final_episodes=protocol.final_episodes,
    )
    seconds, updates = time.perf_counter() - begin, learner.updates - updates
    learner.restore(selection.networks)
    tests, episode = test_on_truth(system, learner.policy, starts, believed)
    on_model, count = selection.best.deterministic, len(tests["tests"])
    if selection.final is not None:
        on_model = selection.final
    elif count > protocol.episodes and not on_true:
        # One start tells little where they differ: from as many as on the true system.
        on_model = float(evaluate(learner.policy, tested, count, starts).mean())
    summary = {
        "simulated_steps": steps,
        "updates": updates,
        "best_step": selection.best.step,
        "return_model": on_model,
        "seconds": seconds,
    }
    return Training(learner, selection.curve, summary | tests, episode)


def test_on_truth(
    system: System, policy: Policy, seed: int, believed: Simulator | None = None
) -> tuple[dict[str, Any], dict[str, Array]]:
    """Rollouts on the true system, each from a start of its own.

    Args:
        system: Says how many, and what is measured.
        policy: Acts without noise.
        seed: Of the first reset; the others count on from it. Policies tested with one seed begin
            in the same states.
        believed: Makes a state of what the true system's sensors show, see ``System``.

    Returns:
        Their mean return and every test, and the first rollout.
    """
    env = system.true_environment(believed)
    runs = [rollout(policy, env, seed + k) for k in range(_starts(system, env, seed))]
    measure = system.measures or (lambda states, actions: {})
    tests = []
    for run in runs:
        states = visited(system, run)
        test: dict[str, Any] = {"start": states[0].tolist(), "return": run.total}
        tests.append(test | dict(measure(states, run.actions)))
    result: dict[str, Any] = {
        "return_true": float(np.mean([run.total for run in runs])),
        "tests": tests,
    }
    first = runs[0]
    episode = {"states": visited(system, first), "actions": first.actions}
    return result, episode | {"rewards": first.rewards}


def _starts(system: System, env: gymnasium.Env, seed: int) -> int:
    """How many starts a test on the true system has."""
    if system.evaluation.true_episodes is not None:
        return system.evaluation.true_episodes
    one, other = (env.reset(seed=seed + k)[1]["state"] for k in range(2))
    return 1 if np.array_equal(one, other) else USUAL_STARTS


def exploration(system: System, algorithm: Algorithm, seed: int) -> OrnsteinUhlenbeck:
    """Exploration noise as in learning, of whatever algorithm."""
    size, c = len(system.nominal.action_channels), algorithm.ddpg
    return OrnsteinUhlenbeck(size, c.noise_sigma, c.noise_theta, stream(seed, "noise"))


def transitions(system: System, rollouts: list[Rollout]) -> Transitions:
    """The steps of rollouts, each its own episode: as measured, if the system is measured."""
    parts, late = [], system.measurement.delay
    for run in rollouts:
        states = visited(system, run)
        if run.measured is not None:
            states = run.measured[late:]
        actions = run.actions[: len(states) - 1]
        if len(actions):
            episode = np.zeros(len(actions), dtype=np.int64)
            parts.append(Transitions(states[:-1], actions, states[1:], episode))
    return Transitions.join(parts)


def visited(system: System, run: Rollout) -> Array:
    """The states along a rollout, shape (T + 1, n_s), without what the simulator does not know.

    Raises:
        ValueError: The environment does not report them.
    """
    if run.states is None:
        raise ValueError("the environment does not report info['state'], the system's state")
    return run.states[:, : len(system.nominal.state_channels)]
