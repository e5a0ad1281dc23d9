"""What is said of effects that exactly dependent sets could imitate."""

from residual.gap.verdicts import dependent, family

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
