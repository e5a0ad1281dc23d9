"""The command through its whole way: from logs to verdict, files and corrected simulator."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

import studies
from sims.loading import load_simulator
from sims.pendulum_equation import PendulumEquation
from studies.find_gap import main, run
from studies.make_log import main as make_log
from studies.make_log import write_logs

EQUATION = "sims.pendulum_equation.PendulumEquation"
FEW = ["mass", "inertia", "delay"]


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    return [str(path) for path in write_logs(tmp_path_factory.mktemp("logs"), runs=6, steps=100)]


@pytest.fixture(scope="module")
def settings(logs):
    return {
        "simulator": EQUATION, "logs": logs[:5], "held_out": [f"{logs[5][:-1]}?"], "effects": FEW,
        "hold": "zero",
    }  # fmt: skip


@pytest.fixture(scope="module")
def found(settings, tmp_path_factory):
    folder = tmp_path_factory.mktemp("found") / "gap"
    lines = []
    return run(settings, folder, progress=lines.append), folder, lines


@pytest.fixture(scope="module")
def record(found):
    return json.loads((found[1] / "gap.json").read_text())


def command(arguments, folder, module="studies.find_gap"):
    root = str(Path(studies.__file__).parents[1])
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": root}
    return subprocess.run(
        [sys.executable, *(["-m", module] if module else []), *map(str, arguments)],
        cwd=folder, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip


def words_of(page):
    """Its text, spaces that do not break made plain."""
    return page.read_text().replace("\N{NO-BREAK SPACE}", " ")


def test_a_first_try_confirms_the_mass_with_default_options(tmp_path):
    make_log(["--output", str(tmp_path / "logs"), "--runs", "8"])
    logs = sorted((tmp_path / "logs").glob("*.csv"))
    done = command(["--simulator", EQUATION, "--output", "gap", "--logs", *logs], tmp_path)
    assert done.returncode == 0, done.stderr
    first, _, verdict = done.stdout.strip().splitlines()[:3]
    assert re.fullmatch(r"(More than )?99\.\d % of the gap is mass.*\.", first)
    assert verdict.startswith("CONFIRMED") and "mass: +0.0" in verdict
    record = json.loads((tmp_path / "gap" / "gap.json").read_text())
    change = record["verdicts"][0]["parameters"]["change"]
    assert change["low"] <= 0.035 <= change["high"] and record["says"] == first
    # What stands out in the data is said before anything is tried.
    told = done.stderr
    assert told.index("250 steps of 0.05 s") < told.index("candidate effects")
    assert re.search(r"^ *\d+\.\d s, \d+ s left ", told, re.MULTILINE)


def test_gap_json_holds_what_it_promises(record):
    assert set(record) >= {
        "says", "verdicts", "gap", "held_out", "evidence", "noise", "quality", "seconds",
        "versions", "config",
    }  # fmt: skip
    (verdict,) = [v for v in record["verdicts"] if v["kind"] in ("confirmed", "ambiguous")]
    assert set(verdict) >= {
        "kind", "effect", "where", "parameters", "alternatives", "family", "share",
        "provisional", "says",
    }  # fmt: skip
    assert (verdict["kind"], verdict["effect"]) == ("confirmed", "mass")
    change = verdict["parameters"]["change"]
    assert change["unit"] == "kg" and change["low"] <= 0.035 <= change["high"]
    assert not change["at_bound"]
    assert ("sampling", "run-01.csv") in {(one["kind"], one["where"]) for one in record["quality"]}
    gap = record["gap"]
    assert set(gap) >= {"horizon_s", "share", "blocks", "folds", "steps", "by_channel"}
    for key in ("before", "after", "noise_floor", "share"):
        assert gap[key]["low"] <= gap[key]["value"] <= gap[key]["high"]
    assert gap["after"]["value"] < 0.1 * gap["before"]["value"]
    assert [step["added"] for step in gap["steps"]] == ["", "mass"]
    assert set(gap["by_channel"]) == {"angle", "rate"}
    assert record["seconds"]["total"] > 0 and record["versions"]["numpy"]


def test_verdict_table_evidence_report_and_file_tell_the_same(record, found):
    result, folder, _ = found
    gap, page = record["gap"], words_of(folder / "report.html")
    assert gap["steps"][0]["gap"] == gap["before"] == gap["by_channel"]["angle"]["before"]
    assert gap["steps"][-1]["gap"] == gap["after"] == gap["by_channel"]["angle"]["after"]
    # One effect: its share is the share of the gap that has a name.
    assert record["verdicts"][0]["share"]["value"] == pytest.approx(gap["share"]["value"])
    (chosen,) = [tried for tried in record["evidence"] if tried["chosen"]]
    assert chosen["effects"] == ["mass"] and not chosen["reason"]
    assert all(tried["reason"] for tried in record["evidence"] if not tried["chosen"])
    assert record["says"] in page
    loaded = yaml.safe_load((folder / "corrected.yaml").read_text())["init_args"]
    assert loaded["hold"] == {"voltage": "zero"}
    (effect,) = loaded["effects"]
    value = record["verdicts"][0]["parameters"]["change"]["value"]
    assert effect["init_args"] == {"parameter": "mass", "change": value}
    assert load_simulator(folder / "corrected.yaml").effects == result.effects


@pytest.mark.long
def test_records_set_aside_are_judged_and_change_nothing_else(record, settings, tmp_path):
    held = record["held_out"]["by_channel"]["angle"]
    assert held["after"]["value"] < 0.1 * held["before"]["value"]
    assert held["after"]["value"] < 2 * held["noise_floor"]["value"]
    without = {k: v for k, v in settings.items() if k != "held_out"}
    run(without, tmp_path / "plain")
    plain = json.loads((tmp_path / "plain" / "gap.json").read_text())
    assert plain["held_out"] is None
    assert plain["verdicts"] == record["verdicts"] and plain["gap"] == record["gap"]


@pytest.mark.long
def test_the_order_of_the_files_changes_no_digit(record, settings, tmp_path):
    run({**settings, "logs": settings["logs"][::-1]}, tmp_path / "back")
    back = json.loads((tmp_path / "back" / "gap.json").read_text())
    assert back["verdicts"] == record["verdicts"] and back["gap"] == record["gap"]


def test_the_corrected_simulator_is_the_same_to_the_last_bit(found):
    result, folder, _ = found
    loaded = load_simulator(folder / "corrected.yaml")
    rng = np.random.default_rng(0)
    states, voltages = rng.normal(size=(20, 2)) * [2, 8], rng.uniform(-3, 3, (20, 1))
    wanted = result.corrected.step(states, voltages)
    np.testing.assert_array_equal(loaded.step(states, voltages), wanted)
    assert not np.array_equal(wanted, PendulumEquation().step(states, voltages))


def test_the_corrected_simulator_loads_from_any_folder_without_a_file(found, tmp_path):
    result, folder, _ = found
    text = (
        "from sims.loading import load_simulator; import numpy as np; "
        f"s = load_simulator({str(folder / 'corrected.yaml')!r}); "
        "print(repr(s.step(np.array([[1.0, 2.0]]), np.array([[0.5]])).tolist()))"
    )
    done = command(["-c", text], tmp_path, module="")
    assert done.returncode == 0, done.stderr
    wanted = result.corrected.step(np.array([[1.0, 2.0]]), np.array([[0.5]]))
    assert json.loads(done.stdout) == wanted.tolist()


@pytest.mark.long
def test_a_hold_by_input_goes_into_the_corrected_simulator(settings, tmp_path):
    # A lag happens before an input that was measured at the actuator, so it is no candidate.
    asked = {**settings, "effects": ["mass", "actuator_lag"], "hold": {"voltage": "linear"}}
    result = run(asked, tmp_path / "linear")
    loaded = load_simulator(tmp_path / "linear" / "corrected.yaml")
    assert loaded.action_channels[0].hold == "linear"
    assert not any("actuator_lag@voltage" in tried.effects for tried in result.evidence)
    actions = np.random.default_rng(0).uniform(-3, 3, (30, 1))
    start = np.array([1.0, 0.0])
    np.testing.assert_array_equal(
        loaded.rollout(start, actions), result.corrected.rollout(start, actions)
    )


def test_the_report_is_one_page_with_the_share_first(found, record):
    _, folder, lines = found
    page = words_of(folder / "report.html")
    assert "http://" not in page.replace("http://www.w3.org", "") and 'src="/' not in page
    for earlier, later in (
        (record["says"], "mass: +0.0"),
        ("mass: +0.0", "noise alone"),
        ("noise alone", "step by step</h2>"),
        ("step by step</h2>", "Records set aside</h2>"),
    ):
        assert page.index(earlier) < page.index(later)
    pictures = {path.stem for path in (folder / "figures").glob("*.png")}
    assert pictures >= {"gap", "rollout-1", "missing-1"}
    assert pictures == {path.stem for path in (folder / "figures").glob("*.csv")}
    assert len(lines) > 3
    assert not list(folder.parent.glob(".partial*"))


def test_the_same_settings_give_the_same_numbers(record, logs, tmp_path):
    assert record["config"]["held_out"] == logs[5:]  # the file, not the pattern that found it
    run(record["config"], tmp_path / "again")
    again = json.loads((tmp_path / "again" / "gap.json").read_text())
    assert again["gap"] == record["gap"] and again["verdicts"] == record["verdicts"]


@pytest.mark.long
def test_an_error_that_does_not_matter_is_said_not_to(settings, tmp_path, capsys):
    arguments = ["--simulator", EQUATION, "--output", str(tmp_path / "g"), "--tolerance", "100"]
    main([*arguments, "--effects", *FEW, "--logs", *settings["logs"]])
    assert capsys.readouterr().out.strip().startswith("Nothing that matters: the ")


@pytest.mark.long
def test_classes_in_the_current_folder_need_no_registration(logs, tmp_path):
    (tmp_path / "mine.py").write_text(
        "import dataclasses\n"
        "from sims.effects import JointEffect, number\n"
        "from sims.pendulum_equation import PendulumEquation\n"
        "class Arm(PendulumEquation):\n"
        "    name = 'my arm'\n"
        "@dataclasses.dataclass(frozen=True)\n"
        "class Pull(JointEffect):\n"
        "    pull: float = number(force=1)\n"
        "    name = 'pull'\n"
        "    sentence = 'Something pulls.'\n"
        "    needs = 'motion'\n"
        "    def force(self, q, v):\n"
        "        return self.pull + 0.0 * q\n"
    )
    (tmp_path / "arm.yaml").write_text("class_path: mine.Arm\ninit_args: {mass: 0.09}\n")
    (tmp_path / "all.yaml").write_text(
        "simulator: arm.yaml\neffects: [mine.Pull]\n" + "logs: " + json.dumps(logs[:4]) + "\n"
    )
    done = command(["--config", "all.yaml", "--output", "gap"], tmp_path)
    assert done.returncode == 0, done.stderr
    assert "class of yours: as --simulator it needs --trust mine, in Python" in done.stdout
    record = json.loads((tmp_path / "gap" / "gap.json").read_text())
    assert record["config"]["simulator"]["init_args"]["mass"] == 0.09
    # The simulator has the true mass already, and nothing pulls.
    assert record["verdicts"][0]["kind"] == "no_gap"
    assert (
        done.stdout.strip().startswith("No gap above the noise")
        and "my arm" in (tmp_path / "gap" / "report.html").read_text()
    )


def test_that_a_step_shows_stays_in_the_answer(settings, tmp_path, monkeypatch):
    says = "the integration step shows in this log; run again with a finer one"
    monkeypatch.setattr("studies.find_gap.advice", lambda simulator, runs: [says])
    lines = []
    answer = run(settings | {"effects": ["mass"]}, tmp_path / "gap", progress=lines.append)
    assert any(says in line for line in lines)
    assert any(says in one.words for one in answer.quality)
    record = json.loads((tmp_path / "gap" / "gap.json").read_text())
    assert [one["says"] for one in record["quality"] if one["kind"] == "step"] == [says]
    assert says in words_of(tmp_path / "gap" / "report.html")
