"""A parameter that follows one channel is asked for over the others, before it is certain."""

from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.gap.answer.varying import over_other_channels
from residual.gap.model.candidates import candidates
from residual.gap.preparation.prepare import prepare
from residual.gap.search.redundant import doubles
from residual.gap.search.sets import Search
from residual.trajectories import Trajectory
from sims.effects import ParameterCurve, SensorOffset
from sims.equations import EquationOfMotion, FirstOrderSystem
from sims.simulator import Channel, Parameter

DT, MU, HALF, YIELD, ETHANOL = 0.1, 0.31, 0.9, 0.16, 2.6


class Ferment(FirstOrderSystem):
    """A fed batch of yeast: biomass grows and makes ethanol as it does."""

    dt = DT
    state_channels = (
        Channel("biomass", "g/L", "other", scale=5.0),
        Channel("sugar", "g/L", "other", scale=10.0),
        Channel("ethanol", "g/L", "other", scale=10.0),
    )
    action_channels = (
        Channel("feed", "g/L/h", "input", scale=5.0, low=0.0),
        Channel("bleed", "1/h", "input", scale=0.1, low=0.0),
    )
    parameters: ClassVar = {
        "mu": Parameter(MU, "1/h", "growth", low=0.01),
        "Ks": Parameter(HALF, "g/L", "half saturation", low=0.01),
    }

    def derivative(self, x, u, p):
        cells, sugar, ethanol = x[:, 0], np.maximum(x[:, 1], 0.0), x[:, 2]
        grown = p.mu * sugar / (p.Ks + sugar) * cells
        return np.stack(
            [
                grown - u[:, 1] * cells,
                u[:, 0] - grown / YIELD - u[:, 1] * sugar,
                ETHANOL * grown - u[:, 1] * ethanol,
            ],
            axis=1,
        )


def batch(seed, rows=450):
    """Growth that ethanol slows down, and stops at 38 g/L."""
    rng = np.random.default_rng(seed)
    feed = np.repeat(rng.uniform(1.0, 7.0, rows // 45), 45)
    bleed = np.repeat(rng.uniform(0.0, 0.12, rows // 50), 50)
    inputs = np.column_stack([feed, bleed])[: rows - 1]

    def rates(_, x, u):
        sugar = max(x[1], 0.0)
        grown = MU * (1 - x[2] / 38.0) * sugar / (HALF + sugar) * x[0]
        kept = [grown, -grown / YIELD, ETHANOL * grown] - u[1] * x
        return kept + np.array([0.0, u[0], 0.0])

    held = [tuple(row) for row in inputs]
    states = path(rates, [2.0, 6.0, 3.0], held, DT, atol=1e-9)
    seen = states + rng.standard_normal(states.shape) * [0.04, 0.13, 0.1]
    return Trajectory(f"run {seed}", DT * np.arange(rows), seen, inputs)


@pytest.mark.long
def test_growth_that_ethanol_slows_down_does_not_follow_the_biomass():
    result = find_gap(Ferment(), [batch(seed) for seed in (1, 2)])
    (curve,) = [effect for effect in result.effects if isinstance(effect, ParameterCurve)]
    assert str(curve) == "parameter_curve@mu over ethanol"
    (verdict,) = [v for v in result.verdicts if v.effect == curve.name]
    for field, number in verdict.parameters.items():
        at, _ = curve.point_of(field)
        assert number.value == pytest.approx(-MU * at / 38.0, abs=0.01)


def test_what_was_asked_is_not_asked_again():
    simulator = Ferment()
    fitter = prepare(simulator, [batch(1)], 8.0).fitter
    named = ParameterCurve("mu", "biomass").suited_to(2.0, 8.0)
    asked = [named, ParameterCurve("mu", "sugar").suited_to(0.0, 6.0)]
    pool = candidates(simulator, asked, fitter.samples)
    search = SimpleNamespace(candidates=pool, simulator=simulator, fitter=fitter)
    answer = SimpleNamespace(found=SimpleNamespace(search=search), key=(0,))
    others = {str(one) for one in over_other_channels(answer, [])}
    over = {name.partition(" over ")[2] for name in others}
    assert {"ethanol", "feed", "bleed"} <= over and not {"biomass", "sugar"} & over
    assert over_other_channels(SimpleNamespace(found=answer.found, key=()), []) == []


class Shuttle(EquationOfMotion):
    """A shuttle that rolls from record to record to where it was left."""

    dt = 0.05
    state_channels = (
        Channel("x", "m", "position", scale=5.0),
        Channel("v", "m/s", "rate", rate_of="x", scale=1.0),
    )
    action_channels = (Channel("force", "N", "input", scale=100.0, low=-300.0, high=300.0),)
    parameters: ClassVar = {
        "mass": Parameter(80.0, "kg", "empty shuttle", low=5.0),
        "damping": Parameter(45.0, "N s/m", "wheels", low=0.0, family="dissipation"),
    }

    def acceleration(self, q, v, u, force, p):
        return ((u[:, 0] + force[:, 0] - p.damping * v[:, 0]) / p.mass)[:, None]


def run_of_a_shuttle(seed, mass, begin, rows=600):
    rng = np.random.default_rng(seed)
    forces = np.repeat(rng.uniform(-150, 150, rows // 30), 30)[: rows - 1]
    states = path(lambda _, x, u: [x[1], (u - 45.0 * x[1]) / mass], [begin, 0.0], forces, 0.05)
    seen = states + rng.standard_normal(states.shape) * [0.004, 0.015]
    return Trajectory(f"run {seed}", 0.05 * np.arange(rows), seen, forces[:, None])


@pytest.mark.long
def test_a_load_in_one_record_does_not_follow_the_place():
    records = [run_of_a_shuttle(1, 80.0, 8.0), run_of_a_shuttle(2, 80.0, 4.0),
               run_of_a_shuttle(3, 129.0, -18.0)]  # fmt: skip
    result = find_gap(Shuttle(), records)
    assert not any(isinstance(effect, ParameterCurve) for effect in result.effects)
    assert "mass" in {one.label for one in result.unlike} and result.lone is None


def test_a_sensor_of_what_a_parameter_follows_only_moves_its_points():
    simulator = Ferment()
    fitter = prepare(simulator, [batch(1)], 8.0).fitter
    curve = ParameterCurve("mu", "ethanol").suited_to(3.0, 33.0)
    offered = [curve, SensorOffset("ethanol"), SensorOffset("biomass")]
    search = Search(simulator, candidates(simulator, offered, fitter.samples), fitter)
    number = {one.label: n for n, one in enumerate(search.candidates)}
    beside = [number[f"sensor_offset@{name}"] for name in ("ethanol", "biomass")]
    assert [doubles(search, (number[str(curve)], sensor)) for sensor in beside] == [True, False]
