"""How accurate a difference model is along given states, and nowhere else.

The paper's claim is that the difference model only has to be right where the policy goes, so
accuracy is measured on rollouts of the policy at hand, never on the training data.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from residual.calibration import NINETY_PERCENT
from residual.corrected import CorrectedSimulator
from sims.simulator import Array, Simulator, state_difference

HORIZONS = (0.25, 1.0)


@dataclasses.dataclass(frozen=True)
class Accuracy:
    """Errors of a corrected simulator against what the true system did.

    Attributes:
        one_step: Per channel, RMS error of the predicted difference over the RMS of the true
            difference: 0 is perfect, 1 is as bad as no correction.
        multi_step: Per horizon (key such as ``"1 s"``) and channel, RMS error of an open-loop
            prediction over that of the uncorrected simulator.
        multi_step_error: The same in the channel's unit.
        coverage90: Share of true differences inside the predicted 90 % interval, all channels
            together; None if the estimator predicts no spread.
    """

    one_step: dict[str, float]
    multi_step: dict[str, dict[str, float]]
    multi_step_error: dict[str, dict[str, float]]
    coverage90: float | None

    def __repr__(self) -> str:
        errors = ", ".join(f"{name} {error:.2g}" for name, error in self.one_step.items())
        return f"Accuracy(one-step error as a share of the gap: {errors})"[:160]


def accuracy_along(
    corrected: CorrectedSimulator,
    states: Array,
    actions: Array,
    horizons: Sequence[float] = HORIZONS,
    stride: int = 1,
) -> Accuracy:
    """Accuracy along rollouts of the true system.

    Args:
        corrected: The idealised simulator with its difference model.
        states: States the true system went through, shape (n, T + 1, n_s).
        actions: Actions applied, shape (n, T, n_a).
        horizons: Prediction horizons in s; one longer than the rollouts is left out.
        stride: Open-loop predictions start at every so many-th state that has the horizon
            ahead of it; more than 1 saves time with a slow simulator.

    Returns:
        The errors.
    """
    names = [channel.name for channel in corrected.state_channels]
    n_states, n_actions = states.shape[-1], actions.shape[-1]
    before = states[:, :-1].reshape(-1, n_states)
    held = actions.reshape(-1, n_actions)
    after = states[:, 1:].reshape(-1, n_states)
    truth = state_difference(
        corrected.state_channels, after, corrected.simulator.step(before, held)
    )
    predicted, spread = corrected.difference.predict(before, held, return_std=True)
    covered = None
    if spread is not None:
        covered = float(np.mean(np.abs(truth - predicted) <= NINETY_PERCENT * spread))
    relative, absolute = {}, {}
    for horizon in horizons:
        steps = round(horizon / corrected.dt)
        if steps > actions.shape[1]:
            continue
        with_model = _horizon_error(corrected, states, actions, steps, stride)
        without = _horizon_error(corrected.simulator, states, actions, steps, stride)
        key = f"{horizon:g} s"
        relative[key] = dict(zip(names, _ratio(with_model, without), strict=True))
        absolute[key] = dict(zip(names, with_model.tolist(), strict=True))
    return Accuracy(
        one_step=dict(zip(names, _ratio(_rms(truth - predicted), _rms(truth)), strict=True)),
        multi_step=relative,
        multi_step_error=absolute,
        coverage90=covered,
    )


def uniform_rollouts(
    system: Simulator, rng: np.random.Generator, rollouts: int = 200, steps: int = 20
) -> tuple[Array, Array]:
    """Rollouts of ``system`` from uniformly random states under uniformly random actions.

    Angles are drawn from a whole turn, other states within 1.5 times their scale. The
    comparison that shows why accuracy is measured where the policy goes.

    Returns:
        States (rollouts, steps + 1, n_s) and actions (rollouts, steps, n_a).
    """
    reach = np.array([np.pi if c.angle else 1.5 * c.scale for c in system.state_channels])
    low = np.array([channel.low for channel in system.action_channels])
    high = np.array([channel.high for channel in system.action_channels])
    starts = rng.uniform(-reach, reach, (rollouts, len(reach)))
    actions = rng.uniform(low, high, (rollouts, steps, len(low)))
    return system.rollout(starts, actions), actions


def _horizon_error(
    model: Simulator, states: Array, actions: Array, steps: int, stride: int
) -> Array:
    """RMS error per channel of ``model`` after ``steps`` open-loop steps, shape (n_s,)."""
    starts = states[:, : states.shape[1] - steps : stride].reshape(-1, states.shape[-1])
    windows = np.lib.stride_tricks.sliding_window_view(actions, steps, axis=1)[:, ::stride]
    inputs = np.moveaxis(windows, -1, 2).reshape(-1, steps, actions.shape[-1])
    reached = model.rollout(starts, inputs)[:, -1]
    truth = states[:, steps::stride].reshape(-1, states.shape[-1])
    # The model starts at the measured, unwrapped state, so whole turns must agree as well.
    return _rms(reached - truth)


def _rms(rows: Array) -> Array:
    return np.sqrt(np.mean(rows**2, axis=0))


def _ratio(error: Array, reference: Array) -> list[float]:
    # A channel without any difference counts as perfectly predicted only if the error is nil.
    safe = np.where(reference > 0, reference, 1.0)
    return np.where(reference > 0, error / safe, np.where(error > 0, np.inf, 0.0)).tolist()
