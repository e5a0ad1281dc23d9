"""Wrong arguments and unusable logs: one line, exit code 2, nothing written."""

import re

import numpy as np
import pytest

from studies.find_gap import build_parser, main
from studies.make_log import write_logs

EQUATION = "sims.pendulum_equation.PendulumEquation"


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    return [str(path) for path in write_logs(tmp_path_factory.mktemp("logs"), runs=1, steps=100)]


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
        (["--simulator", EQUATION, "--hold", "{torque: linear}"], "torque"),
        (["--simulator", EQUATION, "--minutes", "0"], "minutes"),
        (["--simulator", EQUATION, "--held-out", "absent.csv"], "absent.csv"),
        (["--simulator", EQUATION, "--seed", "1"], "seed"),
        (["--simulator", EQUATION, "--tolerance", "-1"], "tolerance"),
        (["--simulator", EQUATION, "--parameter_tolerance", "3"], "a share from 0 to 1"),
        (["--simulator", EQUATION, "--columns.tme", "t"], "tme"),
        (["--simulator", EQUATION, "--columns", "absent.yaml"], "absent.yaml"),
        (["--simulator", EQUATION, "--output", __file__], "expected a folder"),
        (["--simulator", EQUATION, "--output", f"{__file__}/gap"], "expected a folder"),
        (["--simulator", EQUATION, "--output", "/proc/gap"], "cannot be written"),
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
    ("settings", "says"),
    [
        ("time: {column: time, units: ms}", "time: no setting 'units', did you mean 'unit'?"),
        ("states: {angle: {unti: deg}}", "states: angle: no setting 'unti', did you mean 'unit'?"),
        ("stats: {angle: {unit: deg}}", "no setting 'stats', did you mean 'states'?"),
    ],
)
def test_a_misspelt_setting_of_a_column_map_is_named_with_file_and_place(
    settings, says, logs, tmp_path, capsys
):
    path = tmp_path / "columns.yaml"
    path.write_text(settings)
    (tmp_path / "all.yaml").write_text(f"columns: {{{settings}}}")
    for option, file, place in (("columns", path, ""), ("config", tmp_path / "all.yaml", None)):
        with pytest.raises(SystemExit) as stopped:
            main(["--simulator", EQUATION, "--logs", *logs, f"--{option}", str(file), "--output",
                  str(tmp_path / "out")])  # fmt: skip
        said = capsys.readouterr().err
        assert stopped.value.code == 2 and says.split(": no")[-1] in said
        assert place is None or f"error: {file}: {says}" in said


def test_an_effect_at_a_misspelt_place_is_told_the_right_one(logs, tmp_path, capsys):
    with pytest.raises(SystemExit):
        main(["--simulator", EQUATION, "--logs", *logs, "--effects", "delay@volts", "--output",
              str(tmp_path / "out")])  # fmt: skip
    assert "did you mean 'delay@voltage'?" in capsys.readouterr().err


def test_a_file_is_used_or_set_aside_but_not_both(logs, tmp_path, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["--simulator", EQUATION, "--output", str(tmp_path / "o"), "--logs", *logs,
              "--held-out", *logs])  # fmt: skip
    assert stopped.value.code == 2 and "run-01.csv is in --logs" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_one_log_of_a_config_needs_no_list(tmp_path, capsys):
    config = tmp_path / "mine.yaml"
    config.write_text("simulator: sims.pendulum.Pendulum\nlogs: nowhere.csv\n")
    with pytest.raises(SystemExit) as end:
        main(["--config", str(config), "--output", str(tmp_path / "out")])
    assert end.value.code == 2
    assert "nowhere.csv" in capsys.readouterr().err


@pytest.mark.parametrize("joint", ["-", "_"])
def test_an_option_may_be_spelt_with_either_joint(joint):
    words = (f"--held{joint}out", "a.csv", "b.csv", f"--parameter{joint}tolerance=0.1")
    given = build_parser().parse_args(
        ["--simulator", "sims.Pendulum", "--logs", "c.csv", "--output", "gap", *words]
    )
    assert given.held_out == ["a.csv", "b.csv"] and given.parameter_tolerance == 0.1


@pytest.mark.parametrize(
    ("holds", "says"),
    [
        ("states: {angle: {offset: 90 deg}}", "states: angle: offset: '90 deg', expected a number"),
        ("actions: {voltage: {scale: minus one}}", "scale: 'minus one', expected a number"),
        ("minimum_samples: many", "minimum_samples: 'many', expected a whole number"),
        ("[time, angle]", "expected names with values, as in `time: t`, not ['time', 'angle']"),
    ],
)
def test_a_column_map_of_the_wrong_kind_is_told_with_file_and_key(
    holds, says, logs, tmp_path, capsys
):
    path = tmp_path / "columns.yaml"
    path.write_text(holds)
    with pytest.raises(SystemExit, match="2"):
        main(["--simulator", EQUATION, "--logs", *logs, "--columns", str(path)])
    (said,) = capsys.readouterr().err.strip().splitlines()
    assert said.startswith(f"error: {path}: ") and says in said


def test_a_column_map_may_say_numbers_as_yaml_does_not(logs, tmp_path):
    path = tmp_path / "columns.yaml"
    path.write_text("states: {angle: {offset: 1e-3, scale: -1}}\nperiod: null\n")
    given = ["--simulator", EQUATION, "--logs", *logs, "--columns", str(path), "--output", "out"]
    assert build_parser().parse_args(given).columns.states["angle"].offset == 0.001
