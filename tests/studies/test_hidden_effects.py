"""The known-truth benchmark: strengths, scores, rivals, and the fast subset end to end."""

import dataclasses
import json

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.fitting.adequacy import CHANCE, ERRORS
from sims.effects import Backlash
from sims.effects.library import library
from sims.pendulum_equation import PendulumEquation
from studies import report
from studies.hidden.calibration import run_set, table
from studies.hidden.counts import share
from studies.hidden.data import Truth, make_logs
from studies.hidden.grid import Block, HiddenStudy, trials_of
from studies.hidden.play import integrate_play
from studies.hidden.rivals import one_step, regression
from studies.hidden.scores import score_names
from studies.hidden.strengths import HIDDEN, sizes, strength, truth
from studies.hidden_effects import main
from studies.running.progress import Silent

#: What a play may be taken for.
ALIKE = ("backlash", "dead_zone", "coulomb_friction", "delay", "sensor_offset")


def test_every_strength_makes_the_gap_that_was_asked_for():
    for name in HIDDEN:
        found = strength(name, 3.0, "strong", "A")
        assert sizes(name, np.array([found]), "strong", "A")[0] == pytest.approx(3.0, rel=0.05)


def test_truth_holds_what_the_library_calls_by_the_same_name():
    fields = {field.name for field in dataclasses.fields(Truth)}
    names = {effect.name for effect in library(PendulumEquation())}
    assert set(HIDDEN) <= fields & names
    assert truth({"saturation": 0.2}).saturation == pytest.approx(2.4)


def test_play_moves_as_in_the_simulator():
    width = 0.3
    simulator = PendulumEquation().with_effects((Backlash("pivot", width),))
    rng = np.random.default_rng(4)
    volts = rng.uniform(-3, 3, (3, 40))
    states = np.zeros((5, 3))
    states[0], states[1] = rng.uniform(0, 6, 3), rng.uniform(-5, 5, 3)
    gaps = np.zeros(3)
    rows = np.column_stack([*states[:2], gaps])
    crossed = 0
    for k in range(volts.shape[1]):
        before = gaps.copy()
        states = integrate_play(Truth(backlash=width), states, gaps, volts[:, k], simulator.dt)
        rows = simulator.step(rows, volts[:, k : k + 1])
        crossed += int((np.abs(gaps - before) > 0.9 * width).sum())
        np.testing.assert_allclose(rows[:, :2], states[:2].T, atol=2e-4)
    assert crossed > 20


@pytest.mark.long
def test_play_is_named_with_its_width():
    # Of four runs it hangs on a processor's rounding whether a delay does as well.
    logs = make_logs(Truth(backlash=0.35), 8, "strong", "A", 6)
    (verdict,) = find_gap(PendulumEquation(), logs, effects=ALIKE).verdicts
    assert (verdict.kind, verdict.effect) == ("confirmed", "backlash")
    assert verdict.parameters["width"].low <= 0.35 <= verdict.parameters["width"].high


@pytest.mark.long
def test_what_only_one_run_shows_is_named():
    # One run turns far away from a cubic spring's centre; its blocks are spread over the folds.
    strength = 5.923225897069604e-11
    logs = make_logs(Truth(cubic_spring=strength), 42, "strong", "B")
    (verdict,) = find_gap(PendulumEquation(), logs).verdicts
    assert verdict.effect == "cubic_spring"
    assert verdict.parameters["stiffness"].low <= strength <= verdict.parameters["stiffness"].high


def test_names_are_scored_with_the_twins_that_are_declared():
    assert score_names(["length"], ["mass"])["first"]
    lag = score_names(["actuator_lag"], ["delay"])
    assert not lag["first"] and lag["first_alike"] and lag["false"] == 0
    pair = score_names(["mass", "delay"], ["delay", "inertia"])
    assert not pair["first"] and not pair["all_named"] and pair["false"] == 1
    assert score_names([], [])["first"] is None
    assert score_names(["mass"], [])["false"] == 1


def test_share_has_an_exact_interval():
    assert share(0, 200) == "0 % (0/200; 0 to 2)"
    assert share(0, 0) == "-"


def test_draws_are_balanced_over_effects_and_repeatable():
    count = len(HIDDEN)
    study = HiddenStudy([Block("single", [["any"]], [1.5, 3.0], ["strong"], ["A"], sets=count)])
    cells = trials_of(study)
    assert sorted(cell["hidden"][0] for cell in cells) == sorted(HIDDEN)
    assert cells == trials_of(study)
    assert len({cell["seed"] for cell in cells}) == count


def test_an_unknown_name_is_one_line_and_leaves_nothing(tmp_path, capsys):
    settings = json.dumps([{"name": "x", "hidden": [["ghost"]]}])
    with pytest.raises(SystemExit) as stop:
        main(["--blocks", settings, "--output", str(tmp_path / "out")])
    assert stop.value.code == 2
    assert "'ghost'" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_one_step_regression_names_a_mass_when_the_rate_is_measured():
    logs = make_logs(Truth(mass=0.05), 3, "strong", "A", 6)
    simulator = PendulumEquation()
    assert one_step(regression(simulator, library(simulator), logs, False))[0] == "mass"


def test_noise_alone_stays_below_every_threshold(tmp_path):
    config = {"excitation": "weak", "noise": "A", "runs": 5, "seed": 5}
    found = run_set(config, tmp_path, Silent())
    assert found["chosen"] == 0
    assert found["gain"] < found["threshold"]
    assert found["ratio_in_errors"] < ERRORS
    assert found["chance"] > CHANCE
    assert table([found])["sets"].tolist() == [1, 1]


def test_fast_subset(tmp_path, capsys):
    main(["--config", "studies/configs/hidden_effects/fast.yaml", "--output", str(tmp_path)])
    assert "first name right" in capsys.readouterr().out
    for name in ("report.html", "sets.csv", "cells.csv", "rivals.csv", "confusion.png"):
        assert (tmp_path / name).stat().st_size > 0
    said = {
        (r["config"]["block"], *r["config"]["hidden"]): r["answers"]["find_gap"]
        for r in (json.loads(p.read_text()) for p in tmp_path.glob("sets/*/results.json"))
    }
    assert said["single", "mass"]["first"]
    assert said["single", "dead_zone"]["first"]
    assert said["no gap",]["kinds"][0] == "no_gap"
    assert said["outside", "wind"]["unexplained"]
    assert said["outside", "wind"]["sure"] == []
    (tmp_path / "cells.csv").unlink()
    report.main([str(tmp_path / "sets")])
    assert (tmp_path / "cells.csv").stat().st_size > 0


def test_rivals_alone_have_a_report(tmp_path, capsys):
    config = tmp_path / "alone.yaml"
    block = "{name: no gap, hidden: [[]], excitation: [weak], runs: [3]}"
    config.write_text(f"steps: 60\nmethods: [one_step]\nblocks: [{block}]\n")
    main(["--config", str(config), "--output", str(tmp_path / "out")])
    assert "one-step regression: a false name" in capsys.readouterr().out
    assert "Beside other methods" in (tmp_path / "out" / "report.html").read_text()
