"""Records set aside may measure other channels than those that are fitted."""

import dataclasses
from typing import ClassVar

import numpy as np
import pytest
from held import path
from oven import Oven, steps

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel, Parameter
from studies.gap.lead import lead
from studies.hidden.data import Truth, make_logs

ANGLE, RATE = 0, 1


def measuring(runs, *columns):
    """The runs, other columns not measured."""
    kept = np.isin(np.arange(2), columns)
    return [dataclasses.replace(run, states=np.where(kept, run.states, np.nan)) for run in runs]


def ask(fitted, held):
    return find_gap(PendulumEquation(), fitted, held_out=held, effects=["mass"], hold="zero")


@pytest.fixture(scope="module")
def runs():
    return make_logs(Truth(mass=0.2), 3, "strong", "A", runs=6)


@pytest.mark.long
def test_their_noise_is_that_of_their_own_channels(runs):
    fitted, held = runs[:4], runs[4:]
    both = ask(fitted, held).held_out.by_channel
    alone = ask(fitted, measuring(held, RATE)).held_out
    assert set(alone.by_channel) == {"rate"}
    assert alone.noise_floor.value == pytest.approx(both["rate"].noise_floor.value, rel=0.5)
    # From rates alone an angle is hard to tell, and so is what comes next.
    assert alone.after.value > both["rate"].after.value
    assert both["angle"].noise_floor.value < 0.2 * both["rate"].noise_floor.value


@pytest.mark.long
def test_what_only_they_measure_is_not_judged(runs):
    found = ask(measuring(runs[:4], ANGLE), runs[4:])
    assert set(found.held_out.by_channel) == {"angle"}


def test_nothing_in_common_is_refused_before_the_search(runs):
    says = "records set aside: none of them measures angle, which the others measure"
    with pytest.raises(ValueError, match=says):
        ask(measuring(runs[:4], ANGLE), measuring(runs[4:], RATE))


def test_what_is_found_about_them_is_told_as_such(runs):
    still = [dataclasses.replace(run, states=np.array(run.states)) for run in runs[4:]]
    for run in still:
        run.states[:, RATE] = 0.5
    found = ask(runs[:4], still)
    assert any(
        (one.kind, one.where) == ("still", "records set aside: rate")
        and one.words.startswith("records set aside: rate is 0.5 rad/s in all")
        for one in found.quality
    )
    assert set(found.held_out.by_channel) == {"angle"}


@pytest.mark.long
def test_an_effect_that_does_not_help_there_is_not_certain(runs):
    """A brake that was on in the records searched, and off in those set aside."""
    braked = make_logs(Truth(mass=0.2, coulomb_friction=2e-3), 3, "strong", "A", runs=4)
    offered = ["mass", "coulomb_friction"]
    found, alone = (
        find_gap(PendulumEquation(), braked, held_out=held, effects=offered, hold="zero")
        for held in (runs[4:], ())
    )
    kinds, kinds_alone = (
        {v.label: (v.kind, v.doubts) for v in one.verdicts if v.parameters}
        for one in (found, alone)
    )
    assert {kind for kind, _ in kinds_alone.values()} == {"confirmed"}
    assert kinds["mass"][0] == "confirmed"
    assert kinds["coulomb_friction@pivot"] == ("ambiguous", ("no_help",))


def test_what_cannot_act_there_is_not_judged():
    """A gain of a heater that is off throughout the record set aside, in a warmer room."""
    duties = [0.0, 0.8, 0.3, 1.0, 0.0, 0.6, 0.9, 0.2, 0.7, 0.1]
    weak = steps(0, [0.8 * duty for duty in duties], 0.0, lag=0.0)
    weak = dataclasses.replace(weak, actions=weak.actions / 0.8)
    cool = steps(1, [0.0, 0.0, 0.0], 0.9, lag=0.0)
    cool = dataclasses.replace(cool, states=cool.states + 2.0)
    offered = ["actuator_gain", "delay"]
    found = find_gap(Oven(), [weak], held_out=[cool], effects=offered, hold="zero")
    (gain,) = (v for v in found.verdicts if v.effect == "actuator_gain")
    assert (gain.kind, gain.doubts) == ("confirmed", ())
    assert found.held_out.denies
    assert "makes little difference" in lead(found)


def test_how_far_their_forecasts_go_is_told_of_them(runs):
    """Read more rarely, they end elsewhere."""
    rare = [
        dataclasses.replace(
            run, times=run.times[::3], states=run.states[::3], actions=run.actions[:-1:3]
        )
        for run in runs[4:]
    ]
    step = float(np.median(rare[0].durations))
    found = ask(runs[:4], rare)
    told = found.held_out.horizon_s
    assert told == pytest.approx(step * round(told / step))
    assert found.gap.horizon_s != pytest.approx(step * round(found.gap.horizon_s / step))


class Mug(FirstOrderSystem):
    """Its temperature above that of the room; it is of one piece."""

    dt = 5.0
    state_channels = (Channel("warmth", "K", "other", scale=20.0),)
    action_channels = (Channel("power", "W", "input", scale=20.0, low=0.0, high=60.0),)
    parameters: ClassVar = {"loss": Parameter(4e-4, "1/s", "loss", low=1e-6)}

    def derivative(self, x, u, p):
        return (u[:, 0] / 900.0 - p.loss * x[:, 0])[:, None]


def test_a_tail_of_which_nobody_knows_what_its_second_store_holds_is_told():
    """Of a record that was cut in two, its second part: the wall is still warm there."""
    powers = np.repeat([60.0, 0.0, 40.0, 0.0, 55.0, 0.0, 60.0, 0.0], 60)

    def rates(_, x, power):
        return [power / 900 - 4e-4 * x[0] + 4e-3 * (x[1] - x[0]), (x[0] - x[1]) / 1500]

    warmth = path(rates, [0.0, 0.0], powers, 5.0)[:-1, 0]
    warmth = warmth + 0.02 * np.random.default_rng(0).standard_normal(len(powers))
    whole = Trajectory("mug", 5.0 * np.arange(len(powers)), warmth[:, None], powers[:-1, None])
    first, tail = whole.piece(0, 420), whole.piece(420, 480)
    found = find_gap(Mug(), [first], held_out=[tail], effects=["second_store"])
    assert found.held_out.refutes
    assert any("in balance where a record begins" in one.says for one in found.quality)
    other = find_gap(Mug(), [first], held_out=[first], effects=["second_store"])
    assert not any("in balance where a record begins" in one.says for one in other.quality)
