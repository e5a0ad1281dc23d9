"""Held-out figures: which effects earn their place, and the forecast error before and after."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from residual.gap import confirm, noise
from residual.gap.arena import Key
from residual.gap.ceiling import flexible
from residual.gap.model import Model
from residual.gap.result import ChannelGap, Gap, Rollout, Step
from residual.gap.samples import Samples
from residual.gap.search import Found
from residual.gap.windows import Windows
from sims.host import HostSimulator

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Proof:
    """Held-out windows.

    Attributes:
        floor: Smoothed path around the corrected simulator.
        before, after: Cost of each window without and with the effects, (W,).
        freedom: Residuals less free start states.
        cost: Cost of each window under another simulator.
        silent: Chosen candidates that held-out data show neither for nor against.
    """

    floor: noise.Floor
    before: Array
    after: Array
    freedom: int
    cost: Callable[[HostSimulator], Array]
    silent: frozenset[int] = frozenset()


def prove(found: Found, unseen: Samples, longest: int) -> tuple[Found, Proof]:
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
        windows = confirm.held_windows(unseen, floor, arena.scale, longest)

        def cost(simulator: HostSimulator, path: Array = path, windows: Windows = windows) -> Array:
            got = confirm.window_fit(
                simulator, unseen, windows, path, arena.sigma, arena.scale, np.inf
            )
            return got.costs

        after = cost(corrected)
        cap = 20 * max(float(np.median(after)), 25.0)
        after = np.minimum(after, cap)
        before = np.minimum(cost(arena.simulator), 1e6 * cap)
        rows = windows.index[windows.inside]
        size = int(np.isfinite(unseen.seen[rows][:, unseen.measured]).sum())
        proof = Proof(floor, before, after, max(size - physical * len(windows), 1), cost)
        share = size / arena.size
        weakest: Key | None = None
        silent = set()
        if found.key:
            for drop in found.key:
                smaller = tuple(i for i in found.key if i != drop)
                if smaller not in arena.tried:
                    _, theta = arena.merged(found.key, [], drop=(drop,))
                    arena.refit(best, {smaller: [theta]}, most=True)
                without = arena.tried[smaller]
                other = np.minimum(cost(without.model.bind(without.theta)), cap)
                expected = share * (without.merit - best.merit)
                sound = float(after.sum()) < 1.2 * proof.freedom
                # On all training runs it may not be worth its numbers, as it was on some.
                fails = arena.score(smaller) < arena.score(found.key)
                fails |= not confirm.earns_place(other, after, expected if sound else None)
                if fails and sound and confirm.is_silent(other, after, expected):
                    silent.add(drop)
                elif fails and (weakest is None or arena.score(smaller) < arena.score(weakest)):
                    weakest = smaller
        if weakest is None:
            return found, dataclasses.replace(proof, silent=frozenset(silent))
        found = dataclasses.replace(found, key=weakest)


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
    scheme = confirm.plan(unseen, jacobians, foreseen(simulator, unseen, arena.scale), horizon)

    def run(
        simulator: HostSimulator, correction: confirm.Correction | None = None
    ) -> tuple[Array, Array]:
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
            confirm.span(before[:, i], np.random.default_rng(0)),
            confirm.span(after[:, i], np.random.default_rng(0)),
            confirm.span(floor[:, i], np.random.default_rng(0)),
            None
            if best_flexible is None
            else confirm.span(best_flexible[:, i], np.random.default_rng(0)),
        )
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


def foreseen(simulator: HostSimulator, samples: Samples, scale: Array) -> Array:
    """Scales by which to judge how the error of a start state grows.

    The variation of a position that nobody measured is not known, so its channel's scale stands
    for it: what moves nothing that was measured must not forbid a forecast.
    """
    usual = [channel.scale for channel in simulator.physical_channels]
    seen = np.isfinite(samples.seen[:, : len(usual)]).any(axis=0)
    moving = np.array([c.kind == "rate" for c in simulator.physical_channels])
    return np.where(seen | moving, scale, np.maximum(scale, usual))


def order_of(found: Found) -> list[int]:
    """Chosen candidates, the one that is missed most first."""
    arena = found.arena

    def loss(number: int) -> float:
        smaller = tuple(i for i in found.key if i != number)
        return arena.score(smaller) if smaller in arena.tried else np.inf

    return sorted(found.key, key=lambda number: -loss(number))
