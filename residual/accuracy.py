"""How accurate a difference model is along given states, and nowhere else.

The paper's claim is that the difference model only has to be right where the policy goes, so
accuracy is measured on rollouts of the policy at hand, never on the training data.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from scipy.special import stdtrit

from residual.calibration import NINETY_PERCENT
from residual.corrected import CorrectedSimulator
from sims.simulator import Array, Simulator, physical, state_difference

# In s; a slow system is forecast over at least so many periods, as a fast one is over more.
_HORIZONS = (0.25, 1.0)
LEAST_STEPS = (5, 20)
# Of fewer rollouts no interval tells anything.
_ROLLOUTS = 3


@dataclasses.dataclass(frozen=True)
class Accuracy:
    """Errors of a corrected simulator against what the true system did.

    Attributes:
        one_step: Per channel, RMS error of the predicted difference over the RMS of the true
            difference: 0 is perfect, 1 is as bad as no correction.
        multi_step: Per horizon (key such as ``"1 s"``, steps times control period) and channel,
            RMS error of an open-loop prediction over that of the uncorrected simulator.
        multi_step_error: The same in the channel's unit.
        coverage90: Share of true differences inside the predicted 90 % interval, all channels
            together; None if the estimator predicts no spread.
        gap: Per channel, RMS of the true difference over the RMS of what a step of the true
            system changes: 0 where it does what the uncorrected simulator does.
        one_step_95: Per channel, ends of the 95 % interval of ``one_step`` over rollouts, by the
            jackknife of its logarithm; without channels that have none, as of fewer than three
            rollouts. A rollout that fell makes it wide.
    """

    one_step: dict[str, float]
    multi_step: dict[str, dict[str, float]]
    multi_step_error: dict[str, dict[str, float]]
    coverage90: float | None
    gap: dict[str, float]
    one_step_95: dict[str, tuple[float, float]] = dataclasses.field(default_factory=dict)

    def __repr__(self) -> str:
        errors = ", ".join(f"{name} {error:.2g}" for name, error in self.one_step.items())
        return f"Accuracy(one-step error as a share of the gap: {errors})"[:160]


def usual_steps(dt: float) -> tuple[int, ...]:
    """The usual horizons in steps: a quarter of a second and one, but at least 5 and 20 periods."""
    pairs = zip(_HORIZONS, LEAST_STEPS, strict=True)
    return tuple(max(round(horizon / dt), least) for horizon, least in pairs)


def accuracy_along(
    corrected: CorrectedSimulator,
    states: Array | Sequence[Array],
    actions: Array | Sequence[Array],
    horizons: Sequence[float] | None = None,
    stride: int = 1,
) -> Accuracy:
    """Accuracy along rollouts of the true system.

    Args:
        corrected: The idealised simulator with its difference model.
        states: States the true system went through: n rollouts, each of shape (T + 1, n_s); they
            may differ in length.
        actions: Actions applied, each of shape (T, n_a).
        horizons: Prediction horizons in s, each at least a step; one longer than every rollout is
            left out. By default those of ``usual_steps``.
        stride: Open-loop predictions start at every n-th state that has the horizon ahead of it,
            this being n; more than 1 saves time with a slow simulator.

    Returns:
        The errors.
    """
    if not isinstance(corrected, CorrectedSimulator):
        raise ValueError(
            f"accuracy is of a CorrectedSimulator(simulator, difference model), got "
            f"{type(corrected).__name__}"
        )
    names = [channel.name for channel in corrected.state_channels]
    before, held, after = (
        np.concatenate(parts)
        for parts in ([s[:-1] for s in states], list(actions), [s[1:] for s in states])
    )
    truth = state_difference(
        corrected.state_channels, after, corrected.simulator.step(before, held)
    )
    moved = state_difference(corrected.state_channels, after, before)
    predicted, spread = corrected.difference.predict(before, held, return_std=True)
    covered = None
    if spread is not None:
        covered = float(np.mean(np.abs(truth - predicted) <= NINETY_PERCENT * spread))
    relative, absolute = {}, {}
    dt = corrected.dt
    wanted = usual_steps(dt) if horizons is None else [max(round(h / dt), 1) for h in horizons]
    lengths = [len(one) for one in actions]
    for steps in wanted:
        if steps > max(lengths):
            continue
        with_model = _horizon_error(corrected, states, actions, steps, stride)
        without = _horizon_error(corrected.simulator, states, actions, steps, stride)
        key = f"{steps * dt:g} s"
        relative[key] = dict(zip(names, _ratio(with_model, without), strict=True))
        absolute[key] = dict(zip(names, with_model.tolist(), strict=True))
    return Accuracy(
        one_step=dict(zip(names, _ratio(_rms(truth - predicted), _rms(truth)), strict=True)),
        multi_step=relative,
        multi_step_error=absolute,
        coverage90=covered,
        gap=dict(zip(names, _ratio(_rms(truth), _rms(moved)), strict=True)),
        one_step_95=interval_over_rollouts(names, truth - predicted, truth, lengths),
    )


def uniform_rollouts(
    system: Simulator, rng: np.random.Generator, rollouts: int = 200, steps: int = 20
) -> tuple[Array, Array]:
    """Rollouts of ``system`` from uniformly random states under uniformly random actions.

    Angles are drawn from a whole turn, other states within 1.5 times their scale; hidden memory
    begins at rest. The comparison that shows why accuracy is measured where the policy goes.

    Returns:
        States without hidden memory, shape (rollouts, steps + 1, n_s), and actions, shape
        (rollouts, steps, n_a).
    """
    channels = physical(system.state_channels)
    reach = np.array([np.pi if c.angle else 1.5 * c.scale for c in channels])
    low = np.array([channel.low for channel in system.action_channels])
    high = np.array([channel.high for channel in system.action_channels])
    starts = rng.uniform(-reach, reach, (rollouts, len(reach)))
    actions = rng.uniform(low, high, (rollouts, steps, len(low)))
    states = system.rollout(system.augment(starts), actions)
    return states[:, :, : len(channels)], actions


def _horizon_error(
    model: Simulator,
    states: Array | Sequence[Array],
    actions: Array | Sequence[Array],
    steps: int,
    stride: int,
) -> Array:
    """RMS error per channel of ``model`` after ``steps`` open-loop steps, shape (n_s,)."""
    starts, inputs, truth = [], [], []
    for path, acted in zip(states, actions, strict=True):
        if len(acted) < steps:
            continue
        windows = np.lib.stride_tricks.sliding_window_view(acted, steps, axis=0)[::stride]
        starts.append(path[: len(path) - steps : stride])
        inputs.append(np.moveaxis(windows, -1, 1))
        truth.append(path[steps::stride])
    reached = model.rollout(np.concatenate(starts), np.concatenate(inputs))[:, -1]
    # The model starts at the measured, unwrapped state, so whole turns must agree as well.
    return _rms(reached - np.concatenate(truth))


def _rms(rows: Array) -> Array:
    return np.sqrt(np.mean(rows**2, axis=0))


def interval_over_rollouts(
    names: Sequence[str], error: Array, reference: Array, lengths: Sequence[int]
) -> dict[str, tuple[float, float]]:
    """95 % interval of the ratio of two RMS values by channel, over rollouts.

    Rollouts are what chance draws: the jackknife of the ratio's logarithm, by Student's t.

    Args:
        names: Of the channels.
        error: Rows of all rollouts, one after the other, (n, n_s).
        reference: The same of what they are compared with.
        lengths: Rows of each rollout.

    Returns:
        Both ends by channel, without channels that have none; empty of fewer than three rollouts.
    """
    count = len(lengths)
    if count < _ROLLOUTS:
        return {}
    ends = np.cumsum(lengths)[:-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        parts = [[(p**2).sum(axis=0) for p in np.split(rows, ends)] for rows in (error, reference)]
        above, below = np.array(parts)
        whole = 0.5 * np.log(above.sum(axis=0) / below.sum(axis=0))
        without = 0.5 * np.log((above.sum(axis=0) - above) / (below.sum(axis=0) - below))
        spread = np.sqrt((count - 1) * without.var(axis=0))
        reach = stdtrit(count - 1, 0.975) * spread
        low, high = np.exp(whole - reach), np.exp(np.minimum(whole + reach, 700.0))
    return {
        name: (float(low[i]), float(high[i]))
        for i, name in enumerate(names)
        if np.isfinite(whole[i]) and np.isfinite(reach[i])
    }


def _ratio(error: Array, reference: Array) -> list[float]:
    # A channel without any difference counts as perfectly predicted only if the error is nil.
    safe = np.where(reference > 0, reference, 1.0)
    return np.where(reference > 0, error / safe, np.where(error > 0, np.inf, 0.0)).tolist()
