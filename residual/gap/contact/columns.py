"""What each candidate effect does to every window, and all windows as quadratic functions of it."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.candidates import Candidate
from residual.gap.contact.quadratic import Quadratic
from residual.gap.contact.shots import Aimed, Shots, job, run, shown, whitened
from residual.gap.model import Model

Array = NDArray[np.float64]

#: Trial strength of a smooth effect, as a share of what candidates are tried at elsewhere. A
#: window of steps shows a hundredth of most effects, and an impact comes soon after the last.
GENTLE = 0.3


@dataclasses.dataclass(frozen=True)
class Column:
    """One column of signatures.

    Attributes:
        candidate: Number of the candidate it belongs to.
        knobs: Values of the candidate's knobs for a coefficient of one.
        linear: Which knobs scale with the coefficient.
        chosen: Position among the unknowns of the fitted model, or -1 for a candidate that is
            not part of it.
        low: Least value of its coefficient.
    """

    candidate: int
    knobs: Array
    linear: NDArray[np.bool_]
    chosen: int
    low: float

    def start(self, coefficient: float) -> Array:
        """Values of the candidate's knobs at a coefficient."""
        # A secant far from one times itself says little about the true size.
        bound = 30.0 if self.linear.all() else 3.0
        size = float(np.clip(coefficient, -bound, bound))
        return np.where(self.linear, size * self.knobs, self.knobs)


def chosen_changes(model: Model, theta: Array, shots: Shots, aimed: Aimed) -> Array:
    """Derivative of the whitened output by the unknowns of the model, (W, R, p)."""
    steps = np.where(theta + 0.1 * model.step > model.high, -0.1, 0.1) * model.step
    thetas = theta + np.diag(steps)
    jobs = [job(model, t, shots, aimed.starts[None]) for t in thetas]
    measured = shots.samples.measured
    columns = [
        whitened(shots, (shown(one, path, measured)[0] - aimed.shown) / step)
        for one, path, step in zip(jobs, run(jobs), steps, strict=True)
    ]
    return np.stack(columns, axis=2) if columns else np.zeros((*aimed.residual.shape, 0))


def columns(
    model: Model, theta: Array, shots: Shots, aimed: Aimed, candidates: Sequence[Candidate],
    key: Sequence[int],
) -> tuple[list[Column], Quadratic]:  # fmt: skip
    """Columns of the unknowns of a fitted model, and of all candidates beside it.

    Args:
        model: The simulator with the candidates ``key``.
        theta: Their numbers.
        aimed: Its fit to the windows.
        candidates: All that may be missing.
        key: Numbers of the chosen ones, in the order of the model's.
    """
    found: list[Column] = []
    for place, knob in enumerate(model.knobs):
        number = key[int(model.owner[place])]
        values = np.array([float(k is knob) for k in candidates[number].knobs])
        linear = np.ones(len(values), bool)
        found.append(Column(number, values, linear, place, knob.low - theta[place]))
    changes = [chosen_changes(model, theta, shots, aimed)]
    jobs = []
    for number, candidate in enumerate(candidates):
        if number in key:
            continue
        joint = Model(model.simulator, (*model.chosen, candidate))
        gentle = 1.0 if candidate.rough or candidate.fixed_level else GENTLE
        for trial in candidate.trials:
            for row, sided in zip(trial.values, trial.one_sided, strict=True):
                values = np.where(candidate.linear, gentle * row, row)
                one = job(joint, np.append(theta, values), shots, aimed.starts[None])
                jobs.append(one)
                low = 0.0 if sided or candidate.fixed_level else -np.inf
                found.append(Column(number, values, candidate.linear, -1, low))
    measured = shots.samples.measured
    for one, path in zip(jobs, run(jobs), strict=True):
        change = whitened(shots, shown(one, path, measured)[0] - aimed.shown)
        changes.append(change[..., None])
    lows = np.array([column.low for column in found])
    quadratic = Quadratic.of(
        aimed.by_start, aimed.residual, np.concatenate(changes, axis=2), shots.freedom, lows
    )
    return found, quadratic
