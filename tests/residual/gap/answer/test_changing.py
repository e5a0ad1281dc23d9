"""A parameter that changes along the records about its nominal value is told, and only then."""

from types import SimpleNamespace

import numpy as np
import pytest
from trolley import Trolley, record

from residual.gap import find_gap
from residual.gap.answer.changing import _believable
from residual.gap.beside import Changing
from sims.effects import ActuatorGain, ParameterChange
from studies.gap.files import gap_record
from studies.gap.summary import summary

#: What may be missing.
ASKED = ("mass", "stiffness", "damping", "coulomb_friction")


def ask(*records):
    return find_gap(Trolley(), list(records), effects=ASKED, minutes=1)


def test_a_spring_that_weakens_about_its_nominal_is_told_with_both_ends():
    result = ask(*(record(seed, lambda part: 23.0 - 6.0 * part) for seed in (0, 1)))
    found = result.changing
    assert found is not None and found.label == "stiffness"
    assert (found.begin, found.end) == (pytest.approx(23, abs=0.7), pytest.approx(17, abs=0.7))
    assert found.nominal == 20.0 and found.taken > 0.5
    told = " ".join(summary(result).split())
    assert "The rest looks like stiffness that changes along the records, from about 2" in told
    assert "it looks as if stiffness went from about 2" in told and "(20 N/m in the sim" in told
    assert gap_record(result, {})["changing"]["label"] == "stiffness"


@pytest.mark.parametrize("friction", [0.0, 0.8])
def test_what_stays_the_same_changes_nothing(friction):
    """Also where something is missing, and named."""
    assert ask(*(record(seed, lambda _: 20.0, friction) for seed in (2, 3))).changing is None


def test_what_is_different_in_the_middle_of_a_record_is_no_change_along_it():
    """A stiffness that comes and goes twice in a record."""
    records = [record(seed, lambda part: 20 + 4 * np.sin(4 * np.pi * part)) for seed in (4, 5)]
    found = ask(*records).changing
    assert found is None or found.taken < 0.5


@pytest.mark.parametrize(("begin", "end", "told"), [
    (23.0, 17.0, True), (20.0, 0.0, True), (20.0, -4.0, False), (20.0, 300.0, False),
])  # fmt: skip
def test_a_value_that_no_spring_has_is_not_told(begin, end, told):
    search = SimpleNamespace(simulator=Trolley())
    course = SimpleNamespace(one=SimpleNamespace(effect=ParameterChange("stiffness")))
    ends = Changing("stiffness", begin, end, 20.0, "N/m", 0.8)
    assert _believable(search, course, ends) == told


def test_a_gain_may_turn_round_but_not_be_a_hundred_times_larger():
    course = SimpleNamespace(one=SimpleNamespace(effect=ActuatorGain("push")))
    assert _believable(None, course, Changing("actuator_gain@push", -0.5, 0.5, 0.0, "1", 0.8))
    assert not _believable(None, course, Changing("actuator_gain@push", 0.0, 99.0, 0.0, "1", 0.8))
    # Both ends at one bound change nothing.
    assert not _believable(None, course, Changing("actuator_gain@push", 0.5, 0.5, 0.0, "1", 0.8))
