"""The simulator checker finds each way of breaking the contract, and nothing else."""

from typing import ClassVar

import numpy as np
import pytest

from sims.checks import check_simulator
from sims.contract import refuse_unsound
from sims.equations import EquationOfMotion
from sims.pendulum import Pendulum
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel, Parameter, Simulator
from sims.unsound import Unsound


class Good(Simulator):
    name = "good"
    dt = 0.1
    state_channels = (Channel("angle", "rad", "position", angle=True),)
    action_channels = (Channel("rate", "rad/s", "input", low=-1.0, high=1.0),)

    def __init__(self, gain=1.0):
        self.parameters = {"gain": Parameter(gain, "1", "gain of the drive")}

    def with_parameters(self, **values):
        return type(self)(**values)

    def step(self, states, actions):
        states, actions = self.check_rows(states, actions)
        return states + self.parameters["gain"].value * self.dt * actions


class Noisy(Good):
    def step(self, states, actions):
        noise = np.random.default_rng().normal(size=(len(states), 1))
        return super().step(states, actions) + 1e-12 * noise


class Remembering(Good):
    last = 0.0

    def step(self, states, actions):
        following = super().step(states, actions) + 1e-6 * self.last
        self.last = float(np.ravel(actions)[-1])
        return following


class Mixing(Good):
    def step(self, states, actions):
        return super().step(states, actions) + 1e-9 * np.mean(states)


class Wrapping(Good):
    def step(self, states, actions):
        return np.mod(super().step(states, actions), 2 * np.pi)


class Unclipped(Good):
    def step(self, states, actions):
        return np.asarray(states) + self.dt * np.asarray(actions)


class Overwriting(Good):
    def step(self, states, actions):
        states += self.dt * np.clip(actions, -1, 1)
        return states.copy()


class Diverging(Good):
    def step(self, states, actions):
        following = super().step(states, actions)
        following[states[:, 0] > 0] = np.nan
        return following


class Deaf(Good):
    def step(self, states, actions):
        states, actions = self.check_rows(states, actions)
        return states + self.dt * actions


@pytest.mark.parametrize("simulator", [Good(), Pendulum.true(), PendulumEquation()])
def test_what_keeps_the_contract_passes(simulator):
    findings = check_simulator(simulator)
    assert all(finding.ok for finding in findings), "\n".join(map(str, findings))


@pytest.mark.parametrize(
    ("broken", "check"),
    [
        (Noisy, "repeatable"),
        (Remembering, "pure"),
        (Mixing, "batch"),
        (Wrapping, "angle angle"),
        (Unclipped, "bounds"),
        (Overwriting, "arguments"),
        (Diverging, "finite"),
        (Deaf, "parameter gain"),
    ],
)
def test_what_breaks_it_is_named(broken, check):
    failed = {
        finding.check: str(finding) for finding in check_simulator(broken()) if not finding.ok
    }
    assert check in failed
    if check in ("repeatable", "pure", "batch", "finite"):
        assert "for example state [" in failed[check]


class Falling(EquationOfMotion):
    name = "falling body"
    state_channels = (
        Channel("height", "m", "position"),
        Channel("speed", "m/s", "rate", rate_of="height"),
    )
    action_channels = ()
    parameters = {"gravity": Parameter(9.81, "m/s^2", "acceleration of gravity")}

    def acceleration(self, q, v, u, force, p):
        return (force[:, 0] - p.gravity)[:, None]


def test_a_system_without_inputs_can_be_checked():
    findings = check_simulator(Falling())
    assert all(finding.ok for finding in findings), "\n".join(map(str, findings))
    assert "effect quadratic_drag@height" in {finding.check for finding in findings}


class Swinging(EquationOfMotion):
    name = "free pendulum"
    state_channels = (
        Channel("angle", "rad", "position", angle=True),
        Channel("rate", "rad/s", "rate", rate_of="angle"),
    )
    action_channels = ()
    parameters = {"mass": Parameter(0.25, "kg", "of the bob")}

    def acceleration(self, q, v, u, force, p):
        return (force[:, 0] / p.mass - 9.75 * np.sin(q[:, 0]))[:, None]


def test_a_mass_that_cancels_counts_beside_a_load():
    findings = {finding.check: finding for finding in check_simulator(Swinging())}
    assert findings["effect mass"].ok
    assert "beside a load" in findings["effect mass"].says


@pytest.mark.parametrize(("low", "high"), [(1000.0, 2000.0), (-20.0, -4.0), (5.0, np.inf)])
def test_an_input_need_not_reach_zero(low, high):
    class Throttled(Good):
        action_channels = (Channel("pulse", "us", "input", scale=3.0, low=low, high=high),)

    findings = check_simulator(Throttled())
    assert all(finding.ok for finding in findings), "\n".join(map(str, findings))


