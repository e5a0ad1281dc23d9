"""Effects from rows of transitions: exact states, every channel known, often without an end.

The rows are what a difference model learns from, so here nothing is held out and nothing is
told in words: the effects, their numbers and how well they are known.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.angles import with_whole_turns
from residual.gap.confirmation.aliases import aliases, representatives
from residual.gap.fitting.intervals import deviations
from residual.gap.model.candidates import candidates, one_way
from residual.gap.preparation.prepare import prepare
from residual.gap.search.explain import Explanation, explain
from residual.gap.search.pool import Key
from residual.gap.search.significance import pruned
from residual.trajectories import Trajectory
from sims.effects.base import Effect
from sims.effects.library import library, typical
from sims.host import HostSimulator
from sims.simulator import Array, wrap

#: Rows that must follow each other before anything is looked for, and the longest piece.
SHORTEST, LONGEST = 8, 50
#: Sets of effects that are fitted, and of a system that strikes the ground, where each takes
#: seconds.
SETS, SETS_AT_IMPACTS = 300, 60
#: Control periods that forecasts last; of exact states that strike the ground one says more.
HORIZON = 9


@dataclasses.dataclass(frozen=True)
class Named:
    """Effects found in rows.

    Attributes:
        effects: The effects with their numbers; empty if there is no gap above noise.
        numbers: (position in ``effects``, name of the number) for every fitted number.
        covariance: Of the fitted numbers, (p, p).
        ratio: Largest residual of a channel over its noise.
        adequate: Whether no more than noise is left.
        as_good: Other sets of effects, by label, that explain the rows as well with no more
            numbers.
    """

    effects: tuple[Effect, ...]
    numbers: tuple[tuple[int, str], ...]
    covariance: Array
    ratio: float
    adequate: bool
    as_good: tuple[tuple[str, ...], ...] = ()


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
        times = simulator.dt * np.arange(len(path), dtype=float)
        path = with_whole_turns(path, times, channels)
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


def look(simulator: HostSimulator, runs: list[Trajectory], exact: bool = True) -> Named:
    """Search for missing effects without memory; ``exact``: states are known to the last digit."""
    width = len(simulator.state_channels)
    offered = [
        effect
        for effect in library(simulator)
        if len(_hosting(simulator, effect).state_channels) == width
    ]
    groups, sets = aliases(simulator, offered)
    kept, less = representatives(simulator, offered, groups)
    alone = exact and simulator.has_contacts
    periods = 1 if alone else HORIZON
    prepared = prepare(simulator, runs, periods * simulator.dt, exact)
    # By number and not by time, so that the same rows have the same answer on every machine.
    most = SETS_AT_IMPACTS if simulator.has_contacts else SETS
    effort = dataclasses.replace(prepared.effort, tried=most, parameters=alone)
    samples = prepared.fitter.samples
    away = one_way(simulator, less, samples)
    pool = prepared.pool([*candidates(simulator, kept, samples), *away])
    found = explain(
        simulator, pool, prepared.fitter, prepared.floor, prepared.weigh, effort, _quiet, np.inf,
    )  # fmt: skip
    key = _in_fewer(found, sets)
    fit = found.search.tried[key]
    numbers = zip(fit.model.owner, fit.model.knobs, strict=True)
    spread = deviations(fit, found.search.fitter.blocks)
    left = found.search.fitter.left(fit, found.floor)
    return Named(
        fit.model.added(fit.theta),
        tuple((int(i), knob.field) for i, knob in numbers),
        np.diag(spread**2),
        left.ratio,
        left.adequate,
        tuple(_as_good(found, key, groups)),
    )


def _as_good(
    found: Explanation, key: Key, groups: Mapping[str, Sequence[str]]
) -> Iterator[tuple[str, ...]]:
    """Other sets that explain the rows as well as the chosen one does, by label.

    Args:
        found: With all that was tried.
        key: The chosen set.
        groups: Labels of exact twins, by label.
    """
    search = found.search
    labels = [candidate.label for candidate in search.candidates]
    for n in key:
        rest = tuple(labels[i] for i in key if i != n)
        yield from (
            (*rest, twin) for twin in groups.get(labels[n], ())
            if twin != labels[n] and labels[n] in groups.get(twin, ())
        )  # fmt: skip
    if not (found.adequate and key):
        return
    most = search.tried[key].merit + found.needed
    for other in search.tried:
        wider = set(key) <= set(other) or search.numbers(other) > search.numbers(key)
        if not wider and search.sound(other) and search.tried[other].merit <= most:
            yield tuple(labels[i] for i in other)


def _in_fewer(found: Explanation, sets: Sequence[tuple[str, ...]]) -> Key:
    """The chosen set, or one in which one effect does the work of several.

    Of effects that depend on each other exactly, such as resistance, supply and friction of a
    motor, others in one proportion do what one does, and fit no worse. Of what strikes the ground a
    search may come to those first.

    Args:
        found: The choice, of a search in which nothing more than chance is named.
        sets: Labels of effects of which each is made of the others.
    """
    search, key = found.search, found.key
    if not (found.adequate and key):
        return key
    labels = [candidate.label for candidate in search.candidates]
    best = key
    for one in sets:
        inside = [n for n in key if labels[n] in one]
        missing = [labels.index(name) for name in one if name in labels]
        missing = [n for n in missing if n not in key]
        if len(missing) != 1 or len(inside) + 1 < len(one):
            continue
        start = 0.01 * search.candidates[missing[0]].trials[0].values[0]
        fresh, theta = search.merged(key, [(missing[0], start)], drop=tuple(inside))
        search.add({fresh: theta})
        behind = search.tried[fresh].merit - search.tried[key].merit
        if search.sound(fresh) and behind < found.needed:
            best = min(best, fresh, key=lambda k: (search.numbers(k), search.tried[k].merit))
    return pruned(search, best, found.needed) if best != key else key


def _quiet(_: str) -> None:
    """Progress that nobody asked for."""


def _hosting(simulator: HostSimulator, effect: Effect) -> HostSimulator:
    return simulator.with_effects((*simulator.effects, typical(effect, simulator)))
