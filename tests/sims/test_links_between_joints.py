"""Springs and dampers between two joints: against SciPy, and what they keep of the energy."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from sims.effects import AsymmetricCouplingDamping, CouplingDamper, CouplingSpring, library
from sims.effects.library import further_in
from sims.effects.link import linked_joints
from sims.equations import EquationOfMotion
from sims.simulator import Channel

MASSES = np.array([1.2, 0.8])


def joints(*names, unit="m"):
    return tuple(
        channel
        for name in names
        for channel in (
            Channel(name, unit, "position", scale=0.1),
            Channel(f"{name} rate", f"{unit}/s", "rate", rate_of=name, scale=0.5),
        )
    )


class Carts(EquationOfMotion):
    """Two carts on a track, which nothing joins."""

    dt = 0.01
    state_channels = joints("left", "right")
    action_channels = (Channel("push", "N", "input", scale=4.0),)

    def acceleration(self, q, v, u, force, p):
        return (force + u * np.array([1.0, 0.0])) / MASSES


class Winch(Carts):
    """A drum and a load: a turn and a way."""

    state_channels = (*joints("drum", unit="rad"), *joints("load"))


@pytest.mark.parametrize(
    ("ratio", "rest", "forward", "near"),
    [(1.0, 0.0, 0.0, 1e-7), (-0.6, 0.05, 0.0, 1e-7), (-0.6, 0.05, 0.8, 1e-5)],
)
def test_carts_on_a_band_swing_as_scipy_says(ratio, rest, forward, near):
    stiffness, coefficient = 30.0, 1.5
    pushes = np.repeat([4.0, -4.0, 0.0], 40)
    band = [
        CouplingSpring("left and right", ratio, stiffness, rest),
        CouplingDamper("left and right", ratio, coefficient),
        AsymmetricCouplingDamping("left and right", ratio, forward),
    ]
    path = Carts(effects=band, substeps=4).rollout(np.zeros(4), pushes[:, None])

    def rates(_, x, u):
        parting = x[1] - ratio * x[3]
        harder = coefficient + forward * np.sign(parting)
        force = -stiffness * (x[0] - ratio * x[2] - rest) - harder * parting
        return [x[1], (u + force) / MASSES[0], x[3], -ratio * force / MASSES[1]]

    x = np.zeros(4)
    for k, u in enumerate(pushes):
        x = solve_ivp(rates, (0, 0.01), x, args=(u,), rtol=1e-9, atol=1e-11).y[:, -1]
        assert path[k + 1] == pytest.approx(x, abs=near)


@settings(max_examples=25)
@given(st.floats(-3, 3), st.floats(-0.2, 0.2), st.lists(st.floats(-1, 1), min_size=4, max_size=4))
def test_a_band_keeps_energy_and_a_damper_takes_it(ratio, rest, start):
    stiffness = 30.0
    spring = CouplingSpring("left and right", ratio, stiffness, rest)

    def energy(x):
        kinetic = 0.5 * MASSES @ x[1::2] ** 2
        return kinetic + 0.5 * stiffness * (x[0] - ratio * x[2] - rest) ** 2

    def after(*effects):
        path = Carts(effects=effects, substeps=10).rollout(start, np.zeros((20, 1)))
        return energy(path[-1])

    before = energy(np.array(start))
    assert after(spring) == pytest.approx(before, rel=1e-5, abs=1e-9)
    assert after(spring, CouplingDamper("left and right", ratio, 2.0)) <= before * (1 + 1e-5) + 1e-9


def test_links_are_rarer_effects_of_neighbours_of_one_unit():
    kinds = "coupling_spring", "coupling_damper", "asymmetric_coupling_damping"
    linked = {f"{kind}@left and right" for kind in kinds}
    assert linked <= set(map(str, further_in(Carts())))
    assert not linked & set(map(str, library(Carts())))
    assert linked_joints(Winch()) == []
    with pytest.raises(ValueError, match="pair of joints of one unit 'drum and load'"):
        Winch(effects=[CouplingSpring("drum and load", 1.0, 30.0)])
