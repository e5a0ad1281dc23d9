"""The paper's loop: collect with the last policy, refit the difference model, retrain.

    idealised policy                                       trained on f
    repeat:  collect   true transitions with the last policy and exploration noise
             fit       d(s, a) = s'_true - s'_idl on all transitions so far
             train     DDPG on f + d, from the last policy, with the first update's replay
             measure   on the true system: the return, and d's accuracy where the policy goes

(paper, section III-B and figure 2). The control trains on as long without d: what it gains is
not the difference model's doing. The baselines learn on the true system itself: from
nothing (cold) or from the idealised policy (warm); a cold start with a generous budget is the
reference (true).

Every step is a stage: a pure function of its settings and of earlier stages, kept on disk.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from sklearn.base import BaseEstimator

from policy.config import DDPGConfig
from studies.learning.budget import Budget
from studies.learning.earlier import Earlier, ReplayRule
from studies.learning.outcome import Outcome, policy_record, record_key
from studies.learning.problem import Problem
from studies.learning.seeds import describe, seeded
from studies.learning.stages import Stages
from studies.learning.steps import LearningSteps
from studies.running.files import read_json
from studies.running.progress import Progress


def learn_by_difference(
    problem: Problem,
    estimator: BaseEstimator,
    budget: Budget,
    ddpg: DDPGConfig,
    seed: int,
    stages: Stages,
    progress: Progress,
    caution: float = 0.0,
    replay: ReplayRule = "first",
    corrected: Mapping[str, Any] | None = None,
) -> Outcome:
    """The loop of the paper, then the baselines that the budget asks for.

    Args:
        problem: What to control.
        estimator: Learns the difference; cloned, never changed.
        budget: Samples and steps.
        ddpg: Settings of every DDPG agent, the baselines' included.
        seed: Everything follows from it.
        stages: Where finished steps are kept and found again.
        progress: Told what is going on.
        caution: Reward lost per step for each multiple of the typical spread of the difference
            model; 0 learns as in the paper.
        replay: What a training after an update learns from beside its own transitions, see
            ``Earlier``; the control learns from its own in the same way.
        corrected: Settings (``sims.loading.load_simulator``) of a simulator with what the
            idealised one lacked: a policy is trained on it as well, without a true sample.

    Returns:
        Records, and the folders that hold the policies and the models.
    """
    steps = LearningSteps(problem, seeded(estimator, seed), ddpg, seed, progress, replay)
    loop = Loop(steps, budget, stages)
    loop.idealised()
    loop.updates(caution)
    loop.control()
    if corrected is not None:
        loop.corrected(corrected)
    loop.on_the_true_system()
    return loop.outcome


class Loop:
    """The loop in its stages.

    Attributes:
        outcome: What they have left so far.
    """

    def __init__(self, steps: LearningSteps, budget: Budget, stages: Stages) -> None:
        self.steps, self.budget, self.stages = steps, budget, stages
        self.outcome = Outcome([], [], {}, [])
        # What every training depends on.
        self._common = {
            "problem": steps.problem.description,
            "ddpg": dataclasses.asdict(steps.ddpg),
            "seed": steps.seed,
            "replay": steps.replay,
        }

    def idealised(self) -> None:
        """The policy that all others begin with."""
        count = self.budget.idealised_steps
        folder = self.stages.run(
            "idealised",
            {**self._common, "steps": count},
            lambda folder: self.steps.train_idealised(folder, count),
        )
        self._keep(folder, "idealised")

    def updates(self, caution: float) -> None:
        """Collect, fit, train and measure, as often as the budget says."""
        earlier, samples = self._begin(), list[Path]()
        for iteration in range(1, self.budget.iterations + 1):
            samples.append(self._collected(earlier.policy, iteration))
            model = self._fitted(samples)
            policy = self._trained(model, earlier, caution)
            accuracy = self.stages.run(
                "measure",
                {"model": model, "policy": policy, "seed": self.steps.seed},
                partial(self.steps.measure, model=model, policy=policy),
            )
            seen = {"iteration": iteration, "true_samples": iteration * self.budget.true_samples}
            self._keep(policy, "difference", **seen)
            self.outcome.models.append(model)
            self.outcome.accuracy.append(
                seen | read_json(accuracy / "accuracy.json") | read_json(model / "fit.json")
            )
            earlier = earlier.then(policy)

    def control(self) -> None:
        """As much training after each update, on the idealised simulator as it is."""
        earlier, count = self._begin(), self.budget.control_steps
        for iteration in range(1, self.budget.iterations + 1 if count else 1):
            policy = self.stages.run(
                "control",
                {**self._common, **earlier.settings(), "round": iteration, "steps": count},
                partial(self.steps.train_control, earlier=earlier, steps=count),
            )
            self._keep(policy, "control", iteration=iteration)
            earlier = earlier.then(policy)

    def corrected(self, settings: Mapping[str, Any]) -> None:
        """A policy that learns on a simulator that was corrected by name."""
        earlier, count = self._begin(), self.budget.corrected_steps
        policy = self.stages.run(
            "corrected",
            {**self._common, **earlier.settings(), "corrected": settings, "steps": count},
            lambda folder: self.steps.train_named(folder, settings, earlier, count),
        )
        self._keep(policy, "corrected")

    def on_the_true_system(self) -> None:
        """The reference and the baselines."""
        reference, baseline = self.budget.true_steps, self.budget.baseline_steps
        # The reference and the cold start are one experiment, read at two budgets.
        if longest := max(reference, baseline):
            cold = self.stages.run(
                "cold",
                {**self._common, "steps": longest},
                lambda folder: self.steps.train_on_true(folder, None, longest),
            )
            if reference:
                self.outcome.policies.append(policy_record(cold, "true", reference))
                self.outcome.folders["true"] = cold
            if baseline:
                self.outcome.policies.append(policy_record(cold, "cold", baseline))
        if baseline:
            start = self.outcome.folders["idealised"]
            warm = self.stages.run(
                "warm",
                {**self._common, "policy": start, "steps": baseline},
                lambda folder: self.steps.train_on_true(folder, start, baseline),
            )
            self.outcome.policies.append(policy_record(warm, "warm", baseline))
            self.outcome.folders["warm"] = warm

    def _collected(self, policy: Path, iteration: int) -> Path:
        count = self.budget.true_samples
        return self.stages.run(
            "collect",
            {**self._common, "policy": policy, "samples": count, "round": iteration},
            lambda folder: self.steps.collect(folder, policy, count, iteration),
        )

    def _fitted(self, samples: list[Path]) -> Path:
        return self.stages.run(
            "fit",
            {
                "problem": self.steps.problem.description,
                "estimator": describe(self.steps.estimator),
                "samples": list(samples),
            },
            lambda folder: self.steps.fit(folder, samples),
        )

    def _trained(self, model: Path, earlier: Earlier, caution: float) -> Path:
        count = self.budget.difference_steps
        settings = {**self._common, **earlier.settings(), "model": model, "steps": count}
        if caution:
            settings["caution"] = caution
        return self.stages.run(
            "train",
            settings,
            lambda folder: self.steps.train_corrected(folder, model, earlier, count, caution),
        )

    def _begin(self) -> Earlier:
        return Earlier.begin(self.outcome.folders["idealised"], self.steps.replay)

    def _keep(self, folder: Path, name: str, **more: int) -> None:
        """Record a policy that was learnt on a simulator."""
        record = policy_record(folder, name) | more
        self.outcome.policies.append(record)
        self.outcome.folders[record_key(record)] = folder
