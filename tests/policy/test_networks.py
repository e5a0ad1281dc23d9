"""The hand-written gradients against autograd, for any sizes."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from policy.adam import Adam
from policy.networks import Actor, Critic, FlatNetwork

sizes = st.tuples(
    st.integers(1, 80),  # observations: narrow and wide first layers
    st.integers(1, 7),  # actions
    st.tuples(st.integers(1, 90), st.integers(1, 40)),
    st.integers(1, 20),  # batch
    st.integers(0, 2**32 - 1),
)


def spread(network: FlatNetwork, rng: np.random.Generator) -> None:
    """Give every parameter, biases and output layer too, a size that matters."""
    values = rng.normal(size=network.parameters.shape) * 0.3
    network.parameters.copy_(torch.from_numpy(values))


def normal(rng: np.random.Generator, *shape: int) -> torch.Tensor:
    return torch.from_numpy(rng.normal(size=shape)).float()


def autograd_layers(network: FlatNetwork) -> list[tuple[torch.Tensor, torch.Tensor | None]]:
    copies = []
    for layer in network.layers:
        weight = layer.weight.clone().requires_grad_()
        bias = None if layer.bias is None else layer.bias.clone().requires_grad_()
        copies.append((weight, bias))
    return copies


def gradient_of(network: FlatNetwork, layers: list) -> list[tuple[torch.Tensor, torch.Tensor]]:
    """Pairs (written by hand, from autograd) for every weight and bias."""
    pairs = []
    for layer, (weight, bias) in zip(network.layers, layers, strict=True):
        pairs.append((layer._d_weight, weight.grad))
        if bias is not None:
            pairs.append((layer._d_bias, bias.grad))
    return pairs


def actor_autograd(layers: list, observations: torch.Tensor) -> torch.Tensor:
    (w1, b1), (w2, b2), (w3, b3) = layers
    hidden = torch.relu(observations @ w1.T + b1)
    return torch.tanh(torch.relu(hidden @ w2.T + b2) @ w3.T + b3)


def critic_autograd(
    layers: list, observations: torch.Tensor, actions: torch.Tensor
) -> torch.Tensor:
    (w1, b1), (wa, _), (w2, b2), (w3, b3) = layers
    hidden = torch.relu(observations @ w1.T + actions @ wa.T + b1)
    return torch.relu(hidden @ w2.T + b2) @ w3.T + b3


@settings(max_examples=40, deadline=None)
@given(sizes)
def test_actor_matches_autograd(size):
    n_o, n_a, hidden, batch, seed = size
    rng = np.random.default_rng(seed)
    actor = Actor(n_o, n_a, hidden, batch, rng)
    spread(actor, rng)
    observations, d_actions = normal(rng, batch, n_o), normal(rng, batch, n_a)
    layers = autograd_layers(actor)
    expected = actor_autograd(layers, observations)
    expected.backward(d_actions)

    torch.testing.assert_close(actor.forward(observations), expected.detach(), rtol=1e-4, atol=1e-5)
    actor.backward(observations, d_actions)
    for ours, autograd in gradient_of(actor, layers):
        torch.testing.assert_close(ours, autograd, rtol=1e-4, atol=1e-4)


@settings(max_examples=40, deadline=None)
@given(sizes)
def test_critic_matches_autograd(size):
    n_o, n_a, hidden, batch, seed = size
    rng = np.random.default_rng(seed)
    critic = Critic(n_o, n_a, hidden, batch, rng)
    spread(critic, rng)
    observations, actions = normal(rng, batch, n_o), normal(rng, batch, n_a)
    others, d_values = normal(rng, batch, n_a).requires_grad_(), normal(rng, batch, 1)
    layers = autograd_layers(critic)
    expected = critic_autograd(layers, observations, actions)
    expected.backward(d_values)

    values = critic.forward(observations, actions)
    torch.testing.assert_close(values, expected.detach(), rtol=1e-4, atol=1e-4)
    critic.backward(observations, actions, d_values)
    for ours, autograd in gradient_of(critic, layers):
        torch.testing.assert_close(ours, autograd, rtol=1e-4, atol=1e-4)

    # The action's gradient at other actions reuses the pass above.
    gradient = critic.d_action(others.detach(), d_values)
    critic_autograd(layers, observations, others).backward(d_values)
    torch.testing.assert_close(gradient, others.grad, rtol=1e-4, atol=1e-4)


def test_gradient_buffer_is_the_whole_gradient():
    """No parameter lies outside the flat tensor, and none of it is left over."""
    rng = np.random.default_rng(0)
    for network in (Actor(3, 2, (40, 30), 8, rng), Critic(3, 2, (40, 30), 8, rng)):
        parts = [p for layer in network.layers for p in (layer.weight, layer.bias)]
        before = network.parameters.clone()
        for part in parts:
            if part is not None:
                part.add_(1)
        torch.testing.assert_close(network.parameters, before + 1)


@pytest.mark.parametrize("weight_decay", [0.0, 1e-2])
def test_adam_matches_torch(weight_decay):
    generator = torch.Generator().manual_seed(0)
    ours = torch.randn(50, generator=generator)
    theirs = ours.clone().requires_grad_()
    gradient = torch.zeros(50)
    adam = Adam(ours, gradient, 1e-2, weight_decay)
    reference = torch.optim.Adam([theirs], lr=1e-2, weight_decay=weight_decay)
    for _ in range(20):
        gradient.copy_(torch.randn(50, generator=generator))
        theirs.grad = gradient.clone()
        adam.step()
        reference.step()
    torch.testing.assert_close(ours, theirs.detach())
