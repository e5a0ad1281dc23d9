"""The ceiling: what a flexible estimator of the missing acceleration would reach."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import ExtraTreesRegressor

from residual.gap.confirm import Correction
from residual.gap.model import Model
from residual.gap.noise import Floor, push
from residual.gap.samples import Samples
from sims.host import HostSimulator

Array = NDArray[np.float64]


def features(simulator: HostSimulator, states: Array, actions: Array, before: Array) -> Array:
    """States (angles as cosine and sine), inputs and the inputs before, (n, features)."""
    columns: list[Array] = []
    for i, channel in enumerate(simulator.physical_channels):
        x = states[:, i]
        columns += [np.cos(x), np.sin(x)] if channel.angle else [x]
    return np.column_stack([*columns, actions, before])


def previous(samples: Samples) -> Array:
    """Input before the one held at each sample, (n, n_a)."""
    before = np.vstack([samples.actions[:1], samples.actions[:-1]])
    for start, _ in samples.runs:
        before[start] = samples.actions[start]
    return before


def flexible(
    simulator: HostSimulator, samples: Samples, floor: Floor, unseen: Samples,
    rng: np.random.Generator,
) -> Correction:  # fmt: skip
    """Trees fitted to the missing acceleration of the training runs.

    Returns:
        The change of the next state from (states, rows of ``unseen``).
    """
    model = Model(simulator)
    inputs = features(simulator, floor.nodes, samples.actions, previous(samples))
    trees = ExtraTreesRegressor(
        60, min_samples_leaf=5, random_state=int(rng.integers(2**31)), n_jobs=1
    ).fit(inputs, floor.force if floor.force.shape[1] > 1 else floor.force[:, 0])
    unit = push(model, unseen)
    before = previous(unseen)

    def correction(states: Array, rows: NDArray[np.int64]) -> Array:
        x = features(simulator, states, unseen.actions[rows], before[rows])
        force = trees.predict(x).reshape(len(states), -1)
        return np.einsum("nsd,nd->ns", unit[rows], force)

    return correction
