"""What is refused before anything is computed, beside what the checker finds."""

import re
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


POSITION = Channel("height", "m", "position")
WRONG = {
    "state_channels": (
        (POSITION, "Odd.state_channels is one Channel, expected a tuple: (Channel("),
        (("height",), "Odd.state_channels holds 'height', expected state_channels = (Channel("),
        ("height", "Odd.state_channels is 'height', expected"),
        ((Channel("past", "m", "memory"),), "channel 'past' is of kind 'memory', which effects"),
    ),
    "parameters": (
        ({"mass": 2.4}, "Odd.parameters: 'mass' is 2.4, expected Parameter(2.4, "),
        ({"mass": Parameter("2.4", "kg", "load")}, "'mass' has the value '2.4', expected a number"),
        ({"b": Parameter(1.0, "N s/m", "rail", family="disipation")}, "mean 'dissipation'?"),
        (["mass"], "Odd.parameters is ['mass'], expected {"),
    ),
}


@pytest.mark.parametrize(
    ("name", "value", "says"),
    [(name, value, says) for name, cases in WRONG.items() for value, says in cases],
)
def test_what_a_class_declares_wrongly_is_one_line(name, value, says):
    with pytest.raises(ValueError, match=re.escape(says)):
        type("Odd", (Hoist,), {name: value})()


@pytest.mark.parametrize("dt", ["20 ms", 0, -0.1, float("nan"), True])
def test_a_period_that_is_none_is_refused(dt):
    with pytest.raises(ValueError, match=r"Hoist: dt is .*, expected the control period in s"):
        Hoist(dt=dt)


class Misspelt(Hoist):
    def acceleration(self, q, v, u, force, p):
        return ((u[:, 0] / p.drumm + force[:, 0]) / 50.0 - 9.81)[:, None]


def test_a_parameter_that_is_misspelt_is_told_by_the_one_that_there_is():
    with pytest.raises(AttributeError, match=r"no parameter 'drumm'; did you mean 'drum'\?"):
        Misspelt().step([[0.0, 0.0]], [[0.0]])


class Squared(Hoist):
    def acceleration(self, q, v, u, force, p):
        return ((u[:, 0] / p.drum + force[:, 0] ** 2) / 50.0 - 9.81)[:, None]


def test_a_force_that_is_not_added_is_refused():
    with pytest.raises(Unsound, match="twice the force on height does not change the"):
        refuse_unsound(Squared())


def test_a_misspelt_declaration_is_told_by_the_name_that_is_near():
    body = {"dt": 0.1, "state_chanels": (), "acceleration": Hoist.acceleration}
    with pytest.raises(ValueError, match=r"Odd has no state_channels.*by state_chanels\?"):
        type("Odd", (EquationOfMotion,), body)()


def test_a_channel_of_no_hold_is_refused():
    with pytest.raises(ValueError, match="hold='linaer', expected one of 'zero', 'linear'"):
        Channel("push", "N", "input", hold="linaer")
