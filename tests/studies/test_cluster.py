"""A grid on a local Dask cluster: the same results, and no finished trial is lost."""

import json
import os
import signal
import subprocess
import sys
import threading
import time

import pytest
import quick_gap
from distributed import Client, LocalCluster
from safetensors.numpy import load_file

# budgets.yaml with tiny steps, budgets and networks.
GRID = """
budget: {iterations: 1, idealised_steps: 300, difference_steps: 250}
ddpg: {hidden: [16, 16], warm_up: 200}
grid:
- seed: [0, 1]
  budget.true_samples: [40]
  estimator:
  - {class_path: residual.Linear}
  - {class_path: residual.DropoutNet, init_args: {hidden: [16], epochs: 2}}
"""
TRIALS = 4


def arguments(folder, *more):
    config = folder / "grid.yaml"
    config.write_text(GRID)
    return ["--config", str(config), "--output", str(folder / "out"), *more]


def finished(folder):
    """What finished trials left, by file name; writing one anew changes its time."""
    paths = (folder / "out").glob("*-seed*/results.json")
    return {path: path.stat().st_mtime_ns for path in paths}


def numbers(folder):
    """All that a trial computed but the clock, bit for bit."""

    def timeless(value):
        if isinstance(value, dict):
            return {k: timeless(v) for k, v in value.items() if "seconds" not in k}
        return [timeless(item) for item in value] if isinstance(value, list) else value

    trials = {path.parent.name: path.parent for path in finished(folder)}

    def results(trial):
        found = json.loads((trial / "results.json").read_text())
        for name in ("checksum", "versions", "made_by"):  # of the clock and the commit
            del found[name]
        return timeless(found)

    assert len(trials) == TRIALS
    return {
        name: (
            results(trial),
            {str(path.relative_to(trial)): tensors(path) for path in trial.rglob("*.safetensors")},
        )
        for name, trial in trials.items()
    }


def tensors(path):
    # Not the file's bytes: its header lists what it holds in any order.
    return {name: tensor.tobytes() for name, tensor in load_file(path).items()}


def differing(folder, alone):
    """What came out otherwise than alone: the results of a trial, or an array of a file."""
    found, sides = [], (numbers(folder), alone)
    for name in set().union(*sides):
        (results, files), (expected, others) = (side.get(name, ({}, {})) for side in sides)
        if results != expected:
            found.append((name, "results.json"))
        for path in {*files, *others}:
            arrays, wanted = files.get(path, {}), others.get(path, {})
            keys = {*arrays, *wanted}
            found += [(name, path, key) for key in keys if arrays.get(key) != wanted.get(key)]
    return found


def wait_for_some(folder, least=2, seconds=60):
    end = time.monotonic() + seconds
    while len(finished(folder)) < least:
        assert time.monotonic() < end, "no trial has finished"
        time.sleep(0.02)
    return finished(folder)


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """The grid in one process."""
    folder = tmp_path_factory.mktemp("alone")
    quick_gap.main(arguments(folder))
    return numbers(folder)


@pytest.fixture(scope="module")
def cluster():
    with LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
    ) as cluster:
        yield cluster


def on(cluster):
    return ["--backend", "dask", "--scheduler", cluster.scheduler_address]


@pytest.mark.long
def test_a_killed_worker_loses_no_finished_trial(alone, cluster, tmp_path):
    kept = {}

    def kill_one():
        kept.update(wait_for_some(tmp_path))
        with Client(cluster.scheduler_address) as client:
            processes = client.run(os.getpid)
        os.kill(next(iter(processes.values())), signal.SIGKILL)

    killer = threading.Thread(target=kill_one)
    killer.start()
    quick_gap.main(arguments(tmp_path, *on(cluster)))
    killer.join()
    assert 2 <= len(kept) < TRIALS
    assert kept.items() <= finished(tmp_path).items()
    assert not differing(tmp_path, alone)


@pytest.mark.long  # tests/fuzz/soak.py does the same many times
def test_a_killed_command_continues_with_what_is_missing(alone, cluster, tmp_path):
    command = [sys.executable, quick_gap.__file__, *arguments(tmp_path, *on(cluster))]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    wait_for_some(tmp_path)
    process.send_signal(signal.SIGKILL)
    process.wait()
    kept = finished(tmp_path)
    quick_gap.main(arguments(tmp_path, *on(cluster)))
    assert kept.items() <= finished(tmp_path).items()
    assert not differing(tmp_path, alone)
