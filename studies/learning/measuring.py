"""How right a difference model is on the true system: where its policy goes, and anywhere."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence

import numpy as np

from policy.evaluate import Policy, Roll, rollout
from policy.learner import Algorithm
from residual.accuracy import LEAST_STEPS, Accuracy, accuracy_along, uniform_rollouts
from residual.corrected import CorrectedSimulator
from sims.simulator import Array, Simulator
from sims.system import System
from studies.learning.training import exploration, visited

_log = logging.getLogger("simgap")

#: States at most that open-loop predictions start at, unless a system says otherwise.
STARTS = 1000


def where_it_goes(
    system: System,
    algorithm: Algorithm,
    policy: Policy,
    corrected: CorrectedSimulator,
    seed: int,
    roll: Roll = rollout,
) -> tuple[Accuracy, int]:
    """Accuracy along fresh true rollouts of a policy, all but the first with exploration noise.

    Args:
        system: What is controlled; says how many rollouts, and how long.
        algorithm: Its exploration noise.
        policy: Trained on ``corrected``.
        corrected: The simulator with its difference model.
        seed: Where the random numbers of the rollouts begin.
        roll: Rolls out an episode.

    Returns:
        The accuracy, and the steps of the true system that it took.
    """
    protocol = system.evaluation
    env = system.true_environment(corrected)
    steps = None
    if protocol.visited_seconds is not None:
        # Long enough for the longest of the usual horizons.
        steps = max(*LEAST_STEPS, round(protocol.visited_seconds / corrected.dt))
    runs = [roll(policy, env, seed, None, steps)]
    runs += [
        roll(policy, env, seed + k, exploration(system, algorithm, seed + k), steps)
        for k in range(1, protocol.visited_rollouts)
    ]
    # One that fell ends early, and is as long as it is.
    states, actions = [visited(system, run) for run in runs], [run.actions for run in runs]
    accuracy = accuracy_along(corrected, states, actions, stride=_stride(system, actions))
    return accuracy, sum(map(len, actions))


def anywhere(system: System, corrected: CorrectedSimulator, seed: int) -> Accuracy | None:
    """Accuracy along true rollouts from anywhere; None if the true system cannot be set.

    Args:
        system: What is controlled; may say what anywhere is.
        corrected: The simulator with its difference model.
        seed: Of what is drawn.
    """
    rng = np.random.default_rng(seed)
    if system.elsewhere:
        states, actions = system.elsewhere(rng)
    elif isinstance(system.true, Simulator):
        states, actions = uniform_rollouts(system.true, rng)
    else:
        return None
    states = states[..., : len(system.nominal.state_channels)]
    sound = np.asarray(np.isfinite(states).all(axis=(1, 2)))
    if not sound.all():
        _log.warning(
            "the true system returns values that are not finite from %d of %d states anywhere "
            "within the scales of its channels: these are left out of its accuracy anywhere",
            (~sound).sum(), len(sound),
        )  # fmt: skip
    if not sound.any():
        return None
    states, actions = states[sound], actions[sound]
    return accuracy_along(corrected, states, actions, stride=_stride(system, actions))


def _stride(system: System, actions: Array | Sequence[Array]) -> int:
    """Every how manieth state predictions start at."""
    most = system.evaluation.visited_stride
    return most or math.ceil(sum(map(len, actions)) / STARTS)
