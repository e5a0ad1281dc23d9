"""Orders of cogging beyond those that are always looked for."""

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.gap.search.orders import higher_orders
from residual.trajectories import Trajectory
from sims.effects import Cogging
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

DT, INERTIA, DAMPING = 0.005, 0.003, 0.012


class Gimbal(EquationOfMotion):
    """A motor that turns a camera."""

    dt = DT
    state_channels = (
        Channel("angle", "rad", "position", angle=True),
        Channel("rate", "rad/s", "rate", rate_of="angle", scale=2.0),
    )
    action_channels = (Channel("torque", "N m", "input", scale=0.1),)

    def __init__(self):
        self.parameters = {
            "inertia": Parameter(INERTIA, "kg m^2", "of the camera", low=1e-5),
            "damping": Parameter(DAMPING, "N m s/rad", "of the bearing", low=0.0,
                                 family="dissipation"),
        }  # fmt: skip
        super().__init__()

    def acceleration(self, q, v, u, force, p):
        return ((u[:, 0] + force[:, 0] - p.damping * v[:, 0]) / p.inertia)[:, None]


def swept(seed, order, size=0.02, n=3000):
    """Swept to and fro; the speed is not measured."""
    rng = np.random.default_rng(seed)
    torque = np.repeat(rng.uniform(-0.09, 0.09, n // 60), 60)

    def rates(_, x, u):
        pull = size * np.sin(order * x[0] + 0.7)
        return [x[1], (u + pull - 1.01 * DAMPING * x[1]) / INERTIA]

    seen = path(rates, [0.0, 0.0], torque, DT)[:-1]
    angle = 1e-4 * np.round((seen[:, 0] + 1e-4 * rng.standard_normal(n)) / 1e-4)
    states = np.stack([angle, np.full(n, np.nan)], axis=1)
    return Trajectory(f"run {seed}", DT * np.arange(n), states, torque[:-1, None])


@pytest.mark.parametrize("order", [14, 24, 42])
def test_the_order_that_a_motor_has_shows(order):
    found = higher_orders(Gimbal(), [swept(1, order)], [Cogging("angle")])
    assert order in [one.order for one in found]
    assert all(one.joint == "angle" and one.absent for one in found)


def test_none_shows_where_there_is_none():
    assert not higher_orders(Gimbal(), [swept(1, 14, size=0.0)], [Cogging("angle")])
    assert not higher_orders(Gimbal(), [swept(1, 14)], [])


@pytest.mark.long
def test_it_is_named_at_its_size():
    found = find_gap(Gimbal(), [swept(seed, 14) for seed in range(2)])
    (pull,) = [e for e in found.effects if e.name == "cogging"]
    assert pull.order == 14 and np.hypot(pull.sine, pull.cosine) == pytest.approx(0.02, rel=0.1)
