"""A simulator with chosen effects as a function of samples, states and a vector of unknowns."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples
from residual.gap.model.candidates import Candidate, Knob
from residual.gap.model.memory import Memory, half_plays
from residual.gap.model.workers import integrate
from sims.effects.actuator import ActuatorEffect
from sims.effects.backlash import Backlash
from sims.effects.base import Effect
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
        width: Number of state columns: physical, then of plays, stores and flexible parts.
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
        self.physical = len(simulator.physical_channels)
        self._memory = Memory(simulator, [c.effect for c in self.chosen])
        self.width = self._memory.width
        self.free = [*range(self.physical), *self._memory.swinging]
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
        return self.simulator.with_effects((*self.simulator.effects, *self.added(theta, each)))

    def added(self, theta: Array, each: int = 1) -> tuple[Effect, ...]:
        """The effects beside the simulator's own, as they were chosen; arguments as of ``bind``."""
        effects = []
        for i, candidate in enumerate(self.chosen):
            own = self.owner == i
            if theta.ndim == 1:
                effects.append(candidate.bind([float(value) for value in theta[own]]))
            else:
                effects.append(candidate.bind([np.repeat(v, each) for v in theta[:, own].T]))
        return tuple(effects)

    def widen(self, samples: Samples, states: Array, theta: Array, without: bool = False) -> Array:
        """Physical states (n, n_physical) with the memory of effects appended that moves with them.

        A play is a share of half its width, from -1 to 1: a closed one stays closed whatever
        width is tried. What follows the states is where it goes as they are, or, if that is a
        motion ``without`` it, as it would change them.
        """
        if self.width == self.physical:
            return states
        return self._memory.beside(self.bind(theta), samples, states, without)

    def scales(self, physical: Array) -> Array:
        """Typical variation of every state column, from that of the physical ones."""
        return self._memory.scales(physical)

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
        after = np.array(states)
        if len(host.integrated_channels) == self.physical:
            own = slice(self.physical)
            after[:, own] = integrate(host, after[:, own], driven, durations)
            return after
        columns, halves = self._memory.of(host), half_plays(host, len(states))
        inside = after[:, columns]
        inside[:, self.physical :] *= halves
        inside = integrate(host, inside, driven, durations)
        inside[:, self.physical :] /= halves
        after[:, columns] = inside
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
