"""Least squares with signs, and held-out proof."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from residual.gap.confirm import earns_place, span
from residual.gap.signatures import constrained, project_out
from scipy.optimize import nnls


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


def test_projection_removes_what_the_basis_can_imitate():
    rng = np.random.default_rng(0)
    basis, other = rng.normal(size=(30, 3)), rng.normal(size=(30, 2))
    mixed = basis @ rng.normal(size=(3, 2))
    np.testing.assert_allclose(project_out(basis, mixed), 0, atol=1e-9)
    assert np.abs(basis.T @ project_out(basis, other)).max() < 1e-9


def test_an_effect_has_to_help_on_most_of_the_held_out_data():
    rng = np.random.default_rng(1)
    base = rng.chisquare(20, 30)
    assert earns_place(base + 10, base)
    assert not earns_place(base, base + 10)
    assert not earns_place(base + rng.normal(size=30), base)
    once = np.zeros(30)
    once[3] = 500.0
    assert earns_place(base + once, base)


def test_span_brackets_the_root_mean_square():
    squares = np.random.default_rng(2).chisquare(1, 400)
    found = span(squares, np.random.default_rng(3))
    assert found.low < found.value < found.high
    assert found.low < 1 < found.high
