"""A true system whose episodes end at once is refused for that, and for nothing else."""

import numpy as np
import pytest

from sims.episodes import refuse_ended_at_once
from sims.pendulum_equation import PendulumEquation
from sims.unsound import Unsound


def episodes(*lengths):
    rng = np.random.default_rng(0)
    return [(rng.normal(size=(n + 1, 2)), rng.normal(size=(n, 1))) for n in lengths]


def test_single_steps_are_one_line():
    match = r"^it ended 6 of 7 episodes after one step, such as at angle .* rad, rate .* rad/s: "
    with pytest.raises(Unsound, match=match):
        refuse_ended_at_once("it", PendulumEquation(), episodes(1, 1, 1, 30, 1, 1, 1))


@pytest.mark.parametrize("lengths", [(60, 60, 1), (1, 30, 2, 40, 1, 35), (1, 1), ()])
def test_a_fall_now_and_then_is_none(lengths):
    refuse_ended_at_once("it", PendulumEquation(), episodes(*lengths))
