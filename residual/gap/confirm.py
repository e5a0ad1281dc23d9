"""Held-out proof: forecasts from a lead-in, before and after, against what noise allows."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from residual.gap.model import Model
from residual.gap.noise import Floor
from residual.gap.samples import Samples
from residual.gap.shooting import Fit, fit
from residual.gap.windows import Windows, by_growth
from sims.host import HostSimulator

Array = NDArray[np.float64]
Correction = Callable[[Array, NDArray[np.int64]], Array]


@dataclasses.dataclass(frozen=True)
class Span:
    """A value with a 95 % interval."""

    value: float
    low: float
    high: float


@dataclasses.dataclass(frozen=True)
class Plan:
    """Where forecasts start: after a lead-in of ``lead`` samples, over ``steps`` intervals.

    Attributes:
        passes: Rows of the last lead-in sample, non-overlapping within each pass.
        lead: Samples of the lead-in.
        steps: Forecast length in sample intervals.
        left_out: Share of forecasts left out because no model could make them: the error of the
            start state would grow more than ``growth``-fold.
    """

    passes: tuple[NDArray[np.int64], ...]
    lead: int
    steps: int
    left_out: float

    @property
    def rows(self) -> NDArray[np.int64]:
        """All start rows."""
        return np.concatenate(self.passes)


def plan(
    samples: Samples, jacobians: Array, scale: Array, horizon: float, growth: float = 6.0
) -> Plan:
    """Start rows of forecasts over ``horizon`` seconds, shorter where nothing can be foreseen."""
    step = float(np.median(samples.durations))
    steps = max(1, round(horizon / step))
    shortest = min(stop - start for start, stop in samples.runs)
    lead = int(np.clip(round(0.5 * steps), 6, 12))
    steps = min(steps, max(1, shortest - lead - 1))
    scaled = jacobians * scale[None, None, :] / scale[None, :, None]
    while True:
        passes, total, kept = [], 0, 0
        for offset in sorted({k * (lead + steps) // 4 for k in range(4)}):
            rows = []
            for start, stop in samples.runs:
                for a in range(start + offset, stop - lead - steps + 1, lead + steps):
                    row = a + lead - 1
                    total += 1
                    product, worst = np.eye(len(scale)), 1.0
                    for k in range(row, row + steps):
                        product = scaled[k] @ product
                        worst = max(worst, float(np.linalg.norm(product, 2)))
                    if worst < growth:
                        rows.append(row)
                        kept += 1
            passes.append(np.array(rows, np.int64))
        if kept >= max(4, 0.25 * total) or steps <= 2:
            if kept == 0:
                passes = [np.array([start + lead - 1 for start, _ in samples.runs])]
            found = tuple(rows for rows in passes if len(rows))
            return Plan(found, lead, steps, 1 - kept / max(total, 1))
        steps = max(2, steps // 2)


def forecast(
    simulator: HostSimulator, samples: Samples, plan: Plan, nodes: Array, sigma: Array,
    scale: Array, correction: Correction | None = None,
) -> tuple[Array, Array]:  # fmt: skip
    """Forecasts of a simulator from start states fitted to the lead-ins.

    Args:
        simulator: Under test, with its effects.
        samples: Held-out runs.
        nodes: Rough path of the physical states, to start the fit from, (n, n_s).
        sigma: Noise of the measured channels.
        scale: Typical variation of the physical states.
        correction: What a flexible estimator adds to the next state: (states, rows) -> change.

    Returns:
        Forecast measured channels, (k, steps + 1, m), the first the start itself, and the states
        at the beginning of each lead-in, (k, width).
    """
    model = Model(simulator)
    theta = np.zeros(0)
    owner = samples.owner
    shown, begins = [], []
    for rows in plan.passes:
        windows = Windows.cut([(int(owner[r]), int(r) - plan.lead + 1, int(r) + 1) for r in rows])
        wide = model.widen(samples, nodes, theta)
        found = fit(model, samples, windows, wide, theta, sigma, model.scales(scale), iterations=5)
        if correction is None:
            path = model.roll(samples, rows, found.nodes[rows], plan.steps, theta)
        else:
            path = _corrected(model, samples, rows, found.nodes[rows], plan.steps, correction)
        flat = path.reshape(-1, path.shape[2])
        seen = model.sense(flat[None], theta[None])[0].reshape(path.shape)
        shown.append(seen[..., samples.measured])
        begins.append(found.nodes[rows - plan.lead + 1])
    return np.concatenate(shown), np.concatenate(begins)


def _corrected(
    model: Model, samples: Samples, rows: NDArray[np.int64], states: Array, steps: int,
    correction: Correction,
) -> Array:  # fmt: skip
    path = np.repeat(states[:, None], steps + 1, axis=1)
    for k in range(steps):
        path[:, k + 1] = model.roll(samples, rows + k, path[:, k], 1, np.zeros(0))[:, 1]
        path[:, k + 1] += correction(path[:, k], rows + k)
    return path


def errors(samples: Samples, plan: Plan, shown: Array) -> Array:
    """Squared forecast error, mean over the horizon, (k, m)."""
    rows = plan.rows[:, None] + np.arange(1, plan.steps + 1)
    gap = samples.seen[rows][..., samples.measured] - shown[:, 1:]
    return np.nanmean(np.minimum(gap**2, 1e12), axis=1)


def noise_errors(
    simulator: HostSimulator, samples: Samples, plan: Plan, begins: Array, sigma: Array,
    scale: Array, rng: np.random.Generator, draws: int = 4,
) -> Array:  # fmt: skip
    """The same errors if the simulator were the truth: its own data plus noise, (draws, k, m)."""
    model = Model(simulator)
    theta = np.zeros(0)
    found = []
    for _ in range(draws):
        seen = np.array(samples.seen)
        at = 0
        parts = []
        for rows in plan.passes:
            start = begins[at : at + len(rows)]
            at += len(rows)
            first = rows - plan.lead + 1
            path = model.roll(samples, first, start, plan.lead + plan.steps - 1, theta)
            flat = path.reshape(-1, path.shape[2])
            clean = model.sense(flat[None], theta[None])[0].reshape(path.shape)
            index = first[:, None] + np.arange(plan.lead + plan.steps)
            fresh = np.array(seen)
            for i, column in enumerate(samples.measured):
                there = np.isfinite(samples.seen[index, column])
                noisy = clean[..., column] + sigma[i] * rng.standard_normal(index.shape)
                fresh[index, column] = np.where(there, noisy, np.nan)
            nodes = np.array(fresh[:, : model.physical])
            nodes[index] = path[..., : model.physical]
            one = dataclasses.replace(plan, passes=(rows,))
            drawn = dataclasses.replace(samples, seen=fresh)
            filled = np.nan_to_num(nodes)
            shown, _ = forecast(simulator, drawn, one, filled, sigma, scale)
            parts.append(errors(drawn, one, shown))
        found.append(np.concatenate(parts))
    return np.stack(found)


def span(squares: Array, rng: np.random.Generator, draws: int = 400) -> Span:
    """Root mean square over forecasts with a bootstrap interval over forecasts."""
    n = len(squares)
    picks = rng.integers(0, n, (draws, n))
    spread = np.sqrt(squares[picks].mean(axis=1))
    low, high = np.quantile(spread, [0.025, 0.975])
    return Span(float(np.sqrt(squares.mean())), float(low), float(high))


def window_fit(
    simulator: HostSimulator, samples: Samples, windows: Windows, nodes: Array, sigma: Array,
    scale: Array, cap: float,
) -> Fit:  # fmt: skip
    """Windows of held-out runs with free start states and nothing else free."""
    model = Model(simulator)
    theta = np.zeros(0)
    wide = model.widen(samples, nodes, theta)
    return fit(model, samples, windows, wide, theta, sigma, model.scales(scale), 6, cap)


def held_windows(samples: Samples, floor: Floor, scale: Array, longest: int) -> Windows:
    """Windows of held-out runs."""
    width = len(scale)
    return by_growth(samples, floor.slope.by_state[:, :width, :width], scale, longest)


def earns_place(without: Array, with_it: Array, expected: float | None = None) -> bool:
    """Whether an effect lowers the held-out cost, window by window, beyond chance.

    Args:
        without, with_it: Cost of every window.
        expected: Fall of the cost in training, scaled to the size of the held-out data, if the
            model leaves only noise; held-out data that are too few to prove a small effect then
            suffice if they agree with that.
    """
    change = without - with_it
    total = float(change.sum())
    spread = float(change.std(ddof=1)) * np.sqrt(len(change)) if len(change) > 2 else 0.0
    better, worse = np.maximum(change, 0).sum(), np.maximum(-change, 0).sum()
    # A true gain g varies by 2 sqrt(g): one in a thousand falls this far short.
    if expected is not None and total > max(0.0, expected - 3.1 * 2 * np.sqrt(max(expected, 0.0))):
        return True
    # An effect that grows with distance or speed may show in one window alone.
    return total > 6.6 and bool(total > 2.0 * spread or worse < 0.2 * better)


def is_silent(without: Array, with_it: Array, expected: float) -> bool:
    """Whether held-out data do not show an effect at all, for or against it.

    An effect that grows with the cube of the angle, say, is seen in the one run that went far.

    Args:
        without, with_it: Cost of every window.
        expected: Fall of the cost in training, scaled to the size of the held-out data.
    """
    return bool(np.abs(without - with_it).sum() < 0.05 * expected)
