"""A stretch that was knocked, held or reset does not hide what the rest shows, and is told."""

import dataclasses
import re
from typing import ClassVar

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.answer.lone import daily
from residual.gap.data import examine
from residual.gap.data.stretch import Stretch
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel, Parameter
from studies.hidden.data import Truth, make_logs

MIDDLE, LONG = 125, 50
#: What is hidden among others.
OFFERED = ("sensor_offset", "mass", "coulomb_friction")


def ask(logs):
    options = {"effects": OFFERED, "hold": "zero", "minutes": 20.0}
    return find_gap(PendulumEquation(), logs, **options)


def reset(run, other):
    """A motion that goes on as another one, as if put there between two samples."""
    whole = (np.concatenate([a[:MIDDLE], b[MIDDLE:]]) for a, b in (
        (run.states, other.states), (run.actions, other.actions)))  # fmt: skip
    return Trajectory(run.name, run.times, *whole)


def by_hand(run, _):
    """A second in which a hand moves it."""
    states, turn = np.array(run.states), 2 * np.pi * np.arange(LONG) / LONG
    second = slice(MIDDLE, MIDDLE + LONG)
    states[second, 0] = states[MIDDLE, 0] + 2 * np.sin(turn) ** 2
    states[second, 1] = 4 * np.pi * np.sin(2 * turn)
    return dataclasses.replace(run, states=states)


def with_a_stretch(what):
    logs = list(make_logs(Truth(sensor_offset=0.1), 11, "strong", "A", 5))
    logs[2] = what(logs[2], logs[3])
    found = ask(logs)
    first = found.verdicts[0]
    assert first.effect == "sensor_offset"
    assert first.parameters["offset"].value == pytest.approx(0.1, rel=0.05)
    return [one.says for one in found.quality if "one stretch" in one.says]


@pytest.mark.long
def test_what_the_rest_of_the_log_shows_is_named(monkeypatch):
    """Though nobody saw that the record begins anew."""
    monkeypatch.setattr(examine, "cut_at_resets", lambda simulator, runs: (list(runs), []))
    (said,) = with_a_stretch(reset)
    assert "run 2 from 5" in said or "to 6.5 s" in said
    assert said.endswith("It was left out of everything that is said")


@pytest.mark.long
def test_what_is_left_in_one_stretch_beside_a_name_is_told():
    (said,) = with_a_stretch(by_hand)
    assert "of the squared error that is left lies in one stretch, run 2 from" in said
    assert said.endswith("leave it out or log more of its kind")


def test_no_stretch_is_told_of_a_log_without_one():
    found = ask(make_logs(Truth(sensor_offset=0.1), 11, "strong", "A", 5))
    assert not [one.says for one in found.quality if "one stretch" in one.says]


def test_a_run_without_a_stretch_of_its_own_is_two():
    times = np.arange(10.0)
    runs = [
        Trajectory(name, times, np.stack([times, times], axis=1), times[:-1, None])
        for name in ("a", "b")
    ]
    cut = Stretch("b", 3.0, 5.0, 0.9, 0.1).cut_from(runs)
    assert [(run.name, run.times.tolist()) for run in cut] == [
        ("a", times.tolist()),
        ("b", [0.0, 1.0, 2.0]),
        ("b", [6.0, 7.0, 8.0, 9.0]),
    ]
    assert [run.actions[:, 0].tolist() for run in cut[1:]] == [[0.0, 1.0], [6.0, 7.0, 8.0]]
    (begun,) = Stretch("b", 0.0, 5.0, 0.9, 0.1).cut_from(runs[1:])
    assert begun.times.tolist() == [6.0, 7.0, 8.0, 9.0]


def test_a_stretch_that_holds_most_of_the_motion_is_no_matter_of_a_hand():
    says = Stretch("a", 0.0, 1.0, share=0.6, motion=0.5).says(left_out=False)
    assert "50% of the motion lies there, too" in says
    assert "knocked" not in says
    assert "knocked" in Stretch("a", 0.0, 1.0, share=0.6, motion=0.1).says(left_out=False)


