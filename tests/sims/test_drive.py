"""The way of a command to the actuator, against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sims.effects import (
    ActuatorBias,
    ActuatorGain,
    ActuatorLag,
    DeadZone,
    Delay,
    QuadraticActuator,
    Saturation,
)
from sims.pendulum_equation import PendulumEquation

PENDULUM = PendulumEquation()


def drive(effects, actions, durations=None, **options):
    actions = np.asarray(actions, float)[:, None]
    durations = np.full(len(actions), 0.05) if durations is None else durations
    return PENDULUM.with_effects(effects).drive(actions, durations, **options)[..., :, 0]


def test_without_effects_every_sub_step_has_the_command():
    found = drive([], [1.0, -2.0, 5.0], substeps=4)
    assert np.array_equal(found, np.repeat([[1.0], [-2.0], [3.0]], 4, axis=1))


@given(st.floats(0.0, 0.12))
def test_a_delayed_step_keeps_its_exact_mean_in_every_sub_step(delay):
    found = drive([Delay("voltage", delay)], [0.0, 0.0, 3.0, 3.0, 3.0, 3.0], substeps=5).ravel()
    edges = 0.01 * np.arange(31)
    passed = np.clip((edges[1:] - (0.1 + delay)) / 0.01, 0, 1)
    assert found == pytest.approx(3.0 * passed, abs=1e-9)


def test_delay_on_uneven_samples_and_smooth_in_the_delay():
    durations = np.array([0.03, 0.08, 0.01, 0.05])
    delays = np.linspace(0.0, 0.06, 301)
    found = drive([Delay("voltage", delays)], [1.0, -1.0, 2.0, 0.0], durations, substeps=2)
    assert found.shape == (301, 4, 2)
    # One sub-step of length h cannot change faster than the jump 3 V over h per second.
    slopes = np.abs(np.diff(found, axis=0)) / np.diff(delays)[:, None, None]
    assert (slopes <= 3.0 / (durations[:, None] / 2) * (1 + 1e-6)).all()
    one = drive([Delay("voltage", float(delays[77]))], [1.0, -1.0, 2.0, 0.0], durations, substeps=2)
    assert np.array_equal(found[77], one)


def test_lag_follows_the_closed_form():
    time_constant, substeps = 0.04, 5
    found = drive([ActuatorLag("voltage", time_constant)], [0.0, 2.0, 2.0], substeps=substeps)
    t = 0.01 * np.arange(11)
    whole = 2.0 * (t + time_constant * np.exp(-t / time_constant))
    assert found[0] == pytest.approx(0.0)
    assert found[1:].ravel() == pytest.approx(np.diff(whole) / 0.01, rel=1e-9)


def test_linear_hold_averages_the_ramp():
    found = drive([], [0.0, 1.0, 3.0], substeps=2, hold="linear")
    assert found == pytest.approx(np.array([[0.25, 0.75], [1.5, 2.5], [3.0, 3.0]]))
    later = drive([Delay("voltage", 0.05)], [0.0, 1.0, 3.0], substeps=2, hold="linear")
    assert later[1:] == pytest.approx(found[:-1])
    assert later[0] == pytest.approx(0.0)


def test_static_effects_act_in_the_order_of_the_chain():
    chain = [
        Saturation("voltage", 2.0),
        QuadraticActuator("voltage", 0.5, 2.6),
        DeadZone("voltage", 0.5),
        ActuatorBias("voltage", 0.2),
        ActuatorGain("voltage", 0.5),
    ]
    found = drive(chain, [1.0, -0.3, 2.9], substeps=1).ravel()
    left = 1.0 + 0.2 - 0.5
    assert found == pytest.approx([1.5 * (0.5 * left + 0.5 * left**2 / 2.6), 0.0, 2.0])


def test_input_before_the_log_can_be_given():
    effects = [Delay("voltage", 0.05), ActuatorLag("voltage", 0.01)]
    whole = drive(effects, [1.0, -1.0, 2.0, 0.5], substeps=3)
    cut = drive(effects, [2.0, 0.5], substeps=3, before=[[1.0], [-1.0]])
    assert cut == pytest.approx(whole[2:])


def test_values_by_row_equal_scalars():
    gains, lags = np.array([0.0, 0.1, -0.2]), np.array([0.0, 0.01, 0.05])
    actions = [1.0, -2.0, 0.5, 3.0]
    found = drive([ActuatorGain("voltage", gains), ActuatorLag("voltage", lags)], actions)
    assert found.shape == (3, 4, PENDULUM.substeps)
    for i in range(3):
        one = drive([ActuatorGain("voltage", gains[i]), ActuatorLag("voltage", lags[i])], actions)
        assert np.array_equal(one, found[i])


def test_steps_with_memory_equal_the_log_driven_as_a_whole():
    simulator = PENDULUM.with_effects(
        [Delay("voltage", 0.12), ActuatorLag("voltage", 0.03), DeadZone("voltage", 0.3)]
    )
    assert [c.name for c in simulator.state_channels] == [
        *("angle", "rate", "voltage 3 ago", "voltage 2 ago", "voltage 1 ago", "voltage lagged"),
    ]
    actions = np.random.default_rng(2).uniform(-3, 3, (12, 1))
    start = simulator.augment([[2.0, -1.0]], actions[:1])[0]
    stepped = simulator.rollout(start, actions)
    inputs = simulator.drive(actions, np.full(12, 0.05), rises=True)
    state = np.array([[2.0, -1.0]])
    for k in range(12):
        state = simulator.integrate(state, inputs[k : k + 1], np.array([0.05]))
        assert stepped[k + 1, :2] == pytest.approx(state[0], abs=1e-9)


@pytest.mark.parametrize(
    "effects",
    [
        [Delay("voltage", 0.0237)],
        [ActuatorLag("voltage", 0.004)],
        [ActuatorLag("voltage", 3.0)],
    ],
)
@pytest.mark.parametrize("hold", ["zero", "linear"])
def test_mean_and_rise_keep_the_moments_of_the_signal(effects, hold):
    actions, durations = np.array([[1.0], [-2.0], [3.0], [0.5]]), np.array([0.05, 0.03, 0.08, 0.04])
    substeps, fine = 3, 400
    found = PENDULUM.with_effects(effects).drive(actions, durations, substeps, hold, rises=True)[
        :, :, 0
    ]
    # The same path in sub-steps so fine that within one the signal hardly changes.
    signal = PENDULUM.with_effects(effects).drive(actions, durations, substeps * fine, hold)
    signal = signal[..., 0].reshape(4, substeps, fine)
    place = (np.arange(fine) + 0.5) / fine - 0.5
    assert found[..., 0] == pytest.approx(signal.mean(axis=2), abs=1e-9)
    assert found[..., 1] == pytest.approx(12 * (signal * place).mean(axis=2), abs=1e-3)


def test_rises_by_row_equal_scalars():
    lags = np.array([0.0, 0.01, 0.05])
    actions = np.array([[1.0], [-2.0], [0.5]])
    durations = np.full(3, 0.05)
    found = PENDULUM.with_effects([ActuatorLag("voltage", lags)]).drive(
        actions, durations, rises=True
    )
    assert found.shape == (3, 3, PENDULUM.substeps, 1, 2)
    for i in range(3):
        one = PENDULUM.with_effects([ActuatorLag("voltage", lags[i])])
        assert np.array_equal(one.drive(actions, durations, rises=True), found[i])


def test_a_jump_between_sub_steps_that_a_lag_then_follows():
    effects = [Delay("voltage", 0.0237), ActuatorLag("voltage", 0.02)]
    found = drive(effects, [0.0, 3.0, 3.0], substeps=10)
    t = np.maximum(0.005 * np.arange(31) - 0.0737, 0.0)
    whole = 3.0 * (t + 0.02 * np.exp(-t / 0.02))
    assert found.ravel() == pytest.approx(np.diff(whole) / 0.005, abs=0.02)


def test_durations_that_do_not_fit_are_explained():
    with pytest.raises(ValueError, match="a row for each of the durations"):
        PENDULUM.drive([[1.0], [2.0]], [0.05])
    with pytest.raises(ValueError, match="positive"):
        PENDULUM.drive([[1.0], [2.0]], [0.05, -0.05])


@pytest.mark.parametrize("hold", ["zero", "linear"])
@pytest.mark.parametrize(
    "effects",
    [[], [Delay("voltage", 0.13)], [Delay("voltage", 0.02), ActuatorLag("voltage", 0.2)]],
    ids=["prompt", "late", "late and lagging"],
)
def test_of_several_records_none_remembers_another(hold, effects):
    rng = np.random.default_rng(3)
    actions, durations = rng.standard_normal((30, 1)), rng.uniform(0.03, 0.06, 30)
    simulator = PENDULUM.with_effects(effects)
    together = simulator.drive(actions, durations, 4, hold, rises=True, begins=[7, 8, 21])
    pieces = [slice(0, 7), slice(7, 8), slice(8, 21), slice(21, 30)]
    alone = [simulator.drive(actions[p], durations[p], 4, hold, rises=True) for p in pieces]
    assert np.array_equal(together, np.concatenate(alone))
