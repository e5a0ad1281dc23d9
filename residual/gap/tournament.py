"""Which effects explain the residual: rivals are refitted non-linearly and compete.

The linear gain of a signature only says who may enter; it never names an effect.
"""

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


def choose(arena: Arena, known: dict[Key, Array]) -> Key:
    """Forward, swap and backward selection by refitted rivals; the chosen candidates.

    Args:
        arena: Where rivals compete.
        known: Sets to start from, with their numbers (the best is taken); may be empty.
    """
    settings = arena.settings
    known = {key: theta for key, theta in known.items() if key}
    arena.refit(arena.tried[()], {key: [theta] for key, theta in known.items()}, most=True)
    current: Key = min(arena.tried, key=arena.score)
    if current:
        current = backward(arena, current)
    for turn in range(2 * settings.most):
        found = arena.signatures(current)
        arena.calibrate(found)
        singles = settings.singles if turn == 0 else 4
        sets = additions(arena, current, found, singles)
        if far_off(arena, current):
            along = arena.signatures_of_path(current)
            for key, starts in additions(arena, current, along, singles).items():
                sets.setdefault(key, []).extend(starts)
        if current:
            for key, starts in exchanges(arena, current, found).items():
                sets.setdefault(key, []).extend(starts)
        fresh = {k: v for k, v in sets.items() if k not in arena.tried}
        arena.refit(arena.tried[current], fresh)
        best = min(
            (k for k in arena.tried if 0 < len(k) <= settings.most),
            key=arena.score,
            default=current,
        )
        if best == current or not worth(arena, current, best):
            break
        if len(best) > 1:
            best = wide_check(arena, best)
        best = backward(arena, best)
        if best == current or not worth(arena, current, best):
            break
        arena.tell("trying " + " + ".join(arena.candidates[i].label for i in best))
        current = best
    if current:
        arena.polish(current)
        current = challenged(arena, current)
    return current


def complete(arena: Arena, key: Key) -> Key:
    """A set that was chosen on some runs, with what only all of them show.

    Args:
        arena: All runs, where the set and its rivals have been refitted.
        key: The chosen set.
    """
    if not near_floor(arena, key):
        return key
    found = arena.signatures(key)
    arena.calibrate(found)
    if max((gain.value for gain in gains(found)), default=0.0) <= arena.threshold:
        return key
    return choose(arena, {key: arena.tried[key].theta})


def challenged(arena: Arena, current: Key) -> Key:
    """The chosen set, or a pair that shares no member with it and does better.

    Exchanges replace one member at a time, so a pair is also measured against all pairs of
    others: those that come close in the linear picture are refitted. They stay rivals if they
    do nearly as well.
    """
    arena.refit(arena.tried[current], lookalikes(arena, current))
    found, now = arena.signatures(current), arena.tried[current]
    if len(current) != 2 or not near_floor(arena, current):
        return current
    # As if the chosen pair were not there.
    residual = found.plain_residual + found.chosen @ now.theta
    whole = float(residual @ residual)
    chosen = whole - float((now.weights * now.costs).sum())
    sets: dict[Key, list[Array]] = {}
    for gain in pair_gains(found, 40, residual, found.plain, current):
        if len(sets) == arena.settings.swaps or gain.value < 0.95 * chosen - 3 * arena.threshold:
            break
        numbers = [found.variants[i].candidate for i in gain.variants]
        if len({arena.candidates[n].label for n in numbers}) < 2:
            continue
        key, theta = arena.merged((), list(zip(numbers, gain.values, strict=True)))
        if key not in arena.tried:
            sets.setdefault(key, []).append(theta)
    arena.refit(now, sets)
    best = min((k for k in arena.tried if len(k) == len(current)), key=arena.score)
    return best


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
    slack = 3 * arena.threshold if near_floor(arena, current) else 2 * cost
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


def worth(arena: Arena, smaller: Key, larger: Key) -> bool:
    """Whether a set is better beyond noise and, unless it reaches the noise, by a good part.

    While a remainder is left, any effect that resembles it gains significantly; only one that
    takes a good part of the squared error is worth a name.
    """
    fall = arena.score(smaller) - arena.score(larger)
    part = 0.0 if near_floor(arena, larger) else arena.settings.part * arena.tried[smaller].merit
    return fall > max(arena.threshold, part)


def near_floor(arena: Arena, key: Key) -> bool:
    """Whether a set leaves little more than noise."""
    return arena.tried[key].merit < 1.3 * arena.size


def far_off(arena: Arena, key: Key) -> bool:
    """Whether what a set leaves is so large that its path is not the measured one."""
    return arena.tried[key].merit > 9 * arena.size


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
    if near_floor(arena, current):
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
    if near_floor(arena, current):
        limit = -float((fit_now.weights * fit_now.costs).sum()) - 3 * arena.threshold
    for value, key, theta in best:
        if len(sets) == arena.settings.swaps or value < limit:
            break
        if key and key not in arena.tried:
            sets.setdefault(key, [theta])
    return sets


def wide_check(arena: Arena, best: Key) -> Key:
    """Refit every candidate alone; one that comes close to a larger set wins."""
    found = arena.signatures(())
    sets: dict[Key, list[Array]] = {}
    for gain in gains(found):
        number = found.variants[gain.variants[0]].candidate
        if (number,) not in arena.tried:
            options = sets.setdefault((number,), [])
            if len(options) < (2 if arena.candidates[number].rough else 1):
                options.append(gain.values[0])
    arena.refit(arena.tried[()], sets)
    single = min((k for k in arena.tried if len(k) == 1), key=arena.score)
    arena.polish(single)
    return single if arena.score(single) < arena.score(best) + arena.threshold else best


def backward(arena: Arena, best: Key) -> Key:
    """Leave out effects whose absence costs less than the threshold."""
    while len(best) > 1:
        arena.polish(best)
        smaller = {}
        for drop in best:
            # Also if tried before: from another start it may have ended in a worse place.
            key, theta = arena.merged(best, [], drop=(drop,))
            smaller[key] = [theta]
        arena.refit(arena.tried[best], smaller, most=True)
        options = [tuple(i for i in best if i != drop) for drop in best]
        least = min(options, key=arena.score)
        if not worth(arena, least, best):
            best = least
        else:
            break
    return best


def rivals(arena: Arena, key: Key, reach: float = 100.0) -> list[Key]:
    """Refitted sets of the same size that come close in score, and the best without any member.

    Close in cost is enough while a remainder is left, which may favour any of them.
    """
    if not key:
        return []
    best = arena.score(key)
    if not near_floor(arena, key):
        reach = max(reach, 1.5 * arena.tried[key].merit)
    near: list[Key] = []
    told = {tuple(arena.candidates[i].label for i in key)}
    for other in sorted(arena.tried, key=arena.score):
        labels = tuple(arena.candidates[i].label for i in other)
        if len(other) == len(key) and arena.score(other) - best < reach and labels not in told:
            told.add(labels)
            near.append(other)
    unlike = [other for other in near if not set(other) & set(key)]
    close = near[: arena.settings.close]
    return close + [other for other in unlike[:1] if other not in close]
