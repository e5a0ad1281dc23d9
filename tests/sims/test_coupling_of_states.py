"""What one state does to another: against equations in which that is written out."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sims.chosen import chosen_effects
from sims.effects import Coupling, library
from sims.effects.library import further_in
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.pendulum import Pendulum
from sims.simulator import Channel

R, L, K, J, B = 1.2, 4e-3, 0.05, 2.5e-4, 2e-4


class Motor(FirstOrderSystem):
    """A motor without back EMF, on a cart that carries a compass."""

    dt = 1e-3
    state_channels = (
        Channel("current", "A", "other", scale=5.0),
        Channel("speed", "rad/s", "rate", scale=100.0),
        Channel("place", "m", "other", invariant=True),
        Channel("heading", "rad", "other", angle=True),
    )
    action_channels = (Channel("voltage", "V", "input", scale=12.0),)

    def derivative(self, x, u, p):
        current = (u[:, 0] - R * x[:, 0]) / L
        return np.stack([current, (K * x[:, 0] - B * x[:, 1]) / J, x[:, 1], 0 * x[:, 1]], axis=1)


class Gimbal(EquationOfMotion):
    """Two axes, each with an inertia and a spring."""

    dt = 0.01
    state_channels = tuple(
        channel
        for name in ("outer", "inner")
        for channel in (
            Channel(name, "m", "position"),
            Channel(f"{name} rate", "m/s", "rate", rate_of=name),
        )
    )
    action_channels = (Channel("push", "N", "input"),)

    def acceleration(self, q, v, u, force, p):
        return (force - 3.0 * q + np.stack([u[:, 0], 0 * u[:, 0]], axis=1)) / np.array([2.0, 0.5])


def test_a_motor_gets_its_back_emf():
    volts = np.repeat([[6.0], [-9.0], [3.0]], 40, axis=0)
    found = Motor(effects=[Coupling("current by speed", -K / L)]).rollout(np.zeros(4), volts)
    x = np.zeros(2)
    for k, u in enumerate(volts[:, 0]):
        x = solve_ivp(
            lambda _, x, u=u: [(u - R * x[0] - K * x[1]) / L, (K * x[0] - B * x[1]) / J],
            (0, 1e-3), x, rtol=1e-10, atol=1e-10,
        ).y[:, -1]  # fmt: skip
        assert found[k + 1, :2] == pytest.approx(x, rel=2e-3, abs=2e-3)


def test_a_gyroscope_turns_its_axes_into_each_other_and_keeps_their_energy():
    spin = [Coupling("outer by inner", -0.4), Coupling("inner by outer", 0.4)]
    path = Gimbal(effects=spin, substeps=4).rollout([0.3, 0.0, 0.0, 0.0], np.zeros((300, 1)))
    outer, outer_rate, inner, inner_rate = path.T
    energy = 1.5 * (outer**2 + inner**2) + outer_rate**2 + 0.25 * inner_rate**2
    assert np.abs(inner).max() > 0.05
    assert energy == pytest.approx(energy[0], rel=1e-4)


def test_rows_have_strengths_of_their_own_and_none_changes_no_bit():
    plain, rng = Motor(), np.random.default_rng(0)
    states, actions = rng.normal(0, 5, (3, 4)), np.ones((3, 1))
    strength = np.array([0.0, -12.0, 3.0])
    together = plain.with_effects([Coupling("current by speed", strength)]).step(states, actions)
    for i in range(3):
        alone = plain.with_effects([Coupling("current by speed", float(strength[i]))])
        assert np.array_equal(alone.step(states[[i]], actions[[i]])[0], together[i])
    assert np.array_equal(together[0], plain.step(states, actions)[0])


def test_what_may_act_on_what():
    def offered(simulator):
        return [e.where for e in further_in(simulator) if e.name == "coupling"]

    assert "coupling" not in {effect.name for effect in library(Motor())}
    # Nothing acts by where it is on a line, or by its heading.
    assert offered(Motor()) == [
        "current by speed", "speed by current", "place by current", "place by speed",
        "heading by current", "heading by speed",
    ]  # fmt: skip
    assert offered(Gimbal()) == ["outer by inner", "inner by outer"]
    assert offered(Pendulum()) == []
    (asked,) = chosen_effects(Motor(), ["coupling@current by speed"])
    assert asked == Coupling("current by speed")
    assert asked.quantities(Motor())["strength"].unit == "A/rad"
    for names in ("current by place", "current and speed", "speed by speed"):
        with pytest.raises(ValueError, match="it has: current by speed"):
            Motor(effects=[Coupling(names)])


def test_a_place_that_is_none_is_named_with_those_there_are():
    for asked, says in (
        ("delay@amps", "there is no 'amps', and delay acts at voltage"),
        ("coupling@speed", "there is no 'speed', and coupling acts at current by speed or "),
    ):
        with pytest.raises(ValueError, match=says):
            chosen_effects(Motor(), [asked])
