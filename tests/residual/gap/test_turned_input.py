"""An input that acts the other way and is stronger, too; logs of a linear oscillator by expm."""

from typing import ClassVar

import numpy as np
import pytest
from scipy.linalg import expm

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter
from studies.gap.lead import lead

DT, STIFFNESS, DAMPING = 0.02, 25.0, 0.4


class Oscillator(EquationOfMotion):
    dt, substeps = DT, 4
    state_channels = (
        Channel("place", "m", "position", scale=0.3),
        Channel("speed", "m/s", "rate", rate_of="place", scale=1.5),
    )
    action_channels = (Channel("push", "m/s^2", "input", scale=2.0),)
    parameters: ClassVar = {"stiffness": Parameter(STIFFNESS, "1/s^2", "of the spring", low=0.0)}

    def acceleration(self, q, v, u, force, p):
        pull = u[:, 0] - p.stiffness * q[:, 0] - DAMPING * v[:, 0]
        return pull[:, None] + force


def log(strength, stiffness=STIFFNESS, feedback=(0.0, 0.0), seed=0):
    """Random pushes, and what feedback adds to them, each held for a sample."""
    rng = np.random.default_rng(seed)
    law = np.zeros((3, 3))
    law[0, 1], law[1] = 1.0, (-stiffness, -DAMPING, strength)
    step, state = expm(DT * law), np.array([0.2, 0.0])
    states, pushes = [state], []
    for push in np.repeat(rng.uniform(-3, 3, 40), 20):
        push = push - feedback @ state
        state = (step @ [*state, push])[:2]
        states.append(state)
        pushes.append(push)
    seen = np.array(states) + np.array([0.001, 0.01]) * rng.standard_normal((len(states), 2))
    return Trajectory("run", DT * np.arange(len(seen)), seen, np.array(pushes)[:, None])


#: What may be taken for each other here.
OFFERED = ("actuator_gain", "stiffness", "linear_spring", "viscous_friction", "delay")


@pytest.mark.parametrize("strength", [pytest.param(-3.0, marks=pytest.mark.long), -0.5])
def test_it_is_told_with_its_strength_and_nothing_is_certain(strength):
    found = find_gap(Oscillator(), [log(strength, 0.9 * STIFFNESS)], effects=OFFERED)
    named = {verdict.effect: verdict for verdict in found.verdicts if verdict.parameters}
    assert named["actuator_gain"].parameters["gain"].value == pytest.approx(strength - 1, rel=0.05)
    assert found.conventions is not None
    assert "`scale: -1` for push" in found.conventions.changes
    assert "`scale: -1` for push" in lead(found, None)
    assert not any(verdict.kind == "confirmed" for verdict in found.verdicts)


@pytest.mark.parametrize(
    "feedback", [(30.0, 2.0), pytest.param((-15.0, 0.0), marks=pytest.mark.long)]
)
def test_an_input_that_follows_the_state_is_not_turned_by_what_is_missing(feedback):
    """A spring that is missing could be an input of the other sign."""
    found = find_gap(Oscillator(), [log(1.0, 2.0 * STIFFNESS, feedback)], effects=OFFERED)
    assert found.conventions is None
    named = {v.effect for v in found.verdicts if v.kind == "confirmed"}
    assert named & {"stiffness", "linear_spring"}
