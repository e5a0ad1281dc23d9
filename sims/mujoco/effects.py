"""A MuJoCo attribute that differs from what the model file says."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from sims.effects.base import place
from sims.effects.parameter import ParameterChange

if TYPE_CHECKING:
    from sims.host import HostSimulator


@dataclasses.dataclass(frozen=True)
class AttributeChange(ParameterChange):
    """An attribute of a MuJoCo model is larger than the file says by ``change``, in its unit.

    The effect goes by the attribute's name: ``frictionloss of joint elbow``,
    ``mass of body forearm``.
    """

    sentence: ClassVar[str] = "An attribute of the model differs from what the file says."

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """Unit and typical size of a change, which a value near zero would not tell."""
        parameter = place("attribute", self.parameter, simulator.parameters)
        return {"parameter": (parameter.unit, parameter.scale)}
