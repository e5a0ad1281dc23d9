"""A physical parameter that changes with a state or an input."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np

from sims.effects.base import Effect, Quantity, number, place
from sims.effects.curve import Along, CurveBetween
from sims.effects.joint import Value
from sims.effects.parameter import ParameterChange

if TYPE_CHECKING:
    from sims.host import HostSimulator


@dataclasses.dataclass(frozen=True)
class ParameterCurve(CurveBetween):
    """A declared parameter is larger than the simulator says by what a channel makes of it.

    ``first``, ``second`` and ``third`` are the changes at ``low``, in the middle and at ``high`` of
    the channel ``over``, or of its size; between them runs the parabola through the three, beyond
    the ends it stays what it is there, and the parameter stays within its bounds. A resistance
    that rises as it warms, a damper that is stiffer in the middle. The channel counts as it truly
    is at that instant, an input as it comes out of the actuator. In control, what a parameter
    follows is called its scheduling variable (Toth, Modeling and Identification of Linear
    Parameter-Varying Systems, 2010, 1.1).
    """

    parameter: str
    over: str
    first: Value = number(parameter=1, share=0.1)
    second: Value = number(parameter=1, share=0.1)
    third: Value = number(parameter=1, share=0.1)
    low: Value = number(-1.0, role="fixed", channel=1)
    high: Value = number(1.0, role="fixed", channel=1)
    of_size: bool = False

    name: ClassVar[str] = "parameter_curve"
    sentence: ClassVar[str] = "A physical parameter that changes with a state or an input."
    enters: ClassVar = "parameter"
    needs: ClassVar[str] = "small and large values of what it changes with"
    along: ClassVar[Along] = "channel"
    gives: ClassVar[str] = "change"

    @property
    def where(self) -> str:
        """The parameter and what it follows."""
        return f"{self.parameter} over {self.by}"

    @property
    def by(self) -> str:  # type: ignore[override]
        """The channel, ``|name|`` if its size counts."""
        return f"|{self.over}|" if self.of_size else self.over

    @classmethod
    def named(cls, where: str) -> Self:
        """One by its place in words, ``"resistance over temp"`` or ``"drag over |wind|"``.

        Raises:
            ValueError: It is no parameter over a channel.
        """
        parameter, over, channel = where.partition(" over ")
        if not over:
            raise ValueError(
                f"{cls.name}@{where}: write {cls.name}@PARAMETER over CHANNEL, |CHANNEL| if its "
                "size counts"
            )
        sized = channel.startswith("|") and channel.endswith("|")
        return cls(parameter, channel.strip("|") if sized else channel, of_size=sized)

    @property
    def ranged(self) -> bool:
        """Whether it was told between which values its points lie."""
        ends = {f.name: f.default for f in dataclasses.fields(self)}
        return self.reach != (ends["low"], ends["high"])

    def contains(self, other: Effect) -> bool:
        """A parameter that is off by a constant is a case of it."""
        return isinstance(other, ParameterChange) and other.parameter == self.parameter

    def changed(self, value: Value, x: Value, simulator: HostSimulator) -> Value:
        """The parameter, ``value`` in the simulator, where the channel is ``x``, by row."""
        bounds = simulator.parameters[self.parameter]
        return np.clip(value + self.at(np.abs(x) if self.of_size else x), bounds.low, bounds.high)

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """Unit and size of the parameter, and unit and scale of the channel."""
        if not simulator.written_out:
            raise ValueError(f"{self.name} needs a system that is written as equations")
        channels = {c.name: c for c in (*simulator.physical_channels, *simulator.action_channels)}
        channel = place("channel", self.over, channels)
        size = ParameterChange(self.parameter).measures(simulator)["parameter"]
        return {"parameter": size, "channel": (channel.unit, channel.scale)}

    def quantities(self, simulator: HostSimulator) -> dict[str, Quantity]:
        """As for every effect; bounds keep the parameter within its own."""
        found = super().quantities(simulator)
        own = ParameterChange(self.parameter).quantities(simulator)["change"]
        within = {name: dataclasses.replace(found[name], low=own.low, high=own.high)
                  for name in self.strengths()}  # fmt: skip
        return {**found, **within}


@dataclasses.dataclass(frozen=True)
class ParameterSpline(ParameterCurve):
    """The same through five points: two more, ``fourth`` and ``fifth``, so that ``third`` is in the
    middle; between them runs a cubic spline. A rail that is worn at one place, a reaction that
    grows tenfold with its temperature.
    """

    fourth: Value = number(parameter=1, share=0.1)
    fifth: Value = number(parameter=1, share=0.1)

    name: ClassVar[str] = "parameter_spline"
    sentence: ClassVar[str] = (
        "A physical parameter that changes with a state or an input, by five points."
    )

    def contains(self, other: Effect) -> bool:
        """The same by fewer points is a case of it, too."""
        fewer = isinstance(other, ParameterCurve) and not isinstance(other, ParameterSpline)
        return super().contains(other) or (fewer and other.where == self.where)


#: What makes a parameter follow a channel, by the names that stand in labels.
FOLLOWING: dict[str, type[ParameterCurve]] = {
    kind.name: kind for kind in (ParameterCurve, ParameterSpline)
}
