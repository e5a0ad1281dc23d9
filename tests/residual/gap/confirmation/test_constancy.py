"""Constants that are none: zeros that creep, and loads that differ from record to record."""

import dataclasses

import numpy as np
import pytest
from oven import Oven, steps

from residual.gap import find_gap

DUTIES = [np.random.default_rng(seed).uniform(0.1, 1.0, 12) for seed in (0, 1)]
RUNS = [steps(seed, list(duties), 0.3, lag=0.0) for seed, duties in enumerate(DUTIES)]

OFFERED = ("constant_load", "sensor_offset", "actuator_gain")


def shifted(run, first, last):
    """A record whose zero goes in a straight line from one value to another, in K."""
    zero = np.linspace(first, last, len(run.times))
    return dataclasses.replace(run, states=run.states + zero[:, None])


@pytest.mark.parametrize(("zeros", "creeps"), [
    (((5, 5), (5, 5)), False), (((4.8, 5.2), (4.8, 5.2)), False),
    (((3, 7), (3, 7)), True), (((7, 3), (7, 3)), True), (((7, 7), (3, 3)), True),
])  # fmt: skip
def test_a_push_is_certain_only_while_it_is_a_constant(zeros, creeps):
    runs = [shifted(run, *ends) for run, ends in zip(RUNS, zeros, strict=True)]
    (named,) = [v for v in find_gap(Oven(), runs, effects=OFFERED).verdicts if v.label]
    assert named.effect in ("constant_load", "sensor_offset")
    assert ("creeps" in named.doubts) == creeps
    assert (named.kind == "confirmed") == (not creeps)
