"""The workflow from logs to verdict, on data of an independent integrator."""

import dataclasses

import numpy as np
import pytest

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.effects.library import library
from sims.pendulum_equation import PendulumEquation
from studies.hidden.data import Truth, make_logs

#: What is hidden, and what moves alike; test_hidden_effects.py offers the whole library.
RIVALS = (
    "mass", "length", "gravity", "coulomb_friction", "viscous_friction", "dead_zone", "delay",
    "actuator_lag", "sensor_offset", "saturation", "backlash",
)  # fmt: skip
ANSWERS = ("confirmed", "ambiguous", "unexplained", "no_gap")


def answer(truth, seed=11, excitation="strong", kind="A", runs=5, **options):
    logs = make_logs(truth, seed, excitation, kind, runs)
    return find_gap(PendulumEquation(), logs, **{"hold": "zero", "minutes": 20.0, **options})


def kinds(found):
    return [v.kind for v in found.verdicts if v.kind in ANSWERS]


@pytest.mark.long
@pytest.mark.parametrize(("excitation", "kind"), [("weak", "B"), ("strong", "A"), ("policy", "A")])
def test_no_gap_is_said_when_there_is_none(excitation, kind):
    found = answer(Truth(), excitation=excitation, kind=kind, runs=3)
    assert kinds(found) == ["no_gap"]
    assert found.effects == ()
    assert found.gap.after == found.gap.before


def effect(truth, kind, name, field, value):
    return pytest.param(truth, kind, name, field, value, id=f"{name}-{kind}")


@pytest.mark.long
@pytest.mark.parametrize(
    ("truth", "kind", "effect", "field", "value"),
    [
        # With rates; with an angle in steps and no rate; with a noisy angle alone.
        effect(Truth(mass=0.3), "A", "mass", "change", 0.3 * 0.055),
        effect(Truth(coulomb_friction=3e-4), "B", "coulomb_friction", "level", 3e-4),
        effect(Truth(delay=0.04), "C", "delay", "time", 0.04),
        effect(Truth(sensor_offset=0.1), "A", "sensor_offset", "offset", 0.1),
        effect(Truth(saturation=2.2), "A", "saturation", "level", 2.2),
        effect(Truth(backlash=0.35), "A", "backlash", "width", 0.35),
    ],
)
def test_hidden_effect_is_named_and_measured(truth, kind, effect, field, value):
    rivals = [e for e in library(PendulumEquation()) if e.name in RIVALS]
    found = answer(truth, kind=kind, runs=3, effects=rivals)
    first = found.verdicts[0]
    assert (first.kind, first.effect) == ("confirmed", effect)
    number = first.parameters[field]
    # Four standard errors: a test that fails by chance once in 20 would be no use.
    assert abs(number.value - value) < 2 * (number.high - number.low)
    assert found.gap.windows_before > 1.5
    assert found.gap.windows_after < 1.1
    assert found.gap.after.value < 0.6 * found.gap.before.value
    assert first.share.value > 0.5
    if effect == "mass":
        assert set(first.alternatives) >= {"length", "gravity"}


@pytest.mark.long
def test_both_of_a_pair_are_named():
    found = answer(Truth(dead_zone=0.3, inertia=0.2), runs=8)
    assert {v.effect for v in found.verdicts if v.kind == "confirmed"} == {"dead_zone", "inertia"}


@pytest.mark.long
def test_what_is_not_in_the_library_stays_unexplained():
    found = answer(Truth(wind=2e-3))
    assert "unexplained" in kinds(found)
    assert "confirmed" not in kinds(found)


@pytest.mark.long
def test_what_is_removed_from_the_library_is_called_unexplained():
    simulator = PendulumEquation()
    rivals = ("mass", "gravity", "coulomb_friction", "dead_zone", "actuator_lag", "saturation")
    offered = [e for e in library(simulator) if e.name in rivals and e.name != "saturation"]
    found = answer(Truth(saturation=2.0), effects=offered, runs=3)
    assert "unexplained" in kinds(found)
    assert "confirmed" not in kinds(found)


