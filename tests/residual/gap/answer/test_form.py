"""A law of another form that leaves next to nothing is told apart from the true one."""

import pytest
from trolley import Trolley, record

from residual.gap import find_gap

#: Among them what a curve of friction has as its cases, but for one of the two.
OTHERS = ("stiffness", "constant_load", "delay")


def friction(effects, **hidden):
    """What is said of friction on five records of a trolley that has some."""
    runs = [record(seed, lambda part: 20.0, **hidden) for seed in range(5)]
    found = find_gap(Trolley(), runs, effects=(*effects, *OTHERS), parameter_tolerance=0.0)
    return found, next(v for v in found.verdicts if v.where == "place")


@pytest.mark.long
@pytest.mark.parametrize(
    ("effect", "hidden"),
    [
        ("viscous_friction", {"drag": 0.025}),
        ("quadratic_drag", {"damping": lambda place: 1.04}),
    ],
)
def test_a_form_that_the_data_reject_is_undecided(effect, hidden):
    _, verdict = friction([effect], **hidden)
    assert verdict.effect == effect
    assert "friction_curve@place" in verdict.form


@pytest.mark.parametrize(
    ("effect", "hidden"),
    [
        ("quadratic_drag", {"drag": 0.025}),
        pytest.param("viscous_friction", {"damping": lambda place: 1.04}, marks=pytest.mark.long),
    ],
)
def test_the_true_form_is_decided(effect, hidden):
    _, verdict = friction(["viscous_friction", "quadratic_drag"], **hidden)
    assert (verdict.effect, verdict.kind) == (effect, "confirmed")
    assert "friction_curve@place" not in verdict.form
