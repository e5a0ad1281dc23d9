"""A medium that moves, beside SciPy's integration of the same boat."""

from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sims.checks import check_simulator
from sims.effects import AmbientFlow, CoulombFriction, CrankInertia
from sims.effects.library import further_in
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.simulator import Channel, Parameter

MASS, LINEAR, SQUARE = 60.0, 22.0, 25.0


class Boat(EquationOfMotion):
    """Surge, and a mast's angle that nothing damps."""

    dt = 0.1
    substeps = 4
    state_channels = (
        Channel("x", "m", "position", invariant=True),
        Channel("u", "m/s", "rate", rate_of="x", scale=1.0),
        Channel("roll", "rad", "position", angle=True),
        Channel("rolling", "rad/s", "rate", rate_of="roll", scale=1.0),
    )
    action_channels = (Channel("thrust", "N", "input", scale=50.0),)
    parameters: ClassVar = {"mass": Parameter(MASS, "kg", "mass", low=1.0)}

    def acceleration(self, q, v, u, force, p):
        drag = LINEAR * v[:, 0] + SQUARE * v[:, 0] * np.abs(v[:, 0])
        surge = (u[:, 0] - drag + force[:, 0]) / p.mass
        return np.stack([surge, force[:, 1] - 9.0 * np.sin(q[:, 1]) - 0.2 * v[:, 1]], axis=1)


def test_drag_acts_by_the_speed_through_the_water():
    thrusts = np.repeat([60.0, -40.0, 0.0, 20.0], 40)
    path = Boat(effects=[AmbientFlow("x", 0.35)]).rollout([0, 0.2, 0, 0], thrusts[:, None])

    def rates(_, x, thrust):
        w = x[1] - 0.35
        return [x[1], (thrust - LINEAR * w - SQUARE * w * abs(w)) / MASS]

    x = np.array([0, 0.2])
    for k, thrust in enumerate(thrusts):
        found = solve_ivp(rates, (0, 0.1), x, rtol=1e-9, atol=1e-11, args=(thrust,), max_step=0.02)
        x = found.y[:, -1]
        assert path[k + 1, :2] == pytest.approx(x, abs=1e-5)
    drifting = Boat(effects=[AmbientFlow("x", 0.35)]).rollout(np.zeros(4), np.zeros((3000, 1)))
    assert drifting[-1, 1] == pytest.approx(0.35, abs=1e-6)


def test_every_row_has_its_own_beside_other_effects():
    rng = np.random.default_rng(3)
    states, thrusts = rng.standard_normal((6, 4)), rng.uniform(-60, 60, (6, 1))
    speeds = np.linspace(-0.5, 0.5, 6)
    beside = [CoulombFriction("x", 5.0), CrankInertia("roll", cosine_1=0.2)]
    together = Boat(effects=[*beside, AmbientFlow("x", speeds)]).step(states, thrusts)
    for i, speed in enumerate(speeds):
        own = Boat(effects=[*beside, AmbientFlow("x", float(speed))])
        assert np.array_equal(own.step(states[i : i + 1], thrusts[i : i + 1])[0], together[i])
    still = Boat(effects=[AmbientFlow("x", 0.0)]).step(states, thrusts)
    assert np.array_equal(still, Boat().step(states, thrusts))
    assert "failed" not in repr(check_simulator(Boat(effects=[AmbientFlow("x", 0.2)])))


class Sled(Boat):
    """Nothing depends on its speed."""

    def acceleration(self, q, v, u, force, p):
        return np.stack([(u[:, 0] + force[:, 0]) / p.mass, force[:, 1]], axis=1)


class Speed(FirstOrderSystem):
    state_channels = (Channel("speed", "m/s", "rate", scale=1.0),)
    action_channels = (Channel("thrust", "N", "input", scale=50.0),)

    def derivative(self, x, u, p):
        return u - x


def test_it_is_looked_for_where_something_slides_and_feels_its_speed():
    flows = [effect for effect in further_in(Boat()) if isinstance(effect, AmbientFlow)]
    assert [str(flow) for flow in flows] == ["ambient_flow@x"]
    assert flows[0].quantities(Boat())["speed"].unit == "m/s"
    for host in (Sled(), Speed()):
        assert not [effect for effect in further_in(host) if isinstance(effect, AmbientFlow)]
    with pytest.raises(ValueError, match=r"needs a joint of an EquationOfMotion; 'speed' is none"):
        Speed().with_effects([AmbientFlow("speed", 0.1)])
