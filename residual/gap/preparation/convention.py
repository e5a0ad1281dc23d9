"""How a column map may count in place of how it is said to: a sign, a zero, a unit, a clock."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sims.host import HostSimulator

Array = NDArray[np.float64]
Places = NDArray[np.intp]


@dataclasses.dataclass(frozen=True)
class Convention:
    """How columns may count in place of how they are said to.

    Attributes:
        says: What to change in the column map.
        states: Factor and offset of every state, (2, n_s).
        inputs: The same of every input, (2, n_a).
        states_from: Which column every state is read from, (n_s,).
        inputs_from: The same of every input, (n_a,).
        turned: Whether nothing but the zero of an angle is another one, and perhaps its direction.
        clock: Times as long as said that every step lasts.
        meant: Whether that is the control period, from which samples are not far as they are said.
        relative: States to which a multiple of another is added: the places of both, and how often.
    """

    says: str
    states: Array
    inputs: Array
    states_from: Places
    inputs_from: Places
    turned: bool = False
    clock: float = 1.0
    meant: bool = False
    relative: tuple[tuple[int, int, float], ...] = ()

    def states_of(self, seen: Array) -> Array:
        """States as they count so, (n, n_s), of the columns as they are said to."""
        factor, offset = self.states
        states = factor * seen[:, self.states_from] + offset
        for place, other, times in self.relative:
            states[:, place] += times * states[:, other]
        return states

    def inputs_of(self, actions: Array) -> Array:
        """Inputs as they count so, (..., n_a), of the columns as they are said to."""
        factor, offset = self.inputs
        inputs: Array = factor * actions[..., self.inputs_from] + offset
        return inputs

    @property
    def sign(self) -> bool:
        """Whether nothing but signs is another one."""
        factors, offsets = np.hstack([self.states, self.inputs])
        return bool((factors == -1).any() and (np.abs(factors) == 1).all() and not offsets.any())

    @property
    def shifted(self) -> bool:
        """Whether a unit has another zero, as K for degC."""
        factors, offsets = np.hstack([self.states, self.inputs])
        return bool(offsets.any() and (factors > 0).all() and not self.turned)

    @property
    def exchanged(self) -> bool:
        """Whether two columns are in each other's place."""
        return any((np.diff(places) < 0).any() for places in (self.states_from, self.inputs_from))


def reversed_sign(name: str) -> str:
    """The line of a column map that reverses a column."""
    return f"`scale: -1` for {name}"


def of_input(
    simulator: HostSimulator, says: str, place: int, factor: float, offset: float = 0.0
) -> Convention:
    """An input times a factor and shifted, nothing else."""
    plain = as_said(simulator)
    plain.inputs[:, place] = factor, offset
    return dataclasses.replace(plain, says=says)


def of_states(
    simulator: HostSimulator, says: str, joint: Sequence[int], factor: float, offset: float
) -> Convention:
    """A position and its rate count alike, but for its zero."""
    plain = as_said(simulator)
    plain.states[0, joint] = factor
    plain.states[1, joint[0]] = offset
    return dataclasses.replace(plain, says=says)


def plainest(conventions: Sequence[Convention]) -> list[Convention]:
    """Conventions without those that another zero alone parts from one of the others: where they
    do as well, nothing depends on it."""

    def without_zero(one: Convention) -> tuple[object, ...]:
        parts = (one.states[0], one.inputs, one.states_from, one.inputs_from)
        return (*(part.tobytes() for part in parts), one.relative)

    plain = {without_zero(one) for one in conventions if not one.states[1].any()}
    return [one for one in conventions if not one.states[1].any() or without_zero(one) not in plain]


def beyond(convention: Convention) -> Convention | None:
    """With thrice its factors: as good only where they make a force too small to matter."""
    states, inputs = convention.states.copy(), convention.inputs.copy()
    for factors in (states[0], inputs[0]):
        factors[np.abs(factors) != 1.0] *= 3.0
    same = np.array_equal(states, convention.states) and np.array_equal(inputs, convention.inputs)
    return None if same else dataclasses.replace(convention, states=states, inputs=inputs)


def as_said(simulator: HostSimulator) -> Convention:
    """As the log is said to count."""
    sizes = len(simulator.physical_channels), len(simulator.action_channels)
    states, inputs = (np.vstack([np.ones(n), np.zeros(n)]) for n in sizes)
    return Convention("", states, inputs, np.arange(sizes[0]), np.arange(sizes[1]))
