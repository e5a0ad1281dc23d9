"""A log as it was read, what was found in it, and whether it is explained better otherwise."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

from residual.gap.beside import Conventions
from residual.gap.confirmation.numerics import forecast_error, in_spreads
from residual.gap.confirmation.rivals import CLEARLY
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

    @property
    def error(self) -> float:
        """Cross-validated squared forecast error of what was found, in units of the spread."""
        return forecast_error(self.found.search, self.found.key)

    @property
    def by_a_row(self) -> bool:
        """Whether inputs may be logged a row late, which another hold of them may look like."""
        return self.conventions is not None and self.conventions.reason == "row"

    def clearly_better_than(self, other: Read) -> bool:
        """Whether what was found in this reading forecasts clearly better."""
        return CLEARLY**2 * self.error < other.error


@dataclasses.dataclass(frozen=True)
class Asked:
    """What a log that is read otherwise is asked.

    Attributes:
        nominal: The simulator with its inputs held as they are said to be.
        explained: Searches: a simulator, windows, ``earlier``: from what an earlier search found.
        tell: Progress.
    """

    nominal: HostSimulator
    explained: Callable[..., Explanation]
    tell: Callable[[str], None]


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
