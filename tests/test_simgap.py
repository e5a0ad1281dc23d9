"""The one import and the one command, also beside foreign packages of the same names."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import simgap
from policy import OrnsteinUhlenbeck, rollout

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
        _ = simgap.Nothing


def test_the_import_alone_is_light(tmp_path):
    code = "import simgap, sys; simgap.System; print(any(m in sys.modules for m in ('torch',)))"
    assert run(["-c", code], tmp_path).stdout.strip() == "False"


def test_a_wrong_word_waits_for_no_pictures_and_no_networks(tmp_path):
    code = (
        "import importlib, sys; slow = {'torch', 'matplotlib', 'jinja2'}\n"
        "for name in ('find_gap', 'learn', 'make_log', 'log_info'):\n"
        "    importlib.import_module(f'studies.{name}')\n"
        "    assert not slow & set(sys.modules), name"
    )
    done = run(["-c", code], tmp_path)
    assert not done.stderr


#: Of which the studies' own tests and those of the tutorials start processes.
STARTED = ("learn", "find-gap", "make-log")


@pytest.mark.parametrize("command", simgap.COMMANDS)
def test_every_command_tells_its_options(command, tmp_path, monkeypatch, capsys):
    if command in STARTED:
        monkeypatch.setattr(sys, "argv", ["simgap"])
        monkeypatch.setattr(sys, "path", [*sys.path])
        with pytest.raises(SystemExit, match="0"):
            simgap.main([command, "--help"])
        said = capsys.readouterr().out
    else:
        done = run(["-m", "simgap", command, "--help"], tmp_path)
        assert done.returncode == 0
        said = done.stdout
    assert f"usage: simgap {command} " in said


@pytest.mark.parametrize("command", [["simgap", "learn"], ["studies.learn"]], ids=" ".join)
def test_an_interrupt_while_a_command_loads_is_one_line(tmp_path, command):
    (tmp_path / "sklearn.py").write_text("raise KeyboardInterrupt\n")
    done = run(["-m", *command, "--help"], tmp_path)
    assert done.returncode == -signal.SIGINT  # what shells tell as 130
    assert done.stderr == "\nstopped; nothing had begun\n"


def test_what_a_notebook_shows_is_short():
    rng = np.random.default_rng(0)
    states, actions = rng.uniform(-3, 3, (300, 2)), rng.uniform(-3, 3, (300, 1))
    pendulum, leo = simgap.Pendulum(), simgap.Leo()
    after = simgap.Pendulum.true().step(states, actions)
    rows = simgap.Transitions(states, actions, after, np.zeros(300, int))
    difference = simgap.DifferenceModel(simgap.Linear(), pendulum).fit(rows)
    corrected = simgap.CorrectedSimulator(pendulum, difference)
    env = simgap.SimulatorEnv(pendulum, simgap.SwingUp(horizon=20))
    agent = simgap.DDPG.for_env(env)
    run = rollout(agent.policy, env, 0)

    class Hold(simgap.Task):
        horizon = 20
        start = reward = None

    trajectory = simgap.Trajectory("run 1", np.arange(4.0), np.zeros((4, 2)), np.zeros((3, 1)))
    system = simgap.System("pendulum", pendulum, simgap.Pendulum.true(), simgap.SwingUp())
    accuracy = simgap.accuracy_along(corrected, run.states[None], run.actions[None])
    shown = [
        pendulum, leo, rows, difference, corrected, agent, agent.policy, run, trajectory, system,
        accuracy, simgap.Algorithm(), simgap.Budget(), simgap.EvaluationProtocol(),
        simgap.Linear(), simgap.SwingUp(), env, simgap.check_simulator(pendulum),
        pendulum.state_channels[0], simgap.GaussianProcess(), simgap.DropoutNet(),
        simgap.Ensemble(), simgap.NamedEffects(), Hold(), OrnsteinUhlenbeck(1),
    ]  # fmt: skip
    for thing in shown:
        text = repr(thing)
        assert text.startswith(type(thing).__name__)
        assert "\n" not in text and len(text) <= 200, text


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
