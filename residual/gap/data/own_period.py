"""A period that a user says a log without times has, beside the simulator's own."""

from __future__ import annotations

import math

from residual.logs.checks import Finding
from sims.simulator import Simulator

#: Ratio of the two from which on it is told: a wrong period makes inertia wrong by its square.
OTHER = 1.5


def own_period(simulator: Simulator, period: float | None) -> list[Finding]:
    """That a log without times is said to have another period than the simulator.

    Nothing in a log without times can tell: a clock scales all rates and forces alike.

    Args:
        simulator: With its control period.
        period: Seconds between samples, as the user says; None if the log has times.
    """
    if period is None or abs(math.log(period / simulator.dt)) < math.log(OTHER):
        return []
    says = (
        f"period is {period:g} s, and the control period of {simulator.name} is {simulator.dt:g} "
        f"s: if the log holds a row for each of those, set period: {simulator.dt:g}; a period that "
        "is wrong by half makes gains wrong four times, and nothing else in the log tells"
    )
    numbers = {"period_s": period, "control_period_s": simulator.dt}
    return [Finding("period", "columns", says, numbers, "warning")]
