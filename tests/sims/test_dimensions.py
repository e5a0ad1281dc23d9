"""Units of numbers that are products of others."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sims.effects.dimensions import product


@pytest.mark.parametrize(
    ("dimension", "units", "unit"),
    [
        ({"force": 1, "rate": -1}, {"force": "N m", "rate": "rad/s"}, "N m s/rad"),
        ({"force": 1, "rate": -2}, {"force": "N", "rate": "m/s"}, "N s^2/m^2"),
        ({"force": 1}, {"force": "m/s^3/s"}, "m/s^4"),
        ({"force": 1, "rate": -2}, {"force": "px/s/s", "rate": "px/s"}, "1/px"),
        ({"force": 1, "position": -1}, {"force": "degC/s", "position": "degC"}, "1/s"),
        ({"gain": 1}, {"gain": "J/(kg K)"}, "J/(kg K)"),
        ({"gain": 1, "scale": -1}, {"gain": "1/s", "scale": "1"}, "1/s"),
    ],
)
def test_powers_of_a_unit_are_put_together(dimension, units, unit):
    assert product(dimension, {kind: (one, 1.0) for kind, one in units.items()}) == unit


@given(unit=st.sampled_from(["N m", "m/s^2", "degC", "kg m^2/s", "1", "A"]))
def test_a_unit_over_itself_has_none(unit):
    assert product({"one": 1, "other": -1}, {"one": (unit, 1.0), "other": (unit, 1.0)}) == "1"
