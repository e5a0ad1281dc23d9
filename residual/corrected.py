"""The corrected simulator f(s, a) + d(s, a): a simulator with a difference model on top."""

from __future__ import annotations

from numpy.typing import ArrayLike

from residual.difference import DifferenceModel
from sims.simulator import Array, Simulator

# A residual far outside its data could throw the state anywhere; rates are kept within this
# many typical magnitudes so that a bad model ends in a bad return and not in infinities.
_RATE_LIMIT = 8.0


class CorrectedSimulator(Simulator):
    """A simulator plus the difference model learnt for it, itself a simulator.

    Args:
        simulator: The idealised simulator f.
        difference: The difference model d, fitted on this simulator's channels and period.

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
        # An estimator of physics is a simulator itself, which saves two steps of three.
        estimator = difference.fitted()
        same = hasattr(estimator, "corrected") and estimator.simulator is simulator
        self._whole: Simulator | None = estimator.corrected() if same else None
        self._limits = [
            (column, _RATE_LIMIT * channel.scale)
            for column, channel in enumerate(simulator.state_channels)
            if channel.kind == "rate"
        ]

    def step(self, states: ArrayLike, actions: ArrayLike) -> Array:
        """f(s, a) + d(s, a) for every row; rates are kept within 8 times their scale."""
        states, actions = self.check_rows(states, actions)
        if self._whole is not None:
            return self._limited(self._whole.step(states, actions))
        return self.correct(states, actions, self.simulator.step(states, actions))

    def correct(self, states: Array, actions: Array, next_states: Array) -> Array:
        """What ``step`` makes of next states (n, n_s) that the idealised simulator gave."""
        return self._limited(next_states + self.difference.predict(states, actions))

    def _limited(self, next_states: Array) -> Array:
        for column, limit in self._limits:
            next_states[:, column].clip(-limit, limit, out=next_states[:, column])
        return next_states

    def augment(self, states: ArrayLike, actions: ArrayLike | None = None) -> Array:
        """As the simulator below fills its memory."""
        return self.simulator.augment(states, actions)

    def renderer(self) -> object:
        """Looks like the simulator below."""
        return self.simulator.renderer()  # type: ignore[attr-defined]
