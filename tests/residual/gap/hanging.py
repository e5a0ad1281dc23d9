"""A trolley with a load on a rope."""

from typing import ClassVar

import numpy as np

from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

DT, ROPE = 0.05, 1.2


class Crane(EquationOfMotion):
    """A trolley with a load on a rope, for small angles; a camera reads the load."""

    dt = DT
    substeps = 2
    state_channels = (
        Channel("trolley", "m", "position", scale=1.0),
        Channel("trolley rate", "m/s", "rate", rate_of="trolley", scale=1.0),
        Channel("swing", "rad", "position", scale=0.5),
        Channel("swing rate", "rad/s", "rate", rate_of="swing", scale=1.0),
    )
    action_channels = (Channel("force", "N", "input", scale=10.0, low=-30.0, high=30.0),)
    parameters: ClassVar = {"rope": Parameter(ROPE, "m", "length of the rope", low=0.1)}

    def acceleration(self, q, v, u, force, p):
        pull = (u[:, 0] + force[:, 0] + 20.0 * q[:, 1]) / 5.0
        return np.stack([pull, (force[:, 1] - pull - 9.81 * q[:, 1]) / p.rope], axis=1)
