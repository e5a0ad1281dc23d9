"""A physical parameter of the simulator that differs from its nominal value."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from sims.effects.base import Effect, Quantity, number, place
from sims.effects.joint import Value

if TYPE_CHECKING:
    from sims.host import HostSimulator


@dataclasses.dataclass(frozen=True)
class ParameterChange(Effect):
    """A declared parameter is larger than the simulator says by ``change``, in its own unit.

    The effect goes by the name of the parameter: ``mass``, ``inertia``, ``length`` ...
    """

    parameter: str
    change: Value = number(parameter=1)

    sentence: ClassVar[str] = "A physical parameter differs from its nominal value."
    enters: ClassVar = "parameter"
    needs: ClassVar[str] = "motion in which the parameter matters"

    @property
    def name(self) -> str:  # type: ignore[override]
        """Name of the parameter."""
        return self.parameter

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """Unit and nominal size of the parameter (its scale for a parameter that is zero)."""
        parameter = place("parameter", self.parameter, simulator.parameters)
        size = float(np.max(np.abs(parameter.value)))
        return {"parameter": (parameter.unit, size or parameter.scale)}

    def quantities(self, simulator: HostSimulator) -> dict[str, Quantity]:
        """As for every effect; bounds keep the parameter within its own."""
        found = super().quantities(simulator)
        parameter = simulator.parameters[self.parameter]
        low = parameter.low - float(np.min(parameter.value))
        high = parameter.high - float(np.max(parameter.value))
        size = float(np.max(np.abs(parameter.value)))
        bold = None if parameter.bold is None else parameter.bold * size
        return {"change": dataclasses.replace(found["change"], low=low, high=high, bold=bold)}

    def family_in(self, simulator: HostSimulator) -> str:
        """The family that the parameter was declared with."""
        return place("parameter", self.parameter, simulator.parameters).family

    def __str__(self) -> str:
        return self.parameter
