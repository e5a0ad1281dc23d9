"""How far forecasts go if nothing can be named over the usual length."""

from __future__ import annotations

from residual.gap.answer.answer import summed_up, within_noise
from residual.gap.answer.confirmed import Answer
from residual.gap.log import Log
from residual.gap.preparation.horizon import FEWER, PART, longest_horizon, usual_horizon
from sims.host import HostSimulator

#: By how much longer forecasts have to be to show something else.
LONGER = 1.25


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
