"""The nominal simulators of the dirty world: what one would write down from the drawing."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.host import HostSimulator
from sims.simulator import Array, Channel, Parameter

GRAVITY = 9.81


def _angle(name: str) -> tuple[Channel, Channel]:
    """An angle and its rate."""
    return (
        Channel(name, "rad", "position", angle=True),
        Channel(f"{name} rate", "rad/s", "rate", rate_of=name, scale=3.0),
    )


def _solved(a: Array, b: Array, d: Array, first: Array, second: Array) -> Array:
    """Accelerations (n, 2) of two coordinates with the mass matrix [[a, b], [b, d]]."""
    forces = np.stack([d * first - b * second, a * second - b * first], axis=1)
    return forces / (a * d - b * b)[:, None]


class Arm(EquationOfMotion):
    """A link that swings in a vertical plane, driven by a torque; the angle counts from hanging."""

    name = "arm"
    state_channels = _angle("shoulder")
    action_channels = (Channel("torque", "N m", "input", scale=3.0),)
    parameters = {
        "mass": Parameter(1.0, "kg", "mass at the end of the link", low=0.01),
        "length": Parameter(0.5, "m", "length of the link", low=0.01),
        "inertia": Parameter(0.05, "kg m^2", "inertia of the drive", low=0.0),
    }

    def acceleration(self, q: Array, v: Array, u: Array, force: Array, p: Any) -> Array:
        """Torques over moment of inertia."""
        weight = GRAVITY * p.mass * p.length * np.sin(q[:, 0])
        total = u[:, 0] + force[:, 0] - weight
        return (total / (p.inertia + p.mass * p.length**2))[:, None]


class TwoLinkArm(EquationOfMotion):
    """Two links with point masses at their ends in a vertical plane, a torque at each joint."""

    name = "two-link arm"
    state_channels = (*_angle("shoulder"), *_angle("elbow"))
    action_channels = (
        Channel("shoulder torque", "N m", "input", scale=5.0),
        Channel("elbow torque", "N m", "input", scale=2.0),
    )
    parameters = {
        "upper_mass": Parameter(1.0, "kg", "mass at the elbow", low=0.01),
        "lower_mass": Parameter(0.5, "kg", "mass at the hand", low=0.01),
        "upper_length": Parameter(0.4, "m", "shoulder to elbow", low=0.01),
        "lower_length": Parameter(0.3, "m", "elbow to hand", low=0.01),
    }

    def acceleration(self, q: Array, v: Array, u: Array, force: Array, p: Any) -> Array:
        """Mass matrix, centrifugal torques and weight; see any textbook of robotics."""
        cross = p.lower_mass * p.upper_length * p.lower_length
        far, both = p.lower_mass * p.lower_length**2, p.upper_mass + p.lower_mass
        bend, swing = cross * np.cos(q[:, 1]), cross * np.sin(q[:, 1])
        hand = GRAVITY * p.lower_mass * p.lower_length * np.sin(q[:, 0] + q[:, 1])
        elbow = GRAVITY * both * p.upper_length * np.sin(q[:, 0])
        first = u[:, 0] + force[:, 0] - elbow - hand
        first = first + swing * v[:, 1] * (2 * v[:, 0] + v[:, 1])
        second = u[:, 1] + force[:, 1] - hand - swing * v[:, 0] ** 2
        return _solved(both * p.upper_length**2 + far + 2 * bend, far + bend, far, first, second)


class HangingCart(EquationOfMotion):
    """A cart on a rail that a force pushes, with a pole that hangs from it."""

    name = "cart with a pole"
    state_channels = (
        Channel("cart", "m", "position", scale=0.5),
        Channel("cart rate", "m/s", "rate", rate_of="cart"),
        *_angle("hinge"),
    )
    action_channels = (Channel("push", "N", "input", scale=4.0),)
    parameters = {
        "cart_mass": Parameter(1.0, "kg", "mass of the cart", low=0.01),
        "pole_mass": Parameter(0.2, "kg", "mass at the end of the pole", low=0.001),
        "length": Parameter(0.4, "m", "length of the pole", low=0.01),
        "stiffness": Parameter(8.0, "N/m", "spring that centres the cart", low=0.0),
    }

    def acceleration(self, q: Array, v: Array, u: Array, force: Array, p: Any) -> Array:
        """The textbook's equations, the pole hanging."""
        swing, cosine = p.pole_mass * p.length, np.cos(q[:, 1])
        a, b, d = p.cart_mass + p.pole_mass, swing * cosine, swing * p.length
        on_cart = u[:, 0] + force[:, 0] + swing * v[:, 1] ** 2 * np.sin(q[:, 1])
        on_cart = on_cart - p.stiffness * q[:, 0]
        on_pole = force[:, 1] - GRAVITY * swing * np.sin(q[:, 1])
        return _solved(a, b, d, on_cart, on_pole)


class Oven(FirstOrderSystem):
    """A small oven: time_constant T' = ambient - T + gain power."""

    name = "oven"
    state_channels = (Channel("temperature", "K", "other", scale=30.0),)
    action_channels = (Channel("power", "W", "input", scale=20.0),)
    parameters = {
        "gain": Parameter(2.0, "K/W", "warming for one W", low=0.0),
        "time_constant": Parameter(12.0, "s", "time constant", low=0.1),
        "ambient": Parameter(295.0, "K", "temperature without heating"),
    }

    def derivative(self, x: Array, u: Array, p: Any) -> Array:
        """Heating less cooling."""
        return ((p.ambient - x[:, 0] + p.gain * u[:, 0]) / p.time_constant)[:, None]


SYSTEMS: Mapping[str, type[EquationOfMotion] | type[FirstOrderSystem]] = {
    "arm": Arm,
    "two-link arm": TwoLinkArm,
    "cart": HangingCart,
    "oven": Oven,
}


def nominal(system: str, period: float, measured_input: bool, summed: bool) -> HostSimulator:
    """The nominal simulator with what its user declares about the log.

    Args:
        system: Of ``SYSTEMS``.
        period: Sample and control period in s.
        measured_input: The inputs were measured, so they run straight between samples.
        summed: The first position is the running sum of its rate.
    """
    substeps = max(1, round(period / 0.005)) if system != "oven" else 2
    simulator: HostSimulator = SYSTEMS[system](dt=period, substeps=substeps)
    if measured_input:
        simulator = simulator.with_hold({c.name: "linear" for c in simulator.action_channels})
    if summed:
        first, rate, *rest = simulator.state_channels
        first = dataclasses.replace(first, integrates=rate.name)
        simulator.state_channels = (first, rate, *rest)
    return simulator
