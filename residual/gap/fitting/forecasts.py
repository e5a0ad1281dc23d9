"""Forecast errors in the units of the channels: before, step by step, after, noise alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.fitting.contract import Fit, Fitter
from residual.gap.fitting.validation import by_block, validate
from residual.gap.model.model import Model
from residual.gap.result import Span
from sims.host import HostSimulator
from sims.simulator import Channel

Array = NDArray[np.float64]


def span(squares: Array, draws: int = 400) -> Span:
    """Root mean square over blocks, (B,), with a bootstrap interval over blocks."""
    known = squares[np.isfinite(squares)]
    if not len(known):
        return Span(np.nan, np.nan, np.nan)
    rng = np.random.default_rng(0)
    spread = np.sqrt(known[rng.integers(0, len(known), (draws, len(known)))].mean(axis=1))
    low, high = np.quantile(spread, [0.025, 0.975])
    return Span(float(np.sqrt(known.mean())), float(low), float(high))


def noise_floor(fitter: Fitter, fit: Fit, sigma: Array, draws: int = 4) -> Array:
    """Mean squared errors of blocks if the fitted simulator were the truth, (B, m).

    Its own data plus noise go through the same forecasts.
    """
    rng = np.random.default_rng(0)
    thetas, which = fit.theta[None], np.zeros(len(fitter.blocks.windows), np.int64)
    found = []
    for _ in range(draws):
        drawn = fitter.redrawn(fit, sigma, rng)
        squares = drawn.foretell(fit.model, thetas, which, fit).squares
        found.append(by_block(squares, fitter.blocks))
    return np.mean(found, axis=0)


def fitted_floor(fitter: Fitter, fit: Fit, sigma: Array) -> Array:
    """The same, (B, m), from start states that are fitted to the drawn data, as to a log.

    Where motion parts at impacts, most of the error comes from the little that is wrong there.
    """
    thetas, which = fit.theta[None], np.zeros(len(fitter.blocks.windows), np.int64)
    drawn = fitter.redrawn(fit, sigma, np.random.default_rng(0))
    again = drawn.fit(fit.model, fit.theta)
    return by_block(drawn.foretell(fit.model, thetas, which, again).squares, fitter.blocks)


def main_channel(
    simulator: HostSimulator, measured: NDArray[np.int64], squares: Array, floor: Array
) -> int:
    """Place of the channel whose squared error, or what is gained of it, is largest beside its
    noise, (B, m) both; rates of others are left out."""
    channels = [simulator.physical_channels[c] for c in measured]
    places = own_channels(channels)
    times = np.nanmean(squares, axis=0) / np.maximum(np.nanmean(floor, axis=0), 1e-300)
    return max(places, key=lambda i: times[i])


def own_channels(channels: Sequence[Channel]) -> list[int]:
    """Places of measured channels that are not the rate of another one that was measured."""
    names = {channel.name for channel in channels}
    return [i for i, channel in enumerate(channels) if channel.rate_of not in names]


def most_beside_noise(
    simulator: HostSimulator, fitter: Fitter, sigma: Array, draws: int = 4
) -> tuple[int, float, float]:
    """Place of the channel that shows an error of a simulator most, its mean squared forecast
    error, and that by noise alone."""
    fit = fitter.fit(Model(simulator), np.zeros(0))
    squares, floor = validate(fitter, fit).squares, noise_floor(fitter, fit, sigma, draws)
    main = main_channel(simulator, fitter.samples.measured, squares, floor)
    return main, float(np.nanmean(squares[:, main])), float(np.nanmean(floor[:, main]))


def beside_noise(simulator: HostSimulator, fitter: Fitter, sigma: Array) -> float:
    """Forecast error of a simulator over that by noise alone, of the channel that shows it most."""
    _, error, noise = most_beside_noise(simulator, fitter, sigma)
    return float(np.sqrt(error / max(noise, 1e-300)))
