"""Two laws that come near a curve, beside what nothing explains, are not certain."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel


class Fan(FirstOrderSystem):
    """Its air slows it down in proportion."""

    dt = 0.02
    state_channels = (Channel("speed", "rad/s", "rate", scale=30.0),)
    action_channels = (Channel("torque", "1", "input", scale=20.0, low=-40.0, high=40.0),)

    def derivative(self, x, u, p):
        return 5.0 * u - 2.0 * x


#: Among them all laws that curves by command would replace, so that these are offered.
OFFERED = (
    "actuator_gain", "saturation", "dead_zone", "quadratic_actuator", "viscous_friction",
    "constant_load", "delay",
)  # fmt: skip


def blown(torque, seed):
    """Twenty seconds of one whose actuator makes a torque of each command; the reading wanders."""
    rng = np.random.default_rng(seed)
    commands, speeds = np.repeat(rng.uniform(-9, 9, 40), 25), [0.0]
    within = 0.02 * np.arange(1, 26)
    for u in commands[::25]:
        path = solve_ivp(
            lambda t, x, u=u: 5 * torque(u) - 2 * x, (0, within[-1]), speeds[-1:], t_eval=within,
            rtol=1e-8, atol=1e-10,
        )  # fmt: skip
        speeds.extend(path.y[0])
    read = np.array(speeds) + rng.normal(0, 0.05, len(speeds))
    read += np.cumsum(np.random.default_rng(100 + seed).normal(0, 0.05, len(speeds)))
    return Trajectory("fan", 0.02 * np.arange(len(speeds)), read[:, None], commands[:, None])


def of_the_input(found):
    return {
        v.effect: (v.kind, v.alternatives)
        for v in found.verdicts
        if v.kind in ("confirmed", "ambiguous") and v.where == "torque"
    }


@pytest.mark.long
def test_laws_that_a_curve_would_beat_are_not_certain():
    found = find_gap(Fan(), [blown(lambda u: 8 * np.tanh(0.25 * u), 0)], effects=OFFERED)
    named = of_the_input(found)
    assert set(named) == {"actuator_gain", "saturation"}
    for kind, alternatives in named.values():
        assert kind == "ambiguous"
        assert "symmetric_input_curve@torque" in alternatives


@pytest.mark.long
def test_a_law_that_is_the_true_one_stays_certain():
    named = of_the_input(find_gap(Fan(), [blown(lambda u: 1.4 * u, 0)], effects=OFFERED))
    kind, alternatives = named["actuator_gain"]
    assert kind == "confirmed"
    assert not any("curve" in other for other in alternatives)
