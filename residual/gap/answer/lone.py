"""Stretches of a log that hold most of the error and that nothing explains: a hand, a knock.

Sums of squares let one block outweigh all others. What happened in it is then all that is asked
about, and if no effect hosts it, nothing is named, however clear the rest of the log is. One block
is no evidence, neither for an effect nor against all of them: so it is told, and the rest is asked.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.answer.confirmed import Answer
from residual.gap.data.blocks import ENOUGH, Blocks
from residual.gap.data.stretch import MOVES, Stretch
from residual.gap.fitting.contract import Fitter
from residual.gap.fitting.forecasts import main_channel
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.fitting.validation import by_block
from residual.gap.search.comparisons import takes_off
from residual.trajectories import moment

Array = NDArray[np.float64]

#: Share of the nominal simulator's squared error, all joints averaged, that lies in one block.
MOST = 0.5
#: Part of its error in that block up to which a set explains it.
HARDLY = 0.7
#: Part of the nominal simulator's squared error that is worth a word if it is left in one block.
MUCH = 0.1
#: Part of what is left that lies in a few blocks, how few of all that is, and how many are listed.
NEARLY_ALL, FEW, LISTED = 0.8, 1 / 3, 4
#: Seconds of a day, how many of them show an hour, and how near to one hour that is, in days.
DAY, DAYS, AN_HOUR = 86_400.0, 3, 0.05
#: Error over that by noise of a block in which a simulator is clearly off, and up to which most are
#: as good as right.
OFF, NEAR = 2.0, 1.3


def lone_stretch(answer: Answer) -> Stretch | None:
    """The block that holds most of the error, if what was named leaves it nearly as it was.

    Args:
        answer: What was found with all of the log.
    """
    if not _many_blocks(answer):
        return None
    stakes, left = _by_block(answer)
    block = int(np.argmax(stakes))
    if stakes[block] <= MOST * stakes.sum() or left[block] < HARDLY * stakes[block]:
        return None
    return _stretch(answer, block, stakes)


def left_stretch(answer: Answer) -> Stretch | None:
    """The block that holds most of what is left beside what was named, if that is much.

    Args:
        answer: What was found, and not for want of a stretch.
    """
    if not answer.key or not _many_blocks(answer):
        return None
    stakes, left = _by_block(answer)
    block = int(np.argmax(left))
    if left[block] <= MOST * left.sum() or left[block] < MUCH * stakes.sum():
        return None
    return _stretch(answer, block, left, beside=True)


def off_stretch(answer: Answer) -> str:
    """A sentence on the block in which the simulator is clearly off where the log as a whole shows
    next to nothing; none if there is none, or something was named."""
    if answer.key or not _many_blocks(answer):
        return ""
    search, alone = answer.found.search, answer.found.by_noise(())
    measured, squares = search.fitter.samples.measured, search.before.squares
    main = main_channel(search.simulator, measured, squares, alone)
    times = np.sqrt(squares[:, main] / np.maximum(alone[:, main], 1e-300))
    times = np.where(np.isfinite(times), times, 0.0)
    block = int(np.argmax(times))
    if times[block] < OFF or np.median(times) > NEAR:
        return ""
    one = _stretch(answer, block, squares[:, main])
    return (
        f"{one.run} from {moment(one.begin)} to {moment(one.end)}: the simulator errs "
        f"{times[block]:.2g} times as much there as by noise, and elsewhere hardly more than that. "
        "What is missing may show in motion of that kind alone: log more of it"
    )


def few_stretches(answer: Answer) -> str:
    """A sentence on the few blocks in which nearly all lies that is left, beside less motion; none
    if it is spread over the log, or no more than noise.

    Args:
        answer: Of which no single block tells.
    """
    if not _many_blocks(answer) or answer.left.adequate:
        return ""
    _, left = _by_block(answer)
    order = np.argsort(-left)
    count = int(np.searchsorted(np.cumsum(left[order]), NEARLY_ALL * left.sum())) + 1
    worst = [_stretch(answer, int(block), left, beside=True) for block in order[:count]]
    share = sum(one.share for one in worst)
    if not 1 < count <= FEW * len(left) or sum(one.motion for one in worst) > MOVES * share:
        return ""
    told = sorted(worst[:LISTED], key=lambda one: (one.run, one.begin))
    places = ", ".join(f"{o.run} from {moment(o.begin)} to {moment(o.end)}" for o in told)
    more = f" and {count - LISTED} more" if count > LISTED else ""
    asks = (
        "They come at one hour of the day: is there something that goes by it, as the sun does?"
        if daily(worst)
        else "Did something happen there that the simulator does not know?"
    )
    return (
        f"{share:.0%} of the squared error that is left lies in {count} of {len(left)} stretches: "
        f"{places}{more}. {asks}"
    )


def daily(stretches: Sequence[Stretch]) -> bool:
    """Whether three stretches or more of one run come at one hour of as many days."""
    begins = np.sort([one.begin for one in stretches])
    days = np.diff(begins) / DAY
    same = len({one.run for one in stretches}) == 1 and len(begins) >= DAYS
    return bool(same and (np.abs(days - np.round(days)) < AN_HOUR).all() and (days > 0.5).all())


def _many_blocks(answer: Answer) -> bool:
    fitter = answer.found.search.fitter
    return isinstance(fitter, SmoothFitter) and len(fitter.blocks) >= ENOUGH


def _by_block(answer: Answer) -> tuple[Array, Array]:
    """Squared error of the nominal simulator and of the answer by block, joints averaged, (B,)."""
    search = answer.found.search
    before, after = search.before.squares, search.validated[answer.key].squares
    currency = search.currency
    return currency.in_blocks(before), currency.in_blocks(after)


def _stretch(answer: Answer, block: int, errors: Array, beside: bool = False) -> Stretch:
    fitter = answer.found.search.fitter
    windows, samples = fitter.blocks.windows, fitter.samples
    own = fitter.blocks.block == block
    rows = windows.index[own][windows.inside[own]]
    run = samples.names[int(windows.run[own][0])]
    begin, end = float(samples.times[rows.min()]), float(samples.times[rows.max()])
    share = float(errors[block] / errors.sum())
    return Stretch(run, begin, end, share, float(_motion(fitter)[block]), beside)


def _motion(fitter: Fitter) -> Array:
    """Every block's part of the squared motion, (B,), all channels averaged.

    Motion is the way from the start of a window, or the distance from the straight line between its
    two ends, whichever the block has more of: a wheel at an even speed goes far, and shows nothing
    of what set it in motion.
    """
    samples, windows = fitter.samples, fitter.blocks.windows
    seen = samples.seen[windows.index][..., samples.measured]
    way = np.where(windows.inside[..., None], seen - seen[:, :1], np.nan)
    last = windows.inside.sum(axis=1) - 1
    along = np.arange(way.shape[1])[None, :, None] / np.maximum(last, 1)[:, None, None]
    bend = way - along * way[np.arange(len(way)), last][:, None]
    return np.maximum(_shares(way, fitter.blocks), _shares(bend, fitter.blocks))


def _shares(distance: Array, blocks: Blocks) -> Array:
    """Every block's part of squared distances (W, L, m) that may be unknown, (B,)."""
    there = np.isfinite(distance)
    mean = (np.where(there, distance, 0.0) ** 2).sum(axis=1) / np.maximum(there.sum(axis=1), 1)
    squares = by_block(mean, blocks)
    return np.nanmean(squares / np.maximum(np.nansum(squares, axis=0), 1e-300), axis=1)


def explains_the_rest(second: Answer) -> bool:
    """Whether something was named without the stretch, and forecasts the rest materially better."""
    search = second.found.search
    before, after = search.before.squares, search.validated[second.key].squares
    gained, error = search.currency.difference(before, after)
    return bool(second.key) and gained > error and takes_off(search.currency, before, after)
