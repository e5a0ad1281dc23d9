"""Search and confirmation: the steps that find.py takes once a log is looked at."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Sequence

from residual.gap.answer.confirmed import Answer, confirm
from residual.gap.answer.curves import over_the_log, takes_its_place, worth_a_curve
from residual.gap.answer.free_parameters import better, worth_freeing
from residual.gap.answer.lone import explains_the_rest, left_stretch, lone_stretch
from residual.gap.clock import Clock, seldom
from residual.gap.confirmation.certainty import CLEARLY
from residual.gap.confirmation.numerics import fits_better, forecast_error
from residual.gap.confirmation.rest import fits_better_from_rest
from residual.gap.confirmation.twins import exact_twins, with_twins
from residual.gap.fitting.smooth import LEAD, SmoothFitter
from residual.gap.log import Log
from residual.gap.longer import longer_horizon
from residual.gap.model.candidates import Candidate, candidates
from residual.gap.offered import Offered
from residual.gap.preparation.numerics import held_otherwise, how_held
from residual.gap.preparation.prepare import Prepared, prepare
from residual.gap.search.explain import Explanation, explain
from residual.gap.search.sets import Search
from residual.trajectories import Trajectory
from sims.effects.base import Effect
from sims.host import HostSimulator


@dataclasses.dataclass(frozen=True)
class Confirmed:
    """What is known in the end.

    Attributes:
        prepared: The windows that the answer is of.
        answer: What stays after confirmation.
        says: What is to be said of how it was found.
    """

    prepared: Prepared
    answer: Answer
    says: tuple[str, ...]

    def and_says(self, text: str) -> Confirmed:
        """The same with one more thing to say."""
        return dataclasses.replace(self, says=(*self.says, text))


@dataclasses.dataclass(frozen=True)
class Inquiry:
    """Search and confirmation of offered effects, on a clock.

    Attributes:
        offered: What may be missing.
        clock: The time that is left.
        tell: Progress.
    """

    offered: Offered
    clock: Clock
    tell: Callable[[str], None]

    def explained(
        self,
        simulator: HostSimulator,
        ready: Prepared,
        beside: Sequence[Candidate] = (),
        earlier: Search | None = None,
        more: Sequence[Effect] = (),
    ) -> Explanation:
        """The effects that explain a log, see ``explain``; ``more`` of them than are offered."""
        free = {candidate.label for candidate in beside}
        samples = ready.fitter.samples
        less = [one.taking_away() for one in candidates(simulator, self.offered.less, samples)]
        offered = [*self.offered.kept, *more]
        if isinstance(ready.fitter, SmoothFitter):
            for curve in self.offered.asked:
                offered += over_the_log(curve, ready.fitter, simulator)
        pool = ready.pool([*candidates(simulator, offered, samples), *less])
        pool = [candidate for candidate in pool if candidate.label not in free]
        others = {label: e for label, e in self.offered.by_label.items() if label not in free}
        twins = exact_twins(simulator, ready.fitter.samples, self.offered.groups, others)
        lead = 0.0 if simulator.has_contacts else ready.horizon * LEAD / (1 - LEAD)
        begun = f" begun from {lead:.3g} s before" if lead else ""
        ahead = f"forecasts over {ready.horizon:.3g} s{begun}"
        blocks = len(ready.fitter.blocks)
        self.tell(f"{blocks} blocks of data, {ahead}, {len(pool)} candidate effects")
        self.tell("screening them")
        return explain(
            simulator, pool, ready.fitter, ready.floor, ready.weigh, ready.effort,
            seldom(self.tell), self.clock.search_until, beside, earlier, twins,
        )  # fmt: skip

    def other_hold(
        self, log: Log, prepared: Prepared, found: Explanation
    ) -> tuple[Prepared, Explanation, list[str]]:
        """Once more with inputs held the other way, if what was found fits better so.

        Returns:
            What was prepared and found, with the hold that forecasts clearly better, and what is
            to be said of it.
        """
        other = held_otherwise(found.search.simulator)
        if other is None or not fits_better(found.search, found.key, other):
            return prepared, found, []
        self.tell("inputs held the other way fit better: once more so")
        ready = prepare(other, log.runs, log.horizon)
        again = self.explained(other, ready, earlier=found.search)
        if _clearly_better(again, found):
            says = (
                f"inputs were taken to {how_held(other)}: the data fit better so; set hold to say "
                "otherwise"
            )
            return ready, again, [says]
        if not again.search.late:
            return prepared, found, []
        says = (
            f"the data fit better with inputs taken to {how_held(other)}, but there was no time to "
            "search so: set hold to say which it is, or give more --minutes"
        )
        return prepared, found, [says]

    def begun_from_rest(
        self, log: Log, prepared: Prepared, found: Explanation
    ) -> tuple[Log, Prepared, Explanation, list[str]]:
        """Once more with records that begin from rest, if what was found fits better so.

        Returns:
            What was recorded, prepared and found, with the beginning that forecasts clearly
            better, and what is to be said of it.
        """
        if found.search.late:
            return log, prepared, found, []
        runs = fits_better_from_rest(found.search, found.key, log.runs)
        if runs is None:
            return log, prepared, found, []
        self.tell("what came before the records fits better as no input: once more so")
        begun = dataclasses.replace(log, runs=runs)
        ready = prepare(found.search.simulator, runs, log.horizon)
        again = self.explained(found.search.simulator, ready, earlier=found.search)
        if not _clearly_better(again, found):
            return log, prepared, found, []
        late = [run.name for run in runs if run.before is not None]
        more = f" and {len(late) - 3} more" if len(late) > 3 else ""
        says = (
            f"{', '.join(late[:3])}{more}: the first input is on, and what came before is taken to "
            "be rest, which the data fit better; log some samples from before to be sure"
        )
        return begun, ready, again, [says]

    def confirmed(
        self, log: Log, prepared: Prepared, found: Explanation, matters: bool, tolerance: float
    ) -> Confirmed:
        """How sure what was found is, also with parameters free within their tolerance.

        Args:
            log: What was recorded.
            prepared: With the windows that were searched.
            found: What was chosen.
            matters: False if the gap does not, so that nothing is named.
            tolerance: How well the simulator's parameters are known, as a share of each.
        """
        answer = confirm(found, self.offered.groups, matters, tolerance, self.clock.confirm_until)
        known = Confirmed(prepared, answer, ())
        if matters:
            known = self.without_lone_stretch(log, known, tolerance)
            lone = bool(known.says)
            known = self.with_parameters_free(known, tolerance)
            known = self.with_curves(known, tolerance)
            known = self.over_longer_forecasts(log, known, tolerance)
            if not lone and (rest := left_stretch(known.answer)):
                known = known.and_says(rest.says(left_out=False))
        answer = known.answer
        claims = with_twins(answer.found.search, answer.key, answer.claims)
        return dataclasses.replace(known, answer=dataclasses.replace(answer, claims=claims))

    def with_parameters_free(self, known: Confirmed, tolerance: float) -> Confirmed:
        """The same, or what is found with parameters free if they may hide something."""
        answer = known.answer
        beside = worth_freeing(answer, tolerance)
        if not beside:
            return known
        if time.process_time() > self.clock.over:
            return known.and_says(
                "parameters within their tolerance may hide what is missing, or explain some of "
                "what is left: there was no time to look, give more --minutes"
            )
        self.tell("once more with parameters free within their tolerance")
        second = self._asked_again(known, tolerance, beside)
        return dataclasses.replace(known, answer=second) if better(second, answer) else known

    def with_curves(self, known: Confirmed, tolerance: float) -> Confirmed:
        """The same, or what is found with curves by points if they take most of what is left."""
        answer = known.answer
        curves = worth_a_curve(answer, self.offered.curves)
        if not curves:
            return known
        if time.process_time() > self.clock.search_until:
            return known.and_says(
                "what is left may be a law that the library does not have, along a curve by speed, "
                "position or command: there was no time to look, give more --minutes"
            )
        self.tell("once more with curves by points in place of laws")
        second = self._asked_again(known, tolerance, answer.found.search.beside, curves)
        if not takes_its_place(second, answer):
            return known
        return dataclasses.replace(known, answer=second)

    def over_longer_forecasts(self, log: Log, known: Confirmed, tolerance: float) -> Confirmed:
        """The same, or what is found over longer forecasts, of which the records hold fewer.

        They are tried where nothing could be named.
        """
        search = known.answer.found.search
        if log.by_user or known.answer.key or search.beside:
            return known
        simulator = search.simulator
        horizon = longer_horizon(simulator, log, known.answer)
        if horizon is None or time.process_time() > self.clock.search_until:
            return known
        longer = log.at(horizon)
        self.tell("once more over longer forecasts, of which the records hold fewer")
        ready, answer = self._asked_of(simulator, longer.runs, longer.horizon, tolerance)
        if not explains_the_rest(answer):
            return known
        says = (
            f"forecasts go over {ready.fitter.seconds:.3g} s: over {search.fitter.seconds:.3g} s, "
            "of which these records hold more, nothing can be named"
        )
        return Confirmed(ready, answer, (says,))

    def _asked_of(
        self,
        simulator: HostSimulator,
        runs: Sequence[Trajectory],
        horizon: float,
        tolerance: float,
    ) -> tuple[Prepared, Answer]:
        """What is found in windows of other runs, or of another length, and these windows."""
        ready = prepare(simulator, runs, horizon)
        again = self.explained(simulator, ready)
        until = self.clock.confirm_until
        return ready, confirm(again, self.offered.groups, True, tolerance, until)

    def _asked_again(
        self,
        known: Confirmed,
        tolerance: float,
        beside: Sequence[Candidate],
        more: Sequence[Effect] = (),
    ) -> Answer:
        """What is found in the same windows with parameters free, or with more on offer."""
        search = known.answer.found.search
        again = self.explained(search.simulator, known.prepared, beside, search, more)
        return confirm(again, self.offered.groups, True, tolerance, self.clock.confirm_until)

    def untried(self, answer: Answer) -> list[str]:
        """What is to be said of curves that a user asks for, and that were not tried."""
        search = answer.found.search
        tried = {number for key in search.tried for number in key}
        labels = {search.candidates[number].label for number in tried}
        asked = [str(curve) for curve in self.offered.asked if str(curve) not in labels]
        windows = len(search.fitter.blocks.windows)
        return [
            f"{label} was not tried: it has more numbers than these data can tell ({windows} "
            "windows), or what it follows never changed"
            for label in asked
        ]

    def without_lone_stretch(self, log: Log, known: Confirmed, tolerance: float) -> Confirmed:
        """The same, or what is found without a stretch of the log that nothing explains.

        Elsewhere is looked only in time, and counts only if something is named there.
        """
        stretch = lone_stretch(known.answer)
        if stretch is None:
            return known
        if time.process_time() > self.clock.search_until:
            return known.and_says(stretch.says(left_out=False))
        self.tell("once more without a stretch that nothing explains")
        simulator = known.answer.found.search.simulator
        runs = stretch.cut_from(log.runs)
        ready, answer = self._asked_of(simulator, runs, log.horizon, tolerance)
        if not explains_the_rest(answer):
            return known.and_says(stretch.says(left_out=False))
        return Confirmed(ready, answer, (stretch.says(left_out=True),))


def _clearly_better(again: Explanation, found: Explanation) -> bool:
    """Whether what was found in another reading of the log forecasts clearly better."""
    errors = [forecast_error(one.search, one.key) for one in (again, found)]
    return CLEARLY**2 * errors[0] < errors[1]
