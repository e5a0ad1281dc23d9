"""Effects that stand for each other want other numbers beside them, and those are found."""

import numpy as np
import pytest
from slides import Slide, recorded

from residual.gap import find_gap
from residual.gap.model.candidates import candidates
from residual.gap.model.model import Model
from residual.gap.preparation.prepare import prepare
from residual.gap.search.continuation import handed_over
from residual.gap.search.sets import Search
from sims.effects.library import library


def driven(acceleration, rows=600, noise=2e-4, seed=0, dt=0.02):
    """Positions under a PWM of steps, by small steps of ``acceleration(v, u)``."""
    rng = np.random.default_rng(seed)
    pwm = np.repeat(rng.uniform(-300, 300, rows // 10 + 1), 10)[:rows]
    place, speed, places = 0.0, 0.0, []
    for u in pwm:
        places.append(place)
        for _ in range(100):
            speed += acceleration(speed, u) * dt / 100
            place += speed * dt / 100
    return recorded(f"run {seed}", np.array(places), pwm, dt, noise, rng)


def searched(log, *labels):
    """A search of some effects in one log, and their numbers in it."""
    simulator = Slide()
    offered = [effect for effect in library(simulator) if str(effect) in labels]
    fitter = prepare(simulator, [log], 0.6).fitter
    pool = candidates(simulator, offered, fitter.samples)
    return Search(simulator, pool, fitter), [one.label for one in pool]


def test_a_mass_takes_over_from_a_gain_and_the_load_goes_along():
    # Force and load four times as large, damping as it is, or all by a quarter of the mass.
    log = driven(lambda v, u: (4 * 0.5 * u - 4 * 60.0 * v - 40.0) / 4.0)
    search, names = searched(log, "actuator_gain@pwm", "constant_load@slide", "damping", "mass")
    number = {name: i for i, name in enumerate(names)}
    key = tuple(sorted(number[n] for n in names if n != "mass"))
    search.add({key: np.zeros(3)})
    found = dict(zip([names[i] for i in key], search.own(key), strict=True))
    assert found["actuator_gain@pwm"] == pytest.approx(3.0, rel=0.05)
    heir = search.candidates[number["mass"]]
    theta = handed_over(search, key, number["actuator_gain@pwm"], heir)
    stayed = [names[i] for i in key if i != number["actuator_gain@pwm"]]
    got = dict(zip([*stayed, "mass"], theta, strict=True))
    assert got["mass"] == pytest.approx(-3.0, rel=0.05)
    assert got["constant_load@slide"] == pytest.approx(-10.0, rel=0.1)
    assert got["damping"] == pytest.approx(0.0, abs=3.0)
    model = Model(search.simulator, [*(search.candidates[number[n]] for n in stayed), heir])
    again = search.fitter.fit(model, theta)
    assert again.merit < 1.05 * search.tried[key].merit


@pytest.mark.long
def test_too_much_damping_is_not_called_a_stronger_motor_and_a_larger_mass():
    def acceleration(v, u):
        return (0.5 * u - 20.0 * v - 10.0 * np.tanh(v / 1e-3)) / 4.0

    names = ("actuator_gain", "mass", "damping", "viscous_friction", "coulomb_friction")
    offered = [effect for effect in library(Slide()) if effect.name in names]
    found = find_gap(Slide(), [driven(acceleration)], effects=offered, hold="zero")
    named = {v.effect: v for v in found.verdicts if v.kind in ("confirmed", "ambiguous")}
    assert set(named) == {"damping", "coulomb_friction"}
    assert named["damping"].parameters["change"].value == pytest.approx(-40.0, rel=0.05)
    assert named["coulomb_friction"].parameters["level"].value == pytest.approx(10.0, rel=0.05)


def test_a_drive_of_a_third_is_not_called_a_sensor_that_reads_a_third():
    def acceleration(v, u):
        return (0.5 * u / 3 - 60.0 * v - 40.0 * v * abs(v)) / 4.0

    names = ("actuator_gain", "sensor_scale", "quadratic_drag")
    offered = [effect for effect in library(Slide()) if effect.name in names]
    found = find_gap(Slide(), [driven(acceleration)], effects=offered, hold="zero")
    (gain,) = [v for v in found.verdicts if v.effect in ("actuator_gain", "sensor_scale")]
    assert gain.effect == "actuator_gain"
    assert gain.parameters["gain"].value == pytest.approx(-2 / 3, abs=0.02)
