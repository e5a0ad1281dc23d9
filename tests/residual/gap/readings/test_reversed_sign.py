"""A reversed torque that a load hides: what is found with the right sign tells; logs by expm."""

from typing import ClassVar

import numpy as np
import pytest
from scipy.linalg import expm

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter
from studies.gap.lead import lead

DT, INERTIA, DAMPING, LOAD = 0.01, 0.010, 0.015, 0.035
#: What is missing, and what was found in its place.
OFFERED = ("constant_load", "linear_spring", "quadratic_actuator")


class Stand(EquationOfMotion):
    """A drone that rolls on a stand."""

    dt = DT
    state_channels = (
        Channel("roll", "rad", "position", angle=True),
        Channel("roll rate", "rad/s", "rate", rate_of="roll"),
    )
    action_channels = (Channel("torque", "N m", "input", low=-0.5, high=0.5),)
    parameters: ClassVar = {"inertia": Parameter(INERTIA, "kg m^2", "of the drone", low=1e-3)}

    def acceleration(self, q, v, u, force, p):
        return ((u[:, 0] + force[:, 0] - DAMPING * v[:, 0]) / p.inertia)[:, None]


def log(sign, rows=2000):
    """The stand under a controller that follows slow turns, beside a load."""
    law = np.zeros((4, 4))
    law[0, 1], law[1, 1:] = 1.0, (-DAMPING / INERTIA, 1 / INERTIA, LOAD / INERTIA)
    step, state, seen, torques = expm(DT * law)[:2], np.zeros(2), [], []
    for now in DT * np.arange(rows):
        wanted = 0.4 * np.sin(1.9 * now) + 0.25 * np.sin(4.5 * now + 1) + 0.1 * np.sin(11 * now)
        torque = 0.25 * (wanted - state[0]) - 0.06 * state[1]
        seen.append(state)
        torques.append(torque)
        state = step @ [*state, torque, 1.0]
    noise = np.array([2e-3, 1e-2]) * np.random.default_rng(5).standard_normal((rows, 2))
    acted = sign * np.array(torques)[:-1, None]
    return Trajectory("run", DT * np.arange(rows), np.array(seen) + noise, acted)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_sign_is_told_and_no_other_change(sign):
    found = find_gap(Stand(), [log(sign)], effects=OFFERED)
    certain = [verdict.effect for verdict in found.verdicts if verdict.kind == "confirmed"]
    if sign > 0:
        assert found.conventions is None and certain == ["constant_load"]
        return
    assert found.conventions.reason == "found" and not certain
    # Of a system that is its own mirror image nothing tells which of the two is turned round.
    assert found.conventions.changes == (
        "`scale: -1` for torque",
        "`scale: -1` for roll and roll rate",
    )
    assert "what is found errs" in lead(found)
