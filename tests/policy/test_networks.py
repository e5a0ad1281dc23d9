"""The hand-written gradients against autograd, for any sizes."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from policy.adam import Adam
from policy.networks import Actor, Critic, FlatNetwork, Inputs

sizes = st.tuples(
    st.integers(1, 80),  # observations: narrow and wide first layers
    st.integers(1, 7),  # actions
    st.tuples(st.integers(1, 90), st.integers(1, 40)),
    st.integers(1, 20),  # batch
    st.integers(0, 2**32 - 1),
)


def spread(network: FlatNetwork, rng: np.random.Generator) -> None:
    """Give every parameter, biases and output layer too, a size that matters."""
    network.parameters[:] = rng.normal(size=network.parameters.shape) * 0.3


def filled(rng: np.random.Generator, n_o: int, n_a: int, batch: int) -> Inputs:
    inputs = Inputs(n_o, n_a, batch)
    inputs.observations[:] = rng.normal(size=(n_o, batch))
    inputs.actions[:] = rng.normal(size=(n_a, batch))
    return inputs


def normal(rng: np.random.Generator, *shape: int) -> np.ndarray:
    return rng.normal(size=shape).astype(np.float32)


def autograd_weights(network: FlatNetwork) -> list[torch.Tensor]:
    return [torch.tensor(part, requires_grad=True) for part in network.weights]


def autograd(weights: list[torch.Tensor], rows: torch.Tensor) -> torch.Tensor:
    """Inputs that the first layer has no weights for enter at the second."""
    entry, w2, b2, w3, b3 = weights
    hidden = torch.relu(rows[:, : len(entry)] @ entry)
    hidden = torch.cat([hidden, rows[:, len(entry) :]], dim=1)
    return torch.relu(hidden @ w2.T + b2) @ w3.T + b3


def assert_gradient(network: FlatNetwork, weights: list[torch.Tensor]) -> None:
    for ours, theirs in zip(network.d_weights, weights, strict=True):
        np.testing.assert_allclose(ours, theirs.grad, rtol=1e-4, atol=1e-4)


@settings(max_examples=40)
@given(sizes, st.sampled_from([0.0, 0.3]))
def test_actor_matches_autograd(size, penalty):
    n_o, n_a, hidden, batch, seed = size
    rng = np.random.default_rng(seed)
    actor = Actor(n_o, n_a, hidden, batch, rng)
    spread(actor, rng)
    inputs, d_actions = filled(rng, n_o, n_a, batch), normal(rng, n_a, batch)
    weights = autograd_weights(actor)
    output = autograd(weights, torch.tensor(inputs.observed.T))
    expected = torch.tanh(output)
    beyond = penalty * (torch.relu(output.abs() - 2) ** 2).sum() / batch
    ((expected * torch.tensor(d_actions.T)).sum() + beyond).backward()

    observations = inputs.observations.copy()
    actor.forward(inputs)
    np.testing.assert_allclose(inputs.actions.T, expected.detach(), rtol=1e-4, atol=1e-5)
    np.testing.assert_array_equal(inputs.observations, observations)
    actor.backward(inputs, d_actions, penalty)
    assert_gradient(actor, weights)


@pytest.mark.parametrize("action_layer", [1, 2])
@settings(max_examples=40)
@given(size=sizes)
def test_critic_matches_autograd(action_layer, size):
    n_o, n_a, hidden, batch, seed = size
    rng = np.random.default_rng(seed)
    critic = Critic(n_o, n_a, hidden, batch, rng, action_layer)
    spread(critic, rng)
    inputs, d_values = filled(rng, n_o, n_a, batch), normal(rng, 1, batch)
    weights = autograd_weights(critic)
    rows = torch.tensor(inputs.all.T, requires_grad=True)
    expected = autograd(weights, rows)
    expected.backward(torch.tensor(d_values.T))
    assert rows.grad is not None

    values = critic.forward(inputs)
    np.testing.assert_allclose(values.T, expected.detach(), rtol=1e-4, atol=1e-4)
    critic.backward(inputs, d_values)
    assert_gradient(critic, weights)
    kept = critic.gradient.copy()
    d_actions = critic.d_actions(d_values)
    np.testing.assert_allclose(d_actions.T, rows.grad[:, n_o + 1 :], rtol=1e-4, atol=1e-4)
    np.testing.assert_array_equal(critic.gradient, kept)  # the actor's step leaves it alone


def test_flat_arrays_hold_everything_once():
    """No parameter lies outside the flat array, and none of it is left over."""
    rng = np.random.default_rng(0)
    sizes = (3, 2, (40, 30), 8, rng)
    for network in (Actor(*sizes), Critic(*sizes), Critic(*sizes, action_layer=2)):
        before = network.parameters.copy()
        for part in network.weights:
            part += 1
        np.testing.assert_array_equal(network.parameters, before + 1)


def test_a_policy_sees_the_actor_learn():
    actor = Actor(3, 2, (40, 30), 8, np.random.default_rng(0))
    layers = actor.layers()
    assert [layers[f"weight{k}"].shape for k in (1, 2, 3)] == [(40, 3), (30, 40), (2, 30)]
    actor.parameters += 1
    assert all((layers[f"bias{k}"] == 1).all() for k in (1, 2, 3))


@pytest.mark.parametrize("weight_decay", [0.0, 1e-2])
def test_adam_matches_torch(weight_decay):
    rng = np.random.default_rng(0)
    ours, gradient, target = normal(rng, 50), normal(rng, 50), np.zeros(50, np.float32)
    theirs = torch.tensor(ours, requires_grad=True)
    following = torch.zeros(50)
    adam = Adam(ours, gradient, target, 1e-2, weight_decay)
    reference = torch.optim.Adam([theirs], lr=1e-2, weight_decay=weight_decay)
    for k in range(20):
        gradient[:] = normal(rng, 50)
        theirs.grad = torch.tensor(gradient)
        reference.step()
        share = 0.1 * (k % 2)
        adam.step(share)
        following.lerp_(theirs.detach(), share)
    np.testing.assert_allclose(ours, theirs.detach(), rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(target, following, rtol=1e-5, atol=1e-6)


def test_what_is_not_finite_stays_visible():
    """A network that has diverged must not look healthy: NaN goes through the rectifiers."""
    critic = Critic(3, 1, (40, 30), 8, np.random.default_rng(0))
    inputs = filled(np.random.default_rng(1), 3, 1, 8)
    inputs.observations[0, 2] = np.nan
    values = critic.forward(inputs)
    assert np.isnan(values[0, 2]) and np.isfinite(np.delete(values, 2)).all()
