"""What a check of a simulator found, and the random rows that it looks at."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from sims.host import HostSimulator
from sims.simulator import Array, Simulator, random_values


@dataclasses.dataclass(frozen=True)
class Finding:
    """The outcome of one check.

    Args:
        check: What was checked.
        ok: Whether it holds.
        says: In words, with an example row if it does not hold.
    """

    check: str
    ok: bool
    says: str

    def __str__(self) -> str:
        return f"{'ok  ' if self.ok else 'FAIL'}  {self.check}: {self.says}"


class Findings(list[Finding]):
    """Findings that print as a table."""

    def __repr__(self) -> str:
        failed = ", ".join(finding.check for finding in self if not finding.ok)
        return f"Findings({len(self)} checks, {f'failed: {failed}' if failed else 'all kept'})"

    def __str__(self) -> str:
        width = max((len(finding.check) for finding in self), default=0)
        return "\n".join(
            f"{'ok  ' if f.ok else 'FAIL'}  {f.check:<{width}}  {f.says}" for f in self
        )


def example(
    what: str, rows: NDArray[np.intp], states: Array, actions: Array, first: Array, second: Array
) -> str:
    """What is wrong, and the first row where it is."""
    i = int(rows[0])
    says = f"{what}; {len(rows)} of {len(states)} rows, for example state {states[i].tolist()}"
    says += f", action {actions[i].tolist()} -> {first[i].tolist()}"
    return says if first is second else f"{says} and then {second[i].tolist()}"


def draw(simulator: Simulator, n: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Random rows within the scales of the channels; memory as it would be after rest."""

    actions = np.empty((n, len(simulator.action_channels)))  # a system may have none
    for column, action in enumerate(simulator.action_channels):
        actions[:, column] = random_values(action, n, rng)
    states = [
        np.zeros(n) if channel.kind == "memory" else random_values(channel, n, rng)
        for channel in simulator.state_channels
    ]
    found = np.stack(states, axis=1)
    if isinstance(simulator, HostSimulator):
        found = simulator.augment(found[:, : len(simulator.physical_channels)], actions)
    return found, actions
