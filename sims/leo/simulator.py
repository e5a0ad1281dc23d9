"""Leo, the biped of the paper, on Pymunk: a boom keeps it in a plane, six motors move it."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any, Self

import numpy as np

from sims.effects.base import Effect
from sims.host import HostSimulator
from sims.leo.body import ARM, COORDINATES, FOOT, GEAR, MOTORS, SHANK, THIGH, TORSO
from sims.leo.build import Build
from sims.leo.chain import chain
from sims.leo.forces import Forces
from sims.leo.render import LeoRenderer
from sims.simulator import Array, Channel, Joint, Parameter

IDEALISED_TORSO, TRUE_TORSO = TORSO.mass, 1.25
TRUE_FRICTION = 0.03
TORQUE_CONSTANT = 0.006325081 * GEAR
"""N m/A at the joint: the motor's own constant times the ratio of its gear."""
RESISTANCE = 4.6

# Metres and radians, and what they change by in a second.
_SIZES = (1.0, 0.1, 0.6, 0.8, 0.8, 0.8, 0.8, 0.6, 0.6)
_RATES = (0.5, 0.5, 3.0, 6.0, 6.0, 6.0, 6.0, 6.0, 6.0)
_UNITS = ("m", "m", *["rad"] * 7)

STATE_CHANNELS = (
    *(
        Channel(name, unit, "position", scale=size, invariant=name == "x")
        for name, unit, size in zip(COORDINATES, _UNITS, _SIZES, strict=True)
    ),
    *(
        Channel(f"{name}_rate", f"{unit}/s", "rate", rate_of=name, scale=size)
        for name, unit, size in zip(COORDINATES, _UNITS, _RATES, strict=True)
    ),
)
JOINTS = (
    Joint("x", "x", "x_rate", "N", scale=2.0, driven=False),
    Joint("z", "z", "z_rate", "N", scale=2.0, driven=False),
    Joint("pitch", "pitch", "pitch_rate", "N m", scale=0.5, driven=False),
    *(Joint(name, name, f"{name}_rate", "N m", scale=0.5) for name in MOTORS),
)

# Steps of Pymunk in one of the simulator's sub-steps.
INNER = 5


def leo_parameters(
    torso_mass: float = IDEALISED_TORSO, friction: float = 0.0
) -> dict[str, Parameter]:
    """The parameters of Leo; the true one has 1.250 kg and 0.03 N m s/rad (paper, Table I)."""
    return {
        "torso_mass": Parameter(torso_mass, "kg", "mass of the torso", low=0.1),
        "torso_inertia": Parameter(
            TORSO.inertia, "kg m^2", "inertia of the torso about its centre of mass", low=1e-4
        ),
        "arm_mass": Parameter(ARM.mass, "kg", "mass of the arm, welded to the torso", low=0.0),
        "thigh_mass": Parameter(THIGH.mass, "kg", "mass of each thigh", low=0.02),
        "shank_mass": Parameter(SHANK.mass, "kg", "mass of each shank", low=0.02),
        "foot_mass": Parameter(FOOT.mass, "kg", "mass of each foot", low=0.02),
        "boom_mass": Parameter(
            0.0, "kg", "mass of the boom that the hip carries", low=0.0, scale=0.5
        ),
        "gravity": Parameter(9.81, "m/s^2", "acceleration of gravity", low=0.0),
        "slope": Parameter(
            0.0, "rad", "how steeply the ground rises forward", low=-1.0, high=1.0, scale=0.1
        ),
        "ground_friction": Parameter(10.0, "1", "friction of the soles on the ground", low=0.0),
        "torque_constant": Parameter(
            TORQUE_CONSTANT, "N m/A", "torque constant of each motor with its gear", low=1e-2
        ),
        "resistance": Parameter(RESISTANCE, "ohm", "resistance of each winding", low=1e-2),
        "supply": Parameter(1.0, "1", "share of the commanded voltage that arrives", low=0.0),
        "friction": Parameter(
            friction,
            "N m s/rad",
            "viscous friction of all joints",
            low=0.0,
            scale=0.3,
            family="dissipation",
        ),
    }


