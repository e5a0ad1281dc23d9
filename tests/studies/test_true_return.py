"""What the loop is for: a better return on the true system, from few samples of it."""

import pytest

from policy import DDPGConfig
from residual import Linear
from sims.pendulum import Pendulum
from sims.protocol import EvaluationProtocol
from sims.tasks import SwingUp
from studies.learning.budget import Budget
from studies.learning.loop import learn_by_difference
from studies.running.progress import Silent


def true_return(seed, budget, **options):
    found = learn_by_difference(
        Pendulum(), Pendulum.true(), SwingUp(), estimator=Linear(), budget=budget, seed=seed,
        progress=Silent(), **options,
    )  # fmt: skip
    before, after = found.policies
    assert (before["name"], after["name"]) == ("idealised", "difference")
    return before["return_true"], after["return_true"]


def test_one_update_beats_the_idealised_policy():
    quick = EvaluationProtocol(every=1000, noisy=1)
    small = DDPGConfig(hidden=(64, 48), actor_lr=3e-4)
    before, after = true_return(0, Budget(400, 1, 6000, 3000), ddpg=small, evaluation=quick)
    assert after > before


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_one_update_with_400_samples_swings_the_true_pendulum_up(seed):
    assert true_return(seed, Budget(400, 1))[1] > -700
