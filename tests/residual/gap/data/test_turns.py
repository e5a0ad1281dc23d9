"""Angles that were cut at a turn are refused, or told where they are inputs."""

import dataclasses

import numpy as np
import pytest
from pan_head import Head, turning

from residual.gap.data.examine import examine, findings
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel


@pytest.mark.parametrize("unit", ["deg", "rad"])
def test_an_angle_that_is_cut_at_a_turn_is_refused_with_the_fix(unit):
    turn = {"deg": 360.0, "rad": 2 * np.pi}[unit]

    class Turning(Head):
        state_channels = (Channel("pan", unit, "other"),)

    run = turning()
    middle = float(np.median(run.states))
    states = run.states - middle + turn / 2
    cut = dataclasses.replace(run, states=(states + turn / 2) % turn - turn / 2)
    whole = dataclasses.replace(run, states=states)
    if unit == "rad":
        states = states - turn / 2
        states *= 0.02
        whole = dataclasses.replace(run, states=states + turn / 2)
        cut = dataclasses.replace(run, states=(whole.states + turn / 2) % turn - turn / 2)
    assert not [one for one in findings(Turning(), [whole]) if one.kind == "wrapped"]
    with pytest.raises(ValueError, match=r"pan: jumps by a whole turn .*unwrap"):
        examine(Turning(), [cut])


class Vane(FirstOrderSystem):
    """A nacelle that follows the wind's direction."""

    dt = 600.0
    state_channels = (Channel("nacelle", "deg", "other", scale=60.0),)
    action_channels = (Channel("wind", "deg", "input", scale=60.0),)

    def derivative(self, x, u, p):
        return (u - x) / 1200.0


def about_north(fast, seed=0, rows=400):
    """Means of ten minutes of a wind that goes round; the nacelle follows it half way in each."""
    rng = np.random.default_rng(seed)
    wind = np.cumsum(rng.normal(0.0, fast, rows))
    nacelle = [wind[0]]
    for one in wind:
        nacelle.append(nacelle[-1] + 0.4 * (one - nacelle[-1]))
    return Trajectory("run", 600.0 * np.arange(rows + 1), np.array(nacelle)[:, None], wind[:, None])


def wrapped(run):
    return [(one.where, one.severity) for one in findings(Vane(), [run]) if one.kind == "wrapped"]


def test_what_moves_fast_while_it_is_cut_is_seen_and_so_is_an_input():
    run = about_north(20.0)
    steps = np.abs(np.diff(run.states % 360.0, axis=0))
    assert np.abs(steps[steps > 180.0] - 360.0).max() > 0.03 * 360.0  # none too near a whole turn
    assert not wrapped(run)
    cut = dataclasses.replace(run, states=run.states % 360.0, actions=run.actions % 360.0)
    assert wrapped(cut) == [("nacelle", "refuse"), ("wind", "warning")]


def test_directions_that_jump_any_way_are_left_alone():
    rng = np.random.default_rng(1)
    run = about_north(20.0)
    wild = rng.uniform(0.0, 360.0, run.states.shape)
    assert not wrapped(dataclasses.replace(run, states=wild))
