"""A plate on a heater, for tests."""

from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter


class Plate(FirstOrderSystem):
    """A plate on a heater, above the room."""

    dt = 1.0
    state_channels = (Channel("warmth", "K", "other", scale=50.0),)
    action_channels = (Channel("power", "1", "input", scale=1.0, low=0.0, high=1.0),)
    parameters = {"time_constant": Parameter(30.0, "s", "of the plate", low=0.1)}

    def derivative(self, x, u, p):
        return ((60.0 * u[:, 0] - x[:, 0]) / p.time_constant)[:, None]
