"""Which effects are missing: all pairs on the quadratic model, the best refitted, materiality.

A greedy search starts with an effect that imitates two others (here: the supply voltage for
friction and mass) and does not find back. So after each round all sets up to one effect larger
are ranked, which costs no simulation, and the best are refitted with all start states.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.candidates import Candidate
from residual.gap.contact.columns import Column, columns
from residual.gap.contact.quadratic import Quadratic, minimise
from residual.gap.contact.refine import Refined, level, refine, settle
from residual.gap.contact.shots import Aimed, Shots
from residual.gap.contact.student import losses, trimmed_drop
from residual.gap.model import Model
from sims.host import HostSimulator

Array = NDArray[np.float64]
Key = tuple[int, ...]


@dataclasses.dataclass(frozen=True)
class Rules:
    """How hard to search, and what counts.

    Args:
        material: Share of the robust loss that an effect must take off to be named, the windows
            that gain and lose most left out. On walks of Leo by another simulator effects that
            are not there took off at most 0.5 %, however many windows there were: two good
            simulators differ at impacts, which no test of significance knows.
        tries: Sets refitted in a round.
        most: Largest number of effects.
        pairs: Pairs that are ranked with each third effect.
        turns: Gauss-Newton turns of a refit.
    """

    material: float = 0.02
    tries: int = 3
    most: int = 3
    pairs: int = 60
    turns: int = 2


@dataclasses.dataclass(frozen=True)
class Proposal:
    """A set of effects with start values and its robust loss by the quadratic model."""

    key: Key
    theta: Array
    loss: float


class Search:
    """Rival sets of effects on one set of windows.

    Attributes:
        tried: Every refitted set: sorted candidate numbers -> fit.
        around: Columns of all candidates around a set, for those that were asked for.
    """

    def __init__(
        self,
        simulator: HostSimulator,
        candidates: Sequence[Candidate],
        shots: Shots,
        rules: Rules,
        tell: Callable[[str], None],
    ) -> None:
        self.simulator, self.candidates, self.shots = simulator, list(candidates), shots
        self.rules, self.tell = rules, tell
        self.tried: dict[Key, Refined] = {}
        self.around: dict[Key, tuple[list[Column], Quadratic]] = {}

    def model(self, key: Key) -> Model:
        """The simulator with some candidates."""
        return Model(self.simulator, [self.candidates[i] for i in key])

    def named(self, key: Key) -> str:
        """A set in words."""
        return " + ".join(self.candidates[i].label for i in key)

    def signatures(self, key: Key) -> tuple[list[Column], Quadratic]:
        """Columns of all candidates around a fitted set."""
        if key not in self.around:
            now = self.tried[key]
            self.around[key] = columns(
                now.model, now.theta, self.shots, now.aimed, self.candidates, key
            )
        return self.around[key]

    def refit(self, proposal: Proposal, near: Aimed) -> None:
        """Refit a set from the start states of another."""
        if proposal.key in self.tried:
            return
        model = self.model(proposal.key)
        found = refine(model, proposal.theta, self.shots, near, self.rules.turns)
        share = 100 * found.total / self.tried[()].total
        self.tell(f"  {self.named(proposal.key)}: {share:.1f} % of the misfit")
        self.tried[proposal.key] = found

    def begin(self, key: Key, theta: Array, nominal: Array, near: Aimed | None) -> None:
        """Fit the nominal simulator and a set to go on from.

        Args:
            theta: First strengths of the set.
            nominal: First start states of the nominal simulator.
            near: The windows as shot by the set before; None for the nominal simulator alone.
        """
        turns = 2 if near is None else 1
        self.tried[()] = settle(self.model(()), np.zeros(0), self.shots, nominal, turns)
        if key and near is not None:
            again = settle(self.model(key), theta, self.shots, near.starts, 1)
            self.tried[key] = refine(again.model, theta, self.shots, again.aimed, 1)

    def round(self, current: Key) -> Key:
        """The best of the current set, sets up to one larger, and sets with effects exchanged."""
        for proposal in self.proposals(current)[: self.rules.tries]:
            self.refit(proposal, self.tried[current].aimed)
        return self.best(current)

    def level(self, one: Key, other: Key) -> None:
        """Let two sets try each other's start states."""
        self.tried[one], self.tried[other] = level(self.tried[one], self.tried[other], self.shots)

    def best(self, current: Key) -> Key:
        """The set that beats the current one: materially if larger, at all if not."""
        chosen = current
        rivals = [key for key in self.tried if 0 < len(key) <= self.rules.most]
        for key in sorted(rivals, key=lambda key: (len(key), self.tried[key].total)):
            if key != chosen and self.beats(key, chosen):
                self.level(key, chosen)
                chosen = key if self.beats(key, chosen) else chosen
        for smaller in [tuple(i for i in chosen if i != gone) for gone in chosen]:
            if smaller in self.tried and not self.beats(chosen, smaller):
                return smaller
        return chosen

    def beats(self, key: Key, other: Key) -> bool:
        """Whether a set lowers the loss of another enough for its size."""
        return self.drop(other, key) > self.rules.material * max(len(key) - len(other), 0)

    def drop(self, smaller: Key, larger: Key) -> float:
        """Trimmed share by which one set lowers the loss of another."""
        return trimmed_drop(self.tried[smaller].loss, self.tried[larger].loss)

    def proposals(self, current: Key) -> list[Proposal]:
        """Sets up to one effect larger than the current, best first, and worth a refit.

        Each size pays as much as a material effect has to gain.
        """
        _, quadratic = self.signatures(current)
        now = losses(quadratic.c, quadratic.freedom).sum()
        price = 0.5 * self.rules.material * now
        ranked: dict[Key, Proposal] = {}
        for size in range(1, min(len(current) + 2, self.rules.most) + 1):
            for proposal in self.ranked(current, size):
                if proposal.key not in ranked and proposal.key not in self.tried:
                    ranked[proposal.key] = proposal
        kept = [p for p in ranked.values() if p.loss + price * (len(p.key) - len(current)) < now]
        return sorted(kept, key=lambda p: p.loss + price * len(p.key))

    def ranked(self, current: Key, size: int) -> list[Proposal]:
        """The best sets of one size by the quadratic model around the current set."""
        found, _ = self.signatures(current)
        theta = self.tried[current].theta
        owner = np.array([column.candidate for column in found])
        place = np.array([column.chosen for column in found])
        proposals: list[Proposal] = []
        # Sets differ in which chosen effects they lack; those are taken out at once.
        for kept in _subsets(current):
            if len(kept) > size:
                continue
            there, base = self.reduced(current, kept)
            fresh = [int(j) for j in np.flatnonzero(place < 0)]
            sets = _grown(there, base, fresh, owner, size - len(kept), self.rules.pairs)
            if not sets:
                continue
            loss, coefficients = minimise(there, sets)
            for n in np.argsort(loss)[:20]:
                proposals.append(self.proposal(sets[n], coefficients[n], found, theta, loss[n]))
        best: dict[Key, Proposal] = {}
        for proposal in sorted(proposals, key=lambda p: p.loss):
            best.setdefault(proposal.key, proposal)
        return list(best.values())[:20]

    def reduced(self, current: Key, kept: Collection[int]) -> tuple[Quadratic, tuple[int, ...]]:
        """Windows around the current set with only some members left in, and their columns."""
        found, quadratic = self.signatures(current)
        theta = self.tried[current].theta
        gone = np.zeros(len(found))
        base = []
        for j, column in enumerate(found):
            if column.chosen >= 0 and column.candidate in kept:
                base.append(j)
            elif column.chosen >= 0:
                gone[j] = -theta[column.chosen]
        return quadratic.moved(gone), tuple(base)

    def proposal(
        self, chosen: tuple[int, ...], coefficients: Array, found: list[Column], theta: Array,
        loss: float,
    ) -> Proposal:  # fmt: skip
        """A set of columns with the strengths that their coefficients stand for."""
        values: dict[int, Array] = {}
        for j, coefficient in zip(chosen, coefficients, strict=True):
            column = found[j]
            if column.chosen >= 0:
                value = column.knobs * (theta[column.chosen] + coefficient)
                values[column.candidate] = values.get(column.candidate, 0.0) + value
            else:
                values[column.candidate] = column.start(coefficient)
        key = tuple(sorted(values))
        return Proposal(key, np.concatenate([values[i] for i in key]), float(loss))


