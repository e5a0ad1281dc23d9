"""Which of the policies seen during learning to keep.

Returns oscillate by hundreds from one evaluation to the next, so the last policy is a poor
choice. The one with the best single rollout is also risky: on a corrected simulator it may
live from an error of the correction. The rule here averages one rollout without noise, or a
few from different starts, and a few with a little noise, all in the environment that the agent
learns in. The best of many noisy scores is partly luck, so the best few can be scored once more,
from other starts; that second score alone then decides.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from policy.ddpg import Progress
from policy.evaluate import Policy, evaluate
from policy.learner import Learner
from policy.noise import OrnsteinUhlenbeck


@dataclasses.dataclass(frozen=True)
class Point:
    """One evaluation while learning.

    Args:
        step: Environment steps learnt in this call before the evaluation.
        score: What the rule judges by: mean return of the rollouts with and without noise.
        deterministic: Mean return of the rollouts without noise.
    """

    step: int
    score: float
    deterministic: float


@dataclasses.dataclass(frozen=True)
class Selection:
    """The best policy of one call of ``learn_and_select``.

    Args:
        networks: The learner's networks when its score was highest, for ``restore``.
        best: The evaluation then.
        curve: All evaluations in order.
        final: Mean return of the policy in the final, if there was one: it was
            chosen among the finalists only, so it is hardly flattered by luck.
    """

    networks: dict[str, NDArray[Any]]
    best: Point
    curve: tuple[Point, ...]
    final: float | None = None

    def __repr__(self) -> str:
        return f"Selection({self.best}, of {len(self.curve)} evaluations)"


def score(
    policy: Policy,
    env: gymnasium.Env[Any, Any],
    noisy: int,
    sigma: float,
    theta: float,
    seed: int,
    episodes: int = 1,
) -> tuple[float, float]:
    """Mean return of ``episodes`` rollouts without noise and ``noisy`` with it; and of the former.

    Policies scored with one seed see the same start states and the same noise.
    """
    deterministic = evaluate(policy, env, episodes, seed)
    if not noisy:
        return float(deterministic.mean()), float(deterministic.mean())
    size = int(np.prod(env.action_space.shape or ()))
    noise = OrnsteinUhlenbeck(size, sigma, theta, np.random.default_rng(seed))
    disturbed = evaluate(policy, env, noisy, seed + episodes, noise)
    return float(np.concatenate([deterministic, disturbed]).mean()), float(deterministic.mean())


def learn_and_select(
    agent: Learner,
    env: gymnasium.Env[Any, Any],
    evaluation_env: gymnasium.Env[Any, Any],
    steps: int,
    every: int = 1000,
    noisy: int = 3,
    sigma: float = 0.03,
    seed: int = 0,
    callback: Callable[[Point], bool | None] | None = None,
    random_steps: int = 0,
    episodes: int = 1,
    finalists: int = 1,
    final_episodes: int = 0,
    theta: float = 0.15,
) -> Selection:
    """Learn, score the policy now and then, and keep the best.

    The policy is scored at the start, so that what earlier learning brought can win, then
    after each ``every`` steps and at the end, unless no update has changed it since. The agent
    itself ends with the last networks; ``agent.restore(selection.networks)`` goes back.

    Args:
        agent: Learns on, from where it stands.
        env: Where it learns.
        evaluation_env: A second instance of the same environment, so that scoring does not
            disturb the episode being learnt from.
        steps: Environment steps to learn for.
        every: Steps between evaluations.
        noisy: Rollouts with noise per evaluation.
        sigma: Their noise, as ``DDPGConfig.noise_sigma``. As much as in exploration would
            prefer policies that are safe under noise to those that are good without it.
        seed: Seed of the evaluations' start states and noise.
        callback: Called with every evaluation; learning stops if it returns True.
        random_steps: As in ``DDPG.learn``.
        episodes: Rollouts without noise per evaluation, each from its own start state.
        finalists: How many of the best policies are rolled out once more at the end.
        final_episodes: Rollouts of each finalist, without noise and from other starts; their mean
            decides. With 0 the best score does.
        theta: As ``DDPGConfig.noise_theta``, of the noise of evaluations.
    """
    if env.unwrapped is evaluation_env.unwrapped:
        raise ValueError("env and evaluation_env are one object: make the environment twice")
    curve: list[Point] = []
    most = finalists if final_episodes else 1
    kept: list[tuple[Point, dict[str, NDArray[Any]]]] = []
    scored_at = -1

    def consider(step: int) -> bool:
        nonlocal scored_at
        if agent.updates == scored_at:
            return False
        scored_at = agent.updates
        scores = score(agent.policy, evaluation_env, noisy, sigma, theta, seed, episodes)
        point = Point(step, *scores)
        curve.append(point)
        if len(kept) < most or point.score > kept[-1][0].score:
            kept.append((point, agent.networks()))
            # Of equals the earlier one: the sort is stable.
            kept[:] = sorted(kept, key=lambda one: -one[0].score)[:most]
        return bool(callback and callback(point))

    def on_progress(progress: Progress) -> bool:
        return consider(progress.step)

    if not consider(0):
        agent.learn(env, steps, on_progress, every, random_steps)
    if not final_episodes:
        best, networks = kept[0]
        return Selection(networks, best, tuple(curve))
    last, fresh, means = agent.networks(), seed + episodes + noisy, []
    for _, networks in kept:
        agent.restore(networks)
        means.append(float(evaluate(agent.policy, evaluation_env, final_episodes, fresh).mean()))
    agent.restore(last)
    best, networks = kept[means.index(max(means))]
    return Selection(networks, best, tuple(curve), max(means))
