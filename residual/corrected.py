"""The corrected simulator f(s, a) + d(s, a): a simulator with a difference model on top."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from residual.difference import DifferenceModel
from residual.estimator import NotFinite
from sims.simulator import Array, Simulator

# A difference far outside its data could throw the state anywhere; it is kept within this many
# typical magnitudes so that a bad model ends in a bad return and not in infinities. What a channel
# says is typical may be far from how it moves: rates of so many times what was seen are allowed.
_LIMIT, _SEEN = 8.0, 4.0


class CorrectedSimulator(Simulator):
    """A simulator plus the difference model learnt for it, itself a simulator.

    It stays finite: rates are held within 8 times their scale, or 4 times the largest in the data
    if that is more, and other channels within 8 times their scale, or their range in the data, of
    where they were one step before. A value that is NaN stays as it was before the step.

    Args:
        simulator: The idealised simulator f.
        difference: The difference model d, fitted on this simulator's channels and period.

    Attributes:
        held: Rows stepped so far whose next state had to be held.

    Raises:
        ValueError: ``difference`` was fitted for another control period or other channels.
    """

    def __init__(self, simulator: Simulator, difference: DifferenceModel) -> None:
        difference.check_fits(simulator)
        self.simulator = simulator
        self.difference = difference
        self.name = f"{simulator.name} + {difference.name}"
        self.dt = simulator.dt
        self.state_channels = simulator.state_channels
        self.action_channels = simulator.action_channels
        self.parameters = simulator.parameters
        self.held = 0
        # An estimator of physics is a simulator itself, which saves two steps of three.
        estimator = difference.fitted()
        same = hasattr(estimator, "corrected") and estimator.simulator is simulator
        self._whole: Simulator | None = estimator.corrected() if same else None
        channels = simulator.state_channels
        self._rates = np.array([channel.kind == "rate" for channel in channels])
        low, high = difference.seen_
        fastest = _SEEN * np.maximum(np.abs(low), np.abs(high))
        reach = np.where(self._rates, fastest, high - low)
        typical = np.array([np.inf if c.kind == "memory" else c.scale for c in channels])
        self._limits = np.maximum(_LIMIT * typical, reach)

    def __repr__(self) -> str:
        return f"CorrectedSimulator({self.simulator.name} + {self.difference!r})"

    def step(self, states: ArrayLike, actions: ArrayLike) -> Array:
        """f(s, a) + d(s, a) for every row, kept finite."""
        states, actions = self.check_rows(states, actions)
        if self._whole is not None:
            return self._bounded(states, self._whole.step(states, actions))
        return self.correct(states, actions, self.simulator.step(states, actions))

    def correct(self, states: Array, actions: Array, next_states: Array) -> Array:
        """What ``step`` makes of next states (n, n_s) that the idealised simulator gave."""
        return self._bounded(states, next_states + self._difference(states, actions))

    def _difference(self, states: Array, actions: Array) -> Array:
        try:
            return self.difference.predict(states, actions)
        except NotFinite:
            if len(states) == 1:
                return np.full_like(states, np.nan)
        # Rows that can be predicted must not suffer from those that cannot.
        each = [slice(i, i + 1) for i in range(len(states))]
        return np.concatenate([self._difference(states[i], actions[i]) for i in each])

    def _bounded(self, states: Array, next_states: Array) -> Array:
        middle = np.where(self._rates, 0.0, states)
        moved = next_states - middle
        # Not a comparison with the limit alone: it is false for what is no number.
        if (np.abs(moved) <= self._limits).all():
            return next_states
        self.held += int((~(np.abs(moved) <= self._limits)).any(axis=1).sum())
        known = np.where(np.isnan(next_states), states - middle, moved)
        return middle + known.clip(-self._limits, self._limits)

    def augment(self, states: ArrayLike, actions: ArrayLike | None = None) -> Array:
        """See ``Simulator.augment``: as the simulator below does it."""
        return self.simulator.augment(states, actions)

    def renderer(self) -> object:
        """The renderer of the simulator below."""
        return self.simulator.renderer()  # type: ignore[attr-defined]
