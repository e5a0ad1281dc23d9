"""The command through its whole way: from logs to verdict, files and corrected simulator."""

import json
import os
import re
import subprocess
import sys

import numpy as np
import pytest

from residual.gap.result import Number
from sims.effects import Delay, ParameterChange
from sims.environment import SimulatorEnv
from sims.loading import corrected_settings, load_simulator, simulator_settings
from sims.pendulum import Pendulum
from sims.pendulum_equation import PendulumEquation
from sims.tasks import SwingUp
from studies import pendulum_gap
from studies.find_gap import main, run
from studies.gap.words import number_text, rounded
from studies.make_log import write_logs

EQUATION = "sims.pendulum_equation.PendulumEquation"


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    return [str(path) for path in write_logs(tmp_path_factory.mktemp("logs"), runs=6, steps=100)]


@pytest.fixture(scope="module")
def found(logs, tmp_path_factory):
    folder = tmp_path_factory.mktemp("found") / "gap"
    lines = []
    settings = {"simulator": EQUATION, "logs": logs, "effects": ["mass", "inertia", "delay"]}
    result = run(settings, folder, progress=lines.append)
    return result, folder, lines


def test_gap_json_holds_what_it_promises(found):
    _, folder, _ = found
    record = json.loads((folder / "gap.json").read_text())
    assert set(record) >= {"verdicts", "gap", "seconds", "versions", "config"}
    (verdict,) = [v for v in record["verdicts"] if v["effect"]]
    assert set(verdict) == {"kind", "effect", "where", "parameters", "alternatives", "says"}
    assert (verdict["kind"], verdict["effect"]) == ("confirmed", "mass")
    change = verdict["parameters"]["change"]
    assert change["unit"] == "kg" and change["low"] <= 0.035 <= change["high"]
    gap = record["gap"]
    assert set(gap) >= {
        "horizon_s", "before", "after", "noise_floor", "ceiling", "steps", "by_channel",
    }  # fmt: skip
    for key in ("before", "after", "noise_floor", "ceiling"):
        assert gap[key]["low"] <= gap[key]["value"] <= gap[key]["high"]
    assert gap["after"]["value"] < 0.1 * gap["before"]["value"]
    assert [step["added"] for step in gap["steps"]] == ["", "mass"]
    assert set(gap["by_channel"]) == {"angle", "rate"}
    assert record["seconds"]["total"] > 0 and record["versions"]["numpy"]


def test_the_corrected_simulator_is_the_same_to_the_last_bit(found):
    result, folder, _ = found
    loaded = load_simulator(folder / "corrected.yaml")
    rng = np.random.default_rng(0)
    states, voltages = rng.normal(size=(20, 2)) * [2, 8], rng.uniform(-3, 3, (20, 1))
    wanted = result.corrected.step(states, voltages)
    np.testing.assert_array_equal(loaded.step(states, voltages), wanted)
    assert not np.array_equal(wanted, PendulumEquation().step(states, voltages))


def test_the_report_is_one_page_with_the_verdict_first(found):
    _, folder, lines = found
    page = (folder / "report.html").read_text()
    assert "http://" not in page.replace("http://www.w3.org", "") and 'src="/' not in page
    for earlier, later in (("Mass: +0.0", "noise alone"), ("noise alone", "held-out data</h2>")):
        assert page.index(earlier) < page.index(later)
    pictures = {path.stem for path in (folder / "figures").glob("*.png")}
    assert pictures >= {"gap", "rollout-1", "missing-1"}
    assert pictures == {path.stem for path in (folder / "figures").glob("*.csv")}
    assert len(lines) > 3
    assert not list(folder.parent.glob(".partial*"))
    # A confirmed effect is no lead.
    assert "Confirmed on held-out data." in page
    assert "take this as a lead" not in page


def test_the_same_settings_give_the_same_numbers(found, logs, tmp_path):
    _, folder, _ = found
    config = json.loads((folder / "gap.json").read_text())["config"]
    run(config, tmp_path / "again")
    first, again = (
        json.loads((place / "gap.json").read_text()) for place in (folder, tmp_path / "again")
    )
    assert first["gap"] == again["gap"] and first["verdicts"] == again["verdicts"]


def test_the_difference_study_takes_a_corrected_simulator(tmp_path):
    effects = [ParameterChange("mass", 0.1 / 3), Delay("voltage", 0.03)]
    path = tmp_path / "corrected.yaml"
    path.write_text(json.dumps(corrected_settings(simulator_settings(
        "sims.pendulum.Pendulum"), effects)))  # fmt: skip
    parser = pendulum_gap.build_parser()
    chosen = parser.instantiate(parser.parse_args(["--simulator", str(path)])).simulator
    assert chosen.effects == tuple(effects)
    mine, plain = (SimulatorEnv(s, SwingUp()) for s in (chosen, Pendulum()))
    assert mine.observation_space == plain.observation_space
    arguments = [
        "--simulator", str(path), "--budget.iterations", "0", "--budget.idealised_steps", "1100",
        "--ddpg.hidden", "[16, 16]", "--output", str(tmp_path / "policy"),
    ]  # fmt: skip
    pendulum_gap.main(arguments)
    config = json.loads((tmp_path / "policy" / "results.json").read_text())["config"]
    assert config["simulator"] == json.loads(path.read_text())
    observation, _ = mine.reset(seed=0)
    assert mine.observation_space.contains(observation)
    assert mine.observation_space.contains(mine.step(np.array([1.0]))[0])


