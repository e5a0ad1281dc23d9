"""The paper's loop: collect with the last policy, refit the difference model, retrain.

    idealised policy                                       trained on f
    repeat:  collect   true transitions with the last policy and exploration noise
             fit       d(s, a) = s'_true - s'_idl on all transitions so far
             train     on f + d, from the last policy, with the first update's replay
             measure   on the true system: the return, and d's accuracy where the policy goes

(paper, section III-B and figure 2). The control trains on as long without d: what it gains is
not the difference model's doing. The baselines learn on the true system itself: from
nothing (cold) or from the idealised policy (warm); a cold start with a generous budget is the
reference (true).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol, get_args, runtime_checkable

import numpy as np
from sklearn.base import BaseEstimator

from policy.config import DDPGConfig
from policy.learner import OURS, Algorithm
from residual.estimator import check_regressor
from sims.protocol import EvaluationProtocol
from sims.simulator import Simulator
from sims.system import System
from sims.tasks import Task
from studies.learning.budget import Budget
from studies.learning.kept import OnDisk
from studies.learning.outcome import Learnt
from studies.learning.steps import Steps
from studies.learning.warm_start import ReplayRule, WarmStart
from studies.running.progress import Bars, Progress

#: Samples for an update, updates, and steps of a training, unless a budget says otherwise.
USUAL = (450, 2, 20_000)


def run_loop(steps: Steps, budget: Budget, corrected: Simulator | None = None) -> Learnt:
    """The loop, then the control and the baselines that the budget asks for.

    Args:
        steps: The steps for one system, estimator, algorithm and seed.
        budget: Samples and steps.
        corrected: The simulator with what it lacked: a policy is trained on it as well, from the
            idealised one, without a true sample.
    """
    learnt, samples, model = Learnt(steps.system.description()), [], None
    policy = idealised = steps.train("idealised", budget.idealised_steps)
    learnt.add_policy("idealised", idealised)
    start = begin = WarmStart.begin(idealised, steps.replay)
    for update in range(1, budget.iterations + 1):
        samples.append(steps.collect(policy, budget.true_samples, update, model))
        learnt.add_samples(update, samples[-1])
        model = steps.fit(samples)
        policy = steps.train("difference", budget.difference_steps, start, on=model, update=update)
        accuracy = steps.measure(model, policy, update)
        learnt.add_update(update, update * budget.true_samples, policy, model, accuracy)
        start = start.then(policy)

    start = begin
    for update in range(1, budget.iterations + 1 if budget.control_steps else 1):
        control = steps.train("control", budget.control_steps, start, update=update)
        learnt.add_policy("control", control, iteration=update)
        start = start.then(control)
    if corrected is not None:
        named = steps.train("corrected", budget.steps_on_corrected, begin, on=corrected)
        learnt.add_policy("corrected", named)
    # The reference and the cold start are one experiment, read at two budgets.
    if longest := max(budget.true_steps, budget.baseline_steps):
        cold = steps.train("cold", longest)
        learnt.add_on_truth("true", cold, budget.true_steps)
        learnt.add_on_truth("cold", cold, budget.baseline_steps)
    if budget.baseline_steps:
        warm = steps.train("warm", budget.baseline_steps, idealised)
        learnt.add_on_truth("warm", warm, budget.baseline_steps)
    return learnt


def learn_by_difference(
    nominal: Simulator,
    true: Any,
    task: Task,
    *,
    estimator: BaseEstimator | None = None,
    samples: int = USUAL[0],
    updates: int = USUAL[1],
    steps: int = USUAL[2],
    seed: int = 0,
    learner: str | type = OURS,
    learner_options: Mapping[str, Any] | None = None,
    ddpg: DDPGConfig | None = None,
    replay: ReplayRule = "first",
    uncertainty_penalty: float = 0.0,
    evaluation: EvaluationProtocol | None = None,
    state_of: Callable[[Any, Any], Any] | None = None,
    budget: Budget | None = None,
    keep: str | Path | None = None,
    progress: Progress | None = None,
    name: str = "system",
) -> Learnt:
    """Learn to control a system from few samples of it: the loop of the commands, in memory.

    Args:
        nominal: The simulator that one has.
        true: The system that one wants to control, see ``System``.
        task: Reward, termination, start states, horizon.
        estimator: Learns the difference, any scikit-learn regressor; by default
            ``residual.GaussianProcess()``.
        samples: True transitions for each update.
        updates: Updates of the difference model.
        steps: Simulated steps of training, at first and after each update.
        seed: Everything random follows from it.
        learner: ``"policy.DDPG"``, or an off-policy algorithm of Stable-Baselines3, the class
            or its import path.
        learner_options: Keyword arguments of that class.
        ddpg: Settings of ``policy.DDPG``.
        replay: What a training after an update learns from again, see ``WarmStart``.
        uncertainty_penalty: Reward lost per step for each multiple of the typical spread of the
            difference model; 0 learns as in the paper.
        evaluation: How policies are tested.
        state_of: Reads the state of ``true``, see ``System``.
        budget: In place of ``samples``, ``updates`` and ``steps``, with baselines if wanted, such
            as ``Budget(450, 2, 20_000, 20_000, control_steps=20_000)``.
        keep: Folder in which finished steps are kept and found again; by default nothing is.
        progress: Told what is going on; by default bars on stderr or in the notebook.
        name: Of the system, for the report.

    Returns:
        Policies, difference models and their accuracy, with ``report`` and ``plot``.

    Raises:
        TypeError: An argument is of another type than it should be.
        ValueError: The parts do not fit together, or a budget is too small to learn anything.
    """
    _expect("estimator", estimator, Regressor, "residual.Linear()")
    if estimator is not None:
        check_regressor(estimator, nominal)
    _expect("evaluation", evaluation, EvaluationProtocol, "EvaluationProtocol(every=1000)")
    _expect("ddpg", ddpg, DDPGConfig, "DDPGConfig(hidden=(64, 64))")
    _expect("budget", budget, Budget, "Budget(450, 2, 20_000, 20_000)")
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise TypeError(f"seed is {seed!r}, expected a whole number from 0, such as seed=0")
    from residual.gaussian_process import GaussianProcess

    path = learner if isinstance(learner, str) else f"{learner.__module__}.{learner.__qualname__}"
    system = System(
        name, nominal, true, task, evaluation or EvaluationProtocol(), state_of=state_of
    )
    algorithm = Algorithm(path, ddpg or DDPGConfig(), learner_options or {})
    if ddpg is not None and path != OURS:
        raise ValueError(f"ddpg has settings of {OURS}, but another learner is given")
    if budget is None:
        budget = Budget(samples, updates, steps, steps)
    elif (samples, updates, steps) != USUAL:
        raise ValueError(
            f"samples={samples}, updates={updates} and steps={steps} are given beside a budget, "
            f"which has its own ({budget.true_samples}, {budget.iterations}, "
            f"{budget.idealised_steps}): say them there"
        )
    if replay not in get_args(ReplayRule):
        raise ValueError(f"replay is {replay!r}, expected one of {get_args(ReplayRule)}")
    penalty = uncertainty_penalty
    if not isinstance(penalty, int | float | np.number) or not 0 <= penalty < np.inf:
        raise ValueError(f"uncertainty_penalty is {penalty!r}, expected a number from 0")
    if keep is not None and Path(keep).exists() and not Path(keep).is_dir():
        raise ValueError(f"keep is {keep}, which is a file: give a folder, or a name for one")
    budget.check(algorithm, replay == "all")
    system.check()
    loop = Steps(
        system,
        GaussianProcess() if estimator is None else estimator,
        algorithm,
        int(seed),
        OnDisk(keep) if keep else None,
        progress or Bars(),
        replay,
        uncertainty_penalty,
        scaled=True,
    )
    return run_loop(loop, budget)


@runtime_checkable
class Regressor(Protocol):
    """What every scikit-learn regressor has, whatever it derives from."""

    fit: Any
    predict: Any
    get_params: Any


def _expect(name: str, given: Any, kind: type, such_as: str) -> None:
    """Refuse an argument that is neither left out nor an object of a class."""
    if given is None or (isinstance(given, kind) and not isinstance(given, type)):
        return
    # Texts are import paths on the command line, and mappings settings.
    what = f"the class {given.__name__}" if isinstance(given, type) else f"{given!r:.60}"
    raise TypeError(f"{name} is {what}, expected an object such as {name}={such_as}")
