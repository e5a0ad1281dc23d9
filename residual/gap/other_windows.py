"""Search and confirmation in other windows of the log: without a stretch, or longer ones."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from residual.gap.answer.confirmed import Answer
from residual.gap.answer.left import names_more
from residual.gap.answer.lone import explains_the_rest, lone_stretch
from residual.gap.confirmed import Confirmed
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.log import Log
from residual.gap.longer import LESS, LONGER, longer_horizon, over, slow_error, slow_remainder
from residual.gap.model.candidates import candidates
from residual.gap.preparation.horizon import FEWER, WINDOWS, longest_horizon
from residual.gap.preparation.prepare import Prepared, prepare
from residual.gap.search.at_sight import at_sight
from residual.gap.search.measured_path import MeasuredPath
from residual.trajectories import duration_text
from sims.effects.base import Effect

if TYPE_CHECKING:
    from residual.gap.inquiry import Inquiry

#: Part of a slow error that may be left by what takes the place of names of which none is certain,
#: where more than noise is left.
HALF = 0.5
#: Part of the usual length that much shorter forecasts have, and rows at least; residual over noise
#: from which on they are tried.
PART, SAMPLES, FAR = 1 / 8, 16, 10.0


@dataclasses.dataclass(frozen=True)
class OtherWindows:
    """What asks once more of other windows, and only in time.

    Attributes:
        inquiry: Searches and confirms.
        log: What was recorded.
        tolerance: How well the simulator's parameters are known, as a share of each.
    """

    inquiry: Inquiry
    log: Log
    tolerance: float

    def without_lone_stretch(self, known: Confirmed) -> Confirmed:
        """The same, or what is found without a stretch of the log that nothing explains.

        It counts only if something is named elsewhere.
        """
        stretch = lone_stretch(known.answer)
        if stretch is None or self.inquiry.clock.searched or stretch.indispensable:
            return known
        self.inquiry.tell("once more without a stretch that nothing explains")
        simulator = known.answer.found.search.simulator
        runs = stretch.cut_from(self.log.runs)
        ready, answer = self.inquiry.asked_of(simulator, runs, self.log.horizon, self.tolerance)
        if not explains_the_rest(answer):
            return known
        return Confirmed(ready, answer, (stretch.says(left_out=True),))

    def shorter(self, known: Confirmed) -> Confirmed:
        """The same, or what is found over much shorter forecasts, where much is left.

        They are tried where nothing could be named: motion that teeth or a stop catch now and then
        goes another way after a while for the least difference, and hides its cause. And where a
        rarer effect stands out there: what moves a system far over the usual length is no small
        change there, and lies hidden.
        """
        answer, fitter = known.answer, known.answer.found.search.fitter
        horizon = PART * self.log.horizon
        step = np.median(np.concatenate([run.durations for run in self.log.recorded]))
        if not isinstance(fitter, SmoothFitter) or self.inquiry.clock.searched:
            return known
        if answer.left.ratio < FAR or horizon < SAMPLES * step:
            return known
        nothing = self._nothing_named(known)
        sought = [] if nothing else self._standing_out(known, horizon)
        if not (nothing or sought):
            return known
        ready, found = self.over(known, horizon, "much shorter forecasts")
        if not explains_the_rest(found):
            return known
        if sought and not set(sought).intersection(found.found.search.labels(found.key)):
            return known
        says = (
            f"forecasts go over {duration_text(ready.fitter.seconds)}: over "
            f"{duration_text(fitter.seconds)} motion hangs on where it begins, and "
            f"{'too little' if answer.key else 'nothing'} could be named"
        )
        return dataclasses.replace(known, prepared=ready, answer=found, why=says)

    def _standing_out(self, known: Confirmed, horizon: float) -> list[str]:
        """Labels of the rarer effects that stand out over forecasts of some length, in s; none over
        a length that a user did not ask for."""
        search, further = known.answer.found.search, self.inquiry.offered.further
        if self.log.by_user:
            return []
        fitter = prepare(search.simulator, self.log.runs, horizon).fitter
        assert isinstance(fitter, SmoothFitter)
        offered = {candidate.label for candidate in search.candidates}
        rest = [effect for effect in further if str(effect) not in offered]
        path = MeasuredPath(search.simulator, fitter, search.candidates)
        found = at_sight(path, candidates(search.simulator, rest, fitter.samples))
        return [one.label for one in found]

    def longer(self, known: Confirmed) -> Confirmed:
        """The same, or what is found over longer forecasts, of which the records hold fewer.

        They are tried where nothing could be named.
        """
        search = known.answer.found.search
        if not self._nothing_named(known):
            return known
        horizon = longer_horizon(search.simulator, self.log, known.answer)
        if horizon is None or self.inquiry.clock.searched:
            return known
        what = "longer forecasts, of which the records hold fewer"
        ready, answer = self.over(known, horizon, what)
        if not explains_the_rest(answer):
            return known
        says = (
            f"forecasts go over {duration_text(ready.fitter.seconds)}: of shorter ones, over "
            f"{duration_text(search.fitter.seconds)}, there are more, but they name nothing"
        )
        return dataclasses.replace(known, prepared=ready, answer=answer, why=says)

    def longest(self, known: Confirmed) -> Confirmed:
        """The same, or what is found over forecasts as long as the records where these alone show
        that something is missing, even if nothing can be named from so few."""
        search = known.answer.found.search
        if not self._nothing_named(known) or self.inquiry.clock.searched:
            return known
        slow = None if search.simulator.has_contacts else slow_error(self.log, known.answer)
        if slow is None:
            return known
        horizon, says = slow
        what = "the longest forecasts, where a slow error shows"
        ready, answer = self.over(known, horizon, what)
        return dataclasses.replace(known, prepared=ready, answer=answer, why=says)

    def _nothing_named(self, known: Confirmed) -> bool:
        """Whether nothing could be named over the usual length, parameters at their values."""
        answer = known.answer
        return not (self.log.by_user or answer.key or answer.found.search.beside)

    def slow(self, known: Confirmed) -> Confirmed:
        """The same, or what is found beside it over longer forecasts, of which the records hold as
        many as are needed, if those as long as the records show a slow error."""
        answer, search = known.answer, known.answer.found.search
        if self.log.by_user or not answer.key or search.beside or self.inquiry.clock.searched:
            return known
        lengths = (longest_horizon(self.log.recorded, windows) for windows in (WINDOWS, FEWER))
        horizon = next((one for one in lengths if one >= LONGER * self.log.horizon), None)
        if search.simulator.has_contacts or horizon is None:
            return known
        slow = slow_remainder(self.log, answer)
        if slow is None:
            return known
        ready, longer = self.over(known, horizon, "longer forecasts, for a slow error")
        left = over(slow.horizon, self.log, longer).errors[slow.place]
        if left >= LESS * slow.error:
            return known.and_says(slow.says)
        open_ = not (answer.found.adequate or any(claim.sure for claim in answer.claims))
        if not (open_ and left < HALF * slow.error) and not names_more(longer, answer):
            return known  # the same names, of which longer forecasts tell the sizes better
        says = (
            f"forecasts go over {ready.fitter.seconds:.3g} s: over {search.fitter.seconds:.3g} s "
            "what is slow hardly shows"
        )
        return dataclasses.replace(known, prepared=ready, answer=longer, why=says)

    def over(
        self, known: Confirmed, horizon: float, what: str, more: Sequence[Effect] = ()
    ) -> tuple[Prepared, Answer]:
        """What is found over forecasts of another length, and these windows."""
        log, simulator = self.log.at(horizon), known.answer.found.search.simulator
        self.inquiry.tell(f"once more over {what}")
        return self.inquiry.asked_of(simulator, log.runs, log.horizon, self.tolerance, more)