def command(arguments, folder):
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    return subprocess.run(
        [sys.executable, "-m", "studies.find_gap", *map(str, arguments)],
        cwd=folder, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip


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
    record = json.loads((tmp_path / "gap" / "gap.json").read_text())
    assert record["config"]["simulator"]["init_args"]["mass"] == 0.09
    # The simulator has the true mass already, and nothing pulls.
    assert record["verdicts"][0]["kind"] == "no_gap"
    assert "NO GAP" in done.stdout and "my arm" in (tmp_path / "gap" / "report.html").read_text()


def broken(text, old, new, count=1):
    assert old in text
    return text.replace(old, new, count)


BAD = {
    "empty": lambda text: "",
    "no header": lambda text: text.split("\n", 1)[1],
    "text in a number": lambda text: re.sub(r"\n0\.5,", "\n0.5,abc", text),
    "missing column": lambda text: broken(text, "voltage", "current"),
    "NaN everywhere": lambda text: re.sub(r"\n([\d.]+),[^,\n]*,[^,\n]*,", r"\n\1,nan,nan,", text),
    "two rows": lambda text: "\n".join(text.split("\n")[:3]) + "\n",
    "backwards": lambda text: re.sub(r"\n1,", "\n-7,", text),
    "constant action": lambda text: re.sub(r",[^,\n]*\n(?=\d)", ",1.0\n", text),
}


@pytest.mark.parametrize("fault", BAD)
def test_a_bad_log_gets_one_line_and_leaves_nothing(fault, logs, tmp_path, capsys):
    path = tmp_path / "bad.csv"
    with open(logs[0]) as file:
        text = file.read()
    head, rest = text.split("\n", 1)
    path.write_text(BAD[fault](head + "\n" + rest))
    with pytest.raises(SystemExit) as stopped:
        main(["--simulator", EQUATION, "--logs", str(path), "--output", str(tmp_path / "out")])
    assert stopped.value.code == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 1 and said[0].startswith("error: ") and "bad.csv" in said[0]
    assert [p.name for p in tmp_path.iterdir()] == ["bad.csv"]


def test_a_log_in_degrees_is_refused(logs, tmp_path, capsys):
    table = np.loadtxt(logs[0], delimiter=",", skiprows=1)
    table[:, 1] *= 57.2958
    np.savetxt(tmp_path / "deg.csv", table, delimiter=",", header="time,angle,rate,voltage",
               comments="")  # fmt: skip
    with pytest.raises(SystemExit) as stopped:
        main(["--simulator", EQUATION, "--logs", str(tmp_path / "deg.csv"), "--output",
              str(tmp_path / "out")])  # fmt: skip
    assert stopped.value.code == 2 and "deg" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        (["--simulator", "sims.pendulum.Nothing"], "Nothing"),
        (["--simulator", "absent.yaml"], "absent.yaml"),
        (["--simulator", EQUATION, "--effects", "frcition"], "frcition"),
        (["--simulator", EQUATION, "--hold", "cubic"], "hold"),
        (["--simulator", EQUATION, "--tolerance", "-1"], "tolerance"),
        (["--simulator", EQUATION, "--columns.tme", "t"], "tme"),
        (["--simulator", EQUATION, "--columns", "absent.yaml"], "absent.yaml"),
        (["--simulator", EQUATION, "--output", __file__], "expected a folder"),
        ([], "simulator"),
    ],
)
def test_a_wrong_argument_gets_one_line(arguments, names, logs, tmp_path, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["--logs", *logs[:1], "--output", str(tmp_path / "out"), *arguments])
    assert stopped.value.code == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 1 and names in said[0]
    assert not list(tmp_path.iterdir())


def test_a_simulator_that_hosts_nothing_is_told_what_to_derive_from(
    logs, tmp_path, capsys, monkeypatch
):
    (tmp_path / "plain_arm.py").write_text(
        "from sims.simulator import Simulator\n"
        "class Arm(Simulator):\n"
        "    def step(self, states, actions):\n"
        "        return states\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(SystemExit) as stopped:
        main(["--simulator", "plain_arm.Arm", "--logs", logs[0], "--output", str(tmp_path / "o")])
    assert stopped.value.code == 2 and "EquationOfMotion" in capsys.readouterr().err
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize(
    ("value", "half", "text"),
    [(0.0349736, 2.7e-5, "0.034974"), (14.23, 0.4, "14.23"), (6.2181, 0.0061, "6.2181"),
     (1234.5, 60, "1234"), (0.0, 1.0, "0")],
)  # fmt: skip
def test_numbers_show_two_digits_of_their_uncertainty(value, half, text):
    assert rounded(value, half) == text


def test_an_interval_is_written_with_its_unit():
    assert number_text(Number(-0.5, -0.6, -0.4, "1")) == "−0.50 (−0.60 to −0.40)"
    assert number_text(Number(2.0, 1.9, 2.1, "kg"), sign=True) == "+2.00 kg (1.90 to 2.10)"
