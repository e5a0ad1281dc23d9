"""What shows less than a period is no cogging, and a spring may be two plainer effects."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from residual.gap import find_gap
from residual.gap.data.samples import Samples
from residual.gap.model.candidates import candidates
from residual.trajectories import Trajectory
from sims.effects import Cogging
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

DT = 0.02


class Rod(EquationOfMotion):
    """A rod that swings about hanging."""

    dt = DT
    state_channels = (
        Channel("angle", "rad", "position", angle=True, scale=0.1),
        Channel("rate", "rad/s", "rate", rate_of="angle", scale=1.0),
    )
    action_channels = ()
    parameters = {
        "length": Parameter(0.129, "m", "length", low=0.01),
        "mass": Parameter(0.024, "kg", "mass", low=1e-3),
    }

    def acceleration(self, q, v, u, force, p):
        inertia = p.mass * p.length**2 / 3
        pull = 9.81 * p.mass * p.length / 2 * np.sin(q[:, 0])
        return ((force[:, 0] - pull) / inertia)[:, None]


def swing(start, length=0.122, offset=0.004, seconds=4.2, seed=0):
    """A shorter rod, an encoder whose zero is off and which knows 0.0015 rad, no other sensor."""
    times = np.arange(round(seconds / DT)) * DT

    def slope(_, x):
        return [x[1], -1.5 * 9.81 / length * np.sin(x[0]) - 0.1 * x[1]]

    found = solve_ivp(slope, (0, times[-1]), [start, 0.0], t_eval=times, rtol=1e-9, atol=1e-11)
    states = np.full((len(times), 2), np.nan)
    states[:, 0] = np.round((found.y[0] + offset) / 0.0015) * 0.0015
    return Trajectory(f"{start} rad", times, states, np.zeros((len(times) - 1, 0)))


def orders(start):
    samples = Samples.join([swing(start)], 4)
    return [int(c.effect.order) for c in candidates(Rod(), [Cogging("angle")], samples)]


def test_cogging_is_looked_for_where_a_whole_period_was_seen():
    assert orders(0.06) == []
    assert min(orders(0.8)) == 4  # 2 pi / 1.6 rad
    assert orders(0.8) == list(range(4, 13))


@pytest.mark.long
def test_a_small_swing_names_no_law_that_its_motion_cannot_show():
    found = find_gap(Rod(), [swing(0.06)])
    named = {v.effect: v for v in found.verdicts if v.kind in ("confirmed", "ambiguous")}
    assert "cogging" not in named
    # The length with an offset or a load, or the spring that is both: not certain which.
    stiffer = {"length", "linear_spring"}
    either = [{v.effect, *(a.split("@")[0] for a in v.alternatives)} for v in named.values()]
    assert any(stiffer <= {name.split("@")[0] for name in names} for names in either)
    assert not any(v.kind == "confirmed" and v.effect in stiffer for v in named.values())
    blind = [v.alternatives for v in found.verdicts if v.kind == "needs_data"]
    assert not {"length", "sensor_offset@angle"} & {name for names in blind for name in names}


class Free(Rod):
    """A shaft that nothing pulls at, driven by a torque."""

    state_channels = (
        Channel("angle", "rad", "position", scale=5.0),
        Channel("rate", "rad/s", "rate", rate_of="angle", scale=5.0),
    )
    action_channels = (Channel("torque", "N m", "input", low=-2.0, high=2.0),)
    parameters = {}

    def acceleration(self, q, v, u, force, p):
        return 40.0 * (u + force) - 3.0 * v


def shaft(orders):
    """It with torques that repeat along a turn, one for each order."""
    rng = np.random.default_rng(2)
    torque = np.repeat(rng.uniform(-1.0, 1.0, 40), 20)[:, None]
    effects = [Cogging("angle", 0.12, 0.05, float(order)) for order in orders]
    states = Free(effects=effects).rollout(np.zeros(2), torque)
    states = states + rng.normal(0.0, [2e-3, 3e-2], states.shape)
    return Trajectory("run", DT * np.arange(len(states)), states, torque)


@pytest.mark.long
def test_several_orders_together_are_not_certain():
    """They fit whatever follows the position, as a wind or a path of its own does."""
    for orders, kind in (((3,), "confirmed"), ((3, 5), "ambiguous")):
        offered = ("cogging", "viscous_friction", "coulomb_friction", "unbalance", "actuator_gain")
        found = find_gap(Free(), [shaft(orders)], effects=offered)
        named = [v for v in found.verdicts if v.effect == "cogging" and v.parameters]
        assert {v.shape["order"] for v in named} == set(orders)
        assert {v.kind for v in named} == {kind}
        assert all(("orders" in v.doubts) == (len(orders) > 1) for v in named)
