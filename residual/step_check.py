"""Does the integrator of a nominal simulator show in a log? Then it would be taken for physics."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Iterator, Sequence
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from residual.trajectories import Trajectory
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Fall of the squared residual over the variance of the noise from which an effect gets a name.
NOTICED = 15.0
#: Length of a window in s, and the most windows that are compared.
WINDOW, MOST = 0.3, 40
#: Seconds of processor time after which no further finer version is tried.
PATIENCE = 15.0


@runtime_checkable
class Refinable(Protocol):
    """A simulator that knows how to be integrated more finely."""

    def finer(self) -> Iterator[tuple[str, HostSimulator]]:
        """Finer versions with the option that makes them, cheapest first."""


@dataclasses.dataclass(frozen=True)
class StepCheck:
    """What halving the step changes, against the noise of the log.

    Attributes:
        error: Root mean square by measured channel of the simulator against itself at half its
            step, start states free in every window; in the channel's unit.
        noise: Standard deviation of the channel's noise, in its unit.
        visible: Whether so much would be noticed in a log of this length.
    """

    error: dict[str, float]
    noise: dict[str, float]
    visible: bool

    @property
    def says(self) -> str:
        """In one sentence."""
        name = max(self.error, key=lambda n: self.error[n] / max(self.noise[n], 1e-300))
        verb = "shows in this log and would be taken for physics" if self.visible else "is small"
        return (
            f"the integration step {verb}: at half of it {name} differs by "
            f"{self.error[name]:.2g} over {WINDOW:g} s, beside a noise of {self.noise[name]:.2g}"
        )


def check_step(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> StepCheck:
    """Compare a simulator with itself at half its step on windows of a log.

    Both start where the log is; then the start states of the coarse one are fitted to the fine
    one, as they would be to a log, so that only what no start state explains is left.

    Args:
        simulator: The nominal.
        trajectories: Measured runs; give the inputs, the start states and the noise.

    Returns:
        The difference beside the noise.

    Raises:
        ValueError: No window of the log has a measured start.
    """
    simulator = simulator.for_motion([run.states for run in trajectories])
    measured = np.flatnonzero(
        np.any([np.isfinite(run.states).any(axis=0) for run in trajectories], axis=0)
    )
    cut = list(_windows(simulator, trajectories, measured))
    if not cut:
        raise ValueError("no stretch of the log is long enough to compare integration steps")
    starts = np.array([start for start, _, _ in cut])
    actions = np.array([actions for _, actions, _ in cut])
    durations = np.array([durations for _, _, durations in cut])
    fine = _roll(simulator, starts, actions, durations, 2 * simulator.substeps)[..., measured]
    scale = np.array([channel.scale for channel in simulator.physical_channels])
    sigma = _noise(trajectories, measured)
    left = _fitted(simulator, starts, actions, durations, fine, scale, measured)
    squares = np.mean(np.square(left[np.isfinite(left).all(axis=(1, 2))]), axis=1)
    # Where a system strikes the ground, some windows say nothing of the step.
    middle = np.median if simulator.has_contacts else np.mean
    error = np.sqrt(middle(squares, axis=0)) if len(squares) else np.full(len(measured), np.inf)
    samples = sum(len(run.actions) for run in trajectories)
    gain = samples * np.sum((error / np.maximum(sigma, 1e-300)) ** 2)
    names = [simulator.physical_channels[c].name for c in measured]
    return StepCheck(
        dict(zip(names, map(float, error), strict=True)),
        dict(zip(names, map(float, sigma), strict=True)),
        bool(gain > NOTICED),
    )


def fine_enough(
    simulator: HostSimulator, trajectories: Sequence[Trajectory]
) -> tuple[str, HostSimulator] | None:
    """The cheapest finer version of a simulator whose step does not show, with its option.

    Args:
        simulator: A nominal whose step shows.
        trajectories: Measured runs.

    Returns:
        Such as ``("--simulator.integrator RK4", simulator)``; None if none is fine enough of those
        that there was time to try.
    """
    simulator = simulator.for_motion([run.states for run in trajectories])
    # No usual step times a strike of the ground as finely as encoders see it.
    if simulator.has_contacts or not isinstance(simulator, Refinable):
        return None
    begun = time.process_time()
    for option, finer in simulator.finer():
        if time.process_time() - begun > PATIENCE:
            break
        if not check_step(finer, trajectories).visible:
            return option, finer
    return None


def advice(simulator: HostSimulator, trajectories: Sequence[Trajectory]) -> list[str]:
    """What to tell before anything is named: nothing, or that the step shows and what to do.

    Only simulators are asked whose step is part of the model, see ``Refinable``.
    """
    if not isinstance(simulator, Refinable):
        return []
    simulator = simulator.for_motion([run.states for run in trajectories])
    check = check_step(simulator, trajectories)
    if not check.visible:
        return []
    if simulator.has_contacts:
        return [f"{check.says}; contacts are as fine as the step, so small effects are in doubt"]
    found = fine_enough(simulator, trajectories)
    if found is None:
        return [f"{check.says}; none of the finer versions tried is fine enough"]
    return [f"{check.says}; run again with {found[0]}"]


def _windows(
    simulator: HostSimulator, trajectories: Sequence[Trajectory], measured: NDArray[np.int64]
) -> Iterator[tuple[Array, Array, Array]]:
    """Start states, actions and durations of windows spread over the log."""
    pieces = []
    steps = max(
        3, round(WINDOW / float(np.median(np.concatenate([r.durations for r in trajectories]))))
    )
    for run in trajectories:
        for a in range(3, len(run.actions) - steps, steps):
            if np.isfinite(run.states[a - 3 : a + 4, measured]).all():
                pieces.append((run, a))
    for run, a in pieces[:: max(1, -(-len(pieces) // MOST))]:
        rows = slice(a, a + steps)
        yield _start(simulator, run, a), run.actions[rows], run.durations[rows]


def _start(simulator: HostSimulator, run: Trajectory, a: int) -> Array:
    """The state at a sample: measured, or the slope of a parabola through its neighbours."""
    channels = simulator.physical_channels
    names = [channel.name for channel in channels]
    near = slice(a - 3, a + 4)
    start = np.zeros(len(channels))
    for c, channel in enumerate(channels):
        if np.isfinite(run.states[a, c]):
            start[c] = run.states[a, c]
        elif channel.kind == "rate" and channel.rate_of in names:
            position = run.states[near, names.index(channel.rate_of)]
            if np.isfinite(position).all():
                start[c] = np.polyfit(run.times[near] - run.times[a], position, 2)[1]
    return start


def _roll(
    simulator: HostSimulator, starts: Array, actions: Array, durations: Array, substeps: int
) -> Array:
    """States after every sample of windows (w, T, n_s)."""
    states, path = starts, []
    for k in range(actions.shape[1]):
        inputs = np.repeat(actions[:, k, None, :], substeps, axis=1)
        with np.errstate(all="ignore"):
            states = simulator.integrate(states, inputs, durations[:, k])
        path.append(states)
    return np.stack(path, axis=1)


def _fitted(
    simulator: HostSimulator, starts: Array, actions: Array, durations: Array, wanted: Array,
    scale: Array, measured: NDArray[np.int64],
) -> Array:  # fmt: skip
    """What is left (w, T, m) after Gauss-Newton over the start state of every window."""
    count, width = starts.shape
    steps = 1e-5 * scale
    moves = np.concatenate([np.zeros((1, width)), np.diag(steps)])
    best = np.full(wanted.shape, np.nan)
    least = np.full(count, np.inf)
    for _ in range(4):
        varied = (starts + moves[:, None]).reshape(-1, width)
        tile = (width + 1, 1)
        rolled = _roll(
            simulator, varied, np.tile(actions, (*tile, 1)), np.tile(durations, tile),
            simulator.substeps,
        )[..., measured].reshape(width + 1, *wanted.shape)  # fmt: skip
        left = wanted - rolled[0]
        cost = np.sum(np.square(left / scale[measured]), axis=(1, 2))
        better = cost < least
        best[better], least[better] = left[better], cost[better]
        slopes = (rolled[1:] - rolled[0]) / steps[:, None, None, None] / scale[measured]
        starts = starts.copy()
        for w in np.flatnonzero(better & np.isfinite(rolled).all(axis=(0, 2, 3))):
            matrix = slopes[:, w].reshape(width, -1).T * scale
            target = (left[w] / scale[measured]).ravel()
            starts[w] += scale * np.linalg.lstsq(matrix, target, rcond=1e-8)[0]
    return best


def _noise(trajectories: Sequence[Trajectory], measured: NDArray[np.int64]) -> Array:
    """Standard deviation by channel of what a cubic through nine samples leaves, by the median."""
    found = []
    for c in measured:
        parts = []
        for run in trajectories:
            for a in range(0, len(run.times) - 9, 9):
                x, t = run.states[a : a + 9, c], run.times[a : a + 9]
                if np.isfinite(x).all():
                    basis = np.vander((t - t[4]) / (t[-1] - t[0]), 4)
                    rest = x - basis @ np.linalg.lstsq(basis, x, rcond=None)[0]
                    parts.append(rest @ rest / 5)
        # The median of a chi-squared of five is 0.870 of its mean.
        found.append(np.sqrt(np.median(parts) / 0.870) if parts else np.inf)
    return np.array(found)
