"""The Pymunk pendulum against an independent high-order integrator, and its purity."""

import copy

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pendulum_reference import smooth_step

from sims.effects import CoulombFriction, ParameterChange
from sims.pendulum import Pendulum

SYSTEMS = {
    "idealised": (Pendulum(), 0.055, 1.91e-4),
    "true": (Pendulum.true(), 0.090, 1.91e-4),
    "true, heavier": (Pendulum.true(True), 0.090, 1.91e-4 + 0.035 * 0.042**2),
}


def reference(states, voltages, mass, inertia):
    return np.array(
        [
            smooth_step(state, u, mass=mass, inertia=inertia)
            for state, u in zip(states, voltages, strict=True)
        ]
    )


def random_rows(n, seed=0):
    rng = np.random.default_rng(seed)
    states = np.c_[rng.uniform(-np.pi, np.pi, n), rng.uniform(-15, 15, n)]
    return states, rng.uniform(-3, 3, (n, 1))


@pytest.mark.parametrize("system", SYSTEMS)
def test_one_step_agrees_with_an_independent_integrator(system):
    pendulum, mass, inertia = SYSTEMS[system]
    states, actions = random_rows(200)
    error = pendulum.step(states, actions) - reference(states, actions[:, 0], mass, inertia)
    rms = np.sqrt(np.mean(error**2, axis=0))
    assert rms[0] < 1e-6 and rms[1] < 2e-5


def test_what_is_compiled_follows_the_scheme_of_pymunk():
    states, actions = random_rows(200)
    pendulum = Pendulum.true()
    held = np.repeat(actions[:, None], pendulum.substeps, axis=1)
    inputs = np.stack([held, 0 * held], axis=-1)
    found = pendulum.integrate(states, inputs, np.full(200, pendulum.dt))
    assert np.abs(found - pendulum.step(states, actions)).max() < 1e-12
    for change in (0.0, 0.02):
        pymunk = Pendulum(0.055 + change, substeps=5)
        compiled = Pendulum(substeps=5, effects=[ParameterChange("mass", change or 1e-300)])
        paths = [s.rollout(states, np.repeat(actions[:, None], 4, 1)) for s in (pymunk, compiled)]
        assert np.abs(paths[0] - paths[1]).max() < 1e-11


@pytest.mark.parametrize("effects", [(), (CoulombFriction("pivot", 1e-3),)])
def test_a_row_that_runs_away_is_seen_and_leaves_the_others_alone(effects):
    pendulum = Pendulum(effects=effects)
    states, actions = random_rows(3)
    wild = states.copy()
    wild[1] = [1.0, np.inf]
    after = pendulum.step(wild, actions)
    assert np.isnan(after[1]).all()
    assert np.array_equal(after[::2], pendulum.step(states, actions)[::2])
    wild[1] = np.nan
    assert np.isnan(pendulum.step(wild, actions)[1]).all()


def test_half_the_sub_step_gives_a_sixteenth_of_the_error():
    states, actions = random_rows(50)
    truth = reference(states, actions[:, 0], 0.055, 1.91e-4)
    errors = [np.abs(Pendulum(substeps=n).step(states, actions) - truth).max() for n in (3, 6)]
    assert 10 < errors[0] / errors[1] < 22


@pytest.mark.parametrize("voltage", [lambda t: 0.8 * np.sin(2 * t), lambda t: np.full_like(t, 3.0)])
def test_twenty_seconds_open_loop(voltage):
    u = voltage(0.05 * np.arange(400))
    path = Pendulum().rollout([np.pi, 0.0], u[:, None])
    state = np.array([[np.pi, 0.0]])
    for k in range(400):
        state = reference(state, u[k : k + 1], 0.055, 1.91e-4)
        assert abs(path[k + 1, 0] - state[0, 0]) < 1e-4


@settings(max_examples=30)
@given(
    st.lists(
        st.tuples(st.floats(-50, 50), st.floats(-60, 60), st.floats(-4, 4)),
        min_size=2,
        max_size=6,
    ),
    st.randoms(use_true_random=False),
)
def test_rows_are_bit_identical_alone_in_a_batch_and_in_any_order(rows, random):
    rows = np.array(rows)
    pendulum = Pendulum()
    together = pendulum.step(rows[:, :2], rows[:, 2:])
    order = random.sample(range(len(rows)), len(rows))
    assert np.array_equal(pendulum.step(rows[order, :2], rows[order, 2:]), together[order])
    for row, expected in zip(rows, together, strict=True):
        assert np.array_equal(pendulum.step(row[None, :2], row[None, 2:])[0], expected)


def test_actions_are_clipped_to_three_volts():
    pendulum = Pendulum()
    assert np.array_equal(
        pendulum.step([[1.0, 2.0]], [[7.0]]), pendulum.step([[1.0, 2.0]], [[3.0]])
    )


def test_parameters_may_differ_by_row():
    states, actions = random_rows(3)
    masses = np.array([0.05, 0.07, 0.09])
    together = Pendulum().with_parameters(mass=masses).step(states, actions)
    for i, mass in enumerate(masses):
        alone = Pendulum(mass).step(states[i : i + 1], actions[i : i + 1])
        assert np.array_equal(alone[0], together[i])


def test_an_unknown_parameter_is_named():
    with pytest.raises(ValueError, match=r"no parameter weight, it has .*mass"):
        Pendulum().with_parameters(weight=1.0)


def test_wrong_shapes_name_the_channels():
    with pytest.raises(ValueError, match="angle, rate"):
        Pendulum().step([[0.0, 0.0, 0.0]], [[0.0]])


def test_copies_do_not_share_a_body():
    pendulum = Pendulum.true()
    states, actions = random_rows(3)
    expected = pendulum.step(states, actions)
    twin = copy.deepcopy(pendulum)
    assert twin._body is not pendulum._body
    assert np.array_equal(twin.step(states, actions), expected)


def test_fast_spinning_stays_accurate():
    states, actions = np.array([[0.3, 55.0], [2.0, -40.0]]), np.array([[3.0], [-3.0]])
    error = Pendulum.true().step(states, actions) - reference(states, actions[:, 0], 0.090, 1.91e-4)
    assert np.abs(error).max() < 1e-3


def test_no_rows_are_no_error():
    pendulum = Pendulum()
    held, running = np.zeros((0, 4, 1)), np.zeros((0, 4, 1, 2))
    for inputs in (held, running):
        assert pendulum.integrate(np.zeros((0, 2)), inputs, np.zeros(0)).shape == (0, 2)
