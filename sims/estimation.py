"""The state from noisy measurements and a simulator: extended Kalman filter and RTS smoother.

Equations: Särkkä, Bayesian Filtering and Smoothing, 2013, sections 5.2 and 9.1. What the simulator
misses counts as noise that pushes the rates for one control period, and so moves the positions by
half a period of that.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from sims.simulator import Array, Simulator, state_difference

#: Width of the differences that stand for derivatives, in scales of each channel.
_STEP = 1e-4


@dataclasses.dataclass(frozen=True)
class Belief:
    """What is known of a state.

    Attributes:
        mean: shape (n_s,).
        covariance: shape (n_s, n_s).
    """

    mean: Array
    covariance: Array


@dataclasses.dataclass(frozen=True)
class Smoothed:
    """A path, given all measurements of it.

    Attributes:
        means: States, shape (T + 1, n_s).
        covariances: shape (T + 1, n_s, n_s).
        pushes: Variance of what the simulator missed along ``pushes_of``, given the measurements,
            with the square of its mean, shape (T, number of pushes).
    """

    means: Array
    covariances: Array
    pushes: Array


def pushes_of(simulator: Simulator) -> Array:
    """How a unit change of each rate, or of each channel without one, moves the state, (n_s, p)."""
    channels = simulator.state_channels
    names = [channel.name for channel in channels]
    moved = {channel.rate_of for channel in channels if channel.rate_of}
    columns = []
    for place, channel in enumerate(channels):
        if channel.name in moved:
            continue
        column = np.zeros(len(channels))
        column[place] = 1.0
        if channel.rate_of in names:
            column[names.index(channel.rate_of)] = simulator.dt / 2
        columns.append(column)
    return np.stack(columns, axis=1)


def usual_push(simulator: Simulator, share: float) -> Array:
    """Standard deviation of every push as a share of its channel's scale, shape (p,)."""
    channels = simulator.state_channels
    moved = {channel.rate_of for channel in channels if channel.rate_of}
    return share * np.array([c.scale for c in channels if c.name not in moved])


def predicted(
    simulator: Simulator, belief: Belief, action: Array, push: Array
) -> tuple[Belief, Array]:
    """One control period on.

    Args:
        simulator: What moves the state.
        belief: Of the state before.
        action: shape (n_a,).
        push: Standard deviation of what the simulator misses, shape (p,).

    Returns:
        The belief after, and the derivative of the state after by the state before.
    """
    slope, after = _derivative(simulator, belief.mean, action)
    spread = pushes_of(simulator) * push
    covariance = slope @ belief.covariance @ slope.T + spread @ spread.T
    return Belief(after, covariance), slope


def updated(simulator: Simulator, belief: Belief, seen: Array, sigma: Array) -> Belief:
    """After a measurement.

    Args:
        simulator: Says which channels are angles.
        belief: Before it.
        seen: shape (n_s,); NaN where nothing was measured.
        sigma: Standard deviation of its noise, shape (n_s,).
    """
    there = np.flatnonzero(np.isfinite(seen))
    if not len(there):
        return belief
    gap = state_difference(simulator.state_channels, seen, belief.mean)[there]
    rows = belief.covariance[there]
    gain = np.linalg.solve(rows[:, there] + np.diag(sigma[there] ** 2), rows).T
    # Joseph's form stays positive where noise is next to nothing.
    rest = np.eye(len(seen))
    rest[:, there] -= gain
    covariance = rest @ belief.covariance @ rest.T + (gain * sigma[there] ** 2) @ gain.T
    return Belief(belief.mean + gain @ gap, covariance)


def begun(simulator: Simulator, seen: Array, sigma: Array) -> Belief:
    """Before anything is known but a first measurement: a channel not measured is near zero."""
    scale = np.array([c.scale for c in simulator.state_channels])
    there = np.isfinite(seen)
    return Belief(
        np.where(there, seen, 0.0), np.diag(np.where(there, np.maximum(sigma, 1e-6), scale) ** 2)
    )


def smooth(
    simulator: Simulator, seen: Array, actions: Array, sigma: Array, push: Array
) -> Smoothed:
    """States of one run from all of its measurements (Rauch, Tung and Striebel).

    Args:
        simulator: Whose errors are taken for noise.
        seen: Measured states, shape (T + 1, n_s); NaN where nothing was measured.
        actions: shape (T, n_a).
        sigma: Standard deviation of the measurements, shape (n_s,).
        push: Standard deviation of what the simulator misses, see ``pushes_of``, shape (p,).
    """
    now = begun(simulator, seen[0], sigma)
    past, ahead, slopes = [now], [now], []
    for action, row in zip(actions, seen[1:], strict=True):
        before, slope = predicted(simulator, now, action, push)
        now = updated(simulator, before, row, sigma)
        ahead.append(before)
        past.append(now)
        slopes.append(slope)
    channels = simulator.state_channels
    means = [now.mean]
    covariances = [now.covariance]
    inverse = np.linalg.pinv(pushes_of(simulator))
    missed = []
    for k in range(len(actions) - 1, -1, -1):
        before, slope = ahead[k + 1], slopes[k]
        mean, covariance = means[-1], covariances[-1]
        gain = np.linalg.solve(
            before.covariance + 1e-12 * np.diag(np.diag(before.covariance)),
            slope @ past[k].covariance,
        ).T
        surprise = state_difference(channels, mean, before.mean)
        back = past[k].mean + gain @ surprise
        spread = past[k].covariance + gain @ (covariance - before.covariance) @ gain.T
        cross = covariance @ gain.T @ slope.T
        left = covariance + slope @ spread @ slope.T - cross - cross.T
        jump = surprise - slope @ (back - past[k].mean)
        variance = np.maximum(np.diag(inverse @ left @ inverse.T), 0.0)
        missed.append((inverse @ jump) ** 2 + variance)
        means.append(back)
        covariances.append((spread + spread.T) / 2)
    return Smoothed(np.array(means[::-1]), np.array(covariances[::-1]), np.array(missed[::-1]))


def _derivative(simulator: Simulator, state: Array, action: Array) -> tuple[Array, Array]:
    scale = _STEP * np.array([c.scale for c in simulator.state_channels])
    rows = np.vstack([state + np.diag(scale), state - np.diag(scale), state])
    after = simulator.step(rows, np.broadcast_to(action, (len(rows), len(action))))
    n = len(state)
    moved = state_difference(simulator.state_channels, after[:n], after[n : 2 * n])
    return (moved / (2 * scale[:, None])).T, after[-1]
