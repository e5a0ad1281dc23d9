"""The workflow: read, is there a gap, where, which effects, add, confirm, verdict."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap import confirm, noise
from residual.gap.adequacy import Remainder, remainder
from residual.gap.candidates import Candidate, candidates
from residual.gap.ceiling import flexible
from residual.gap.checks import integration
from residual.gap.intervals import covariance
from residual.gap.model import Model
from residual.gap.result import Blind, ChannelGap, Gap, GapResult, Number, Rival, Rollout, Step
from residual.gap.samples import Samples
from residual.gap.search import Found, search, survey
from residual.gap.tournament import Key, Settings
from residual.gap.verdicts import Claim, verdicts
from residual.gap.where import locate
from residual.gap.workers import workers
from residual.trajectories import Trajectory
from sims.effects.base import Effect
from sims.effects.library import exact_aliases, library
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Score difference beyond which a rival is excluded: a rival that is true loses by more than this
#: with probability below 1e-3, however far apart the two predictions are.
TIE = 9.55


def find_gap(
    simulator: HostSimulator,
    trajectories: Sequence[Trajectory],
    *,
    tolerance: float | None = None,
    effects: Iterable[Effect] | None = None,
    hold: str = "zero",
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
        horizon: Forecast length in seconds; by default 20 control periods.
        rng: Random generator or seed.
        ceiling: Whether to fit the flexible estimator for comparison.
        settings: How hard to search; by default less hard for a simulator that steps row by row.
        n_jobs: Processes for a simulator that steps row by row.
        progress: Called with a line of text now and then.

    Returns:
        The verdicts and everything behind them.

    Raises:
        ValueError: There are no trajectories, or nothing was measured.
    """
    with workers(n_jobs):
        return _find(
            simulator, trajectories, tolerance, effects, hold, horizon, np.random.default_rng(rng),
            ceiling, settings or usual_settings(simulator), progress or (lambda _: None),
        )  # fmt: skip


def usual_settings(simulator: HostSimulator) -> Settings:
    """Full search for equations, which advance all rows at once; a lean one for all others."""
    if isinstance(simulator, EquationOfMotion | FirstOrderSystem):
        return Settings()
    return Settings(singles=4, pairs=1, swaps=2, nominal_turns=4, more_turns=4, runs=3, close=2)


