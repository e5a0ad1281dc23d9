"""The one import and the one command, also beside foreign packages of the same names."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import simgap

ROOT = Path(__file__).parents[1]


def run(arguments, folder):
    # An empty entry is the present folder, as for whoever starts Python there.
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": f"{os.pathsep}{ROOT}"}
    command = [sys.executable, *arguments]
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


def test_every_public_name_is_there():
    for name in simgap.__all__:
        assert getattr(simgap, name).__name__ == name
    with pytest.raises(AttributeError, match="no attribute 'Nothing'"):
        simgap.Nothing  # noqa: B018


def test_the_import_alone_is_light(tmp_path):
    code = "import simgap, sys; simgap.System; print(any(m in sys.modules for m in ('torch',)))"
    assert run(["-c", code], tmp_path).stdout.strip() == "False"


@pytest.mark.parametrize("command", simgap.COMMANDS)
def test_every_command_tells_its_options(command, tmp_path):
    done = run(["-m", "simgap", command, "--help"], tmp_path)
    assert done.returncode == 0 and "usage:" in done.stdout


def test_an_unknown_command_is_one_line(capsys):
    with pytest.raises(SystemExit) as stopped:
        simgap.main(["lern"])
    assert stopped.value.code == 2
    assert capsys.readouterr().err.count("\n") == 1
    simgap.main(["--help"])
    assert "find-gap" in capsys.readouterr().out


@pytest.mark.parametrize("start", [["-m", "studies.learn"], ["-m", "simgap", "learn"]])
def test_a_foreign_package_in_the_way_is_one_line(start, tmp_path):
    (tmp_path / "policy").mkdir()
    (tmp_path / "policy" / "__init__.py").write_text("")
    done = run([*start, "--help"], tmp_path)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1 and "policy" in done.stderr
