"""Sets within sets: what a larger set found with a member at zero, the smaller one gets, too."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from residual.gap.model.candidates import candidates
from residual.gap.model.nested import absent, from_nested
from residual.gap.preparation.prepare import prepare
from residual.gap.search.sets import Search
from sims.effects import ActuatorGain, DeadZone
from sims.pendulum_equation import PendulumEquation
from studies.hidden.data import Truth, make_logs

GAIN, ZONE = 0, 1


@pytest.fixture(scope="module")
def search() -> Search:
    """A gain of +30 % is hidden; a dead zone is not."""
    simulator = PendulumEquation()
    logs = make_logs(Truth(actuator_gain=0.3), 0, "strong", "A", 2)
    fitter = prepare(simulator, logs, 0.4).fitter
    offered = [ActuatorGain("voltage"), DeadZone("voltage")]
    return Search(simulator, candidates(simulator, offered, fitter.samples), fitter)


def test_a_set_without_what_is_not_there_fits_as_well(search):
    """A fit that got stuck before is mended by what a larger set found."""
    search.fit((GAIN,), np.array([0.1]))
    fitted = search.tried[GAIN,]
    stuck = dataclasses.replace(fitted, theta=np.array([-0.4]), loss=100 * fitted.loss)
    search.tried[GAIN,] = stuck
    search.fit((GAIN, ZONE), np.array([0.1, 0.01]))
    whole = search.tried[GAIN, ZONE]
    assert absent(whole.model, (GAIN, ZONE), whole.theta) == [ZONE]
    assert search.tried[GAIN,].merit == pytest.approx(whole.merit, rel=1e-6)
    assert search.tried[GAIN,].theta == pytest.approx(fitted.theta, rel=1e-3)


def test_a_larger_set_begins_where_the_smaller_one_is(search):
    search.fit((GAIN,), np.array([0.1]))
    inner, outer = search.tried[GAIN,], search.model((GAIN, ZONE))
    start = from_nested(
        outer, (GAIN, ZONE), np.array([0.0, 0.5]), inner.model, (GAIN,), inner.theta
    )
    assert start[0] == inner.theta[0]
    assert 0 < start[1] < 0.02 * outer.knobs[1].step