def _find(
    simulator: HostSimulator, trajectories: Sequence[Trajectory], tolerance: float | None,
    effects: Iterable[Effect] | None, hold: str, horizon: float | None, rng: np.random.Generator,
    ceiling: bool, settings: Settings, tell: Callable[[str], None],
) -> GapResult:  # fmt: skip
    clock = Clock()
    quality: list[str] = []
    train, held = split(trajectories)
    if not len(train[0].actions):
        raise ValueError("the first trajectory has no steps")
    substeps = substeps_for(simulator, trajectories)
    samples = Samples.join(train, substeps, hold)
    unseen = Samples.join(held, substeps, hold)
    if not len(samples.measured):
        raise ValueError("no state channel was measured: every value in the trajectories is NaN")
    horizon = 20 * simulator.dt if horizon is None else horizon
    offered = tuple(library(simulator) if effects is None else effects)
    groups, sets = aliases(simulator, offered)
    kept = [effect for effect in offered if str(effect) not in groups or groups[str(effect)][0] == str(effect)]
    pool = candidates(simulator, kept, samples)
    clock.lap("read")

    tell("looking for the gap")
    found = search(simulator, pool, samples, rng, settings, tell=tell)
    clock.lap("search")

    tell("confirming on held-out data")
    found, proof = prove(found, unseen, horizon)
    clock.lap("confirm")
    left = remainder(
        found.fit, samples, found.arena.windows, found.arena.sigma, found.floor, found.arena.scale
    )
    nominal_left = remainder(
        found.arena.tried[()], samples, found.arena.windows, found.arena.sigma, found.floor,
        found.arena.scale,
    )  # fmt: skip
    claims = claim(found, left, groups)
    clock.lap("intervals")
    gap, rollouts = measure(found, proof, unseen, horizon, rng, ceiling)
    clock.lap("forecast")
    model = found.fit.model
    corrected = model.bind(found.fit.theta)
    where = locate(
        Model(simulator), samples, found.arena.windows, found.arena.tried[()], nominal_left.ratio,
        found.nominal_floor,
    )  # fmt: skip
    channels = tuple(
        (simulator.physical_channels[c].name, simulator.physical_channels[c].unit)
        for c in samples.measured
    )
    blind = hidden(found, pool)
    return GapResult(
        verdicts=verdicts(claims, left, gap, sets, tolerance, blind),
        gap=gap,
        where=where,
        evidence=evidence(found),
        rollouts=rollouts,
        effects=tuple(corrected.effects[len(simulator.effects):]),
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


def split(trajectories: Sequence[Trajectory]) -> tuple[list[Trajectory], list[Trajectory]]:
    """Training and held-out runs: the last fifth of the runs, or the last part of each."""
    count = len(trajectories)
    if count >= 4:
        last = max(1, round(0.2 * count))
        return list(trajectories[:-last]), list(trajectories[-last:])
    train, held = [], []
    for run in trajectories:
        cut = int(round(0.75 * len(run)))
        train.append(part(run, 0, cut))
        held.append(part(run, cut, len(run)))
    return train, held


def part(run: Trajectory, start: int, stop: int) -> Trajectory:
    """Samples ``start`` to ``stop`` of a run, both included."""
    return Trajectory(
        run.name, run.times[start : stop + 1], run.states[start : stop + 1],
        run.actions[start:stop],
    )  # fmt: skip


def substeps_for(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> int:
    """Sub-steps for one sample interval, no longer than the simulator's own sub-step."""
    longest = max(float(np.quantile(t.durations, 0.95)) for t in trajectories)
    return max(1, int(np.ceil(simulator.substeps * longest / simulator.dt - 1e-6)))


def aliases(
    simulator: HostSimulator, offered: Sequence[Effect]
) -> tuple[dict[str, tuple[str, ...]], tuple[tuple[str, ...], ...]]:
    """Exact aliases among the offered effects: twins by name, and dependent sets."""
    names = {str(effect) for effect in offered}
    groups: dict[str, tuple[str, ...]] = {}
    sets = []
    for alias in exact_aliases(simulator):
        inside = tuple(name for name in alias.effects if name in names)
        if len(inside) < 2:
            continue
        if "combination" in alias.says:
            if len(inside) == len(alias.effects):
                sets.append(inside)
        else:
            groups.update({name: inside for name in inside})
    return groups, tuple(sets)


@dataclasses.dataclass(frozen=True)
class Proof:
    """Held-out windows."""

    floor: noise.Floor
    scale: Array
    before: Array
    after: Array
    size: int
    windows_count: int
    freedom: int


def prove(found: Found, unseen: Samples, horizon: float) -> tuple[Found, Proof]:
    """Held-out cost of nominal and corrected simulator; effects that do not help are dropped."""
    arena = found.arena
    physical = len(arena.simulator.physical_channels)
    while True:
        best = found.fit
        corrected = best.model.bind(best.theta)
        model = Model(corrected)
        nodes = noise.first_path(model, unseen, np.zeros(0))
        scale = model.scales(arena.scale)
        floor = noise.estimate(model, unseen, nodes, np.zeros(0), arena.sigma, scale)
        path = floor.nodes[:, :physical]
        windows = confirm.held_windows(unseen, floor, arena.scale, 25)

        def cost(simulator: HostSimulator, path: Array = path, windows=windows) -> Array:  # type: ignore[no-untyped-def]
            got = confirm.window_fit(
                simulator, unseen, windows, path, arena.sigma, arena.scale, np.inf
            )
            return got.costs

        after = cost(corrected)
        cap = 20 * max(float(np.median(after)), 25.0)
        after = np.minimum(after, cap)
        before = np.minimum(cost(arena.simulator), 1e6 * cap)
        size = int(np.isfinite(unseen.seen[windows.index[windows.inside]][:, unseen.measured]).sum())
        proof = Proof(floor, arena.scale, before, after, size, len(windows),
                      max(size - physical * len(windows), 1))  # fmt: skip
        weakest: Key | None = None
        if found.key:
            for drop in found.key:
                smaller = tuple(i for i in found.key if i != drop)
                if smaller not in arena.tried:
                    _, theta = arena.merged(found.key, [], drop=(drop,))
                    arena.refit(best, {smaller: [theta]}, most=True)
                without = arena.tried[smaller]
                other = np.minimum(cost(without.model.bind(without.theta)), cap)
                if not confirm.earns_place(other, after):
                    if weakest is None or arena.score(smaller) < arena.score(weakest):
                        weakest = smaller
        if weakest is None:
            return found, proof
        found = dataclasses.replace(found, key=weakest)


def claim(found: Found, left: Remainder, groups: dict[str, tuple[str, ...]]) -> list[Claim]:
    """Numbers, intervals, rivals and numerics of every chosen effect, strongest first."""
    arena, best = found.arena, found.fit
    if not found.key:
        return []
    spread = covariance(best, arena.windows, arena.size)
    half = 1.96 * np.sqrt(np.diag(spread))
    numerics = integration(found, most_windows=60)
    excess = max(1.0, best.costs.sum() / max(arena.size - best.basis.shape[2] * len(arena.windows), 1))
    claims = []
    for position, number in enumerate(found.key):
        candidate = arena.candidates[number]
        own = np.flatnonzero(best.model.owner == position)
        numbers, artefact = {}, False
        for j in own:
            knob = best.model.knobs[j]
            value, fine = float(best.theta[j]), float(numerics.fine[j])
            low, high = value - half[j], value + half[j]
            shift = abs(fine - value)
            if knob.strength and shift > half[j]:
                artefact |= shift > 0.3 * abs(value)
                # Half the step is nearer to the truth, so the interval moves there.
                low, high = min(low, fine - half[j]), max(high, fine + half[j])
            numbers[knob.field] = Number(value, max(low, knob.low), min(high, knob.high), knob.unit)
        if numerics.nominal_held_merit < best.merit + TIE * excess:
            artefact = True
        smaller = tuple(i for i in found.key if i != number)
        alone = arena.score(smaller) if smaller in arena.tried else np.inf
        ties, near = [], []
        for other in arena.tried:
            if len(other) != len(found.key) or len(set(other) - set(found.key)) != 1:
                continue
            (gone,) = set(found.key) - set(other)
            if gone != number:
                continue
            (rival,) = set(other) - set(found.key)
            label = arena.candidates[rival].label
            if not excluded(arena.score(other) - arena.score(found.key),
                            arena.tried[other].merit / best.merit, excess, left.adequate):
                ties.append(label)
        claims.append(
            Claim(
                candidate.name, candidate.effect.where, candidate.label, numbers,
                tuple(ties), tuple(n for n in groups.get(candidate.label, ()) if n != candidate.label),
                alone - arena.score(found.key), artefact, candidate.effect.sentence,
            )
        )  # fmt: skip
    return sorted(claims, key=lambda c: -c.gain)


def excluded(difference: float, ratio: float, excess: float, adequate: bool) -> bool:
    """Whether a rival is out: beyond chance, and, while a remainder is left, clearly worse."""
    if adequate:
        return difference > TIE * excess
    return difference > TIE * excess and ratio > 1.5**2


def measure(
    found: Found, proof: Proof, unseen: Samples, horizon: float, rng: np.random.Generator,
    ceiling: bool,
) -> tuple[Gap, tuple[Rollout, ...]]:  # fmt: skip
    """Forecast errors on held-out data."""
    arena, best = found.arena, found.fit
    simulator = arena.simulator
    corrected = best.model.bind(best.theta)
    physical = len(simulator.physical_channels)
    path = proof.floor.nodes[:, :physical]
    jacobians = proof.floor.slope.by_state[:, :physical, :physical]
    scheme = confirm.plan(unseen, jacobians, arena.scale, horizon)

    def run(simulator: HostSimulator, correction=None):  # type: ignore[no-untyped-def]
        return confirm.forecast(
            simulator, unseen, scheme, path, arena.sigma, arena.scale, correction
        )

    shown_before, _ = run(simulator)
    shown_after, begins = run(corrected)
    before = confirm.errors(unseen, scheme, shown_before)
    after = confirm.errors(unseen, scheme, shown_after)
    floor = confirm.noise_errors(
        corrected, unseen, scheme, begins, arena.sigma, arena.scale, rng
    ).mean(axis=0)
    best_flexible = None
    if ceiling:
        correction = flexible(simulator, arena.samples, found.nominal_floor, unseen, rng)
        shown, _ = run(simulator, correction)
        best_flexible = confirm.errors(unseen, scheme, shown)
    by_channel = {}
    for i, c in enumerate(unseen.measured):
        channel = simulator.physical_channels[c]
        by_channel[channel.name] = ChannelGap(
            channel.unit,
            *(confirm.span(e[:, i], np.random.default_rng(0)) for e in (before, after, floor)),
            None if best_flexible is None
            else confirm.span(best_flexible[:, i], np.random.default_rng(0)),
        )  # fmt: skip
    kinds = [simulator.physical_channels[c].kind for c in unseen.measured]
    order = [i for i, kind in enumerate(kinds) if kind in ("position", "other")] or [0]
    main = max(order, key=lambda i: before[:, i].mean() / max(floor[:, i].mean(), 1e-300))
    name = simulator.physical_channels[unseen.measured[main]].name
    steps = [Step("", by_channel[name].before)]
    for count in range(1, len(found.key)):
        partial = order_of(found)[:count]
        key = tuple(sorted(partial))
        if key not in arena.tried:
            _, theta = arena.merged(found.key, [], drop=tuple(set(found.key) - set(key)))
            arena.refit(best, {key: [theta]}, most=True)
        sub = arena.tried[key]
        shown, _ = run(sub.model.bind(sub.theta))
        squares = confirm.errors(unseen, scheme, shown)[:, main]
        label = arena.candidates[partial[-1]].label
        steps.append(Step(label, confirm.span(squares, np.random.default_rng(0))))
    if found.key:
        steps.append(Step(arena.candidates[order_of(found)[-1]].label, by_channel[name].after))
    rows = scheme.rows
    owner = unseen.owner
    rollouts = []
    for k in np.linspace(0, len(rows) - 1, min(6, len(rows))).astype(int):
        index = rows[k] + np.arange(scheme.steps + 1)
        rollouts.append(
            Rollout(
                unseen.names[owner[rows[k]]], unseen.times[index],
                unseen.seen[index][:, unseen.measured], shown_before[k], shown_after[k],
            )
        )  # fmt: skip
    step = float(np.median(unseen.durations))
    channel = by_channel[name]
    return Gap(
        name, channel.unit, scheme.steps * step, channel.before, channel.after,
        channel.noise_floor, channel.ceiling, tuple(steps), by_channel,
        float(np.sqrt(proof.before.sum() / proof.freedom)),
        float(np.sqrt(proof.after.sum() / proof.freedom)), scheme.left_out,
    ), tuple(rollouts)  # fmt: skip


def order_of(found: Found) -> list[int]:
    """Chosen candidates, the one that is missed most first."""
    arena = found.arena

    def loss(number: int) -> float:
        smaller = tuple(i for i in found.key if i != number)
        return arena.score(smaller) if smaller in arena.tried else np.inf

    return sorted(found.key, key=lambda number: -loss(number))


def evidence(found: Found) -> tuple[Rival, ...]:
    """Chosen set, nominal and runners-up on the training windows."""
    arena = found.arena
    freedom = max(arena.size - found.fit.basis.shape[2] * len(arena.windows), 1)
    base = arena.score(found.key)
    rows = []
    trial = found.trial
    share = trial.size / arena.size
    trial_base = trial.score(found.key) if found.key in trial.tried else None
    for key in {**arena.tried, **trial.tried}:
        if key in arena.tried:
            difference = arena.score(key) - base
            ratio = float(np.sqrt(arena.tried[key].costs.sum() / freedom))
        elif trial_base is not None:
            # Tried on some of the runs only: scaled to all.
            difference = (trial.score(key) - trial_base) / share
            ratio = float(np.sqrt(trial.tried[key].costs.sum() / (freedom * share)))
        else:
            continue
        rows.append(
            Rival(
                tuple(arena.candidates[i].label for i in key), difference, ratio,
                key == found.key, key != found.key and difference > TIE,
            )
        )  # fmt: skip
    return tuple(sorted(rows, key=lambda r: (not r.chosen, r.excess)))


def hidden(found: Found, pool: Sequence[Candidate]) -> tuple[Blind, ...]:
    """Effects that could be there at a size that matters without this log showing it."""
    trial = found.trial
    key = found.key if found.key in trial.tried else ()
    around = trial.signatures(key)
    # The tournament saw some of the runs only.
    share = trial.size / found.arena.size
    smallest: dict[int, tuple[float, str]] = {}
    for variant in around.variants:
        candidate = pool[variant.candidate]
        if candidate.fixed_level or variant.candidate in found.key:
            continue
        for row, column in enumerate(variant.columns):
            knob = next(i for i in np.flatnonzero(variant.linear) if variant.trial.values[row, i])
            size = variant.trial.values[row, knob]
            strength = max(around.strengths[column] / share, 1e-300)
            visible = float(size * np.sqrt(found.arena.threshold / strength))
            limit = 10 * candidate.knobs[knob].step
            known = smallest.get(variant.candidate)
            if known is None or visible < known[0]:
                smallest[variant.candidate] = (visible, candidate.knobs[knob].unit, limit)  # type: ignore[assignment]
    return tuple(
        Blind(pool[number].label, visible, unit, pool[number].effect.needs)
        for number, (visible, unit, limit) in smallest.items()  # type: ignore[misc]
        if visible > limit
    )
