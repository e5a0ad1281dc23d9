"""Two states that use each other up where they meet, against SciPy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sims.effects import Reaction, library
from sims.effects.library import further_in
from sims.equations import FirstOrderSystem
from sims.simulator import Channel


class Tank(FirstOrderSystem):
    """Two reagents that are fed and washed out, and its temperature."""

    dt = 5.0
    state_channels = (
        Channel("acid", "mol/L", "other", scale=1.0),
        Channel("alcohol", "mol/L", "other", scale=0.5),
        Channel("temperature", "degC", "other", scale=20.0),
    )
    action_channels = (Channel("dilution", "1/s", "input", low=0.0, high=0.1, scale=0.02),)

    def derivative(self, x, u, p):
        return u * (np.array([2.0, 1.5, 20.0]) - x)


@pytest.mark.parametrize(("first", "second"), [(0.02, 0.02), (0.03, -0.01), (0.0, 0.04)])
def test_a_reaction_runs_as_scipy_says(first, second):
    dilution = np.repeat([0.0, 0.05, 0.01], 15)
    tank = Tank(effects=[Reaction("acid and alcohol", first, second)], substeps=8)
    path = tank.rollout([1.0, 0.8, 35.0], dilution[:, None])

    def rates(_, x, u):
        meet = x[0] * x[1]
        return [
            u * (2.0 - x[0]) - first * meet, u * (1.5 - x[1]) - second * meet, u * (20.0 - x[2]),
        ]  # fmt: skip

    x = np.array([1.0, 0.8, 35.0])
    for k, u in enumerate(dilution):
        x = solve_ivp(rates, (0, 5.0), x, args=(u,), rtol=1e-10, atol=1e-12).y[:, -1]
        assert path[k + 1] == pytest.approx(x, abs=1e-6)


class Bloom(FirstOrderSystem):
    """Algae in g/L and a herbicide in mg/L, at a temperature."""

    dt = 5.0
    state_channels = (
        Channel("algae", "g/L", "other", scale=2.0),
        Channel("herbicide", "mg/L", "other", scale=30.0),
        Channel("temperature", "degC", "other", scale=20.0),
    )
    action_channels = ()

    def derivative(self, x, u, p):
        return 0.01 * x


def test_concentrations_meet_whatever_their_units():
    (reaction,) = (e for e in further_in(Bloom()) if isinstance(e, Reaction))
    assert str(reaction) == "reaction@algae and herbicide"
    known = reaction.quantities(Bloom())
    assert known["from_first"].unit in ("L/(s mg)", "L/(mg s)")
    assert known["from_second"].unit in ("L/(s g)", "L/(g s)")
    bloom = Bloom(effects=[reaction.with_values(from_first=1e-3)], substeps=4)
    after = bloom.rollout([2.0, 30.0, 20.0], np.zeros((1, 0)))[-1]
    exact = solve_ivp(
        lambda _, x: [0.01 * x[0] - 1e-3 * x[0] * x[1], 0.01 * x[1]], (0, 5.0), [2.0, 30.0],
        rtol=1e-10,
    ).y[:, -1]  # fmt: skip
    assert after[:2] == pytest.approx(exact, rel=1e-4)


def test_only_what_has_one_unit_reacts():
    reactions = [str(e) for e in further_in(Tank()) if isinstance(e, Reaction)]
    assert reactions == ["reaction@acid and alcohol"]
    assert not [e for e in library(Tank()) if isinstance(e, Reaction)]
    with pytest.raises(ValueError, match="two concentrations, 'acid and temperature'"):
        Tank(effects=[Reaction("acid and temperature", 0.1)])


def test_strength_zero_changes_no_bit():
    rng = np.random.default_rng(0)
    states, actions = rng.uniform(0, 2, (20, 3)), rng.uniform(0, 0.1, (20, 1))
    plain = Tank().step(states, actions)
    assert np.array_equal(Tank(effects=[Reaction("acid and alcohol")]).step(states, actions), plain)
