"""Which effects would do in place of a chosen one."""

import numpy as np
import pytest
from toy import Toy

from residual.gap.confirmation.rivals import near


@pytest.mark.parametrize(("times", "left"), [(1.4, ("constant_load@pivot",)), (1.6, ())])
def test_a_rival_is_out_when_it_is_clearly_worse(times, left):
    toy = Toy({(0,): 0.3, (3,): 0.3 * times})
    assert near(toy, (0,), 0, adequate=False) == ((), (), left)


@pytest.mark.parametrize(("times", "left"), [(1.6, ("constant_load@pivot",)), (3.5, ())])
def test_a_rival_has_to_be_worse_from_starts_that_are_better_known_too(times, left):
    toy = Toy({(0,): 0.3, (3,): 0.3 * times})
    alike = toy.validated[(0,)].squares
    toy.from_longer_leads = lambda key: alike
    assert near(toy, (0,), 0, adequate=False) == ((), (), left)


def test_a_set_that_did_not_converge_is_no_rival():
    toy = Toy({(0,): 0.3, (3,): 0.3})
    toy.unfit.add((3,))
    assert near(toy, (0,), 0, adequate=False) == ((), (), ())


@pytest.mark.parametrize("likely", [True, False])
def test_a_rival_whose_numbers_may_be_believable_is_one(likely):
    """Eleven times its nominal value is absurd; eleven that may be nine excludes nothing."""
    toy = Toy({(0,): 0.3, (3,): 0.3})
    toy.refused[(3,)] = "11 times its nominal value"
    toy.nearly |= {(3,)} if likely else set()
    left = ("constant_load@pivot",) if likely else ()
    assert near(toy, (0,), 0, adequate=False) == ((), (), left)


def test_the_ratio_is_taken_at_the_joint_where_the_effect_matters():
    toy = Toy({(0,): (0.2, 0.9), (3,): (0.4, 0.9)}, joints=2)
    assert near(toy, (0,), 0, adequate=False) == ((), (), ())


def test_forms_of_one_family_are_apart_if_the_same_wins_at_half_the_horizon_too():
    close = Toy({(1,): 0.3, (2,): 0.34})
    assert near(close, (1,), 1, adequate=False) == (("coulomb_friction@pivot",), (), ())
    errors = {(1,): 0.3, (2,): 0.38}
    assert near(Toy(errors), (1,), 1, adequate=False) == ((), (), ())
    other = near(Toy(errors, half={(1,): 0.3, (2,): 0.25}), (1,), 1, adequate=False)
    assert other == (("coulomb_friction@pivot",), (), ())
    few = near(Toy(errors, blocks=7), (1,), 1, adequate=False)
    assert few == (("coulomb_friction@pivot",), (), ())


@pytest.mark.parametrize(
    ("contacts", "error", "left"),
    [(False, 0.51, ()), (True, 0.51, ("constant_load@pivot",)), (True, 0.56, ())],
)
def test_of_what_strikes_the_ground_a_rival_has_to_forecast_worse(contacts, error, left):
    toy = Toy({(0,): 0.50, (3,): error}, merits={(): 1e6, (0,): 10.0, (3,): 1e5})
    toy.fitter.samples.seen, toy.fitter.samples.measured = np.zeros((80, 1)), [0]
    toy.halved = {(0,): toy.tried[0,]}
    toy.simulator.has_contacts = contacts
    assert near(toy, (0,), 0, adequate=True)[2] == left
