"""What is said of effects that exactly dependent sets could imitate."""

from types import SimpleNamespace

import numpy as np
import pytest

from residual.gap.answer.table import no_better
from residual.gap.answer.verdicts import dependent, nameable
from residual.gap.result import Number
from sims.effects.combinations import near_combinations
from sims.pendulum_equation import PendulumEquation

SETS = (
    ("viscous", "gain", "torque_constant"),
    ("viscous", "gain", "resistance"),
    ("viscous", "gain", "mass", "inertia"),
)


def test_one_effect_of_a_dependent_set_is_imitated_by_all_the_others():
    stand_ins, together = dependent("mass", ["mass"], SETS)
    assert stand_ins == ()
    assert together == (("viscous", "gain", "inertia"),)


def test_two_of_three_dependent_effects_could_be_another_two():
    stand_ins, together = dependent("gain", ["gain", "viscous"], SETS)
    assert stand_ins == ("torque_constant", "resistance")
    assert together == ()


def test_an_effect_outside_of_all_sets_stands_alone():
    assert dependent("delay", ["delay", "mass"], SETS) == ((), ())


def test_an_effect_that_a_pair_imitates_is_known_from_the_equations():
    near = near_combinations(PendulumEquation(), ["inertia", "resistance"])
    assert "mass" in near
    assert "linear_spring@pivot" not in near


def test_blocks_in_which_nothing_was_gained_are_counted():
    before, floor = np.array([4.0, 4.0, 4.0, 1.2]), np.ones(4)
    # Better, worse, as bad as before, and worse within what noise alone does.
    assert no_better(before, np.array([1.0, 5.0, 4.0, 1.5]), floor) == 2


@pytest.mark.parametrize(("adequate", "share", "by_fit", "named"), [
    (False, -0.1, False, False), (False, 0.1, False, True), (True, -0.1, False, True),
    (False, -0.1, True, True),
])  # fmt: skip
def test_what_makes_forecasts_worse_is_not_named_where_neither_chance_nor_fits_decide(
    adequate, share, by_fit, named
):
    knob = SimpleNamespace(field="change", strength=True)
    search = SimpleNamespace(
        candidates=[SimpleNamespace(label="mass", effect=None, knobs=(knob,))],
        family=lambda number: "",
    )
    claim = SimpleNamespace(
        number=0, share=(share, share - 0.1, share + 0.1), rivals=(), needed=True,
        numbers={"change": Number(0.1, 0.05, 0.15, "kg")}, by_fit=by_fit,
    )  # fmt: skip
    assert nameable(search, claim, 20, adequate) is named
