"""A part of what moves that hangs on a spring: a flexible shaft, a load on a rope, a liquid."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from sims.effects.base import Effect, number, place
from sims.effects.joint import Value

if TYPE_CHECKING:
    from sims.host import HostSimulator

#: Control periods that one swing usually takes.
SWING = 10.0


@dataclasses.dataclass(frozen=True)
class FlexiblePart(Effect):
    """A part z = q + r of the mass moves beside the joint q, on a spring and a damper.

    With ``w = 2 pi frequency`` and its pull ``s = (w^2 r + 2 damping w r') / (1 + ratio)``, the
    acceleration ``a`` that the joint would have without it, and that by forces of position alone,
    ``g``: ``q'' = a + ratio (a + s - g(q))`` and ``z'' = g(z) - s``. So are two masses on a spring,
    of which the first is measured and driven (Den Hartog, Mechanical Vibrations, 3.2): ``ratio`` is
    the second one's mass or inertia over the first one's, ``frequency`` that at which both swing
    against each other, ``damping`` its ratio. While the first is held the second swings at
    ``frequency / sqrt(1 + ratio)``, as a load on a rope of length l does at ``sqrt(g / l) / (2
    pi)``. Slow motion shows nothing of it.

    Hosted by joints, and speeds of first-order systems, that are written out as equations. Its
    place r beside the joint and r' are memory channels, and at first zero.
    """

    joint: str
    ratio: Value = number(low=0.0, high=50.0, share=0.3, starts=(0.5,))
    frequency: Value = number(
        1.0, role="shape", low=1e-9, frequency=1, starts=(0.1, 0.2, 0.4, 0.8, 1.6)
    )
    damping: Value = number(0.15, role="shape", low=0.0, high=2.0, share=0.5, starts=(0.15,))

    name: ClassVar[str] = "flexible_part"
    sentence: ClassVar[str] = "A part hangs on a spring: a flexible shaft, a load on a rope."
    enters: ClassVar = "joint"
    needs: ClassVar[str] = "sudden changes of the force, and samples fast enough for the swing"
    family: ClassVar[str] = "elasticity"

    @property
    def carried(self) -> Value:
        """Times its own part that it feels of the forces by position."""
        return 1.0

    def pull(self, place: Value, rate: Value) -> Value:
        """Acceleration of the part towards the joint, from its place and rate beside it."""
        swing = 2 * np.pi * self.frequency
        return swing * (swing * place + 2 * self.damping * rate) / (1 + self.ratio)

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """Unit and typical size of the frequency."""
        joint = place("joint", self.joint, {joint.name: joint for joint in simulator.joints})
        if not simulator.written_out or joint.rate is None:
            raise ValueError(
                f"{self.name} needs a joint or a speed of a system that is written out as an "
                f"equation, and {self.joint!r} is none"
            )
        return {"frequency": ("Hz", 1 / (SWING * simulator.dt))}


@dataclasses.dataclass(frozen=True)
class FlexibleJoint(FlexiblePart):
    """What a drive moves hangs on a spring, with all that pulls at it by position.

    As ``FlexiblePart``, but ``g`` pulls at the part alone, with ``g (1 + ratio) / ratio``: a motor
    that is measured, and the link behind its gear (Spong, Modeling and control of elastic joint
    robots, J. Dynamic Systems, Measurement and Control 109, 1987).
    """

    name: ClassVar[str] = "flexible_joint"
    sentence: ClassVar[str] = "The drive, which is measured, moves what it carries by a spring."

    @property
    def carried(self) -> Value:
        """Times its own part that it feels of the forces by position: all of them."""
        ratio = np.asarray(self.ratio, float)
        return np.divide(1 + ratio, ratio, out=np.zeros(ratio.shape), where=ratio > 0)


def flexible_parts(simulator: HostSimulator) -> list[FlexiblePart]:
    """The flexible parts of a simulator that are not at zero strength."""
    return [e for e in simulator.effects if isinstance(e, FlexiblePart) and not e.absent]
