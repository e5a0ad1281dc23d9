"""What find_gap and read_logs take for measured runs, and how they refuse the rest."""

import dataclasses

import numpy as np
import pandas as pd
import pytest
from swing import noisy

from residual.gap import find_gap
from residual.gap.log import look
from residual.gap.offered import Offered
from residual.logs import LogData, read_logs
from residual.trajectories import Trajectory, trajectories_of
from sims.chosen import chosen_effects
from sims.pendulum_equation import PendulumEquation
from sims.simulator import Simulator


def test_one_run_several_and_what_was_read_are_the_same():
    run = noisy()
    for given in (run, [run], (run,), LogData((run,), ()), iter([run])):
        assert trajectories_of(given) == [run]


@pytest.mark.parametrize(
    ("given", "kind"),
    [("log.csv", "str"), (5, "int"), ([np.zeros((4, 2))], "ndarray"),
     (pd.DataFrame({"angle": [0.0]}), "DataFrame"), (["log.csv"], "str")],
)  # fmt: skip
def test_what_is_no_run_is_refused_with_the_way_to_read_one(given, kind):
    with pytest.raises(ValueError, match=rf"got {kind}: read logs with read_logs\("):
        find_gap(PendulumEquation(), given)


@pytest.mark.parametrize(
    ("states", "actions", "says"),
    [((50, 3), (49, 1), "states has 3 columns, expected 2: angle, rate"),
     ((50, 1), (49, 1), "states has 1 columns"),
     ((50, 2), (49, 2), "actions has 2 columns, expected 1: voltage")],
)  # fmt: skip
def test_columns_that_are_not_the_channels_are_refused(states, actions, says):
    rng = np.random.default_rng(0)
    run = Trajectory("swing", 0.05 * np.arange(50), rng.normal(size=states), np.ones(actions))
    with pytest.raises(ValueError, match=f"swing: {says}"):
        find_gap(PendulumEquation(), run)


def test_times_that_fall_and_states_that_are_no_numbers_are_refused():
    run = noisy()
    backwards = dataclasses.replace(run, times=run.times[::-1])
    with pytest.raises(ValueError, match=r"times go from 19.95 to 19.9 s at row 1.*sort the rows"):
        find_gap(PendulumEquation(), backwards)
    with pytest.raises(ValueError, match=r"run: states are str\d+, expected numbers"):
        dataclasses.replace(run, states=run.states.astype(str))


def test_a_run_of_one_dimension_is_refused_with_the_fix():
    with pytest.raises(ValueError, match=r"shape \(5,\), expected two.*values\[:, None\]"):
        Trajectory("drop", np.arange(5.0), np.zeros(5), np.zeros((4, 0)))


def test_a_class_in_place_of_a_simulator_is_told():
    with pytest.raises(ValueError, match=r"PendulumEquation is a class, .* PendulumEquation\(\)"):
        find_gap(PendulumEquation, [noisy()])


def test_a_simulator_that_hosts_nothing_is_told_what_to_derive_from():
    class Arm(Simulator):
        def step(self, states, actions):
            return states

    with pytest.raises(ValueError, match="Arm cannot host effects: derive it from Equation"):
        find_gap(Arm(), [noisy()])


def test_what_a_measured_input_has_recorded_already_is_not_offered():
    log = look(PendulumEquation(), [noisy()], [], None, lambda _: None)
    every, recorded = (set(Offered.of(log, None, given).by_label) for given in ((), ["voltage"]))
    assert {"dead_zone@voltage", "actuator_lag@voltage"} <= every - recorded
    assert recorded == set(Offered.of(log, None, True).by_label)
    assert "viscous_friction@pivot" in recorded
    with pytest.raises(ValueError, match="measured_input: no input torque; there are voltage"):
        Offered.of(log, None, ["torque"])


def test_runs_in_place_of_a_simulator_are_told():
    with pytest.raises(ValueError, match="simulator is of type list, expected a Simulator"):
        find_gap([noisy()], PendulumEquation())


@pytest.mark.parametrize(
    ("settings", "says"),
    [({"horizon": "2"}, "horizon is '2', expected seconds above 0"),
     ({"minutes": 0}, "minutes is 0, expected minutes above 0"),
     ({"parameter_tolerance": 3}, "parameter_tolerance is 3, expected a share up to 1"),
     ({"n_jobs": 0}, "n_jobs is 0, expected a number of processes, 1 or more")],
)  # fmt: skip
def test_settings_that_are_no_numbers_or_beyond_their_range_are_refused(settings, says):
    with pytest.raises(ValueError, match=says):
        find_gap(PendulumEquation(), noisy(), **settings)


@pytest.mark.long
def test_one_effect_by_name_is_a_list_of_one():
    one, listed = (
        find_gap(PendulumEquation(), noisy(), effects=effects) for effects in ("mass", ["mass"])
    )
    assert one.verdicts == listed.verdicts


def test_one_file_and_one_table_are_read_alone(tmp_path):
    run = noisy()
    table = pd.DataFrame({"time": run.times[:-1], "angle": run.states[:-1, 0],
                          "rate": run.states[:-1, 1], "voltage": run.actions[:, 0]})  # fmt: skip
    table.to_csv(tmp_path / "run.csv", index=False)
    model = PendulumEquation()
    named = {name: table[name].to_numpy() for name in table}
    for given in (tmp_path / "run.csv", str(tmp_path / "run.csv"), table, named):
        (read,) = read_logs(given, model.state_channels, model.action_channels).trajectories
        np.testing.assert_allclose(read.states[:100], run.states[:100])


def test_a_simulator_shows_the_effects_that_it_hosts():
    model = PendulumEquation()
    hosted = model.with_effects(chosen_effects(model, ["viscous_friction"]))
    assert repr(hosted) == f"{model!r} + viscous_friction@pivot"
