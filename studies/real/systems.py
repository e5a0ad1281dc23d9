"""Nominal models of the measured rigs in docs/real-rigs.md: what one would write down first."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.simulator import Array, Channel, Joint, Parameter

GRAVITY = 9.81


class FreeCart(EquationOfMotion):
    """A cart on an air track that nothing pushes: x'' = 0, per unit of mass.

    Length is in the unit of the source, which is not stated.
    """

    name = "free cart"
    dt = 1 / 30
    substeps = 4
    state_channels = (
        Channel("position", "m", "position", scale=100.0),
        Channel("velocity", "m/s", "rate", rate_of="position", scale=100.0),
    )
    action_channels = ()
    parameters = {"mass": Parameter(1.0, "kg", "mass of the cart", low=1e-3)}

    def acceleration(self, q: Array, v: Array, u: Array, force: Array, p: Any) -> Array:
        """Force over mass."""
        return force / np.reshape(p.mass, (-1, 1))


class GearedPendulum(EquationOfMotion):
    """A pendulum on a geared motor, driven by a measured torque; the angle counts from hanging.

    J q'' = torque - offset - g m l sin q - coulomb tanh(q' / 0.05).
    """

    name = "geared pendulum"
    dt = 0.005
    substeps = 2
    state_channels = (
        Channel("angle", "rad", "position", angle=True),
        Channel("rate", "rad/s", "rate", rate_of="angle", scale=5.0),
    )
    action_channels = (Channel("torque", "N m", "input", scale=2.0),)

    def __init__(
        self,
        inertia: float,
        moment: float,
        offset: float = 0.0,
        coulomb: float = 0.0,
        payload: float = 0.0,
        arm: float = 0.5,
    ) -> None:
        """Make the pendulum.

        Args:
            inertia: Moment of inertia about the pivot in kg m^2.
            moment: Mass times distance of the centre of gravity in kg m.
            offset: Constant torque against the motor in N m.
            coulomb: Dry friction that is known already, in N m.
            payload: Mass at the end of the arm in kg.
            arm: Distance of the payload in m.
        """
        self.parameters = {
            "inertia": Parameter(inertia, "kg m^2", "moment of inertia", low=1e-3),
            "moment": Parameter(moment, "kg m", "mass times distance of its centre", low=0.0),
            "payload": Parameter(payload, "kg", "mass at the end of the arm", low=0.0),
        }
        self.offset, self.coulomb, self.arm = offset, coulomb, arm
        super().__init__()

    def acceleration(self, q: Array, v: Array, u: Array, force: Array, p: Any) -> Array:
        """Torques over moment of inertia."""
        weight = GRAVITY * (p.moment + p.payload * self.arm) * np.sin(q[:, 0])
        known = self.offset + self.coulomb * np.tanh(v[:, 0] / 0.05)
        inertia = p.inertia + p.payload * self.arm**2
        return ((u[:, 0] - known - weight + force[:, 0]) / inertia)[:, None]


class Heater(FirstOrderSystem):
    """A transistor heater on a small board: tau T' = ambient - T + gain level."""

    name = "heater"
    dt = 1.0
    substeps = 2
    state_channels = (Channel("temperature", "K", "other", scale=50.0),)
    action_channels = (Channel("level", "1", "input", scale=150.0),)
    parameters = {
        "gain": Parameter(0.3635, "K", "warming for one unit of drive level", low=0.0),
        "time_constant": Parameter(138.7, "s", "time constant", low=1.0),
        "ambient": Parameter(299.53, "K", "temperature without heating"),
    }

    def derivative(self, x: Array, u: Array, p: Any) -> Array:
        """Heating less cooling."""
        rise = p.ambient - x[:, 0] + p.gain * u[:, 0]
        return (rise / p.time_constant)[:, None]


class FallingPhone(EquationOfMotion):
    """A phone in free flight, per unit of mass: v' = -9.8 m/s^2.

    Its accelerometer feels every force but gravity. What was measured is thus no state; summed
    up from rest it gives the velocity but for the start speed (docs/real-rigs.md).
    """

    name = "falling phone"
    dt = 0.005
    substeps = 1
    state_channels = (
        Channel("height", "m", "position"),
        Channel("velocity", "m/s", "rate", rate_of="height", scale=5.0),
    )
    action_channels = ()
    joints = (Joint("phone", "height", "velocity", "N/kg", scale=10.0),)

    def acceleration(self, q: Array, v: Array, u: Array, force: Array, p: Any) -> Array:
        """Free fall with a force."""
        return force - 9.8


class Drives(EquationOfMotion):
    """Drives of which each turns an inertia, on its own: J q'' = torque."""

    name = "drives"
    substeps = 2

    def __init__(self, inertias: Sequence[float], names: Sequence[str], dt: float) -> None:
        """Make the drives.

        Args:
            inertias: Moment of inertia of each in kg m^2.
            names: What each is called; its channels are ``angle``, ``rate`` and ``torque`` of it.
            dt: Control period in s.
        """
        angles = [Channel(f"angle {n}", "rad", "position", angle=True) for n in names]
        rates = [Channel(f"rate {n}", "rad/s", "rate", rate_of=f"angle {n}") for n in names]
        self.state_channels = (*angles, *rates)
        self.action_channels = tuple(
            Channel(f"torque {n}", "N m", "input", scale=5.0) for n in names
        )
        self.parameters = {
            f"inertia {n}": Parameter(value, "kg m^2", f"inertia of drive {n}", low=1e-5)
            for n, value in zip(names, inertias, strict=True)
        }
        super().__init__(dt=dt)

    def acceleration(self, q: Array, v: Array, u: Array, force: Array, p: Any) -> Array:
        """Torque over inertia."""
        torques = (u + force).T
        moved = zip(torques, self.parameters, strict=True)
        return np.stack([torque / getattr(p, name) for torque, name in moved], axis=1)


class Car(FirstOrderSystem):
    """A model car at low speed: a bicycle that rolls where its wheels point, actuators ideal.

    x' = v cos h, y' = v sin h, h' = v tan(steering) / wheelbase; the speed is the one asked for
    within a control period.
    """

    name = "car"
    dt = 0.025
    substeps = 5
    state_channels = (
        Channel("x", "m", "other", invariant=True),
        Channel("y", "m", "other", invariant=True),
        Channel("heading", "rad", "other", angle=True),
        Channel("speed", "m/s", "other"),
    )
    action_channels = (
        Channel("steering", "rad", "input", scale=0.2),
        Channel("speed_command", "m/s", "input"),
    )
    parameters = {"wheelbase": Parameter(0.3302, "m", "wheelbase", low=0.01)}

    def derivative(self, x: Array, u: Array, p: Any) -> Array:
        """Rolling without slip."""
        heading, speed = x[:, 2], x[:, 3]
        reached = (u[:, 1] - speed) / (self.dt / 5)
        turn = speed * np.tan(u[:, 0]) / p.wheelbase
        return np.stack([speed * np.cos(heading), speed * np.sin(heading), turn, reached], axis=1)


class CoastingRocket(EquationOfMotion):
    """A rocket after burn-out, going straight up: h'' = -9.807 m/s^2.

    What pushes on it acts on its frontal area, so forces are counted per m^2 of it; the area per
    kg differs between rockets and comes with the log.
    """

    name = "coasting rocket"
    dt = 0.1
    substeps = 1
    state_channels = (
        Channel("altitude", "m", "position", scale=1000.0, invariant=True),
        Channel("speed", "m/s", "rate", rate_of="altitude", scale=100.0),
    )
    action_channels = (Channel("area_per_mass", "m2/kg", "input", scale=1e-3),)
    joints = (Joint("airframe", "altitude", "speed", "N/m^2", scale=1e4),)

    def acceleration(self, q: Array, v: Array, u: Array, force: Array, p: Any) -> Array:
        """Free fall with a pressure on the frontal area."""
        return force * u - 9.807
