"""When a fitted number has no interval."""

from types import SimpleNamespace

import numpy as np
import pytest

from residual.gap.intervals import bounded, ended


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
