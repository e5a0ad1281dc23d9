"""Angles that were cut at a turn, of channels that do not say that they are angles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.inspection import measured, refusal
from residual.logs.checks import Finding
from residual.trajectories import Trajectory, moment
from sims.host import HostSimulator
from sims.simulator import Channel

Array = NDArray[np.float64]

#: How nearly a jump has to be a turn, and the share of it that no other step reaches.
ALMOST, SMALL = 0.03, 0.3
#: Jumps from which on they need not be so near if all values are within one turn: what moves fast
#: is on its way while it is cut.
SOME = 3


def wrapped(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """Measured states that jump by a turn, which no motion does."""
    found = []
    for channel, runs in measured(simulator, trajectories):
        rows = _jumps(channel, runs, trajectories)
        if rows:
            fix = "declare it with angle=True" if channel.unit == "rad" else "unwrap the column"
            says = f"{_says(rows)}: {fix} (numpy.unwrap(values, period={channel.turn:.6g}))"
            found.append(refusal("wrapped", channel.name, says))
    return found


def wrapped_inputs(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[Finding]:
    """Inputs that do, as the direction of a wind: a simulator may take its sine, and not mind."""
    found = []
    for column, channel in enumerate(simulator.action_channels):
        rows = _jumps(channel, [run.actions[:, column] for run in trajectories], trajectories)
        if rows:
            says = (
                f"{_says(rows)}: unless the simulator takes its sine and cosine, unwrap the "
                f"column (numpy.unwrap(values, period={channel.turn:.6g}))"
            )
            found.append(Finding("wrapped", channel.name, says, {"jumps": len(rows)}, "warning"))
    return found


def _says(rows: Sequence[str]) -> str:
    often = "once" if len(rows) == 1 else f"{len(rows)} times"
    return (
        f"jumps by a whole turn {often} (the first at {rows[0]}), as an angle does that is cut "
        "there"
    )


def _jumps(
    channel: Channel, runs: Sequence[Array], trajectories: Sequence[Trajectory]
) -> list[str]:
    """Where a channel jumps by a turn, in words; empty if it moves as far otherwise, too."""
    turn = channel.turn
    if turn is None or channel.angle or not runs:
        return []
    values = np.concatenate(runs)
    values = values[np.isfinite(values)]
    steps = [np.abs(np.diff(one)) for one in runs]
    within = values.size and np.ptp(values) <= (1 + ALMOST) * turn
    far = sum(int((step > (1 - SMALL) * turn).sum()) for step in steps)
    nearly = SMALL if within and far >= SOME else ALMOST
    jumps = [np.abs(step - turn) < nearly * turn for step in steps]
    others = np.concatenate([step[~jump] for step, jump in zip(steps, jumps, strict=True)])
    others = others[np.isfinite(others)]
    if others.size and others.max() >= SMALL * turn:
        return []
    return [
        f"{moment(run.times[row + 1])} of {run.name}"
        for run, jump in zip(trajectories, jumps, strict=True)
        for row in np.flatnonzero(jump)
    ]
