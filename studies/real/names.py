"""What an answer key thinks of the names that find_gap gave."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from residual.gap.result import Verdict
from sims.effects.base import Effect
from sims.effects.library import library
from sims.host import HostSimulator
from studies.real.rigs import Rig


@dataclasses.dataclass(frozen=True)
class Named:
    """Names against a key.

    Attributes:
        right: For each thing that is wanted: ``"confirmed"``, ``"one of ..."`` families, or
            ``"missing"``.
        wrong: Confirmed labels that the key does not support.
    """

    right: tuple[str, ...]
    wrong: tuple[str, ...]

    @property
    def enough(self) -> bool:
        """Everything wanted is confirmed, or one of at most two families."""
        return all(how in ("confirmed", "one of 1", "one of 2") for how in self.right)


def named(rig: Rig, simulator: HostSimulator, verdicts: Sequence[Verdict]) -> Named:
    """Compare verdicts with the key of a rig."""
    family = {str(effect): _family(effect, simulator) for effect in library(simulator)}
    right = []
    for accepted in rig.wanted:
        found = "missing"
        for verdict in verdicts:
            label = verdict.label
            offered = {label, *verdict.alternatives} if verdict.effect else set()
            if not offered & accepted or verdict.kind not in ("confirmed", "ambiguous"):
                continue
            if verdict.kind == "confirmed" and label in accepted:
                found = "confirmed"
                break
            if found == "missing":
                families = {family.get(name, name) for name in offered}
                found = f"one of {len(families)}"
        right.append(found)
    sure = [v.label for v in verdicts if v.kind == "confirmed" and v.effect]
    return Named(tuple(right), tuple(label for label in sure if label not in rig.allowed))


def _family(effect: Effect, simulator: HostSimulator) -> str:
    """Family and place, so that the friction of two joints is not one thing."""
    family = effect.family_in(simulator)
    return f"{family}@{effect.where}" if family and effect.enters != "parameter" else str(effect)
