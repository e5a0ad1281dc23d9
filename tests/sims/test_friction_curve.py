"""Friction given by its sizes at three speeds."""

import numpy as np
import pytest
from hosts import HOSTS, host, rows
from hypothesis import given
from hypothesis import strategies as st

from sims.effects import FrictionCurve, QuadraticDrag

sizes = st.floats(0.0, 1e3)


@given(slow=sizes, medium=sizes, fast=sizes, full=st.floats(1e-3, 1e3))
def test_it_has_the_given_sizes_and_opposes_the_motion(slow, medium, fast, full):
    curve = FrictionCurve("pivot", slow, medium, fast, full)
    speeds = np.array([0.0, full / 3, 2 * full / 3, full, 5 * full])
    wanted = np.array([0.0, slow, medium, fast, fast])
    slack = 1e-9 * (1 + slow + medium + fast)
    assert curve.force(0.0, speeds) == pytest.approx(-wanted, abs=slack)
    assert curve.force(0.0, -speeds) == pytest.approx(wanted, abs=slack)


@pytest.mark.parametrize("power", [1, 2, 3])
def test_powers_of_the_speed_are_cases_of_it(power):
    full = 4.0
    slow, medium, fast = (0.7 * (share * full) ** power for share in (1 / 3, 2 / 3, 1.0))
    curve = FrictionCurve("pivot", slow, medium, fast, full)
    speeds = np.linspace(0.0, full, 41)
    assert curve.force(0.0, speeds) == pytest.approx(-0.7 * speeds**power, abs=1e-12)


def test_points_lie_at_thirds_of_the_full_speed():
    curve = FrictionCurve("pivot", 1.0, 2.0, 3.0, full=6.0)
    assert [curve.point_of(f) for f in ("slow", "medium", "fast")] == [
        (pytest.approx(2.0), "rate"),
        (pytest.approx(4.0), "rate"),
        (6.0, "rate"),
    ]
    assert curve.point_of("full") is None


@host
def test_hosts_apply_it_like_the_law_that_it_is_a_case_of(host):
    states, volts = rows(30)
    plain, full, drag = HOSTS[host], 60.0, 2e-5  # faster than any row becomes
    curve = FrictionCurve("pivot", *(drag * (k * full / 3) ** 2 for k in (1, 2, 3)), full)
    of_curve = plain.with_effects([curve]).step(states, volts)
    of_law = plain.with_effects([QuadraticDrag("pivot", drag)]).step(states, volts)
    assert of_curve == pytest.approx(of_law, abs=1e-9)
    assert np.abs(of_law - plain.step(states, volts)).max() > 1e-3
