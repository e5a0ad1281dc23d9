"""Sets of effects worth refitting next, read off the linear picture around a fitted set."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from residual.gap.arena import Arena, Key
from residual.gap.signatures import (
    Gain,
    Signatures,
    constrained_gram,
    gains,
    pair_gains,
    project_out,
    variant_start,
)

Array = NDArray[np.float64]


def additions(
    arena: Arena, current: Key, found: Signatures, singles: int
) -> dict[Key, list[Array]]:
    """Sets that add one or two candidates to the current one, with start values."""
    settings = arena.settings
    sets: dict[Key, list[Array]] = {}
    taken = {arena.candidates[i].label for i in current}

    def fresh(number: int) -> bool:
        return arena.candidates[number].label not in taken

    ranked = [g for g in gains(found) if fresh(found.variants[g.variants[0]].candidate)]
    if arena.near_floor(current):
        # So near the noise the linear picture holds: what promises nothing need not be tried.
        ranked = [g for g in ranked if g.value > 0.5 * arena.threshold]
    entered: dict[int, list[Gain]] = {}
    for gain in ranked:
        number = found.variants[gain.variants[0]].candidate
        if number in entered:
            if len(entered[number]) < 2 and arena.candidates[number].rough:
                entered[number].append(gain)
        elif len(entered) < singles and gain.value > 0:
            entered[number] = [gain]
    if not entered:
        return sets
    winner = found.variants[ranked[0].variants[0]]
    lead = found.matrix[:, winner.columns[0]]
    for gain in ranked:
        variant = found.variants[gain.variants[0]]
        if variant.candidate in entered or len(entered) >= singles + 2:
            continue
        column = found.matrix[:, variant.columns[0]]
        size = np.sqrt((lead @ lead) * (column @ column))
        if size > 0 and abs(lead @ column) > 0.9 * size:
            entered[variant.candidate] = [gain]
    for number, options in entered.items():
        for gain in options:
            key, theta = arena.merged(current, [(number, gain.values[0])])
            sets.setdefault(key, []).append(theta)
    if len(current) + 2 <= settings.most:
        kept = 0
        lead_value = ranked[0].value
        for gain in pair_gains(found):
            numbers = [found.variants[i].candidate for i in gain.variants]
            if kept == settings.pairs or gain.value < lead_value + arena.threshold:
                break
            labels = {arena.candidates[n].label for n in numbers}
            if len(labels) < 2 or not all(fresh(n) for n in numbers):
                continue
            key, theta = arena.merged(current, list(zip(numbers, gain.values, strict=True)))
            if key not in sets:
                sets[key] = [theta]
                kept += 1
    return sets


def exchanges(arena: Arena, current: Key, found: Signatures) -> dict[Key, list[Array]]:
    """Sets in which one chosen effect is replaced by another or by two others."""
    fit_now = arena.tried[current]
    best: list[tuple[float, Key, Array]] = []
    for drop in current:
        owners = np.array([current[i] for i in fit_now.model.owner])
        gone = owners == drop
        residual = found.plain_residual + found.chosen[:, gone] @ fit_now.theta[gone]
        stay = found.chosen[:, ~gone]
        matrix = project_out(stay, found.plain)
        residual = project_out(stay, residual[:, None])[:, 0]
        gram, right = matrix.T @ matrix, matrix.T @ residual
        singles = []
        for variant in found.variants:
            if variant.candidate in current:
                continue
            columns = list(variant.columns)
            value, c = constrained_gram(
                gram[np.ix_(columns, columns)], right[columns], variant.trial.one_sided
            )
            singles.append((value, variant, c))
        singles.sort(key=lambda item: -item[0])
        for value, variant, c in singles[:4]:
            key, theta = arena.merged(
                current, [(variant.candidate, variant_start(variant, c))], drop=(drop,)
            )
            best.append((value - float(residual @ residual), key, theta))
        if len(current) < arena.settings.most:
            for _, first, _ in singles[:6]:
                for _, second, _ in singles[:12]:
                    if first.candidate >= second.candidate:
                        continue
                    columns = list(first.columns + second.columns)
                    sides = np.append(first.trial.one_sided, second.trial.one_sided)
                    value, c = constrained_gram(
                        gram[np.ix_(columns, columns)], right[columns], sides
                    )
                    k = len(first.columns)
                    key, theta = arena.merged(
                        current,
                        [
                            (first.candidate, variant_start(first, c[:k])),
                            (second.candidate, variant_start(second, c[k:])),
                        ],
                        drop=(drop,),
                    )
                    best.append((value - float(residual @ residual) - arena.threshold, key, theta))
    best.sort(key=lambda item: -item[0])
    sets: dict[Key, list[Array]] = {}
    limit = -np.inf
    if arena.near_floor(current):
        limit = -float((fit_now.weights * fit_now.costs).sum()) - 3 * arena.threshold
    for value, key, theta in best:
        if len(sets) == arena.settings.swaps or value < limit:
            break
        if key and key not in arena.tried:
            sets.setdefault(key, [theta])
    return sets


def lookalikes(arena: Arena, current: Key, most: int = 3) -> dict[Key, list[Array]]:
    """Sets in which one member is replaced by an effect that moves nearly alike.

    Near in the sense of the verdict (see ``claims.excluded``), with room for the linear picture.

    Args:
        arena: Where the set won.
        current: The set.
        most: Replacements tried for each member.
    """
    found, now = arena.signatures(current), arena.tried[current]
    cost = float((now.weights * now.costs).sum())
    slack = 3 * arena.threshold if arena.near_floor(current) else 2 * cost
    owners = np.array([current[i] for i in now.model.owner])
    sets: dict[Key, list[Array]] = {}
    for drop in current:
        gone = owners == drop
        stay = found.chosen[:, ~gone]
        matrix = project_out(stay, found.plain)
        residual = found.plain_residual + found.chosen[:, gone] @ now.theta[gone]
        residual = project_out(stay, residual[:, None])[:, 0]
        own = float(residual @ residual) - cost
        fresh: dict[Key, Array] = {}
        for gain in gains(found, residual, matrix):
            number = found.variants[gain.variants[0]].candidate
            if number in current:
                continue
            if gain.value < own - slack or len(fresh) == most:
                break
            key, theta = arena.merged(current, [(number, gain.values[0])], drop=(drop,))
            if key not in arena.tried:
                fresh.setdefault(key, theta)
        for key, theta in fresh.items():
            sets.setdefault(key, []).append(theta)
    return sets


def other_pairs(arena: Arena, current: Key) -> dict[Key, list[Array]]:
    """Pairs that share no member with the current one and come close to it."""
    found, now = arena.signatures(current), arena.tried[current]
    # As if the current pair were not there.
    residual = found.plain_residual + found.chosen @ now.theta
    whole = float(residual @ residual)
    taken = whole - float((now.weights * now.costs).sum())
    sets: dict[Key, list[Array]] = {}
    for gain in pair_gains(found, 40, residual, found.plain, current):
        if len(sets) == arena.settings.swaps or gain.value < 0.95 * taken - 3 * arena.threshold:
            break
        numbers = [found.variants[i].candidate for i in gain.variants]
        if len({arena.candidates[n].label for n in numbers}) < 2:
            continue
        key, theta = arena.merged((), list(zip(numbers, gain.values, strict=True)))
        if key not in arena.tried:
            sets.setdefault(key, []).append(theta)
    return sets
