"""Stretches of a log that hold most of the error and that nothing explains: a hand, a knock.

Sums of squares let one block outweigh all others. What happened in it is then all that is asked
about, and if no effect hosts it, nothing is named, however clear the rest of the log is. One block
is no evidence, neither for an effect nor against all of them: so it is told, and the rest is asked.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.answer.confirmed import Answer
from residual.gap.data.blocks import ENOUGH, Blocks
from residual.gap.fitting.contract import Fitter
from residual.gap.fitting.forecasts import main_channel
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.fitting.validation import by_block
from residual.gap.search.comparisons import takes_off
from residual.trajectories import Trajectory, moment

Array = NDArray[np.float64]

#: Share of the nominal simulator's squared error, all joints averaged, that lies in one block.
MOST = 0.5
#: Part of its error in that block up to which a set explains it.
HARDLY = 0.7
#: Part of the nominal simulator's squared error that is worth a word if it is left in one block.
MUCH = 0.1
#: Part of what is left that lies in a few blocks, how few of all that is, and how many are listed.
NEARLY_ALL, FEW, LISTED = 0.8, 1 / 3, 4
#: Error over that by noise of a block in which a simulator is clearly off, and up to which most are
#: as good as right.
OFF, NEAR = 2.0, 1.3
#: Part of the motion over that of the error, from which on it may be the motion that is not known;
#: part of the motion without which the log tells of rest alone.
MOVES, ALL = 0.5, 0.9


@dataclasses.dataclass(frozen=True)
class Stretch:
    """Where it is.

    Attributes:
        run: Name of the run.
        begin, end: Its first and last row, in s since the start of the log.
        share: Its part of the nominal simulator's squared error, or of what is left of it.
        motion: Its part of the squared motion.
        beside: Whether it is what is left beside something that was named.
    """

    run: str
    begin: float
    end: float
    share: float
    motion: float
    beside: bool = False

    @property
    def indispensable(self) -> bool:
        """Whether nearly all of the motion lies in it."""
        return self.motion > ALL

    def says(self, left_out: bool) -> str:
        """A sentence for the user."""
        error = "squared error that is left" if self.beside else "squared error"
        told = (
            f"{self.share:.0%} of the {error} lies in one stretch, {self.run} from "
            f"{moment(self.begin)} to {moment(self.end)}, and nothing that was tried explains it: "
        )
        moves = self.motion > MOVES * self.share
        told += (
            f"{self.motion:.0%} of the motion lies there, too, so that more of its kind, in other "
            "records, may tell"
            if moves
            else "was it held, knocked or reset there, or did it move so only there?"
        )
        if left_out:
            return f"{told}{'.' * moves} It was left out of everything that is said"
        return told if moves else f"{told} Look there, then leave it out or log more of its kind"

    def cut_from(self, runs: Sequence[Trajectory]) -> tuple[Trajectory, ...]:
        """The runs without it: what comes before and after are runs of their own."""
        kept: list[Trajectory] = []
        for run in runs:
            inside = (run.times >= self.begin) & (run.times <= self.end)
            if run.name != self.run or not inside.any():
                kept.append(run)
                continue
            first, last = np.flatnonzero(inside)[[0, -1]]
            for a, b in ((0, int(first)), (int(last) + 1, len(run.times))):
                if b - a > 1:
                    kept.append(run.piece(a, b))
        return tuple(kept)


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
    return (
        f"{share:.0%} of the squared error that is left lies in {count} of {len(left)} stretches: "
        f"{places}{more}. Did something happen there that the simulator does not know?"
    )


def _many_blocks(answer: Answer) -> bool:
    fitter = answer.found.search.fitter
    return isinstance(fitter, SmoothFitter) and len(fitter.blocks) >= ENOUGH


def _by_block(answer: Answer) -> tuple[Array, Array]:
    """Squared error of the nominal simulator and of the answer by block, joints averaged, (B,)."""
    search = answer.found.search
    before, after = search.before.squares, search.validated[answer.key].squares
    return (
        search.currency.by_block(before).mean(axis=1),
        search.currency.by_block(after).mean(axis=1),
    )


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
