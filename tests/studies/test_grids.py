"""Grids expand as written and wrong ones are refused."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from studies.running.grids import expand_grid

BASE = {"seed": 0, "budget": {"true_samples": 3750, "iterations": 2}, "estimator": {}}


@given(
    seeds=st.lists(st.integers(0, 99), min_size=1, max_size=4, unique=True),
    samples=st.lists(st.integers(2, 9999), min_size=1, max_size=4, unique=True),
)
def test_a_block_is_the_product_of_its_values(seeds, samples):
    trials = expand_grid(BASE, [{"seed": seeds, "budget.true_samples": samples}])
    found = [(trial["seed"], trial["budget"]["true_samples"]) for trial in trials]
    assert found == [(seed, n) for seed in seeds for n in samples]
    assert all(trial["budget"]["iterations"] == 2 for trial in trials)


def test_blocks_follow_one_another_and_share_no_duplicates():
    trials = expand_grid(BASE, [{"seed": [1, 2]}, {"seed": [2, 3]}])
    assert [trial["seed"] for trial in trials] == [1, 2, 3]


def test_the_shared_settings_are_not_changed():
    expand_grid(BASE, [{"budget.true_samples": [1]}])
    assert BASE["budget"]["true_samples"] == 3750


@pytest.mark.parametrize(
    ("block", "message"),
    [
        ({"budget.samples": [1]}, "no setting 'budget.samples'"),
        ({"sed": [1]}, "no setting 'sed'"),
        ({"seed": 1}, "'seed' needs a list"),
        ({"seed": []}, r"'seed' needs a list of values, got \[\]"),
    ],
)
def test_a_wrong_grid_names_the_block_and_the_setting(block, message):
    with pytest.raises(ValueError, match=message):
        expand_grid(BASE, [{"seed": [0]}, block])
