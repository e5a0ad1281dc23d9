"""Short windows by single shooting: from one start state, simulated to the window's end.

Impacts make a window's residual kinked in its start state, and each window in its own way, so
every window is fitted by itself, with its own step length. Unlike in lifted shooting no state
but the first can lie in the ground.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples
from residual.gap.data.windows import Windows
from residual.gap.fitting.impacts.ahead import Ahead, rows_ahead
from residual.gap.model.model import Model
from residual.gap.model.workers import each, integrate_rows
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Rows of one piece of work for a process.
PIECE = 200
#: Doubt about a start state that is known.
KNOWN = 1e-12


@dataclasses.dataclass(frozen=True)
class WindowData:
    """Windows of equal length with what was measured in them.

    Attributes:
        samples: The measured table.
        windows: W windows of L samples.
        sigma: Noise of every measured channel, (m,).
        guess: First guess of every window's physical start state, (W, n_p).
        doubt: How far off the guess of an unmeasured state may be, (n_p,); infinite for a
            measured one, ``KNOWN`` for one that is exactly as measured.
        moves: By how much each state is moved to see its influence, (n_p,).
        ahead: How forecasts past their ends count; None if these are not asked for.
    """

    samples: Samples
    windows: Windows
    sigma: Array
    guess: Array
    doubt: Array
    moves: Array
    ahead: Ahead | None = None

    def __len__(self) -> int:
        return len(self.windows)

    @property
    def seen(self) -> Array:
        """Measured channels in every window, (W, L, m); NaN where not measured."""
        return self.samples.seen[self.windows.index][..., self.samples.measured]

    @property
    def known(self) -> NDArray[np.bool_]:
        """Which start states are exactly as measured, (n_p,)."""
        return self.doubt <= KNOWN

    @property
    def freedom(self) -> Array:
        """Measured values less free states of every window, (W,)."""
        values = np.isfinite(self.seen).sum(axis=(1, 2))
        return np.maximum(values - np.isinf(self.doubt).sum(), 1).astype(float)

    def take(self, which: NDArray[np.int64]) -> WindowData:
        """Some of the windows."""
        windows = self.windows
        part = windows[which]
        return dataclasses.replace(self, windows=part, guess=self.guess[which])

    def until(self, size: int) -> WindowData:
        """The first so many samples of every window, and nothing past them."""
        windows = self.windows
        part = Windows(windows.index[:, :size], windows.inside[:, :size], windows.run)
        return dataclasses.replace(self, windows=part, ahead=None)


@dataclasses.dataclass(frozen=True)
class StartFit:
    """Windows fitted by their best start states.

    Attributes:
        starts: Physical start states, (W, n_p).
        shown: What the sensors show along the way, (W, L, m).
        residual: Whitened residual with the doubts about the guess below it, (W, R).
        by_start: Derivative of what is shown (and of the doubts), whitened, (W, R, n_p).
    """

    starts: Array
    shown: Array
    residual: Array
    by_start: Array

    @property
    def costs(self) -> Array:
        """Squared residual of every window, (W,)."""
        return np.minimum((self.residual**2).sum(axis=1), 1e30)

    def take(self, which: NDArray[np.int64]) -> StartFit:
        """Some of the windows."""
        return StartFit(*(getattr(self, f.name)[which] for f in dataclasses.fields(self)))

    def with_windows(self, which: NDArray[np.int64], other: StartFit) -> StartFit:
        """The same with some of the windows fitted otherwise."""
        whole = [np.array(getattr(self, f.name)) for f in dataclasses.fields(self)]
        for array, field in zip(whole, dataclasses.fields(self), strict=True):
            array[which] = getattr(other, field.name)
        return StartFit(*whole)


@dataclasses.dataclass(frozen=True)
class Job:
    """Start states (V, W, n_i), inputs (W, H, substeps, n_a, 2) and durations (W, H)."""

    host: HostSimulator
    starts: Array
    inputs: Array
    durations: Array


def _run(job: Job) -> Array:
    """States along every window, (V, W, H + 1, n_i)."""
    variants, count, width = job.starts.shape
    path = np.empty((variants, count, job.inputs.shape[1] + 1, width))
    path[:, :, 0] = job.starts
    for k in range(job.inputs.shape[1]):
        path[:, :, k + 1] = integrate_rows(
            job.host,
            path[:, :, k].reshape(-1, width),
            np.concatenate([job.inputs[:, k]] * variants),
            np.tile(job.durations[:, k], variants),
        ).reshape(variants, count, width)
    return path


def run(jobs: Sequence[Job]) -> list[Array]:
    """States along every window of every job, shared among processes inside ``workers``."""
    pieces: list[Job] = []
    owners: list[int] = []
    for number, job in enumerate(jobs):
        variants, count, _ = job.starts.shape
        size = max(1, PIECE // variants)
        for a in range(0, count, size):
            part = slice(a, a + size)
            pieces.append(Job(job.host, job.starts[:, part], job.inputs[part], job.durations[part]))
            owners.append(number)
    done = each(_run, pieces)
    return [
        np.concatenate([path for path, own in zip(done, owners, strict=True) if own == number], 1)
        for number in range(len(jobs))
    ]


def job(model: Model, theta: Array, data: WindowData, starts: Array) -> Job:
    """The work of shooting all windows from physical start states (V, W, n_p)."""
    samples, index = data.samples, data.windows.index
    host = model.bind(theta)
    inputs = model.inputs(samples, theta[None])[0]
    own = len(host.integrated_channels)
    if own > model.physical:
        first = index[:, 0]
        before = samples.actions[np.maximum(first - 1, 0)]
        starts = np.stack([host.augment(s, before)[:, :own] for s in starts])
    return Job(host, starts, inputs[index[:, :-1]], samples.durations[index[:, :-1]])


def shown(job: Job, path: Array, measured: NDArray[np.int64]) -> Array:
    """What the sensors show of paths (V, W, L, n_i), (V, W, L, m)."""
    flat = path.reshape(-1, path.shape[-1])
    return job.host.sense(flat).reshape(path.shape)[..., measured]


def simulate(model: Model, theta: Array, data: WindowData, starts: Array) -> Array:
    """What the sensors show along windows from start states (V, W, n_p), (V, W, L, m)."""
    one = job(model, theta, data, starts)
    return shown(one, run([one])[0], data.samples.measured)


def foretold(model: Model, theta: Array, data: WindowData, starts: Array, steps: int) -> Array:
    """The same along windows and so many rows beyond, from (W, n_p), (W, L + steps, m)."""
    rows = rows_ahead(data, steps)[:, :-1]
    one = job(model, theta, data, starts[None])
    inputs = model.inputs(data.samples, theta[None])[0]
    whole = Job(one.host, one.starts, inputs[rows], data.samples.durations[rows])
    return shown(whole, run([whole])[0], data.samples.measured)[0]


def residual(data: WindowData, starts: Array, shown: Array) -> Array:
    """Whitened residual, zero where nothing was measured, and the doubts below it, (W, R)."""
    gap = (data.seen - shown) / data.sigma
    gap = np.clip(np.nan_to_num(gap, nan=0.0), -1e7, 1e7).reshape(len(data), -1)
    return np.concatenate([gap, (data.guess - starts) / data.doubt], axis=1)


def whitened(data: WindowData, change: Array) -> Array:
    """Change of what is shown (W, L, m) in units of the residual; no doubt changes, (W, R)."""
    valid = np.isfinite(data.seen)
    flat = np.where(valid, change / data.sigma, 0.0).reshape(len(data), -1)
    flat = np.clip(flat, -1e7, 1e7)
    return np.concatenate([flat, np.zeros((len(data), len(data.doubt)))], axis=1)
