"""Numerics before physics: thinning of fast logs, sub-steps, and how inputs run between samples.

An integration error or a wrong hold is as systematic as a missing effect and would be given its
name, so both are settled on the nominal simulator.
"""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting import Fit
from residual.gap.model import Model
from residual.gap.samples import Samples
from residual.gap.search import Key, Search
from residual.trajectories import Trajectory
from sims.host import HostSimulator
from sims.simulator import Hold

Array = NDArray[np.float64]

#: Part of the misfit that the other hold must take off to be believed.
CLEARER = 0.05
#: Rows in a forecast horizon that are enough to follow the motion.
ROWS = 24
#: Sub-steps of a corrected simulator, at most, over the nominal one's.
FINEST = 32
#: Error of one interval by too few sub-steps, as a share of what counts; those of a window add up.
FINE = 0.01


def stride_for(trajectories: Sequence[Trajectory], horizon: float) -> int:
    """Recorded samples in an interval, so that a horizon has about ``ROWS`` rows."""
    step = float(np.median(np.concatenate([t.durations for t in trajectories])))
    wanted = max(1, int(horizon / ROWS / step + 1e-9))
    # Powers of two, so that an interval has whole sub-steps of recorded ones.
    return 2 ** int(np.log2(wanted))


def own_substeps(simulator: HostSimulator, trajectories: Sequence[Trajectory], stride: int) -> int:
    """Sub-steps of an interval that are as fine as the simulator's own."""
    longest = stride * max(float(np.quantile(t.durations, 0.95)) for t in trajectories)
    own = max(1, int(np.ceil(simulator.substeps * longest / simulator.dt - 1e-6)))
    return own if stride == 1 else min(_power(own), stride)


def enough_substeps(
    simulator: HostSimulator, samples: Samples, nodes: Array, sigma: Array, most: int
) -> int:
    """As few sub-steps as change nothing that could be seen, at most ``most``.

    The simulator is advanced from rows of the table with so many sub-steps and twice as
    many; the worst twentieth of the rows decides.

    Args:
        simulator: The nominal simulator, or with what was found.
        samples: The table.
        nodes: States at its rows, (n, n_s).
        sigma: Error of every measured channel that counts one, (m,).
        most: The simulator's own.
    """
    if not simulator.advances_rows_at_once:
        return most
    model = Model(simulator)
    rows = np.unique(np.linspace(0, len(samples) - 1, min(len(samples), 400)).astype(int))
    states = nodes[rows][None, :, : model.physical]

    def after(count: int) -> Array:
        table = dataclasses.replace(samples, substeps=count)
        return Model(simulator).advance(table, states, np.zeros((1, 0)), rows)[0]

    count, coarse = 1, after(1)
    while count < most:
        fine = after(min(2 * count, most))
        change = np.abs(fine - coarse)[:, samples.measured]
        if (np.quantile(change, 0.95, axis=0) <= FINE * sigma).all():
            return count
        count, coarse = min(2 * count, most), fine
    return most


def with_enough_substeps(corrected: HostSimulator, search: Search, key: Key) -> HostSimulator:
    """A corrected simulator with so many sub-steps that it moves as with twice as many.

    What was found may be faster than anything in the nominal simulator: a time constant of a
    quarter of the nominal one is unstable where that was fine. The step of a model that came from
    a file of its own, and of one that strikes the ground, is its author's.

    Args:
        corrected: With effects whose values are numbers.
        search: With the set that it is made of.
        key: That set.
    """
    own = not corrected.has_contacts and not corrected.own_files()
    if not (own and key and corrected.advances_rows_at_once):
        return corrected
    samples, fitter = search.fitter.samples, search.fitter
    rows = np.unique(np.linspace(0, len(samples) - 1, min(len(samples), 400)).astype(int))
    physical = len(corrected.physical_channels)
    actions = samples.actions[rows]
    states = corrected.augment(search.tried[key].inner.nodes[rows][:, :physical], actions)

    def after(simulator: HostSimulator) -> Array:
        return simulator.step(states, actions)[:, samples.measured]

    now, coarse = corrected, after(corrected)
    while now.substeps < FINEST * corrected.substeps:
        finer = copy.copy(now)
        finer.substeps = 2 * now.substeps
        fine = after(finer)
        if (np.quantile(np.abs(fine - coarse), 0.95, axis=0) <= FINE * fitter.sigma).all():
            break
        now, coarse = finer, fine
    return now


def held_as(simulator: HostSimulator, hold: Hold | Mapping[str, Hold] | None) -> HostSimulator:
    """The simulator with its inputs held as given, or as its channels say."""
    if hold is None:
        return simulator
    names = [channel.name for channel in simulator.action_channels]
    return simulator.with_hold(hold if isinstance(hold, Mapping) else dict.fromkeys(names, hold))


def held_otherwise(simulator: HostSimulator) -> HostSimulator | None:
    """The simulator with all inputs held the other way; None if that is no question."""
    if not simulator.action_channels or simulator.has_contacts:
        return None
    return simulator.with_hold(
        {c.name: "zero" if c.hold == "linear" else "linear" for c in simulator.action_channels}
    )


def how_held(simulator: HostSimulator) -> str:
    """How the inputs run between samples, in words."""
    if simulator.action_channels[0].hold == "linear":
        return "run straight from sample to sample"
    return "be held between samples"


def fits_better(search: Search, key: Key, other: HostSimulator) -> bool:
    """Whether the chosen set fits clearly better on a simulator with inputs held otherwise."""
    fitter, fit = search.fitter, search.tried[key]
    again = fitter.fit(Model(other, fit.model.chosen), fit.theta)
    gained = fit.merit - again.merit
    return gained > max(CLEARER * fit.merit, fitter.tie(search.tried[()]))


def forecast_error(search: Search, key: Key) -> float:
    """Cross-validated forecast error in units of the spread of each channel, all averaged."""
    samples = search.fitter.samples
    spread = np.nanvar(samples.seen[:, samples.measured], axis=0)
    return float(np.nanmean(search.validated[key].squares / np.maximum(spread, 1e-300)))


def at_half_step(search: Search, key: Key) -> Fit:
    """A set fitted at half the integration step."""
    if key not in search.halved:
        fit = search.tried[key]
        search.halved[key] = search.fitter.halved().fit(fit.model, fit.theta, fit)
    return search.halved[key]


def other_numerics(search: Search, key: Key, tie: float) -> list[Array]:
    """Numbers of a set fitted at half the step, and with inputs held the other way, each (p,).

    Where the data say clearly how inputs are held, the other hold is no question.

    Args:
        search: With the fitted set.
        key: The set.
        tie: Rise of the loss beyond which the other hold is out.
    """
    fitter, fit = search.fitter, search.tried[key]
    found = [at_half_step(search, key).theta]
    flipped = held_otherwise(search.simulator)
    if flipped is not None:
        other = fitter.fit(Model(flipped, fit.model.chosen), fit.theta)
        if other.merit - fit.merit < tie:
            found.append(other.theta)
    return found


def _power(count: int) -> int:
    """The smallest power of two that is not smaller."""
    return 2 ** int(np.ceil(np.log2(count)))
