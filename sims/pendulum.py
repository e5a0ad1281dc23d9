"""The inverted pendulum of the paper on Pymunk: a motor swings a mass about a pivot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Self

import numpy as np
import pymunk

from sims.effects.backlash import Backlash
from sims.effects.base import Effect
from sims.effects.friction import DryFriction
from sims.effects.joint import JointEffect, ViscousFriction
from sims.host import HostSimulator, Joint
from sims.kick import DrivenJoint, kick
from sims.render import PendulumRenderer
from sims.simulator import Array, Channel, Parameter

IDEALISED_MASS, TRUE_MASS = 0.055, 0.090

STATE_CHANNELS = (
    Channel("angle", "rad", "position", angle=True),
    Channel("rate", "rad/s", "rate", rate_of="angle", scale=10.0),
)
ACTION_CHANNELS = (Channel("voltage", "V", "input", scale=3.0, low=-3.0, high=3.0),)
JOINTS = (Joint("pivot", "angle", "rate", "N m", scale=0.01),)


def pendulum_parameters(mass: float = IDEALISED_MASS) -> dict[str, Parameter]:
    """The parameters of the paper's pendulum; the true one has a mass of 0.090 kg."""
    return {
        "mass": Parameter(mass, "kg", "mass that swings", low=0.0),
        "inertia": Parameter(1.91e-4, "kg m^2", "moment of inertia about the pivot", low=1e-6),
        "length": Parameter(0.042, "m", "distance of the centre of gravity", low=0.0),
        "gravity": Parameter(9.81, "m/s^2", "acceleration of gravity", low=0.0),
        "damping": Parameter(
            3e-6, "N m s/rad", "viscous damping of the bearing", low=0.0, family="dissipation"
        ),
        "torque_constant": Parameter(0.0536, "N m/A", "torque constant of the motor", low=1e-6),
        "resistance": Parameter(9.5, "ohm", "resistance of the motor winding", low=1e-3),
    }


