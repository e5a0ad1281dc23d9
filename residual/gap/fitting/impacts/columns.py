"""What each number of a model, and each candidate effect, does to every window."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.impacts.single_shooting import (
    StartFit,
    WindowData,
    foretold,
    job,
    run,
    shown,
    whitened,
)
from residual.gap.fitting.impacts.start_states import begun_beside, descend
from residual.gap.model.candidates import Candidate
from residual.gap.model.model import Model

Array = NDArray[np.float64]

#: Trial strength of a smooth effect, as a share of what candidates are tried at elsewhere. A
#: window of steps shows a hundredth of most effects, and an impact comes soon after the last.
GENTLE = 0.3
#: Step of a finite difference by a strength, as a share of a usual one. Narrow ones see the kinks
#: of impacts, and steps of Gauss and Newton by such derivatives are far too short.
WIDE = 0.5
#: Steps of start states beside a changed number.
SOME = 4


@dataclasses.dataclass(frozen=True)
class Slopes:
    """Derivatives by the numbers of a model.

    Attributes:
        window: Of the whitened output of every window, its start state as it is, (W, R, p).
        ahead: Of the residual of what follows it, start states fitted anew, with its sign turned as
            that of an output, (W, R', p).
    """

    window: Array
    ahead: Array


def slopes(
    model: Model,
    theta: Array,
    data: WindowData,
    fitted: StartFit,
    ahead: Array,
    width: float = WIDE,
) -> Slopes:
    """Derivative by the unknowns of the model.

    Args:
        model: The fitted simulator with effects.
        theta: Their numbers, (p,).
        data: The windows.
        fitted: The fit to them.
        ahead: Residual of what follows them, (W, R').
        width: Step of the finite differences, as a share of usual ones.
    """
    widths = width * model.step
    steps = np.where(theta + widths > model.high, -widths, widths)
    thetas = theta + np.diag(steps)
    jobs = [job(model, t, data, fitted.starts[None]) for t in thetas]
    measured = data.samples.measured
    columns = [
        whitened(data, (shown(one, path, measured)[0] - fitted.shown) / step)
        for one, path, step in zip(jobs, run(jobs), steps, strict=True)
    ]
    if not columns:
        return Slopes(np.zeros((*fitted.residual.shape, 0)), np.zeros((*ahead.shape, 0)))
    window = np.stack(columns, axis=2)
    if data.ahead is None:
        return Slopes(window, np.zeros((*ahead.shape, len(steps))))
    changed = []
    for j, t in enumerate(thetas):
        begin = begun_beside(model, t, data, fitted, window[..., j] * steps[j])
        starts = descend(model, t, data, begin, SOME).starts
        there = data.ahead.residual(data, foretold(model, t, data, starts, data.ahead.steps))
        changed.append((ahead - there) / steps[j])
    return Slopes(window, np.stack(changed, axis=2))


def candidate_changes(
    model: Model,
    theta: Array,
    data: WindowData,
    fitted: StartFit,
    candidates: Sequence[Candidate],
) -> Array:
    """Change of the whitened output by every trial of candidates beside a fitted model, (W, R, c).

    Args:
        model: The fitted simulator with effects.
        theta: Their numbers.
        data: The windows.
        fitted: The fit to them.
        candidates: All that may be missing.
    """
    jobs, shares = [], []
    for candidate in candidates:
        joint = Model(model.simulator, (*model.chosen, candidate))
        gentle = 1.0 if candidate.rough or candidate.fixed_level else GENTLE
        for trial in candidate.trials:
            for row in trial.values:
                values = np.where(candidate.linear, gentle * row, row)
                jobs.append(job(joint, np.append(theta, values), data, fitted.starts[None]))
                shares.append(gentle)
    measured = data.samples.measured
    if not jobs:
        return np.zeros((*fitted.residual.shape, 0))
    changes = [
        whitened(data, shown(one, path, measured)[0] - fitted.shown) / share
        for one, path, share in zip(jobs, run(jobs), shares, strict=True)
    ]
    return np.stack(changes, axis=2)
