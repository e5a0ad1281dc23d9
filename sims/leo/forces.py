"""The forces on Leo's nine coordinates in one row of a batch: motors, friction and effects."""

from __future__ import annotations

from collections.abc import Sequence

from sims.effects.backlash import Backlash
from sims.effects.base import Effect
from sims.effects.friction import CoulombFriction, DryFriction
from sims.effects.joint import ConstantLoad, JointEffect, ViscousFriction
from sims.leo.body import COORDINATES
from sims.leo.chain import Chain

BASE = 3
"""The first coordinates - x, z and pitch - have no motor."""


class Forces:
    """Effects sorted by how they are solved.

    Viscous friction and constant loads at the motors' joints are part of the motor law, dry
    friction is a brake that the solver holds; all others are computed in every sub-step.

    Args:
        effects: Joint effects and backlashes of the row.
        drive: Motor torque per volt at rest.
        back: Loss of motor torque per rate.
        friction: Viscous friction of every joint.
        h: Sub-step of Pymunk in seconds.
        start: The row's state; its places in the plays follow the 18 physical channels.
    """

    def __init__(
        self,
        effects: Sequence[Effect],
        drive: float,
        back: float,
        friction: float,
        h: float,
        start: Sequence[float],
    ) -> None:
        self._drive, self._back, self._h = drive, back, h
        self._x = start[0]
        self._slopes = [back + friction] * 6
        self._loads = [0.0] * 6
        self._smooth: dict[int, list[JointEffect]] = {}
        self._dry: dict[int, list[DryFriction]] = {}
        self._width: dict[int, float] = {}
        self._place: dict[int, float] = {}
        self._order: list[int] = []
        self._voltage: Sequence[float] = ()
        for effect in effects:
            j = COORDINATES.index(effect.where)
            if isinstance(effect, Backlash):
                self._order.append(j)
                edge = 0.5 * float(effect.width)
                self._width[j] = float(effect.width)
                self._place[j] = max(-edge, min(edge, start[17 + len(self._order)]))
            elif effect.absent:
                continue
            elif isinstance(effect, DryFriction):
                self._dry.setdefault(j, []).append(effect)
            elif j >= BASE and isinstance(effect, ViscousFriction):
                self._slopes[j - BASE] += float(effect.coefficient)
            elif j >= BASE and isinstance(effect, ConstantLoad):
                self._loads[j - BASE] += float(effect.load)
            elif isinstance(effect, JointEffect):
                self._smooth.setdefault(j, []).append(effect)
        self.dry = bool(self._dry)
        # Joints whose law the motor alone cannot follow, and brakes that depend on the rate.
        played = {j for j, width in self._width.items() if width > 0}
        self._special = sorted(j for j in {*self._smooth, *played} if j >= BASE)
        self._base = sorted(j for j in self._smooth if j < BASE)
        self._moody = [
            j
            for j, dry in self._dry.items()
            if not all(isinstance(effect, CoulombFriction) for effect in dry)
        ]

    def plays(self) -> list[float]:
        """Where every drive is in its play, in the order of the backlashes."""
        return [self._place[j] for j in self._order]

    def brake(self, chain: Chain) -> None:
        """Set the dry friction that does not depend on the rate."""
        for j, dry in self._dry.items():
            chain.brake(j, sum(float(effect.limit(0.0)) for effect in dry))

    def run(self, chain: Chain, voltage: Sequence[float], steps: int) -> None:
        """Some sub-steps under constant voltages of the six motors."""
        self._voltage = voltage
        targets = [
            (self._drive * volts + load) / slope
            for volts, load, slope in zip(voltage, self._loads, self._slopes, strict=True)
        ]
        if self._special or self._base or self._moody:
            chain.run(targets, self._slopes, steps, lambda: self._act(chain))
        else:
            chain.run(targets, self._slopes, steps)

    def _act(self, chain: Chain) -> None:
        for j in self._special:
            q, v = chain.joint(j)
            torque, slope = self._motor(j, v)
            force, fall = self._force(j, q, v)
            chain.push(j - BASE, v, torque + force, slope + fall)
        if self._base:
            loads = [0.0] * BASE
            for j in self._base:
                q, v = chain.joint(j)
                loads[j] = self._force(j, q + (self._x if j == 0 else 0.0), v)[0]
            chain.load(loads)
        for j in self._moody:
            _, v = chain.joint(j)
            chain.brake(j, sum(float(effect.limit(abs(v))) for effect in self._dry[j]))

    def _motor(self, j: int, v: float) -> tuple[float, float]:
        """Torque of motor, viscous friction and load, and how it falls with the rate."""
        i = j - BASE
        push = self._drive * self._voltage[i] - self._back * v
        rest = self._loads[i] - (self._slopes[i] - self._back) * v
        if self._width.get(j, 0.0) > 0 and self._crosses(j, push):
            # Without the motor nothing limits the rate: a slope that does not matter.
            return rest, max(self._slopes[i] - self._back, 1e-9)
        return push + rest, self._slopes[i]

    def _crosses(self, j: int, push: float) -> bool:
        """Whether the drive is open; if so it runs on across its play."""
        edge, place = 0.5 * self._width[j], self._place[j]
        if (place >= edge and push >= 0) or (place <= -edge and push <= 0):
            return False
        self._place[j] = max(-edge, min(edge, place + self._h * push / self._back))
        return True

    def _force(self, j: int, q: float, v: float) -> tuple[float, float]:
        """Smooth effects on a coordinate, and how their force falls with the rate."""
        force, fall = 0.0, 0.0
        for effect in self._smooth.get(j, ()):
            here = float(effect.force(q, v))
            force += here
            if effect.follows_rate:
                fall += (here - float(effect.force(q, v + 1e-4))) / 1e-4
        return force, max(fall, 0.0)