class Servo(FirstOrderSystem):
    """It follows its command as a first-order lag; its speed has no limit."""

    dt = 0.05
    state_channels = (Channel("angle", "rad", "other", scale=1.0),)
    action_channels = (Channel("command", "rad", "input", scale=1.0, low=-3.0, high=3.0),)
    parameters: ClassVar = {"time_constant": Parameter(0.1, "s", "of the servo", low=0.005)}

    def derivative(self, x, u, p):
        return ((u[:, 0] - x[:, 0]) / p.time_constant)[:, None]


def test_where_alone_it_moves_is_told_as_such():
    """A limit of speed, which no effect is, shows in the one large step."""
    rng = np.random.default_rng(0)
    command = np.repeat([0.0, 0.05, 2.5, 2.45, 2.5, 2.45], 40)
    seen = [0.0]
    for goal in command[:-1]:
        seen.append(seen[-1] + float(np.clip(goal - seen[-1], -0.08, 0.08)) * 0.4)
    states = np.array(seen)[:, None] + 3e-3 * rng.standard_normal((len(seen), 1))
    run = Trajectory("run", 0.05 * np.arange(len(seen)), states, command[:-1, None])
    found = find_gap(Servo(), [run], effects=["sensor_offset"])
    (said,) = [one.says for one in found.quality if "one stretch" in one.says]
    assert "of the motion lies there, too" in said
    assert found.lone is not None and found.lone.run == "run" and found.lone.share > 0.5


class Tank(FirstOrderSystem):
    """A tank with an outlet that is always open."""

    dt = 2.0
    state_channels = (Channel("level", "m", "other", scale=0.5),)
    action_channels = (Channel("inflow", "l/s", "input", scale=1.0, low=0.0, high=2.0),)
    parameters: ClassVar = {"area": Parameter(100.0, "dm^2", "of the surface", low=1.0)}

    def derivative(self, x, u, p):
        return ((u[:, 0] - 2.0 * x[:, 0]) / p.area / 0.1)[:, None]


def tanks(leak):
    """Three records; in each somebody opens a tap for a minute, another minute every time."""
    rng, simulator = np.random.default_rng(0), Tank()
    for number in range(3):
        inflow = np.repeat(rng.uniform(0.0, 2.0, 20), 15)
        level, opened = [np.array([0.3])], slice(70 + 60 * number, 100 + 60 * number)
        for row, u in enumerate(inflow):
            gone = leak if opened.start <= row < opened.stop else 0.0
            after = simulator.step(level[-1][None], np.array([[u]]))[0]
            level.append(after - gone * 2.0 / 100.0)
        states = np.array(level) + 1e-3 * rng.standard_normal((301, 1))
        yield Trajectory(f"run {number}", 2.0 * np.arange(301), states, inflow[:, None])


def stretches(leak):
    asked = ("area", "actuator_gain", "constant_load", "proportional_loss", "actuator_lag")
    found = find_gap(Tank(), list(tanks(leak)), effects=asked)
    return [one.says for one in found.quality if "stretches" in one.says]


@pytest.mark.long
def test_what_happens_now_and_then_is_told_with_its_times():
    said = stretches(0.5)
    assert len(said) == 1 and "Did something happen there" in said[0]
    for number in range(3):
        begin, end = 2.0 * (70 + 60 * number), 2.0 * (100 + 60 * number)
        places = re.findall(rf"run {number} from ([\d.]+) s to ([\d.]+) s", said[0])
        assert any(float(a) < end and float(b) > begin for a, b in places), said[0]
    assert not stretches(0.0)


@pytest.mark.parametrize(
    ("begins", "told"),
    [
        ((28_800.0, 115_200.0, 202_200.0), True),
        ((202_200.0, 28_800.0, 374_400.0), True),  # in any order, with days left out
        ((28_800.0, 115_200.0), False),  # two are no habit
        ((28_800.0, 100_000.0, 202_200.0), False),
        ((28_800.0, 30_000.0, 115_200.0), False),  # two on one day
    ],
)
def test_stretches_at_one_hour_of_the_day_are_told(begins, told):
    assert daily([Stretch("room", begin, begin + 28_000.0, 0.3, 0.1) for begin in begins]) == told
