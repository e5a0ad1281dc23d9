"""One training: learn, and keep the policy that is best where it learnt."""

from __future__ import annotations

import dataclasses
import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import gymnasium
import numpy as np

from policy.evaluate import Policy, Rollout
from policy.learner import Algorithm, Learner
from policy.noise import OrnsteinUhlenbeck
from policy.observations import Column, StateColumns
from policy.selection import Point, learn_and_select
from residual.corrected import CorrectedSimulator
from residual.trajectories import Transitions
from residual.uncertainty_penalty import PenalisedTask
from simgap_files.npz import read_npz, write_npz
from sims.environment import observed_channels
from sims.simulator import Array, Channel, Simulator
from sims.system import System
from sims.tasks import Task
from studies.learning.streams import stream
from studies.learning.warm_start import Recorder, Simulated, WarmStart

if TYPE_CHECKING:
    from studies.learning.results import Model
    from studies.learning.steps import Steps
    from studies.learning.testing import Tested

AGENT, CURVE, SUMMARY = "agent.safetensors", "curve.json", "summary.json"
SIMULATED = "simulated.npz"
# Policies learnt from nothing begin with random actions, the baselines too.
RANDOM_STEPS = 1000

#: Kinds that learn on the true system.
ON_TRUTH = ("cold", "warm")
Kind = Literal["idealised", "difference", "control", "corrected", "cold", "warm"]
_TITLES = {
    "idealised": "train on the simulator",
    "difference": "train on the corrected simulator",
    "control": "train on, no difference model",
    "corrected": "train on what was corrected by name",
    "cold": "cold start on the true system",
    "warm": "warm start on the true system",
}


@dataclasses.dataclass(frozen=True)
class Training:
    """What a training leaves.

    Attributes:
        learner: With the networks of the policy that was kept.
        curve: Tests while it learnt, in the environment that it learnt in.
        summary: ``simulated_steps``, ``updates``, ``best_step``, ``return_model``, ``seconds``,
            ``held``, and, once it was tested, what ``Tested`` has.
        simulated: The transitions it learnt from, if they are to be learnt from again.
        key: Of the step that it was kept as.
        episode: One episode on the true system, see ``Tested``; empty before it was tested.
    """

    learner: Learner
    curve: tuple[Point, ...]
    summary: dict[str, Any]
    simulated: Simulated | None = None
    key: str = ""
    episode: dict[str, Array] = dataclasses.field(default_factory=dict)

    def __repr__(self) -> str:
        told = {k: round(v, 3) for k, v in self.summary.items() if isinstance(v, int | float)}
        return f"Training({told})"[:180]

    @property
    def policy(self) -> Policy:
        """The policy kept."""
        return self.learner.policy

    def tested(self, tests: Tested) -> Training:
        """The same with its tests on the true system."""
        held = self.summary["held"] + tests.summary["held"]
        summary = self.summary | tests.summary | {"held": held}
        return dataclasses.replace(self, summary=summary, episode=tests.episode)

    def save(self, folder: Path) -> None:
        """Write it, without tests; no file holds code."""
        self.learner.save(folder / AGENT, replay=False)
        points = [dataclasses.asdict(point) for point in self.curve]
        (folder / CURVE).write_text(json.dumps(points))
        (folder / SUMMARY).write_text(json.dumps(self.summary))
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
            Simulated(**read_npz(simulated)) if simulated.exists() else None,
            key,
        )


def train(
    steps: Steps,
    kind: Kind,
    count: int,
    start: WarmStart | Training | None,
    on: Model | Simulator | None,
    update: int,
) -> Training:
    """Learn, and keep the policy that is best in the environment learnt in.

    Args:
        steps: Of whom this is one.
        kind: See ``Steps.train``, as the others.
        count: Steps of the environment.
        start: Where it starts from.
        on: The difference model to add to the simulator, or another simulator.
        update: Which update it belongs to.
    """
    system, all_again = steps.system, steps.replay == "all"
    simulator, task = learnt_on(steps, on)
    difference = None if isinstance(on, Simulator | None) else on.difference
    on_true = kind in ON_TRUTH
    env, tested = (
        system.true_environment() if on_true else system.environment(simulator, task)
        for _ in range(2)
    )
    sigma = system.cold_noise_sigma if start is None else None
    seed = stream(steps.seed, "train", kind, update)
    columns = state_columns(system.nominal)
    learner = steps.algorithm.make(env, seed, sigma, steps.scaling, columns)
    if isinstance(start, WarmStart) and start.rows:
        with steps.progress.task("take up what was simulated", start.rows) as tell:
            again = isinstance(on, Simulator)
            start.fill(learner, env, again, lambda done: tell(done, ""))  # type: ignore[arg-type]
    if start:
        last = start.last if isinstance(start, WarmStart) else start
        learner.restore(last.learner.networks())
    recorder = None
    if not on_true and (all_again or kind in ("difference", "control")):
        recorder = Recorder(env)  # type: ignore[arg-type]
    protocol, updates, begin = system.evaluation, learner.updates, time.perf_counter()
    with steps.progress.task(_TITLES[kind], count) as tell:
        best = -np.inf

        def report(point: Point) -> None:
            nonlocal best
            best, numbers = max(best, point.deterministic), {"return": point.deterministic}
            told = f"return {point.deterministic:.4g}, best {best:.4g}"
            tell(point.step, told, numbers)

        selection = learn_and_select(
            learner,
            recorder or env,
            tested,
            count,
            every=protocol.every_true if on_true else protocol.every,
            noisy=0 if on_true else protocol.noisy,
            seed=stream(steps.seed, "select", kind, update),
            callback=report,
            random_steps=RANDOM_STEPS if start is None else 0,
            episodes=protocol.episodes,
            finalists=protocol.finalists,
            final_episodes=protocol.final_episodes,
        )
    summary: dict[str, Any] = {
        "simulated_steps": count,
        "updates": learner.updates - updates,
        "best_step": selection.best.step,
        "return_model": selection.best.deterministic,
        "seconds": time.perf_counter() - begin,
    }
    learner.restore(selection.networks)
    if selection.final is not None:
        summary["return_model"] = selection.final
    summary["held"] = simulator.held if isinstance(simulator, CorrectedSimulator) else 0
    taken = recorder.taken(difference if all_again else None) if recorder else None
    return Training(learner, selection.curve, summary, taken)


def learnt_on(steps: Steps, on: Model | Simulator | None) -> tuple[Simulator, Task]:
    """The simulator and the task that a training on a simulator learns."""
    task = steps.system.task
    if isinstance(on, Simulator | None):
        return on or steps.system.nominal, task
    if steps.uncertainty_penalty:
        task = PenalisedTask.around(task, on.difference, on.data, steps.uncertainty_penalty)
    return steps.corrected(on), task


def state_columns(simulator: Simulator) -> StateColumns:
    """What policies that learn on a simulator see of its states, for ``act_on``."""
    seen = observed_channels(simulator)

    def column(c: Channel) -> Column:
        scale, memory = float(c.scale), c.kind == "memory"
        return Column(str(c.name), str(c.unit), scale, bool(c.angle), c in seen, memory)

    return StateColumns(tuple(map(column, simulator.state_channels)))


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
