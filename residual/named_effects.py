"""NamedEffects: a difference made of named physical effects, found by the gap engine."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Self

import numpy as np

from residual.estimator import Array, Estimator
from residual.gap.rows import SHORTEST, chains, look, pieces
from sims.effects.base import Effect
from sims.effects.library import library
from sims.host import HostSimulator
from sims.simulator import Simulator

#: Sets of effects that explain rows as well, of those that are told.
MOST_TOLD = 3


class NamedEffects(Estimator):
    """Grey box: the effects that a simulator lacks, by name, and their numbers.

    Rows that follow each other are joined to trajectories, ``residual.gap`` looks for the missing
    effects in them, and a prediction steps the simulator with and without what was found. A few
    dozen consecutive rows with little noise are enough. Noise is estimated from the rows.

    Effects with memory (delay, lag, backlash) are no function of state and action and are left
    out: a difference model cannot hold them.

    Args:
        simulator: The simulator whose difference is learnt, as ``for_simulator`` sets it.
        most_rows: Most rows to look at, in pieces spread over all of them.
        noisy: Whether states are readings of sensors. Where motion jumps at impacts, exact states
            say far more, control period by control period; elsewhere it makes no difference.

    Attributes:
        effects_: The effects found, each with its numbers; empty if there is no gap above noise.
        covariance_: Of their fitted numbers in the order of ``numbers_``, shape (p, p).
        numbers_: (position in ``effects_``, name of the number) for every fitted number.
        residual_: Root mean square of what the effects leave, for each output.
        says_: What was found, in words, what would explain the rows as well, and what stays
            unexplained.
    """

    reads_noise: ClassVar[bool] = True

    _learned: ClassVar[tuple[str, ...]] = ("covariance_", "residual_")

    effects_: tuple[Effect, ...]
    numbers_: tuple[tuple[int, str], ...]
    covariance_: Array
    residual_: Array
    says_: str

    def __init__(
        self,
        simulator: HostSimulator | None = None,
        most_rows: int = 400,
        noisy: bool = False,
    ) -> None:
        self.simulator = simulator
        self.most_rows = most_rows
        self.noisy = noisy

    def for_simulator(self, simulator: Simulator) -> Self:
        """An unfitted copy for rows [states, actions] of this simulator.

        Raises:
            ValueError: The simulator hosts no effects.
        """
        if not isinstance(simulator, HostSimulator):
            raise ValueError(
                f"NamedEffects needs a simulator that hosts effects, {simulator.name} does not: "
                "derive it from sims.host.HostSimulator or sims.equations.EquationOfMotion"
            )
        return type(self)(simulator, self.most_rows, self.noisy)

    def _fit(self, X: Array, y: Array) -> None:
        simulator = self._host()
        wanted = len(simulator.state_channels) + len(simulator.action_channels)
        if X.shape[1] != wanted or y.shape[1] != len(simulator.state_channels):
            raise ValueError(
                f"X has {X.shape[1]} columns and y {y.shape[1]}; {simulator.name} has "
                f"{wanted} states and actions and {len(simulator.state_channels)} states"
            )
        difference = y * self.target_scale_ + self.target_mean_
        # Predictions are physics in SI units, not standardised targets.
        self.target_mean_, self.target_scale_ = np.zeros(y.shape[1]), np.ones(y.shape[1])
        self.effects_, self.numbers_, self.covariance_ = (), (), np.zeros((0, 0))
        runs = pieces(chains(simulator, X, difference), self.most_rows)
        if not runs:
            raise ValueError(
                f"NamedEffects needs at least {SHORTEST} rows that follow each other: give "
                "transitions in the order in which they were observed, not shuffled"
            )
        found = look(simulator, runs, exact=not self.noisy)
        left = difference - self._change(X, found.effects)
        alone = np.sqrt((difference**2).mean(axis=0))
        self.residual_ = np.sqrt((left**2).mean(axis=0))
        if found.effects and (self.residual_ <= alone).all():
            self.effects_, self.numbers_ = found.effects, found.numbers
            self.covariance_ = found.covariance
        else:
            self.residual_ = alone
        self.says_ = self._words(found.ratio, found.adequate and bool(self.effects_))
        if self.effects_ and found.as_good:
            sets = [" and ".join(one) for one in found.as_good]
            more = f", or one of {len(sets) - MOST_TOLD} others" if len(sets) > MOST_TOLD else ""
            self.says_ += (
                f"; these rows have it as well from {', or '.join(sets[:MOST_TOLD])}{more}"
            )

    def _predict(self, X: Array, return_std: bool) -> tuple[Array, Array | None]:
        mean = self._change(X, self.effects_)
        if not return_std:
            return mean, None
        spreads = np.sqrt(np.diag(self.covariance_))
        columns = []
        for (place, name), spread in zip(self.numbers_, spreads, strict=True):
            moved = list(self.effects_)
            value = float(getattr(moved[place], name))
            moved[place] = moved[place].with_values(**{name: value + spread})
            columns.append((self._change(X, tuple(moved)) - mean) / max(spread, 1e-300))
        variance = np.broadcast_to(self.residual_**2, mean.shape)
        if columns:
            slope = np.stack(columns, axis=2)
            variance = variance + np.einsum("nsi,ij,nsj->ns", slope, self.covariance_, slope)
        return mean, np.sqrt(variance)

    def corrected(self) -> HostSimulator:
        """The simulator with the effects: its step is the simulator's plus the difference."""
        simulator = self._host()
        return simulator.with_effects((*simulator.effects, *self.effects_))

    def _change(self, X: Array, effects: tuple[Effect, ...]) -> Array:
        """What effects change in the next state, (n, n_s)."""
        simulator = self._host()
        width = len(simulator.state_channels)
        if not effects:
            return np.zeros((len(X), width))
        other = simulator.with_effects((*simulator.effects, *effects))
        states, actions = X[:, :width], X[:, width:]
        return other.step(states, actions) - simulator.step(states, actions)

    def _host(self) -> HostSimulator:
        if self.simulator is None:
            raise ValueError(
                "NamedEffects has no simulator: use it in a DifferenceModel, or call "
                "for_simulator(simulator) first"
            )
        return self.simulator

    def _words(self, ratio: float, adequate: bool) -> str:
        if not self.effects_:
            return (
                f"no effect found; what the simulator leaves is {ratio:.3g} times what scatters in "
                "these rows without a law"
            )
        spreads = np.sqrt(np.diag(self.covariance_))
        parts = []
        for (place, name), spread in zip(self.numbers_, spreads, strict=True):
            effect = self.effects_[place]
            unit = effect.quantities(self._host())[name].unit
            number = f"{getattr(effect, name):.5g} +- {1.96 * spread:.2g} {unit}"
            parts.append(f"{effect} {name} {number}".removesuffix(" 1"))
        rest = "" if adequate else f"; unexplained: {ratio:.3g} times the noise is left"
        return ", ".join(parts) + rest

    def state_values(self) -> dict[str, Any]:
        """What was learnt beside the arrays, as plain values for a file.

        Raises:
            TypeError: An effect is not of the simulator's library, so that a file could not name
                it without naming code.
        """
        known = {str(effect) for effect in library(self._host())}
        for effect in self.effects_:
            if str(effect) not in known:
                raise TypeError(f"{effect} is not of the library and cannot be saved")
        return {
            "effects": [
                {"effect": str(e), "numbers": {n: float(getattr(e, n)) for n in e.numbers()}}
                for e in self.effects_
            ],
            "numbers": [list(number) for number in self.numbers_],
            "says": self.says_,
        }

    def restore(self, values: Mapping[str, Any], simulator: Simulator) -> None:
        """Take up what ``state_values`` gave, for this simulator.

        Raises:
            ValueError, KeyError: The simulator hosts no such effect.
        """
        self.simulator = self.for_simulator(simulator).simulator
        known = {str(effect): effect for effect in library(self._host())}
        self.effects_ = tuple(
            known[entry["effect"]].with_values(
                **{name: float(value) for name, value in entry["numbers"].items()}
            )
            for entry in values["effects"]
        )
        self.numbers_ = tuple((int(place), str(name)) for place, name in values["numbers"])
        self.says_ = str(values["says"])
        p = len(self.numbers_)
        self.covariance_ = np.asarray(self.covariance_, float).reshape(p, p)
