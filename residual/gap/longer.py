"""How far forecasts go if the usual length shows too little."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from residual.gap.answer.answer import summed_up, within_noise
from residual.gap.answer.confirmed import Answer
from residual.gap.fitting.contract import Fit, Fitter
from residual.gap.fitting.forecasts import most_beside_noise, noise_floor
from residual.gap.fitting.validation import validate
from residual.gap.log import Log
from residual.gap.model.model import Model
from residual.gap.preparation.horizon import (
    FEWER,
    PART,
    WINDOWS,
    longest_horizon,
    usual_horizon,
)
from residual.gap.preparation.prepare import prepare
from sims.host import HostSimulator
from sims.simulator import Channel

Array = NDArray[np.float64]

#: By how much longer forecasts have to be to show something else.
LONGER = 1.25
#: Windows of the longest forecasts, the most first; error over that by noise, over that of usual
#: forecasts and over the spread of the channel, from which on a slow error shows though they are
#: as few.
FEWEST, PLAIN, GROWN, MATTERS = (2, 1), 5.0, 3.0, 0.05
#: Times that these are longer, at least, where something is named, and error over that by noise.
LONGEST, BESIDE = 4.0, 3.0
#: Part of such an error that may be left where what makes it is named.
LESS = 0.7
#: Error over that by noise below which noise is overstated.
UNDER = 0.75
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


@dataclasses.dataclass(frozen=True)
class Slow:
    """An error of a corrected simulator that grows over forecasts nearly as long as the records.

    Attributes:
        horizon: Length that was asked for, in s, and ``seconds``: that forecasts have.
        place: Of the channel in which it shows, among those measured; ``channel``: itself.
        error: Root mean square of these forecasts, in the channel's unit.
        usual: The same over the usual length.
    """

    horizon: float
    seconds: float
    place: int
    channel: Channel
    error: float
    usual: float

    @property
    def says(self) -> str:
        """What is to be said if nothing was found for it."""
        error = f"{self.error:.3g}{self.channel.unit_text}"
        return (
            f"over {self.seconds:.3g} s the corrected simulator errs by {error} in "
            f"{self.channel.name} ({self.usual:.3g} over the length of the forecasts): what is "
            "slow may be missing (a leak, a little damping); --horizon asks over longer forecasts"
        )


def slow_remainder(log: Log, answer: Answer) -> Slow | None:
    """What the corrected simulator is plainly off by over forecasts nearly as long as the records,
    though it is not over the usual ones; None if it is not, or motion is too unstable to tell.

    Over a part of a swing damping takes hardly anything off, and over many it takes half.

    Args:
        log: What was asked about, and how far its forecasts went.
        answer: In which something is named.
    """
    usual = np.sqrt(np.nanmean(answer.found.search.validated[answer.key].squares, axis=0))
    for windows in FEWEST:
        horizon = longest_horizon(log.recorded, windows)
        if horizon < LONGEST * log.horizon:
            continue
        long = over(horizon, log, answer)
        fitter = long.fitter
        if fitter.seconds < LONGEST * answer.found.search.fitter.seconds:
            continue
        seen = fitter.samples.seen[:, fitter.samples.measured]
        spread = np.nanstd(seen, axis=0)
        grown = (long.errors > np.maximum(GROWN * usual, MATTERS * spread)) & (long.errors < spread)
        if not grown.any():
            continue  # noise need not be asked
        with np.errstate(over="ignore", invalid="ignore"):
            floor = noise_floor(fitter, long.fit, long.sigma)
        plain = grown & (long.errors > BESIDE * np.sqrt(np.nanmean(floor, axis=0)))
        if plain.any():
            place = int(np.argmax(np.where(plain, long.errors / np.where(plain, spread, 1.0), 0.0)))
            channel = long.fit.model.simulator.physical_channels[fitter.samples.measured[place]]
            sizes = float(long.errors[place]), float(usual[place])
            return Slow(horizon, fitter.seconds, place, channel, *sizes)
    return None


@dataclasses.dataclass(frozen=True)
class Long:
    """Forecasts by a corrected simulator over a length.

    Attributes:
        fitter: With these windows, and ``fit``: of the simulator as it is.
        errors: Root mean square by measured channel, (m,), and ``sigma``: the noise.
    """

    fitter: Fitter
    fit: Fit
    errors: Array
    sigma: Array


def over(horizon: float, log: Log, answer: Answer) -> Long:
    """Forecasts by what was corrected over a length in s."""
    corrected = answer.corrected
    with np.errstate(over="ignore", invalid="ignore"):  # what runs away is no slow error
        ready = prepare(corrected, log.at(horizon).runs, horizon)
        fit = ready.fitter.fit(Model(corrected), np.zeros(0))
        errors = np.sqrt(np.nanmean(validate(ready.fitter, fit).squares, axis=0))
    return Long(ready.fitter, fit, errors, ready.floor.sigma)


def slow_error(log: Log, answer: Answer) -> tuple[float, str] | None:
    """Length in s of forecasts over which the simulator is plainly off though it is not over the
    usual ones, and how that is said; None if there is none.

    What a sensor jumps by hides a slow error from short forecasts. Where records hold many of
    these, it shows in their mean, unless they err by less than noise is said to make: that is too
    much then, as of what is rounded in time. Over long ones motion may be too unstable to tell.

    Args:
        log: What was asked about, and how far its forecasts went.
        answer: In which nothing is named.
    """
    search = answer.found.search
    gap = summed_up(answer)
    overstated = gap.before.value < UNDER * gap.noise_floor.value
    if len(search.fitter.blocks) >= WINDOWS and not overstated:
        return None
    if not (answer.found.nominal_left.adequate or within_noise(gap)):
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