class Leo(HostSimulator):
    """A planar biped: torso with a welded arm, and two legs of thigh, shank and foot.

    The base is free: x forward and z up are those of the torso's centre, z = 0 its height on
    straight legs; with a slope, both are along and across the ground. A positive pitch leans
    forward. Hips swing forward, knees flex to the negative, ankles lift the toe. The motors
    pull with (K / R) (U - K rate) less viscous friction, all referred to the joint. Heel and
    toe stand on wheels that do not turn: rigid, inelastic contacts with Coulomb friction.

    Dynamics do not depend on x. Every effect of the library can be hosted, on the six joints
    and on the three coordinates of the torso (where a boom would rub or lift).

    Args:
        torso_mass: kg; 0.94226 is the idealised Leo, 1.250 the true one.
        friction: Viscous friction of all six joints, N m s/rad.
        stops: Whether the joints have the mechanical stops of the robot; the authors' model
            has none.
        voltage: Largest voltage of the motors; 8.6 V in the authors' code at the time of the paper,
            with which learning takes longer (docs/deviations.md).
        dt: Control period in seconds.
        substeps: Sub-steps per control period, each of five steps of Pymunk.
        effects: What acts beside all that.
    """

    name = "leo"
    joints = JOINTS
    has_drive_force = True
    has_contacts = True

    def __init__(
        self,
        torso_mass: float = IDEALISED_TORSO,
        friction: float = 0.0,
        stops: bool = False,
        voltage: float = 10.7745,
        dt: float = 0.03,
        substeps: int = 30,
        effects: Sequence[Effect] = (),
    ) -> None:
        self.dt = dt
        self.substeps = substeps
        self.stops = stops
        self.parameters = leo_parameters(torso_mass, friction)
        self.state_channels = STATE_CHANNELS
        self.action_channels = tuple(
            Channel(f"{name}_voltage", "V", "input", scale=voltage, low=-voltage, high=voltage)
            for name in MOTORS
        )
        hosted = self.with_effects(effects)
        self.effects, self.state_channels = hosted.effects, hosted.state_channels

    @classmethod
    def true(cls, **options: Any) -> Self:
        """The paper's true Leo: a torso of 1.250 kg and friction of 0.03 N m s/rad."""
        return cls(TRUE_TORSO, TRUE_FRICTION, **options)

    def renderer(self) -> LeoRenderer:
        """How it looks."""
        return LeoRenderer()

    def smooth_states(self, n: int, rng: np.random.Generator) -> Array:
        """Random states in the air, see ``HostSimulator.smooth_states``."""
        states = super().smooth_states(n, rng)
        states[:, 1] += 1.0
        return states

    def drive_forces(self, states: Array, inputs: Array) -> Array:
        """Torques of the motors, shape (n, 9), zero on x, z and pitch."""
        p: dict[str, Any] = {
            name: value[:, None] if isinstance(value, np.ndarray) and value.ndim else value
            for name, value in self.parameter_values().items()
        }
        k, supply = p["torque_constant"], p["supply"]
        torques = k / p["resistance"] * (supply * inputs - k * states[:, 12:18])
        return np.concatenate([np.zeros((len(states), 3)), torques], axis=1)

    def integrate(self, states: Array, inputs: Array, durations: Array) -> Array:
        """See ``HostSimulator.integrate``."""
        states, inputs = np.asarray(states, float), np.asarray(inputs, float)
        values = self.parameter_values()
        effects: list[Effect] = [*self.joint_effects(), *self.plays()]
        by_row = any(effect.rows is not None for effect in effects)
        after = np.empty_like(states)
        for i, (state, volts) in enumerate(zip(states, inputs, strict=True)):
            row = {
                name: float(value[i] if isinstance(value, np.ndarray) and value.ndim else value)
                for name, value in values.items()
            }
            own = [effect.take(i) for effect in effects] if by_row else effects
            h = float(durations[i]) / (len(volts) * INNER)
            after[i] = self._advance(state, volts, h, row, own)
        return after

    def _advance(
        self, state: Array, volts: Array, h: float, p: dict[str, float], effects: list[Effect]
    ) -> list[float] | float:
        """One row through one control period."""
        if not np.isfinite(state).all():
            return np.nan
        k, supply, friction = p.pop("torque_constant"), p.pop("supply"), p.pop("friction")
        drive = k / p.pop("resistance")
        start = state.tolist()
        forces = Forces(effects, drive * supply, k * drive, friction, h, start)
        scratch = chain(self.stops, forces.dry)
        scratch.prepare(Build(**p), h)
        # Far from x = 0 nothing else may round differently.
        scratch.set([0.0, *start[1:9]], start[9:18])
        forces.brake(scratch)
        for voltage, steps in _runs(volts):
            forces.run(scratch, voltage, steps)
        q, v = scratch.get()
        return [start[0] + q[0], *q[1:], *v, *forces.plays()]


def _runs(volts: Array) -> list[tuple[list[float], int]]:
    """Voltages of one row, (substeps, 6) or with rises (substeps, 6, 2), and for how long each."""
    if volts.ndim == 3:
        mean, rise = volts[..., 0], volts[..., 1]
        if rise.any():
            share = (np.arange(INNER) + 0.5) / INNER - 0.5
            inner = mean[:, None] + rise[:, None] * share[:, None]
            return [(voltage, 1) for voltage in inner.reshape(-1, mean.shape[1]).tolist()]
        volts = mean
    changes = np.flatnonzero((volts[1:] != volts[:-1]).any(axis=1)) + 1
    edges = [0, *changes.tolist(), len(volts)]
    return [
        (volts[begin].tolist(), INNER * (end - begin)) for begin, end in itertools.pairwise(edges)
    ]
