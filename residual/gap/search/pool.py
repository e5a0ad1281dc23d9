"""What may be missing in a simulator, by number, and what is known of it before any fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from residual.gap.model.candidates import Candidate
from sims.host import HostSimulator

#: A set of candidates by their numbers, sorted.
Key = tuple[int, ...]
Twins = Mapping[str, Sequence[Candidate]]


def all_but(key: Key, number: int) -> Key:
    """A set without one of its members."""
    return tuple(i for i in key if i != number)


class Pool:
    """Candidates of one simulator.

    Attributes:
        simulator: The simulator as it was given.
        candidates: What may be missing, by number; those from ``screened`` on are twins only, or
            losses that several of them make together.
        twins: Exact twins of candidates by label, tried where those would be absurd; such a loss
            by its own label.
    """

    def __init__(
        self, simulator: HostSimulator, candidates: Sequence[Candidate], twins: Twins | None = None
    ) -> None:
        self.simulator, self.twins, self.screened = simulator, twins or {}, len(candidates)
        others = {twin.effect: twin for found in self.twins.values() for twin in found}
        known = {candidate.effect for candidate in candidates}
        self.candidates = [*candidates, *(t for e, t in others.items() if e not in known)]

    def labels(self, key: Key) -> tuple[str, ...]:
        """Names and places of a set."""
        return tuple(self.candidates[i].label for i in key)

    def numbers(self, key: Key) -> int:
        """Free numbers of a set."""
        return sum(len(self.candidates[i].knobs) for i in key)

    def twins_of(self, number: int) -> list[Candidate]:
        """Candidates that move exactly as one does."""
        own = self.candidates[number]
        return [one for one in self.twins.get(own.label, ()) if one.effect != own.effect]

    def stands_for(self, number: int) -> int:
        """The screened candidate that moves exactly as a twin does; itself if it is one."""
        effect = self.candidates[number].effect
        alike = (
            i for i in range(self.screened) if effect in [twin.effect for twin in self.twins_of(i)]
        )
        return number if number < self.screened else next(alike, number)

    def contains(self, one: int, other: int) -> bool:
        """Whether an effect is a special case of another at the same place."""
        return self.candidates[one].effect.contains(self.candidates[other].effect)

    def family(self, number: int) -> str:
        """What effects that differ in form more than in kind have in common, and where."""
        effect = self.candidates[number].effect
        family = effect.family_in(self.simulator)
        return f"{family}@{self.place(number)}" if family else ""

    def place(self, number: int) -> str:
        """The joint, actuator, channel or parameter of a candidate."""
        return self.candidates[number].effect.where