def exchanged(key: Key, rival: Key) -> tuple[int, int] | None:
    """The member that a rival lacks and what it has in its place; None if more differs."""
    gone, come = set(key) - set(rival), set(rival) - set(key)
    return (gone.pop(), come.pop()) if len(gone) == len(come) == 1 else None


def _subsets(key: Key) -> list[Key]:
    """A set, it without one member, and the empty one."""
    smaller = [tuple(i for i in key if i != gone) for gone in key]
    return list(dict.fromkeys([key, *smaller, ()]))


def _grown(
    quadratic: Quadratic, base: tuple[int, ...], fresh: Sequence[int], owner: Array, more: int,
    pairs: int,
) -> list[tuple[int, ...]]:  # fmt: skip
    """Sets of columns with ``more`` fresh ones of different candidates beside ``base``."""
    if more == 0:
        return [base] if base else []
    if more == 1:
        return [(*base, j) for j in fresh]
    two = [
        (*base, i, j) for n, i in enumerate(fresh) for j in fresh[n + 1 :] if owner[i] != owner[j]
    ]
    if more == 2 or not two:
        return two
    loss, _ = minimise(quadratic, two)
    grown = set()
    for n in np.argsort(loss)[:pairs]:
        taken = {int(owner[j]) for j in two[n]}
        grown |= {tuple(sorted((*two[n], j))) for j in fresh if int(owner[j]) not in taken}
    return sorted(grown)
