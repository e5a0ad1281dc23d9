"""Rigs and their keys: how simulators are judged, and the command."""

import dataclasses
import os
from pathlib import Path

import numpy as np
import pytest

from residual.gap.result import Span, Verdict
from residual.trajectories import Trajectory
from sims.effects import ActuatorLag, Delay, ViscousFriction
from studies.judging.forecasts import plan, root_mean_squares
from studies.judging.oracle import fit_effects
from studies.real.judge import Judge, ask, named
from studies.real.prepare import local_slope
from studies.real.rigs import RIGS
from studies.real.systems import Car, Drives, Heater
from studies.real_rigs import main

DATA = Path(os.environ.get("SIMGAP_DATA", Path(__file__).parents[3] / "shared" / "data"))
BY_NAME = {rig.folder: rig for rig in RIGS}


def run_of(simulator, start, actions):
    """A run of a simulator's own steps, memory of effects left out."""
    path = simulator.rollout(simulator.augment([start], [actions[0]])[0], actions)
    times = simulator.dt * np.arange(len(path))
    physical = len(simulator.physical_channels)
    return Trajectory("own", times, path[:, :physical], np.asarray(actions, float))


def steps(levels, each=30):
    return np.repeat(np.asarray(levels, float), each)[:, None]


@pytest.mark.parametrize(
    "effects",
    [(), (ActuatorLag("level", 12.0),), (Delay("level", 7.3),)],
    ids=["plain", "lag", "delay"],
)
def test_a_simulator_forecasts_its_own_motion_without_error(effects):
    simulator = Heater().with_effects(effects)
    run = run_of(simulator, [300.0], steps([0, 100, 20, 150]))
    (error,) = root_mean_squares(simulator, plan(simulator, [run], 40.0)).values()
    assert error < 1e-6
    (nominal,) = root_mean_squares(Heater(), plan(simulator, [run], 40.0)).values()
    assert (nominal > 0.1) == bool(effects)


def test_runs_of_several_sampling_times_are_judged_together():
    simulator = Drives([1.0], ["1"], 0.01)
    run = run_of(simulator, [0.0, 0.0], steps([1, -2, 3, 0]))
    sparse = Trajectory("sparse", run.times[::2], run.states[::2], run.actions[::2])
    groups = plan(simulator, [run, sparse], 0.2)
    assert [group.steps for group in groups] == [20, 10]
    assert max(root_mean_squares(simulator, groups).values()) < 1e-9


def test_a_missing_start_is_passed_over():
    simulator = Drives([1.0], ["1"], 0.01)
    run = run_of(simulator, [0.0, 0.0], steps([1, -2, 3, 0]))
    run.states[0] = np.nan
    run.states[50:70, 1] = np.nan
    (group,) = plan(simulator, [run], 0.2)
    assert np.isfinite(group.states).all()
    assert root_mean_squares(simulator, [group])["angle 1"] < 1e-9


def test_the_repair_finds_the_strengths_that_made_the_data():
    true = Drives([1.0, 0.1], ["a", "b"], 0.01).with_effects(
        [ViscousFriction("angle a", 2.0), ViscousFriction("angle b", 0.3)]
    )
    rng = np.random.default_rng(0)
    actions = np.repeat(rng.normal(size=(20, 2)), 20, axis=0)
    nominal = Drives([1.0, 0.1], ["a", "b"], 0.01)
    key = (ViscousFriction("angle a"), ViscousFriction("angle b"))
    groups = plan(nominal, [run_of(true, np.zeros(4), actions)], 0.3)
    found = fit_effects(nominal, key, groups, ["rate a", "rate b"])
    assert [e.coefficient for e in found] == pytest.approx([2.0, 0.3], rel=1e-4)


def test_a_slope_is_exact_for_a_parabola_with_uneven_samples():
    times = np.cumsum(np.random.default_rng(1).uniform(0.02, 0.2, 60))
    slopes = local_slope(times, 3 + 2 * times - 5 * times**2, 0.8)
    np.testing.assert_allclose(slopes, 2 - 10 * times, atol=1e-8)


def test_the_car_rolls_in_a_circle():
    simulator = Car()
    actions = np.tile([0.2, 0.4], (400, 1))
    path = simulator.rollout([0.0, 0.0, 0.0, 0.4], actions)
    radius = 0.3302 / np.tan(0.2)
    off_centre = np.hypot(path[:, 0], path[:, 1] - radius)
    np.testing.assert_allclose(off_centre, radius, rtol=1e-6)
    assert path[-1, 2] == pytest.approx(10 * 0.4 / radius, rel=1e-6)


def verdict(kind, effect, where, *alternatives):
    return Verdict(kind, effect, where, {}, alternatives, "", "", Span(0.0, 0.0, 0.0))


def test_names_are_held_against_the_key():
    rig = BY_NAME["small-car-steps"]
    sure = verdict("confirmed", "actuator_lag", "speed_command")
    either = verdict("ambiguous", "wheelbase", "wheelbase", "delay@steering", "x_offset@x")
    found = named(rig, Car(), [sure, either])
    assert found.right == ("confirmed", "one of 3")
    assert not found.enough
    assert not found.wrong
    load = verdict("confirmed", "constant_load", "speed")
    assert named(rig, Car(), [load]).wrong == ("constant_load@speed",)
    assert named(rig, Car(), [load]).right == ("missing", "missing")
    twin = dataclasses.replace(load, same_motion=("actuator_lag@steering",))
    assert not named(rig, Car(), [twin]).wrong


def test_a_folder_that_is_not_there_is_one_line(tmp_path, capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--data", str(tmp_path / "none")])
    assert stop.value.code == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_an_unknown_rig_is_one_line(tmp_path, capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--data", str(tmp_path), "--rigs", "airtruck"])
    assert stop.value.code == 2
    assert "'airtruck'" in capsys.readouterr().err


needs_data = pytest.mark.skipif(
    not DATA.is_dir(), reason="no data: set SIMGAP_DATA to the folder of docs/real-rigs.md"
)


@needs_data
@pytest.mark.parametrize(
    ("folder", "nominal", "repaired"),
    [
        ("heater", 2.53, 0.39),
        ("arm-open-loop-torque", 0.950, 0.0185),
        ("small-car-steps", 0.0526, 0.0221),
        ("coasting-rockets", 22.2, 5.2),
    ],
)
def test_the_judge_finds_the_errors_that_the_keys_state(folder, nominal, repaired, tmp_path):
    judge = Judge(BY_NAME[folder], DATA, tmp_path)
    before = next(iter(judge.errors(judge.simulator).values()))
    after = next(iter(judge.errors(judge.repaired()).values()))
    assert before == pytest.approx(nominal, rel=0.12)
    # The keys' own windows and smoothing differ a little from those here.
    assert 0.6 * repaired < after < 1.1 * repaired


@needs_data
@pytest.mark.parametrize("folder", [
    "heater",
    # Their names are asked of the same logs in test_invariances.py.
    pytest.param("airtrack", marks=pytest.mark.long),
    pytest.param("phone-drop", marks=pytest.mark.long),
])  # fmt: skip
def test_find_gap_names_what_the_key_names(folder, tmp_path):
    found = ask(BY_NAME[folder], DATA, tmp_path)
    assert found.named.enough
    assert not found.named.wrong
    assert found.ratio <= 1.5
