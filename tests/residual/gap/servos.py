"""Servos that follow a command, as a first-order system and as an equation of motion."""

from typing import ClassVar

from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.simulator import Channel, Parameter

DT, SLOW, FREQUENCY, DAMPING = 0.02, 0.08, 20.0, 0.8


class SlowServo(FirstOrderSystem):
    """An angle that approaches its command."""

    name, dt = "servo", DT
    state_channels = (Channel("angle", "deg", "other", scale=60.0),)
    action_channels = (Channel("command", "deg", "input", low=-90.0, high=90.0, scale=60.0),)
    parameters: ClassVar = {"slow": Parameter(SLOW, "s", "time constant", low=0.001)}

    def derivative(self, x, u, p):
        return ((u[:, 0] - x[:, 0]) / p.slow)[:, None]


class Servo(EquationOfMotion):
    """A servo of second order; its command is in degrees."""

    name, dt = "servo", DT
    state_channels = (
        Channel("angle", "rad", "position", scale=1.0),
        Channel("rate", "rad/s", "rate", rate_of="angle", scale=5.0),
    )
    action_channels = (Channel("command", "deg", "input", low=-120.0, high=120.0, scale=60.0),)
    parameters: ClassVar = {
        "frequency": Parameter(FREQUENCY, "rad/s", "natural frequency", low=0.1),
        "damping": Parameter(DAMPING, "1", "damping ratio", low=0.0),
    }

    def acceleration(self, q, v, u, force, p):
        wanted = u[:, 0] * 3.141592653589793 / 180
        pull = p.frequency**2 * (wanted - q[:, 0]) - 2 * p.damping * p.frequency * v[:, 0]
        return pull[:, None] + force
