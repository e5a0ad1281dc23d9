"""The study through its command line, as its user runs it."""

import contextlib
import io
import json
import os
import random
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import quick_gap
from safetensors import safe_open

from studies import pendulum_gap

TINY = [
    "--estimator", "residual.Linear",
    "--budget.true_samples", "60",
    "--budget.iterations", "1",
    "--budget.idealised_steps", "300",
    "--budget.difference_steps", "250",
    "--ddpg.hidden", "[32, 32]",
    "--ddpg.warm_up", "100",
]  # fmt: skip


def start(arguments, cwd, program):
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    return subprocess.Popen(
        [sys.executable, program, *arguments],
        cwd=cwd,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def results(folder):
    """What must not change between runs: everything but the clock and the commit."""

    def timeless(value):
        if isinstance(value, dict):
            return {
                k: timeless(v) for k, v in value.items() if "seconds" not in k and k != "checksum"
            }
        return [timeless(item) for item in value] if isinstance(value, list) else value

    found = timeless(json.loads((folder / "results.json").read_text()))
    return {name: value for name, value in found.items() if name not in ("versions", "made_by")}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed")
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        pendulum_gap.main([*TINY, "--output", str(folder / "run")])
    return folder / "run", out.getvalue()


def test_the_results_are_complete(undisturbed):
    folder, out = undisturbed
    found = json.loads((folder / "results.json").read_text())
    assert found["system"] == "pendulum" and found["seed"] == 0
    assert [policy["name"] for policy in found["policies"]] == ["idealised", "difference"]
    for policy in found["policies"]:
        assert set(policy) >= {
            "name", "iteration", "true_samples", "simulated_steps", "return_true",
            "return_model", "seconds",
        }  # fmt: skip
    (accuracy,) = found["accuracy"]
    assert accuracy["true_samples"] == 60 and accuracy["fit_seconds"] > 0
    for where in ("visited", "uniform"):
        assert set(accuracy[where]["one_step"]) == {"angle", "rate"}
        assert set(accuracy[where]["multi_step"]) == {"0.25 s", "1 s"}
        assert 0 <= accuracy[where]["coverage90"] <= 1
    assert found["versions"]["torch"] and found["config"]["budget"]["iterations"] == 1
    assert "Linear, update 1" in out


def test_the_folder_holds_all_that_was_made(undisturbed):
    folder, _ = undisturbed
    made = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}
    assert made >= {
        "results.json", "report.html", "config.yaml", "figures/trajectories.png",
        "figures/trajectories.csv", "figures/updates.png", "policies/idealised.safetensors",
        "policies/difference-1.safetensors", "models/difference-1.safetensors",
    }  # fmt: skip
    page = (folder / "report.html").read_text()
    assert "<img" in page or "<svg" in page
    assert "http://" not in page.replace("http://www.w3.org", "") and 'src="/' not in page


def test_saved_policies_and_models_can_be_used(undisturbed):
    import gymnasium

    from policy.ddpg import DDPG

    folder, _ = undisturbed
    found = json.loads((folder / "results.json").read_text())
    agent = DDPG.load(folder / "policies" / "difference-1.safetensors")
    env = gymnasium.make(
        "residual:simgap/PendulumCorrected-v0",
        difference=folder / "models" / "difference-1.safetensors",
    )
    observation, _ = env.reset(seed=0)
    total, done = 0.0, False
    while not done:
        observation, reward, _, done, _ = env.step(agent.act(observation))
        total += float(reward)
    assert total == pytest.approx(found["policies"][1]["return_model"], rel=1e-9)


def test_no_file_is_a_pickle(undisturbed):
    folder, _ = undisturbed
    for path in folder.rglob("*.safetensors"):
        with safe_open(path, "np") as file:
            assert list(file.keys())
    for path in folder.rglob("*.npz"):
        with np.load(path, allow_pickle=False) as data:
            assert all(data[name].dtype != object for name in data)


@pytest.mark.long  # tests/fuzz/soak.py does the same many times
def test_a_study_killed_again_and_again_ends_with_the_same_results(tmp_path):
    random.seed(os.getpid())
    command = [*TINY, "--output", str(tmp_path / "run")]
    for _ in range(2):
        process = start(command, tmp_path, quick_gap.__file__)
        while not (tmp_path / "run" / "stages").exists():
            assert process.poll() is None
            time.sleep(0.02)
        time.sleep(random.uniform(0, 3))
        process.send_signal(signal.SIGKILL)
        process.communicate()
        for path in tmp_path.rglob("results.json"):
            json.loads(path.read_text())
    quick_gap.main(command)
    quick_gap.main([*TINY, "--output", str(tmp_path / "undisturbed")])
    assert results(tmp_path / "run") == results(tmp_path / "undisturbed")


