"""Laws that are bent where the simulator's are straight, in systems of first order."""

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.equations import FirstOrderSystem
from sims.simulator import Channel, Parameter


class Prey(FirstOrderSystem):
    """What grows without end, and what hunts it (Lotka and Volterra)."""

    dt = 0.3
    state_channels = (
        Channel("hares", "1", "other", scale=15.0),
        Channel("lynxes", "1", "other", scale=8.0),
    )
    action_channels = ()

    def __init__(self):
        self.parameters = {
            "growth": Parameter(0.8, "1/s", "of hares", low=0.01),
            "hunting": Parameter(0.09, "1/s", "by lynxes", low=0.0),
            "thriving": Parameter(0.02, "1/s", "of lynxes", low=0.0),
            "death": Parameter(0.28, "1/s", "of lynxes", low=0.0),
        }
        super().__init__()

    def derivative(self, x, u, p):
        hares, lynxes = x.T
        born = hares * (p.growth - p.hunting * lynxes)
        return np.stack([born, lynxes * (p.thriving * hares - p.death)], axis=1)


def crowded(seed, start, n=160):
    """Hares stand in each other's way, by the square of their number."""
    rng = np.random.default_rng(seed)

    def rates(_, x, u):
        hares, lynxes = x
        born = hares * (0.81 - 0.025 * hares - 0.0885 * lynxes)
        return [born, lynxes * (0.02 * hares - 0.28)]

    seen = path(rates, start, np.zeros(n), 0.3)
    seen = seen + rng.normal(0.0, (0.03, 0.012), seen.shape)
    return Trajectory(f"run {seed}", 0.3 * np.arange(n + 1), seen, np.zeros((n, 0)))


@pytest.mark.long
@pytest.mark.parametrize("seed", range(3))
def test_growth_that_ends_is_no_tenth_of_the_growth_and_a_constant(seed):
    starts = ([12.0, 5.0], [17.0, 4.0])
    found = find_gap(Prey(), [crowded(10 * seed + i, s) for i, s in enumerate(starts)])
    (crowd,) = [v for v in found.verdicts if v.kind == "confirmed"]
    assert crowd.label == "power_loss@hares"
    assert crowd.parameters["power"].low <= 2.0 <= crowd.parameters["power"].high


class Reactor(FirstOrderSystem):
    """A is fed and turns to B, and B to something else, each by itself."""

    dt = 90.0
    state_channels = (
        Channel("a", "mol/L", "other", scale=2.0),
        Channel("b", "mol/L", "other", scale=0.5),
    )
    action_channels = (
        Channel("space", "1/s", "input", scale=0.001, low=0.0, high=0.01),
        Channel("feed", "mol/L", "input", scale=3.0, low=0.0, high=20.0),
    )

    def __init__(self):
        self.parameters = {
            "first": Parameter(0.0011, "1/s", "of A to B", low=0.0),
            "second": Parameter(0.0007, "1/s", "of B", low=0.0),
        }
        super().__init__()

    def derivative(self, x, u, p):
        a, b = x.T
        made = p.first * a
        fed = u[:, 0] * (u[:, 1] - a) - made
        return np.stack([fed, made - (u[:, 0] + p.second) * b], axis=1)


def reacting(seed, rate, n=240):
    """The same, in which A and B use each other up; both rates are a percent off."""
    rng = np.random.default_rng(seed)
    space = np.repeat(rng.uniform(0.0003, 0.003, n // 30), 30)
    feed = np.repeat(rng.uniform(1.0, 5.0, n // 20), 20)

    def rates(_, x, inputs):
        a, b = x
        meet, made = rate * a * b, 0.00111 * a
        return [inputs[0] * (inputs[1] - a) - made - meet,
                made - (inputs[0] + 0.000695) * b - meet]  # fmt: skip

    inputs = [tuple(one) for one in np.stack([space, feed], axis=1)]
    seen = path(rates, [1.0, 0.3], inputs, 90.0)[:-1]
    seen = seen + rng.normal(0.0, (0.008, 0.004), seen.shape)
    return Trajectory(f"run {seed}", 90.0 * np.arange(n), seen, np.array(inputs[:-1]))


@pytest.mark.parametrize("seed", [0, *(pytest.param(n, marks=pytest.mark.long) for n in (1, 2))])
def test_two_that_use_each_other_up_are_told_as_that(seed):
    found = find_gap(Reactor(), [reacting(10 * seed + run, 4e-4) for run in range(3)])
    sure = {v.label: v for v in found.verdicts if v.kind == "confirmed"}
    assert "reaction@a and b" in sure and set(sure) <= {"reaction@a and b", "first", "second"}
    numbers = sure["reaction@a and b"].parameters
    for number in numbers.values():
        assert number.low <= 4e-4 <= number.high
        assert number.value == pytest.approx(4e-4, rel=0.1)


class Chain(FirstOrderSystem):
    """X turns to Y and Y to Z, which takes up N, as if there were always enough of it."""

    dt = 1.0
    state_channels = tuple(
        Channel(name, "mmol/L", "other", scale=scale)
        for name, scale in (("X", 2.0), ("Y", 1.0), ("Z", 1.0), ("N", 2.0))
    )
    action_channels = (
        Channel("dilution", "1/min", "input", scale=0.05, low=0.0, high=0.3),
        Channel("feed", "mmol/L", "input", scale=3.0, low=0.0, high=20.0),
        Channel("cofactor", "mmol/L", "input", scale=3.0, low=0.0, high=20.0),
    )

    def __init__(self):
        self.parameters = {
            "first": Parameter(0.0588, "1/min", "of X", low=0.0),
            "second": Parameter(0.055, "1/min", "of Y", low=0.0),
        }
        super().__init__()

    def derivative(self, x, u, p):
        return chain(x.T, u.T, p.first, p.second)


def chain(x, u, first, second):
    rates = [first * x[0], second * x[1]]
    return np.stack([u[0] * (u[1] - x[0]) - rates[0], rates[0] - rates[1] - u[0] * x[1],
                     rates[1] - u[0] * x[2], u[0] * (u[2] - x[3]) - rates[1]], axis=-1)  # fmt: skip


def short_of_cofactor(seed, n=200):
    """The second step goes with N, too, as by the law of mass action."""
    rng = np.random.default_rng(seed)
    inputs = np.stack(
        [
            np.repeat(rng.uniform(*reach, n // 20), 20)
            for reach in ((0.01, 0.08), (1.0, 6.0), (1.0, 6.0))
        ],
        axis=1,
    )

    def rates(_, x, u):
        return chain(x, u, 0.06, 0.05 * x[3])

    seen = path(rates, [2.0, 0.5, 0.5, 2.0], [tuple(one) for one in inputs], 1.0)[:-1]
    seen = seen + 0.006 * rng.standard_normal(seen.shape)
    return Trajectory(f"run {seed}", np.arange(float(n)), seen, inputs[:-1])


@pytest.mark.long
@pytest.mark.parametrize("seed", range(3))
def test_a_rate_that_goes_with_another_state_is_no_push_at_each_state(seed):
    found = find_gap(Chain(), [short_of_cofactor(10 * seed + run) for run in range(2)])
    (curve,) = [one for one in found.effects if one.name == "parameter_curve"]
    assert str(curve) == "parameter_curve@second over N"
    seen = np.linspace(*curve.reach, 5)
    np.testing.assert_allclose(0.055 + curve.at(seen), 0.05 * seen, atol=0.01)
