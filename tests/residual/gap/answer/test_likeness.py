"""What a law does in any motion, and what a parameter does that follows a channel."""

from typing import ClassVar

import numpy as np
import pytest
from held import path

from residual.gap.answer.likeness import in_any_motion
from residual.gap.preparation.prepare import prepare
from residual.trajectories import Trajectory
from sims.effects import CubicSpring, LinearSpring, ParameterCurve, ViscousFriction
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

DT = 0.02


class Table(EquationOfMotion):
    """A table on a leaf spring, which a coil pushes."""

    dt = DT
    state_channels = (
        Channel("x", "mm", "position", scale=3.0),
        Channel("v", "mm/s", "rate", rate_of="x", scale=50.0),
    )
    action_channels = (Channel("coil", "N", "input", scale=20.0),)
    parameters: ClassVar = {
        "mass": Parameter(0.02, "N s^2/mm", "table", low=1e-3),
        "spring": Parameter(4.0, "N/mm", "leaf", low=0.0),
        "damping": Parameter(0.05, "N s/mm", "air", low=0.0, family="dissipation"),
    }

    def acceleration(self, q, v, u, force, p):
        pull = p.spring * q[:, 0] + p.damping * v[:, 0]
        return ((u[:, 0] + force[:, 0] - pull) / p.mass)[:, None]


@pytest.fixture(scope="module")
def fitter():
    rng = np.random.default_rng(0)
    coil = np.repeat(rng.uniform(-20, 20, 30), 20)[:-1]
    states = path(
        lambda _, x, u: [x[1], (u - 4.0 * x[0] - 0.05 * x[1]) / 0.02], [0.0, 0.0], coil, DT
    )
    run = Trajectory("a", DT * np.arange(600), states, coil[:, None])
    return prepare(Table(), [run], 0.5).fitter


STIFFENING = ParameterCurve("spring", "x", low=-20.0, high=20.0)


@pytest.mark.parametrize(
    ("law", "wanted"),
    [
        (CubicSpring("x"), True),
        (LinearSpring("x"), True),
        (CubicSpring("x", rest=10.0), False),
        (ViscousFriction("x"), False),
    ],
    ids=["stiffens", "stiffer", "stiffens elsewhere", "friction"],
)
def test_a_spring_that_goes_by_where_it_is_does_what_a_stiffening_one_does(fitter, law, wanted):
    assert in_any_motion(fitter, Table(), STIFFENING, law) is wanted


def test_a_stiffening_spring_does_not_all_that_one_does_which_goes_by_where_it_is(fitter):
    assert not in_any_motion(fitter, Table(), CubicSpring("x"), STIFFENING)
