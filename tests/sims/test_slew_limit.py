"""A command that is followed at a limited pace, against its definition in small steps."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from sims import drive, followers
from sims.checks import check_simulator
from sims.effects import ActuatorLag, Delay, SlewLimit
from sims.effects.library import further_in, library
from sims.equations import EquationOfMotion
from sims.pendulum import Pendulum
from sims.simulator import Channel


class Servo(EquationOfMotion):
    """A hobby servo, 1 kg m^2."""

    dt = 0.05
    substeps = 3
    state_channels = (
        Channel("angle", "rad", "position", scale=1.0),
        Channel("speed", "rad/s", "rate", rate_of="angle", scale=5.0),
    )
    action_channels = (Channel("goal", "rad", "input", scale=1.0, low=-2.0, high=2.0),)

    def acceleration(self, q, v, u, force, p):
        return 100.0 * (u - q) - 14.0 * v + force


def in_small_steps(command, pace, times, start):
    """What follows a command by at most a pace, at the times."""
    path, y = [start], start
    for before, after in itertools.pairwise(times):
        most = pace * (after - before)
        y += np.clip(command(0.5 * (before + after)) - y, -most, most)
        path.append(y)
    return np.array(path)


@pytest.mark.parametrize("hold", ["zero", "linear"])
def test_means_and_rises_are_those_of_the_definition(hold):
    rng = np.random.default_rng(0)
    samples, substeps, slow = rng.uniform(-2, 2, (1, 30)), 4, 0.08
    durations = rng.uniform(0.02, 0.2, 30)
    begins = np.concatenate([[0.0], np.cumsum(durations)])
    steep = np.append(np.diff(samples[0]), 0.0) if hold == "linear" else np.zeros(30)

    def command(time):
        k = min(np.searchsorted(begins, time, side="right") - 1, 29)
        return samples[0, k] + steep[k] * (time - begins[k]) / durations[k]

    means, rises = drive.substep_inputs(samples, durations, substeps, 0.0, hold, (0, 30))
    means, rises, last = followers.limited(means, rises, durations, slow, samples[:, :1], (0, 30))
    fine = 400
    ends = begins[:-1, None] + durations[:, None] * np.arange(substeps * fine) / (substeps * fine)
    times = np.append(ends.ravel(), begins[-1])
    path = in_small_steps(command, 1 / slow, times, samples[0, 0])
    middles = 0.5 * (path[1:] + path[:-1]).reshape(30, substeps, fine)
    assert means[0] == pytest.approx(middles.mean(axis=2), abs=2e-3)
    tilt = (np.arange(fine) + 0.5) / fine - 0.5
    assert rises[0] == pytest.approx(12 * (middles * tilt).mean(axis=2), abs=1e-2)
    assert last[0] == pytest.approx(path[-1], abs=2e-3)


def test_a_small_step_is_followed_soon_and_a_large_one_late():
    servo = Servo(effects=[SlewLimit("goal", time=1.0, full=4.0)])
    for step, late in ((0.2, 0.05), (2.0, 0.5)):
        inputs = servo.drive(np.full((40, 1), step), np.full(40, 0.05), before=[[0.0]])[..., 0]
        arrives = 0.05 * np.argmax(inputs[..., -1].ravel() >= step - 1e-12)
        assert arrives == pytest.approx(late, abs=0.051)


def test_period_by_period_it_is_as_over_the_whole_record():
    effects = [Delay("goal", 0.07), ActuatorLag("goal", 0.03), SlewLimit("goal", 0.8, 4.0)]
    servo, rng = Servo(effects=effects), np.random.default_rng(1)
    goals = np.repeat(rng.uniform(-2, 2, (8, 1)), 6, axis=0)
    path = servo.rollout(servo.augment([[0.0, 0.0]], goals[:1])[0], goals)
    inputs = servo.drive(goals, np.full(48, 0.05), rises=True)
    state = np.zeros((1, 2))
    for t in range(48):
        state = servo.integrate(state, inputs[None, t], np.array([0.05]))
        assert path[t + 1, :2] == pytest.approx(state[0], abs=1e-9)
    assert "failed" not in repr(check_simulator(servo))


def test_rows_have_times_of_their_own_and_none_changes_no_bit():
    plain, rng = Servo(), np.random.default_rng(2)
    times = np.array([0.0, 0.3, 2.0])
    goals = rng.uniform(-2, 2, (3, 1))
    there = plain.with_effects([SlewLimit("goal", times, 4.0)])
    states = there.augment(rng.normal(0, 1, (3, 2)), rng.uniform(-2, 2, (3, 1)))
    together = there.step(states, goals)
    for i in (1, 2):
        alone = plain.with_effects([SlewLimit("goal", float(times[i]), 4.0)])
        assert np.array_equal(alone.step(states[[i]], goals[[i]])[0], together[i])
    assert np.array_equal(together[:1, :2], plain.step(states[:1, :2], goals[:1]))


def test_goals_are_asked_for_it_at_once_and_other_inputs_where_much_is_left():
    class Driven(Servo):
        action_channels = (Channel("torque", "N m", "input", scale=1.0),)

    assert "slew_limit@goal" in map(str, library(Servo()))
    assert "slew_limit@goal" not in map(str, further_in(Servo()))
    assert "slew_limit@torque" not in map(str, library(Driven()))
    assert "slew_limit@torque" in map(str, further_in(Driven()))
    suited = SlewLimit("goal", 0.5).suited_to(-1.0, 2.0)
    assert (suited.full, suited.seconds_per_unit) == (3.0, pytest.approx(0.5 / 3))
    with pytest.raises(ValueError, match="written as equations"):
        Pendulum().with_effects([SlewLimit("voltage", 0.1)])
