"""What is claimed of each chosen effect: numbers, intervals, rivals, and what stays hidden."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from residual.gap.adequacy import Remainder
from residual.gap.contact.columns import chosen_changes
from residual.gap.contact.duel import excluded
from residual.gap.contact.quadratic import minimise
from residual.gap.contact.refine import Refined, quadratic, refine
from residual.gap.contact.search import Key, Search, exchanged
from residual.gap.contact.shots import Shots
from residual.gap.contact.student import losses, trimmed_drop, weights
from residual.gap.result import Blind, Number, Rival
from residual.gap.verdicts import Claim

Array = NDArray[np.float64]


def bootstrap(found: Refined, shots: Shots, rng: np.random.Generator, draws: int = 300) -> Array:
    """Standard deviation of the strengths over windows drawn anew, (p,)."""
    if not len(found.theta):
        return np.zeros(0)
    changes = chosen_changes(found.model, found.theta, shots, found.aimed)
    around = quadratic(found, shots, changes)
    every = [tuple(range(len(found.theta)))]
    picks = rng.integers(0, len(shots), (draws, len(shots)))
    return np.std([minimise(around.take(pick), every)[1][0] for pick in picks], axis=0)


def idle(found: Refined, shots: Shots, material: float) -> list[int]:
    """Positions of the chosen effects whose absence costs less than a material effect.

    All windows tell, by the quadratic model; the search has seen some of them only.
    """
    model = found.model
    changes = chosen_changes(model, found.theta, shots, found.aimed)
    around = quadratic(found, shots, changes)
    lacking = []
    for position in range(len(model.chosen)):
        own = model.owner == position
        there = around.moved(np.where(own, -found.theta, 0.0))
        others = tuple(int(j) for j in np.flatnonzero(~own))
        change = np.zeros(len(own))
        if others:
            change[list(others)] = minimise(there, [others])[1][0]
        without = losses(there.costs(change), shots.freedom)
        if trimmed_drop(without, found.loss) < material:
            lacking.append(position)
    return lacking


def finer(found: Refined, shots: Shots) -> Array:
    """The strengths refitted at half the integration step, (p,)."""
    samples = dataclasses.replace(shots.samples, substeps=2 * shots.samples.substeps)
    halved = dataclasses.replace(shots, samples=samples)
    return refine(found.model, found.theta, halved, found.aimed, 1).theta


def challenge(search: Search, key: Key, most: int = 2) -> None:
    """Refit what comes near the chosen set with one effect exchanged, ``most`` for each effect."""
    _, around = search.signatures(key)
    sets = search.ranked(key, len(key))
    limit = losses(around.c, around.freedom).sum() * (1 + 2 * search.rules.material)
    near = [p for p in sets if p.loss < limit and p.key not in search.tried]
    for gone in key:
        instead = [p for p in near if set(key) - set(p.key) == {gone}]
        for proposal in instead[:most]:
            search.refit(proposal, search.tried[key].aimed)
    for rival in [k for k in search.tried if len(k) == len(key) and k != key]:
        if search.drop(rival, key) < 3 * search.rules.material:
            search.level(rival, key)


def claims(
    search: Search, key: Key, full: Refined, spread: Array, fine: Array,
    groups: Mapping[str, tuple[str, ...]], beaten: Collection[Key],
) -> list[Claim]:  # fmt: skip
    """Numbers, intervals, rivals and numerics of every chosen effect, strongest first.

    Args:
        search: With all that was tried.
        key: The chosen candidates.
        full: Their fit to all windows.
        spread: Standard deviation of the numbers, (p,).
        fine: The numbers of the search at half the integration step, (p,).
        groups: Exact twins by label.
        beaten: Rivals that all windows exclude.
    """
    base = search.tried[key]
    told = []
    for position, number in enumerate(key):
        candidate = search.candidates[number]
        numbers, artefact = {}, False
        for j in np.flatnonzero(full.model.owner == position):
            knob, value = full.model.knobs[j], float(full.theta[j])
            shift = abs(float(fine[j] - base.theta[j]))
            half = float(np.hypot(1.96 * spread[j], shift))
            artefact |= knob.strength and shift > 0.3 * abs(value)
            low, high = max(value - half, knob.low), min(value + half, knob.high)
            numbers[knob.field] = Number(value, low, high, knob.unit)
        ties = [
            search.candidates[swap[1]].label
            for rival in search.tried
            if (swap := exchanged(key, rival))
            and swap[0] == number
            and not excluded(search, rival, key, beaten)
        ]
        without = [p for p in search.ranked(key, len(key) - 1) if number not in p.key]
        gain = min((p.loss for p in without), default=search.tried[()].total) - base.total
        twins = tuple(n for n in groups.get(candidate.label, ()) if n != candidate.label)
        told.append(
            Claim(
                candidate.name, candidate.effect.where, candidate.label, numbers, tuple(ties),
                twins, (), gain, artefact, candidate.effect.sentence,
            )
        )  # fmt: skip
    return sorted(told, key=lambda claim: -claim.gain)


def evidence(search: Search, key: Key, beaten: Collection[Key]) -> tuple[Rival, ...]:
    """Chosen set, nominal and runners-up on the windows of the search.

    Args:
        beaten: Rivals that all windows exclude.
    """
    base = search.tried[key]
    rows = []
    for other, found in search.tried.items():
        ratio = float(np.sqrt(np.median(found.aimed.costs / search.shots.freedom)))
        rows.append(
            Rival(
                tuple(search.candidates[i].label for i in other), found.total - base.total, ratio,
                other == key, other != key and excluded(search, other, key, beaten),
            )
        )  # fmt: skip
    return tuple(sorted(rows, key=lambda r: (not r.chosen, r.excess)))


def hidden(search: Search, key: Key) -> tuple[Blind, ...]:
    """Effects that could be there at a size that matters without this log showing it."""
    found, around = search.signatures(key)
    weight = weights(around.c, around.freedom)
    strengths = np.einsum("w,wjj->j", weight, around.a)
    needed = search.rules.material * search.tried[key].total
    smallest: dict[int, tuple[float, str, float]] = {}
    for column, strength in zip(found, strengths, strict=True):
        candidate = search.candidates[column.candidate]
        if column.chosen >= 0 or candidate.fixed_level or column.candidate in key:
            continue
        knob = next(iter(np.flatnonzero(column.linear & (column.knobs != 0))))
        size = abs(float(column.knobs[knob]))
        visible = size * float(np.sqrt(needed / max(strength, 1e-300)))
        known = smallest.get(column.candidate)
        if known is None or visible < known[0]:
            limit = 10 * candidate.knobs[knob].step
            smallest[column.candidate] = (visible, candidate.knobs[knob].unit, limit)
    return tuple(
        Blind(search.candidates[n].label, visible, unit, search.candidates[n].effect.needs)
        for n, (visible, unit, limit) in smallest.items()
        if visible > limit
    )


def remainder(count: int) -> Remainder:
    """None on any of ``count`` channels: their noise is estimated from the windows themselves."""
    ones = np.ones(count)
    return Remainder(ones, 0 * ones, ones, 0.0, 0, 1.0, "", True)


def spoiled(found: Refined, shots: Shots) -> float:
    """Share of windows that fit worse than noise allows, mostly by impacts."""
    return float((found.aimed.costs > 2 * shots.freedom).mean())
