"""NamedEffects: a difference made of named physical effects, found by the gap engine."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from residual.estimator import Array, Estimator
from residual.gap.adequacy import remainder
from residual.gap.arena import Settings
from residual.gap.candidates import candidates
from residual.gap.claims import aliases
from residual.gap.intervals import covariance
from residual.gap.samples import Samples
from residual.gap.search import Found, search
from residual.trajectories import Trajectory
from sims.effects.base import Effect
from sims.effects.library import library, typical
from sims.host import HostSimulator
from sims.simulator import Simulator, wrap

#: Rows that must follow each other before anything is looked for, and the longest piece.
SHORTEST, LONGEST = 12, 50
#: Enough to name an effect, and little enough to be done in seconds on a simulator that steps
#: row by row. Samples of a simulator are exact but for the difference of integrators.
SETTINGS = Settings(
    singles=4, pairs=1, swaps=2, nominal_turns=4, more_turns=4, runs=4, close=1, finest=1e-4
)


class NamedEffects(Estimator):
    """Grey box: the effects that a simulator lacks, by name, and their numbers.

    Rows that follow each other are joined to trajectories, ``residual.gap`` looks for the missing
    effects in them, and a prediction steps the simulator with and without what was found. A few
    dozen consecutive rows with little noise are enough. Noise is estimated from the rows.

    Effects with memory (delay, lag, backlash) are no function of state and action and are left
    out: a difference model cannot hold them.

    Args:
        simulator: The simulator whose difference is learnt, as ``for_simulator`` sets it.
        most_rows: At most so many rows are looked at, in pieces spread over all of them.

    Attributes:
        effects_: The effects found, each with its numbers; empty if there is no gap above noise.
        covariance_: Of their fitted numbers in the order of ``numbers_``, shape (p, p).
        numbers_: (position in ``effects_``, name of the number) for every fitted number.
        residual_: Root mean square of what the effects leave, for each output.
        says_: What was found, in words, and what stays unexplained.
    """

    _learned: ClassVar[tuple[str, ...]] = ("covariance_", "residual_")

    effects_: tuple[Effect, ...]
    numbers_: tuple[tuple[int, str], ...]
    covariance_: Array
    residual_: Array
    says_: str

    def __init__(self, simulator: HostSimulator | None = None, most_rows: int = 400) -> None:
        self.simulator = simulator
        self.most_rows = most_rows

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
        return type(self)(simulator, self.most_rows)

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
        found = look(simulator, runs)
        chosen = self._bound(found)
        left = difference - self._change(X, chosen)
        alone = np.sqrt((difference**2).mean(axis=0))
        self.residual_ = np.sqrt((left**2).mean(axis=0))
        rest = remainder(
            found.fit, found.arena.samples, found.arena.windows, found.arena.sigma, found.floor,
            found.arena.scale,
        )  # fmt: skip
        if chosen and (self.residual_ <= alone).all():
            self.effects_ = chosen
            self.numbers_ = tuple(
                (int(i), knob.field)
                for i, knob in zip(found.fit.model.owner, found.fit.model.knobs, strict=True)
            )
            self.covariance_ = covariance(found.fit, found.arena.windows, found.arena.size)
        else:
            self.residual_ = alone
        self.says_ = self._words(float(rest.ratio.max()), rest.adequate and bool(self.effects_))

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

    def _change(self, X: Array, effects: tuple[Effect, ...]) -> Array:
        """What effects change in the next state, (n, n_s)."""
        simulator = self._host()
        width = len(simulator.state_channels)
        if not effects:
            return np.zeros((len(X), width))
        other = simulator.with_effects((*simulator.effects, *effects))
        states, actions = X[:, :width], X[:, width:]
        return other.step(states, actions) - simulator.step(states, actions)

    def _bound(self, found: Found) -> tuple[Effect, ...]:
        known = len(self._host().effects)
        return found.fit.model.bind(found.fit.theta).effects[known:]

    def _host(self) -> HostSimulator:
        if self.simulator is None:
            raise ValueError(
                "NamedEffects has no simulator: use it in a DifferenceModel, or call "
                "for_simulator(simulator) first"
            )
        return self.simulator

    def _words(self, ratio: float, adequate: bool) -> str:
        if not self.effects_:
            return f"no effect found; the nominal simulator leaves {ratio:.3g} times the noise"
        spreads = np.sqrt(np.diag(self.covariance_))
        parts = []
        for (place, name), spread in zip(self.numbers_, spreads, strict=True):
            effect = self.effects_[place]
            parts.append(f"{effect} {name} {getattr(effect, name):.5g} +- {1.96 * spread:.2g}")
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


def chains(simulator: HostSimulator, X: Array, difference: Array) -> list[Trajectory]:
    """Rows that follow each other, joined: the next state of a row is the state of the next row.

    Args:
        simulator: Predicts the next state.
        X: Rows [states, actions], (n, n_s + n_a).
        difference: Next state less the simulator's, (n, n_s).

    Returns:
        Trajectories of at least ``SHORTEST`` steps, physical channels only, angles unwrapped.
    """
    channels = simulator.physical_channels
    width, physical = len(simulator.state_channels), len(channels)
    states, actions = X[:, :width], X[:, width:]
    following = (simulator.step(states, actions) + difference)[:, :physical]
    gap = following[:-1] - states[1:, :physical]
    for i, channel in enumerate(channels):
        if channel.angle:
            gap[:, i] = wrap(gap[:, i])
    size = np.array([channel.scale for channel in channels])
    # The next state has been through a subtraction and an addition, so some bits are lost.
    joined = (np.abs(gap) <= 1e-9 * (size + np.abs(states[1:, :physical]))).all(axis=1)
    edges = [0, *(np.flatnonzero(~joined) + 1).tolist(), len(X)]
    found = []
    for start, stop in itertools.pairwise(edges):
        if stop - start < SHORTEST:
            continue
        path = np.vstack([states[start:stop, :physical], following[stop - 1 : stop]])
        for i, channel in enumerate(channels):
            if channel.angle:
                path[:, i] = np.unwrap(path[:, i])
        times = simulator.dt * np.arange(len(path), dtype=float)
        found.append(Trajectory(f"row {start}", times, path, actions[start:stop]))
    return found


def pieces(runs: list[Trajectory], most_rows: int) -> list[Trajectory]:
    """Runs cut into pieces of at most ``LONGEST`` steps, spread evenly if there are too many."""
    cut = []
    for run in runs:
        count = max(1, round(len(run) / LONGEST))
        edges = np.linspace(0, len(run), count + 1).astype(int)
        for a, b in itertools.pairwise(edges):
            cut.append(
                Trajectory(run.name, run.times[a : b + 1], run.states[a : b + 1], run.actions[a:b])
            )
    keep = max(1, most_rows // LONGEST)
    if len(cut) <= keep:
        return cut
    chosen: NDArray[np.int64] = np.linspace(0, len(cut) - 1, keep).round().astype(int)
    return [cut[i] for i in chosen]


def look(simulator: HostSimulator, runs: list[Trajectory]) -> Found:
    """Search for missing effects without memory."""
    width = len(simulator.state_channels)
    offered = [
        effect
        for effect in library(simulator)
        if len(_hosting(simulator, effect).state_channels) == width
    ]
    groups, _ = aliases(simulator, offered)
    kept = [e for e in offered if groups.get(str(e), (str(e),))[0] == str(e)]
    samples = Samples.join(runs, simulator.substeps)
    pool = candidates(simulator, kept, samples)
    return search(simulator, pool, samples, np.random.default_rng(0), SETTINGS)


def _hosting(simulator: HostSimulator, effect: Effect) -> HostSimulator:
    return simulator.with_effects((*simulator.effects, typical(effect, simulator)))
