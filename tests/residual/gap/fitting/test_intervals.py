"""When a fitted number has no interval."""

from types import SimpleNamespace

import numpy as np
import pytest

from residual.gap.fitting.intervals import bounded, deviations, ended


def fitted(value, slopes):
    """A fit of one number between -10 and 10."""
    knob = SimpleNamespace(low=-10.0, high=10.0, step=0.1, unit="m/s")
    return SimpleNamespace(
        model=SimpleNamespace(knobs=[knob]),
        theta=np.array([value]),
        by_knob=np.full((3, 5, 1), slopes),
    )


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
    fit = SimpleNamespace(
        model=SimpleNamespace(knobs=[SimpleNamespace(known=k) for k in (np.inf, known)]),
        theta=np.ones(2),
        by_knob=np.stack([effect, parameter], axis=2),
        projected=noise * rng.standard_normal((30, 20)),
        weights=np.ones(30),
        basis=np.zeros((30, 20, 0)),
    )
    own = noise / np.linalg.norm(effect)
    assert deviations(fit, Ten())[1] < 2 * known
    assert deviations(fit, Ten())[0] < 2 * np.hypot(own, known)