@pytest.mark.long
def test_an_estimator_of_ones_own_needs_no_registration(tmp_path, monkeypatch):
    (tmp_path / "my_nearest.py").write_text(
        "import numpy as np\n"
        "from sklearn.base import BaseEstimator, RegressorMixin\n\n"
        "class Nearest(RegressorMixin, BaseEstimator):\n"
        "    def __init__(self, scale: float = 1.0):\n"
        "        self.scale = scale\n"
        "    def fit(self, X, y):\n"
        "        self.X_, self.y_ = X, y\n"
        "        return self\n"
        "    def predict(self, X):\n"
        "        distance = ((X[:, None] - self.X_) ** 2).sum(-1)\n"
        "        return self.scale * self.y_[distance.argmin(1)]\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    arguments = [*TINY, "--estimator", "my_nearest.Nearest", "--estimator.scale", "0.5"]
    quick_gap.main([*arguments, "--output", str(tmp_path / "run")])
    found = results(tmp_path / "run")
    assert found["estimator"] == "my_nearest.Nearest"
    assert found["config"]["estimator"]["init_args"] == {"scale": 0.5}
    assert found["accuracy"][0]["visited"]["coverage90"] is None


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        (["--estimator", "residual.NoSuch"], "NoSuch"),
        (["--estimator", "no_such_module.Thing"], "no_such_module"),
        (["--estimator.dropuot", "0.2"], "dropuot"),
        (["--estimator", "residual.Linear", "--estimator.degree", "many"], "degree"),
        (["--budget.true_samples", "-5"], "true_samples"),
        (["--ddpg.gamma", "1.5"], "gamma"),
        (["--seed", "x"], "seed"),
        (["--seed", "-1"], "seed is -1"),
        (["--learner", "stable_baselines3.SAC", "--ddpg.gamma", "0.5"], "learner_options"),
        (["--config", "absent.yaml"], "absent.yaml"),
        (["--nonsense"], "nonsense"),
    ],
)
def test_a_wrong_argument_gets_one_line_and_exit_code_2(arguments, names, tmp_path, capsys):
    with pytest.raises(SystemExit, match="2"):
        pendulum_gap.main([*arguments, "--output", str(tmp_path / "run")])
    err = capsys.readouterr().err
    assert len(err.strip().splitlines()) == 1 and names in err
    assert not (tmp_path / "run").exists()


@pytest.mark.long
def test_a_grid_runs_every_trial_and_reports_failed_ones(tmp_path, monkeypatch, capsys):
    (tmp_path / "grid.yaml").write_text(
        "budget: {iterations: 1, idealised_steps: 250, difference_steps: 250}\n"
        "ddpg: {hidden: [16, 16], warm_up: 200}\n"
        "estimator: {class_path: residual.Linear}\n"
        "grid:\n"
        "- seed: [0, 1]\n"
        "  budget.true_samples: [40]\n"
        "- estimator: [{class_path: my_broken.Broken}]\n"
    )
    (tmp_path / "my_broken.py").write_text(
        "from sklearn.base import BaseEstimator\n"
        "class Broken(BaseEstimator):\n"
        "    def fit(self, X, y):\n"
        "        raise RuntimeError('deliberate')\n"
        "    def predict(self, X):\n"
        "        return X\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    command = ["--config", str(tmp_path / "grid.yaml"), "--jobs", "2"]
    with pytest.raises(SystemExit, match="1"):
        quick_gap.main([*command, "--output", str(tmp_path / "out")])
    assert "deliberate" in capsys.readouterr().err
    rows = (tmp_path / "out" / "results.csv").read_text().splitlines()
    assert len(rows) == 1 + 2 * 2
    assert "1 trial failed" in (tmp_path / "out" / "report.html").read_text()
    assert "residual.Linear" in (tmp_path / "out" / "results.json").read_text()


def test_help_teaches(capsys):
    with pytest.raises(SystemExit, match="0"):
        pendulum_gap.main(["--help"])
    out = capsys.readouterr().out
    assert "python -m studies.pendulum_gap --estimator" in out and "true_samples" in out
