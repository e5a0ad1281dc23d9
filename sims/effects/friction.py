"""Dry friction: set-valued at rest, so that what is held does not creep."""

from __future__ import annotations

import abc
import dataclasses
from typing import ClassVar

import numpy as np

from sims.effects.base import number
from sims.effects.joint import ConstantLoad, JointEffect, Value


@dataclasses.dataclass(frozen=True)
class DryFriction(JointEffect):
    """Friction of a given size against any sliding, and up to a given size at rest.

    Hosts apply it as it is defined: at rest it is whatever force holds the joint, up to
    ``limit(0)``; no smoothing of the sign, hence no creep.
    """

    family: ClassVar[str] = "dissipation"
    subfamily: ClassVar[str] = "dry friction"
    holds_still: ClassVar[bool] = True

    @abc.abstractmethod
    def limit(self, v: Value) -> Value:
        """Size of the friction at rate ``v``, not negative; at 0, the most it can hold."""

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
