"""What is known in the end, and the windows that it is of."""

from __future__ import annotations

import dataclasses

from residual.gap.answer.confirmed import Answer
from residual.gap.data.stretch import Stretch
from residual.gap.preparation.prepare import Prepared
from sims.effects.parameter_curve import ParameterCurve


@dataclasses.dataclass(frozen=True)
class Confirmed:
    """What is known in the end.

    Attributes:
        prepared: The windows that the answer is of.
        answer: What stays after confirmation.
        says: What is to be said of how it was found.
        in_vain: Parameters that follow a channel, asked for and not named.
        unasked: What may be left, in words, and was not asked for lack of time.
        why: Why forecasts go over windows of another length than the usual one, in words.
        stretch: Where most of the error lies, if nothing that was named explains it and it was not
            left out.
    """

    prepared: Prepared
    answer: Answer
    says: tuple[str, ...]
    in_vain: tuple[ParameterCurve, ...] = ()
    unasked: tuple[str, ...] = ()
    why: str = ""
    stretch: Stretch | None = None

    def lacks_time(self, *what: str) -> Confirmed:
        """The same with more that was not asked for lack of time."""
        return dataclasses.replace(self, unasked=tuple(dict.fromkeys((*self.unasked, *what))))

    def and_says(self, text: str) -> Confirmed:
        """The same with one more thing to say."""
        return dataclasses.replace(self, says=(*self.says, text))
