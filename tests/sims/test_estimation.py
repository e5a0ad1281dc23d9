"""Filter and smoother: against the batch solution of a linear system, and on the pendulum."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from sims.estimation import begun, predicted, pushes_of, smooth, updated, usual_push
from sims.pendulum import Pendulum
from sims.simulator import Channel, Simulator


class Cart(Simulator):
    """x'' = -2 x - x' / 2 + u, exactly."""

    name, dt, parameters = "cart", 0.1, {}
    state_channels = (
        Channel("place", "m", "position"), Channel("speed", "m/s", "rate", rate_of="place"),
    )  # fmt: skip
    action_channels = (Channel("push", "N", "input", low=-1, high=1),)

    def __init__(self):
        whole = expm(np.array([[0, 1, 0], [-2, -0.5, 1], [0, 0, 0]]) * self.dt)
        self.by_state, self.by_action = whole[:2, :2], whole[:2, 2:]

    def step(self, states, actions):
        states, actions = self.check_rows(states, actions)
        return states @ self.by_state.T + actions @ self.by_action.T


def recorded(n=30, seed=0):
    cart, random = Cart(), np.random.default_rng(seed)
    actions = random.uniform(-1, 1, (n, 1))
    states = cart.rollout(np.array([1.0, 0.0]), actions)
    return cart, actions, states, states + [0.05, 0.2] * random.standard_normal(states.shape)


@pytest.mark.parametrize("rates", [True, False])
def test_smoothing_is_least_squares_over_all_samples_at_once(rates):
    cart, actions, _, seen = recorded()
    if not rates:
        seen[:, 1] = np.nan
    sigma, push = np.array([0.05, 0.2]), np.array([0.3])
    found = smooth(cart, seen, actions, sigma, push)
    # Unknowns: the first state, and one push for every step; the path is linear in them.
    T, G = len(actions), pushes_of(cart)
    path = np.zeros((T + 1, 2, 2 + T))
    free = cart.rollout(np.zeros(2), actions)
    path[0, :, :2] = np.eye(2)
    for k in range(T):
        path[k + 1] = cart.by_state @ path[k]
        path[k + 1, :, 2 + k] += G[:, 0]
    prior = begun(cart, seen[0], sigma)
    rows = [np.linalg.inv(np.sqrt(prior.covariance)) @ path[0]]
    aims = [np.linalg.inv(np.sqrt(prior.covariance)) @ prior.mean]
    for k in range(1, T + 1):
        there = np.isfinite(seen[k])
        rows.append((path[k] / sigma[:, None])[there])
        aims.append(((seen[k] - free[k]) / sigma)[there])
    rows.append(np.eye(T + 2)[2:] / push)
    aims.append(np.zeros(T))
    A, b = np.vstack(rows), np.concatenate(aims)
    solved = np.linalg.lstsq(A, b, rcond=None)[0]
    spread = np.linalg.inv(A.T @ A)
    assert np.allclose(found.means, free + path @ solved, atol=1e-6)
    assert np.allclose(found.covariances[10], path[10] @ spread @ path[10].T, atol=1e-6)
    # Solved and spread tell what was missed in each step, and how well that is known.
    assert np.allclose(found.pushes[:, 0], solved[2:] ** 2 + np.diag(spread)[2:], atol=1e-5)


def test_an_exact_model_smooths_noise_away():
    cart, actions, states, seen = recorded(200)
    found = smooth(cart, seen, actions, np.array([0.05, 0.2]), np.array([1e-6]))
    assert np.abs(found.means - states).max() < 0.05
    assert np.sqrt(np.mean((found.means - states) ** 2)) < 0.02


def test_a_filter_takes_an_angle_for_what_it_is_modulo_turns():
    pendulum = Pendulum()
    before = begun(pendulum, np.array([3.1, 0.0]), np.array([0.1, 0.1]))
    after = updated(pendulum, before, np.array([3.1 - 2 * np.pi, 0.0]), np.array([0.1, 0.1]))
    assert np.allclose(after.mean, before.mean)


def test_a_prediction_moves_the_belief_as_the_simulator_moves_a_cloud():
    pendulum, random = Pendulum(), np.random.default_rng(0)
    before = begun(pendulum, np.array([1.0, 2.0]), np.array([0.01, 0.05]))
    after, _ = predicted(pendulum, before, np.array([1.0]), usual_push(pendulum, 0.0))
    cloud = random.multivariate_normal(before.mean, before.covariance, 4000)
    moved = pendulum.step(cloud, np.ones((4000, 1)))
    assert np.allclose(after.mean, moved.mean(axis=0), atol=0.01)
    assert np.allclose(after.covariance, np.cov(moved.T), rtol=0.15, atol=1e-5)
