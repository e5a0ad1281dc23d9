"""Laws given by points: friction by speed, force by position, rate by state, input by command."""

import numpy as np
import pytest
from hosts import HOSTS, host, rows
from hypothesis import given
from hypothesis import strategies as st

from sims.effects import (
    CURVES,
    ForceCurve,
    FrictionCurve,
    InputCurve,
    LinearSpring,
    QuadraticDrag,
    StateCurve,
    SymmetricInputCurve,
    library,
)
from sims.equations import FirstOrderSystem
from sims.simulator import Channel

sizes = st.floats(0.0, 1e3)
kinds = pytest.mark.parametrize("kind", CURVES)


class Tank(FirstOrderSystem):
    dt = 1.0
    state_channels = (Channel("level", "m", "other"),)
    action_channels = (Channel("pump", "V", "input"),)

    def derivative(self, x, u, p):
        return 0.01 * u


def through(kind, law, low=-1.0, high=3.0):
    """A curve whose points lie on a law."""
    curve = kind("there").suited_to(low, high)
    return curve.with_values(**{f: law(curve.point_of(f)[0]) for f in curve.strengths()})


@given(slow=sizes, medium=sizes, fast=sizes, full=st.floats(1e-3, 1e3))
def test_friction_has_the_given_sizes_and_opposes_the_motion(slow, medium, fast, full):
    curve = FrictionCurve("pivot", slow, medium, fast, full)
    speeds = np.array([0.0, full / 3, 2 * full / 3, full, 5 * full])
    wanted = np.array([0.0, slow, medium, fast, fast])
    slack = 1e-9 * (1 + slow + medium + fast)
    assert curve.force(0.0, speeds) == pytest.approx(-wanted, abs=slack)
    assert curve.force(0.0, -speeds) == pytest.approx(wanted, abs=slack)


@kinds
@given(values=st.lists(st.floats(-1e3, 1e3), min_size=7, max_size=7))
def test_every_curve_runs_through_its_points_and_is_level_beyond(kind, values):
    curve = kind("there").suited_to(-1.0, 3.0)
    fields = curve.strengths()
    given_values = dict(zip(fields, values, strict=False))
    curve = curve.with_values(**given_values)
    for field in fields:
        x, along = curve.point_of(field)
        assert along == kind.along
        assert float(curve.at(x)) == pytest.approx(given_values[field], abs=1e-8)
    assert float(curve.at(curve.reach[1] + 7.0)) == pytest.approx(float(curve.at(curve.reach[1])))


@kinds
@pytest.mark.parametrize("power", [1, 2, 3])
def test_powers_are_cases_of_every_curve(kind, power):
    curve = through(kind, lambda x: 0.7 * x**power)
    x = np.linspace(*curve.reach, 41)
    assert curve.at(x) == pytest.approx(0.7 * x**power, abs=1e-12)


@kinds
def test_a_smooth_law_is_followed_between_the_points(kind):
    def law(x):
        return 0.8 * np.tanh(x)

    curve = through(kind, law, 0.0, 2.0)
    x = np.linspace(*curve.reach, 41)
    assert np.abs(curve.at(x) - law(x)).max() < 0.02


@kinds
def test_rows_may_have_numbers_of_their_own(kind):
    curve = kind("there").suited_to(0.0, 3.0)
    numbers = {f: np.arange(2.0) + i for i, f in enumerate(curve.strengths())}
    both, x = curve.with_values(**numbers), np.array([1.3, 1.3])
    for row in (0, 1):
        assert both.at(x)[row] == pytest.approx(float(both.take(row).at(1.3)))


def test_a_symmetric_input_curve_adds_in_both_directions():
    curve = through(SymmetricInputCurve, lambda u: -0.1 * u * u)
    u = np.array([-2.0, -0.5, 0.0, 0.5, 2.0])
    assert curve.shape(u) == pytest.approx(u - 0.1 * u * np.abs(u))


