"""How far forecasts go if nothing can be named over the usual length."""

from __future__ import annotations

import numpy as np

from residual.gap.answer.answer import summed_up, within_noise
from residual.gap.answer.confirmed import Answer
from residual.gap.fitting.forecasts import most_beside_noise
from residual.gap.log import Log
from residual.gap.preparation.horizon import (
    FEWER,
    PART,
    WINDOWS,
    longest_horizon,
    usual_horizon,
)
from residual.gap.preparation.prepare import prepare
from sims.host import HostSimulator

#: By how much longer forecasts have to be to show something else.
LONGER = 1.25
#: Windows of the longest forecasts, the most first; error over that by noise, over that of usual
#: forecasts and over the spread of the channel, from which on a slow error shows though they are
#: as few.
FEWEST, PLAIN, GROWN, MATTERS = (2, 1), 5.0, 3.0, 0.1
#: Draws of noise: of what swings far a few say little.
DRAWS = 16


def longer_horizon(simulator: HostSimulator, log: Log, answer: Answer) -> float | None:
    """Length in s of forecasts of which the records hold fewer, None if that is hardly more.

    The usual length, if the records were too short for it; and where there is a gap a period of the
    motion: a scale that is off by a sixth hardly shows in a third of a swing.

    Args:
        simulator: The nominal one.
        log: What was asked about, and how far its forecasts went.
        answer: In which nothing is named.
    """
    longer = usual_horizon(simulator, log.recorded, FEWER)
    if not answer.found.nominal_left.adequate and not within_noise(summed_up(answer)):
        longer = max(longer, min(log.horizon / PART, longest_horizon(log.recorded, FEWER)))
    return longer if longer >= LONGER * log.horizon else None


def slow_error(log: Log, answer: Answer) -> tuple[float, str] | None:
    """Length in s of forecasts over which the simulator is plainly off though it is not over the
    usual ones, and how that is said; None if there is none.

    What a sensor jumps by hides a slow error from short forecasts. Where records hold many of
    these, it shows in their mean; and over long ones motion may be too unstable to tell.

    Args:
        log: What was asked about, and how far its forecasts went.
        answer: In which nothing is named.
    """
    search = answer.found.search
    if len(search.fitter.blocks) >= WINDOWS:
        return None
    if not (answer.found.nominal_left.adequate or within_noise(summed_up(answer))):
        return None
    usual = np.nanmean(search.before.squares, axis=0)
    for windows in FEWEST:
        horizon = longest_horizon(log.recorded, windows)
        if horizon < LONGER * log.horizon:
            continue
        ready = prepare(search.simulator, log.at(horizon).runs, horizon)
        fitter = ready.fitter
        main, error, noise = most_beside_noise(search.simulator, fitter, ready.floor.sigma, DRAWS)
        spread = np.nanvar(fitter.samples.seen[:, fitter.samples.measured[main]])
        if error > max(PLAIN**2 * noise, GROWN**2 * usual[main], MATTERS**2 * spread):
            says = (
                f"forecasts go over {fitter.seconds:.3g} s, of which the records hold "
                f"{len(fitter.blocks)}: over {search.fitter.seconds:.3g} s noise hides a slow error"
            )
            return horizon, says
    return None
