"""A parameter that changes along the records about its nominal value is told, and only then."""

from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest
from trolley import Trolley, record

from residual.gap import find_gap
from residual.gap.answer.changing import _believable
from residual.gap.beside import Changing
from residual.trajectories import Trajectory
from sims.effects import ActuatorGain, ParameterChange
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.simulator import Channel, Parameter
from studies.gap.files import gap_record
from studies.gap.summary import summary

#: What may be missing.
ASKED = ("mass", "stiffness", "damping", "coulomb_friction")


class Copter(EquationOfMotion):
    """A small copter that climbs and sinks."""

    dt = 0.05
    state_channels = (
        Channel("height", "m", "position", scale=2.0),
        Channel("climb", "m/s", "rate", rate_of="height", scale=1.0),
    )
    action_channels = (Channel("throttle", "1", "input", scale=0.5, low=0.0, high=1.0),)
    parameters: ClassVar = {"thrust": Parameter(21.4, "N", "at full throttle", low=1.0)}

    def acceleration(self, q, v, u, force, p):
        return ((p.thrust * u[:, 0] + force[:, 0]) / 1.2 - 0.1 * v[:, 0] - 9.81)[:, None]


def sagging(seed, rows=500, dt=0.05):
    """A record whose thrust falls by 15 %, its height held by a controller."""
    rng, state, seen, inputs = np.random.default_rng(seed), np.array([2.0, 0.0]), [], []
    goals = np.repeat(rng.uniform(0.5, 3.5, rows // 25), 25)
    for row, goal in enumerate(goals):
        throttle = np.clip(0.55 + 0.2 * (goal - state[0]) - 0.2 * state[1], 0.0, 1.0)
        seen.append(state + rng.normal(0, (2e-3, 1e-2)))
        inputs.append(throttle)
        thrust = 21.4 * (1 - 0.15 * row / rows)
        for _ in range(20):
            pull = thrust * throttle / 1.2 - 0.1 * state[1] - 9.81
            state = state + dt / 20 * np.array([state[1] + dt / 40 * pull, pull])
    return Trajectory(str(seed), dt * np.arange(rows), np.array(seen), np.array(inputs)[:-1, None])


def ask(*records):
    return find_gap(Trolley(), list(records), effects=ASKED, minutes=1)


@pytest.mark.long
def test_a_spring_that_weakens_about_its_nominal_is_told_with_both_ends():
    result = ask(*(record(seed, lambda part: 23.0 - 6.0 * part) for seed in (0, 1)))
    found = result.changing
    assert found is not None and found.label == "stiffness"
    assert (found.begin, found.end) == (pytest.approx(23, abs=0.7), pytest.approx(17, abs=0.7))
    assert found.nominal == 20.0 and found.taken > 0.5
    told = " ".join(summary(result).split())
    assert "The rest looks like stiffness that changes along the records, from about 2" in told
    assert "it looks as if stiffness went from about 2" in told and "(20 N/m in the sim" in told
    assert gap_record(result, {})["changing"]["label"] == "stiffness"


@pytest.mark.parametrize("friction", [0.0, pytest.param(0.8, marks=pytest.mark.long)])
def test_what_stays_the_same_changes_nothing(friction):
    """Also where something is missing, and named."""
    assert ask(*(record(seed, lambda _: 20.0, friction) for seed in (2, 3))).changing is None


def test_what_laws_only_imitate_is_told_in_their_place():
    """Thrust that sags, where a bent curve of the throttle takes some of it off."""
    found = find_gap(
        Copter(), [sagging(seed) for seed in (0, 1)], effects=("saturation", "linear_spring"),
        minutes=1,
    )  # fmt: skip
    changes = found.changing
    full = {"thrust": 0.0, "actuator_gain@throttle": 1.0}[changes.label]
    assert changes.instead
    assert (full + changes.end) / (full + changes.begin) == pytest.approx(0.85, abs=0.03)
    assert not any(verdict.kind == "confirmed" for verdict in found.verdicts)
    assert "in place of all that is named" in " ".join(summary(found).split())


@pytest.mark.long
def test_what_is_different_in_the_middle_of_a_record_is_no_change_along_it():
    """A stiffness that comes and goes twice in a record."""
    records = [record(seed, lambda part: 20 + 4 * np.sin(4 * np.pi * part)) for seed in (4, 5)]
    found = ask(*records).changing
    assert found is None or found.taken < 0.5


@pytest.mark.parametrize(("begin", "end", "told"), [
    (23.0, 17.0, True), (20.0, 0.0, True), (20.0, -4.0, False), (20.0, 300.0, False),
])  # fmt: skip
def test_a_value_that_no_spring_has_is_not_told(begin, end, told):
    search = SimpleNamespace(simulator=Trolley())
    course = SimpleNamespace(one=SimpleNamespace(effect=ParameterChange("stiffness")))
    ends = Changing("stiffness", begin, end, 20.0, "N/m", 0.8)
    assert _believable(search, course, ends) == told


def test_a_gain_may_turn_round_but_not_be_a_hundred_times_larger():
    course = SimpleNamespace(one=SimpleNamespace(effect=ActuatorGain("push")))
    assert _believable(None, course, Changing("actuator_gain@push", -0.5, 0.5, 0.0, "1", 0.8))
    assert not _believable(None, course, Changing("actuator_gain@push", 0.0, 99.0, 0.0, "1", 0.8))
    # Both ends at one bound change nothing.
    assert not _believable(None, course, Changing("actuator_gain@push", 0.5, 0.5, 0.0, "1", 0.8))


class HotPlate(FirstOrderSystem):
    """A plate on a heating wire whose resistance is taken for constant."""

    dt = 5.0
    state_channels = (Channel("plate", "degC", "other", scale=50.0),)
    action_channels = (Channel("volts", "V", "input", low=0.0, high=32.0),)
    parameters: ClassVar = {
        "resistance": Parameter(8.0, "ohm", "of the wire", low=0.5),
        "capacity": Parameter(224.0, "J/K", "of the plate", low=1.0),
    }

    def derivative(self, x, u, p):
        heat = u[:, 0] ** 2 / p.resistance
        return ((heat - 0.9 * (x[:, 0] - 20.0)) / p.capacity)[:, None]


def test_a_wire_that_conducts_worse_as_it_warms_is_told_in_place_of_four_that_imitate_it():
    rng, warm = np.random.default_rng(744), [20.0]
    volts = np.repeat(np.r_[0, rng.choice([0, 12, 18, 24, 28, 32], 29)], 40).astype(float)
    for volt in volts[:-1]:
        resistance = 8.0 * (1 + 0.004 * (warm[-1] - 20.0))
        over = volt**2 / resistance / 0.9 + 20.0
        warm.append(over + (warm[-1] - over) * np.exp(-0.9 * 5.0 / 224.0))
    seen = np.array(warm)[:, None] + rng.normal(0, 0.15, (len(volts), 1))
    log = Trajectory("0", 5.0 * np.arange(len(volts)), seen, volts[:-1, None])
    effects = ("asymmetric_response", "actuator_gain", "actuator_bias", "capacity")
    found = find_gap(HotPlate(), [log], effects=effects, minutes=0.5)
    changes = found.changing
    assert changes is not None and changes.instead and changes.over == "plate"
    assert not any(verdict.kind == "confirmed" for verdict in found.verdicts)


class Sled(EquationOfMotion):
    """A load on a spring that loses a third of its mass on the way."""

    dt = 0.02
    state_channels = (
        Channel("place", "m", "position", scale=0.2),
        Channel("speed", "m/s", "rate", rate_of="place", scale=0.5),
    )
    action_channels = (Channel("push", "N", "input", scale=10.0),)
    parameters: ClassVar = {"mass": Parameter(14.0, "kg", "load", low=0.1)}

    def acceleration(self, q, v, u, force, p):
        pull = u[:, 0] + force[:, 0] - 4.0 * v[:, 0] - 60.0 * q[:, 0]
        return (pull / p.mass)[:, None]


def losing(seed, rows=1500, dt=0.02):
    rng, state, seen = np.random.default_rng(seed), np.zeros(2), []
    pushes = np.repeat(rng.uniform(-15, 15, rows // 50), 50)
    for row, push in enumerate(pushes):
        seen.append(state + rng.normal(0, (1e-3, 3e-3)))
        mass = 14.0 - 4.5 * row / rows
        for _ in range(20):
            speed = state[1] + dt / 40 * (push - 4 * state[1] - 60 * state[0]) / mass
            pull = (push - 4 * speed - 60 * (state[0] + dt / 40 * state[1])) / mass
            state = state + dt / 20 * np.array([speed, pull])
    return Trajectory(str(seed), dt * np.arange(rows), np.array(seen), pushes[:-1, None])


@pytest.mark.long
def test_both_ends_of_a_mass_that_falls_by_a_third_are_near():
    found = find_gap(Sled(), [losing(seed) for seed in range(3)]).changing
    assert found is not None and found.label == "mass"
    assert (found.begin, found.end) == (pytest.approx(14, abs=0.7), pytest.approx(9.5, abs=0.7))
