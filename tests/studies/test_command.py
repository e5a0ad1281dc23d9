"""Commands end in one way."""

import errno
import importlib
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest

from residual.gap.data.windows import Windows
from residual.logs.units import find_unit
from studies import find_gap, learn
from studies.learning.trial import build_parser
from studies.pendulum_gap import STUDY
from studies.running import ending
from studies.running.ending import (
    check_output,
    fail,
    guarded,
    on_purpose,
)


def ended(capsys, fault, arguments=(), **options):
    """Exit code and what was said of a command that raises."""

    @guarded(**options)
    def faulty(given):
        assert "--debug" not in given
        raise fault

    with pytest.raises(SystemExit) as stopped:
        faulty([*arguments])
    return stopped.value.code, capsys.readouterr().err


@pytest.mark.parametrize("rate", [["rate"], ["[rate]"]])
def test_words_in_a_row_after_an_option_that_takes_a_list(rate):
    parser = build_parser(STUDY)
    written = ["--measure.noise", "0.01", "0.2", "--ddpg.hidden", "64", "64", "--seed", "3",
               "--measure.unmeasured", *rate]  # fmt: skip
    plain = ["--measure.noise=[0.01, 0.2]", "--ddpg.hidden=[64, 64]", "--seed=3",
             "--measure.unmeasured=[rate]"]  # fmt: skip
    parsed, same = (parser.parse_args(arguments) for arguments in (written, plain))
    assert list(parsed.measure.noise) == [0.01, 0.2]
    assert parsed.as_dict() == same.as_dict()
    assert parsed.seed == 3


def test_a_stopped_command_says_how_to_go_on(capsys):
    code, said = ended(capsys, KeyboardInterrupt())
    assert code == 130 and said == "\nstopped; the same command goes on\n"
    assert "begins anew" in ended(capsys, KeyboardInterrupt(), resumes=False)[1]


