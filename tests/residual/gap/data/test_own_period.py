"""A period that is typed for a log without times is compared with the simulator's own."""

import pytest

from residual.gap.data.own_period import own_period
from sims.pendulum_equation import PendulumEquation


@pytest.mark.parametrize(
    ("times", "told"), [(None, False), (1.0, False), (1.2, False), (2.0, True), (0.5, True)]
)
def test_another_one_is_told_with_what_to_set(times, told):
    simulator = PendulumEquation()
    found = own_period(simulator, None if times is None else times * simulator.dt)
    assert bool(found) == told
    if told:
        assert f"set period: {simulator.dt:g}" in found[0].words
