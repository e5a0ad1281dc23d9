"""Is something left that no chosen effect explains: size against the noise, and a generic force."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from residual.gap.data.carrying import carry
from residual.gap.data.samples import Samples
from residual.gap.data.windows import Windows
from residual.gap.fitting.linearised import ShootingFit
from residual.gap.fitting.noise import Floor, driven_states, push
from residual.gap.fitting.screening import flatten, project_out
from residual.gap.model.slopes import observe
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Standard errors by which a residual may exceed the noise: one in 740 does by chance alone. In
#: 72 logs without a gap the largest excess was 2.0 (studies.hidden.calibration).
ERRORS = 3.0
#: Probability below which a generic force is there. The same logs gave probabilities that are
#: uniform or a little larger, down to 0.03.
CHANCE = 1e-4
#: Probability by noise, as large as the residual, below which a force is told; and part of the
#: squared residual that it takes off from which on no probability is needed.
RARE, LARGE = 1e-3, 0.25
#: Part of the best gain of a single force from which on the plainer one is told.
NEARLY = 0.95


@dataclasses.dataclass(frozen=True)
class Remainder:
    """What a fitted model leaves.

    Attributes:
        ratio: Residual over noise for each measured channel, start states allowed for.
        error: Standard error of ``ratio`` if only noise is left.
        limit: What noise alone would reach, for each channel.
        gain: What the best of a family of generic forces would take off the cost.
        freedom: Number of functions in that family.
        chance: Probability of such a gain by noise alone.
        force: The function that gains most alone, in words; empty if none stands out.
        adequate: True if nothing is left above noise.
    """

    ratio: Array
    error: Array
    limit: Array
    gain: float
    freedom: int
    chance: float
    force: str
    adequate: bool


def generic_forces(
    simulator: HostSimulator, samples: Samples, nodes: Array, scale: Array
) -> tuple[Array, list[str]]:
    """Functions of state and input that a missing force could be made of, (n, g), and names.

    Where an angle does not run through half a wave, it shows no wave: that has no name. Nor has
    the sign of a rate or an input that never changes it.
    """
    columns: list[Array] = []
    names: list[str] = []

    def add(name: str, values: Array) -> None:
        spread = values.std()
        if np.isfinite(spread) and spread > 1e-12:
            columns.append(values / spread)
            names.append(name)

    channels = simulator.physical_channels
    for i, channel in enumerate(channels):
        x = nodes[:, i]
        if channel.angle:
            for k in (1, 2, 3, 5):
                shows = k * np.ptp(x) > np.pi
                add(f"sin({k} {channel.name})" if shows else "", np.sin(k * x))
                add(f"cos({k} {channel.name})" if shows else "", np.cos(k * x))
        size = max(float(np.std(x)), 1e-12)
        middle = 0.0 if channel.kind == "rate" else float(np.mean(x))
        z = (x - middle) / size
        add(channel.name, z)
        add(f"{channel.name}^3", z**3)
        if channel.kind == "rate":
            add(f"{channel.name} |{channel.name}|", z * np.abs(z))
            turns = float(x.min()) < 0 < float(x.max())
            add(f"sign of {channel.name}" if turns else "", np.tanh(3 * z))
            add(f"sharp sign of {channel.name}" if turns else "", np.tanh(12 * z))
    before = np.vstack([samples.actions[:1], samples.actions[:-1]])
    for start, _ in samples.runs:
        before[start] = samples.actions[start]
    for j, channel in enumerate(simulator.action_channels):
        u, past = samples.actions[:, j], before[:, j]
        size = max(float(np.std(u)), 1e-12)
        add(channel.name, u / size)
        add(f"{channel.name} |{channel.name}|", u * np.abs(u) / size**2)
        turns = float(u.min()) < 0 < float(u.max())
        add(f"sign of {channel.name}" if turns else "", np.tanh(2 * u / size))
        add(f"change of {channel.name}", (u - past) / size)
        for i, other in enumerate(channels):
            if other.kind == "rate":
                z = nodes[:, i] / max(float(np.std(nodes[:, i])), 1e-12)
                add(f"{channel.name} {other.name}^2", u * z**2 / size)
    return np.stack(columns, axis=1), names


def remainder(
    fit: ShootingFit, samples: Samples, windows: Windows, sigma: Array, floor: Floor, scale: Array
) -> Remainder:
    """Size and shape of what is left after a fit."""
    measured = samples.measured
    model = fit.model
    count, places = windows.index.shape
    valid = np.isfinite(samples.seen[:, measured])[windows.index] & windows.inside[..., None]
    leverage = (fit.basis**2).sum(axis=2).reshape(count, places, -1)
    usual = fit.weights >= 1.0
    freedom = np.where(valid, 1 - leverage, 0.0)[usual].sum(axis=(0, 1))
    square = fit.projected.reshape(count, places, -1)[usual] ** 2
    square = square.sum(axis=(0, 1)) + _beyond_cap(fit, places)
    ratio = np.sqrt(square / np.maximum(freedom, 1.0)) * sigma / floor.sigma
    own = 1 / np.sqrt(2 * np.maximum(freedom, 1.0))
    spread = np.sqrt((floor.error / floor.sigma) ** 2 + own**2)
    limit = 1 + ERRORS * spread
    values, names = generic_forces(model.simulator, samples, fit.nodes, scale)
    unit = push(model, samples)
    columns = np.einsum("nsd,ng->nsdg", unit, values).reshape(len(samples), model.width, -1)
    response = carry(windows, fit.slope.by_state, np.zeros((model.width, 0)), columns)
    shown = observe(samples, windows, fit.slope, response, sigma)
    shown = shown.reshape(count, -1, columns.shape[2])
    shown = shown - fit.basis @ (fit.basis.transpose(0, 2, 1) @ shown)
    chosen = flatten(fit.by_knob, fit.weights)
    matrix = project_out(chosen, flatten(shown, fit.weights))
    residual = project_out(chosen, flatten(fit.projected, fit.weights)[:, None])[:, 0]
    gain, rank = _gain(matrix, residual)
    variance = max(1.0, float(np.median(ratio)) ** 2)
    single = (matrix.T @ residual) ** 2 / np.maximum((matrix**2).sum(axis=0), 1e-300)
    driven = driven_states(model)
    best = _plainest(single, names * len(driven))
    chance = float(chdtrc(max(rank, 1), gain / variance))
    channel = model.simulator.physical_channels[driven[best // len(names)]].name
    where = f"{names[best % len(names)]}, acting on {channel}"
    alone = float(chdtrc(1, single[best] / variance)) * len(single)
    tells = alone < RARE or single[best] > LARGE * float(residual @ residual)
    return Remainder(
        ratio, spread, limit, gain, rank, chance, where if tells else "",
        bool((ratio < limit).all() and chance > CHANCE),
    )  # fmt: skip


def _plainest(gains: Array, names: list[str]) -> int:
    """The force with a name that takes most off alone, or one with a shorter name next to it."""
    told = np.array([bool(name) for name in names])
    most = float(np.max(gains[told]))
    near = np.flatnonzero(told & (gains >= NEARLY * most))
    return int(min(near, key=lambda place: (len(names[place]), -gains[place])))


def _beyond_cap(fit: ShootingFit, places: int) -> Array:
    """Squared residual of windows beyond the cap, counted at the cap, by channel."""
    far = fit.weights < 1.0
    square = fit.projected.reshape(len(fit.costs), places, -1)[far] ** 2
    return (square * fit.weights[far][:, None, None]).sum(axis=(0, 1))


def _gain(matrix: Array, residual: Array) -> tuple[float, int]:
    """Fall of the cost with all columns, and their rank."""
    size = np.sqrt(np.maximum((matrix**2).sum(axis=0), 1e-300))
    matrix = matrix / size
    # Squares of singular values: of columns of length one they are known down to 1e-15, and those
    # below 1e-6 of the largest are not asked for.
    squares, right = np.linalg.eigh(matrix.T @ matrix)
    keep = squares > 1e-6 * squares[-1]
    along = right[:, keep].T @ (matrix.T @ residual)
    return float((along**2 / squares[keep]).sum()), int(keep.sum())
