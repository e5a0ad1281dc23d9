"""Enough is enough: the smallest set that forecasts about as well as any."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from toy import Toy

from residual.gap.search.choice import choose
from residual.gap.search.significance import least_otherwise, significant
from sims.pendulum_equation import PendulumEquation


@pytest.mark.parametrize(("second", "key"), [(0.41, (0,)), (0.39, (0, 1))])
def test_an_effect_has_to_take_a_fifth_off_what_remains(second, key):
    found = choose(Toy({(0,): 0.5, (0, 1): second}))
    assert found.key == key


@pytest.mark.parametrize(("first", "key"), [(0.65, (0, 1)), (0.72, (0,))])
def test_or_three_tenths_at_one_joint_of_several(first, key):
    # Over three joints that is a tenth: too little on the whole.
    toy = Toy({(0,): 0.6, (0, 1): (0.6 * first, 0.6, 0.6)}, joints=3)
    assert choose(toy).key == key


def test_what_takes_less_is_minor_and_says_what_it_took():
    found = choose(Toy({(0,): 0.5, (0, 1): 0.43}))
    assert found.key == (0,)
    assert found.minor == (1,)
    assert found.reasons[0, 1] == "takes only 14 % off what remains"


def test_a_trifle_beside_the_nominal_error_is_no_effect_however_much_of_the_rest_it_is():
    assert choose(Toy({(0,): 0.008, (0, 1): 0.004})).key == (0,)


def test_nothing_is_chosen_where_nothing_helps_beyond_chance():
    assert choose(Toy({(0,): 0.99, (1,): 1.02}, scatter=0.2)).key == ()


def test_fewest_numbers_win_among_equals():
    toy = Toy({(0, 1): 0.200, (3,): 0.205, (0,): 0.6, (1,): 0.6})
    assert choose(toy).key == (3,)


def test_ties_go_to_the_better_fit():
    toy = Toy({(0,): 0.200, (3,): 0.201}, merits={(0,): 50.0, (3,): 20.0})
    assert choose(toy).key == (3,)
    worse = Toy({(0,): 0.2, (3,): 0.4}, merits={(0,): 50.0, (3,): 20.0})
    assert choose(worse).key == (0,)


def test_steps_that_give_up_less_than_a_fifth_each_do_not_add_up():
    # A law of two numbers with a mass; a fifth worse, two effects of one number; a single one.
    errors = {(0, 2): 0.607, (1, 3): 0.757, (4,): 0.818}
    toy = Toy(errors)
    toy.numbers = lambda key: len(key) + (2 in key)
    assert choose(toy).key == (1, 3)
    toy = Toy({key: error for key, error in errors.items() if key != (0, 2)})
    assert choose(toy).key == ()


def test_of_what_no_data_tell_apart_the_least_is_otherwise_than_was_known():
    # One effect, and a mass that is 2 % off; or that mass off by a third, and another effect.
    sets = {(0, 3): 0.2, (1, 3): 0.2, (0, 1): 0.2}
    merits = {(0, 3): 20.01, (1, 3): 20.0, (0, 1): 30.0}
    known = PendulumEquation().parameters["mass"].value
    assert choose(Toy(sets, merits, mass=0.02 * known)).key == (0, 3)
    assert choose(Toy(sets, merits, mass=0.33 * known)).key == (1, 3)


def test_of_what_moves_exactly_alike_the_simulators_own_parameter_is_named():
    known = PendulumEquation().parameters["mass"].value
    sets = {(0, 3): 0.2, (1, 3): 0.2}
    for merits in ({(0, 3): 20.0001, (1, 3): 20.0}, {(0, 3): 20.0, (1, 3): 20.0001}):
        assert choose(Toy(sets, merits, mass=0.33 * known)).key == (0, 3)


@pytest.mark.parametrize("far", [0.2, 0.6])
def test_of_what_moves_exactly_alike_the_smallest_numbers_are_named_however_they_forecast(far):
    """A gain of 5.1 beside friction moves as a time constant does that is off by 0.8."""
    sets, merits = {(1, 4): 0.2, (3, 5): far}, {(1, 4): 20.0, (3, 5): 20.0001}
    sizes = {(1, 4): (5.1, 2.5), (3, 5): (0.8, 0.01)}
    assert choose(Toy(sets, merits, sizes=sizes)).key == (3, 5)


def test_what_fits_worse_is_another_motion_and_forecasts_tell():
    sets, merits = {(1, 4): 0.2, (3, 5): 0.6}, {(1, 4): 20.0, (3, 5): 21.0}
    sizes = {(1, 4): (5.1, 2.5), (3, 5): (0.8, 0.01)}
    assert choose(Toy(sets, merits, sizes=sizes)).key == (1, 4)


def test_what_would_be_surprisingly_large_comes_after_what_does_as_well():
    merits = {(0,): 50.0, (3,): 20.0}
    assert choose(Toy({(0,): 0.200, (3,): 0.201}, merits, surprising={3})).key == (0,)
    assert choose(Toy({(0,): 0.400, (3,): 0.201}, merits, surprising={3})).key == (3,)


@pytest.mark.parametrize(
    ("error", "mass", "first"),
    [
        (0.199, 0.02, (0, 3)),
        (0.199, 0.30, (1, 4)),  # the mass would be far off, too
        (0.205, 0.02, (1, 4)),  # forecasts worse
    ],
)
def test_what_departs_less_may_have_one_number_more(error, mass, first):
    """A spring and a mass off by 2 % come before two effects of one number each."""
    known = PendulumEquation().parameters["mass"].value
    toy = Toy({(1, 4): 0.200, (0, 3): error}, mass=mass * known)
    toy.numbers = lambda key: len(key) + (3 in key)
    found = choose(toy)
    assert found.key == first
    if first == (0, 3):
        assert "departs more from what was known" in found.reasons[1, 4]


def test_a_surprise_has_to_be_better_by_more_than_a_tenth():
    """Each block says the same, so that chance excuses nothing."""
    assert choose(Toy({(0,): 0.215, (3,): 0.2})).key == (3,)
    assert choose(Toy({(0,): 0.215, (3,): 0.2}, surprising={3})).key == (0,)
    assert choose(Toy({(0,): 0.225, (3,): 0.2}, surprising={3})).key == (3,)


def test_what_undoes_itself_has_to_be_better_by_half():
    """A zero far off, and a load that holds it there, bend a motion as a bit of length does."""
    for error, key in ((0.28, (0, 2)), (0.32, (1, 3))):
        toy = Toy({(0,): 0.5, (0, 2): error, (1, 3): 0.2}, undoing=[(1, 3)])
        assert choose(toy).key == key
    assert choose(Toy({(0,): 0.5, (0, 2): 0.28, (1, 3): 0.2})).key == (1, 3)


def test_a_set_that_shrank_is_exchanged_for_one_that_surprises_less():
    """The pair does best, but either member alone does about as well."""
    errors = {(3,): 0.1000, (0,): 0.1001, (1, 3): 0.0999}
    merits = {(3,): 1.0, (0,): 1.01, (1, 3): 0.99}
    assert choose(Toy(errors, merits, surprising={3})).key == (0,)


def test_a_set_that_is_good_enough_asks_for_no_more():
    toy = Toy({(0,): 0.10, (0, 1): 0.05})
    assert choose(toy).key == (0, 1)
    assert choose(toy, lambda key: key == (0,)).key == (0,)


def test_fits_that_did_not_converge_or_cannot_be_are_no_evidence():
    toy = Toy({(0,): 0.5, (1,): 0.1, (3,): 0.05})
    toy.unfit.add((1,))
    toy.refused[(3,)] = "mass would be 60 times its nominal value"
    found = choose(toy)
    assert found.key == (0,)
    assert found.reasons[(1,)] == "did not converge"
    assert found.reasons[(3,)].startswith("mass would be")


def test_every_other_set_has_a_reason_with_its_worst_place():
    found = choose(Toy({(0,): 0.2, (1,): 0.5, (0, 1): 0.195}))
    assert set(found.reasons) == {(), (1,), (0, 1)}
    assert found.reasons[(1,)].startswith("2.5 times the error, most at ")


def test_what_takes_more_than_a_fifth_is_not_said_to_take_little():
    # The larger set fits no better, so that its better forecasts are luck.
    found = choose(Toy({(0,): 0.2, (0, 1): 0.1}, {(0,): 1.0, (0, 1): 1.0}))
    assert found.key == (0,)
    assert found.reasons[(0, 1)] == "takes 50 % off what remains, and fits no better"


@given(st.lists(st.floats(0.02, 1.2), min_size=6, max_size=6), st.integers(0, 3))
@settings(max_examples=60)
def test_what_is_chosen_is_never_worse_than_the_nominal(errors, seed):
    keys = [(0,), (1,), (3,), (0, 1), (0, 3), (0, 1, 3)]
    toy = Toy(dict(zip(keys, errors, strict=True)), scatter=0.1 * seed)
    found = choose(toy)
    assert toy.error(found.key) <= 1.0 + 1e-9
    assert not set(found.key) & set(found.minor)
    assert set(found.reasons) == set(toy.tried) - {found.key}


def test_what_fits_no_better_than_chance_is_not_needed_however_well_it_forecasts():
    """What breaks away by a hair forecasts a block well or badly, whatever is known of it."""
    errors = {(2,): 0.13, (1, 2): 0.003}
    assert choose(Toy(errors, merits={(): 9e3, (2,): 213.6, (1, 2): 212.0})).key == (2,)
    assert choose(Toy(errors, merits={(): 9e3, (2,): 213.6, (1, 2): 180.0})).key == (1, 2)


@pytest.mark.parametrize(("astray", "key"), [(1, (2,)), (3, (0,))])
def test_what_leaves_a_third_of_all_data_wins_though_a_block_or_two_go_astray(astray, key):
    toy = Toy({(0,): 0.02, (2,): 0.005}, merits={(): 9e3, (0,): 300.0, (2,): 20.0}, blocks=8)
    toy.validated[2,].squares[:astray] = toy.currency.nominal[:astray]
    assert toy.error((2,)) > 3 * toy.error((0,))
    assert choose(toy).key == key
    toy.tried[2,].merit = 200.0
    assert choose(toy).key == (0,)


@pytest.mark.parametrize(("alone", "merit", "key"), [
    (1, 40.0, (2,)), (3, 40.0, (0,)), (1, 120.0, (0,)),
])  # fmt: skip
def test_a_step_that_lies_in_one_block_is_judged_by_fits(alone, merit, key):
    """Data without it do not tell what it shows, so that its forecast is luck."""
    toy = Toy({(0,): 0.02, (2,): 0.02}, merits={(): 9e3, (0,): 220.0, (2,): merit}, blocks=8)
    toy.validated[2,].squares[:alone] *= 9.0
    toy.currency.nominal[:alone] *= 100.0
    for one in toy.validated.values():
        one.squares[:alone] *= 100.0
    assert toy.error((2,)) > 1.5 * toy.error((0,))
    assert choose(toy).key == key


@pytest.mark.parametrize(("merit", "key"), [(20.5, (0, 3)), (25.0, (1, 3))])
def test_down_to_the_noise_the_same_counts_among_what_fits_no_worse(merit, key):
    sets = {(0, 3): 0.2, (1, 3): 0.2, (0, 1): 0.2}
    known = PendulumEquation().parameters["mass"].value
    toy = Toy(sets, {(0, 3): merit, (1, 3): 20.0, (0, 1): 90.0}, mass=0.02 * known)
    assert least_otherwise(toy, (1, 3)) == key


class Fitted(Toy):
    """The same, with what is left of a set without a member, if it was tried."""

    def merged(self, key, more, drop):
        return tuple(number for number in key if number not in drop), None

    def add(self, sets):
        assert set(sets) <= set(self.tried)


@pytest.mark.parametrize(("error", "named"), [(0.08, (3,)), (0.025, (2,))])
def test_where_only_noise_is_left_a_fit_whose_forecasts_go_astray_is_not_the_likeliest(
    error, named
):
    toy = Fitted({(2,): error, (3,): 0.02}, {(): 5000.0, (2,): 100.0, (3,): 100.04})
    assert significant(toy, needed=10.0) == named
