"""Whether a simulator can be run on recorded states at all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.inspection import refusal
from residual.logs.checks import Finding
from residual.trajectories import Trajectory, moment
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Ranges of a channel by which half the step makes a control period end elsewhere, where the
#: integration runs away, and where it is settled; times its own sub-steps that are tried.
RUNS_AWAY, SETTLED, FINEST = 1.0, 0.01, 4096


def nominal(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """A simulator that breaks down on recorded states."""
    for run in trajectories:
        states = filled(simulator, run)
        if states is None:
            continue
        rows = np.unique(np.linspace(0, len(run) - 1, 500).astype(int))
        whole = np.isfinite(states[rows]).all(axis=1)
        rows = rows[whole]
        if not len(rows):
            continue
        actions = run.actions[rows]
        with np.errstate(all="ignore"):
            after = simulator.step(simulator.augment(states[rows], actions), actions)
        bad = np.flatnonzero(~np.isfinite(after).all(axis=1))
        if bad.size:
            row = int(rows[bad[0]])
            channel = simulator.state_channels[int(np.flatnonzero(~np.isfinite(after[bad[0]]))[0])]
            value = after[bad[0]][~np.isfinite(after[bad[0]])][0]
            zero = [n for n, p in simulator.parameters.items() if not np.all(p.value)]
            perhaps = f" (its {' and '.join(zero)} is 0)" if zero else ""
            says = (
                f"{simulator.name}{perhaps} returns {value} for "
                f"{channel.name} from the state recorded at {moment(run.times[row])} "
                f"({_listed(simulator, states[row])}): mend the simulator, or cut these rows"
            )
            return [refusal("nominal", run.name, says)]
        if says := _too_coarse(simulator, states[rows], actions):
            return [refusal("nominal", run.name, says)]
    return []


def _too_coarse(simulator: HostSimulator, states: Array, actions: Array) -> str:
    """What to do about a simulator whose own steps are so long that its integration runs away."""
    if not simulator.advances_rows_at_once or simulator.effects:
        return ""
    ranges = np.ptp(states, axis=0)
    usual = np.where(ranges > 0, ranges, np.inf)  # what stands still tells of no size
    durations = np.full(len(states), simulator.dt)

    def after(substeps: int) -> Array:
        with np.errstate(all="ignore"):
            return simulator.integrate(
                states, np.repeat(actions[:, None], substeps, axis=1), durations
            )

    def apart(one: Array, other: Array) -> Array:
        with np.errstate(all="ignore"):
            return np.median(np.abs(one - other)[:, : len(usual)], axis=0) / usual

    own = count = simulator.substeps
    coarse, fine = after(own), after(2 * own)
    astray = apart(coarse, fine)
    column = int(np.argmax(astray))
    if not RUNS_AWAY < astray[column] < np.inf:
        return ""
    while not apart(coarse, fine)[column] < SETTLED and count < FINEST * own:
        count, coarse, fine = 2 * count, fine, after(4 * count)
    return (
        f"the integration of {simulator.name} runs away: its steps of {simulator.dt / own:.3g} s "
        f"(dt / substeps) are too long for it, with half of them "
        f"{simulator.physical_channels[column].name} differs by {astray[column]:.3g} times what it "
        f"does in the log. Set substeps = {count} in its class, or a shorter dt"
    )


def _listed(simulator: HostSimulator, state: Array) -> str:
    return ", ".join(
        f"{c.name} {value:.4g}" for c, value in zip(simulator.physical_channels, state, strict=True)
    )


def filled(simulator: HostSimulator, run: Trajectory) -> Array | None:
    """Physical states of a run, rates that were not measured from their positions."""
    channels = simulator.physical_channels
    names = [channel.name for channel in channels]
    states = np.array(run.states[:, : len(channels)])
    for column, channel in enumerate(channels):
        if np.isfinite(states[:, column]).any():
            continue
        if channel.rate_of not in names:
            return None
        position = states[:, names.index(channel.rate_of)]
        known = position[np.isfinite(position)]
        # Of a constant nothing is left, not even rounding.
        states[:, column] = np.gradient(position - known[:1].sum(), run.times)
    return states
