"""Several effects that imitate one which no library holds: others imitate it as well."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.gap.model.candidates import candidates
from residual.gap.preparation.prepare import prepare
from residual.gap.search.redundant import doubles
from residual.gap.search.sets import Search
from residual.gap.search.without import add_answers_without, akin, answers_without
from residual.trajectories import Trajectory
from sims.effects import ActuatorGain, ForceCurve, SensorOffset, library
from sims.equations import FirstOrderSystem
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel, Parameter

AREA, PUMP, UPPER, LOWER, LEAK = 0.0154, 1e-5, 5e-5, 5.2e-5, 1.3e-5


class Tanks(FirstOrderSystem):
    """Two tanks, one above the other, whose outlets are a few percent off."""

    dt = 2.0
    state_channels = tuple(Channel(n, "m", "other", scale=0.2) for n in ("upper", "lower"))
    action_channels = (Channel("pump", "V", "input", low=0.0, high=12.0, scale=5.0),)
    parameters: ClassVar = {
        "area": Parameter(AREA, "m^2", "cross section", low=1e-4),
        "upper_outlet": Parameter(5.1e-5, "m^2", "of the upper", low=1e-7),
        "lower_outlet": Parameter(5.1e-5, "m^2", "of the lower", low=1e-7),
        "gain": Parameter(PUMP, "m^3/s/V", "pump", low=1e-8),
    }

    def derivative(self, x, u, p):
        speed = np.sqrt(2 * 9.81 * np.maximum(x, 0.0))
        between, out = p.upper_outlet * speed[:, 0], p.lower_outlet * speed[:, 1]
        return np.stack([(p.gain * u[:, 0] - between) / p.area, (between - out) / p.area], axis=1)


def levels(leak: float) -> Trajectory:
    """An hour, in which the upper tank also leaks past the lower one."""
    rng = np.random.default_rng(9)
    volts = np.repeat(rng.uniform(3.0, 9.0, 20).round(1), 75)

    def rates(_, h, u):
        fast = np.sqrt(2 * 9.81 * np.maximum(h, 0.0))
        inflow, between = PUMP * u - (UPPER + leak) * fast[0], UPPER * fast[0]
        return [inflow / AREA, (between - LOWER * fast[1]) / AREA]

    seen = path(rates, [0.15, 0.08], volts, 2.0) + rng.normal(0, 8e-4, (len(volts) + 1, 2))
    return Trajectory("tanks", 2.0 * np.arange(len(seen)), seen, volts[:, None])


def test_a_leak_that_others_imitate_gives_none_of_them_certainty():
    found = find_gap(Tanks(), [levels(LEAK)])
    named = [verdict for verdict in found.verdicts if verdict.effect]
    assert named and not [v for v in named if v.kind == "confirmed"]
    told = [v for v in named if "instead" in v.doubts]
    assert told and all(len(v.instead) > 1 and v.label not in v.instead for v in told)
    assert all(", ".join(v.instead) in v.says for v in told)


def test_a_weak_pump_is_certain_beside_outlets_that_are_off():
    weak = Tanks(effects=[ActuatorGain("pump", -0.2)])
    volts = np.repeat(np.random.default_rng(1).uniform(3.0, 9.0, (20, 1)), 75, axis=0)
    states = weak.rollout([0.15, 0.08], volts)
    states += np.random.default_rng(2).normal(0, 8e-4, states.shape)
    log = Trajectory("tanks", 2.0 * np.arange(len(states)), states, volts)
    (sure,) = [v for v in find_gap(Tanks(), [log]).verdicts if v.kind == "confirmed"]
    assert sure.label == "actuator_gain@pump" and not sure.instead


@pytest.fixture(scope="module")
def search() -> Search:
    """A pendulum that the whole library may explain."""
    simulator = PendulumEquation()
    rng = np.random.default_rng(0)
    volts = np.repeat(rng.uniform(-3.0, 3.0, (4, 20, 1)), 10, axis=1)
    states = simulator.with_effects([ActuatorGain("voltage", 0.3)]).rollout(
        rng.uniform(-1.0, 1.0, (4, 2)), volts
    )
    states += np.array([1e-3, 0.02]) * rng.standard_normal(states.shape)
    times = simulator.dt * np.arange(states.shape[1])
    logs = [Trajectory(f"run {i}", times, states[i], volts[i]) for i in range(4)]
    ready = prepare(simulator, logs, 0.4)
    samples = ready.fitter.samples
    curve = ForceCurve("pivot").suited_to(-1.0, 1.0)
    pool = candidates(simulator, [*library(simulator), curve], samples)
    return Search(simulator, pool, ready.fitter)


def number(search: Search, label: str) -> int:
    return [candidate.label for candidate in search.candidates].index(label)


def test_an_answer_without_an_effect_has_none_of_its_family_and_is_no_larger(search):
    gone, other = number(search, "coulomb_friction@pivot"), number(search, "mass")
    key = tuple(sorted((gone, other)))
    search.add({key: np.array([0.01, 0.01])})
    add_answers_without(search, key, gone, lambda _: False, np.inf)
    found = answers_without(search, key, gone)
    names = {search.candidates[n].label for one in found for n in one}
    assert found and names.isdisjoint({"viscous_friction@pivot", "stribeck_friction@pivot"})
    assert all(len(one) <= 2 and search.numbers(one) <= 2 for one in found)
    # What was barred is free again.
    assert not search.barred and key in search.usable() and search.fits_in(key)


def test_kin_are_the_family_and_all_spellings(search):
    waves = akin(search, number(search, "cogging@pivot"))
    assert {search.candidates[n].label for n in waves} == {"cogging@pivot"} and len(waves) > 1
    kin = akin(search, number(search, "coulomb_friction@pivot"))
    rubbing = {search.candidates[n].label for n in kin}
    assert "viscous_friction@pivot" in rubbing and "mass" not in rubbing


def test_no_sensor_moves_the_points_of_a_curve(search):
    curve = number(search, "force_curve@pivot")
    zero = [n for n, one in enumerate(search.candidates) if one.effect == SensorOffset("angle")]
    assert zero and doubles(search, (min(zero[0], curve), max(zero[0], curve)))
