"""Transitions of the pendulum for the estimators' benchmarks."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from residual.features import ChannelFeatures
from sims.pendulum import Pendulum
from sims.simulator import state_difference

Rows = NDArray[np.float64]


@functools.cache
def observed(n: int, seed: int, reach: float) -> tuple[Rows, Rows]:
    """Raw rows [states, actions] and differences true - idealised at n random states.

    Args:
        n: Number of rows.
        seed: Of the states and actions.
        reach: Rates are drawn from [-reach, reach] rad/s.
    """
    random = np.random.default_rng(seed)
    states = random.uniform([-np.pi, -reach], [np.pi, reach], (n, 2))
    actions = random.uniform(-3, 3, (n, 1))
    idealised, true = Pendulum(), Pendulum.true()
    difference = state_difference(
        idealised.state_channels, true.step(states, actions), idealised.step(states, actions)
    )
    return np.concatenate([states, actions], axis=1), difference


def features(rows: Rows) -> Rows:
    """What a network or a kernel sees of raw rows."""
    return ChannelFeatures.for_simulator(Pendulum()).fit(rows).transform(rows)


def training(n: int) -> tuple[Rows, Rows]:
    """Rows to fit on: features and standardised differences."""
    rows, difference = observed(n, seed=0, reach=12.0)
    return features(rows), difference / SCALE


def held_out() -> tuple[Rows, Rows]:
    """Rows to judge by, up to rates that training did not see."""
    rows, difference = observed(2000, seed=1, reach=15.0)
    return features(rows), difference / SCALE


SCALE = np.array([0.06, 2.4])  # about the RMS of both differences, in rad and rad/s


def held_out_error(model: object) -> float:
    """RMS error over RMS difference on held-out rows, both channels together."""
    X, y = held_out()
    predicted = model.predict(X)  # type: ignore[attr-defined]
    return float(np.sqrt(np.mean((predicted - y) ** 2) / np.mean(y**2)))
