"""Parameters that are a little off are moved within their tolerance where that helps."""

from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest
from held import path

from residual.gap import find_gap
from residual.gap.answer.calibrated import moved
from residual.trajectories import Trajectory
from sims.effects import CoulombFriction
from sims.equations import FirstOrderSystem
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Channel, Parameter
from studies.hidden.data import Truth, make_logs

#: Every one within 3 % of the nominal value.
OFF = {"mass": 0.02, "length": -0.015, "inertia": -0.025}


def answer(truth, **options):
    return find_gap(PendulumEquation(), make_logs(truth, 3, "strong", "A", 4), **options)


def test_parameters_within_their_tolerance_may_be_all_there_is():
    found = answer(Truth(**OFF), effects=[])
    (verdict,) = found.verdicts
    assert verdict.kind == "calibrated"
    parameters = PendulumEquation().parameters
    # What hardly moves is not told, be it small or right.
    assert {*OFF, "gravity"} <= set(verdict.parameters) <= set(parameters)
    for name, change in verdict.parameters.items():
        size = 0.03 * parameters[name].value
        assert -size <= change.low <= change.value <= change.high <= size
        assert abs(change.value) > 0.04 * size
    # They are in the corrected simulator, and the table is its.
    assert found.gap.after.value < 0.7 * found.gap.before.value
    assert {e.name for e in found.effects} <= set(parameters)
    assert len(found.effects) == len(parameters)
    assert found.gap.share.value > 0.5


def test_parameters_that_are_exact_are_not_moved():
    found = answer(Truth(**OFF), effects=[], parameter_tolerance=0.0)
    assert [v.kind for v in found.verdicts] == ["unexplained"]
    assert not found.effects


@pytest.mark.long
def test_what_pulls_all_parameters_to_their_ends_is_no_calibration():
    found = answer(Truth(mass=0.3), effects=[])
    assert [v.kind for v in found.verdicts] == ["unexplained"]
    assert found.gap.after.value == found.gap.before.value


@pytest.mark.long
def test_an_effect_is_named_beside_parameters_that_are_off():
    found = answer(Truth(**OFF, coulomb_friction=5e-4), effects=[CoulombFriction("pivot")])
    first = found.verdicts[0]
    assert first.effect == "coulomb_friction"
    assert np.isclose(first.parameters["level"].value, 5e-4, rtol=0.1)
    assert first.parameters["level"].low <= 5e-4 <= first.parameters["level"].high
    assert [v.kind for v in found.verdicts[:2]] == [first.kind, "calibrated"]
    assert found.gap.windows_after < 1.2


@pytest.mark.parametrize(("length", "told"), [(-0.01, {"mass", "length"}), (1e-4, {"mass"})])
def test_what_stays_where_it_was_is_not_told(length, told):
    """Free parameters that another effect made needless end near their own values."""
    knob = SimpleNamespace(low=-0.03, high=0.03, unit="1")
    fit = SimpleNamespace(
        theta=np.array([5e-4, 0.02, length]), model=SimpleNamespace(knobs=(None, knob, knob))
    )
    search = SimpleNamespace(
        tried={(0,): fit},
        numbers=lambda key: len(key),
        beside=[SimpleNamespace(effect=name) for name in ("mass", "length")],
    )
    assert set(moved(search, (0,))) == told


class Grid(FirstOrderSystem):
    """Frequency and governor of a small diesel grid."""

    dt = 0.1
    state_channels = (
        Channel("freq", "Hz", "other", scale=0.5),
        Channel("power", "kW", "other", scale=30.0),
    )
    action_channels = (Channel("load", "kW", "input", scale=30.0, low=-200.0, high=200.0),)
    parameters: ClassVar = {
        "M": Parameter(28.0, "kW s/Hz", "rotating mass", low=1.0),
        "D": Parameter(5.5, "kW/Hz", "load's own", low=0.0),
        "droop": Parameter(40.0, "kW/Hz", "governor", low=0.0),
        "T": Parameter(0.9, "s", "fuel rack", low=0.05),
    }

    def derivative(self, x, u, p):
        freq, power = x[:, 0], x[:, 1]
        return np.stack(
            [(power - u[:, 0] - p.D * freq) / p.M, (-p.droop * freq - power) / p.T], axis=1
        )


def steps(seed, mass, own, droop, rack, rows=900):
    rng = np.random.default_rng(seed)
    load = np.repeat(rng.uniform(-40, 40, rows // 30), 30)[: rows - 1]

    def rates(_, x, u):
        return [(x[1] - u - own * x[0]) / mass, (-droop * x[0] - x[1]) / rack]

    states = path(rates, [0.0, 0.0], load, 0.1)
    noise = rng.standard_normal(states.shape) * [0.0023, 0.23]
    for row in range(1, rows):
        noise[row] += 0.7 * noise[row - 1]
    seen = states + noise
    return Trajectory(f"run {seed}", 0.1 * np.arange(rows), seen, load[:, None])


@pytest.mark.long
def test_four_that_are_a_percent_or_two_off_are_calibrated_not_one_of_them_named():
    truth = (28.0 * 0.985, 5.5 * 1.02, 40.0 * 1.015, 0.9 * 1.02)
    found = find_gap(Grid(), [steps(seed, *truth) for seed in (1, 2, 3)])
    assert not [v.label for v in found.verdicts if v.kind in ("confirmed", "ambiguous")]
    assert "calibrated" in [v.kind for v in found.verdicts]
    moved = {effect.parameter: effect.change for effect in found.corrected.effects}
    values = [Grid.parameters[name].value + moved[name] for name in ("M", "D", "droop", "T")]
    assert np.allclose(values, truth, rtol=0.01)
