"""Nominal models of the measured systems in docs/find-gap.md: what one would write down first."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.host import Joint
from sims.simulator import Array, Channel, Parameter
from studies.running.files import atomic_write_text

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
    parameters = {"mass": Parameter(1.0, "kg", "mass of the cart", low=1e-3)}  # noqa: RUF012

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
    parameters = {  # noqa: RUF012
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
    up from rest it gives the velocity but for the start speed (docs/find-gap.md).
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


def sum_accelerations(source: str | Path, target: str | Path) -> None:
    """Sum an accelerometer's log up to velocities, for ``FallingPhone``.

    The start speed of a trial is not in the log; it is taken as zero, which is nearly true for a
    phone that was dropped and wrong for one that was thrown.

    Args:
        source: CSV with columns kind, trial, t in s and az in m/s^2, zero in free fall.
        target: CSV to write, with the column velocity in m/s in place of az.
    """
    table = pd.read_csv(source)
    trials = []
    for _, trial in table.groupby(["kind", "trial"], sort=False):
        steps = np.diff(trial["t"])
        middle = 0.5 * (trial["az"].to_numpy()[1:] + trial["az"].to_numpy()[:-1])
        felt = np.concatenate([[0.0], np.cumsum(steps * middle)])
        trials.append(trial.assign(velocity=felt - 9.8 * (trial["t"] - trial["t"].iloc[0])))
    columns = ["kind", "trial", "t", "velocity"]
    atomic_write_text(target, pd.concat(trials)[columns].to_csv(index=False))
