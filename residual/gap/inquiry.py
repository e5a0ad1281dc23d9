"""Search and confirmation: the steps that find.py takes once a log is looked at."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

from residual.gap.answer.confirmed import Answer, confirm
from residual.gap.answer.curves import over_the_log
from residual.gap.answer.from_readings import not_kept, worse_from_readings
from residual.gap.answer.parameter_twins import with_parameters_as_twins
from residual.gap.clock import Clock, seldom
from residual.gap.confirmation.instead import with_other_answers
from residual.gap.confirmation.twins import exact_twins, with_twins
from residual.gap.confirmed import Confirmed
from residual.gap.fitting.smooth import LEAD, SmoothFitter
from residual.gap.log import Log
from residual.gap.model.candidates import Candidate, candidates, one_way
from residual.gap.offered import Offered
from residual.gap.once_more import OnceMore
from residual.gap.preparation.prepare import Prepared, finely, prepare
from residual.gap.search.explain import Explanation, explain
from residual.gap.search.orders import kept_orders, of_order
from residual.gap.search.sets import Search
from residual.trajectories import Trajectory
from sims.effects.base import Effect
from sims.host import HostSimulator


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
        less = one_way(simulator, self.offered.less, samples)
        offered = [*self.offered.kept, *more, *self._kept(earlier, more)]
        if isinstance(ready.fitter, SmoothFitter):
            for curve in self.offered.asked:
                if str(curve) not in map(str, more):
                    offered += over_the_log(curve, ready.fitter, simulator)
        there = candidates(simulator, offered, samples, ready.fitter.seconds)
        there += kept_orders(earlier.candidates, there) if earlier else []
        pool = ready.pool([*there, *less])
        pool = [candidate for candidate in pool if candidate.label not in free]
        further = self._further(simulator, ready, earlier, more)
        others = {label: e for label, e in self.offered.by_label.items() if label not in free}
        twins = exact_twins(simulator, samples, self.offered.groups, others)
        # What several make together is tried in place of them.
        twins |= {one.label: [one] for one in candidates(simulator, self.offered.losses, samples)}
        lead = 0.0 if simulator.has_contacts else ready.horizon * LEAD / (1 - LEAD)
        begun = f" begun from {lead:.3g} s before" if lead else ""
        ahead = f"forecasts over {ready.horizon:.3g} s{begun}"
        blocks = len(ready.fitter.blocks)
        self.tell(f"{blocks} blocks of data, {ahead}, {len(pool)} candidate effects")
        self.tell("screening them")
        with self.clock.searching():
            return explain(
                simulator, pool, ready.fitter, ready.floor, ready.weigh, ready.effort,
                self.clock.checked(seldom(self.tell)), self.clock.search_until, beside, earlier,
                twins, earlier is None and not more, further,
            )  # fmt: skip

    def _further(
        self,
        simulator: HostSimulator,
        ready: Prepared,
        earlier: Search | None,
        more: Sequence[Effect],
    ) -> list[Candidate]:
        """The rarer effects that may stand out in a first search."""
        if earlier is not None or not isinstance(ready.fitter, SmoothFitter):
            return []
        asked = set(map(str, more))
        rest = [effect for effect in self.offered.further if str(effect) not in asked]
        samples = ready.fitter.samples
        orders = of_order(simulator, self.offered.orders, samples)
        return [*candidates(simulator, rest, samples), *orders]

    def _kept(self, earlier: Search | None, more: Sequence[Effect]) -> list[Effect]:
        """The rarer effects that stood out in an earlier search."""
        there = {candidate.label for candidate in earlier.candidates} if earlier else set()
        there -= set(map(str, more))
        return [effect for effect in self.offered.further if str(effect) in there]

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
        until = self.clock.confirm_until
        with self.clock.confirming():
            answer = confirm(found, self.offered.groups, matters, tolerance, until)
        known = Confirmed(prepared, answer, ())
        if matters:
            known = OnceMore(self, log, tolerance).of(known)
        if times := worse_from_readings(known.answer):
            answer, says = not_kept(known.answer, times)
            return dataclasses.replace(known.and_says(says), answer=answer)
        answer = with_parameters_as_twins(known.answer, self.offered.by_label)
        search, found = answer.found.search, answer.found
        claims = with_other_answers(
            search, answer.key, answer.claims, found.adequate, found.floor, self.clock.spare_until
        )
        claims = with_twins(search, answer.key, claims)
        return dataclasses.replace(known, answer=dataclasses.replace(answer, claims=claims))

    def asked_of(
        self,
        simulator: HostSimulator,
        runs: Sequence[Trajectory],
        horizon: float,
        tolerance: float,
        more: Sequence[Effect] = (),
    ) -> tuple[Prepared, Answer]:
        """What is found in windows of other runs, or of another length, and these windows."""
        ready = prepare(simulator, runs, horizon)
        ready = finely(ready) if more else ready
        again = self.explained(simulator, ready, more=more)
        until = self.clock.confirm_until
        return ready, confirm(again, self.offered.groups, True, tolerance, until)

    def asked_again(
        self,
        known: Confirmed,
        tolerance: float,
        beside: Sequence[Candidate],
        more: Sequence[Effect] = (),
    ) -> Answer:
        """What is found in the same windows with parameters free, or with more on offer; how sure
        it is only if it has some of that."""
        search = known.answer.found.search
        again = self.explained(search.simulator, known.prepared, beside, search, more)
        if more and not {str(one) for one in more}.intersection(again.search.labels(again.key)):
            return Answer(again, again.key, (), ())
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
