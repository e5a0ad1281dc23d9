"""A difference model from noisy measurements: states and difference are estimated in turns.

One-step differences of noisy states carry the noise of two readings, and put noise into what the
difference is a function of. Here the whole recorded path is smoothed instead, what the simulator
misses counting as noise of unknown size; the difference is fitted to the smoothed path, and the
path is smoothed again by the simulator with that difference, which by now misses less. That is
expectation and maximisation for a state-space model whose dynamics are learnt (Ghahramani and
Roweis, Learning nonlinear dynamical systems using an EM algorithm, NIPS 1998), the regression
taking the smoothed means for the states.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from sklearn.base import clone

from residual.corrected import CorrectedSimulator
from residual.difference import DifferenceModel
from residual.trajectories import Transitions
from sims.estimation import smooth, usual_push
from sims.measured import MISSED
from sims.simulator import Array, Simulator

#: Turns of smoothing and fitting.
TURNS = 6
#: What a difference model is believed to miss at least, in scales of the rates.
LEAST = 0.003


def fit_measured(
    model: DifferenceModel, measured: Transitions, sigma: Array, turns: int = TURNS
) -> Transitions:
    """Fit a difference model to measured transitions.

    An estimator with ``reads_noise`` true is fitted to the measured path itself where every
    channel of it was measured: it knows what to do with noise, and if it has a parameter
    ``noisy``, that is set.

    Args:
        model: Unfitted, with its simulator; is fitted.
        measured: What was measured, each episode in order of time; NaN where there was no sensor.
        sigma: Standard deviation of a reading of each state channel, shape (n_s,).
        turns: Of smoothing and fitting.

    Returns:
        The transitions that the model was fitted to.

    Raises:
        ValueError: The model has no simulator.
    """
    nominal = model.simulator
    if nominal is None:
        raise ValueError("the difference model has no simulator to compare with")
    knows = getattr(model.estimator, "reads_noise", False)
    if knows and "noisy" in model.estimator.get_params():
        model.estimator = clone(model.estimator).set_params(noisy=True)
    if knows and np.isfinite(measured.states).all():
        model.fit(measured)
        return measured
    simulator: Simulator = nominal
    push = usual_push(nominal, MISSED)
    least = usual_push(nominal, LEAST)
    data = measured
    for _ in range(1 if knows else turns):
        data, missed = smoothed(simulator, measured, sigma, push)
        model.fit(data)
        simulator = CorrectedSimulator(nominal, model)
        push = np.maximum(np.sqrt(missed), least)
    return data


def smoothed(
    simulator: Simulator, measured: Transitions, sigma: Array, push: Array
) -> tuple[Transitions, Array]:
    """The transitions of smoothed paths, and the mean square of what the simulator missed, (p,)."""
    parts, missed = [], []
    for episode in np.unique(measured.episodes):
        rows = measured.episodes == episode
        seen = np.vstack([measured.states[rows], measured.next_states[rows][-1:]])
        path = smooth(simulator, seen, measured.actions[rows], sigma, push)
        parts.append(
            Transitions(
                path.means[:-1], measured.actions[rows], path.means[1:], measured.episodes[rows]
            )
        )
        missed.append(path.pushes)
    whole = Transitions.join(parts)
    return dataclasses.replace(whole, episodes=measured.episodes), np.concatenate(missed).mean(0)
