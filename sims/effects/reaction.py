"""What two states of a first-order system make of each other where they meet."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, ClassVar

from sims.effects.base import Both, number
from sims.effects.exchange import BetweenStates, meeting_states
from sims.effects.joint import Value

if TYPE_CHECKING:
    from sims.host import HostSimulator


@dataclasses.dataclass(frozen=True)
class Reaction(BetweenStates):
    """Two states meet: ``x1' -= from_first x1 x2`` and ``x2' -= from_second x1 x2``.

    A reaction of second order by the law of mass action (Guldberg and Waage, 1864), prey that is
    eaten and what grows by it (Lotka, 1925), an infection. A strength below zero adds to a state.
    """

    from_first: Value = number(force=1, position=-1, other=-1)
    from_second: Value = number(other_force=1, position=-1, other=-1)

    name: ClassVar[str] = "reaction"
    between: ClassVar[str] = "pair of states of one unit, or of two concentrations,"
    sentence: ClassVar[str] = "Two states use each other up where they meet: a reaction, a hunt."
    needs: ClassVar[str] = "much and little of each, with much and with little of the other"

    @staticmethod
    def pairs(simulator: HostSimulator) -> list[tuple[str, str]]:
        """Every two states of one unit, and every two concentrations."""
        return meeting_states(simulator)

    def flows(self, positions: Both, rates: Both) -> Both:
        """Rates of change of both states, by row."""
        meet = rates[0] * rates[1]
        return -self.from_first * meet, -self.from_second * meet
