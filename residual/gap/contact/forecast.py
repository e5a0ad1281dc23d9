"""Held-out forecasts of systems with contacts: medians, because impacts make a heavy tail."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from residual.gap.confirm import Span
from residual.gap.contact.shots import Job, Shots, aim, job, run, shown
from residual.gap.contact.windows import STEPS, lay_out
from residual.gap.model import Model
from residual.gap.samples import Samples
from sims.host import HostSimulator

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Plan:
    """Where forecasts start.

    Attributes:
        lead: Windows to which start states are fitted.
        rows: Their last rows, where forecasts start, (k,).
        steps: Length of the forecasts in sample intervals.
    """

    lead: Shots
    rows: NDArray[np.int64]
    steps: int

    @property
    def ahead(self) -> NDArray[np.int64]:
        """Rows of every forecast, its start first, (k, steps + 1)."""
        return self.rows[:, None] + np.arange(self.steps + 1)


def plan(
    simulator: HostSimulator, samples: Samples, sigma: Array, horizon: float, most: int = 40
) -> Plan:
    """Forecasts after a lead-in of a window each, that overlap by their lead-ins at most."""
    steps = max(1, round(horizon / float(np.median(samples.durations))))
    longest = max(stop - start for start, stop in samples.runs)
    steps = max(1, min(steps, longest - STEPS - 2))
    cut = [
        (run, a, a + STEPS + 1)
        for run, (start, stop) in enumerate(samples.runs)
        for a in range(start + 1, stop - STEPS - steps, steps)
    ][:most]
    lead = lay_out(simulator, samples, cut)
    lead = dataclasses.replace(lead, sigma=sigma)
    return Plan(lead, lead.windows.index[:, -1], steps)


def forecast(
    simulator: HostSimulator, plan: Plan, lead: Shots | None = None, turns: int = 2
) -> tuple[Array, Array]:
    """What a simulator foretells from start states fitted to the lead-ins.

    Args:
        simulator: Under test, with its effects.
        plan: Where forecasts start.
        lead: The lead-ins, if not as measured.

    Returns:
        Measured channels of every forecast, (k, steps + 1, m), and the start states of the
        lead-ins, (k, n_p).
    """
    model, theta = Model(simulator), np.zeros(0)
    lead = lead or plan.lead
    starts = aim(model, theta, lead, lead.guess, turns).starts
    return roll(simulator, plan, starts)[:, STEPS:], starts


def roll(simulator: HostSimulator, plan: Plan, starts: Array) -> Array:
    """Measured channels from the start of the lead-ins to the end of the forecasts, (k, _, m)."""
    model, theta = Model(simulator), np.zeros(0)
    samples = plan.lead.samples
    one = job(model, theta, plan.lead, starts[None])
    rows = plan.lead.windows.index[:, :1] + np.arange(STEPS + plan.steps)
    inputs = model.inputs(samples, theta[None])[0]
    whole = Job(one.host, one.starts, inputs[rows], samples.durations[rows])
    return shown(whole, run([whole])[0], samples.measured)[0]


def errors(plan: Plan, shown: Array, seen: Array | None = None) -> Array:
    """Root mean square error of every forecast over its length, (k, m)."""
    if seen is None:
        samples = plan.lead.samples
        seen = samples.seen[plan.ahead][..., samples.measured]
    return np.sqrt(np.nanmean((seen[:, 1:] - shown[:, 1:]) ** 2, axis=1))


def noise_errors(
    simulator: HostSimulator, plan: Plan, starts: Array, rng: np.random.Generator
) -> Array:
    """The same errors if the simulator were the truth: on its own paths plus noise, (k, m)."""
    lead = plan.lead
    samples, measured = lead.samples, lead.samples.measured
    clean = roll(simulator, plan, starts)
    noisy = clean + lead.sigma * rng.standard_normal(clean.shape)
    count, length, _ = clean.shape
    # A table of its own, since forecasts overlap: each is a run.
    rows = (lead.windows.index[:, :1] + np.arange(length)).ravel()
    seen = np.full((len(rows), samples.seen.shape[1]), np.nan)
    seen[:, measured] = noisy.reshape(-1, len(measured))
    seen[np.isnan(samples.seen[rows])] = np.nan
    edges = np.arange(count + 1) * length
    drawn = dataclasses.replace(
        samples, seen=seen, actions=samples.actions[rows], durations=samples.durations[rows],
        times=samples.times[rows], runs=tuple((int(a), int(a) + length) for a in edges[:-1]),
        names=("drawn",) * count,
    )  # fmt: skip
    fresh = lay_out(
        simulator, drawn, [(k, int(a), int(a) + STEPS + 1) for k, a in enumerate(edges[:-1])]
    )
    fresh = dataclasses.replace(fresh, sigma=lead.sigma)
    redrawn = Plan(fresh, fresh.windows.index[:, -1], plan.steps)
    output, _ = forecast(simulator, redrawn)
    return errors(redrawn, output)


def median_span(errors: Array, rng: np.random.Generator, draws: int = 400) -> Span:
    """Median over forecasts with a bootstrap interval, (k,) -> value."""
    picks = rng.integers(0, len(errors), (draws, len(errors)))
    low, high = np.quantile(np.median(errors[picks], axis=1), [0.025, 0.975])
    return Span(float(np.median(errors)), float(low), float(high))
