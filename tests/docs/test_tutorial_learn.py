"""The tutorial's systems run as they are written, with less training and shorter episodes."""

import json
import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scripts import blocks

import simgap
from policy import load_policy
from studies import find_gap, learn
from studies.learning.trial import build_parser, resolve
from studies.running.grids import expand_grid

ROOT = Path(__file__).parents[2]
TUTORIAL = ROOT / "docs" / "tutorial-learn.md"
LESS = [
    "--budget.idealised_steps", "300", "--budget.difference_steps", "250",
    "--budget.iterations", "1", "--budget.true_samples", "150",
]  # fmt: skip
SMALL_DDPG = ["--ddpg.hidden", "[32, 32]", "--ddpg.warm_up", "200"]


def run(command, folder):
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tutorial")
    for code in blocks(TUTORIAL, "python"):
        code = code.replace("horizon = 200", "horizon = 60")
        (folder / code.splitlines()[0].removeprefix("# ")).write_text(code)
    return folder


def learnt(folder, command, more, own_process=False):
    words = command.split()
    assert words[:3] == ["python", "-m", "studies.learn"]
    output = f"out{len(list(folder.glob('out*')))}"
    given = [*words[3:], *LESS, *more, "--output", output]
    if own_process:
        run([sys.executable, *words[1:3], *given], folder)
    else:
        learn.main(given)
    assert "Policies" in (folder / output / "report.html").read_text()
    return output, json.loads((folder / output / "results.json").read_text())


def test_the_file_is_short_and_the_command_learns(folder):
    assert len((folder / "cart_pole.py").read_text().splitlines()) <= 60
    command, more = blocks(TUTORIAL, "bash")[0], [*SMALL_DDPG, "--budget.true_samples", "200"]
    output, found = learnt(folder, command, more, own_process=True)
    assert [policy["name"] for policy in found["policies"]] == ["idealised", "difference"]
    errors = found["accuracy"][0]["visited"]["one_step"]
    assert max(errors.values()) < 0.2
    assert set(found["accuracy"][0]) >= {"visited", "uniform"}
    file = folder / output / "policies" / "difference-1.safetensors"
    printed = run([sys.executable, "use.py", str(file)], folder)
    assert "acts on cart (m), cart rate (m/s), pole (rad)" in printed
    # What the page says of this state, and what was done on the true system.
    policy = load_policy(file)
    acted = policy.act([0.3, -0.6, np.cos(3), np.sin(3), 0.1])
    np.testing.assert_array_equal(policy.act_on([0.3, -1.2, 3.0, 0.5]), acted)
    assert str(acted) in printed
    with np.load(folder / output / "rollouts" / "difference-1.npz") as episode:
        acted = [policy.act_on(state) for state in episode["states"][:-1]]
        np.testing.assert_array_equal(acted, episode["actions"])


@pytest.mark.long
def test_the_python_call_runs(here, capsys):
    from cart_pole import CartPole

    code = (here / "call.py").read_text()
    few = "from policy import DDPGConfig\n" + (
        code.replace("samples=450, updates=2", "samples=60, updates=1, steps=150, "
                     "ddpg=DDPGConfig((16, 16), warm_up=100)")
    )  # fmt: skip
    assert few != code
    (here / "few.py").write_text(few)
    runpy.run_path("few.py", run_name="__main__")
    assert "Learnt(system: return on the true system" in capsys.readouterr().out
    assert (here / "report.html").exists() and list((here / "kept").glob("difference-*"))
    # What was kept is found again, and the files that the page names are read.
    policy = load_policy(here / "policy.safetensors")
    np.testing.assert_array_equal(policy.act_on([0.3, -1.2, 3.0, 0.5]).shape, (1,))
    assert simgap.load(here / "model.safetensors", CartPole()).simulator.dt == 0.04
    asked = (here / "ask.py").read_text().replace("from call", "from few")
    assert asked.count("learnt.runs)") == 1
    few = 'learnt.runs, effects=["viscous_friction@cart"], minutes=0.05)'
    (here / "ask_few.py").write_text(asked.replace("learnt.runs)", few))
    runpy.run_path("ask_few.py", run_name="__main__")
    assert {"gap.json", "corrected.yaml"} <= {path.name for path in (here / "found").iterdir()}


def test_the_grid_is_as_many_trials_as_the_page_says(here):
    (code,) = blocks(TUTORIAL, "yaml")
    (here / "grid.yaml").write_text(code)
    parser = build_parser(learn.STUDY)
    settings = parser.plain(parser.parse_args(["--config", "grid.yaml"]))
    settings = {name: settings[name] for name in (*learn.STUDY.settings, "grid")}
    grid = settings.pop("grid")
    resolved = [resolve(learn.STUDY, trial) for trial in expand_grid(settings, grid)]
    first = expand_grid(settings, grid[:1])
    distinct = {json.dumps(trial, sort_keys=True) for trial in resolved}
    assert (len(first), len(resolved) - len(first), len(distinct)) == (12, 6, 15)
    assert "3 x 2 x 2 = 12 trials, the second 3 x 2 = 6" in TUTORIAL.read_text()


def test_the_table_of_a_grid_is_read(here):
    rows = "GaussianProcess,{},450,difference,1,450,{}\n"
    head = "estimator,seed,samples_per_update,name,iteration,true_samples,return_true\n"
    (here / "results.csv").write_text(head + rows.format(0, -50.0) + rows.format(1, -60.0))
    printed = run([sys.executable, "read.py", "results.csv"], here)
    assert re.search(r"GaussianProcess difference +1 +450 +-55\.0 +-60\.0 +2", printed)


@pytest.mark.parametrize("learner", ["ddpg", pytest.param("sac", marks=pytest.mark.long)])
def test_a_mujoco_environment_is_the_true_system(here, learner):
    pytest.importorskip("mujoco")
    pytest.importorskip("imageio")
    command = blocks(TUTORIAL, "bash")[1 if learner == "ddpg" else 3]
    small = "{policy_kwargs: {net_arch: [16, 16]}, learning_starts: 100}"
    more = SMALL_DDPG if learner == "ddpg" else ["--learner_options", small]
    output, found = learnt(here, command, more)
    _first, second = found["policies"]
    assert second["true_samples"] == 150 and second["updates"] > 0
    # The truth cannot be set to a state, so accuracy is where the policy goes and nowhere else.
    assert "uniform" not in found["accuracy"][0]
    assert max(found["accuracy"][0]["visited"]["one_step"].values()) < 0.5
    if learner == "ddpg":
        asked = blocks(TUTORIAL, "bash")[2].split()
        assert asked[:3] == ["python", "-m", "studies.find_gap"]
        logs = sorted(map(str, (here / output / "samples").glob("*.csv")))
        given = [word for word in asked[3:] if "samples" not in word]
        at = given.index("--logs") + 1
        find_gap.main([*given[:at], *logs, *given[at:], "--minutes", "0.05"])
        assert (here / "gap" / "corrected.yaml").exists()
