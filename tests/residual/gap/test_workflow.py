"""The workflow from logs to verdict, on data of an independent integrator."""

import dataclasses

import numpy as np
import pytest

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.effects.library import library
from sims.pendulum_equation import PendulumEquation
from studies.hidden.data import Truth, make_logs


def answer(truth, seed=11, excitation="strong", kind="A", runs=8, **options):
    logs = make_logs(truth, seed, excitation, kind, runs)
    return find_gap(PendulumEquation(), logs, ceiling=False, **options)


@pytest.mark.parametrize(("excitation", "kind"), [("strong", "A"), ("weak", "B"), ("policy", "A")])
def test_no_gap_is_said_when_there_is_none(excitation, kind):
    found = answer(Truth(), excitation=excitation, kind=kind)
    assert [v.kind for v in found.verdicts if v.kind != "needs_data"] == ["no_gap"]
    assert found.effects == ()
    assert found.gap.windows_after == found.gap.windows_before


@pytest.mark.parametrize(
    ("truth", "kind", "effect", "field", "value"),
    [
        (Truth(mass=0.636), "A", "mass", "change", 0.636 * 0.055),
        (Truth(coulomb_friction=2e-4), "A", "coulomb_friction", "level", 2e-4),
        (Truth(delay=0.0065), "B", "delay", "time", 0.0065),
        (Truth(sensor_offset=0.044), "A", "sensor_offset", "offset", 0.044),
        (Truth(saturation=2.7), "A", "saturation", "level", 2.7),
    ],
)
def test_hidden_effect_is_named_and_measured(truth, kind, effect, field, value):
    found = answer(truth, kind=kind)
    first = found.verdicts[0]
    assert (first.kind, first.effect) == ("confirmed", effect)
    number = first.parameters[field]
    # Four standard errors: a test that fails by chance once in 20 would be no use.
    assert abs(number.value - value) < 2 * (number.high - number.low)
    assert found.gap.windows_before > 1.5
    assert found.gap.windows_after < 1.1
    assert found.gap.after.value < 0.5 * found.gap.before.value


def test_exact_aliases_are_listed():
    found = answer(Truth(mass=0.2))
    assert set(found.verdicts[0].alternatives) >= {"length", "gravity"}


def test_both_of_a_pair_are_named():
    found = answer(Truth(dead_zone=0.06, inertia=0.03))
    assert {v.effect for v in found.verdicts if v.kind == "confirmed"} == {"dead_zone", "inertia"}


def test_what_is_not_in_the_library_stays_unexplained():
    found = answer(Truth(wind=2e-3), runs=5)
    assert "unexplained" in [v.kind for v in found.verdicts]
    assert "confirmed" not in [v.kind for v in found.verdicts]


def test_removed_effect_is_not_given_another_name():
    simulator = PendulumEquation()
    offered = [e for e in library(simulator) if e.name != "saturation"]
    found = answer(Truth(saturation=2.4), effects=offered, runs=5)
    assert "unexplained" in [v.kind for v in found.verdicts]
    assert "confirmed" not in [v.kind for v in found.verdicts]


def test_tolerance_turns_a_small_gap_into_nothing_that_matters():
    found = answer(Truth(mass=0.03), tolerance=10.0, runs=5)
    assert found.verdicts[0].kind == "no_gap"
    assert "nothing that matters" in found.verdicts[0].says


def test_corrected_simulator_forecasts_like_the_truth():
    found = answer(Truth(inertia=0.05))
    start, volts = np.array([[3.0, 0.0]]), np.array([[1.0]])
    change = found.verdicts[0].parameters["change"].value
    by_hand = PendulumEquation().with_parameters(inertia=1.91e-4 + change)
    np.testing.assert_allclose(
        found.corrected.step(start, volts), by_hand.step(start, volts), rtol=1e-12
    )


def test_same_seed_gives_the_same_answer():
    first, second = (answer(Truth(actuator_gain=-0.05), rng=4, runs=5) for _ in range(2))
    assert first.verdicts == second.verdicts
    assert first.gap == second.gap


def test_single_record_and_uneven_sampling():
    simulator = PendulumEquation(mass=0.07)
    rng = np.random.default_rng(5)
    times = np.cumsum(np.append(0.0, rng.uniform(0.015, 0.035, 900)))
    volts = np.repeat(rng.uniform(-3, 3, 100), 9)[:, None]
    states = np.empty((901, 2))
    states[0] = 3.0, 0.0
    inputs = np.repeat(volts[:, None], 5, axis=1)
    for k, h in enumerate(np.diff(times)):
        states[k + 1] = simulator.integrate(states[k : k + 1], inputs[k : k + 1], np.array([h]))
    seen = states + rng.normal(size=states.shape) * [0.01, 0.2]
    found = find_gap(PendulumEquation(), [Trajectory("one", times, seen, volts)], ceiling=False)
    assert found.verdicts[0].effect == "mass"
    number = found.verdicts[0].parameters["change"]
    assert abs(number.value - 0.015) < 2 * (number.high - number.low)


def test_nothing_measured_is_one_clear_error():
    logs = make_logs(Truth(), 2, "weak", "A", 4)
    blind = [dataclasses.replace(run, states=np.full_like(run.states, np.nan)) for run in logs]
    with pytest.raises(ValueError, match="no state channel was measured"):
        find_gap(PendulumEquation(), blind)