def test_an_input_curve_adds_to_the_command():
    curve = through(InputCurve, lambda u: 0.5 - 0.1 * u * u)
    u = np.array([-1.0, -0.5, 0.0, 0.5, 2.0])
    assert curve.shape(u) == pytest.approx(u + 0.5 - 0.1 * u * u)


@host
def test_hosts_apply_friction_like_the_law_that_it_is_a_case_of(host):
    states, volts = rows(30)
    plain, full, drag = HOSTS[host], 60.0, 2e-5  # faster than any row becomes
    curve = FrictionCurve("pivot", *(drag * (k * full / 3) ** 2 for k in (1, 2, 3)), full)
    of_curve = plain.with_effects([curve]).step(states, volts)
    of_law = plain.with_effects([QuadraticDrag("pivot", drag)]).step(states, volts)
    assert of_curve == pytest.approx(of_law, abs=1e-9)
    assert np.abs(of_law - plain.step(states, volts)).max() > 1e-3


@host
def test_hosts_apply_a_force_like_the_spring_that_it_is(host):
    states, volts = rows(30)
    plain, stiffness, rest = HOSTS[host], 0.01, 0.4
    points = np.linspace(-9.0, 9.0, 6)
    curve = ForceCurve("pivot", *(-stiffness * (points - rest)), low=-9.0, high=9.0)
    of_curve = plain.with_effects([curve]).step(states, volts)
    of_law = plain.with_effects([LinearSpring("pivot", stiffness, rest)]).step(states, volts)
    assert of_curve == pytest.approx(of_law, abs=1e-9)
    assert np.abs(of_law - plain.step(states, volts)).max() > 1e-3


@host
def test_hosts_apply_an_input_curve_as_the_command_that_it_makes(host):
    states, volts = rows(30)
    volts = 0.6 * volts  # what is made of it stays within bounds
    curve = InputCurve("voltage", 0.1, 0.3, 0.2, -0.4, 0.0, 0.2, 0.5, low=-3.0, high=3.0)
    changed = HOSTS[host].with_effects([curve]).step(states, volts)
    assert changed == pytest.approx(HOSTS[host].step(states, curve.shape(volts)), abs=1e-12)


def test_a_tank_that_runs_out_by_a_curve_falls_as_the_closed_form_says():
    # x' = -0.1 x + 0.02 x^2 is a logistic law.
    curve = through(StateCurve, lambda x: -0.1 * x + 0.02 * x * x, 0.0, 4.0)
    tank = Tank(
        effects=[StateCurve("level", *(getattr(curve, f) for f in curve.strengths()), 0, 4)]
    )
    levels = tank.rollout(np.array([[3.0]]), np.zeros((1, 30, 1)))[0, :, 0]
    t = np.arange(31.0)
    assert levels == pytest.approx(5 / (1 + (5 / 3.0 - 1) * np.exp(0.1 * t)), rel=1e-6)


def test_none_is_in_the_library_and_each_stays_where_it_belongs():
    assert not {e.name for e in library(HOSTS["equation"])} & {kind.name for kind in CURVES}
    with pytest.raises(ValueError, match="there it is force_curve"):
        StateCurve("pivot").quantities(HOSTS["equation"])
    with pytest.raises(ValueError, match="needs a joint with a rate"):
        ForceCurve("level").quantities(Tank())


def test_only_points_stand_somewhere():
    for kind in CURVES:
        curve = kind("there").suited_to(0.0, 6.0)
        assert all(curve.point_of(f) for f in curve.strengths())
        assert not any(curve.point_of(f) for f in set(curve.numbers()) - set(curve.strengths()))
    slow = FrictionCurve("pivot", full=6.0).point_of("slow")
    assert slow == (pytest.approx(2.0), "rate")
    assert StateCurve("level", low=1.0, high=6.0).point_of("second") == (2.0, "position")
