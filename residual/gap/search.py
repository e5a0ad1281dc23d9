"""From samples to a chosen set of effects: noise, windows and tournament in turns.

Noise and windows are estimated around the best model so far, because both suffer from a large
gap; the tournament then runs again, until nothing changes.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap import noise
from residual.gap.candidates import Candidate
from residual.gap.model import Model
from residual.gap.samples import Samples
from residual.gap.shooting import Fit, fit
from residual.gap.tournament import Arena, Key, Settings, choose, rivals
from residual.gap.windows import Windows, by_growth

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Found:
    """What the search ends with, on all training runs.

    Attributes:
        arena: All training runs; holds the fits of the chosen set, its rivals and the nominal.
        key: The chosen candidates.
        floor: Noise and smooth path around the chosen model.
        nominal_floor: The same around the nominal model.
        history: Chosen sets in the order in which they were accepted.
    """

    arena: Arena
    key: Key
    floor: noise.Floor
    nominal_floor: noise.Floor

    @property
    def fit(self) -> Fit:
        """Fit of the chosen set."""
        return self.arena.tried[self.key]

    @property
    def chosen(self) -> list[Candidate]:
        """The chosen candidates."""
        return [self.arena.candidates[i] for i in self.key]


def survey(
    model: Model, samples: Samples, theta: Array, nodes: Array | None, sigma: Array | None
) -> tuple[noise.Floor, Array]:
    """Noise and smooth path around a model, and the typical variation of the states."""
    if nodes is None:
        nodes = noise.first_path(model, samples, theta)
    if sigma is None:
        sigma = noise.local_noise(samples)
    scale = noise.variation(samples, nodes)
    return noise.estimate(model, samples, nodes, theta, sigma, scale), scale


def search(
    simulator,
    candidates: Sequence[Candidate],
    samples: Samples,
    rng: np.random.Generator,
    settings: Settings,
    longest: int = 25,
    most_runs: int = 6,
    tell: Callable[[str], None] = lambda _: None,
) -> Found:
    """Choose the missing effects from training runs."""
    some = sorted(rng.permutation(len(samples.runs))[:most_runs].tolist())
    part, rows = samples.pick(some)
    nominal_floor, scale = survey(Model(simulator), samples, np.zeros(0), None, None)
    floor, key, theta = nominal_floor, (), np.zeros(0)
    physical = len(simulator.physical_channels)
    for turn in range(3):
        model = Model(simulator, [candidates[i] for i in key])
        windows = by_growth(part, floor.slope.by_state[rows][:, :physical, :physical], scale[:physical], longest)
        arena = Arena(
            simulator, candidates, part, windows, floor.nodes[rows][:, :physical], floor.sigma,
            scale[:physical], settings, tell,
        )  # fmt: skip
        before = key
        key = choose(arena, {key: theta})
        theta = arena.tried[key].theta
        if not key:
            break
        model = Model(simulator, [candidates[i] for i in key])
        fresh, _ = survey(model, samples, theta, None, floor.sigma)
        change = np.abs(np.log(fresh.sigma / floor.sigma)).max()
        floor = fresh
        if key == before and change < 0.05:
            break
        if turn == 0 and change < 0.05 and settled(arena, key):
            break
    found = everything(simulator, candidates, samples, arena, key, floor, scale, settings, longest)
    return Found(found, key, floor, nominal_floor)


def settled(arena: Arena, key: Key) -> bool:
    """Whether the chosen set leaves about the noise."""
    freedom = arena.size - 2 * len(arena.windows)
    return arena.tried[key].costs.sum() / freedom < 1.1


def everything(
    simulator, candidates: Sequence[Candidate], samples: Samples, arena: Arena, key: Key,
    floor: noise.Floor, scale: Array, settings: Settings, longest: int,
) -> Arena:  # fmt: skip
    """Refit nominal, chosen set and near rivals on all training runs."""
    physical = len(simulator.physical_channels)
    windows = by_growth(
        samples, floor.slope.by_state[:, :physical, :physical], scale[:physical], longest
    )
    full = Arena(
        simulator, candidates, samples, windows, floor.nodes[:, :physical], floor.sigma,
        scale[:physical], settings, arena.tell,
    )  # fmt: skip
    sets = {key: [arena.tried[key].theta]} if key else {}
    sets.update({rival: [arena.tried[rival].theta] for rival in rivals(arena, key)})
    full.refit(full.tried[()], sets, most=True)
    return full
