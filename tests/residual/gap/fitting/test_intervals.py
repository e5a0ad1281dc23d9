"""When a fitted number has no interval."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from residual.gap.confirmation.certainty import SCATTERED, imitates
from residual.gap.fitting.contract import Fit
from residual.gap.fitting.intervals import bounded, cut_off, deviations, ended, scatter


def fitted(value, slopes):
    """A fit of one number between -10 and 10."""
    knob = SimpleNamespace(low=-10.0, high=10.0, step=0.1, unit="m/s")
    return SimpleNamespace(
        model=SimpleNamespace(knobs=[knob]),
        theta=np.array([value]),
        by_knob=np.full((3, 5, 1), slopes),
    )


@pytest.mark.parametrize(("value", "whole", "there"), [
    (10.0, (), True), (10.0, ("square",), False), (-10.0, ("square",), True), (2.0, (), False),
])  # fmt: skip
def test_a_bound_at_which_a_law_is_whole_cuts_nothing_off(value, whole, there):
    fit = fitted(value, 0.3)
    fit.model.knobs[0].field = "square"
    fit.model.owner = np.zeros(1, int)
    fit.model.chosen = [SimpleNamespace(effect=SimpleNamespace(whole=whole))]
    assert cut_off(fit, 0) is there


def found(knobs, theta, rows, left):
    """A linear fit of windows without start states, (W, R, p) and (W, R)."""
    model = SimpleNamespace(knobs=knobs)
    none = np.zeros((*left.shape, 0))
    with np.errstate(over="ignore"):
        losses = (left**2).sum(axis=1)
    return Fit(model, theta, losses, np.ones(len(left)), left, rows, none, True, None)


@pytest.mark.parametrize(
    ("value", "slopes", "there"), [(2.0, 0.3, False), (10.0, 0.3, True), (2.0, 0.0, True)]
)
def test_a_number_ends_at_its_bound_and_where_nothing_depends_on_it(value, slopes, there):
    fit = fitted(value, slopes)
    assert ended(fit, 0) is there
    assert bounded(fit, 0, 0.05, []).at_bound is there


class Ten(SimpleNamespace):
    """Ten blocks of three windows."""

    block = np.repeat(np.arange(10), 3)

    def __len__(self):
        return 10


def test_what_is_known_beforehand_is_known_however_large_residuals_are():
    rng = np.random.default_rng(0)
    known, noise = 0.1, 30.0
    effect = rng.standard_normal((30, 20))
    parameter = effect + 0.01 * rng.standard_normal((30, 20))
    knobs = [SimpleNamespace(known=k) for k in (np.inf, known)]
    rows = np.stack([effect, parameter], axis=2)
    fit = found(knobs, np.ones(2), rows, noise * rng.standard_normal((30, 20)))
    own = noise / np.linalg.norm(effect)
    assert deviations(fit, Ten())[1] < 2 * known
    assert deviations(fit, Ten())[0] < 2 * np.hypot(own, known)


@pytest.mark.parametrize(("slopes", "left"), [(1.0, 1e200), (1e200, 1.0), (np.inf, 1.0)])
def test_of_a_fit_that_ran_away_no_number_is_known(slopes, left):
    knobs = [SimpleNamespace(known=np.inf)]
    rows = np.full((30, 20, 1), slopes)
    fit = found(knobs, np.ones(1), rows, np.full((30, 20), left))
    assert deviations(fit, Ten()) == np.inf


def slopes_by_block(rng, amplitudes, together, numbers=1):
    """A fit of numbers that are zero by blocks of three windows, of unequal amplitude, each with
    errors that go together, as of a law that is not quite right."""
    blocks = len(amplitudes)
    rows = rng.standard_normal((blocks, 60, numbers)) * amplitudes[:, None, None]
    seen = together * (rows * rng.standard_normal((blocks, 1, numbers))).sum(axis=2)
    seen += rng.standard_normal(seen.shape)
    theta = np.linalg.lstsq(rows.reshape(-1, numbers), seen.ravel())[0]
    shape = (3 * blocks, 20)
    left = (seen - rows @ theta).reshape(shape)
    knobs = [SimpleNamespace(known=np.inf)] * numbers
    return found(knobs, theta, rows.reshape(*shape, numbers), left)


@pytest.mark.parametrize("numbers", [1, 5])
@pytest.mark.parametrize("together", [pytest.param(0.0, marks=pytest.mark.long), 1.0])
@pytest.mark.parametrize("amplitudes", [np.ones(10), np.linspace(0.1, 1, 10)], ids=["even", "ramp"])
def test_intervals_cover_however_blocks_are_driven(amplitudes, together, numbers):
    rng, covered = np.random.default_rng(0), []
    for _ in range(600):
        fit = slopes_by_block(rng, amplitudes, together, numbers)
        covered.append(np.abs(fit.theta) <= 1.96 * deviations(fit, Ten()))
    # Of white noise alone they are wider than they need to be.
    assert 0.92 <= np.mean(covered) <= (0.985 if together else 1.0)


def test_an_interval_is_as_if_one_block_after_the_other_were_left_out():
    fit = slopes_by_block(np.random.default_rng(3), np.linspace(0.5, 1, 10), 1.0, 2)
    without = []
    for b in range(10):
        rows, left = (part[Ten.block != b] for part in (fit.by_knob, fit.projected))
        moved = np.linalg.lstsq(rows.reshape(-1, 2), left.ravel())[0]
        without.append(moved)
    spread = np.sqrt(0.9 * (np.array(without) ** 2).sum(axis=0))
    told = deviations(fit, Ten())
    assert (spread < told).all() and (told < 1.3 * spread).all()


def test_an_interval_is_no_narrower_than_the_profile_of_the_loss_tells():
    fit = slopes_by_block(np.random.default_rng(0), np.ones(10), 0.0, numbers=2)
    own = deviations(fit, Ten())
    wide = dataclasses.replace(fit, spread=np.array([2.0, 0.1]) * own)
    np.testing.assert_allclose(deviations(wide, Ten()), [2.0, 1.0] * own)


def test_numbers_scatter_as_noise_does_only_where_the_law_is_right():
    rng, ramp = np.random.default_rng(0), np.linspace(0.3, 1, 10)
    right, wrong = (
        [scatter(slopes_by_block(rng, ramp, together, 2), Ten()).max() for _ in range(200)]
        for together in (0.0, 1.0)
    )
    assert np.median(right) == pytest.approx(1.0, abs=0.3) and max(right) < SCATTERED
    assert np.mean(np.array(wrong) > SCATTERED) > 0.95


@pytest.mark.parametrize(("size", "said"), [(2.0, True), (50.0, False)])
def test_what_scatters_is_steady_all_the_same_if_it_is_well_known(size, said):
    fit = slopes_by_block(np.random.default_rng(0), np.linspace(0.3, 1, 10), 1.0, 2)
    half = 1.96 * deviations(fit, Ten())
    fit = dataclasses.replace(fit, theta=size * half)
    assert imitates(fit, Ten(), half).any() == said
