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
from pathlib import Path
from typing import Any

from sklearn.base import BaseEstimator

from policy.config import DDPGConfig
from studies.learning.earlier import Earlier, ReplayRule
from studies.learning.problem import Problem
from studies.learning.seeds import describe, seeded
from studies.learning.stages import Stages
from studies.learning.steps import LearningSteps
from studies.running.files import read_json
from studies.running.progress import Progress

Record = dict[str, Any]


@dataclasses.dataclass(frozen=True)
class Budget:
    """How much is sampled and trained.

    Args:
        true_samples: True transitions collected before each update of the difference model.
        iterations: Updates of the difference model.
        idealised_steps: Simulated steps that train the idealised policy.
        difference_steps: Simulated steps on the corrected simulator after each update.
        true_steps: True steps that train the reference policy on the true system; 0 skips it.
        baseline_steps: True steps given to the cold and to the warm start; 0 skips them.
        control_steps: Simulated steps of the control for each update; 0 skips it.
        corrected_steps: Simulated steps on the simulator that was corrected by name, if there is
            one.
    """

    true_samples: int = 3750
    iterations: int = 2
    idealised_steps: int = 20_000
    difference_steps: int = 20_000
    true_steps: int = 0
    baseline_steps: int = 0
    control_steps: int = 0
    corrected_steps: int = 20_000

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            least = 2 if field.name == "true_samples" else 0
            if (value := getattr(self, field.name)) < least:
                raise ValueError(f"{field.name} is {value}, expected at least {least}")


@dataclasses.dataclass(frozen=True)
class Outcome:
    """What the loop leaves behind.

    Attributes:
        policies: One record per policy, in the order learnt (docs/results.md).
        accuracy: One record per update of the difference model.
        folders: Folder of each policy, by a name such as ``"idealised"``, ``"difference-1"``.
        models: Folder of each difference model, one per update.
    """

    policies: list[Record]
    accuracy: list[Record]
    folders: dict[str, Path]
    models: list[Path]


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
    estimator = seeded(estimator, seed)
    steps = LearningSteps(problem, estimator, ddpg, seed, progress, replay)
    common = {
        "problem": problem.description,
        "ddpg": dataclasses.asdict(ddpg),
        "seed": seed,
        "replay": replay,
    }
    named = describe(estimator)

    idealised = stages.run(
        "idealised",
        {**common, "steps": budget.idealised_steps},
        lambda folder: steps.train_idealised(folder, budget.idealised_steps),
    )
    policies = [steps.record(idealised, "idealised")]
    folders = {"idealised": idealised}

    models: list[Path] = []
    samples: list[Path] = []
    accuracy: list[Record] = []
    policy, earlier = idealised, Earlier.begin(idealised, replay)
    for iteration in range(1, budget.iterations + 1):
        collected = stages.run(
            "collect",
            {
                **common,
                "policy": earlier.policy,
                "samples": budget.true_samples,
                "round": iteration,
            },
            lambda folder: steps.collect(folder, earlier.policy, budget.true_samples, iteration),  # noqa: B023
        )
        samples.append(collected)
        model = stages.run(
            "fit",
            {"problem": problem.description, "estimator": named, "samples": list(samples)},
            lambda folder: steps.fit(folder, samples),
        )
        models.append(model)
        policy = stages.run(
            "train",
            {
                **common,
                **earlier.settings(),
                "model": model,
                "steps": budget.difference_steps,
                **({"caution": caution} if caution else {}),
            },
            lambda folder: steps.train_corrected(
                folder,
                model,  # noqa: B023
                earlier,  # noqa: B023
                budget.difference_steps,
                caution,
            ),
        )
        earlier = earlier.then(policy)
        measured = stages.run(
            "measure",
            {"model": model, "policy": policy, "seed": seed},
            lambda folder: steps.measure(folder, model, policy),  # noqa: B023
        )
        folders[f"difference-{iteration}"] = policy
        seen = {"iteration": iteration, "true_samples": iteration * budget.true_samples}
        policies.append(steps.record(policy, "difference") | seen)
        errors = read_json(measured / "accuracy.json")
        accuracy.append(seen | errors | read_json(model / "fit.json"))

    earlier = Earlier.begin(idealised, replay)
    for iteration in range(1, budget.iterations + 1 if budget.control_steps else 1):
        policy = stages.run(
            "control",
            {**common, **earlier.settings(), "round": iteration, "steps": budget.control_steps},
            lambda folder: steps.train_control(folder, earlier, budget.control_steps),  # noqa: B023
        )
        earlier = earlier.then(policy)
        folders[f"control-{iteration}"] = policy
        policies.append(steps.record(policy, "control") | {"iteration": iteration})

    if corrected is not None:
        earlier = Earlier.begin(idealised, replay)
        folders["corrected"] = stages.run(
            "corrected",
            {
                **common,
                **earlier.settings(),
                "corrected": corrected,
                "steps": budget.corrected_steps,
            },
            lambda folder: steps.train_named(folder, corrected, earlier, budget.corrected_steps),
        )
        policies.append(steps.record(folders["corrected"], "corrected"))

    # The reference and the cold start are one experiment, read at two budgets.
    if longest := max(budget.true_steps, budget.baseline_steps):
        cold = stages.run(
            "cold",
            {**common, "steps": longest},
            lambda folder: steps.train_on_true(folder, None, longest),
        )
        if budget.true_steps:
            policies.append(steps.record(cold, "true", budget.true_steps))
            folders["true"] = cold
        if budget.baseline_steps:
            policies.append(steps.record(cold, "cold", budget.baseline_steps))
    if budget.baseline_steps:
        folders["warm"] = stages.run(
            "warm",
            {**common, "policy": idealised, "steps": budget.baseline_steps},
            lambda folder: steps.train_on_true(folder, idealised, budget.baseline_steps),
        )
        policies.append(steps.record(folders["warm"], "warm", budget.baseline_steps))
    return Outcome(policies, accuracy, folders, models)
