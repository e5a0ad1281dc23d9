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
from residual.gap.adequacy import remainder
from residual.gap.arena import Arena, Key, Settings
from residual.gap.candidates import Candidate
from residual.gap.model import Model
from residual.gap.samples import Samples
from residual.gap.shooting import Fit
from residual.gap.tournament import choose, complete, rivals
from residual.gap.windows import by_growth
from sims.host import HostSimulator

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Found:
    """What the search ends with, on all training runs.

    Attributes:
        arena: All training runs; holds the fits of the chosen set, its rivals and the nominal.
        trial: The runs of the tournament; holds all rivals that were tried.
        key: The chosen candidates.
        floor: Noise and smooth path around the chosen model.
        nominal_floor: The same around the nominal model.
    """

    arena: Arena
    trial: Arena
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
    model: Model, samples: Samples, theta: Array, sigma: Array | None, finest: float
) -> tuple[noise.Floor, Array]:
    """Noise and smooth path around a model, and the typical variation of the states."""
    nodes = noise.first_path(model, samples, theta)
    if sigma is None:
        sigma = noise.local_noise(samples)
    scale = noise.variation(samples, nodes)
    floor = noise.estimate(model, samples, nodes, theta, sigma, scale)
    least = finest * scale[samples.measured]
    return dataclasses.replace(floor, sigma=np.maximum(floor.sigma, least)), scale


def search(
    simulator: HostSimulator,
    candidates: Sequence[Candidate],
    samples: Samples,
    rng: np.random.Generator,
    settings: Settings,
    longest: int = 25,
    tell: Callable[[str], None] = lambda _: None,
) -> Found:
    """Choose the missing effects from training runs.

    Args:
        simulator: The nominal simulator.
        candidates: What may be missing.
        samples: The training runs.
        rng: Chooses the runs that the tournament sees.
        settings: How hard to search.
        longest: Longest window in samples.
        tell: Progress.
    """
    some = sorted(rng.permutation(len(samples.runs))[: settings.runs].tolist())
    part, rows = samples.pick(some)
    nominal_floor, scale = survey(Model(simulator), samples, np.zeros(0), None, settings.finest)
    physical = len(simulator.physical_channels)
    scale = scale[:physical]
    floor, theta = nominal_floor, np.zeros(0)
    key: Key = ()

    def arena(table: Samples, index: NDArray[np.int64]) -> Arena:
        nodes = floor.nodes[index][:, :physical]
        by_state = floor.slope.by_state[index][:, :physical, :physical]
        windows = by_growth(table, by_state, scale, longest)
        return Arena(
            simulator, candidates, table, windows, nodes, by_state, floor.sigma, scale, settings,
            tell,
        )  # fmt: skip

    for turn in range(3):
        trial = arena(part, rows)
        before = key
        key = choose(trial, {key: theta})
        theta = trial.tried[key].theta
        if key:
            model = Model(simulator, [candidates[i] for i in key])
            floor, _ = survey(model, samples, theta, floor.sigma, settings.finest)
        full = arena(samples, np.arange(len(samples)))
        sets = {key: [theta]} if key else {}
        sets.update({rival: [trial.tried[rival].theta] for rival in rivals(trial, key)})
        full.refit(full.tried[()], sets, most=True)
        full.threshold, full.noise_gain = trial.threshold, trial.noise_gain
        # All runs may prefer a rival that came close on those of the tournament.
        key = min(sets, key=full.score, default=key)
        left = remainder(full.tried[key], samples, full.windows, floor.sigma, floor, scale)
        if left.adequate or (turn and key == before) or turn == 2:
            break
        if not key:
            break
        theta = full.tried[key].theta
    completed = complete(full, key)
    if completed != key:
        key = completed
        model = Model(simulator, [candidates[i] for i in key])
        floor, _ = survey(model, samples, full.tried[key].theta, floor.sigma, settings.finest)
    return Found(full, trial, key, floor, nominal_floor)
