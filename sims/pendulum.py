"""The inverted pendulum of the paper on Pymunk: a motor swings a mass about a pivot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Self

import numpy as np
import pymunk
from numpy.typing import NDArray

from sims.effects.base import Effect
from sims.host import HostSimulator
from sims.render import PendulumRenderer
from sims.simulator import Array, Channel, Joint, Parameter
from sims.swing import swing

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
    hosts every effect, as a torque inside every sub-step. What has effects, and what is
    integrated for the fit of a log, is moved by the same scheme in compiled code.

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
    advances_rows_at_once = True

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
        """See ``HostSimulator.integrate``; compiled, and equal to Pymunk's steps to rounding."""
        states, inputs = np.asarray(states, float), np.asarray(inputs, float)
        effects = [*self.joint_effects(), *self.plays()]
        return swing(states, _halves(inputs), np.asarray(durations, float), self._motor(), effects)

    def _move(self, states: Array, inputs: Array, durations: Array) -> Array:
        """``step`` moves the rows without effects by Pymunk."""
        there = [np.broadcast_to(effect.present(), len(states)) for effect in self.effects]
        plain = ~np.logical_or.reduce(there) if there else np.ones(len(states), dtype=bool)
        if not plain.any():
            return self.integrate(states, inputs, durations)
        after = states.copy()
        if not plain.all():
            after[~plain] = self.take(~plain).integrate(
                states[~plain], inputs[~plain], durations[~plain]
            )
            states, inputs, durations = states[plain], inputs[plain], durations[plain]
        constants = [_by_row(value, len(plain), plain) for value in self._motor().values()]
        rows = zip(
            np.flatnonzero(plain).tolist(), states.tolist(), _halves(inputs).tolist(),
            durations.tolist(), *constants, strict=True,
        )  # fmt: skip
        for i, state, voltages, duration, *own in rows:
            # Leapfrog errs in even powers of the sub-step; this removes the second.
            whole = [0.5 * (a + b) for a, b in zip(voltages[::2], voltages[1::2], strict=True)]
            fine = self._swing(state, voltages, duration, *own)
            coarse = self._swing(state, whole, duration, *own)
            after[i, :2] = [f + (f - c) / 3 for f, c in zip(fine, coarse, strict=True)]
        return after

    def _motor(self) -> dict[str, Any]:
        """The pendulum without effects, by the names of ``sims.driven``."""
        p: dict[str, Any] = self.parameter_values()
        inertia = p["inertia"]
        if self.inertia_follows_mass:
            inertia = inertia + (p["mass"] - IDEALISED_MASS) * p["length"] ** 2
        drive = p["torque_constant"] / p["resistance"]
        return {
            "inertia": inertia,
            "weight": p["mass"] * p["gravity"] * p["length"],
            "damping": p["damping"],
            "drive": drive,
            "back": p["torque_constant"] * drive,
        }

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
        damping: float,
        drive: float,
        back: float,
    ) -> tuple[float, float]:
        """One control period without effects; NaN if the pendulum runs away."""
        body, advance, sin = self._body, self._space.step, math.sin
        angle, rate, *_ = state
        friction = damping + back
        h = duration / len(voltages)
        middle = angle + 0.5 * h * rate
        if not math.isfinite(middle):
            return math.nan, math.nan
        body.moment = inertia
        body.angle = angle - 0.5 * h * rate
        body.angular_velocity = rate
        # The torque that, held for h, has the effect of damping that follows the rate.
        pull = inertia * math.expm1(-friction / inertia * h) / h
        push = -pull / friction if friction > 0 else 1.0
        for voltage in voltages:
            body.torque = pull * rate + push * (weight * sin(middle) + drive * voltage)
            advance(h)
            rate = body.angular_velocity
            middle += h * rate
            if not math.isfinite(middle):
                return math.nan, math.nan
        return body.angle + 0.5 * h * rate, rate

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


def _by_row(value: float | Array, n: int, rows: NDArray[np.bool_]) -> list[float]:
    if np.ndim(value):
        return np.broadcast_to(value, n)[rows].tolist()
    return [float(value)] * int(np.count_nonzero(rows))


def _halves(inputs: Array) -> Array:
    """Mean voltage in both halves of every sub-step, (n, 2 substeps)."""
    if inputs.ndim == 3:
        return np.repeat(inputs[:, :, 0], 2, axis=1)
    mean, quarter = inputs[:, :, 0, 0], 0.25 * inputs[:, :, 0, 1]
    ends = np.stack([mean - quarter, mean + quarter], axis=2)
    return ends.reshape(len(mean), 2 * mean.shape[1])
