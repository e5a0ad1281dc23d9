"""The table of errors: nominal, effect by effect, corrected, and noise alone; also set aside."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.answer.calibrated import moved
from residual.gap.data.blocks import Blocks
from residual.gap.fitting.contract import Fit, Fitter, Foretold
from residual.gap.fitting.forecasts import main_channel, span
from residual.gap.fitting.smooth import LOST, SmoothFitter
from residual.gap.fitting.validation import Validated, by_block
from residual.gap.result import ChannelGap, Gap, Rollout, Span, Step
from residual.gap.search.pool import Key
from residual.gap.search.sets import Search

Array = NDArray[np.float64]

#: The step of parameters that are free within their tolerance.
BESIDE = "parameters within their tolerance"
#: Part of the largest error that counts, from which on hardly any counts in full.
NEARLY = 0.97
#: Forecasts drawn for pictures.
PICTURES = 6
#: Squared error of a block over that of noise alone, up to which it is as good as can be.
AS_GOOD_AS_NOISE = 2.0


def gap(
    search: Search, key: Key, order: Sequence[int], floor: Array, ratios: tuple[float, float]
) -> Gap:
    """Errors of the nominal and the corrected simulator on data that did not fit their numbers.

    Args:
        search: With the chosen set and its parts.
        key: The chosen set.
        order: Its members, the one that matters most first.
        floor: See ``noise_floor``.
        ratios: Residual over noise in windows, before and after.
    """
    samples, simulator = search.fitter.samples, search.simulator
    before, after = search.before, search.validated[key]
    by_channel = {}
    for i, c in enumerate(samples.measured):
        channel = simulator.physical_channels[c]
        by_channel[channel.name] = ChannelGap(
            channel.unit, span(before.squares[:, i]), span(after.squares[:, i]), span(floor[:, i])
        )
    shrunk = before.squares - after.squares if key else before.squares
    main = main_channel(simulator, samples.measured, shrunk, floor)
    name = simulator.physical_channels[samples.measured[main]].name
    steps = [Step("", by_channel[name].before)]
    if moved(search, key):
        squares = search.validated[()].squares[:, main]
        steps.append(Step(BESIDE, span(squares)))
    part: Key = ()
    rest = list(order)
    while rest:
        larger = {n: tuple(sorted((*part, n))) for n in rest}
        fitted = [n for n in rest if larger[n] in search.validated]

        def left(number: int, larger: dict[int, Key] = larger) -> float:
            return float(np.nanmean(search.validated[larger[number]].squares[:, main]))

        number = min(fitted, key=left) if fitted else rest[0]
        rest.remove(number)
        part = larger[number]
        if part not in search.validated:
            partial, theta = search.merged(key, (), drop=tuple(rest))
            search.fit(partial, theta)
        squares = search.validated[part].squares[:, main]
        steps.append(Step(search.candidates[number].label, span(squares)))
    blocks: Blocks = search.fitter.blocks
    share = search.currency.share(before.squares, after.squares, np.random.default_rng(0))
    return Gap(
        name, by_channel[name].unit, search.fitter.seconds,
        by_channel[name].before, by_channel[name].after, by_channel[name].noise_floor,
        tuple(steps), by_channel, *ratios,
        Span(*share) if key or search.beside else Span(0.0, 0.0, 0.0), len(blocks), blocks.folds,
        no_better(before.squares[:, main], after.squares[:, main], floor[:, main]),
        not simulator.has_contacts and drowned(samples.seen[:, samples.measured], floor),
    )  # fmt: skip


def drowned(seen: Array, floor: Array) -> bool:
    """Whether of all that was measured, (n, m), forecasts are no better by noise alone, their
    squared errors (B, m), than the mean is."""
    return bool((np.nanmean(floor, axis=0) > np.nanvar(seen, axis=0)).all())


def lost(search: Search, table: Gap) -> list[str]:
    """What is to be said where the nominal simulator errs by as much as any error counts."""
    samples, simulator = search.fitter.samples, search.simulator
    names = [simulator.physical_channels[column].name for column in samples.measured]
    seen = samples.seen[:, samples.measured[names.index(table.channel)]]
    most = LOST * float(np.nanstd(seen))
    if not isinstance(search.fitter, SmoothFitter) or table.before.value < NEARLY * most:
        return []
    return [
        f"nominal forecasts of {table.channel} are off by {most:.3g} {table.unit} or more, "
        f"{LOST:.0f} times the standard deviation of what was measured: every error counts as that "
        "at the most"
    ]


def no_better(before: Array, after: Array, floor: Array) -> int:
    """Blocks in which something is left to be had and nothing gained, of squared errors (B,)."""
    return int(((after >= before) & (after > AS_GOOD_AS_NOISE * floor)).sum())


def rollouts(search: Search, before: Validated, after: Validated) -> tuple[Rollout, ...]:
    """Some forecasts from the first to the last, measured, nominal and corrected."""
    samples, windows = search.fitter.samples, search.fitter.blocks.windows
    found = []
    count = min(PICTURES, len(windows))
    for w in np.unique(np.linspace(0, len(windows) - 1, count).astype(int)):
        inside = windows.inside[w]
        index = windows.index[w][inside]
        found.append(
            Rollout(
                samples.names[windows.run[w]], samples.times[index],
                samples.seen[index][:, samples.measured],
                before.foretold.shown[w][inside], after.foretold.shown[w][inside],
            )
        )  # fmt: skip
    return tuple(found)


def squares_of(fitter: Fitter, fit: Fit) -> Array:
    """Squared errors of a fit's forecasts by block and channel, (B, m)."""
    return by_block(forecasts(fitter, fit).squares, fitter.blocks)


def forecasts(fitter: Fitter, fit: Fit) -> Foretold:
    """Forecasts of a fit over all windows."""
    which = np.zeros(len(fitter.blocks.windows), np.int64)
    return fitter.foretell(fit.model, fit.theta[None], which, fit)


def held_out(gap: Gap, fitter: Fitter, before: Fit, after: Fit, floor: Array) -> Gap:
    """The same table for records that were set aside, about the channel that is furthest off there.

    Args:
        gap: Of the records that were used.
        fitter: For the records set aside.
        before, after: Nominal and corrected simulator with start states on these records.
        floor: See ``noise_floor``.
    """
    squares = [squares_of(fitter, fit) for fit in (before, after)]
    channels = before.model.simulator.physical_channels
    by_channel = {
        channels[c].name: ChannelGap(
            channels[c].unit, span(squares[0][:, i]), span(squares[1][:, i]), span(floor[:, i])
        )
        for i, c in enumerate(fitter.samples.measured)
    }
    worst = np.fmax(*squares)
    place = main_channel(before.model.simulator, fitter.samples.measured, worst, floor)
    name = list(by_channel)[place]
    main = by_channel[name]
    steps = (Step("", main.before), Step("all that was found", main.after))
    return dataclasses.replace(
        gap, channel=name, unit=main.unit, horizon_s=fitter.seconds, before=main.before,
        after=main.after, noise_floor=main.noise_floor, steps=steps, by_channel=by_channel,
        blocks=len(fitter.blocks), folds=1,
        no_better=no_better(squares[0][:, place], squares[1][:, place], floor[:, place]),
    )  # fmt: skip