class Pendulum(HostSimulator):
    """J phi'' = m g l sin(phi) - (b + K^2/R) phi' + (K/R) u, with phi = 0 upright.

    A Pymunk body of moment J turns about the pivot, where its centre of gravity is put, and
    gravity acts as a torque: a joint would damp the swing numerically, at first order. It
    hosts every effect, as a torque inside every sub-step.

    Args:
        mass: kg; 0.055 is the paper's idealised pendulum, 0.090 its true one.
        inertia_follows_mass: If False (as in the paper), J stays 1.91e-4 kg m^2 when the mass
            changes; if True it grows by (mass - 0.055) l^2.
        dt: Control period in seconds.
        substeps: Sub-steps per control period; the error falls with their fourth power.
        effects: What acts beside the equation above.
    """

    name = "pendulum"
    joints = JOINTS
    has_drive_force = True

    def __init__(
        self,
        mass: float = IDEALISED_MASS,
        inertia_follows_mass: bool = False,
        dt: float = 0.05,
        substeps: int = 8,
        effects: Sequence[Effect] = (),
    ) -> None:
        self.dt = dt
        self.substeps = substeps
        self.inertia_follows_mass = inertia_follows_mass
        self.parameters = pendulum_parameters(mass)
        self.state_channels = STATE_CHANNELS
        self.action_channels = ACTION_CHANNELS
        self._make_body()
        hosted = self.with_effects(effects)
        self.effects, self.state_channels = hosted.effects, hosted.state_channels

    @classmethod
    def true(cls, inertia_follows_mass: bool = False, **options: Any) -> Self:
        """The paper's true pendulum: 0.090 kg instead of 0.055 kg."""
        return cls(TRUE_MASS, inertia_follows_mass, **options)

    def renderer(self) -> PendulumRenderer:
        """How it looks."""
        return PendulumRenderer()

    def drive_forces(self, states: Array, inputs: Array) -> Array:
        """Motor torque (K/R) (u - K phi'), shape (n, 1)."""
        p = self.parameter_values()
        drive = p["torque_constant"] / p["resistance"]
        return (drive * (inputs[:, 0] - p["torque_constant"] * states[:, 1]))[:, None]

    def integrate(self, states: Array, inputs: Array, durations: Array) -> Array:
        """See ``HostSimulator.integrate``."""
        states = np.asarray(states, float)
        p: dict[str, Any] = self.parameter_values()
        inertia = p["inertia"]
        if self.inertia_follows_mass:
            inertia = inertia + (p["mass"] - IDEALISED_MASS) * p["length"] ** 2
        drive = p["torque_constant"] / p["resistance"]
        constants = (
            inertia,
            p["mass"] * p["gravity"] * p["length"],
            p["damping"],
            drive,
            p["torque_constant"] * drive,
        )
        rows = zip(
            states.tolist(),
            _halves(np.asarray(inputs, float)).tolist(),
            np.asarray(durations, float).tolist(),
            *(_by_row(value, len(states)) for value in constants),
            strict=True,
        )
        forces: list[Effect] = [*self.joint_effects(), *self.plays()]
        by_row = any(effect.rows is not None for effect in forces)
        after = np.empty_like(states)
        for i, (state, voltages, duration, moment, weight, *motor) in enumerate(rows):
            damping, drive, back = motor
            own = forces
            if by_row:
                own = [effect.take(i) for effect in forces]
                own = [effect for effect in own if not effect.absent]
            row = _Row(moment, damping, drive, back, own) if own else None
            swing = self._swing if row is None or row.simple else self._swing_by_kicks
            # Leapfrog errs in even powers of the sub-step; this removes the second.
            whole = [0.5 * (a + b) for a, b in zip(voltages[::2], voltages[1::2], strict=True)]
            fine = swing(state, voltages, duration, moment, weight, motor, row)
            coarse = swing(state, whole, duration, moment, weight, motor, row)
            after[i] = [f + (f - c) / 3 for f, c in zip(fine, coarse, strict=True)]
            if row is not None and row.joint.width:
                after[i, 2] = np.clip(after[i, 2], -0.5 * row.joint.width, 0.5 * row.joint.width)
        return after

    # Pymunk first moves the angle at the old rate and then changes the rate. An angle that
    # starts half a sub-step back is thus at the middle of the sub-step when the torque acts:
    # leapfrog, of second order. ``middle`` is that angle, known before Pymunk gets there.

    def _swing(
        self,
        state: list[float],
        voltages: list[float],
        duration: float,
        inertia: float,
        weight: float,
        motor: list[float],
        row: _Row | None,
    ) -> list[float]:
        """One control period with torques that depend on the angle, and linear damping."""
        body, advance, sin = self._body, self._space.step, math.sin
        angle, rate, *play = state
        damping, drive, back = motor
        friction = damping + back + (row.viscous if row else 0.0)
        forces = row.by_angle if row else ()
        h = duration / len(voltages)
        body.moment = inertia
        body.angle = angle - 0.5 * h * rate
        body.angular_velocity = rate
        middle = angle + 0.5 * h * rate
        # The torque that, held for h, has the effect of damping that follows the rate.
        decay = math.expm1(-friction / inertia * h)
        pull = inertia * decay / h
        push = -pull / friction if friction > 0 else 1.0
        for voltage in voltages:
            load = weight * sin(middle) + drive * voltage
            for effect in forces:
                load += float(effect.force(middle, 0.0))
            body.torque = pull * rate + push * load
            advance(h)
            rate = body.angular_velocity
            middle += h * rate
        return [body.angle + 0.5 * h * rate, rate, *play]

    def _swing_by_kicks(
        self,
        state: list[float],
        voltages: list[float],
        duration: float,
        inertia: float,
        weight: float,
        motor: list[float],
        row: _Row | None,
    ) -> list[float]:
        """One control period with dry friction, play or torques that depend on the rate."""
        assert row is not None
        body, advance, sin = self._body, self._space.step, math.sin
        angle, rate, *play = state
        x = play[0] if play else 0.0
        h = duration / len(voltages)
        body.moment = inertia
        body.angle = angle - 0.5 * h * rate
        body.angular_velocity = rate
        middle = angle + 0.5 * h * rate
        for voltage in voltages:
            load = weight * sin(middle)
            for effect in row.by_angle:
                load += float(effect.force(middle, 0.0))
            wanted, x, moved = kick(row.joint, middle, rate, x, load, voltage, h)
            body.torque = inertia * (wanted - rate) / h
            advance(h)
            if wanted == 0:
                # Held is held: no rate is left by rounding.
                body.angular_velocity = 0.0
            if moved:
                body.angle += moved
                middle += moved
            rate = body.angular_velocity
            middle += h * rate
        end = [body.angle + 0.5 * h * rate, rate]
        return [*end, x] if play else end

    def _make_body(self) -> None:
        self._space = pymunk.Space()
        self._body = pymunk.Body(1.0, 1.0)
        self._space.add(self._body)

    def __getstate__(self) -> dict[str, Any]:
        state = self.__dict__.copy()
        del state["_space"], state["_body"]
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        # Copies get a body of their own: the body is a scratch pad, not a state.
        self.__dict__.update(state)
        self._make_body()


def _by_row(value: float | Array, n: int) -> list[float]:
    return np.broadcast_to(value, n).tolist() if np.ndim(value) else [float(value)] * n


def _halves(inputs: Array) -> Array:
    """Mean voltage in both halves of every sub-step, (n, 2 substeps)."""
    if inputs.ndim == 3:
        return np.repeat(inputs[:, :, 0], 2, axis=1)
    mean, quarter = inputs[:, :, 0, 0], 0.25 * inputs[:, :, 0, 1]
    return np.stack([mean - quarter, mean + quarter], axis=2).reshape(len(mean), -1)


class _Row:
    """The forces on the pendulum in one row of a batch, sorted by how they can be solved."""

    def __init__(
        self,
        inertia: float,
        damping: float,
        drive: float,
        back: float,
        effects: Sequence[Effect],
    ) -> None:
        forces = [effect for effect in effects if isinstance(effect, JointEffect)]
        self.viscous = sum(e.coefficient for e in forces if isinstance(e, ViscousFriction))
        self.by_angle = [effect for effect in forces if not effect.follows_rate]
        self.joint = DrivenJoint(
            inertia,
            damping + self.viscous,
            drive,
            back,
            smooth=[
                effect
                for effect in forces
                if effect.follows_rate and not isinstance(effect, ViscousFriction | DryFriction)
            ],
            dry=[effect for effect in forces if isinstance(effect, DryFriction)],
            width=sum(float(e.width) for e in effects if isinstance(e, Backlash)),
        )
        self.simple = not (self.joint.smooth or self.joint.dry or self.joint.width)
