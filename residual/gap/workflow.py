"""The workflow: read, is there a gap, where, which effects, add, confirm, verdict."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from residual.gap.adequacy import remainder
from residual.gap.arena import Settings
from residual.gap.candidates import candidates
from residual.gap.claims import aliases, claim, evidence, hidden
from residual.gap.contact.workflow import explain
from residual.gap.data import examine
from residual.gap.holdout import split
from residual.gap.measure import measure, prove
from residual.gap.model import Model
from residual.gap.proposals import lookalikes
from residual.gap.result import GapResult
from residual.gap.samples import Hold, Samples
from residual.gap.search import search
from residual.gap.verdicts import verdicts
from residual.gap.where import locate
from residual.gap.workers import workers
from residual.trajectories import Trajectory
from sims.effects.base import Effect
from sims.effects.library import library
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.host import HostSimulator

#: Effects upstream of an input that was measured at the actuator's output.
UPSTREAM = frozenset({"dead_zone", "saturation", "actuator_lag"})


def find_gap(
    simulator: HostSimulator,
    trajectories: Sequence[Trajectory],
    *,
    tolerance: float | None = None,
    effects: Iterable[Effect] | None = None,
    hold: Hold = "zero",
    measured_input: bool = False,
    horizon: float | None = None,
    rng: np.random.Generator | int = 0,
    ceiling: bool = True,
    settings: Settings | None = None,
    n_jobs: int = 1,
    progress: Callable[[str], None] | None = None,
) -> GapResult:
    """Find where a simulator and measured logs disagree, and name what is missing.

    Args:
        simulator: The nominal simulator.
        trajectories: Measured runs; about a fifth of them (or the end of each, if there are
            fewer than four) is held out to confirm what is found.
        tolerance: Forecast error that does not matter, in the unit of the first measured
            position; below it the verdict is "nothing that matters".
        effects: Effects that may be missing; by default all that the simulator can host.
        hold: How the input runs between samples, ``"zero"`` or ``"linear"``.
        measured_input: True if the logged input was measured at the actuator's output; what
            happens before that (dead zone, saturation, lag) is then no candidate.
        horizon: Forecast length in seconds; by default 20 control periods.
        rng: Random generator or seed.
        ceiling: Whether to fit the flexible estimator for comparison.
        settings: How hard to search; by default less hard for a simulator that steps row by row.
        n_jobs: Processes for a simulator that steps row by row.
        progress: Called with a line of text now and then.

    Returns:
        The verdicts and everything behind them.

    Raises:
        ValueError: There are no trajectories, nothing was measured, samples are too rare, or a
            position of a system that strikes the ground was not measured.
    """
    offered = tuple(library(simulator) if effects is None else effects)
    if measured_input:
        offered = tuple(e for e in offered if e.name not in UPSTREAM)
    with workers(n_jobs):
        return _find(
            simulator, trajectories, tolerance, offered, hold, horizon, np.random.default_rng(rng),
            ceiling, settings or usual_settings(simulator), progress or (lambda _: None),
        )  # fmt: skip


def usual_settings(simulator: HostSimulator) -> Settings:
    """Full search for equations, which advance all rows at once; a lean one for all others."""
    if isinstance(simulator, EquationOfMotion | FirstOrderSystem):
        return Settings()
    return Settings(singles=4, pairs=1, swaps=2, nominal_turns=4, more_turns=4, runs=3, close=2)


def _find(
    simulator: HostSimulator, trajectories: Sequence[Trajectory], tolerance: float | None,
    offered: Sequence[Effect], hold: Hold, horizon: float | None, rng: np.random.Generator,
    ceiling: bool, settings: Settings, tell: Callable[[str], None],
) -> GapResult:  # fmt: skip
    clock = Clock()
    examined = examine(simulator, trajectories)
    trajectories = examined.trajectories
    quality = [f"{found.where} {found.says}".strip() for found in examined.findings]
    if len(trajectories) == 1:
        quality.append(
            "one record only: its end was held out, which is the same experiment, so what is "
            "confirmed is provisional until a second record agrees"
        )
    train, held = split(trajectories)
    substeps = substeps_for(simulator, trajectories)
    samples = Samples.join(train, substeps, hold)
    unseen = Samples.join(held, substeps, hold)
    if horizon is None:
        # After a few strikes of the ground no forecast of a walk means anything.
        horizon = (10 if simulator.has_contacts else 20) * simulator.dt
    groups, sets = aliases(simulator, offered)
    kept = [e for e in offered if groups.get(str(e), (str(e),))[0] == str(e)]
    pool = candidates(simulator, kept, samples)
    channels = tuple(
        (simulator.physical_channels[c].name, simulator.physical_channels[c].unit)
        for c in samples.measured
    )
    clock.lap("read")

    tell("looking for the gap")
    if simulator.has_contacts:
        found_there = explain(
            simulator, samples, unseen, channels, pool, groups, sets, quality, tolerance, horizon,
            rng, tell, clock.lap, provisional=len(trajectories) == 1,
        )  # fmt: skip
        return dataclasses.replace(found_there, seconds=clock.laps)
    # Long enough for what the user cares about, and for slow effects in fast logs.
    longest = max(25, round(1.25 * horizon / float(np.median(samples.durations))))
    found = search(simulator, pool, samples, rng, settings, longest, tell)
    clock.lap("search")

    tell("confirming on held-out data")
    before = found.key
    found, proof = prove(found, unseen, longest)
    if found.key and found.key != before:
        # What is left after something was dropped has rivals of its own.
        found.arena.refit(found.fit, lookalikes(found.arena, found.key))
    clock.lap("confirm")
    left = remainder(
        found.fit, samples, found.arena.windows, found.arena.sigma, found.floor, found.arena.scale
    )
    nominal_left = remainder(
        found.arena.tried[()], samples, found.arena.windows, found.arena.sigma, found.floor,
        found.arena.scale,
    )  # fmt: skip
    claims = claim(found, left, groups, proof)
    clock.lap("intervals")
    gap, rollouts = measure(found, proof, unseen, horizon, rng, ceiling)
    clock.lap("forecast")
    model = found.fit.model
    corrected = model.bind(found.fit.theta)
    where = locate(
        Model(simulator), samples, found.arena.windows, found.arena.tried[()], nominal_left.ratio,
        found.nominal_floor,
    )  # fmt: skip
    blind = hidden(found, pool)
    return GapResult(
        verdicts=verdicts(claims, left, gap, sets, tolerance, blind, len(trajectories) == 1),
        gap=gap,
        where=where,
        evidence=evidence(found),
        rollouts=rollouts,
        effects=tuple(corrected.effects[len(simulator.effects) :]),
        corrected=corrected,
        channels=channels,
        noise={
            name: (float(s), float(e))
            for (name, _), s, e in zip(channels, found.floor.sigma, found.floor.error, strict=True)
        },
        quality=tuple(quality),
        blind=blind,
        threshold=(found.arena.threshold, found.arena.noise_gain),
        seconds=clock.laps,
    )  # fmt: skip


class Clock:
    """Seconds by stage."""

    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, stage: str) -> None:
        """End of a stage."""
        now = time.perf_counter()
        self.laps[stage] = now - self._last
        self._last = now


def substeps_for(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> int:
    """Sub-steps for one sample interval, no longer than the simulator's own sub-step."""
    longest = max(float(np.quantile(t.durations, 0.95)) for t in trajectories)
    return max(1, int(np.ceil(simulator.substeps * longest / simulator.dt - 1e-6)))
