"""Whole runs: edited code is run anew, damage is healed, and the same run gives the same bytes."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import quick_gap

from policy import Algorithm, DDPGConfig
from residual import Linear
from studies.learning.budget import Budget
from studies.learning.kept import OnDisk
from studies.learning.loop import run_loop
from studies.learning.steps import Steps
from studies.running.progress import Silent

ROOT = Path(__file__).parents[2]
ESTIMATOR = """
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.linear_model import Ridge


class Mine(RegressorMixin, BaseEstimator):
    def fit(self, X, y):
        self.ridge_ = Ridge(1e-6).fit(X, y)
        return self

    def predict(self, X):
        return FACTOR * self.ridge_.predict(X)


FACTOR = 1.0
"""
TINY = [
    "--estimator", "mine.Mine", "--budget.true_samples", "40", "--budget.iterations", "1",
    "--budget.idealised_steps", "300", "--budget.difference_steps", "300",
    "--ddpg.hidden", "[16, 16]", "--ddpg.warm_up", "100",
]  # fmt: skip


def run(folder, output):
    places = os.pathsep.join(map(str, (ROOT, ROOT / "tests" / "studies", folder)))
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": places}
    command = [sys.executable, quick_gap.__file__, *TINY, "--output", output]
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads((folder / output / "results.json").read_text())


def kept(folder, output):
    """Finished steps by name and when they were written."""
    steps = (folder / output / "stages").glob("*-*/step.json")
    return {path.parent.name: path.stat().st_mtime_ns for path in steps}


def bytes_of(folder, output):
    files = sorted((folder / output / "policies").iterdir())
    return {path.name: path.read_bytes() for path in files}


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    """A folder with an estimator of one's own, and a run with it in a process of its own."""
    folder = tmp_path_factory.mktemp("first")
    (folder / "mine.py").write_text(ESTIMATOR)
    return folder, run(folder, "run")


@pytest.fixture
def here(first, monkeypatch):
    monkeypatch.syspath_prepend(first[0])
    monkeypatch.chdir(first[0])
    return first[0]


def test_the_same_run_computes_nothing_anew(first, here):
    before = kept(here, "run")
    quick_gap.main([*TINY, "--output", "run"])
    assert (
        json.loads((here / "run" / "results.json").read_text())["accuracy"]
        == (first[1]["accuracy"])
    )
    assert kept(here, "run") == before


def test_two_runs_give_the_same_policy_files_byte_by_byte(here):
    quick_gap.main([*TINY, "--output", "two"])
    one, two = (bytes_of(here, output) for output in ("run", "two"))
    assert one == two and len(one) == 2


def test_an_edited_estimator_is_fitted_and_trained_with_again(first, tmp_path):
    shutil.copytree(first[0] / "run", tmp_path / "run")
    before, policies = kept(tmp_path, "run"), bytes_of(tmp_path, "run")
    (tmp_path / "mine.py").write_text(ESTIMATOR.replace("FACTOR = 1.0", "FACTOR = 0.5"))
    second = run(tmp_path, "run")
    added = {name.split("-")[0] for name in kept(tmp_path, "run").keys() - before.keys()}
    assert added == {"fit", "difference", "test", "measure"}
    error = [r["accuracy"][0]["visited"]["one_step"]["rate"] for r in (first[1], second)]
    assert error[1] > error[0] + 0.2
    after = bytes_of(tmp_path, "run")
    assert after["idealised.safetensors"] == policies["idealised.safetensors"]
    assert after["difference-1.safetensors"] != policies["difference-1.safetensors"]


def learn(root, rule):
    budget = Budget(40, 1, 300, 200, 200, 0, 200)
    algorithm = Algorithm(ddpg=DDPGConfig((8, 8), warm_up=100))
    system = quick_gap.system_of(None)
    return run_loop(Steps(system, Linear(), algorithm, 0, OnDisk(root), Silent(), rule), budget)


def comparable(learnt):
    records = [*learnt.policies, *learnt.accuracy]
    return json.dumps([{k: v for k, v in r.items() if "seconds" not in k} for r in records])


@pytest.mark.parametrize("rule", ["first", pytest.param("all", marks=pytest.mark.long)])
def test_a_flipped_byte_in_any_kept_file_is_healed(tmp_path, caplog, rule):
    whole = comparable(learn(tmp_path, rule))
    kinds = {}
    for path in sorted(tmp_path.glob("*-*/*")):
        kinds.setdefault((path.parent.name.split("-")[0], path.name), path)
    names = {name for _, name in kinds}
    assert names == {
        "step.json", "agent.safetensors", "curve.json", "summary.json", "rollout.npz",
        "simulated.npz", "transitions.npz", "fit.json", "difference.safetensors", "accuracy.json",
        "tests.json",
    }  # fmt: skip
    rng = np.random.default_rng(0)
    for path in kinds.values():
        content = bytearray(path.read_bytes())
        content[rng.integers(len(content))] ^= 1 << int(rng.integers(8))
        path.write_bytes(content)
        caplog.clear()
        assert comparable(learn(tmp_path, rule)) == whole
        assert path.parent.name in caplog.text and "damaged" in caplog.text
        assert path.read_bytes() != bytes(content)
