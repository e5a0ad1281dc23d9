"""Effects from rows of transitions: exact states, every channel known, often without an end.

The rows are what a difference model learns from, so here nothing is held out and nothing is
told in words: the effects, their numbers and how well they are known.
"""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
from numpy.typing import NDArray

from residual.gap.adequacy import remainder
from residual.gap.arena import Settings
from residual.gap.candidates import Candidate, candidates
from residual.gap.claims import aliases
from residual.gap.contact.claims import bootstrap
from residual.gap.contact.noise import with_noise
from residual.gap.contact.search import Rules
from residual.gap.contact.windows import lay_out, scales, some
from residual.gap.contact.windows import pieces as windows_of
from residual.gap.contact.workflow import MEASURED_ON, NAMED_ON, name, prove, simple
from residual.gap.intervals import covariance
from residual.gap.model import Model
from residual.gap.samples import Samples
from residual.gap.search import search
from residual.trajectories import Trajectory
from sims.effects.base import Effect
from sims.effects.library import library, typical
from sims.host import HostSimulator
from sims.simulator import Array, wrap

#: Rows that must follow each other before anything is looked for, and the longest piece.
SHORTEST, LONGEST = 12, 50
#: Enough to name an effect, and little enough to be done in seconds on a simulator that steps
#: row by row. Samples of a simulator are exact but for the difference of integrators.
SETTINGS = Settings(
    singles=4, pairs=1, swaps=2, nominal_turns=4, more_turns=4, runs=4, close=1, finest=1e-4
)


@dataclasses.dataclass(frozen=True)
class Named:
    """Effects found in rows.

    Attributes:
        effects: The effects with their numbers; empty if there is no gap above noise.
        numbers: (position in ``effects``, name of the number) for every fitted number.
        covariance: Of the fitted numbers, (p, p).
        ratio: Largest residual of a channel over its noise.
        adequate: Whether no more than noise is left.
    """

    effects: tuple[Effect, ...]
    numbers: tuple[tuple[int, str], ...]
    covariance: Array
    ratio: float
    adequate: bool


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


def look(simulator: HostSimulator, runs: list[Trajectory]) -> Named:
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
    if simulator.has_contacts:
        return _look_at_walks(simulator, samples, pool)
    found = search(simulator, pool, samples, np.random.default_rng(0), SETTINGS)
    arena = found.arena
    rest = remainder(found.fit, arena.samples, arena.windows, arena.sigma, found.floor, arena.scale)
    effects, numbers = _bound(found.fit.model, found.fit.theta)
    spread = np.zeros((0, 0))
    if numbers:
        spread = covariance(found.fit, arena.windows, arena.size)
    return Named(effects, numbers, spread, float(rest.ratio.max()), rest.adequate)


def _look_at_walks(simulator: HostSimulator, samples: Samples, pool: list[Candidate]) -> Named:
    """The same where impacts set windows apart, see ``residual.gap.contact``."""
    cut = windows_of(samples)
    search, key = name(simulator, samples, some(cut, NAMED_ON), simple(pool), Rules(), _quiet)
    whole = lay_out(simulator, samples, some(cut, MEASURED_ON))
    whole = with_noise(whole, search.shots.sigma, scales(simulator))
    key, full = prove(search, key, whole, _quiet)
    spread = bootstrap(full, whole, np.random.default_rng(0))
    effects, numbers = _bound(full.model, full.theta)
    # The noise is estimated from the windows themselves, so that nothing is ever left of it.
    return Named(effects, numbers, np.diag(spread**2), 1.0, True)


def _bound(model: Model, theta: Array) -> tuple[tuple[Effect, ...], tuple[tuple[int, str], ...]]:
    """Effects of a fit, and whose each number is."""
    known = len(model.simulator.effects)
    numbers = zip(model.owner, model.knobs, strict=True)
    return model.bind(theta).effects[known:], tuple((int(i), knob.field) for i, knob in numbers)


def _quiet(_: str) -> None:
    """Progress that nobody asked for."""


def _hosting(simulator: HostSimulator, effect: Effect) -> HostSimulator:
    return simulator.with_effects((*simulator.effects, typical(effect, simulator)))