def test_tolerance_turns_a_small_gap_into_nothing_that_matters():
    found = answer(Truth(mass=0.03), tolerance=10.0, runs=3, effects=[])
    assert found.verdicts[0].kind == "no_gap"
    assert "nothing that matters" in found.verdicts[0].says


def test_with_nothing_on_offer_a_gap_is_unexplained_and_no_gap_is_none():
    found = answer(Truth(mass=0.3), runs=3, effects=[])
    assert kinds(found) == ["unexplained"]
    found = answer(Truth(), excitation="weak", runs=3, effects=[])
    assert kinds(found) == ["no_gap"]


def few():
    return [e for e in library(PendulumEquation()) if e.name in ("inertia", "delay", "mass")]


def test_corrected_simulator_forecasts_like_the_truth():
    found = answer(Truth(inertia=0.3), effects=few())
    start, volts = np.array([[3.0, 0.0]]), np.array([[1.0]])
    change = found.verdicts[0].parameters["change"].value
    by_hand = PendulumEquation().with_parameters(inertia=1.91e-4 + change)
    np.testing.assert_allclose(
        found.corrected.step(start, volts), by_hand.step(start, volts), rtol=1e-12
    )


@pytest.mark.long
def test_the_same_logs_give_the_same_answer():
    first, second = (answer(Truth(inertia=0.2), runs=4, effects=few()) for _ in range(2))
    assert first.verdicts == second.verdicts
    assert first.gap == second.gap


@pytest.mark.long
def test_records_set_aside_only_judge():
    logs = make_logs(Truth(inertia=0.3), 11, "strong", "A", 6)
    options = {"effects": few(), "hold": "zero", "minutes": 20.0}
    alone = find_gap(PendulumEquation(), logs[:4], **options)
    judged = find_gap(PendulumEquation(), logs[:4], held_out=logs[4:], **options)
    assert judged.verdicts == alone.verdicts
    assert judged.gap == alone.gap
    assert alone.held_out is None
    assert judged.held_out.after.value < 0.6 * judged.held_out.before.value


@pytest.mark.parametrize(
    ("inertia", "doubt"),
    [pytest.param(-0.3, "set_aside", marks=pytest.mark.long), (0.13, "no_help")],
)
def test_nothing_is_certain_that_records_set_aside_speak_against(inertia, doubt):
    """They are of a lighter rotor, or of one between the nominal one and the heavier one."""
    logs = make_logs(Truth(inertia=0.3), 11, "strong", "A", 4)
    others = make_logs(Truth(inertia=inertia), 12, "strong", "A", 2)
    found = find_gap(PendulumEquation(), logs, held_out=others, effects=few(), hold="zero")
    first = found.verdicts[0]
    assert (first.kind, first.effect) == ("ambiguous", "inertia")
    assert first.doubts == (doubt,)


@pytest.mark.long
def test_a_single_record_with_uneven_sampling():
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
    run = Trajectory("one", times, seen, volts)
    found = find_gap(PendulumEquation(), [run], hold="zero", minutes=20.0)
    assert (found.verdicts[0].kind, found.verdicts[0].effect) == ("confirmed", "mass")
    number = found.verdicts[0].parameters["change"]
    assert abs(number.value - 0.015) < 2 * (number.high - number.low)


@pytest.mark.long
def test_a_dead_channel_hides_nothing():
    """A constant column is taken as not measured, and the others still count."""
    logs = make_logs(Truth(inertia=0.3), 11, "strong", "A", 4)
    still = [
        dataclasses.replace(run, states=np.stack([run.states[:, 0], 0 * run.states[:, 1]], axis=1))
        for run in logs
    ]
    found = find_gap(PendulumEquation(), still, effects=few(), hold="zero", minutes=20.0)
    assert found.verdicts[0].effect == "inertia"


def test_nothing_measured_is_one_clear_error():
    logs = make_logs(Truth(), 2, "weak", "A", 4)
    blind = [dataclasses.replace(run, states=np.full_like(run.states, np.nan)) for run in logs]
    with pytest.raises(ValueError, match="no state channel was measured"):
        find_gap(PendulumEquation(), blind)
