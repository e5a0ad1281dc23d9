"""The workflow for systems that strike the ground, from samples to the answer.

Named on some windows, where every set of effects is refitted with all its start states; the
numbers then come from all windows of the training runs.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.candidates import Candidate
from residual.gap.contact import claims as told
from residual.gap.contact.duel import duels
from residual.gap.contact.exchange import exchange
from residual.gap.contact.forecast import errors, forecast, median_span, noise_errors, plan
from residual.gap.contact.noise import quieten, spread, with_noise
from residual.gap.contact.refine import Refined, renew
from residual.gap.contact.search import Key, Proposal, Rules, Search
from residual.gap.contact.shots import Shots
from residual.gap.contact.windows import lay_out, pieces, scales, some
from residual.gap.model import Model
from residual.gap.result import ChannelGap, Gap, GapResult, Rollout, Step, Where
from residual.gap.samples import Samples
from residual.gap.verdicts import verdicts
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Windows that effects are named on, and those that the numbers come from: more would shrink
#: intervals that the disagreement at impacts bounds anyway.
NAMED_ON, MEASURED_ON = 24, 100
#: Steps of the strengths on all windows; the first is by far the longest.
FULL_STEPS = 3


def explain(
    simulator: HostSimulator, samples: Samples, unseen: Samples,
    channels: tuple[tuple[str, str], ...], pool: Sequence[Candidate],
    groups: Mapping[str, tuple[str, ...]], sets: Sequence[tuple[str, ...]],
    quality: Sequence[str], tolerance: float | None, horizon: float, rng: np.random.Generator,
    tell: Callable[[str], None], lap: Callable[[str], None], rules: Rules | None = None,
    provisional: bool = False,
) -> GapResult:  # fmt: skip
    """Find what is missing; see ``residual.gap.workflow.find_gap``."""
    rules = rules or Rules()
    pool = simple(pool)
    cut = pieces(samples)
    search, key = name(simulator, samples, some(cut, NAMED_ON), pool, rules, tell)
    lap("search")
    tell("refining on all windows")
    whole = lay_out(simulator, samples, some(cut, MEASURED_ON))
    whole = with_noise(whole, search.shots.sigma, scales(simulator))
    key, full = prove(search, key, whole, tell)
    chosen = search.tried[key]
    sigma, error = spread(whole, full.aimed)
    told.challenge(search, key)
    beaten = duels(search, key, full, whole, FULL_STEPS)
    fine = told.finer(chosen, search.shots) if key else np.zeros(0)
    made = told.claims(search, key, full, told.bootstrap(full, whole, rng), fine, groups, beaten)
    lap("intervals")
    tell("confirming on held-out data")
    order = [claim.label for claim in made]
    gap, rollouts = measure(search, key, full, unseen, sigma, horizon, order, rng)
    lap("forecast")
    corrected = full.model.bind(full.theta)
    blind = told.hidden(search, key)
    share = told.spoiled(full, whole)
    quality = [
        *quality,
        f"{100 * share:.0f} % of the windows of {whole.windows.index.shape[1] - 1} steps fit "
        "worse than noise allows, mostly by impacts, on which simulators differ: their weight "
        "was lowered",
    ]
    return GapResult(
        verdicts=verdicts(
            made, told.remainder(len(channels)), gap, sets, tolerance, blind, provisional
        ),
        gap=gap,
        where=where(search, samples, channels),
        evidence=told.evidence(search, key, beaten),
        rollouts=rollouts,
        effects=tuple(corrected.effects[len(simulator.effects) :]),
        corrected=corrected,
        channels=channels,
        noise={
            name: (float(s), float(e))
            for (name, _), s, e in zip(channels, sigma, error, strict=True)
        },
        quality=tuple(quality),
        blind=blind,
        threshold=(rules.material * search.tried[key].total, 0.0),
        seconds={},
        robust=True,
    )  # fmt: skip


def simple(pool: Sequence[Candidate]) -> list[Candidate]:
    """One trial for each candidate, and no torque that repeats with the angle (cogging).

    Every trial costs a simulation of all windows, and cogging alone has a dozen for each joint.
    """
    found = []
    for candidate in pool:
        if candidate.name != "cogging":
            middle = candidate.trials[len(candidate.trials) // 2]
            found.append(dataclasses.replace(candidate, trials=(middle,)))
    return found


def name(
    simulator: HostSimulator, samples: Samples, cut: list[tuple[int, int, int]],
    pool: Sequence[Candidate], rules: Rules, tell: Callable[[str], None],
) -> tuple[Search, Key]:  # fmt: skip
    """Choose effects, the noise estimated anew whenever the choice has changed."""
    scale = scales(simulator)
    shots = lay_out(simulator, samples, cut)
    shots, aimed = quieten(Model(simulator), np.zeros(0), shots, shots.guess, scale, 3)
    nominal, near = aimed.starts, None
    key: Key = ()
    theta = np.zeros(0)
    for _ in range(2 * rules.most):
        search = Search(simulator, pool, shots, rules, tell)
        search.begin(key, theta, nominal, near)
        fresh = exchange(search, key)
        if fresh == key:
            fresh = search.round(key)
        if fresh == key:
            break
        key = fresh
        tell("trying " + " + ".join(pool[i].label for i in key))
        found = search.tried[key]
        theta, nominal = found.theta, search.tried[()].aimed.starts
        sigma, _ = spread(shots, found.aimed)
        shots, near = quieten(
            found.model, theta, with_noise(shots, sigma, scale), found.aimed.starts, scale, 1
        )
    else:
        search = Search(simulator, pool, shots, rules, tell)
        search.begin(key, theta, nominal, near)
    return search, key


def prove(
    search: Search, key: Key, whole: Shots, tell: Callable[[str], None]
) -> tuple[Key, Refined]:
    """The fit to all windows; effects that are not material there are left out."""
    while True:
        chosen = search.tried[key]
        full = renew(chosen.model, chosen.theta, whole, whole.guess, FULL_STEPS)
        lacking = told.idle(full, whole, search.rules.material)
        if not lacking:
            return key, full
        smaller = tuple(i for place, i in enumerate(key) if place != lacking[0])
        tell(f"not material on all windows: {search.candidates[key[lacking[0]]].label}")
        theta = chosen.theta[chosen.model.owner != lacking[0]]
        search.refit(Proposal(smaller, theta, 0.0), chosen.aimed)
        key = smaller


def measure(
    search: Search, key: Key, full: Refined, unseen: Samples, sigma: Array, horizon: float,
    order: Sequence[str], rng: np.random.Generator,
) -> tuple[Gap, tuple[Rollout, ...]]:  # fmt: skip
    """Forecast errors on held-out data: medians over forecasts."""
    simulator = search.simulator
    corrected = full.model.bind(full.theta)
    scheme = plan(simulator, unseen, sigma, horizon)
    shown_before, _ = forecast(simulator, scheme)
    shown_after, starts = forecast(corrected, scheme)
    before, after = errors(scheme, shown_before), errors(scheme, shown_after)
    floor = noise_errors(corrected, scheme, starts, rng)
    by_channel = {}
    for i, c in enumerate(unseen.measured):
        channel = simulator.physical_channels[c]
        spans = [median_span(e[:, i], np.random.default_rng(0)) for e in (before, after, floor)]
        by_channel[channel.name] = ChannelGap(channel.unit, spans[0], spans[1], spans[2], None)
    positions = {
        name: found
        for name, found in by_channel.items()
        if any(c.name == name and c.kind != "rate" for c in simulator.physical_channels)
    } or by_channel
    main = max(
        positions,
        key=lambda n: positions[n].before.value / max(positions[n].noise_floor.value, 1e-12),
    )
    at = list(by_channel).index(main)
    shown_gap = by_channel[main]
    steps = [Step("", shown_gap.before)]
    labels = [search.candidates[i].label for i in key]
    for label in order[:-1]:
        (number,) = (i for i, name in zip(key, labels, strict=True) if name == label)
        if (number,) in search.tried:
            sub = search.tried[(number,)]
            shown, _ = forecast(sub.model.bind(sub.theta), scheme)
            steps.append(
                Step(label, median_span(errors(scheme, shown)[:, at], np.random.default_rng(0)))
            )
    if order:
        steps.append(Step(order[-1], shown_gap.after))
    owner = unseen.owner
    rollouts = tuple(
        Rollout(
            unseen.names[owner[scheme.rows[k]]], unseen.times[scheme.ahead[k]],
            unseen.seen[scheme.ahead[k]][:, unseen.measured], shown_before[k], shown_after[k],
        )
        for k in np.unique(np.linspace(0, len(scheme.rows) - 1, 6).astype(int))
    )  # fmt: skip

    nominal = np.median(search.tried[()].aimed.costs / search.shots.freedom)
    left = np.median(search.tried[key].aimed.costs / search.shots.freedom)
    step = float(np.median(unseen.durations))
    return Gap(
        main, shown_gap.unit, scheme.steps * step, shown_gap.before, shown_gap.after,
        shown_gap.noise_floor, None, tuple(steps), by_channel, float(np.sqrt(nominal)),
        float(np.sqrt(left)), 0.0,
    ), rollouts  # fmt: skip


def where(search: Search, samples: Samples, channels: Sequence[tuple[str, str]]) -> Where:
    """Residual of the nominal simulator over the noise, by channel and by run."""
    nominal, shots = search.tried[()], search.shots
    count, length, measured = nominal.aimed.shown.shape
    square = nominal.aimed.residual[:, : length * measured].reshape(count, length, measured) ** 2
    share = float(shots.freedom.mean()) / (length * measured)
    ratio = np.sqrt(np.median(square.mean(axis=1), axis=0) / share)
    runs = {
        samples.names[run]: float(
            np.sqrt(np.median((nominal.aimed.costs / shots.freedom)[shots.windows.run == run]))
        )
        for run in np.unique(shots.windows.run)
    }
    by_channel = {name: float(r) for (name, _), r in zip(channels, ratio, strict=True)}
    return Where(by_channel, (), np.zeros(0), {}, runs)
