"""Many trials: nothing finished is lost or computed again, and failures stay visible."""

import functools
import os
import signal
from pathlib import Path

import pytest

from simgap_files.atomic import read_json
from studies.running.progress import Silent
from studies.running.trials import (
    Execution,
    attempt_trial,
    read_trials,
    run_trials,
    spread_seeds,
    trial_folder,
)
from studies.running.watching import running
from studies.running.workers import WorkersError, workers


def square(config, folder, progress):
    """Counts how often it is computed; fails or dies as the configuration says."""
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / "attempts", "a") as file:
        file.write("x")
    if config.get("fails"):
        raise RuntimeError("deliberate")
    if len((folder / "attempts").read_text()) <= config.get("deaths", 0):
        os.kill(os.getpid(), signal.SIGKILL)
    with progress.task("square", 1) as tell:
        tell(1, "")
    return {"square": config["x"] ** 2, "config": config}


def run(root, configs, jobs=1):
    trials = {trial_folder(root, f"x{config['x']}", config): config for config in configs}
    return run_trials("squares", trials, square, Execution(jobs=jobs))


def attempts(root, x):
    (path,) = root.glob(f"x{x}-*/attempts")
    return len(path.read_text())


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_come_in_the_order_asked_for(tmp_path, jobs):
    results, failures = run(tmp_path, [{"x": x} for x in (3, 1, 2)], jobs)
    assert [result["square"] for result in results] == [9, 1, 4] and not failures


def test_finished_trials_are_read_and_new_ones_added(tmp_path):
    run(tmp_path, [{"x": 1}, {"x": 2}])
    results, _ = run(tmp_path, [{"x": 1}, {"x": 2}, {"x": 3}])
    assert [result["square"] for result in results] == [1, 4, 9]
    assert [attempts(tmp_path, x) for x in (1, 2, 3)] == [1, 1, 1]


def test_another_configuration_never_meets_old_results(tmp_path):
    run(tmp_path, [{"x": 1}, {"x": 2}])
    results, _ = run(tmp_path, [{"x": 2, "note": "changed"}])
    assert [result["config"] for result in results] == [{"x": 2, "note": "changed"}]
    assert read_trials(tmp_path) == (results, {})


def test_a_failed_trial_is_kept_apart_and_tried_again(tmp_path):
    results, failures = run(tmp_path, [{"x": 1}, {"x": 2, "fails": True}])
    assert [result["square"] for result in results] == [1]
    ((folder, text),) = failures.items()
    assert folder.name.startswith("x2-") and "RuntimeError: deliberate" in text
    assert read_trials(tmp_path) == (results, failures)
    run(tmp_path, [{"x": 1}, {"x": 2, "fails": True}])
    assert attempts(tmp_path, 1) == 1 and attempts(tmp_path, 2) == 2


def test_a_trial_whose_process_was_killed_is_run_again(tmp_path):
    configs = [{"x": 0}, {"x": 1, "deaths": 1}, {"x": 2}, {"x": 3}]
    results, failures = run(tmp_path, configs, jobs=2)
    assert [result["square"] for result in results] == [0, 1, 4, 9] and not failures
    assert attempts(tmp_path, 1) == 2
    assert not running([path.parent for path in tmp_path.glob("*/results.json")])


def test_a_trial_that_kills_its_process_again_and_again_is_given_up(tmp_path):
    configs = [{"x": 0}, {"x": 1, "deaths": 99}, {"x": 2}]
    results, failures = run(tmp_path, configs, jobs=2)
    assert [result["square"] for result in results] == [0, 4]
    ((folder, text),) = failures.items()
    assert folder.name.startswith("x1-") and "killed 3 times" in text
    assert (folder / "error.txt").read_text() == text


def test_a_finished_trial_is_not_computed_again_by_a_worker(tmp_path):
    attempt = functools.partial(attempt_trial, square, None, {"x": 1}, tmp_path / "one")
    assert attempt() is None and attempt() is None
    assert (tmp_path / "one" / "attempts").read_text() == "x"


def test_an_exit_fails_the_trial_and_not_the_worker(tmp_path):
    def leave(config, folder, progress):
        raise SystemExit(2)

    assert "SystemExit" in attempt_trial(leave, None, {}, tmp_path)
    assert (tmp_path / "error.txt").exists() and not running([tmp_path])


def test_trials_of_one_seed_start_apart():
    trials = {Path(f"{seed}{k}"): {"seed": seed} for seed in (0, 1) for k in "abc"}
    order = [str(path) for path in spread_seeds(trials)]
    assert order == ["0a", "1a", "0b", "1b", "0c", "1c"]


def test_the_plan_names_the_study(tmp_path):
    run(tmp_path, [{"x": 1}])
    plan = read_json(tmp_path / "study.json")
    assert plan["study"] == "squares" and list(plan["trials"].values()) == [{"x": 1}]


@pytest.mark.parametrize(
    ("backend", "address", "message"),
    [
        ("dask", None, "--scheduler"),
        ("dask", "tcp://127.0.0.1:1", "no Dask scheduler at tcp://127.0.0.1:1"),
        ("ray", "127.0.0.1:1", "no Ray cluster at 127.0.0.1:1|needs the package ray"),
        ("ray", "ray://127.0.0.1:1", "no Ray cluster at ray://127.0.0.1:1|needs the package ray"),
        ("ray", "nowhere", "no Ray cluster at nowhere|needs the package ray"),
    ],
)
def test_a_cluster_that_is_not_there_is_named(monkeypatch, backend, address, message):
    monkeypatch.setattr("studies.running.workers.CONNECT_SECONDS", 0.5)
    with pytest.raises(WorkersError, match=f"(?i){message}"), workers(backend, 1, address):
        pass


def test_silence_takes_anything():
    with Silent().task("a", 1) as tell:
        tell(1, "note", {"return": 1.0})
