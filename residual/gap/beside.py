"""What is told beside the verdicts: what the log could hide, counts otherwise, or disagrees on."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Literal


@dataclasses.dataclass(frozen=True)
class Blind:
    """An effect that this log could hide.

    Attributes:
        effect: ``name@where``.
        visible_from: Smallest strength that would have been noticed, in ``unit``.
        needs: What data would show it.
    """

    effect: str
    visible_from: float
    unit: str
    needs: str


@dataclasses.dataclass(frozen=True)
class Conventions:
    """What the log may count otherwise than the simulator.

    Attributes:
        changes: Lines of the column map, any of which makes the nominal simulator forecast far
            better: a sign, a zero, a unit or a clock; of ``"row"`` the inputs, of ``"size"``
            what is left out.
        times: How much smaller the error is then, or how many times its scale a channel is.
        reason: ``"forecasts"`` are far better so, or with the ``"zero"`` of an angle elsewhere, or
            with samples at the ``"pace"`` of the control period; an input would be turned round by
            what was found (``"sign"``); a channel is far beyond the ``"scale"`` that it declares;
            what is found with every input a ``"row"`` earlier forecasts better, or what is
            ``"found"`` with the change; or a channel may hold the ``"size"`` of a speed alone.
    """

    changes: tuple[str, ...]
    times: float
    reason: Literal["forecasts", "zero", "pace", "sign", "scale", "row", "found", "size"] = (
        "forecasts"
    )


@dataclasses.dataclass(frozen=True)
class Changing:
    """A parameter or a gain whose change along the records, or with a measured channel, would take
    most of what is left off.

    Attributes:
        label: ``name@where``, or the name alone of a parameter.
        begin, end: Its values where records begin and end, or at both ends of the channel.
        nominal: What it is in the simulator.
        unit: Of these; ``"1"`` for the share of a gain.
        taken: Part of the squared residual that this would take off.
        over: The channel that it follows; empty along the records.
        of_size: Whether it follows that channel's size.
        low, high, over_unit: The ends of that channel, or of its size.
        instead: Whether it would do so in place of what was named, not beside it.
    """

    label: str
    begin: float
    end: float
    nominal: float
    unit: str
    taken: float
    over: str = ""
    low: float = 0.0
    high: float = 0.0
    over_unit: str = ""
    of_size: bool = False
    instead: bool = False


@dataclasses.dataclass(frozen=True)
class Periodic:
    """A force at one frequency that would take most of what is left off.

    Attributes:
        joint: Where it acts.
        frequency: In Hz.
        size, unit: Its amplitude, the median over records.
        taken: Part of the squared residual that this would take off.
        instead: The effect, ``name@where``, in whose place it would do that; empty: beside all.
    """

    joint: str
    frequency: float
    size: float
    unit: str
    taken: float
    instead: str = ""


@dataclasses.dataclass(frozen=True)
class Unlike:
    """An effect that every record wants in a size of its own.

    Attributes:
        effect, where: Its name and place.
        field, unit: The number, and its unit.
        sizes: By record, of those with data enough.
        share: Part of the nominal simulator's cross-validated squared error that has a name then.
        instead: Whether that is so in place of what was named, not beside it.
    """

    effect: str
    where: str
    field: str
    unit: str
    sizes: Mapping[str, float]
    share: float
    instead: bool = False

    @property
    def label(self) -> str:
        """``name@where``, or the name alone of a parameter."""
        return self.effect if self.where == self.effect else f"{self.effect}@{self.where}"
