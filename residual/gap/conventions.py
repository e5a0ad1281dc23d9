"""Signs and zeros that a log counts otherwise than the simulator: no effect, but a column map.

A reversed input or an angle counted from elsewhere makes every forecast wrong, and no effect of
the library undoes it. So it is asked beforehand whether the nominal simulator forecasts far better
with one of them changed.
"""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
from numpy.typing import NDArray

from residual.gap import paths
from residual.gap.model import Model
from residual.gap.smooth import SmoothFitter
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Error, in units of the usual variation, below which forecasts are too good to ask.
GOOD = 0.3
#: Times that forecasts have to be better with another convention, and other conventions that do
#: as well.
BETTER, ALIKE = 3.0, 1.2
#: Zeros from which angles are counted.
QUARTERS = (0.0, np.pi / 2, np.pi, -np.pi / 2)
#: Windows that are looked at: all rows at once, and row by row.
AT_ONCE, BY_ROW = 120, 20
#: Error of a window in units of the usual variation beyond which it is just wrong.
WRONG = 5.0


@dataclasses.dataclass(frozen=True)
class Convention:
    """How columns may count in place of how they are said to.

    Attributes:
        says: What to change in the column map.
        states: Factor and offset of every state, (2, n_s).
        inputs: Factor of every input, (n_a,).
    """

    says: str
    states: Array
    inputs: Array


def otherwise(simulator: HostSimulator, fitter: SmoothFitter) -> list[str]:
    """Conventions with which the nominal simulator forecasts far better, the best one in words.

    Args:
        simulator: The nominal simulator.
        fitter: With the windows to forecast.

    Returns:
        No sentence, or one.
    """
    own = _error(simulator, fitter)
    if own < GOOD:
        return []
    errors = {one.says: _error(simulator, fitter, one) for one in _conventions(simulator, fitter)}
    least = min(errors.values(), default=own)
    if BETTER * least > own:
        return []
    alike = [says for says, error in errors.items() if error < ALIKE * least]
    return [
        f"does the log count as the simulator does? Its forecasts err {own / least:.2g} times less "
        f"with {' or '.join(alike)} in the column map: if that is so, set it and ask again"
    ]


def _conventions(simulator: HostSimulator, fitter: SmoothFitter) -> list[Convention]:
    channels, inputs = simulator.physical_channels, simulator.action_channels
    measured = set(fitter.samples.measured.tolist())
    plain = np.vstack([np.ones(len(channels)), np.zeros(len(channels))])
    found = []
    for place, action in enumerate(inputs):
        if action.low < 0 < action.high:
            turned = np.ones(len(inputs))
            turned[place] = -1.0
            found.append(Convention(f"scale: -1 for {action.name}", plain, turned))
    for place, channel in enumerate(channels):
        if channel.kind != "position":
            continue
        joint = [place, *(i for i, c in enumerate(channels) if c.rate_of == channel.name)]
        joint = [i for i in joint if i in measured]
        turns = channel.angle or channel.unit == "rad"
        zeros = QUARTERS if turns and place in measured else QUARTERS[:1]
        for sign, zero in itertools.product((1.0, -1.0), zeros):
            if not joint or (sign, zero) == (1.0, 0.0):
                continue
            states = plain.copy()
            states[0, joint] = sign
            states[1, place] = zero
            says = [f"offset: {zero:.6g}"] if zero else []
            says += ["scale: -1"] if sign < 0 else []
            names = [channel.name] if sign > 0 else [channels[i].name for i in joint]
            found.append(
                Convention(f"{' and '.join(says)} for {' and '.join(names)}", states,
                           np.ones(len(inputs)))
            )  # fmt: skip
    return found


def _error(
    simulator: HostSimulator, fitter: SmoothFitter, convention: Convention | None = None
) -> float:
    """Mean error of forecasts straight from what was measured, in units of the usual variation."""
    samples, windows = fitter.samples, fitter.blocks.windows
    if convention is not None:
        factor, offset = convention.states
        samples = dataclasses.replace(
            samples, seen=factor * samples.seen + offset,
            actions=convention.inputs * samples.actions,
            recorded=tuple(
                dataclasses.replace(run, actions=convention.inputs * run.actions)
                for run in samples.recorded
            ),
        )  # fmt: skip
    model, none = Model(simulator), np.zeros((1, 0))
    nodes = paths.measured(model, samples, none[0])
    most = AT_ONCE if simulator.advances_rows_at_once else BY_ROW
    some = np.unique(np.linspace(0, len(windows) - 1, most).astype(int))
    index, inside = windows.index[some], windows.inside[some]
    asked = dataclasses.replace(fitter, samples=samples)
    shown = asked.shown(
        model, index[:, 0], nodes[index[:, 0]], index.shape[1] - 1, none,
        np.zeros(len(some), int),
    )  # fmt: skip
    seen = samples.seen[index][..., samples.measured]
    there = np.isfinite(seen) & inside[..., None]
    miss = np.where(there, (shown - seen) / fitter.scale[samples.measured], 0.0)
    # What runs away is wrong, too.
    squares = np.nan_to_num(miss, nan=np.inf) ** 2
    each = np.sqrt(squares.sum(axis=(1, 2)) / np.maximum(there.sum(axis=(1, 2)), 1))
    return float(np.minimum(each, WRONG).mean())
