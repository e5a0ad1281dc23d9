"""Fits and forecasts of systems that strike the ground: short windows, each with a robust vote."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.blocks import Blocks
from residual.gap.data.samples import Recorded, Samples
from residual.gap.fitting.contract import Fit, Fitter, Foretold, Left
from residual.gap.fitting.impacts.columns import candidate_changes, chosen_changes
from residual.gap.fitting.impacts.known_states import sharpened
from residual.gap.fitting.impacts.noise import with_noise
from residual.gap.fitting.impacts.refine import (
    Refined,
    grown,
    has_short_parts,
    improved,
    level,
    refine,
)
from residual.gap.fitting.impacts.robust import weights
from residual.gap.fitting.impacts.single_shooting import (
    Job,
    StartFit,
    WindowData,
    begun,
    descend,
    job,
    run,
    shown,
)
from residual.gap.fitting.impacts.windows import lay_out
from residual.gap.fitting.noise import Noise
from residual.gap.fitting.screening import Signatures
from residual.gap.fitting.where import Where
from residual.gap.model.candidates import Candidate
from residual.gap.model.model import Model

Array = NDArray[np.float64]

#: Share of the robust loss that an effect must take off to be named. On walks of Leo by another
#: simulator effects that are not there took off at most 0.5 %, however many windows there were:
#: two good simulators differ at impacts, which no test of significance knows.
MATERIAL = 0.02
#: Share of it by which a rival must be worse to be excluded.
TIED = 0.01
#: Steps of the strengths on whole windows.
STEPS = 2
#: A forecast's squared error counts up to so many times the upper quartile of the nominal one.
LOST = 4.0


@dataclasses.dataclass(frozen=True)
class ImpactFitter:
    """See ``residual.gap.fitting.contract.Fitter``.

    Args:
        data: The windows with their noise.
        blocks: The same windows in blocks and folds.
        horizon: Forecast length in rows, beyond the window.
        scale: Usual size of every physical state, (n_p,).
        limit: Largest squared error that a forecast counts with, (m,).
    """

    data: WindowData
    blocks: Blocks
    horizon: int
    scale: Array
    limit: Array

    @property
    def samples(self) -> Samples:
        """The table."""
        return self.data.samples

    @property
    def sigma(self) -> Array:
        """Weight of every measured channel, (m,)."""
        return self.data.sigma

    @property
    def seconds(self) -> float:
        """See ``Fitter.seconds``: from the end of every window on."""
        return self.horizon * self.samples.step

    def halved(self) -> ImpactFitter:
        """See ``Fitter.halved``."""
        samples = dataclasses.replace(self.samples, substeps=2 * self.samples.substeps)
        return dataclasses.replace(self, data=dataclasses.replace(self.data, samples=samples))

    def from_longer_leads(self) -> ImpactFitter:
        """See ``Fitter.from_longer_leads``; here they start where a whole window ends."""
        return self

    def weighed_like(self, other: Fitter) -> ImpactFitter:
        """See ``Fitter.weighed_like``."""
        sigma = self.samples.of_these(other.samples, other.sigma)
        return dataclasses.replace(self, data=with_noise(self.data, sigma, self.scale))

    def fit(self, model: Model, theta: Array, near: Fit | None = None) -> Fit:
        """See ``Fitter.fit``."""
        data = self.data
        theta = np.clip(theta, model.low, model.high)
        if near is not None and len(near.theta):
            found = refine(model, theta, data, near.inner.fitted, STEPS)
        else:
            # Short parts of the windows say how strong; what long ones proposed overshoots.
            zero = [c.linear & (not c.rough and c.bold is None) for c in model.chosen]
            theta = np.where(np.concatenate([*zero, []]) > 0, 0.0, theta)
            found = improved(_first(model, theta, data, near), data, STEPS)
        if data.known.all():
            found = sharpened(found, data, self.scale, STEPS)
        if near is None:
            return self._as_fit(found, found.loss)
        found, gain = level(found, near.inner, data)
        return self._as_fit(found, near.loss - gain)

    def as_fit(self, model: Model, theta: Array, fitted: StartFit) -> Fit:
        """A model whose start states have been found."""
        found = Refined.of(model, theta, fitted, self.data)
        return self._as_fit(found, found.loss)

    def _as_fit(self, found: Refined, loss: Array) -> Fit:
        fitted = found.fitted
        basis, _ = np.linalg.qr(fitted.by_start)
        inner = basis.transpose(0, 2, 1)
        changes = chosen_changes(found.model, found.theta, self.data, fitted)
        return Fit(
            found.model, found.theta, loss, weights(fitted.costs, self.data.freedom),
            fitted.residual - (basis @ (inner @ fitted.residual[..., None]))[..., 0],
            changes - basis @ (inner @ changes), basis, True, found,
        )  # fmt: skip

    def resumed(self, model: Model, theta: Array, near: Fit) -> Fit:
        """See ``Fitter.resumed``."""
        return self.fit(model, theta, near)

    def columns(self, fit: Fit, candidates: Sequence[Candidate]) -> Array:
        """See ``Fitter.columns``."""
        return candidate_changes(fit.model, fit.theta, self.data, fit.inner.fitted, candidates)

    def foretell(self, model: Model, thetas: Array, which: NDArray[np.int64], fit: Fit) -> Foretold:
        """See ``Fitter.foretell``: from the end of every window on, in the same run."""
        rows = self._ahead()
        seen = self.samples.seen[rows][..., self.samples.measured]
        found = np.full(seen.shape, np.nan)
        for number in np.unique(which):
            own = np.flatnonzero(which == number)
            theta = thetas[number]
            part = self.data.take(own)
            near = fit.inner.fitted.take(own)
            starts = near.starts
            if len(theta):
                here = begun(model, theta, part, starts, near.by_start)
                starts = descend(model, theta, part, here).starts
            one = job(model, theta, part, starts[None])
            inputs = model.inputs(self.samples, theta[None])[0]
            whole = Job(
                one.host, one.starts, inputs[rows[own, :-1]], self.samples.durations[rows[own, :-1]]
            )
            found[own] = shown(whole, run([whole])[0], self.samples.measured)[0]
        square = np.where(self._inside(rows), np.minimum((seen - found) ** 2, self.limit), np.nan)
        size = self.data.windows.index.shape[1]
        middle = size + self.horizon // 2
        return Foretold(_mean(square[:, size:]), _mean(square[:, size:middle]), found[:, :size])

    def _ahead(self) -> NDArray[np.int64]:
        """Rows of every window and of its forecast, (W, L + horizon)."""
        index = self.data.windows.index
        rows = index[:, :1] + np.arange(index.shape[1] + self.horizon)
        return np.minimum(rows, len(self.samples) - 1)

    def _inside(self, rows: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Which of them belong to the window's run, (W, L + horizon, 1)."""
        ends = np.array([self.samples.runs[r][1] for r in self.data.windows.run])
        index = self.data.windows.index[:, :1] + np.arange(rows.shape[1])
        return (index < ends[:, None])[..., None]

    def redrawn(self, fit: Fit, sigma: Array, rng: np.random.Generator) -> ImpactFitter:
        """See ``Fitter.redrawn``; forecasts overlap, so each window becomes a run of its own."""
        rows, samples = self._ahead(), self.samples
        one = job(fit.model, fit.theta, self.data, fit.inner.fitted.starts[None])
        inputs = fit.model.inputs(samples, fit.theta[None])[0]
        whole = Job(one.host, one.starts, inputs[rows[:, :-1]], samples.durations[rows[:, :-1]])
        clean = shown(whole, run([whole])[0], samples.measured)[0]
        count, length = rows.shape
        flat = rows.ravel()
        seen = np.full((count * length, samples.seen.shape[1]), np.nan)
        noisy = clean + sigma * rng.standard_normal(clean.shape)
        seen[:, samples.measured] = noisy.reshape(count * length, -1)
        seen[np.isnan(samples.seen[flat])] = np.nan
        begins = np.arange(count) * length
        drawn = dataclasses.replace(
            samples, seen=seen, actions=samples.actions[flat], durations=samples.durations[flat],
            # Rows beyond a run's end are its last one again, so times are counted anew.
            times=np.tile(samples.step * np.arange(length), count), names=("drawn",) * count,
            runs=tuple((int(a), int(a) + length) for a in begins),
            recorded=tuple(
                Recorded(samples.actions[r], samples.durations[r], np.arange(length)) for r in rows
            ),
        )  # fmt: skip
        size = self.data.windows.index.shape[1]
        cut = [(k, int(a), int(a) + size) for k, a in enumerate(begins)]
        exact = bool(self.data.known.all())
        data = with_noise(lay_out(fit.model.simulator, drawn, cut, exact), self.sigma, self.scale)
        blocks = dataclasses.replace(self.blocks, windows=data.windows)
        return dataclasses.replace(self, data=data, blocks=blocks)

    def left(self, fit: Fit, floor: Noise) -> Left:
        """See ``Fitter.left``.

        The noise is estimated from the windows themselves, most of which hold no impact, so that
        nothing is ever left of it: chance decides, with a material share in place of its level.
        """
        count, length = self.blocks.windows.index.shape
        measured = len(self.sigma)
        square = fit.inner.fitted.residual[:, : length * measured].reshape(count, length, -1) ** 2
        portion = float(self.data.freedom.mean()) / (length * measured)
        by_channel = np.sqrt(np.median(square.mean(axis=1), axis=0) / portion)
        ratio = float(np.sqrt(np.median(fit.inner.fitted.costs / self.data.freedom)))
        return Left(True, ratio, "", tuple(float(r) for r in by_channel))

    def needed(self, around: Callable[[], Signatures], nominal: Fit) -> float:
        """See ``Fitter.needed``."""
        return MATERIAL * nominal.merit

    def tie(self, nominal: Fit) -> float:
        """See ``Fitter.tie``."""
        return TIED * nominal.merit

    def chance(self, one: Fit, other: Fit) -> float:
        """See ``Fitter.chance``: two standard errors over the windows."""
        change = one.loss - other.loss
        return 2 * float(np.sqrt(len(change)) * change.std())

    def where(self, nominal: Fit, floor: Noise) -> Where:
        """See ``Fitter.where``; impacts leave no smooth force to be drawn."""
        samples = self.samples
        channels = nominal.model.simulator.physical_channels
        left = nominal.inner.fitted.costs / self.data.freedom
        return Where(
            by_channel={
                channels[c].name: ratio
                for c, ratio in zip(
                    samples.measured, self.left(nominal, floor).by_channel, strict=True
                )
            },
            profiles=(),
            lags_s=np.zeros(0),
            lag_correlation={},
            run_ratio={
                samples.names[r]: float(np.sqrt(np.median(left[self.blocks.windows.run == r])))
                for r in np.unique(self.blocks.windows.run)
            },
        )


def _first(model: Model, theta: Array, data: WindowData, near: Fit | None) -> Refined:
    """A first fit of strengths and start states; the nominal one, while nothing acts yet."""
    if near is None or theta.any() or has_short_parts(data):
        return grown(model, theta, data, data.guess)
    return dataclasses.replace(near.inner, model=model, theta=theta)


def _mean(values: Array) -> Array:
    """Mean over the samples of every window, NaN where there are none, (W, m)."""
    there = np.isfinite(values)
    count = there.sum(axis=1)
    total = np.where(there, values, 0.0).sum(axis=1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
