"""Parameters that are a little off are moved within their tolerance where that helps."""

from types import SimpleNamespace

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.answer.calibrated import moved
from sims.effects import CoulombFriction
from sims.pendulum_equation import PendulumEquation
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
