"""Single commands that nobody can have meant: a record is cut there, as where none was logged."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.logs.checks import Finding
from residual.trajectories import Trajectory, moment
from sims.host import HostSimulator
from sims.simulator import Channel

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Times the declared bounds that a command goes beyond, and times the range of all other commands
#: where none are declared, if it was not meant.
BEYOND_BOUNDS, BEYOND_OTHERS = 3.0, 20.0
#: No more than this share of all commands are accidents.
FEW = 0.05
#: Samples of the shortest piece that is kept.
SHORTEST = 5


def without_wild_inputs(
    simulator: HostSimulator, trajectories: Sequence[Trajectory]
) -> tuple[list[Trajectory], list[Finding]]:
    """Runs cut at commands that stand alone far beyond all others, and what was found.

    A command is wild if it stands in a single sample of its channel beyond three times the bounds
    that are declared, or, where none are, is the only one to go beyond all others by twenty times
    their range. What it did is in no simulator, and one of a thousand times the size of the others
    would be all that a fit sees.

    Args:
        simulator: Has the inputs and their bounds.
        trajectories: Measured runs.
    """
    runs, found = list(trajectories), []
    if not any(len(run.actions) for run in runs):
        return runs, []
    gone = [np.zeros(len(run.actions), bool) for run in runs]
    for column, channel in enumerate(simulator.action_channels):
        masks = _wild(channel, [run.actions[:, column] for run in runs])
        rows = tuple(
            (run.name, float(time))
            for run, mask in zip(runs, masks, strict=True)
            for time in run.times[:-1][mask]
        )
        if not rows:
            continue
        values = [run.actions[mask, column] for run, mask in zip(runs, masks, strict=True)]
        most = max(np.concatenate(values), key=abs)
        says = (
            f"reaches {most:.4g}{channel.unit_text} in {len(rows)} of {sum(map(len, masks))} "
            f"samples (the first at {moment(rows[0][1])} of {rows[0][0]}), far beyond all "
            "others: no such command can have been meant; cut there"
        )
        numbers = {"samples": len(rows), "most": float(most)}
        found.append(Finding("wild", channel.name, says, numbers, "warning", rows))
        gone = [one | mask for one, mask in zip(gone, masks, strict=True)]
    if not found:
        return runs, []
    pieces = [p for run, mask in zip(runs, gone, strict=True) for p in _pieces(run, mask)]
    return (pieces, found) if pieces else (runs, [])


def _wild(channel: Channel, inputs: Sequence[Array]) -> list[Mask]:
    """Commands of one input that stand alone far beyond all others, by run."""
    values = np.concatenate(list(inputs))
    sizes = [abs(bound) for bound in (channel.low, channel.high) if np.isfinite(bound)]
    if sizes:
        far = [np.abs(run) > BEYOND_BOUNDS * max(sizes) for run in inputs]
        most = max(1, int(FEW * len(values)))
    else:
        middle = float(np.median(values))
        out = int(np.abs(values - middle).argmax())
        others = np.delete(values, out)
        low, high = (others.min(), others.max()) if len(others) else (middle, middle)
        reach = BEYOND_OTHERS * (high - low)
        far = [(run > high + reach) | (run < low - reach) for run in inputs]
        far = far if high > low else [np.zeros(len(run), bool) for run in inputs]
        most = 1
    alone = all(not (mask[1:] & mask[:-1]).any() for mask in far)
    if not alone or sum(int(mask.sum()) for mask in far) > most:
        return [np.zeros(len(run), bool) for run in inputs]
    return far


def _pieces(run: Trajectory, gone: Mask) -> list[Trajectory]:
    """What lies between commands that are gone; a run that has none as it is."""
    if not gone.any():
        return [run]
    edges = [0, *(np.flatnonzero(gone) + 1).tolist(), len(run.times)]
    spans = [(a, b) for a, b in itertools.pairwise(edges) if b - a >= SHORTEST]
    return [
        run.piece(a, b, f"{run.name} part {number}") for number, (a, b) in enumerate(spans, start=1)
    ]
