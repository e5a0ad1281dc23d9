"""An effect that must be there has a size, however loosely a ratio of numbers ties it."""

from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from slides import braked, recorded

from residual.gap import find_gap
from residual.gap.confirmation.claim import Claim
from residual.gap.confirmation.size import by_factors, half_open, may_vanish
from residual.gap.model.candidates import Knob
from residual.gap.result import Number
from sims.effects.curves import InputCurve, StateCurve
from sims.equations import EquationOfMotion
from sims.simulator import Channel, Parameter

sizes = st.floats(1e-3, 1e3)


class Cart(EquationOfMotion):
    """A motor pushes a cart; nothing brakes it."""

    dt = 0.01
    state_channels = (
        Channel("cart", "m", "position", scale=0.1),
        Channel("cart rate", "m/s", "rate", rate_of="cart", scale=0.5),
    )
    action_channels = (Channel("pwm", "1", "input", scale=100.0, low=-255.0, high=255.0),)
    parameters: ClassVar[dict[str, Parameter]] = {
        "mass": Parameter(0.5, "kg", "mass of the cart", low=0.01),
        "force_per_count": Parameter(0.02, "N", "force per count"),
    }

    def acceleration(self, q, v, u, force, p):
        return ((p.force_per_count * u[:, 0] + force[:, 0]) / p.mass)[:, None]


def pushed(friction, gain, rows=360, noise=5e-4, wave=0.03):
    """Positions of the true cart, whose motor also gets weaker and stronger in turn."""
    rng = np.random.default_rng(0)
    pwm = np.repeat(rng.uniform(-200, 200, rows // 12 + 1), 12)[:rows]
    force = 0.02 * gain * pwm * (1 + wave * np.sin(2.1 * 0.01 * np.arange(rows)))
    return recorded("run", braked(force, friction, 0.5, 0.01), pwm, 0.01, noise, rng)


@pytest.mark.long
def test_friction_without_which_nothing_fits_is_certain_though_the_mass_may_be_meant():
    # Eight times the force with friction 20, or an eighth of the mass with friction 2.5: the same.
    asked = ("viscous_friction", "coulomb_friction", "actuator_gain", "mass", "sensor_scale")
    found = find_gap(Cart(), [pushed(20.0, 8.0)], effects=asked, hold="zero")
    by_name = {verdict.effect: verdict for verdict in found.verdicts}
    friction, gain = by_name["viscous_friction"], by_name["actuator_gain"]
    assert friction.kind == "confirmed"
    number = friction.parameters["coefficient"]
    assert 0 < number.low < 2.5 < 20.0 < number.high
    assert gain.kind == "ambiguous"  # nor can data say which
    assert "mass" in gain.alternatives
    assert gain.doubts == ("rivals",)


@given(value=sizes, below=sizes, above=sizes, sign=st.sampled_from([-1, 1]))
def test_an_interval_by_factors_keeps_the_sign_and_turns_round_with_it(value, below, above, sign):
    free = Knob("load", "N", -np.inf, np.inf, 1.0, True)
    low, high = by_factors(value, value - below, value + above, free)
    assert 0 <= low <= value <= high
    turned = by_factors(-value, -value - above, -value + below, free)
    assert turned == pytest.approx((-high, -low))


def test_small_intervals_by_factors_are_those_of_the_numbers():
    free = Knob("load", "N", -np.inf, np.inf, 1.0, True)
    assert by_factors(10.0, 9.9, 10.2, free) == pytest.approx((9.9, 10.2), abs=3e-3)


def test_a_side_that_a_bound_cuts_off_goes_as_far_as_the_other():
    knob = Knob("coefficient", "N s/m", 0.0, np.inf, 1.0, True)
    low, high = by_factors(34.0, 0.0, 75.0, knob)
    assert low * high == pytest.approx(34.0**2)
    assert 0 < low < 34.0 - 20.0


def told(effect, *spans, asked=may_vanish, above=""):
    """Whether an effect with these intervals may be nothing, the last number above another."""
    ends = [*[""] * (len(spans) - 1), above]
    knobs = [Knob(f"n{i}", "K/s", -np.inf, np.inf, 1.0, True, above=e) for i, e in enumerate(ends)]
    numbers = {f"n{i}": Number(0.5 * (a + b), a, b, "K/s") for i, (a, b) in enumerate(spans)}
    search = SimpleNamespace(candidates=[SimpleNamespace(effect=effect, knobs=knobs)])
    claim = Claim(0, numbers, (), (), (), (), True, True, True, False, (0.5, 0.4, 0.6))
    return asked(search, claim)


def test_a_curve_along_a_state_needs_two_points_that_are_none_of_zero():
    nothing, something = (-1.0, 2.0), (1.0, 2.0)
    assert told(StateCurve("room"), nothing, something, nothing)
    assert not told(StateCurve("room"), something, something, nothing)
    assert not told(InputCurve("heat"), nothing, something, nothing)
    assert told(InputCurve("heat"), nothing, nothing, nothing)


@pytest.mark.parametrize(
    ("spans", "half"),
    [
        ([(0.0, 2.0), (0.6, 2.4)], True),  # forward 1.0, backward 1.5
        ([(0.1, 1.9), (0.6, 2.4)], False),
        ([(-0.3, 0.5), (0.6, 2.4)], False),  # forward 0.1: friction one way, perhaps
        ([(0.0, 2.0)], False),  # told by may_vanish
    ],
)
def test_of_two_strengths_none_that_is_large_may_be_zero(spans, half):
    assert told(InputCurve("heat"), *spans, asked=half_open) == half


def test_friction_that_may_be_none_in_motion_is_no_friction():
    sliding, breakaway = (0.0, 0.4), (1.0, 1.2)
    assert told(InputCurve("heat"), sliding, breakaway, asked=half_open, above="n0")
    assert not told(InputCurve("heat"), sliding, breakaway, asked=half_open)
    assert not told(InputCurve("heat"), (0.1, 0.4), breakaway, asked=half_open, above="n0")
