"""A simulator with chosen effects as a function of samples, states and a vector of unknowns."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from residual.gap.data.samples import Samples
from residual.gap.model.candidates import Candidate, Knob
from residual.gap.model.workers import integrate
from sims.effects.actuator import ActuatorEffect
from sims.effects.backlash import Backlash
from sims.effects.base import Effect
from sims.effects.store import SecondStore, stores
from sims.host import HostSimulator

Array = NDArray[np.float64]


class Model:
    """A simulator, the effects it is given, and their numbers as one vector of unknowns.

    Args:
        simulator: Hosts the effects.
        chosen: The candidates at work, in the order in which their numbers are listed.

    Attributes:
        knobs: One for each unknown, with its bounds and step.
        owner: Which candidate each unknown belongs to, (p,).
        physical: Number of physical state channels, the first columns of a state.
        width: Number of state columns: physical, then each play of a backlash, or store.
        free: Columns whose start value is free in every window.
        batched: Whether the simulator advances all rows at once, each with its own numbers.
    """

    def __init__(self, simulator: HostSimulator, chosen: Sequence[Candidate] = ()) -> None:
        self.simulator = simulator
        self.chosen = tuple(chosen)
        self.knobs = tuple(knob for candidate in self.chosen for knob in self._numbers(candidate))
        self.owner = np.array([i for i, c in enumerate(self.chosen) for _ in c.knobs], int)
        self.low = np.array([knob.low for knob in self.knobs])
        self.high = np.array([knob.high for knob in self.knobs])
        self.step = np.array([knob.step for knob in self.knobs])
        self.known = np.array([knob.known for knob in self.knobs])
        memories = sum(isinstance(c.effect, Backlash | SecondStore) for c in self.chosen)
        self.physical = len(simulator.physical_channels)
        self.width = len(simulator.integrated_channels) + memories
        self.free = list(range(self.physical))
        self.batched = simulator.advances_rows_at_once
        enters = [c.effect.enters for c in self.chosen]
        self._actuator = np.array(
            [enters[i] == "actuator" and not isinstance(self.chosen[i].effect, Backlash)
             for i in self.owner], bool,
        )  # fmt: skip
        self.has_sensor = "sensor" in enters + [effect.enters for effect in simulator.effects]
        # The samples are kept with their inputs, so that an identity is never reused.
        self._drives: dict[bytes, tuple[Samples, Array]] = {}

    def __len__(self) -> int:
        return len(self.knobs)

    def _numbers(self, candidate: Candidate) -> tuple[Knob, ...]:
        """Numbers of one of the candidates.

        A saturation cuts what comes out of a gain: beside one, its level is not among commands.
        """
        effect = candidate.effect
        if not (candidate.fixed_level and isinstance(effect, ActuatorEffect)):
            return candidate.knobs
        gains = [c.effect for c in self.chosen if c.effect.drives]
        if not any(isinstance(g, ActuatorEffect) and effect.meets(g) for g in gains):
            return candidate.knobs
        return tuple(dataclasses.replace(knob, high=np.inf) for knob in candidate.knobs)

    def room(self, theta: Array) -> tuple[Array, Array]:
        """How far each unknown may go down and up at once, each (p,): within its bounds, and no
        further than a slope is believed."""
        leap = 10 * self.step + np.abs(theta)
        return np.maximum(self.low - theta, -leap), np.minimum(self.high - theta, leap)

    def bind(self, theta: Array, each: int = 1) -> HostSimulator:
        """The simulator with its own effects and these.

        Args:
            theta: Unknowns, (p,), or (V, p) to serve a batch of V times ``each`` rows.
            each: Rows for each vector of unknowns.
        """
        effects = []
        for i, candidate in enumerate(self.chosen):
            own = self.owner == i
            if theta.ndim == 1:
                effects.append(candidate.bind([float(value) for value in theta[own]]))
            else:
                effects.append(candidate.bind([np.repeat(v, each) for v in theta[:, own].T]))
        return self.simulator.with_effects((*self.simulator.effects, *effects))

    def widen(self, samples: Samples, states: Array, theta: Array) -> Array:
        """Physical states (n, n_physical) with the play of each backlash appended.

        A play is a share of half its width, from -1 to 1: a closed one stays closed whatever
        width is tried.
        """
        if self.width == self.physical:
            return states
        host = self.bind(theta)
        full = np.zeros((len(states), self.width))
        full[:, : self.physical] = states
        filled = self._stores(host.effects[len(self.simulator.effects) :])
        for i, store in enumerate(filled):
            column = full[:, self._place(store)]
            full[:, self.physical + i] = _following(samples, column, float(store.time))
        if filled:
            return full
        if len(host.integrated_channels) == self.width:
            # The play lies where the input before the sample has pushed it.
            before = np.vstack([samples.actions[:1], samples.actions[:-1]])
            for (start, _), recorded in zip(samples.runs, samples.recorded, strict=True):
                before[start] = recorded.first
            pushed = host.augment(states, before)[:, self.physical : self.width]
            full[:, self.physical :] = pushed / _halves(host, 1)
        return full

    def scales(self, physical: Array) -> Array:
        """Typical variation of every state column, from that of the physical ones."""
        chosen = [candidate.effect for candidate in self.chosen]
        plays = [0.1 for e in (*self.simulator.plays(), *chosen) if isinstance(e, Backlash)]
        filled = [physical[self._place(store)] for store in self._stores(chosen)]
        return np.concatenate([physical, plays, filled])

    def _stores(self, chosen: Sequence[Effect]) -> list[SecondStore]:
        """The stores with columns of their own, in their order; those that are chosen have them
        at zero strength, too."""
        return [*stores(self.simulator), *(e for e in chosen if isinstance(e, SecondStore))]

    def _place(self, store: SecondStore) -> int:
        names = [channel.name for channel in self.simulator.physical_channels]
        return names.index(store.joint)

    def inputs(self, samples: Samples, theta: Array) -> Array:
        """Mean and rise of the input in every sub-step, (V, n, substeps, n_a, 2).

        V is 1 if the actuator path is the same for all rows of ``theta``.
        """
        if not self._actuator.any():
            theta = theta[:1]
        key = theta[:, self._actuator].tobytes() + np.array([id(samples), len(theta)]).tobytes()
        if key not in self._drives:
            if len(self._drives) > 4:
                self._drives.clear()
            commands = samples.commands
            driven = self.bind(theta).drive(
                commands.actions, commands.durations, samples.recorded_substeps, rises=True,
                begins=commands.begins,
            )  # fmt: skip
            driven = samples.in_intervals(driven if driven.ndim == 5 else driven[None])
            self._drives[key] = (samples, driven)
        return self._drives[key][1]

    def advance(
        self,
        samples: Samples,
        states: Array,
        theta: Array,
        rows: NDArray[np.int64] | None = None,
    ) -> Array:
        """One sample interval from every state.

        Args:
            samples: Gives inputs and durations.
            states: shape (V, n, n_s), a state at every sample, or at those of ``rows``.
            theta: shape (V, p).
            rows: Samples that the states belong to, if not all.

        Returns:
            States at the next sample, shape (V, n, n_s).
        """
        variants, n, width = states.shape
        theta = np.asarray(theta, float)
        distinct, which = np.unique(theta[:, self._actuator], axis=0, return_inverse=True)
        if len(distinct) < variants:
            first = [int(np.flatnonzero(which == i)[0]) for i in range(len(distinct))]
            driven = self.inputs(samples, theta[first])
            driven = driven[which] if len(driven) > 1 else np.repeat(driven, variants, axis=0)
        else:
            driven = self.inputs(samples, theta)
            driven = np.broadcast_to(driven, (variants, *driven.shape[1:]))
        durations = samples.durations
        if rows is not None:
            driven, durations = driven[:, rows], durations[rows]
        if not self.batched:
            return np.stack(
                [self._rowwise(*v, durations) for v in zip(states, driven, theta, strict=True)]
            )
        after = self._integrate(
            self.bind(theta, each=n),
            states.reshape(variants * n, width),
            driven.reshape(variants * n, *driven.shape[2:]),
            np.tile(durations, variants),
        )
        return after.reshape(variants, n, width)

    def _rowwise(self, states: Array, driven: Array, theta: Array, durations: Array) -> Array:
        """One interval with the same numbers in all rows, which spares a bind for each row."""
        return self._integrate(self.bind(theta), states, driven, durations)

    def _integrate(
        self, host: HostSimulator, states: Array, driven: Array, durations: Array
    ) -> Array:
        own = len(host.integrated_channels)
        after = np.array(states)
        if own == self.physical:
            after[:, :own] = integrate(host, after[:, :own], driven, durations)
            return after
        halves = _halves(host, len(states))
        after[:, self.physical : own] *= halves
        after[:, :own] = integrate(host, after[:, :own], driven, durations)
        after[:, self.physical : own] /= halves
        return after

    def sense(self, states: Array, theta: Array) -> Array:
        """What the sensors show of states (V, n, n_s) under unknowns (V, p)."""
        if not self.has_sensor:
            return states
        variants, n, width = states.shape
        host = self.bind(theta, each=n)
        return host.sense(np.array(states).reshape(variants * n, width)).reshape(states.shape)

    def roll(
        self, samples: Samples, rows: NDArray[np.int64], states: Array, steps: int, theta: Array,
        which: NDArray[np.int64] | None = None,
    ) -> Array:  # fmt: skip
        """Open loop from states (k, width) at some rows, shape (k, steps + 1, width).

        Args:
            samples: Gives inputs and durations.
            rows: Where each starts, (k,).
            states: Where from.
            steps: Intervals.
            theta: Unknowns, (p,), or several vectors of them, (V, p).
            which: Which of the vectors each row has, (k,).
        """
        thetas = np.atleast_2d(theta)
        if which is None or len(thetas) == 1 or not len(self):
            thetas, which = thetas[:1], np.zeros(len(rows), np.int64)
            host = self.bind(thetas[0])
        else:
            host = self.bind(thetas[which])
        driven = self.inputs(samples, thetas)
        if len(driven) == 1:
            which = np.zeros(len(rows), np.int64)
        path = np.repeat(states[:, None], steps + 1, axis=1)
        for k in range(steps):
            at = np.minimum(rows + k, len(samples) - 1)
            path[:, k + 1] = self._integrate(
                host, path[:, k], driven[which, at], samples.durations[at]
            )
        return path


def _halves(host: HostSimulator, rows: int) -> Array:
    """Half the width of every play, (rows, n_plays); 1 in rows without play, and of stores."""
    widths = [np.broadcast_to(play.width, rows) for play in host.plays()]
    widths += [np.full(rows, 2.0) for _ in stores(host)]
    return np.stack([np.where(width > 0, 0.5 * width, 1.0) for width in widths], axis=1)


def _following(samples: Samples, column: Array, time: float) -> Array:
    """What a store holds that follows a state (n,), in every run first in balance with it."""
    found = np.empty_like(column)
    for start, stop in samples.runs:
        away = column[start:stop] - column[start]
        step = float(np.median(np.diff(samples.times[start:stop]))) if stop - start > 1 else 0.0
        kept = np.exp(-step / time)
        found[start:stop] = column[start] + lfilter([0.0, 1.0 - kept], [1.0, -kept], away)
    return found
