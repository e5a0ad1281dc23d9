"""The steps of difference learning; each writes what it computed into the folder it is given.

Folders of policies hold ``agent.safetensors``, ``curve.json``, ``summary.json``,
``rollout.npz`` (one episode on the true system) and, if all is to be replayed,
``simulated.npz``. Folders of models hold ``fit.json`` and, for the estimators of this package,
``difference.safetensors``; any other estimator is refitted from the samples when it is needed,
because its only file format would be a pickle.
"""

from __future__ import annotations

import contextlib
import dataclasses
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from sklearn.base import BaseEstimator

from policy.config import DDPGConfig
from policy.ddpg import DDPG
from policy.evaluate import Rollout, collect, rollout
from policy.mlp import MlpPolicy
from policy.noise import OrnsteinUhlenbeck
from policy.selection import Point, learn_and_select
from residual.accuracy import accuracy_along, uniform_rollouts
from residual.caution import CautiousTask
from residual.corrected import CorrectedSimulator
from residual.difference import DifferenceModel
from residual.persistence import load, save
from residual.trajectories import Transitions
from sims.environment import SimulatorEnv
from sims.loading import load_simulator
from sims.simulator import Array, Simulator
from studies.learning.earlier import Earlier, ReplayRule
from studies.learning.problem import Problem
from studies.learning.seeds import derived_seed
from studies.learning.simulated import FILE, Recorder, recorded, remember
from studies.running.files import atomic_write_json
from studies.running.progress import Progress

# Policies learnt from nothing begin with random actions, the baselines too.
RANDOM_STEPS = 1000


