"""Dry friction: set-valued at rest, so that what is held does not creep."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from sims.effects.base import number
from sims.effects.joint import ConstantLoad, JointEffect, Value

if TYPE_CHECKING:
    from sims.host import HostSimulator

#: Drive force, in any unit, for which a drive counts that is about to push.
AT_LEAST = 1e-100


@dataclasses.dataclass(frozen=True)
class DryFriction(JointEffect):
    """Friction of a given size against any sliding, and up to a given size at rest.

    Hosts apply it as it is defined: at rest it is whatever force holds the joint, up to
    ``limit(0)``; no smoothing of the sign, hence no creep.

    Attributes:
        follows_drive: True if its size depends on the force of the actuators, see ``under``.
    """

    family: ClassVar[str] = "dissipation"
    subfamily: ClassVar[str] = "dry friction"
    holds_still: ClassVar[bool] = True
    follows_drive: ClassVar[bool] = False

    @abc.abstractmethod
    def limit(self, v: Value) -> Value:
        """Size of the friction at rate ``v``, not negative; at 0, the most it can hold."""

    def under(self, drive: Value) -> DryFriction:
        """The friction while the actuators push with a force, by row; most are the same."""
        return self

    def force(self, q: Value, v: Value) -> Value:
        """Friction while sliding (zero at rest, where it is not a function of the state)."""
        return -np.sign(v) * self.limit(v)


@dataclasses.dataclass(frozen=True)
class CoulombFriction(DryFriction):
    """Friction of constant size ``level`` against the motion."""

    level: Value = number(low=0.0, force=1, share=0.1, bold=0.3)

    name: ClassVar[str] = "coulomb_friction"
    sentence: ClassVar[str] = "Dry friction of constant size that always opposes the motion."
    needs: ClassVar[str] = "reversals of the motion"

    def limit(self, v: Value) -> Value:
        """The level, at every rate."""
        return self.level + 0.0 * v


@dataclasses.dataclass(frozen=True)
class ConstantLoss(CoulombFriction):
    """Loss of constant size on the state x of a first-order system: ``-level sign(x)``.

    The dead time of an inverter and a motor's brushes take a constant voltage from a current,
    whichever way it flows. At zero it holds against whatever is smaller. On a speed it is
    ``CoulombFriction``.
    """

    name: ClassVar[str] = "constant_loss"
    sentence: ClassVar[str] = "A loss of constant size against what flows: brushes, a dead time."
    needs: ClassVar[str] = "values of both signs"
    subfamily: ClassVar[str] = ""
    mechanical: ClassVar[bool] = False
    if_it_moves: ClassVar[str] = "coulomb_friction"


@dataclasses.dataclass(frozen=True)
class StribeckFriction(DryFriction):
    """Dry friction that drops from ``breakaway`` at rest to ``sliding`` beyond ``speed``.

    It never rises: a breakaway below the sliding friction counts as equal to it.

    ``sliding + (breakaway - sliding) exp(-(v / speed)^2)``, see Armstrong-Helouvry, Dupont,
    Canudas de Wit, "A survey of models, analysis tools and compensation methods for the
    control of machines with friction", Automatica 30(7), 1994.
    """

    sliding: Value = number(low=0.0, force=1, share=0.1, bold=0.1)
    breakaway: Value = number(low=0.0, force=1, share=0.1, bold=0.8, above="sliding")
    speed: Value = number(
        0.5, role="shape", low=1e-3, share=0.1, starts=(0.05, 0.15, 0.4), bold=0.15, rate=1
    )

    name: ClassVar[str] = "stribeck_friction"
    sentence: ClassVar[str] = "Dry friction that holds harder at rest than it brakes in motion."
    needs: ClassVar[str] = "slow reversals and stops, and fast motion"
    special_cases: ClassVar[tuple[str, ...]] = ("coulomb_friction",)

    def limit(self, v: Value) -> Value:
        """Size of the friction at rate ``v``."""
        ratio = v / self.speed
        excess = np.maximum(self.breakaway - self.sliding, 0.0)
        return self.sliding + excess * np.exp(-ratio * ratio)


@dataclasses.dataclass(frozen=True)
class DirectionalFriction(DryFriction):
    """Dry friction of size ``forward`` against positive rates and ``backward`` against negative.

    At rest it holds against a pull forward up to ``forward``, and ``backward`` likewise. The same
    motion comes from Coulomb friction of the mean size and a constant load of half the difference,
    so no data can tell it from those two together.
    """

    forward: Value = number(low=0.0, force=1, share=0.1)
    backward: Value = number(low=0.0, force=1, share=0.1)

    name: ClassVar[str] = "directional_friction"
    sentence: ClassVar[str] = "Dry friction that is larger in one direction than in the other."
    needs: ClassVar[str] = "motion and stops in both directions"
    special_cases: ClassVar[tuple[str, ...]] = ("coulomb_friction",)

    def parts(self) -> tuple[JointEffect, ...]:
        """Coulomb friction and a constant load."""
        return (
            CoulombFriction(self.joint, 0.5 * (self.forward + self.backward)),
            ConstantLoad(self.joint, 0.5 * (self.backward - self.forward)),
        )

    def limit(self, v: Value) -> Value:
        """The level of the direction; at rest the larger one."""
        most = np.maximum(self.forward, self.backward)
        return np.where(v > 0, self.forward, np.where(v < 0, self.backward, most))


@dataclasses.dataclass(frozen=True)
class LoadDependentFriction(DryFriction):
    """Dry friction in proportion to what the drive pushes: ``share |drive force|``.

    Gears, lead screws and belts lose a share of what they carry, so that they lift with less than
    the motor gives and hold more. The force of the drive is the simulator's ``drive_force`` where
    that is known, else that of the inputs. See Bittencourt and Gunnarsson, "Static friction in a
    robot joint: modeling and identification of load and temperature effects", Journal of Dynamic
    Systems, Measurement, and Control 134(5), 2012.
    """

    share: Value = number(low=0.0, high=1.0, share=0.3, force=0)

    name: ClassVar[str] = "load_dependent_friction"
    sentence: ClassVar[str] = "Dry friction in proportion to the load: a gear or screw that wastes."
    needs: ClassVar[str] = "reversals of the motion under small and large inputs"
    follows_drive: ClassVar[bool] = True

    def measures(self, simulator: HostSimulator) -> Mapping[str, tuple[str, float]]:
        """See ``JointEffect.measures``; the joint has to be driven."""
        joints = {joint.name: joint for joint in simulator.joints}
        if not simulator.written_out:
            raise ValueError(f"{self.name} needs a system that is written as equations")
        if self.joint in joints and not joints[self.joint].driven:
            raise ValueError(f"{self.name} needs a driven joint; nothing drives {self.joint!r}")
        return super().measures(simulator)

    def under(self, drive: Value) -> DryFriction:
        """Coulomb friction of that share."""
        return CoulombFriction(self.joint, self.share * np.maximum(np.abs(drive), AT_LEAST))

    def limit(self, v: Value) -> Value:
        """That without a drive, which is none."""
        return 0.0 * v
