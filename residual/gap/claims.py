"""What is claimed of each chosen effect: numbers, intervals, rivals, and what stays hidden."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import norm

from residual.gap.adequacy import Remainder
from residual.gap.candidates import Candidate, candidates
from residual.gap.checks import integration
from residual.gap.intervals import covariance
from residual.gap.measure import Proof
from residual.gap.result import Blind, Number, Rival
from residual.gap.search import Found
from residual.gap.shooting import Fit
from residual.gap.verdicts import Claim
from sims.effects.base import Effect
from sims.effects.library import exact_aliases, library, near_combinations
from sims.host import HostSimulator

#: Score difference beyond which a rival is excluded. If the rival is true and the two predictions
#: are d standard errors apart, the difference is normal with mean -d^2 and deviation 2 d, and it
#: exceeds z^2 with the largest probability at d = z: that of a normal beyond z, here 1e-3.
TIE = float(norm.isf(1e-3)) ** 2
#: Ratio of squared errors beyond which a rival is excluded while a remainder is left.
CLEARLY = 1.5**2


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


def claim(
    found: Found, left: Remainder, groups: dict[str, tuple[str, ...]], proof: Proof
) -> list[Claim]:
    """Numbers, intervals, rivals and numerics of every chosen effect, strongest first."""
    arena, best = found.arena, found.fit
    if not found.key:
        return []
    spread = covariance(best, arena.windows, arena.size)
    half = 1.96 * np.sqrt(np.diag(spread))
    numerics = integration(found, most_windows=60)
    freedom = max(arena.size - best.basis.shape[2] * len(arena.windows), 1)
    excess = max(1.0, float(best.costs.sum()) / freedom)
    alone_instead = not_offered(found, groups) if left.adequate else ()
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
        ties: list[str] = []
        instead: list[str] = []
        for other in arena.tried:
            if len(other) != len(found.key) or number in other:
                continue
            difference = arena.score(other) - arena.score(found.key)
            rival = arena.tried[other]
            ratio = rival.merit / best.merit
            if not left.adequate and CLEARLY < ratio < 4 * CLEARLY:
                # Imperfection of either model decides; other data have to agree.
                ratio = min(ratio, held_ratio(rival, proof))
            if excluded(difference, ratio, excess, left.adequate):
                continue
            fresh = tuple(arena.candidates[i].label for i in other if i not in found.key)
            if smaller in arena.tried and len(fresh) == 1:
                # Beside a remainder many are near; a rival has to do what the effect does.
                rest = arena.tried[smaller].merit
                if rest - rival.merit < 0.5 * (rest - best.merit):
                    continue
            known = ties if len(fresh) == 1 else instead
            name = " with ".join(fresh)
            if name not in known:
                known.append(name)
        twins = groups.get(candidate.label, ())
        claims.append(
            Claim(
                candidate.name, candidate.effect.where, candidate.label, numbers,
                tuple(ties), tuple(n for n in twins if n != candidate.label),
                (*instead, *alone_instead),
                alone - arena.score(found.key), artefact, candidate.effect.sentence,
                number in proof.silent,
            )
        )  # fmt: skip
    return sorted(claims, key=lambda c: -c.gain)


def not_offered(found: Found, groups: dict[str, tuple[str, ...]]) -> tuple[str, ...]:
    """Single effects that were not offered and do as well as a chosen pair.

    Only such that the pair imitates by the simulator's own equations, so that nothing is
    looked for that was ruled out: what would be named is named, with the doubt.
    """
    arena = found.arena
    if len(found.key) != 2:
        return ()
    simulator = arena.simulator
    offered = {c.label for c in arena.candidates} | {n for twins in groups.values() for n in twins}
    near = near_combinations(simulator, [arena.candidates[i].label for i in found.key])
    new = [e for e in library(simulator) if str(e) in near and str(e) not in offered]
    told = []
    for candidate in candidates(simulator, new, arena.samples):
        single = arena.alone(candidate)
        price = np.log(arena.size) * len(single.theta)
        if single.merit + price - arena.score(found.key) < TIE:
            told.append(candidate.label)
    return tuple(told)


def excluded(difference: float, ratio: float, excess: float, adequate: bool) -> bool:
    """Whether a rival is out: beyond chance, and, while a remainder is left, clearly worse."""
    if adequate:
        return difference > TIE * excess
    return difference > TIE * excess and ratio > CLEARLY


def held_ratio(rival: Fit, proof: Proof) -> float:
    """Held-out cost of a rival over that of the chosen set."""
    cap = 20 * max(float(np.median(proof.after)), 25.0)
    cost = np.minimum(proof.cost(rival.model.bind(rival.theta)), cap)
    return float(cost.sum() / max(float(proof.after.sum()), 1e-300))


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
            near = trial.tried[key].costs.sum() / trial.tried[found.key].costs.sum()
            ratio = float(np.sqrt(near * found.fit.costs.sum() / freedom))
        else:
            continue
        rows.append(
            Rival(
                tuple(arena.candidates[i].label for i in key), float(difference), ratio,
                key == found.key, bool(key != found.key and difference > TIE),
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
    smallest: dict[int, tuple[float, str, float]] = {}
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
                smallest[variant.candidate] = (visible, candidate.knobs[knob].unit, limit)
    return tuple(
        Blind(pool[number].label, visible, unit, pool[number].effect.needs)
        for number, (visible, unit, limit) in smallest.items()
        if visible > limit
    )
