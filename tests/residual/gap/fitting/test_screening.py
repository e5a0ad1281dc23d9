"""What a candidate adds to a fit: least squares with signs, start states projected out."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear, nnls

from residual.gap.fitting.bounded import bounded_step
from residual.gap.fitting.screening import (
    Signatures,
    Variant,
    constrained,
    pair_gains,
    project_out,
    signatures,
    triple_gains,
)
from residual.gap.model.candidates import Trial


@given(st.integers(0, 10_000), st.integers(1, 3))
def test_gain_never_exceeds_free_least_squares_and_respects_signs(seed, width):
    rng = np.random.default_rng(seed)
    columns, residual = rng.normal(size=(20, width)), rng.normal(size=20)
    sided = rng.integers(0, 2, width).astype(bool)
    gain, found = constrained(columns, residual, sided)
    assert (found[sided] >= 0).all()
    free = residual - columns @ np.linalg.lstsq(columns, residual, rcond=None)[0]
    assert gain <= residual @ residual - free @ free + 1e-6
    left = residual - columns @ found
    assert np.isclose(gain, residual @ residual - left @ left, atol=1e-6)


@given(st.integers(0, 10_000))
def test_one_sided_column_agrees_with_scipy(seed):
    rng = np.random.default_rng(seed)
    column, residual = rng.normal(size=(20, 1)), rng.normal(size=20)
    _, found = constrained(column, residual, np.array([True]))
    np.testing.assert_allclose(found, nnls(column, residual)[0], atol=1e-6)


@given(st.integers(0, 10_000), st.booleans())
def test_a_step_keeps_its_bounds_and_is_least_squares_where_none_binds(seed, tight):
    rng = np.random.default_rng(seed)
    columns, residual = rng.normal(size=(20, 2)) * [1.0, 300.0], rng.normal(size=20)
    high = (rng.uniform(0, 0.2, 2) if tight else 1e3) / np.array([1, 300])
    found = bounded_step(columns.T @ columns, columns.T @ residual, -high, high, 1e-12)
    assert (np.abs(found) <= high).all()
    if tight:
        assert ((residual - columns @ found) ** 2).sum() <= residual @ residual + 1e-9
    else:
        free = np.linalg.lstsq(columns, residual, rcond=None)[0]
        np.testing.assert_allclose(found, free, rtol=1e-6)


@given(st.integers(0, 10_000))
def test_a_bounded_step_of_one_number_agrees_with_scipy(seed):
    rng = np.random.default_rng(seed)
    column, residual = rng.normal(size=(20, 1)), rng.normal(size=20)
    low, high = -rng.uniform(0, 0.2, 1), rng.uniform(0, 0.2, 1)
    found = bounded_step(column.T @ column, column.T @ residual, low, high, 1e-12)
    best = lsq_linear(column, residual, (low, high), method="bvls").x
    np.testing.assert_allclose(found, best, atol=1e-6)


def shown(matrix, residual, one_sided=()):
    """Signatures of candidates with one column each."""
    variants = [
        Variant(n, Trial(np.ones((1, 1)), np.array([n in one_sided])), (n,), np.ones(1, dtype=bool))
        for n in range(matrix.shape[1])
    ]
    return Signatures(tuple(variants), matrix, residual)


@given(st.integers(0, 10_000))
def test_three_together_gain_what_least_squares_says(seed):
    rng = np.random.default_rng(seed)
    matrix, residual = rng.normal(size=(40, 6)) * [1, 1, 1, 1, 1, 1e-4], rng.normal(size=40)

    def left(places):
        basis = matrix[:, list(places)]
        rest = residual - basis @ np.linalg.lstsq(basis, residual, rcond=None)[0]
        return float(rest @ rest)

    for gain in triple_gains(shown(matrix, residual), 50):
        np.testing.assert_allclose(residual @ residual - gain.value, left(gain.variants), rtol=1e-6)
        pairs = min(left(pair) for pair in itertools.combinations(gain.variants, 2))
        assert left(gain.variants) < 0.8 * pairs * (1 + 1e-6)


def test_what_helps_only_together_is_found_among_much_that_helps_a_bit():
    rng = np.random.default_rng(0)
    hidden = rng.normal(size=200)
    first, second = rng.normal(size=(2, 200))
    three = np.stack([hidden + first, second - first, hidden - second], axis=1)
    bits = 3.0 * rng.normal(size=(200, 20)) + 0.6 * hidden[:, None]
    found = shown(np.hstack([bits, three]), 0.5 * hidden)
    assert {20, 21, 22} not in [set(gain.variants) for gain in pair_gains(found, 3)]
    best = triple_gains(found, 1)[0]
    assert set(best.variants) == {20, 21, 22}
    assert triple_gains(found, 1, without=[21]) != [best]
    forbidden = shown(found.matrix, -found.residual, one_sided=[20])
    assert {20, 21, 22} not in [set(gain.variants) for gain in triple_gains(forbidden, 50)]


@pytest.mark.parametrize("count", [0, 2])
def test_of_fewer_than_three_there_are_no_three(count):
    assert triple_gains(shown(np.ones((5, count)), np.ones(5)), 2) == []


def test_projection_removes_what_the_basis_can_imitate():
    rng = np.random.default_rng(0)
    basis, other = rng.normal(size=(30, 3)), rng.normal(size=(30, 2))
    mixed = basis @ rng.normal(size=(3, 2))
    np.testing.assert_allclose(project_out(basis, mixed), 0, atol=1e-9)
    assert np.abs(basis.T @ project_out(basis, other)).max() < 1e-9


def test_a_number_at_its_bound_hides_nothing_that_moves_like_it():
    rng = np.random.default_rng(0)
    column = rng.normal(size=(4, 30, 1))
    knob = SimpleNamespace(low=-0.1, high=0.1, step=0.1)

    def fit(value):
        return SimpleNamespace(
            model=SimpleNamespace(knobs=[knob]), theta=np.array([value]), weights=np.ones(4),
            basis=np.zeros((4, 30, 0)), by_knob=column, projected=3.0 * column[..., 0],
        )  # fmt: skip

    assert np.abs(signatures(fit(0.05), [], column).matrix).max() < 1e-9
    pinned = signatures(fit(0.1), [], column)
    np.testing.assert_allclose(pinned.matrix[:, 0], column.ravel())
    np.testing.assert_allclose(pinned.residual, 3.0 * column.ravel())


@pytest.mark.parametrize("overflown", [np.inf, np.nan])
def test_equations_that_overflow_give_no_step(overflown):
    matrix, right = np.eye(2), np.ones(2)
    none = np.zeros(2)
    for broken in (np.array([[1.0, 0.0], [0.0, overflown]]), matrix):
        aims = right if broken is not matrix else np.array([1.0, overflown])
        np.testing.assert_array_equal(bounded_step(broken, aims, -right, right), none)
