"""Fits and forecasts of systems that strike the ground: short windows, each with a robust vote."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.blocks import Blocks
from residual.gap.data.samples import Recorded, Samples
from residual.gap.fitting.contract import Fit, Fitter, Foretold, Left, Told
from residual.gap.fitting.impacts.ahead import inside, rows_ahead
from residual.gap.fitting.impacts.columns import candidate_changes, slopes
from residual.gap.fitting.impacts.known_states import sharpened
from residual.gap.fitting.impacts.noise import with_noise
from residual.gap.fitting.impacts.profile import by_profile
from residual.gap.fitting.impacts.refine import Refined, grown, improved, level, settle
from residual.gap.fitting.impacts.robust import weights
from residual.gap.fitting.impacts.single_shooting import StartFit, WindowData, foretold
from residual.gap.fitting.impacts.start_states import begun, descend
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
#: Steps of strengths, of few of them, of states that are known, and of many and of a model that was
#: fitted before.
STEPS, KNOWN, MANY = 4, 2, 4
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
        known: The nominal simulator fitted to these windows, if it was.
    """

    data: WindowData
    blocks: Blocks
    horizon: int
    scale: Array
    limit: Array
    known: StartFit | None = None

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
        again = near is not None and len(near.theta) == len(theta)
        turns = 1 if again or len(theta) >= MANY else STEPS
        turns = turns if data.ahead is not None else KNOWN
        if near is None:
            found = improved(self._begun(model, theta), data, turns)
        else:
            inner = near.inner.fitted
            every = [
                improved(settle(model, start, data, inner.starts, 1, inner.by_start), data, turns)
                for start in (_starts(model, theta) if not len(near.theta) else [theta])
            ]
            found = min(every, key=lambda one: one.total)
        if data.known.all():
            found = sharpened(found, data, self.scale, turns)
        if near is None:
            return self._as_fit(found, found.loss)
        found, gain = level(found, near.inner, data)
        return self._as_fit(found, near.loss - gain)

    def _begun(self, model: Model, theta: Array) -> Refined:
        """Start states from nothing, or of the nominal simulator from where they were found."""
        data, fitted = self.data, None if len(theta) else self.known
        if fitted is None:
            return grown(model, theta, data, data.guess)
        return settle(model, theta, data, fitted.starts, 1, fitted.by_start)

    def as_fit(self, model: Model, theta: Array, fitted: StartFit) -> Fit:
        """A model whose start states have been found."""
        found = Refined.of(model, theta, fitted, self.data)
        return self._as_fit(found, found.loss)

    def _as_fit(self, found: Refined, loss: Array) -> Fit:
        data, fitted = self.data, found.fitted
        basis, _ = np.linalg.qr(fitted.by_start)
        inner = basis.transpose(0, 2, 1)
        changes = found.slopes
        if changes is None or data.ahead is None:
            changes = slopes(found.model, found.theta, data, fitted, found.ahead)
        window = changes.window - basis @ (inner @ changes.window)
        projected = fitted.residual - (basis @ (inner @ fitted.residual[..., None]))[..., 0]
        weight = weights(fitted.costs, data.freedom)
        told = None
        if data.ahead is not None:
            own, beyond = (np.sqrt(w) for w in (weight, weights(found.costs_ahead, data.freedom)))
            told = Told(
                np.concatenate([projected * own[:, None], found.ahead * beyond[:, None]], axis=1),
                np.concatenate(
                    [window * own[:, None, None], changes.ahead * beyond[:, None, None]], axis=1
                ),
                basis.shape[2],
            )
        return Fit(
            found.model, found.theta, loss, weight, projected, window, basis, True, found, told
        )

    def profiled(self, fit: Fit) -> Fit:
        """See ``Fitter.profiled``; states that are known leave nothing to luck."""
        if self.data.ahead is None or fit.spread is not None or not len(fit.theta):
            return fit
        found, spread = by_profile(fit.inner, self.data, self.blocks.block)
        found, gain = level(found, fit.inner, self.data)
        found = dataclasses.replace(found, slopes=fit.inner.slopes)
        return dataclasses.replace(self._as_fit(found, fit.loss - gain), spread=spread)

    def resumed(self, model: Model, theta: Array, near: Fit) -> Fit:
        """See ``Fitter.resumed``."""
        return self.fit(model, theta, near)

    def columns(self, fit: Fit, candidates: Sequence[Candidate]) -> Array:
        """See ``Fitter.columns``."""
        return candidate_changes(fit.model, fit.theta, self.data, fit.inner.fitted, candidates)

    def foretell(self, model: Model, thetas: Array, which: NDArray[np.int64], fit: Fit) -> Foretold:
        """See ``Fitter.foretell``: from the end of every window on, in the same run."""
        rows = rows_ahead(self.data, self.horizon)
        seen = self.samples.seen[rows][..., self.samples.measured]
        found = np.full(seen.shape, np.nan)
        for number in np.unique(which):
            own = np.flatnonzero(which == number)
            theta, part, near = thetas[number], self.data.take(own), fit.inner.fitted.take(own)
            starts = near.starts
            if len(theta):
                here = begun(model, theta, part, starts, near.by_start)
                starts = descend(model, theta, part, here).starts
            found[own] = foretold(model, theta, part, starts, self.horizon)
        there = inside(self.data, rows)
        square = np.where(there, np.minimum((seen - found) ** 2, self.limit), np.nan)
        size = self.data.windows.index.shape[1]
        middle = size + self.horizon // 2
        return Foretold(_mean(square[:, size:]), _mean(square[:, size:middle]), found[:, :size])

    def redrawn(self, fit: Fit, sigma: Array, rng: np.random.Generator) -> ImpactFitter:
        """See ``Fitter.redrawn``; forecasts overlap, so each window becomes a run of its own."""
        rows, samples = rows_ahead(self.data, self.horizon), self.samples
        starts = fit.inner.fitted.starts
        clean = foretold(fit.model, fit.theta, self.data, starts, self.horizon)
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
        laid = lay_out(fit.model.simulator, drawn, cut, exact)
        data = with_noise(laid, self.sigma, self.scale)
        data = dataclasses.replace(data, ahead=self.data.ahead)
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


def _starts(model: Model, theta: Array) -> list[Array]:
    """Where numbers begin beside nothing: at zero, since what the screen proposes overshoots; and
    what is bold from there, too."""
    linear = [c.linear & (not c.rough) for c in model.chosen]
    bold = [np.full(len(c.linear), c.bold is not None) for c in model.chosen]
    zero, also = (np.concatenate([*some, []]) > 0 for some in (linear, bold))
    at_zero, boldly = np.where(zero, 0.0, theta), np.where(zero & ~also, 0.0, theta)
    return [at_zero, boldly] if (zero & also).any() else [at_zero]


def _mean(values: Array) -> Array:
    """Mean over the samples of every window, NaN where there are none, (W, m)."""
    there = np.isfinite(values)
    count = there.sum(axis=1)
    total = np.where(there, values, 0.0).sum(axis=1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
