"""Which effects explain the residual: rivals are refitted non-linearly and compete.

The linear gain of a signature only says who may enter; it never names an effect.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.candidates import Candidate
from residual.gap.model import Model
from residual.gap.samples import Samples
from residual.gap.shooting import Fit, capped, fit
from residual.gap.signatures import (
    Gain,
    Signatures,
    constrained_gram,
    gains,
    pair_gains,
    project_out,
    signatures,
    variant_start,
)
from residual.gap.windows import Windows
from sims.host import HostSimulator

Array = NDArray[np.float64]
Key = tuple[int, ...]


@dataclasses.dataclass(frozen=True)
class Settings:
    """How hard to search.

    Args:
        singles: Effects that enter a round by their own gain.
        pairs: Pairs that enter a round.
        swaps: Exchanges that enter a round.
        most: Largest number of effects chosen.
        share: Smallest part of the noise energy worth a name.
        nominal_turns: Gauss-Newton iterations of the nominal simulator.
        first_turns, more_turns: The same of all rivals, and of the close ones.
        runs: Training runs that the tournament sees; the final fit sees all.
        close: Rivals refitted on all training runs.
    """

    singles: int = 5
    pairs: int = 2
    swaps: int = 3
    most: int = 3
    share: float = 0.004
    nominal_turns: int = 6
    first_turns: int = 3
    more_turns: int = 5
    runs: int = 6
    close: int = 4


class Arena:
    """Fixed windows of some runs, on which rival sets of effects are refitted.

    Args:
        nodes: Smoothed path of the physical states, where every refit starts.
        by_state: Derivatives by the state there.

    Attributes:
        tried: Every refitted set: sorted candidate numbers -> fit.
    """

    def __init__(
        self,
        simulator: HostSimulator,
        candidates: Sequence[Candidate],
        samples: Samples,
        windows: Windows,
        nodes: Array,
        by_state: Array,
        sigma: Array,
        scale: Array,
        settings: Settings,
        tell: Callable[[str], None] = lambda _: None,
    ) -> None:
        self.simulator, self.candidates = simulator, list(candidates)
        self.samples, self.windows = samples, windows
        self.sigma, self.scale, self.settings, self.tell = sigma, scale, settings, tell
        self.size = int(
            np.isfinite(samples.seen[windows.index[windows.inside]][:, samples.measured]).sum()
        )
        self.cap = np.inf
        self.nodes = nodes
        self.tried: dict[Key, Fit] = {}
        nominal = self._fit(Model(simulator), nodes, np.zeros(0), settings.nominal_turns, None)
        rows = windows.inside.sum(axis=1).max() * len(samples.measured)
        self.cap = 20 * max(float(np.median(nominal.costs)), float(rows))
        self.tried[()] = dataclasses.replace(
            nominal, cap=self.cap, merit=capped(nominal.costs, self.cap)
        )
        self.by_state = by_state
        self._signatures: dict[Key, Signatures] = {}
        self.material = settings.share * self.size
        self.noise_gain = 16.0
        self.threshold = max(self.noise_gain, self.material)

    def _fit(
        self, model: Model, nodes: Array, theta: Array, turns: int, by_state: Array | None,
        widths: float = 0.3,
    ) -> Fit:  # fmt: skip
        nodes = model.widen(self.samples, nodes[:, : model.physical], theta)
        if by_state is not None and by_state.shape[1] != model.width:
            by_state = None
        return fit(
            model, self.samples, self.windows, nodes, theta, self.sigma, model.scales(self.scale),
            iterations=turns, cap=self.cap, by_state=by_state, widths=widths,
        )  # fmt: skip

    def calibrate(self, found: Signatures) -> None:
        """Set the threshold from no-gap redraws: noise alone pushed through the same signatures.

        The largest gain over all candidates is recorded for each redraw of the noise, and the
        threshold is the 99.9 % point of a Gumbel law fitted to these maxima.
        """
        rng = np.random.default_rng(0)
        size = np.sqrt(np.maximum(found.strengths, 1e-300))
        alive = found.strengths > 1e-9 * max(found.strengths.max(initial=0.0), 1e-300)
        if not alive.any():
            return
        unit = found.matrix[:, alive] / size[alive]
        # The Gram matrix of unit signatures is the covariance of their products with the noise.
        values, vectors = np.linalg.eigh(unit.T @ unit)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        drawn = root @ rng.standard_normal((len(values), 400))
        largest = (drawn**2).max(axis=0)
        spread = largest.std() * np.sqrt(6) / np.pi
        point = largest.mean() - 0.5772 * spread - spread * np.log(-np.log(0.999))
        self.threshold = max(float(point), self.material)

    def score(self, key: Key) -> float:
        """Cost plus the price of the unknowns; lower is better."""
        found = self.tried[key]
        return found.merit + np.log(self.size) * len(found.theta)

    def refit(self, base: Fit, sets: dict[Key, list[Array]], most: bool = False) -> None:
        """Refit sets of candidates from start values, those near the best for longer.

        Args:
            base: Where nodes start.
            sets: Candidate numbers (sorted) -> list of start vectors.
            most: Give every set all iterations.
        """
        settings = self.settings
        for key, starts in sets.items():
            for theta in starts:
                model = Model(self.simulator, [self.candidates[i] for i in key])
                theta = np.clip(theta, model.low, model.high)
                # From the measured path, not from a rival's: that may be in a wrong basin.
                found = self._fit(model, self.nodes, theta, settings.first_turns, self.by_state)
                if key not in self.tried or found.merit < self.tried[key].merit:
                    self.tried[key] = found
        if not sets:
            return
        merits = {key: self.tried[key].merit for key in sets}
        best = min(merits.values())
        reach = base.merit - best
        for key, merit in merits.items():
            if most or base.merit - merit > 0.7 * reach:
                self.polish(key)

    def polish(self, key: Key) -> None:
        """More iterations for one set, with small finite differences at the end."""
        found = self.tried[key]
        turns = self.settings.more_turns
        again = self._fit(found.model, found.nodes, found.theta, turns, None, 0.05)
        if again.merit < found.merit:
            self.tried[key] = again

    def signatures(self, key: Key) -> Signatures:
        """Signatures of all candidates around a fitted set."""
        if key not in self._signatures:
            self._signatures = {
                key: signatures(
                    self.tried[key], self.samples, self.windows, self.sigma, self.candidates
                )
            }
        return self._signatures[key]

    def merged(self, key: Key, additions: Sequence[tuple[int, Array]], drop: Key = ()) -> tuple[Key, Array]:
        """Sorted key and start vector of a set with some candidates added and some dropped."""
        found = self.tried[key]
        values: dict[int, Array] = {}
        at = 0
        for number in key:
            width = len(self.candidates[number].knobs)
            values[number] = found.theta[at : at + width]
            at += width
        for number in drop:
            values.pop(number)
        values.update(dict(additions))
        fresh = tuple(sorted(values))
        theta = np.concatenate([values[i] for i in fresh]) if fresh else np.zeros(0)
        return fresh, theta


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
        sets = additions(arena, current, found, settings.singles if turn == 0 else 4)
        if current:
            for key, starts in exchanges(arena, current, found).items():
                sets.setdefault(key, []).extend(starts)
        fresh = {k: v for k, v in sets.items() if k not in arena.tried}
        arena.refit(arena.tried[current], fresh)
        best = min(
            (k for k in arena.tried if 0 < len(k) <= settings.most), key=arena.score, default=current
        )
        if best == current or arena.score(current) - arena.score(best) < arena.threshold:
            break
        if len(best) > 1:
            best = wide_check(arena, best)
        best = backward(arena, best)
        if best == current or arena.score(current) - arena.score(best) < arena.threshold:
            break
        arena.tell("trying " + " + ".join(arena.candidates[i].label for i in best))
        current = best
    if current:
        arena.polish(current)
    return current


def near_floor(arena: Arena, key: Key) -> bool:
    """Whether a set leaves little more than noise."""
    return arena.tried[key].merit < 1.3 * arena.size


def additions(
    arena: Arena, current: Key, found: Signatures, singles: int
) -> dict[Key, list[Array]]:
    """Sets that add one or two candidates to the current one, with start values."""
    settings = arena.settings
    sets: dict[Key, list[Array]] = {}
    ranked = [g for g in gains(found) if found.variants[g.variants[0]].candidate not in current]
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
            if any(n in current for n in numbers):
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
            best.append((value - residual @ residual, key, theta))
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
                    best.append((value - residual @ residual - arena.threshold, key, theta))
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
            key, theta = arena.merged(best, [], drop=(drop,))
            if key not in arena.tried:
                smaller[key] = [theta]
        arena.refit(arena.tried[best], smaller, most=True)
        options = [tuple(i for i in best if i != drop) for drop in best]
        least = min(options, key=arena.score)
        if arena.score(least) - arena.score(best) < arena.threshold:
            best = least
        else:
            break
    return best


def rivals(arena: Arena, key: Key, reach: float = 100.0) -> list[Key]:
    """Refitted sets of the same size that differ in one member and come close in score."""
    if not key:
        return []
    best = arena.score(key)
    near = [
        other
        for other in arena.tried
        if len(other) == len(key)
        and len(set(other) - set(key)) == 1
        and arena.score(other) - best < reach
    ]
    return sorted(near, key=arena.score)[: arena.settings.close]
