"""Inputs that run straight between samples: in rollouts, by channel, and in YAML."""

import numpy as np
import pytest
import yaml
from pendulum_reference import smooth_step

from sims.effects import ActuatorGain, ActuatorLag, CoulombFriction, Delay
from sims.loading import corrected_settings, load_simulator, simulator_settings
from sims.pendulum import Pendulum
from sims.pendulum_equation import PendulumEquation

HOSTS = {"pymunk": Pendulum(), "equation": PendulumEquation()}
host = pytest.mark.parametrize("host", HOSTS)
START = np.array([2.0, -1.0])


def voltages(n=12, seed=0):
    return np.random.default_rng(seed).uniform(-2.5, 2.5, (n, 1))


@host
def test_a_rollout_with_a_straight_input_follows_its_equation(host):
    simulator = HOSTS[host].with_hold({"voltage": "linear"})
    actions = voltages()
    found = simulator.rollout(START, actions)
    state = START
    for k, (first, last) in enumerate(
        zip(actions[:, 0], [*actions[1:, 0], actions[-1, 0]], strict=True)
    ):
        state = smooth_step(state, lambda t, a=first, b=last: a + (b - a) * t / 0.05)
        assert found[k + 1] == pytest.approx(state, abs=3e-5)
    held = HOSTS[host].rollout(START, actions)
    assert np.abs(found - held).max() > 0.1


@host
@pytest.mark.parametrize("hold", ["zero", "linear"])
def test_rollout_is_what_windows_of_a_record_see(host, hold):
    effects = [
        Delay("voltage", 0.07),
        ActuatorLag("voltage", 0.02),
        ActuatorGain("voltage", -0.1),
        CoulombFriction("pivot", 1e-3),
    ]
    simulator = HOSTS[host].with_effects(effects).with_hold({"voltage": hold})
    actions, durations = voltages(), np.full(12, simulator.dt)
    inputs = simulator.drive(actions, durations, rises=True)
    assert np.array_equal(inputs, simulator.drive(actions, durations, hold=[hold], rises=True))
    state = START[None]
    start = simulator.augment(state, actions[:1])[0]
    found = simulator.rollout(start, actions)
    for k in range(12):
        state = simulator.integrate(state, inputs[k : k + 1], durations[:1])
        assert found[k + 1, :2] == pytest.approx(state[0], abs=1e-9)
    several = simulator.rollout(np.stack([start, start]), np.stack([actions, -actions]))
    assert np.array_equal(several[0], found)


def test_a_hold_that_is_not_known_is_refused():
    with pytest.raises(ValueError, match=r"current.*voltage"):
        Pendulum().with_hold({"current": "linear"})
    with pytest.raises(ValueError, match=r"'cubic'.*'zero' or 'linear'"):
        Pendulum().with_hold({"voltage": "cubic"})
    with pytest.raises(ValueError, match="2 entries for 1"):
        Pendulum().drive(voltages(), np.ones(12), hold=["zero", "linear"])


def test_hold_and_integration_come_back_from_yaml(tmp_path):
    path = tmp_path / "corrected.yaml"
    plain = simulator_settings("sims.pendulum.Pendulum")
    delay = Delay("voltage", 0.03)
    for effects in ([], [delay]):
        settings = corrected_settings(plain, effects, {"voltage": "linear"}, substeps=16)
        path.write_text(yaml.safe_dump(settings))
        loaded = load_simulator(path)
        assert loaded.action_channels[0].hold == "linear" and loaded.substeps == 16
        assert loaded.effects == tuple(effects)
    # What is corrected can be corrected again, and what was said before stays.
    again = corrected_settings(
        simulator_settings(path), [CoulombFriction("pivot", 1e-3)], substeps=32
    )
    loaded = load_simulator(again)
    assert loaded.effects == (delay, CoulombFriction("pivot", 1e-3))
    assert loaded.action_channels[0].hold == "linear" and loaded.substeps == 32
    wanted = Pendulum(substeps=32, effects=loaded.effects).with_hold({"voltage": "linear"})
    start = wanted.augment(START[None], voltages()[:1])[0]
    assert np.array_equal(loaded.rollout(start, voltages()), wanted.rollout(start, voltages()))
