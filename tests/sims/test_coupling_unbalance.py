"""A weight that two joints turn: gravity on an arm whose base tilts, against its energy."""

import numpy as np
import pytest

from sims.effects import CouplingUnbalance, Unbalance
from sims.effects.library import further_in
from sims.equations import EquationOfMotion
from sims.simulator import Channel

INERTIA, COUPLED, FOREARM = 0.06, 0.011, 0.012
#: Torques of both parts and of the forearm on a base that tilts.
BOTH, OUTER = 0.2, 0.05


def joints(unit):
    return tuple(
        channel
        for name in ("shoulder", "elbow")
        for channel in (
            Channel(name, unit, "position", angle=unit == "rad"),
            Channel(f"{name} rate", f"{unit}/s", "rate", rate_of=name, scale=2.0),
        )
    )


class Arm(EquationOfMotion):
    """Two links in a plane, the elbow's angle counted from the upper arm."""

    dt = 0.01
    state_channels = joints("rad")
    action_channels = (Channel("torque", "N m", "input", scale=0.2),)

    def acceleration(self, q, v, u, force, p):
        c, s = COUPLED * np.cos(q[:, 1]), COUPLED * np.sin(q[:, 1])
        a, b, d = INERTIA + 2 * c, FOREARM + c, FOREARM
        first = u[:, 0] + force[:, 0] + s * (2 * v[:, 0] * v[:, 1] + v[:, 1] ** 2)
        other = force[:, 1] - s * v[:, 0] ** 2
        moved = np.stack([d * first - b * other, a * other - b * first], axis=1)
        return moved / (a * d - b * b)[:, None]


class InDegrees(Arm):
    state_channels = joints("deg")


def test_an_arm_on_a_base_that_tilts_keeps_its_energy():
    weights = [
        Unbalance("shoulder", -BOTH, 0.0), CouplingUnbalance("shoulder and elbow", -1.0, -OUTER),
    ]  # fmt: skip
    path = Arm(effects=weights, substeps=10).rollout([1.2, 0.0, -0.7, 0.0], np.zeros((300, 1)))
    q, v, e, w = path.T
    c = COUPLED * np.cos(e)
    kinetic = 0.5 * (INERTIA + 2 * c) * v**2 + (FOREARM + c) * v * w + 0.5 * FOREARM * w**2
    height = -BOTH * np.cos(q) - OUTER * np.cos(q + e)
    assert np.ptp(kinetic) > 0.1
    assert kinetic + height == pytest.approx(height[0], abs=1e-5)


def test_it_is_rarer_than_the_library_and_goes_by_radians():
    assert "coupling_unbalance@shoulder and elbow" in map(str, further_in(Arm()))
    assert not [e for e in further_in(InDegrees()) if e.name == "coupling_unbalance"]
    with pytest.raises(ValueError, match="in rad"):
        InDegrees(effects=[CouplingUnbalance("shoulder and elbow", -1.0, 0.1)])
