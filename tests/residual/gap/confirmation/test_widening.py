"""Intervals allow for larger sets that fit much better."""

from types import SimpleNamespace

import numpy as np
import pytest
from toy import Toy

from residual.gap.confirmation import widening
from residual.gap.confirmation.claim import Claim
from residual.gap.result import Number
from sims.effects.curves import StateCurve


def told(monkeypatch, merit, error, most=10.0):
    """The interval of one effect, 2 (1.9 to 2.1), that would be 1 beside a second one, where it is
    bounded otherwise."""
    search = Toy({(): 1.0, (0,): 0.1, (0, 1): error}, merits={(0,): 100.0, (0, 1): merit})
    knob = SimpleNamespace(field="change", low=-10.0, high=most)
    for key, values in (((0,), [2.0]), ((0, 1), [1.0, 5.0])):
        fit = search.tried[key]
        fit.theta = np.array(values)
        fit.model.knobs, fit.model.owner = (knob,) * len(key), np.arange(len(key))
    monkeypatch.setattr(widening, "deviations", lambda fit, blocks: np.full(len(fit.theta), 0.05))
    number = Number(2.0, 1.9, 2.1, "kg")
    claim = Claim(0, {"change": number}, (), (), (), (), True, True, True, False, (0.9, 0.8, 0.95))
    found = widening._beside_rivals(search, (0,), claim, [claim]).numbers["change"]
    return found.low, found.high


def test_an_interval_holds_in_a_larger_set_that_leaves_half_of_the_loss(monkeypatch):
    low, high = told(monkeypatch, merit=40.0, error=0.12)
    assert low == pytest.approx(1.0 - 1.96 * 0.05) and high == pytest.approx(2.1)


@pytest.mark.parametrize(("merit", "error"), [(80.0, 0.12), (40.0, 0.2)])
def test_not_in_one_that_fits_hardly_better_or_forecasts_clearly_worse(monkeypatch, merit, error):
    assert told(monkeypatch, merit, error) == (1.9, 2.1)


def test_bounds_of_the_larger_set_take_nothing_off(monkeypatch):
    """Beside a gain a saturation may lie beyond all commands."""
    low, high = told(monkeypatch, merit=40.0, error=0.12, most=1.5)
    assert low == pytest.approx(1.0 - 1.96 * 0.05) and high == 2.1


def test_a_remainder_widens_within_the_bounds():
    """No model that leaves one is quite right."""
    search = Toy({(0,): 0.1})
    knob = SimpleNamespace(field="change", low=0.0, high=2.15)
    search.tried[(0,)].model.knobs, search.tried[(0,)].model.owner = (knob,), np.zeros(1, int)
    number = Number(2.0, 1.5, 2.1, "kg")
    claim = Claim(0, {"change": number}, (), (), (), (), True, True, True, False, (0.9, 0.8, 0.95))
    found = widening._of_a_misfit(search, (0,), claim).numbers["change"]
    assert (found.low, found.high) == pytest.approx((1.4, 2.12))
    wide = Claim(0, {"change": Number(2.0, 0.1, 2.14, "kg")}, *([()] * 4), True, True, True, False,
                 (0.9, 0.8, 0.95))  # fmt: skip
    found = widening._of_a_misfit(search, (0,), wide).numbers["change"]
    assert (found.low, found.high) == (0.0, 2.15)


@pytest.mark.parametrize("curved", [True, False])
def test_a_size_holds_without_a_curve_along_a_state_beside_it(monkeypatch, curved):
    """It takes up whatever happens while the state is there."""
    search = Toy({(): 1.0, (0,): 0.3, (0, 1): 0.1}, merits={(0,): 300.0, (0, 1): 100.0})
    if curved:
        search.candidates[1].effect = StateCurve("room")
    knob = SimpleNamespace(field="change", low=-10.0, high=10.0)
    for key, values in (((0,), [1.0]), ((0, 1), [2.0, 5.0])):
        fit = search.tried[key]
        fit.theta = np.array(values)
        fit.model.knobs, fit.model.owner = (knob,) * len(key), np.arange(len(key))
    monkeypatch.setattr(widening, "deviations", lambda fit, blocks: np.full(len(fit.theta), 0.05))
    claims = [
        Claim(n, {"change": Number(size, size - 0.1, size + 0.1, "kg")}, (), (), (), (), True, True,
              True, False, (0.9, 0.8, 0.95))
        for n, size in ((0, 2.0), (1, 5.0))
    ]  # fmt: skip
    found = widening._beside_rivals(search, (0, 1), claims[0], claims).numbers["change"]
    assert found.high == pytest.approx(2.1)
    assert found.low == pytest.approx(1.0 - 1.96 * 0.05 if curved else 1.9)


@pytest.mark.parametrize(("alone", "asked"), [(0.9, [(0, 2), (0, 1)]), (0.02, [(0,)])])
def test_two_that_may_each_stand_for_the_other_do_not_both_go(alone, asked):
    """A gain and a mass: without both of them the size of a lag beside them says nothing."""
    search = Toy({(0,): alone, (0, 1): 0.011, (0, 2): 0.02, (0, 1, 2): 0.01, (1, 2): 0.1})
    search.merged = lambda key, more, drop: (tuple(n for n in key if n not in drop), np.zeros(0))
    search.add = lambda sets: None
    claim = Claim(0, {}, (), (), (), (), True, True, True, False, (0.9, 0.8, 0.95))
    assert widening._without_the_unsure(search, (0, 1, 2), claim, set()) == asked
