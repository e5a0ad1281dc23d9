"""The pendulum as an equation of motion: fast in batches, and an example to copy."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Self

import numpy as np

from sims.effects.base import Effect
from sims.equations import EquationOfMotion
from sims.pendulum import (
    ACTION_CHANNELS,
    IDEALISED_MASS,
    JOINTS,
    STATE_CHANNELS,
    TRUE_MASS,
    pendulum_parameters,
)
from sims.simulator import Array


class PendulumEquation(EquationOfMotion):
    """The same pendulum as ``sims.pendulum.Pendulum``, without Pymunk.

    Args:
        mass, inertia_follows_mass, dt, substeps, effects: As for ``Pendulum``.
    """

    name = "pendulum equation"
    state_channels = STATE_CHANNELS
    action_channels = ACTION_CHANNELS
    joints = JOINTS

    def __init__(
        self,
        mass: float = IDEALISED_MASS,
        inertia_follows_mass: bool = False,
        dt: float = 0.05,
        substeps: int = 10,
        effects: Sequence[Effect] = (),
    ) -> None:
        self.parameters = pendulum_parameters(mass)
        self.inertia_follows_mass = inertia_follows_mass
        super().__init__(dt, substeps, effects)

    @classmethod
    def true(cls, inertia_follows_mass: bool = False, **options: Any) -> Self:
        """The paper's true pendulum: 0.090 kg instead of 0.055 kg."""
        return cls(TRUE_MASS, inertia_follows_mass, **options)

    def acceleration(self, q: Array, v: Array, u: Array, force: Array, p: Any) -> Array:
        """Torques over moment of inertia; see ``EquationOfMotion.acceleration``."""
        weight = p.mass * p.gravity * p.length * np.sin(q[:, 0])
        inertia = p.inertia
        if self.inertia_follows_mass:
            inertia = inertia + (p.mass - IDEALISED_MASS) * p.length**2
        motor = self.drive_force(q, v, u, p)[:, 0]
        return ((weight - p.damping * v[:, 0] + motor + force[:, 0]) / inertia)[:, None]

    def drive_force(self, q: Array, v: Array, u: Array, p: Any) -> Array:
        """Torque of the motor (K/R) (u - K phi'), back-EMF included."""
        drive = p.torque_constant / p.resistance
        return (drive * (u[:, 0] - p.torque_constant * v[:, 0]))[:, None]
