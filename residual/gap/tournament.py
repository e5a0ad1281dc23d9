"""Which effects explain the residual: rivals are refitted non-linearly and compete.

The linear gain of a signature only says who may enter; it never names an effect.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from residual.gap.arena import Arena, Key
from residual.gap.proposals import additions, exchanges, lookalikes, other_pairs
from residual.gap.signatures import gains

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
        if arena.far_off(current):
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
    if not arena.near_floor(key):
        return key
    found = arena.signatures(key)
    arena.calibrate(found)
    if max((gain.value for gain in gains(found)), default=0.0) <= arena.threshold:
        return key
    return choose(arena, {key: arena.tried[key].theta})


def challenged(arena: Arena, current: Key) -> Key:
    """The chosen set, or a pair that shares no member with it and does better.

    Exchanges replace one member at a time, so a pair is also measured against all pairs of
    others. They stay rivals if they do nearly as well.
    """
    arena.refit(arena.tried[current], lookalikes(arena, current))
    if len(current) != 2 or not arena.near_floor(current):
        return current
    arena.refit(arena.tried[current], other_pairs(arena, current))
    return min((k for k in arena.tried if len(k) == len(current)), key=arena.score)


def worth(arena: Arena, smaller: Key, larger: Key) -> bool:
    """Whether a set is better beyond noise and, unless it reaches the noise, by a good part.

    While a remainder is left, any effect that resembles it gains significantly; only one that
    takes a good part of the squared error is worth a name.
    """
    fall = arena.score(smaller) - arena.score(larger)
    part = 0.0 if arena.near_floor(larger) else arena.settings.part * arena.tried[smaller].merit
    return fall > max(arena.threshold, part)


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
    if not arena.near_floor(key):
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
