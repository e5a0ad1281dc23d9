"""A command that acts through a play, against its definition in small steps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims import drive, followers
from sims.checks import check_simulator
from sims.effects import ActuatorLag, Delay, Hysteresis
from sims.effects.library import further_in, library
from sims.equations import FirstOrderSystem
from sims.pendulum import Pendulum
from sims.simulator import Channel, Parameter


class Valve(FirstOrderSystem):
    """A flow that settles behind a valve."""

    dt = 0.1
    substeps = 3
    state_channels = (Channel("flow", "l/min", "other", scale=5.0),)
    action_channels = (Channel("valve", "percent", "input", scale=50.0, low=0.0, high=100.0),)
    parameters = {"tau": Parameter(0.6, "s", "time constant", low=0.05)}

    def derivative(self, x, u, p):
        return (0.1 * u - x) / np.reshape(p.tau, (-1, 1))


def in_small_steps(path, width, start):
    """What follows a path through a play."""
    found, y = [], start
    for u in path:
        y = min(max(y, u - 0.5 * width), u + 0.5 * width)
        found.append(y)
    return np.array(found)


@settings(max_examples=25)
@given(st.integers(0, 1000), st.sampled_from(["zero", "linear"]), st.floats(0.01, 3.0))
def test_means_and_rises_are_those_of_the_definition(seed, hold, width):
    samples, n, fine = np.random.default_rng(seed).uniform(-2, 2, (1, 12)), 4, 200
    means, rises = drive.substep_inputs(samples, np.ones(12), n, 0.0, hold, (0, 12))
    middles = (np.arange(fine) + 0.5) / fine - 0.5
    path = (means[0, ..., None] + rises[0, ..., None] * middles).ravel()
    within = in_small_steps(path, width, samples[0, 0]).reshape(12, n, fine)
    start = samples[:, :1]
    means, rises, last = followers.dragged(means, rises, np.ones(12), width, start, (0, 12))
    assert means[0] == pytest.approx(within.mean(axis=2), abs=0.02)
    assert rises[0] == pytest.approx(12 * (within * middles).mean(axis=2), abs=0.05)
    assert last[0] == pytest.approx(within[-1, -1, -1], abs=0.02)


def test_period_by_period_it_is_as_over_the_whole_record():
    effects = [Delay("valve", 0.17), Hysteresis("valve", 7.0), ActuatorLag("valve", 0.2)]
    valve, rng = Valve(effects=effects), np.random.default_rng(1)
    commands = np.repeat(rng.uniform(20, 80, (8, 1)), 6, axis=0)
    path = valve.rollout(valve.augment([[3.0]], commands[:1])[0], commands)
    inputs = valve.drive(commands, np.full(48, 0.1), rises=True)
    state = np.full((1, 1), 3.0)
    for t in range(48):
        state = valve.integrate(state, inputs[None, t], np.array([0.1]))
        assert path[t + 1, :1] == pytest.approx(state[0], abs=1e-9)
    assert "failed" not in repr(check_simulator(valve))


def test_rows_have_plays_of_their_own_and_none_changes_no_bit():
    plain, rng, widths = Valve(), np.random.default_rng(2), np.array([0.0, 3.0, 30.0])
    commands = rng.uniform(0, 100, (3, 1))
    there = plain.with_effects([Hysteresis("valve", widths)])
    states = there.augment(rng.uniform(0, 10, (3, 1)), rng.uniform(0, 100, (3, 1)))
    together = there.step(states, commands)
    for i in (1, 2):
        alone = plain.with_effects([Hysteresis("valve", float(widths[i]))])
        assert np.array_equal(alone.step(states[[i]], commands[[i]])[0], together[i])
    assert np.array_equal(together[:1, :1], plain.step(states[:1, :1], commands[:1]))


def test_it_is_asked_for_where_much_is_left():
    assert "hysteresis@valve" not in map(str, library(Valve()))
    assert "hysteresis@valve" in map(str, further_in(Valve()))
    with pytest.raises(ValueError, match="written as equations"):
        Pendulum().with_effects([Hysteresis("voltage", 0.1)])


def logged(width, seed=3):
    """A stem with play before a flow that is slower than it was said to be, in small steps."""
    rng = np.random.default_rng(seed)
    goals = np.clip(50 + np.cumsum(rng.normal(0, 6, 60)), 10, 90)
    commands = np.repeat(goals, 10)
    stem = in_small_steps(commands, width, commands[0])
    flow, path = 0.1 * stem[0], []
    for u in stem:
        path.append(flow)
        for _ in range(100):
            flow += 1e-3 * (0.1 * u - flow) / 0.62
    seen = np.array(path)[:, None] + rng.normal(0, 0.01, (len(path), 1))
    return Trajectory("run", 0.1 * np.arange(len(path)), seen, commands[:-1, None])


@pytest.mark.long
def test_find_gap_names_it_and_its_width_and_no_play_where_there_is_none():
    found = find_gap(Valve(), [logged(6.0)])
    play = next(v for v in found.verdicts if v.effect == "hysteresis")
    assert play.kind == "confirmed"
    assert play.parameters["width"].value == pytest.approx(6.0, abs=0.2)
    without = find_gap(Valve(), [logged(0.0)])
    assert not any(v.effect == "hysteresis" for v in without.verdicts)
