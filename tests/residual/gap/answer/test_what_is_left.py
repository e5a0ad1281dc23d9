"""What is asked of a set that lost a member: it, or another as small that forecasts better."""

import pytest
from toy import Toy

from residual.gap.answer.answer import likelier

#: Of three the first was lost; errors over that of the nominal simulator.
THREE = {(): 1.0, (0,): 0.6, (1,): 0.5, (2,): 0.45, (0, 1, 2): 0.10}


@pytest.mark.parametrize(
    ("errors", "asked", "then"),
    [
        ({(1, 2): 0.16, (2, 3): 0.12}, (), (2, 3)),
        ({(1, 2): 0.16, (2, 3): 0.155}, (), (1, 2)),  # no better to speak of
        ({(1, 2): 0.16, (2, 3): 0.12}, [(2, 3)], (1, 2)),  # lost a member itself
        ({(1, 2): 0.16, (0, 1, 3): 0.05}, (), (1, 2)),  # no smaller than what failed
        ({(1, 2): 0.60, (0, 3): 0.70}, (), (2,)),  # two that make it worse than one
    ],
)
def test_the_best_set_of_its_size_is_asked_next(errors, asked, then):
    toy = Toy({**THREE, **errors})
    assert likelier(toy, (1, 2), {(0, 1, 2), *asked}) == then


def test_what_cannot_be_right_is_not_asked():
    toy = Toy({**THREE, (1, 2): 0.16, (2, 3): 0.12})
    toy.refused[(2, 3)] = "a mass of minus one"
    assert likelier(toy, (1, 2), set()) == (1, 2)
