"""What other ways of naming say on the same logs: one-step regression, and pysindy.

Both regress what the nominal simulator misses in acceleration on the effects of the same
library, each effect's column computed by the simulator itself. They are thus given more than
they bring: columns for delay, lag and sensors.
"""

from __future__ import annotations

import dataclasses
import importlib
import warnings
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter
from scipy.stats import chi2

from residual.gap.confirmation.aliases import aliases, representatives
from residual.gap.data.samples import Samples
from residual.gap.model.candidates import candidates
from residual.gap.model.model import Model
from residual.trajectories import Trajectory
from sims.effects.base import Effect
from sims.host import HostSimulator
from sims.simulator import Array

#: Savitzky-Golay window in samples; wider ones smear the jumps of the input.
WINDOW = 5
#: Smallest share of the residual worth a name, the same as the engine's.
SHARE = 0.004


@dataclasses.dataclass(frozen=True)
class Regression:
    """Missing acceleration and a library of columns.

    Attributes:
        target: Missing acceleration in rad/s^2, (n,).
        matrix: Columns of the effects, (n, c).
        owner: Name of the effect that each column belongs to.
        run: Which run each row belongs to, (n,).
    """

    target: Array
    matrix: Array
    owner: tuple[str, ...]
    run: NDArray[np.int64]


def states(run: Trajectory) -> Array:
    """States of a run, as measured; without a rate both from the smoothed angle, (T + 1, 2)."""
    angle, rate = run.states.T
    if np.isfinite(rate).all():
        return np.array(run.states)
    step = float(np.median(run.durations))
    return np.stack([savgol_filter(angle, WINDOW, 3, deriv=d, delta=step) for d in (0, 1)], axis=1)


def columns(
    simulator: HostSimulator, offered: Sequence[Effect], samples: Samples, nodes: Array
) -> tuple[Array, tuple[str, ...]]:
    """Change of the rate over one step per effect and trial size, as acceleration, (n, c)."""
    groups, _ = aliases(simulator, offered)
    kept, _ = representatives(simulator, offered, groups)
    pool = candidates(simulator, kept, samples)
    base = Model(simulator).advance(samples, nodes[None], np.zeros((1, 0)))[0]
    found, owner = [], []
    for candidate in pool:
        rows = np.vstack([trial.values for trial in candidate.trials])
        model = Model(simulator, [candidate])
        starts = np.stack([model.widen(samples, nodes, row) for row in rows])
        after = model.advance(samples, starts, rows)
        if candidate.effect.enters == "sensor":
            # A wrong sensor shows in the force at the place where the joint really is.
            true = np.stack([model.bind(row).unsense(nodes) for row in rows])
            after = model.advance(samples, true, rows) - (true - nodes)
        for one in after:
            found.append((one[:, 1] - base[:, 1]) / samples.durations)
            owner.append(candidate.name)
    return np.stack(found, axis=1), tuple(owner)


def regression(
    simulator: HostSimulator,
    offered: Sequence[Effect],
    runs: Sequence[Trajectory],
    differentiate: bool,
) -> Regression:
    """The missing acceleration of all runs, and the library's columns.

    Args:
        differentiate: Take the acceleration from a smoothed derivative of the rate (as sparse
            regression of dynamics does) rather than from one step of the simulator.
    """
    samples = Samples.join(runs, simulator.substeps)
    by_name = {run.name: run for run in runs}
    nodes = np.concatenate([states(by_name[name]) for name in samples.names])
    matrix, owner = columns(simulator, offered, samples, nodes)
    ahead = Model(simulator).advance(samples, nodes[None], np.zeros((1, 0)))[0, :, 1]
    expected = (ahead - nodes[:, 1]) / samples.durations
    target = np.full(len(nodes), np.nan)
    for start, stop in samples.runs:
        rate, step = nodes[start:stop, 1], float(np.median(samples.durations[start:stop]))
        found = np.diff(rate) / step
        if differentiate:
            pysindy = importlib.import_module("pysindy")
            smooth = {"window_length": WINDOW, "polyorder": 3}
            method = pysindy.SmoothedFiniteDifference(smoother_kws=smooth)
            # The mean of two derivatives is that over the interval between the samples.
            slope = method(rate[:, None], step * np.arange(len(rate)))[:, 0]
            found = 0.5 * (slope[:-1] + slope[1:])
        target[start : stop - 1] = found
    target = target - expected
    inside = np.isfinite(target)
    for start, stop in samples.runs:
        inside[start : start + 3] = inside[stop - 4 : stop] = False
    return Regression(target[inside], matrix[inside], owner, samples.owner[inside])


def one_step(data: Regression, chance: float = 0.05, most: int = 3) -> list[str]:
    """Forward selection by least squares, each name at ``chance`` over all that were offered."""
    size = np.sqrt(np.maximum((data.matrix**2).sum(axis=0), 1e-300))
    unit = data.matrix / size
    names = sorted(set(data.owner))
    limit = max(float(chi2.isf(chance / len(names), 1)), SHARE * len(data.target))
    chosen: list[int] = []
    n = len(data.target)
    while len(chosen) < most:
        fitted = np.linalg.lstsq(unit[:, chosen], data.target, rcond=None)[0]
        left = data.target - unit[:, chosen] @ fitted
        q, _ = np.linalg.qr(unit[:, chosen])
        rest = unit - q @ (q.T @ unit)
        power = (rest**2).sum(axis=0)
        gain = np.where(power > 1e-4, (rest.T @ left) ** 2 / np.maximum(power, 1e-12), 0.0)
        taken = {data.owner[i] for i in chosen}
        gain[[name in taken for name in data.owner]] = 0.0
        best = int(np.argmax(gain))
        if gain[best] < limit * float(left @ left) / n:
            break
        chosen.append(best)
    return [data.owner[i] for i in chosen]


def sparse(data: Regression) -> list[str]:
    """pysindy's sequentially thresholded least squares on the same columns.

    Columns are scaled to the target's size, and the threshold is the one whose model errs least
    on every third run, the sparsest of those within one standard error.
    """
    pysindy = importlib.import_module("pysindy")
    spread = float(data.target.std())
    size = np.sqrt(np.maximum((data.matrix**2).mean(axis=0), 1e-300))
    unit = data.matrix / size
    target = data.target / max(spread, 1e-300)
    held = data.run % 3 == 2
    if not held.any():
        held = np.arange(len(target)) % 3 == 2
    tried = []
    for threshold in (0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            model = pysindy.STLSQ(threshold=threshold, alpha=1e-3).fit(
                unit[~held], target[~held][:, None]
            )
        weights = model.coef_[0]
        error = (target[held] - unit[held] @ weights) ** 2
        tried.append((float(error.mean()), float(error.std() / np.sqrt(held.sum())), weights))
    best = min(tried, key=lambda item: item[0])
    weights = next(w for e, _, w in reversed(tried) if e <= best[0] + best[1])
    order = np.argsort(-np.abs(weights))
    return list(dict.fromkeys(data.owner[i] for i in order if weights[i]))