@dataclasses.dataclass(frozen=True)
class LearningSteps:
    """The steps for one problem, estimator and seed."""

    problem: Problem
    estimator: BaseEstimator
    ddpg: DDPGConfig
    seed: int
    progress: Progress
    replay: ReplayRule = "first"

    def train_idealised(self, folder: Path, steps: int) -> None:
        """The policy that one gets from the idealised simulator alone."""
        agent = self._agent(self.problem.cold_sigma)
        env = self._environments(self.problem.idealised)
        self._train(folder, agent, env, steps, "train on the idealised model", RANDOM_STEPS)

    def collect(self, folder: Path, policy: Path, samples: int, iteration: int) -> None:
        """True transitions under a policy with exploration noise."""
        seed = derived_seed(self.seed, "collect", str(iteration))
        rollouts = collect(
            DDPG.load(policy / "agent.safetensors").policy,
            self.problem.environment(self.problem.true),
            samples,
            seed,
            self._noise(seed),
        )
        transitions(rollouts).save(folder / "transitions.npz")

    def fit(self, folder: Path, samples: Sequence[Path]) -> None:
        """The difference model on all transitions so far."""
        data = Transitions.join([Transitions.load(part / "transitions.npz") for part in samples])
        data.save(folder / "transitions.npz")
        with self.progress.task(f"fit {type(self.estimator).__name__} to {len(data)}", 1) as tell:
            begin = time.perf_counter()
            model = DifferenceModel(self.estimator, self.problem.idealised).fit(data)
            seconds = time.perf_counter() - begin
            tell(1, "")
        # Other libraries' estimators have no file format but pickle: they are fitted again.
        with contextlib.suppress(TypeError):
            save(model, folder / "difference.safetensors")
        atomic_write_json(folder / "fit.json", {"fit_seconds": seconds})

    def train_corrected(
        self, folder: Path, model: Path, earlier: Earlier, steps: int, caution: float = 0.0
    ) -> None:
        """DDPG on the corrected simulator, from the last policy's networks.

        With ``caution`` the reward is less where the difference model is unsure; see
        ``residual.caution``.
        """
        corrected = self.corrected(model)
        task = self.problem.task
        if caution:
            data = Transitions.load(model / "transitions.npz")
            task = CautiousTask.around(task, corrected.difference, data, caution)
        env = SimulatorEnv(corrected, task), SimulatorEnv(corrected, task)
        agent = self._continued(earlier, env[0])
        title = "train on the corrected model"
        self._train(folder, agent, env, steps, title, difference=corrected.difference)

    def train_control(self, folder: Path, earlier: Earlier, steps: int) -> None:
        """As ``train_corrected``, without a difference model: what more training alone brings."""
        env = self._environments(self.problem.idealised)
        agent = self._continued(earlier, env[0])
        self._train(folder, agent, env, steps, "train on, no difference model")

    def train_named(
        self, folder: Path, settings: Mapping[str, Any], earlier: Earlier, steps: int
    ) -> None:
        """DDPG on a simulator that was corrected by name, from the last policy's networks.

        What was simulated before is simulated again, since no difference can be added to it.
        """
        simulator = load_simulator(settings)
        env = self._environments(simulator)
        agent = self._continued(earlier, env[0], again=True)
        self._train(folder, agent, env, steps, f"train on {simulator.name}, corrected")

    def train_on_true(self, folder: Path, start: Path | None, steps: int) -> None:
        """A baseline: DDPG on the true system, from nothing or from a policy's networks."""
        if start is None:
            agent, title, random_steps = (
                self._agent(self.problem.cold_sigma),
                "cold start",
                RANDOM_STEPS,
            )
        else:
            agent, title, random_steps = self._agent(), "warm start", 0
            agent.restore(DDPG.load(start / "agent.safetensors").networks())
        title += " on the true system"
        env = self._environments(self.problem.true)
        self._train(folder, agent, env, steps, title, random_steps)

    def measure(self, folder: Path, model: Path, policy: Path) -> None:
        """Accuracy of the model along fresh true rollouts of the policy trained on it."""
        seed = derived_seed(self.seed, "measure")
        corrected = self.corrected(model)
        learnt = DDPG.load(policy / "agent.safetensors").policy
        env = self.problem.environment(self.problem.true)
        tests = self.problem.tests
        steps = round(tests.visited_seconds / corrected.dt)
        runs = [rollout(learnt, env, seed, max_steps=steps)]
        runs += [
            rollout(learnt, env, seed + k, self._noise(seed + k), steps)
            for k in range(1, tests.visited_rollouts)
        ]
        # A run that fell ends early; all are cut to the shortest so that they stack.
        shortest = min(len(run.rewards) for run in runs)
        states = np.stack([visited(run)[: shortest + 1] for run in runs])
        actions = np.stack([run.actions[:shortest] for run in runs])
        rng = np.random.default_rng(seed)
        if self.problem.elsewhere:
            uniform = self.problem.elsewhere(rng)
        else:
            uniform = uniform_rollouts(self.problem.true, rng)
        stride = tests.visited_stride
        atomic_write_json(
            folder / "accuracy.json",
            {
                "visited": accuracy_along(corrected, states, actions, stride=stride),
                "uniform": accuracy_along(corrected, *uniform, stride=stride),
            },
        )

    def corrected(self, model: Path) -> CorrectedSimulator:
        """The idealised simulator with the difference model of a folder."""
        simulator = self.problem.idealised
        saved = model / "difference.safetensors"
        if saved.exists():
            return CorrectedSimulator(simulator, load(saved, simulator))
        data = Transitions.load(model / "transitions.npz")
        return CorrectedSimulator(simulator, DifferenceModel(self.estimator, simulator).fit(data))

    def _train(
        self,
        folder: Path,
        agent: DDPG,
        environments: tuple[SimulatorEnv, SimulatorEnv],
        steps: int,
        title: str,
        random_steps: int = 0,
        difference: DifferenceModel | None = None,
    ) -> None:
        env, tested = environments
        on_true = env.simulator is self.problem.true
        tests = self.problem.tests
        recorder = Recorder(env) if self.replay == "all" and not on_true else None
        begin = time.perf_counter()
        with self.progress.task(title, steps) as tell:

            def report(point: Point) -> None:
                numbers = {"return": point.deterministic}
                tell(point.step, f"return {point.deterministic:.0f}", numbers)

            selection = learn_and_select(
                agent,
                recorder or env,
                tested,
                steps,
                every=tests.every_true if on_true else tests.every,
                # On the true system the test is the measure itself.
                noisy=0 if on_true else tests.noisy,
                seed=derived_seed(self.seed, "select"),
                callback=report,
                random_steps=random_steps,
                episodes=tests.episodes,
                finalists=tests.finalists,
                final_episodes=tests.final_episodes,
            )
        seconds = time.perf_counter() - begin
        agent.restore(selection.networks)
        # What was simulated is kept once: as it was, or as the idealised simulator said it.
        agent.save(folder / "agent.safetensors", replay=self.replay == "first")
        if recorder:
            recorder.save(folder / FILE, difference)
        atomic_write_json(
            folder / "curve.json", [dataclasses.asdict(point) for point in selection.curve]
        )
        outcome = {
            "simulated_steps": steps,
            "return_model": (
                selection.best.deterministic if selection.final is None else selection.final
            ),
            "seconds": seconds,
        }
        atomic_write_json(folder / "summary.json", outcome | self._test(folder, selection.policy))

    def _test(self, folder: Path, policy: MlpPolicy) -> dict[str, Any]:
        """Rollouts on the true system, the first of them kept: the mean return and measures."""
        env = self.problem.environment(self.problem.true)
        runs = [
            rollout(policy, env, self.seed + k) for k in range(self.problem.tests.true_episodes)
        ]
        first = runs[0]
        np.savez_compressed(
            folder / "rollout.npz",
            states=visited(first),
            actions=first.actions,
            rewards=first.rewards,
        )
        result: dict[str, Any] = {"return_true": float(np.mean([run.total for run in runs]))}
        if self.problem.measures:
            result["tests"] = [{"return": run.total, **self.problem.measures(run)} for run in runs]
        return result

    def _environments(self, simulator: Simulator) -> tuple[SimulatorEnv, SimulatorEnv]:
        """One to learn in and one to be tested in."""
        return self.problem.environment(simulator), self.problem.environment(simulator)

    def _continued(self, earlier: Earlier, env: SimulatorEnv, again: bool = False) -> DDPG:
        """An agent with a policy's networks, and with what there is to be learnt from again."""
        agent = self._agent()
        if earlier.rule == "all":
            title, rows = "take up what was simulated", recorded(earlier.trainings)
            with self.progress.task(title, rows) as tell:
                remember(agent, env, earlier.trainings, again, lambda done: tell(done, ""))
        elif earlier.trainings:
            (first,) = earlier.trainings
            agent = DDPG.load(first / "agent.safetensors")
        agent.restore(DDPG.load(earlier.policy / "agent.safetensors").networks())
        return agent

    def _agent(self, sigma: float | None = None) -> DDPG:
        env = self.problem.environment(self.problem.idealised)
        config = dataclasses.replace(self.ddpg, noise_sigma=sigma) if sigma else self.ddpg
        return DDPG.for_env(env, config, self.seed)

    def _noise(self, seed: int) -> OrnsteinUhlenbeck:
        size = len(self.problem.true.action_channels)
        c = self.ddpg
        return OrnsteinUhlenbeck(size, c.noise_sigma, c.noise_theta, np.random.default_rng(seed))


def transitions(rollouts: Sequence[Rollout]) -> Transitions:
    """The steps of rollouts, each its own episode."""
    parts = [
        Transitions(
            visited(run)[:-1],
            run.actions,
            visited(run)[1:],
            np.zeros(len(run.rewards), dtype=np.int64),
        )
        for run in rollouts
    ]
    return Transitions.join(parts)


def visited(run: Rollout) -> Array:
    """The simulator's states along a rollout, shape (T + 1, n_s)."""
    if run.states is None:
        raise ValueError("the environment does not report info['state'], the simulator's state")
    return run.states
