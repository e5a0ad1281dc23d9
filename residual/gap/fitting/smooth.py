"""Fits and forecasts of systems without impacts: lifted multiple shooting over whole windows."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.blocks import Blocks
from residual.gap.data.samples import Samples
from residual.gap.fitting import shooting
from residual.gap.fitting.adequacy import ERRORS, remainder
from residual.gap.fitting.chance import TIE, threshold
from residual.gap.fitting.columns import columns
from residual.gap.fitting.contract import Fit, Fitter, Foretold, Left
from residual.gap.fitting.linearised import ShootingFit, capped
from residual.gap.fitting.noise import Floor, Noise
from residual.gap.fitting.screening import Signatures
from residual.gap.fitting.starts import starts
from residual.gap.fitting.where import Where, locate
from residual.gap.model.candidates import Candidate
from residual.gap.model.model import Model

Array = NDArray[np.float64]

#: Part of a window that a forecast's start state is fitted to, and its least number of samples.
LEAD, LEAST = 0.25, 5
#: Forecast errors count up to so many times the spread of a channel: a forecast that runs away
#: is as wrong as one that is merely lost.
LOST = 3.0


@dataclasses.dataclass(frozen=True)
class SmoothFitter:
    """See ``residual.gap.fitting.contract.Fitter``.

    Args:
        samples: The table.
        blocks: Windows in blocks and folds.
        nodes: First guess of the physical state at every row, (n, n_p).
        by_state: Derivative of each row's next state by it, (n, n_p, n_p).
        sigma: Weight of every measured channel: an error of this size counts one, (m,).
        scale: Typical variation of every physical state, (n_p,).
        cap: Cost above which a window counts only by its logarithm.
        turns: Gauss-Newton iterations of a fit.
        lead_part: Part of a window that a forecast's start state is fitted to.
    """

    samples: Samples
    blocks: Blocks
    nodes: Array
    by_state: Array
    sigma: Array
    scale: Array
    cap: float = np.inf
    turns: int = 8
    lead_part: float = LEAD

    @property
    def seconds(self) -> float:
        """See ``Fitter.seconds``: whole windows, lead-ins included."""
        index, times = self.blocks.windows.index, self.samples.times
        return float(np.median(times[index[:, -1]] - times[index[:, 0]]))

    def with_substeps(self, count: int) -> SmoothFitter:
        """The same with so many integration steps between rows."""
        return dataclasses.replace(self, samples=dataclasses.replace(self.samples, substeps=count))

    def halved(self) -> SmoothFitter:
        """See ``Fitter.halved``."""
        return self.with_substeps(2 * self.samples.substeps)

    def from_longer_leads(self) -> SmoothFitter:
        """See ``Fitter.from_longer_leads``."""
        return dataclasses.replace(self, lead_part=2 * self.lead_part)

    def weighed_like(self, other: Fitter) -> SmoothFitter:
        """See ``Fitter.weighed_like``."""
        return dataclasses.replace(self, sigma=self.samples.of_these(other.samples, other.sigma))

    def fit(self, model: Model, theta: Array, near: Fit | None = None) -> Fit:
        """See ``Fitter.fit``; always from the measured path, since a rival's may mislead.

        Where that leads nowhere, once more from forecasts by what was found.
        """
        theta = np.clip(theta, model.low, model.high)
        nodes = model.widen(self.samples, self.nodes, theta)
        known = self.by_state if model.width == self.by_state.shape[1] else None
        found = self._shot(model, nodes, theta, known, 0.3)
        if len(theta) and not found.converged:
            again = self._shot(model, found.nodes, found.theta, None, 0.05)
            found = again if again.merit <= found.merit else found
        if len(theta) and not found.converged:
            again = self._shot_from_forecasts(model, found.theta, found)
            found = again if again.merit < found.merit else found
        return self._as_fit(found)

    def on_measured_path(self, model: Model) -> Fit:
        """The linear picture of a model without unknowns around the measured path: it holds however
        far from that its own path is, as long as little hangs on the state."""
        nodes = model.widen(self.samples, self.nodes, np.zeros(0))
        return self._as_fit(self._shot(model, nodes, np.zeros(0), None, 0.3, turns=0))

    def from_forecasts(self, model: Model, theta: Array, near: Fit) -> Fit:
        """Numbers of least loss from ``theta`` and its forecasts of all windows on: where motion
        begins and stops, the measured path tells a linear picture little."""
        theta = np.clip(theta, model.low, model.high)
        return self._as_fit(self._shot_from_forecasts(model, theta, near.inner))

    def _shot_from_forecasts(self, model: Model, theta: Array, near: ShootingFit) -> ShootingFit:
        return self._shot(model, self._foretold(model, theta, near), theta, None, 0.05)

    def _foretold(self, model: Model, theta: Array, near: ShootingFit) -> Array:
        """Nodes on forecasts from the lead-ins of all windows, (n, n_s)."""
        windows, which = self.blocks.windows, np.zeros(len(self.blocks.windows), np.int64)
        first, steps = windows.index[:, 0], windows.index.shape[1] - 1
        begun = starts(self, model, theta[None], which, near.nodes[first])
        path = model.roll(self.samples, first, begun, steps, theta)
        nodes = np.array(model.widen(self.samples, self.nodes, theta))
        sound = windows.inside & np.isfinite(path).all(axis=2)
        nodes[windows.index[sound]] = path[sound]
        return nodes

    def profiled(self, fit: Fit) -> Fit:
        """See ``Fitter.profiled``: slopes say it all."""
        return fit

    def resumed(self, model: Model, theta: Array, near: Fit) -> Fit:
        """See ``Fitter.resumed``."""
        nodes = model.widen(self.samples, near.inner.nodes[:, : model.physical], theta)
        return self._as_fit(self._shot(model, nodes, theta, None, 0.05))

    def _shot(
        self, model: Model, nodes: Array, theta: Array, by_state: Array | None, widths: float,
        turns: int | None = None,
    ) -> ShootingFit:  # fmt: skip
        return shooting.fit(
            model, self.samples, self.blocks.windows, nodes, theta, self.sigma,
            model.scales(self.scale), self.turns if turns is None else turns, self.cap, widths,
            by_state=by_state,
        )  # fmt: skip

    def _as_fit(self, found: ShootingFit) -> Fit:
        return Fit(
            found.model, found.theta, capped(found.costs, self.cap), found.weights,
            found.projected, found.by_knob, found.basis, found.converged, found,
        )  # fmt: skip

    def columns(
        self, fit: Fit, candidates: Sequence[Candidate], share: Array | None = None
    ) -> Array:
        """See ``Fitter.columns``."""
        return columns(self, fit, candidates, share)

    def redrawn(self, fit: Fit, sigma: Array, rng: np.random.Generator) -> SmoothFitter:
        """See ``Fitter.redrawn``."""
        samples, windows = self.samples, self.blocks.windows
        first = windows.index[:, 0]
        start = fit.inner.nodes[first]
        which = np.zeros(len(windows), np.int64)
        length = windows.index.shape[1]
        clean = self.shown(fit.model, first, start, length - 1, fit.theta[None], which)
        noisy = clean + sigma * rng.standard_normal(clean.shape)
        seen = np.full_like(samples.seen, np.nan)
        for i, column in enumerate(samples.measured):
            there = windows.inside & np.isfinite(samples.seen[windows.index, column])
            seen[windows.index[there], column] = noisy[..., i][there]
        return dataclasses.replace(self, samples=dataclasses.replace(samples, seen=seen))

    def left(self, fit: Fit, floor: Noise) -> Left:
        """See ``Fitter.left``: in every fold, and no generic force to be seen."""
        assert isinstance(floor, Floor)
        samples, windows = self.samples, self.blocks.windows
        found = remainder(fit.inner, samples, windows, self.sigma, floor, self.scale)
        worst = float(np.max(found.ratio))
        return Left(
            found.adequate and self._quiet_in_every_fold(fit, floor), worst, found.force,
            tuple(float(r) for r in found.ratio),
        )  # fmt: skip

    def over_noise(self, fit: Fit, sigma: Array) -> Array:
        """Residual of every measured channel over its noise ``sigma``, (m,)."""
        square = fit.projected.reshape(*self.blocks.windows.index.shape, -1) ** 2
        count = np.maximum(self.valid.sum(axis=(0, 1)), 1)
        return np.sqrt(square.sum(axis=(0, 1)) / count) * self.sigma / sigma

    def noise_alone(self, sigma: Array) -> float:
        """Loss where nothing but noise ``sigma``, (m,), is left."""
        return float((self.valid.sum(axis=(0, 1)) * (sigma / self.sigma) ** 2).sum())

    def _quiet_in_every_fold(self, fit: Fit, floor: Floor) -> bool:
        """Whether no fold of the data has a residual beyond noise."""
        windows = self.blocks.windows
        count, length = windows.index.shape
        square = fit.projected.reshape(count, length, -1) ** 2
        leverage = (fit.basis**2).sum(axis=2).reshape(count, length, -1)
        free = np.where(self.valid, 1 - leverage, 0.0)
        for fold in range(self.blocks.folds):
            own = self.blocks.fold_of_window == fold
            freedom = np.maximum(free[own].sum(axis=(0, 1)), 1.0)
            ratio = np.sqrt(square[own].sum(axis=(0, 1)) / freedom) * self.sigma / floor.sigma
            spread = np.sqrt((floor.error / floor.sigma) ** 2 + 0.5 / freedom)
            if (ratio > 1 + (ERRORS + 1) * spread).any():
                return False
        return True

    def where(self, nominal: Fit, floor: Noise) -> Where:
        """See ``Fitter.where``."""
        assert isinstance(floor, Floor)
        return locate(
            Model(nominal.model.simulator), self.samples, self.blocks.windows, nominal, self.sigma,
            self.left(nominal, floor).by_channel, floor,
        )  # fmt: skip

    def needed(self, around: Callable[[], Signatures], nominal: Fit) -> float:
        """See ``Fitter.needed``: what noise alone reaches once in a thousand logs."""
        return threshold(around(), int(self.valid.sum()))

    def tie(self, nominal: Fit) -> float:
        """See ``Fitter.tie``: what a true rival falls short by once in a thousand logs."""
        return TIE

    def chance(self, one: Fit, other: Fit) -> float:
        """See ``Fitter.chance``: start states are found whatever the model."""
        return 0.0

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Where there is a measurement inside a window, (W, L, m)."""
        samples, windows = self.samples, self.blocks.windows
        seen = np.isfinite(samples.seen[:, samples.measured])[windows.index]
        return seen & windows.inside[..., None]

    @property
    def lead(self) -> NDArray[np.bool_]:
        """Samples of every window that its forecast starts from, (W, L)."""
        windows = self.blocks.windows
        lengths = windows.inside.sum(axis=1)
        count = np.maximum(np.minimum(LEAST, lengths - 1), np.round(self.lead_part * lengths))
        return np.arange(windows.index.shape[1]) < count[:, None]

    def foretell(self, model: Model, thetas: Array, which: NDArray[np.int64], fit: Fit) -> Foretold:
        """See ``Fitter.foretell``: start states by Gauss and Newton on the lead-ins."""
        samples, windows = self.samples, self.blocks.windows
        first = windows.index[:, 0]
        begun = starts(self, model, thetas, which, fit.inner.nodes[first])
        full = self.shown(model, first, begun, windows.index.shape[1] - 1, thetas, which)
        seen = samples.seen[windows.index][..., samples.measured]
        with np.errstate(over="ignore"):  # where what was redrawn ran away
            most = LOST * np.nanstd(samples.seen[:, samples.measured], axis=0)
            square = np.clip(seen - full, -most, most) ** 2
        # What happens within the lead-in counts too: a lag shows just after a record's start.
        lengths = windows.inside.sum(axis=1)
        near = np.arange(windows.index.shape[1]) < 0.5 * lengths[:, None]
        return Foretold(
            _mean(square, self.valid), _mean(square, self.valid & near[..., None]), full
        )

    def shown(
        self, model: Model, rows: NDArray[np.int64], states: Array, steps: int, thetas: Array,
        which: NDArray[np.int64],
    ) -> Array:  # fmt: skip
        """What the sensors show along rollouts, (k, steps + 1, m)."""
        path = model.roll(self.samples, rows, states, steps, thetas, which)
        if model.has_sensor:
            host = model.bind(np.repeat(thetas[which], steps + 1, axis=0))
            path = host.sense(path.reshape(-1, path.shape[2])).reshape(path.shape)
        return path[..., self.samples.measured]


def _mean(values: Array, where: NDArray[np.bool_]) -> Array:
    """Mean over the samples of every window, NaN where there are none, (W, m)."""
    count = where.sum(axis=1)
    total = np.where(where, values, 0.0).sum(axis=1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
