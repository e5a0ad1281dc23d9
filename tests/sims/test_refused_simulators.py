"""What is refused before anything is computed, beside what the checker finds."""

from typing import ClassVar

import pytest

from sims.contract import refuse_unsound
from sims.equations import EquationOfMotion
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel, Parameter
from sims.unsound import Unsound


class Hoist(EquationOfMotion):
    """Its drive tells a force for every row of every row where the gear is a number by row."""

    dt = 0.02
    state_channels = (
        Channel("height", "m", "position", scale=1.0),
        Channel("speed", "m/s", "rate", rate_of="height", scale=1.0),
    )
    action_channels = (Channel("torque", "N m", "input", low=-20.0, high=20.0),)
    parameters: ClassVar = {"drum": Parameter(0.1, "m", "radius of the drum", low=0.01)}

    def acceleration(self, q, v, u, force, p):
        return ((u[:, 0] / p.drum + force[:, 0]) / 50.0 - 9.81)[:, None]

    def drive_force(self, q, v, u, p):
        return u / p.drum


def test_a_drive_force_that_mixes_rows_is_refused_before_anything_is_computed():
    with pytest.raises(Unsound, match=r"drive_force: .*drum is one number for each row"):
        refuse_unsound(Hoist())


class Negative(PendulumEquation):
    def __init__(self, **options):
        super().__init__(**options)
        mass = Parameter(-0.1, "kg", "of the pendulum", low=0.0)
        self.parameters = self.parameters | {"mass": mass}


def test_a_parameter_outside_its_own_bounds_is_refused():
    with pytest.raises(Unsound, match=r"parameters: 'mass' is -0.1, outside its own bounds 0 and"):
        refuse_unsound(Negative())
