"""What grows steadily along a record, as a room that warms, passes for an effect no longer."""

import dataclasses

import numpy as np
import pytest
from oven import SLOW, Oven, steps

from residual.gap import find_gap

DUTIES = [float(duty) for duty in np.random.default_rng(3).integers(0, 2, 25)]


def warmed(run, by):
    """The record in a room that warms steadily, by so many K in all (closed form)."""
    rate = by / run.times[-1]
    more = rate * (run.times - SLOW * (1 - np.exp(-run.times / SLOW)))
    return dataclasses.replace(run, states=run.states + more[:, None])


def named(run):
    return [v for v in find_gap(Oven(), [run]).verdicts if v.parameters]


@pytest.mark.parametrize("by", [1.0, 3.0])
def test_a_room_that_warms_has_no_name_that_is_certain(by):
    found = named(warmed(steps(0, DUTIES, 0.0, lag=0.0), by))
    assert not [verdict.label for verdict in found if verdict.kind == "confirmed"]


def test_what_is_there_in_a_room_that_warms_stays_certain():
    found = named(warmed(steps(0, DUTIES, 0.0, lag=8.0), 1.0))
    assert "actuator_lag@duty" in [v.label for v in found if v.kind == "confirmed"]
    assert not [v.label for v in found if v.kind == "confirmed" and v.effect != "actuator_lag"]


def test_a_gain_in_a_room_that_stays_as_it_is_is_certain():
    duties = np.random.default_rng(3).uniform(0.0, 0.9, 25)
    run = steps(0, list(duties), 0.0, lag=0.0)
    actions = run.actions / 0.9
    (gain,) = named(dataclasses.replace(run, actions=actions))
    assert (gain.kind, gain.doubts) == ("confirmed", ())
    assert gain.parameters["gain"].value == pytest.approx(-0.1, abs=5e-3)


def test_no_number_of_what_is_certain_lies_at_its_bound():
    """A store so slow that it is a ramp."""
    found = named(warmed(steps(0, DUTIES, 0.0, lag=0.0), 1.0))
    bound = [v for v in found if any(n.at_bound for n in v.parameters.values())]
    assert all("at_bound" in verdict.doubts for verdict in bound)
