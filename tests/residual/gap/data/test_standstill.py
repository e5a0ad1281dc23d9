"""What stands still now and then, and what only passes through zero speed."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from residual.gap.data.samples import Samples
from residual.gap.data.standstill import may_stick, stands_still
from residual.trajectories import Trajectory
from sims.effects import ActuatorGain, CoulombFriction, DeadZone
from sims.pendulum_equation import PendulumEquation

TIMES = np.linspace(0.0, 20.0, 2001)


def swings(size, period):
    return size * np.sin(2 * np.pi * TIMES / period)


@settings(max_examples=30)
@given(st.floats(1e-4, 1e4), st.floats(0.2, 8.0), st.floats(0.0, 0.01))
def test_swinging_is_no_standstill_in_any_unit(size, period, noise):
    rough = noise * size * np.random.default_rng(0).standard_normal(len(TIMES))
    assert not stands_still([swings(size, period) + rough])


@settings(max_examples=30)
@given(st.floats(1e-4, 1e4), st.floats(0.2, 8.0), st.floats(0.3, 0.9))
def test_stopping_for_a_while_is(size, period, part):
    moving = (TIMES / period) % 1 > part
    assert stands_still([swings(size, 0.4 * period) * moving])


def test_what_noise_hides_may_be():
    noise = np.random.default_rng(0).standard_normal(len(TIMES))
    assert stands_still([swings(0.5, 5.0) + noise])


def test_one_slow_record_among_many_is_none():
    fast = [swings(1.0, 2.0)] * 5
    slow = np.where(TIMES < 8, 0.0, swings(0.2, 3.0))
    assert stands_still([slow])
    assert not stands_still([slow, *fast])


@pytest.mark.parametrize(
    ("effect", "swinging", "resting"),
    [
        (CoulombFriction("pivot"), False, True),
        (DeadZone("voltage"), True, True),
        (ActuatorGain("voltage"), False, False),
    ],
)
def test_friction_may_stick_where_its_joint_rests_and_inputs_anywhere(effect, swinging, resting):
    simulator = PendulumEquation()
    for expected, moving in ((swinging, TIMES > 0), (resting, TIMES > 12)):
        rate = swings(2.0, 2.0) * moving
        nodes = np.stack([np.cumsum(rate) * 0.01, rate], axis=1)
        run = Trajectory("run", TIMES, nodes, np.zeros((len(TIMES) - 1, 1)))
        samples = Samples.join([run], 1)
        assert may_stick(effect, simulator, samples, nodes) is expected
