"""Logs of a step: what came before it, when it came, and what only switches the motion off."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims import Channel, FirstOrderSystem, Parameter


class Block(FirstOrderSystem):
    """A block that is heated."""

    dt = 1.0
    state_channels = (Channel("temperature", "degC", "other", scale=40.0),)
    action_channels = (Channel("power", "1", "input", scale=0.3, low=0.0, high=1.0),)
    parameters = {
        "room": Parameter(24.0, "degC", "around it"),
        "rise": Parameter(900.0, "degC", "at full power", low=10.0),
        "time_constant": Parameter(300.0, "s", "of the block", low=5.0),
    }

    def derivative(self, x, u, p):
        return ((p.room + p.rise * u[:, 0] - x[:, 0]) / p.time_constant)[:, None]


def heated(lag, rise, rows=260, seed=0):
    """From rest at full power, then by a controller that keeps 100 degC; the element lags."""
    rng = np.random.default_rng(seed)
    state, seen, powers = np.array([24.0, 0.0]), [], []
    for _ in range(rows):
        seen.append(np.round(state[0] + 0.03 * rng.standard_normal(), 1))
        power = np.clip(0.03 * (100.0 - seen[-1]) + 0.07, 0.0, 1.0)
        powers.append(round(float(power), 2))

        def rates(_, x, power=powers[-1]):
            return [(24.0 + rise * x[1] - x[0]) / 300.0, (power - x[1]) / lag]

        state = solve_ivp(rates, (0, 1.0), state, rtol=1e-8).y[:, -1]
    return Trajectory("step", np.arange(float(rows)), np.array(seen)[:, None],
                      np.array(powers)[:-1, None])  # fmt: skip


@pytest.mark.long
def test_a_step_from_rest_is_asked_with_lags_beside_what_was_not_chosen():
    """Taken to have gone on before, it leads to a delay and twice the time constant."""
    offered = ("actuator_lag", "delay", "actuator_gain", "rise", "time_constant", "constant_load")
    result = find_gap(Block(), heated(26.0, 1100.0), effects=offered)
    named = {verdict.effect: verdict for verdict in result.verdicts if verdict.parameters}
    lag = named["actuator_lag"].parameters["time_constant"]
    assert lag.value == pytest.approx(26.0, abs=1.5)
    drive = named.get("actuator_gain") or named["rise"]
    (stronger,) = drive.parameters.values()
    by = stronger.value / (1.0 if drive.effect == "actuator_gain" else 900.0)
    assert by == pytest.approx(200 / 900, abs=0.03)
    assert "delay" not in named and "time_constant" not in named


class Wheel(FirstOrderSystem):
    """A wheel whose speed is measured."""

    dt = 0.02
    state_channels = (Channel("speed", "rad/s", "rate", scale=10.0),)
    action_channels = (Channel("duty", "1", "input", scale=1.0, low=-1.0, high=1.0),)
    parameters = {
        "full_speed": Parameter(20.0, "rad/s", "at full duty", low=0.1),
        "time_constant": Parameter(0.2, "s", "of the wheel", low=0.01),
    }

    def derivative(self, x, u, p):
        return ((p.full_speed * u[:, 0] - x[:, 0]) / p.time_constant)[:, None]


def wheel(speeds, duties, seed=0):
    rng, rows = np.random.default_rng(seed), len(speeds)
    seen = speeds + 0.05 * rng.standard_normal(rows)
    return Trajectory(f"run {seed}", 0.02 * np.arange(rows), seen[:, None], duties[:-1, None])


@pytest.mark.long
def test_when_an_input_came_on_that_never_changes_is_not_certain():
    times = 0.02 * np.arange(300)
    speeds = 24.0 * (1 - np.exp(-np.maximum(times - 0.1, 0.0) / 0.2))
    records = [wheel(speeds * share, np.full(300, share), k) for k, share in enumerate((0.5, 1.0))]
    offered = ("delay", "actuator_lag", "actuator_gain", "full_speed", "time_constant")
    result = find_gap(Wheel(), records, effects=offered)
    timed = [v for v in result.verdicts if v.effect == "delay"]
    assert all(v.kind != "confirmed" for v in timed)
    assert timed and all("clock" in v.doubts for v in timed if v.kind == "ambiguous")


def test_a_gap_that_a_single_stretch_shows_is_told():
    """A step, and then nothing for long: forecasts err little more than by noise, all in all."""
    times = 0.02 * np.arange(500)
    duties = np.where(times < 0.2, 0.0, 1.0)
    speeds = 20.0 * (1 - np.exp(-np.maximum(times - 0.2, 0.0) / 0.26))
    noisy = speeds + 0.6 * np.random.default_rng(5).standard_normal(len(times))
    result = find_gap(Wheel(), wheel(noisy, duties))
    assert [v.kind for v in result.verdicts if v.kind != "needs_data"] == ["no_gap"]
    (told,) = [one.says for one in result.quality if "as much there as by noise" in one.says]
    assert told.startswith("run 0 from 0 s to ")
