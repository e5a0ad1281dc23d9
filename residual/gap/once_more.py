"""Search and confirmation once more, where what was found leaves something open."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Callable, Sequence

from residual.gap.answer.confirmed import Answer, untimely
from residual.gap.answer.curves import worth_a_curve
from residual.gap.answer.form import of_open_form
from residual.gap.answer.free_parameters import better, worth_freeing
from residual.gap.answer.laws import beside_curves, beside_further, beside_others, beside_their_kind
from residual.gap.answer.left import (
    still_names,
    takes_most_by_itself,
    takes_what_is_left,
    worth_a_part,
    worth_asking_for,
)
from residual.gap.answer.lone import few_stretches, left_stretch, lone_stretch, off_stretch
from residual.gap.answer.varying import (
    no_surer,
    over_other_channels,
    over_unused,
    through_more_points,
    worth_varying,
)
from residual.gap.clock import OutOfTime
from residual.gap.confirmed import Confirmed
from residual.gap.data.windows import TooShort
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.other_windows import OtherWindows
from residual.gap.preparation.prepare import finely
from residual.gap.search.redundant import by_points
from sims.effects.base import Effect
from sims.effects.curve import Curve


class OnceMore(OtherWindows):
    """What asks once more, each only in time, and only if it then explains more."""

    def of(self, known: Confirmed) -> Confirmed:
        """The same, or what is found without a stretch that nothing explains, with parameters
        free, with more than the library on offer, or over longer forecasts."""
        known = self._step(self.without_lone_stretch, known)
        left_out = bool(known.says)
        for step in (
            self.with_parameters_free, self.with_further, self.with_varying, self.with_curves,
            self.shorter, self.with_parts, self.longer, self.longest, self.slow,
        ):  # fmt: skip
            known = self._step(step, known)
        if known.why:
            known = known.and_says(known.why)
        if known.unasked:
            known = known.and_says(_no_time(known.unasked))
        if left_out:
            return known
        if rest := lone_stretch(known.answer) or left_stretch(known.answer):
            return dataclasses.replace(known, stretch=rest)
        says = few_stretches(known.answer) or off_stretch(known.answer)
        return known.and_says(says) if says else known

    def _step(self, step: Callable[[Confirmed], Confirmed], known: Confirmed) -> Confirmed:
        """What is known after a step, which has a share of the time that is left."""
        with self.inquiry.clock.once_more(), contextlib.suppress(TooShort, OutOfTime):
            return step(known)
        return known  # windows are too short, or time is: what was found holds without

    def with_parameters_free(self, known: Confirmed) -> Confirmed:
        """The same, or what is found with parameters free if they may hide something."""
        answer = known.answer
        beside = worth_freeing(answer, self.tolerance)
        if not beside:
            return known
        if self._late():
            return known.lacks_time(
                "parameters that are off within their tolerance, which may hide more than is left"
            )
        self.inquiry.tell("once more with parameters free within their tolerance")
        second = self.inquiry.asked_again(known, self.tolerance, beside)
        return dataclasses.replace(known, answer=second) if better(second, answer) else known

    def with_further(self, known: Confirmed) -> Confirmed:
        """The same, or what is found with rarer effects, if they take most of what is left.

        Whatever of their kind is certain is of open form where there is no time to ask for them, or
        where they take clearly something, and not most.
        """
        answer = known.answer
        further = worth_asking_for(answer, self.inquiry.offered.further)
        if not further:
            return known
        what = " or ".join(dict.fromkeys(one.name.replace("_", " ") for one in further))
        with self.inquiry.clock.once_more(worth_it=True):
            found, second = self._asked_with(known, further, what, what)
        if found.answer is second:
            return found
        if second is None:
            return dataclasses.replace(found, answer=beside_their_kind(answer, further))
        beside = beside_further(answer, second, further, self._late)
        named = set(second.found.search.labels(second.key))
        of_these = [effect for effect in further if str(effect) in named]
        if of_these and better(second, answer):
            beside = beside_their_kind(beside, of_these)
        return dataclasses.replace(found, answer=beside)

    def with_varying(self, known: Confirmed) -> Confirmed:
        """The same, or what is found with parameters that follow what was measured, if they take
        most of what is left."""
        answer, what = known.answer, "a parameter that changes with a state or an input"
        offered = self.inquiry.offered
        curves = worth_a_curve(answer, offered.curves)
        varying = {str(one): one for one in worth_varying(answer, curves, offered.by_label)}
        unused = [one.where for one in self.log.findings if one.kind == "unused"]
        varying |= {str(one): one for one in over_unused(answer, offered.by_label, unused)}
        found, second = self._asked_with(known, list(varying.values()), what, what)
        if found.answer is not answer:
            return self._over_other_channels(found, answer, curves)
        if second is not None:
            finer = self._through_more_points(found, second)
            if finer.answer is not answer:
                return self._over_other_channels(finer, answer, curves)
            beside = beside_others(answer, second, list(varying.values()), self._late)
            found = dataclasses.replace(found, answer=beside)
        late = found.unasked != known.unasked
        return found if late else dataclasses.replace(found, in_vain=tuple(varying.values()))

    def _over_other_channels(
        self, known: Confirmed, earlier: Answer, curves: Sequence[Curve]
    ) -> Confirmed:
        """An answer in which a parameter follows a channel, or what is found with it over another
        one; none surer than an earlier answer was without."""
        what = "the same parameter over other channels"
        others = over_other_channels(known.answer, curves)
        found, second = self._asked_with(known, others, what, what)
        if second is not None and found.answer is not second:
            beside = beside_others(found.answer, second, others, self._late)
            found = dataclasses.replace(found, answer=beside)
        found = self._through_more_points(found, found.answer)
        return dataclasses.replace(found, answer=no_surer(found.answer, earlier))

    def _through_more_points(self, known: Confirmed, tried: Answer) -> Confirmed:
        """The same, or what is found with the curves of an answer through more points."""
        what = "the same parameter by more points"
        return self._with_more(known, through_more_points(tried), what, what)

    def with_curves(self, known: Confirmed) -> Confirmed:
        """The same, or what is found with curves by points if they take most of what is left; then
        a rarer effect may take most of what they leave."""
        offered = self.inquiry.offered.curves
        answer = of_open_form(known.answer, offered, self.tolerance)
        known, curves = dataclasses.replace(known, answer=answer), worth_a_curve(answer, offered)
        lacking = "a law that the library does not have (a curve by speed, position or command)"
        what = "curves by points in place of laws"
        found, second = self._asked_with(known, curves, what, lacking)
        if second is None:
            if not curves:
                return found
            untested = untimely(of_open_form(found.answer, (), self.tolerance))
            return dataclasses.replace(found, answer=untested)
        if found.answer is second:
            return self.with_further(found)
        beside, says = beside_curves(found.answer, second, curves)
        beside = beside_others(beside, second, curves, self._late)
        return dataclasses.replace(found, answer=beside, says=(*found.says, *says))

    def with_parts(self, known: Confirmed) -> Confirmed:
        """The same, or what is found with flexible parts if they take most of what is left.

        Where rows are far apart, so that no swing of some samples shows, shorter forecasts, which
        have every sample, are asked after them.
        """
        parts, part = self.inquiry.offered.parts, "a part on a spring"
        asked = worth_a_part(known.answer, parts)
        found = self._with_more(_finely(known), asked, part, part)
        fitter = known.prepared.fitter
        if found.answer is not known.answer:
            return found
        known = dataclasses.replace(known, says=found.says, unasked=found.unasked)
        if not asked or self.log.by_user:
            return known
        if not isinstance(fitter, SmoothFitter) or fitter.samples.stride == 1:
            return known
        if self._late():
            return known.lacks_time(part)
        horizon, what = self.log.horizon / fitter.samples.stride, f"short forecasts, with {part}"
        try:
            ready, answer = self.over(known, horizon, what, [*_curves(known), *parts])
        except OutOfTime:
            return known.lacks_time(part)
        if not (takes_most_by_itself(answer, parts) and still_names(answer, known.answer)):
            return known
        says = (
            f"forecasts go over {ready.fitter.seconds:.3g} s, in which every sample shows: those "
            f"over {fitter.seconds:.3g} s have one of {fitter.samples.stride}, too few for what "
            "swings so fast"
        )
        return dataclasses.replace(known, prepared=ready, answer=answer, why=says)

    def _with_more(
        self, known: Confirmed, more: Sequence[Effect], what: str, lacking: str
    ) -> Confirmed:
        """The same, or what is found with more on offer if that takes most of what is left."""
        return self._asked_with(known, more, what, lacking)[0]

    def _asked_with(
        self, known: Confirmed, more: Sequence[Effect], what: str, lacking: str
    ) -> tuple[Confirmed, Answer | None]:
        """``_with_more``, and what was found with more on offer, if it was asked."""
        if not more:
            return known, None
        if self._late():
            return known.lacks_time(lacking), None
        self.inquiry.tell(f"once more with {what}")
        beside, offered = known.answer.found.search.beside, [*_curves(known), *more]
        try:
            second = self.inquiry.asked_again(known, self.tolerance, beside, offered)
        except OutOfTime:
            return known.lacks_time(lacking), None
        if not takes_what_is_left(second, known.answer, more):
            return known, second
        return dataclasses.replace(known, answer=second), second

    def _late(self) -> bool:
        return self.inquiry.clock.searched


def _no_time(unasked: Sequence[str]) -> str:
    """What is to be said of what was not asked for."""
    *most, last = unasked
    what = f"{', '.join(most)} or {last}" if most else last
    return f"what is left may be {what}: there was no time to look, give more --minutes"


def _curves(known: Confirmed) -> list[Effect]:
    """The curves that were named: a search with more on offer is to have them, too."""
    search, key = known.answer.found.search, known.answer.key
    return [search.candidates[number].effect for number in by_points(search) if number in key]


def _finely(known: Confirmed) -> Confirmed:
    """The same with sub-steps that are short beside the fastest swing of a part."""
    return dataclasses.replace(known, prepared=finely(known.prepared))
