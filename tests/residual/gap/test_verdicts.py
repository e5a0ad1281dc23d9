"""What is said of effects that exactly dependent sets could imitate."""

import numpy as np
from residual.gap.confirm import earns_place, is_silent
from residual.gap.holdout import end_of_training

from residual.gap.verdicts import dependent, family
from residual.trajectories import Trajectory
from sims.effects.library import near_combinations
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


def test_a_family_holds_only_its_own():
    assert family(["delay@voltage", "actuator_lag@voltage"]) == "delay or lag"
    assert family(["delay@voltage", "mass"]) == ""


def test_an_effect_that_a_pair_imitates_is_known_from_the_equations():
    near = near_combinations(PendulumEquation(), ["inertia", "resistance"])
    assert "mass" in near
    assert "linear_spring@pivot" not in near


def test_a_small_held_out_part_need_not_prove_what_training_shows():
    rng = np.random.default_rng(0)
    without = 20 + rng.normal(size=30)
    assert earns_place(without, without - 0.1, expected=4.0)
    assert not earns_place(without, without - 0.1)
    assert not earns_place(without, without + 0.1, expected=4.0)
    assert not earns_place(without, without - 0.1, expected=400.0)


def test_held_out_data_are_silent_only_if_they_speak_neither_for_nor_against():
    without = 20 + np.random.default_rng(0).normal(size=30)
    assert is_silent(without, without - 0.1, expected=400.0)
    assert not is_silent(without, without - 0.1, expected=4.0)
    assert not is_silent(without, without + 2.0, expected=400.0)


def test_a_single_record_is_held_out_where_its_input_changes():
    steps = np.repeat([0.0, 1.0, 0.0, 1.0], [20, 180, 200, 171])[:, None]
    run = Trajectory("one", np.arange(572.0), np.zeros((572, 1)), steps)
    cut = end_of_training(run)
    assert 300 < cut < 400
    busy = Trajectory(
        "one", np.arange(572.0), np.zeros((572, 1)), np.sin(np.arange(571.0))[:, None]
    )
    assert end_of_training(busy) == round(0.75 * 571)
