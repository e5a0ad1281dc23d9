"""A slide on a guide, of which force, friction and mass are easily mistaken for each other."""

from typing import ClassVar

import numpy as np

from residual.trajectories import Trajectory
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter


class Slide(EquationOfMotion):
    """A motor pushes a slide that its guide brakes."""

    dt = 0.02
    state_channels = (
        Channel("slide", "m", "position", scale=0.2),
        Channel("slide rate", "m/s", "rate", rate_of="slide", scale=0.3),
    )
    action_channels = (Channel("pwm", "1", "input", scale=100.0, low=-320.0, high=320.0),)
    parameters: ClassVar[dict[str, Parameter]] = {
        "mass": Parameter(4.0, "kg", "mass of the slide", low=0.1),
        "force_per_count": Parameter(0.5, "N", "force per count", low=0.0),
        "damping": Parameter(60.0, "N s/m", "damping", low=0.0, family="dissipation"),
    }

    def acceleration(self, q, v, u, force, p):
        push = p.force_per_count * u[:, 0] - p.damping * v[:, 0]
        return ((push + force[:, 0]) / p.mass)[:, None]


def braked(force, friction, mass, dt):
    """Positions from rest under forces that are held (n,), viscous friction by closed form."""
    rate, places, place, speed = friction / mass, [], 0.0, 0.0
    for steady in np.asarray(force) / friction:
        places.append(place)
        place += steady * dt + (speed - steady) * (1 - np.exp(-rate * dt)) / rate
        speed = steady + (speed - steady) * np.exp(-rate * dt)
    return np.array(places)


def recorded(name, places, pwm, dt, noise, rng):
    """A log of noisy positions, the rate not measured."""
    seen = places + noise * rng.standard_normal(len(places))
    states = np.stack([seen, np.full(len(places), np.nan)], axis=1)
    return Trajectory(name, dt * np.arange(len(places)), states, pwm[:-1, None])
