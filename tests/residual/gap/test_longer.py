"""Where nothing can be named over the usual length, forecasts over a whole period are asked."""

from types import SimpleNamespace

import numpy as np
import pytest
from swing import noisy

from residual.gap import longer
from residual.gap.preparation.horizon import longest_horizon, usual_horizon
from sims.pendulum_equation import PendulumEquation

PENDULUM = PendulumEquation()


def answer(adequate):
    """An empty one, of a log of which the nominal simulator leaves noise, or more."""
    return SimpleNamespace(found=SimpleNamespace(nominal_left=SimpleNamespace(adequate=adequate)))


def asked(rows, adequate, monkeypatch, near=False):
    monkeypatch.setattr(longer, "summed_up", lambda _: None)
    monkeypatch.setattr(longer, "within_noise", lambda _: near)
    run = noisy(n=rows)
    log = SimpleNamespace(horizon=usual_horizon(PENDULUM, [run]), recorded=[run])
    return log.horizon, longer.longer_horizon(PENDULUM, log, answer(adequate)), run


def test_a_gap_is_asked_about_over_a_period(monkeypatch):
    usual, found, _ = asked(400, False, monkeypatch)
    # A sine of 2 rad/s.
    assert usual == pytest.approx(np.pi / 3, rel=0.2)
    assert found == pytest.approx(np.pi, rel=0.2)


def test_a_short_log_holds_at_least_five_of_them(monkeypatch):
    _, found, run = asked(160, False, monkeypatch)
    assert found == longest_horizon([run], 5)


@pytest.mark.parametrize(("adequate", "near"), [(True, False), (False, True)])
def test_without_a_gap_nothing_more_is_asked_of_a_long_log(adequate, near, monkeypatch):
    assert asked(400, adequate, monkeypatch, near)[1] is None
