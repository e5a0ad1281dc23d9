"""A log as it was read, what was found in it, and whether it is explained better otherwise."""

from __future__ import annotations

import dataclasses

from residual.gap.beside import Conventions
from residual.gap.confirmation.numerics import in_spreads
from residual.gap.fitting.validation import validate
from residual.gap.log import Log
from residual.gap.model.model import Model
from residual.gap.preparation.prepare import Prepared
from residual.gap.search.explain import Explanation
from sims.host import HostSimulator

#: Times that forecasts have to be better if a log is read otherwise to ask, and to say so.
WORTH, BETTER = 1.1, 1.35


@dataclasses.dataclass(frozen=True)
class Read:
    """A log as it was read, and what was found in it.

    Attributes:
        log: What was recorded.
        prepared: Its windows.
        found: What explains them.
        says: What is to be said of how it was read.
        conventions: What is to be looked at first.
    """

    log: Log
    prepared: Prepared
    found: Explanation
    says: tuple[str, ...] = ()
    conventions: Conventions | None = None


def error_of(ready: Prepared, nominal: HostSimulator, found: Explanation) -> float:
    """Squared forecast error with what was found, or none of it, in units of the spread."""
    fit = found.search.tried[found.key]
    chosen, own = fit.model.chosen, fit.theta
    errors = []
    for members, theta in ((chosen, own), ((), own[:0])):
        again = ready.fitter.fit(Model(nominal, members), theta)
        squares = validate(ready.fitter, again).squares
        errors.append(in_spreads(ready.fitter.samples, squares))
    return min(errors)