def test_rows_can_be_given():
    findings = check_simulator(Good(), states=[[7.0]], actions=[[0.5]])
    assert all(finding.ok for finding in findings)
    findings = check_simulator(Good(), states=np.array([[7.0], [-1.0]]))
    assert all(finding.ok for finding in findings)
    with pytest.raises(ValueError, match="angle"):
        check_simulator(Good(), states=[[7.0, 1.0]], actions=[[0.5]])


def test_an_effect_that_does_not_reach_the_output_is_named():
    class Unfelt(PendulumEquation):
        def acceleration(self, q, v, u, force, p):
            return super().acceleration(q, v, u, np.zeros_like(force), p)

    failed = [finding.check for finding in check_simulator(Unfelt()) if not finding.ok]
    assert (
        "effect viscous_friction@pivot" in failed and "effect actuator_gain@voltage" not in failed
    )


class Stage(EquationOfMotion):
    """A slide on a slide; ``forgotten`` is the joint whose force is left out."""

    dt = 0.01
    state_channels = (
        Channel("low", "m", "position"), Channel("low rate", "m/s", "rate", rate_of="low"),
        Channel("high", "m", "position"), Channel("high rate", "m/s", "rate", rate_of="high"),
    )  # fmt: skip
    action_channels = ()
    parameters: ClassVar = {"mass": Parameter(3e7, "kg", "of each", low=1.0)}
    forgotten = None

    def acceleration(self, q, v, u, force, p):
        sums = [-1e7 * q[:, j] + (0 if j == self.forgotten else force[:, j]) for j in range(2)]
        return np.stack([each / p.mass for each in sums], axis=1)


def test_a_force_left_out_of_the_equation_is_named_with_its_joint():
    refuse_unsound(Stage())
    assert all(finding.ok for finding in check_simulator(Stage()) if finding.check == "forces")
    simulator = Stage()
    simulator.forgotten = 1
    says = r"simulator Stage: forces: .*joint 'high', .*: add force\[:, 1\] to the sum of forces"
    with pytest.raises(Unsound, match=says):
        refuse_unsound(simulator)
    failed = [finding.check for finding in check_simulator(simulator) if not finding.ok]
    assert failed[0] == "forces" and "linear in forces" not in failed


class Bounded(Good):
    state_channels = (Channel("x", "m", "other", low=-5.0, high=5.0),)


class BreakingFarOut(Bounded):
    def step(self, states, actions):
        following = super().step(states, actions)
        following[np.abs(np.asarray(states)[:, 0]) > 3] = np.nan
        return following


class Timeless(Good):
    dt = 0.0


class Empty(Good):
    state_channels = ()


class Bent(PendulumEquation):
    def acceleration(self, q, v, u, force, p):
        return super().acceleration(q, v, u, force * np.abs(force), p)


class Undefined(PendulumEquation):
    """No force changes what is not a number, which is not what is wrong with it."""

    def acceleration(self, q, v, u, force, p):
        return np.nan * super().acceleration(q, v, u, force, p)


@pytest.mark.parametrize(
    ("broken", "check"),
    [
        (Undefined, "finite"),
        (BreakingFarOut, "finite to the bounds"),
        (Timeless, "period"),
        (Empty, "channels"),
        (Bent, "linear in forces"),
    ],
)
def test_broken_promises_beyond_the_contract_are_named(broken, check):
    findings = check_simulator(broken())
    assert [finding.check for finding in findings if not finding.ok][:1] == [check]


class SmallRotor(EquationOfMotion):
    """So light that a damping of 1 N m s/rad is beyond any integration step."""

    dt = 0.05
    state_channels = (
        Channel("rotor", "rad", "position", angle=True),
        Channel("rotor rate", "rad/s", "rate", rate_of="rotor", scale=10.0),
    )
    action_channels = (Channel("torque", "N m", "input", scale=1e-11, low=-1e-11, high=1e-11),)
    parameters: ClassVar = {
        "inertia": Parameter(2e-14, "kg m^2", "inertia", low=1e-16),
        "damping": Parameter(0.0, "N m s/rad", "bearing", low=0.0),
    }

    def acceleration(self, q, v, u, force, p):
        return (u + force - p.damping * v) / p.inertia


def test_a_parameter_of_zero_is_tried_with_what_the_system_bears():
    findings = check_simulator(SmallRotor())
    assert [f.says for f in findings if not f.ok and "damping" in f.check] == []
    assert any("parameter damping" in f.check and "moves" in f.says for f in findings)


def test_findings_print_as_a_table():
    findings = check_simulator(Bounded())
    lines = str(findings).splitlines()
    assert len(lines) == len(findings) and all(finding.ok for finding in findings)
    starts = {line.index(f.says) for line, f in zip(lines, findings, strict=True)}
    assert len(starts) == 1