def test_an_internal_fault_is_one_line_and_a_file(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(ending, "users_code", lambda error: "")
    code, said = ended(capsys, RuntimeError("deliberate"))
    (kept,) = tmp_path.iterdir()
    assert code == 1 and said.count("\n") == 1 and "deliberate" in said and str(kept) in said
    assert "Traceback" in kept.read_text() and "RuntimeError: deliberate" in kept.read_text()


def test_a_fault_of_the_users_code_is_one_line_that_says_where(capsys):
    code, said = ended(capsys, ZeroDivisionError("deliberate"))
    assert code == 2 and said.count("\n") == 1
    assert f"{__file__}, line" in said and "ZeroDivisionError: deliberate" in said


def users_own():
    raise ValueError("no such valve")


@pytest.mark.parametrize(
    ("act", "told"),
    [
        pytest.param(lambda: find_unit("furlongz", "m"), True, id="raised by ours"),
        pytest.param(lambda: Windows.cut([(0, 4)]), False, id="inside a line of ours"),
        pytest.param(lambda: np.linalg.inv(np.zeros((2, 2))), False, id="linear algebra"),
        pytest.param(lambda: np.zeros(3).reshape(2, 2), True, id="called by the user"),
        pytest.param(users_own, True, id="raised by the user"),
        pytest.param(lambda: Path("/no/such").read_text(), True, id="operating system"),
    ],
)
def test_what_was_raised_on_purpose_is_told_from_a_fault_of_ours(act, told):
    with pytest.raises((ValueError, OSError)) as caught:
        act()
    assert on_purpose(caught.value) is told


@pytest.mark.parametrize(
    ("act", "code"),
    [(lambda: find_unit("furlongz", "m"), 2), (lambda: Windows.cut([(0, 4)]), 1), (users_own, 2)],
)
def test_a_value_error_ends_every_command_as_what_it_is(act, code, capsys, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr("studies.log_info.describe", lambda path: act())
    with pytest.raises(SystemExit, match=str(code)):
        importlib.import_module("studies.log_info").main(["run.csv"])
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and ("internal fault" in said) == (code == 1)
    assert (f"{__file__}, line" in said) == (act is users_own)


@pytest.mark.parametrize("how", ["option", "variable"])
def test_debug_shows_where(how, capsys, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    if how == "variable":
        monkeypatch.setenv("SIMGAP_DEBUG", "1")
    given = ["--debug"] if how == "option" else []
    assert "Traceback" in ended(capsys, RuntimeError("deliberate"), given)[1]

    @guarded()
    def command(arguments):
        try:
            raise ValueError("deliberate")
        except ValueError as error:
            fail(str(error))

    with pytest.raises(SystemExit, match="2"):
        command(given)
    assert "Traceback" in capsys.readouterr().err


def test_a_full_disk_is_one_line(capsys, tmp_path, monkeypatch):
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "here.csv")
    assert ended(capsys, full) == (2, "error: [Errno 28] No space left on device: 'here.csv'\n")

    def fsync(handle):
        raise full

    monkeypatch.setattr(os, "fsync", fsync)
    with pytest.raises(SystemExit, match="2"):
        check_output(tmp_path / "new" / "folder")
    assert "cannot be written: No space left" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


COMMANDS = {
    "pendulum_gap": [],
    "leo_gap": [],
    "learn": ["--system", "studies.systems.pendulum.pendulum"],
    "make_log": [],
    "hidden_effects": [],
    "hidden.calibration": [],
}


@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.parametrize(
    ("output", "says"), [(__file__, "expected a folder"), ("/proc/x/y", "cannot be written")]
)
def test_output_is_checked_before_anything_is_computed(name, output, says, capsys):
    main = importlib.import_module(f"studies.{name}").main
    with pytest.raises(SystemExit, match="2"):
        main([*COMMANDS[name], "--output", output])
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "--output" in said and says in said


WRONG = {
    "bad.yaml": b"seed: 0\nsimulator: [", "latin.yaml": b"seed: 0 # \xe9",
    "bytes.yaml": b"\x00" * 9, "words.yaml": b"minutes: two",
    "gone.yaml": b"allow_constant_action: true",
}  # fmt: skip
SIMULATOR = ("--simulator", "sims.pendulum_equation.PendulumEquation")
SYSTEM = ("--system", "studies.systems.pendulum.SYSTEM")


@pytest.mark.parametrize(
    ("name", "arguments", "says"),
    [
        ("find_gap", ("--config", "none.yaml"), "--config none.yaml: there is no such file"),
        ("find_gap", ("--config", "bad.yaml"), "--config bad.yaml is no YAML: line 2, column 13: "),
        ("find_gap", ("--config", "latin.yaml"), "byte 0xe9 at 10 is not UTF-8; save it as UTF-8"),
        ("find_gap", ("--simulator", "bytes.yaml"), "bytes.yaml is no YAML: character 1: "),
        ("find_gap", ("--simulator=sims.None",), "--simulator: there is no class sims.None; expec"),
        ("find_gap", ("--simulator=sims.Pendulm",), "sims.Pendulm; did you mean sims.Pendulum?"),
        ("find_gap", ("--simulator", "gone.xml"), "--simulator: there is no file gone.xml"),
        ("find_gap", ("--simulator", "no_such.X"), "there is no module 'no_such' for no_such"),
        ("find_gap", ("--simulator", "arm.py:Arm"), "is no import path; write arm.Arm"),
        ("find_gap", ("--simulator", "sims.Pendulum()"), "expected the class alone: sims.Pe"),
        ("find_gap", ("--simulator", "sims"), "is a module, expected a class in it: sims.CLASS"),
        ("find_gap", ("--simulator", "."), "--simulator: . is a folder; expected MODULE.CLASS"),
        ("find_gap", ("--simulator", "sims.tasks.SwingUp"), "SwingUp is no Simulator, expec"),
        ("find_gap", (*SIMULATOR, "--columns", "."), "--columns . is a folder, expected a YAML"),
        ("find_gap", ("--simulator", "a/arm.py"), "write arm.CLASS and start Python in a/"),
        ("find_gap", (*SIMULATOR, "--columns", "none.yaml"), "--columns none.yaml: there is no"),
        ("find_gap", (*SIMULATOR, "--logs", "none.csv"), "none.csv: there is no such file"),
        ("learn", (*SYSTEM, "--corrected", "none.yaml"), "--corrected none.yaml: there is no"),
        ("learn", (*SYSTEM, "--estimator", "residual.No"), "--estimator: there is no class res"),
        ("learn", (*SYSTEM, "--estimator", "sklearn.cluster.KMeans"), "is no regressor (clus"),
        ("find_gap", (*SIMULATOR, "--parameter_tolerance", "-1"), "expected a share from 0 to 1"),
        ("learn", ("--system", "sims.simulator.wrap"), "cannot be called without argu"),
        ("learn", (*SYSTEM, "--backend", "dask"), "--backend dask runs the trials of a grid"),
        ("learn", (*SYSTEM, "--ddpg.hiden", "9"), "--ddpg.hiden 9; did you mean --ddpg.hidden?"),
        ("find_gap", (*SIMULATOR, "--minuts", "3"), "--minuts 3; did you mean --minutes?"),
        ("find_gap", (*SIMULATOR, "--horizon", "0"), "--horizon 0: expected a number above 0"),
        ("find_gap", (*SIMULATOR, "--columns.allow_constant_action", "true"), "; leave it out, an"),
        ("find_gap", (*SIMULATOR, "--columns", "gone.yaml"), "allow_constant_action': leave it o"),
        ("find_gap", ("--config", "words.yaml"), "words.yaml: minutes two: expected a number abov"),
        ("find_gap", (*SIMULATOR, "--jobs=two"), "--jobs two: expected a whole number, 1 or more"),
    ],
)  # fmt: skip
def test_what_is_not_there_is_named(name, arguments, says, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for file, content in WRONG.items():
        Path(file).write_bytes(content)
    with pytest.raises(SystemExit, match="2"):
        importlib.import_module(f"studies.{name}").main([*arguments, "--output", "out"])
    said = capsys.readouterr().err
    assert said.startswith("error: ") and said.count("\n") == 1
    assert says in said
    assert not Path("out").exists()


def test_a_system_file_that_is_no_python_is_the_users(tmp_path, monkeypatch, capsys):
    (tmp_path / "unclosed.py").write_text("from sims import System\n\nSYSTEM = System('x',\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(SystemExit, match="2"):
        learn.main(["--system", "unclosed.SYSTEM", "--output", str(tmp_path / "out")])
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and f"{tmp_path / 'unclosed.py'}, line 3" in said
    assert "never closed" in said and not (tmp_path / "out").exists()


def test_so_is_a_simulator_that_is_no_python(tmp_path, monkeypatch, capsys):
    (tmp_path / "commas.py").write_text("class Wheel:\n    def derivative(self,,, x, u, p):\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(SystemExit, match="2"):
        find_gap.main(["--simulator", "commas.Wheel", "--logs", "run.csv"])
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and f"{tmp_path / 'commas.py'}, line 2" in said


def test_a_reader_that_has_read_enough_is_no_error():
    code = """
from studies.running.ending import guarded

@guarded()
def main(arguments):
    for number in range(100_000):
        print(number)

main([])
"""
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stdout.readline() == b"0\n"
        process.stdout.close()
        assert process.stderr.read() == b""
    assert process.returncode == 141
