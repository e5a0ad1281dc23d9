"""Errors of forecasts in units of what the nominal simulator makes of them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from residual.gap.fitting.forecasts import span
from residual.gap.search.currency import Currency, groups
from sims.simulator import Channel


def made(seed, blocks=12, channels=3):
    rng = np.random.default_rng(seed)
    nominal = rng.uniform(0.1, 4.0, (blocks, channels)) * 10.0 ** rng.integers(-6, 6, channels)
    return rng, nominal, Currency(nominal, ((0, 1), (2,))[: channels - 1])


@given(st.integers(0, 1000), st.floats(0.01, 3))
def test_perfect_is_nought_the_nominal_one_and_scale_is_linear(seed, times):
    _, nominal, currency = made(seed)
    assert currency.error(0 * nominal) == 0.0
    assert currency.error(nominal) == pytest.approx(1.0)
    assert currency.error(times**2 * nominal) == pytest.approx(times)
    np.testing.assert_allclose(currency.by_group(times**2 * nominal), times)


@given(st.integers(0, 1000), st.floats(1e-3, 1e3))
def test_units_do_not_matter(seed, factor):
    rng, nominal, currency = made(seed)
    squares = nominal * rng.uniform(0, 2, nominal.shape)
    units = np.array([factor**2, 1.0, 1.0])
    other = Currency(nominal * units, currency.groups)
    assert other.error(squares * units) == pytest.approx(currency.error(squares))


@given(st.integers(0, 1000))
def test_a_second_copy_of_the_blocks_does_not_matter(seed):
    rng, nominal, currency = made(seed)
    squares = nominal * rng.uniform(0, 2, nominal.shape)
    twice = Currency(np.vstack([nominal, nominal]), currency.groups)
    assert twice.error(np.vstack([squares, squares])) == pytest.approx(currency.error(squares))


def test_a_joint_counts_once_however_many_of_its_channels_were_measured():
    channels = [
        Channel("angle", "rad", "position"),
        Channel("slide", "m", "position"),
        Channel("rate", "rad/s", "rate", rate_of="angle"),
    ]
    assert groups(channels) == ((0, 2), (1,))
    assert groups(channels[2:]) == ((0,),)
    nominal = np.ones((5, 3))
    currency = Currency(nominal, groups(channels))
    assert currency.error(nominal * [0.0, 1.0, 0.0]) == pytest.approx(0.5)


def test_a_joint_counts_by_the_part_of_its_error_that_is_no_noise():
    """One that errs 50 times as noise does is mended, and one with next to no gap stays."""
    nominal = np.array([[2500.0, 1.44]] * 6)
    currency = Currency(nominal, ((0,), (1,))).only_where_wrong(np.ones((6, 2)))
    assert currency.error(nominal) == pytest.approx(1.0)
    left = currency.error(nominal * [0.0, 1.0])
    assert 0.1 < left < 0.2
    share, low, high = currency.share(nominal, nominal * [0.0, 1.0], np.random.default_rng(0))
    assert low <= share <= high and share == pytest.approx(1 - left)


def test_a_joint_that_errs_as_noise_does_counts_for_nothing():
    nominal = np.array([[2500.0, 1.1]] * 6)
    currency = Currency(nominal, ((0,), (1,))).only_where_wrong(np.ones((6, 2)))
    assert currency.error(nominal * [0.0, 9.0]) == 0.0


def test_missing_blocks_count_for_nothing():
    nominal = np.ones((6, 1))
    nominal[2] = np.nan
    squares = 0.25 * nominal
    assert Currency(nominal, ((0,),)).error(squares) == pytest.approx(0.5)


def test_difference_has_the_standard_error_of_paired_blocks():
    rng = np.random.default_rng(0)
    errors = []
    for _ in range(400):
        nominal = np.ones((30, 1))
        currency = Currency(nominal, ((0,),))
        one = (0.5 + 0.1 * rng.standard_normal((30, 1))) ** 2
        more, error = currency.difference(one, 0.25 * nominal)
        errors.append(more / error)
    assert np.std(errors) == pytest.approx(1.0, abs=0.15)


def test_clearly_does_not_mind_that_blocks_are_driven_unequally_hard():
    drive = np.geomspace(0.01, 10, 20)[:, None] ** 2
    currency = Currency(drive, ((0,),))
    assert currency.clearly(0.3 * drive, 0.1 * drive, 0) > 10
    rng = np.random.default_rng(0)
    noise = drive * rng.uniform(0.5, 1.5, drive.shape)
    assert abs(currency.clearly(noise, drive, 0)) < 4


def test_share_is_what_lies_between_two_sets():
    rng, nominal, currency = made(3)
    low, high = currency.share(0.5 * nominal, 0.2 * nominal, rng)[1:]
    assert low <= 0.3 + 1e-9 and high >= 0.3 - 1e-9
    assert currency.share(nominal, 0 * nominal, rng) == pytest.approx((1.0, 1.0, 1.0))


def test_span_brackets_the_root_mean_square():
    squares = np.random.default_rng(2).chisquare(1, 400)
    found = span(squares)
    assert found.low < found.value < found.high
    assert found.low < 1 < found.high


def test_one_block_that_decides_alone_is_no_evidence():
    nominal = np.full((8, 1), 0.01)
    nominal[0] = 100.0
    better = nominal * np.linspace(0.2, 0.3, 8)[:, None]
    one = Currency(nominal, ((0,),))
    assert one.clearly(nominal, better, 0) > 2
    assert one.clearly(nominal, better, 0, by_stake=True) == 0
    alike = np.full((8, 1), 1.0)
    even = Currency(alike, ((0,),))
    worse = alike * np.linspace(1.5, 2.5, 8)[:, None]
    plain, by_stake = even.clearly(worse, alike, 0), even.clearly(worse, alike, 0, by_stake=True)
    assert plain == pytest.approx(by_stake, rel=0.1)


@pytest.mark.parametrize(("others", "sure"), [(9.0, True), (1.0, False)])
def test_where_one_block_outweighs_all_others_these_are_asked(others, sure):
    """A step at the start of a long rest: what explains it has to help in the rest, too."""
    wobble = np.random.default_rng(0).uniform(0.7, 1.4, 8)[:, None]
    nominal = np.array([40.0, 3.0, 1.0, 1.0, 2.0, 1.0, 1e-4, 1e-4])[:, None]
    better = np.append([[1.0]], nominal[1:] / others, axis=0) * wobble
    one = Currency(nominal, ((0,),))
    assert one.clearly(nominal, better, 0, True) == 0.0
    assert (one.clearly_elsewhere(nominal, better, 0) > 2.0) is sure
