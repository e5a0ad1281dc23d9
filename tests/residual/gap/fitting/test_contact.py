"""Effects are named from walks: another simulator makes the log, sensors are noisy."""

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize

from residual.gap import find_gap
from residual.gap.fitting.impacts.quadratic import Quadratic, minimise
from residual.gap.fitting.impacts.robust import losses
from residual.gap.preparation.horizon import other_length, usual_horizon
from residual.trajectories import Trajectory
from sims.effects.parameter import ParameterChange
from sims.leo import Leo, Walking

sys.path.insert(0, str(Path(__file__).parents[3] / "sims"))
import leo_reference as reference


def struggle(system, rows, steps, seed, rates=False):
    """Logs of the reference under drunken voltages, from Leo's start pose."""
    rng = np.random.default_rng(seed)
    task = Walking(start_at="around")
    state = np.array([task.start(rng) for _ in range(rows)])
    noise = np.zeros((rows, 6))
    states, actions = [state], []
    for _ in range(steps):
        noise += -0.15 * noise + 0.2 * rng.standard_normal(noise.shape)
        actions.append(8.6 * np.clip(noise, -1, 1))
        state = reference.step(state, actions[-1], system, h=3e-4)
        states.append(state)
    seen = np.stack(states, axis=1)
    seen += np.repeat([1e-3, 2e-3, 0.1 if rates else np.nan], [2, 7, 9]) * rng.standard_normal(
        seen.shape
    )
    times = 0.03 * np.arange(steps + 1)
    volts = np.stack(actions, axis=1)
    return [
        Trajectory(f"run {i}", times, s, a)
        for i, (s, a) in enumerate(zip(seen, volts, strict=True))
    ]


def offered(*names):
    return [ParameterChange(name) for name in names]


@pytest.mark.long
def test_two_effects_are_named_with_their_values():
    logs = struggle(reference.TRUE, rows=6, steps=22, seed=0)
    effects = offered("torso_mass", "friction", "supply", "gravity", "slope")
    result = find_gap(Leo(), logs, effects=effects, minutes=20.0)
    found = {str(effect): effect.change for effect in result.effects}
    assert set(found) == {"torso_mass", "friction"}
    assert 0.94226 + found["torso_mass"] == pytest.approx(1.25, rel=0.03)
    assert found["friction"] == pytest.approx(0.03, rel=0.06)
    assert result.gap.after.value < 0.6 * result.gap.before.value
    friction = next(v for v in result.verdicts if v.effect == "friction")
    assert friction.parameters["change"].low < 0.03 < friction.parameters["change"].high * 1.05


@pytest.mark.long
def test_a_short_struggle_names_the_heavier_torso():
    logs = struggle(reference.TRUE, rows=3, steps=12, seed=2, rates=True)
    # With half of the sub-steps the mass is 3 % off; with a third of them it is not found.
    leo, effects = Leo(substeps=15), offered("torso_mass", "friction")
    result = find_gap(leo, logs, effects=effects, parameter_tolerance=0.0, minutes=20.0)
    found = {str(effect): effect.change for effect in result.effects}
    assert 0.94226 + found["torso_mass"] == pytest.approx(1.25, rel=0.1)
    # What is told is how far forecasts go, not how long the windows are that they begin after.
    told = result.gap.horizon_s
    assert told == pytest.approx(usual_horizon(leo, logs), abs=0.5 * leo.dt + 1e-9)
    assert other_length(leo, told, told) == []


@pytest.mark.long
def test_no_gap_no_name():
    logs = struggle(reference.System(), rows=6, steps=17, seed=1)
    effects = offered("torso_mass", "friction", "supply", "gravity", "slope")
    result = find_gap(Leo(), logs, effects=effects, minutes=20.0)
    assert result.effects == ()
    assert result.verdicts[0].kind == "no_gap"


def test_the_robust_loss_of_a_set_is_its_least():
    rng = np.random.default_rng(0)
    columns, residual = rng.standard_normal((30, 12, 3)), rng.standard_normal((30, 12))
    residual[:4] *= 20
    residual += columns @ np.array([0.5, -0.3, 0.0])
    model = Quadratic.of(
        rng.standard_normal((30, 12, 2)), residual, columns, np.full(30, 10.0), np.full(3, -np.inf)
    )
    (loss,), (found,) = minimise(model, [(0, 1)], turns=40)

    def total(x):
        return losses(model.costs(np.append(x, 0.0)), model.freedom).sum()

    best = minimize(total, [0.0, 0.0])
    assert loss == pytest.approx(best.fun, rel=1e-6)
    np.testing.assert_allclose(found, best.x, atol=1e-3)
    held = Quadratic(model.a, model.b, model.c, model.freedom, np.array([-np.inf, 0.0, 0.0]))
    _, (bounded,) = minimise(held, [(0, 1)], turns=40)
    assert bounded[1] == 0.0
