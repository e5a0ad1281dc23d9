"""Trials that run can be seen from outside, and their curves drawn."""

import pytest

from simgap_files.atomic import read_json
from studies.running.progress import Bars, Curves, Several
from studies.running.watching import StatusFile, TrialsView, running


def test_a_running_trial_says_where_it_is(tmp_path, monkeypatch):
    monkeypatch.setattr("studies.running.watching.WRITE_EVERY", 0.0)
    status = StatusFile(tmp_path / "one")
    with status.task("train", 200) as tell:
        tell(50, "return -3")
        ((folder, seen),) = running([tmp_path / "one", tmp_path / "waits"]).items()
    assert folder == tmp_path / "one"
    assert (seen["step"], seen["done"], seen["total"]) == ("train", 50, 200)
    assert seen["note"] == "return -3" and seen["host"] and seen["process"]
    status.remove()
    assert not running([tmp_path / "one"])


def test_a_busy_step_writes_seldom(tmp_path):
    with StatusFile(tmp_path).task("train", 10**6) as tell:
        for k in range(1000):
            tell(k)
    assert read_json(tmp_path / "status.json")["done"] == 0


def test_the_view_counts_what_runs_ended_and_failed(tmp_path, capsys):
    folders = [tmp_path / name for name in "abc"]
    with TrialsView(folders, total=5) as view:
        StatusFile(folders[0])
        view.ended(folders[1], failed=False)
        view.ended(folders[2], failed=True)
    shown = capsys.readouterr().err
    assert "4 done, 1 running, 1 failed" in shown


def test_lines_of_running_trials_are_for_terminals(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    with TrialsView([tmp_path / "Linear-seed0"], total=1), Bars().task("other", 1):
        status = StatusFile(tmp_path / "Linear-seed0")
        status._write("train", 1, 4, "return -7")
    assert "Linear-seed0: train 25 % return -7" in capsys.readouterr().err


def test_curves_are_kept_for_tensorboard(tmp_path):
    accumulator = pytest.importorskip("tensorboard.backend.event_processing.event_accumulator")
    for start in (0.0, 100.0):  # the same step twice, as after a kill
        with Several(Curves(tmp_path)).task("train on the model", 2) as tell:
            tell(1, "return", {"return": start - 5.0})
            tell(2, "no number")
            tell(2, "return", {"return": start - 2.5})
    runs = sorted(tmp_path.iterdir())
    assert [run.name for run in runs] == ["train-on-the-model-1", "train-on-the-model-2"]
    for run, start in zip(runs, (0.0, 100.0), strict=True):
        events = accumulator.EventAccumulator(str(run)).Reload()
        points = [(event.step, event.value) for event in events.Scalars("return")]
        assert points == [(1, start - 5.0), (2, start - 2.5)]


def test_a_step_without_numbers_leaves_no_curve(tmp_path):
    with Curves(tmp_path).task("fit", 1) as tell:
        tell(1, "")
    assert not list(tmp_path.iterdir())


def test_progress_in_a_file_is_lines(capsys, monkeypatch):
    now = iter(range(0, 10**6, 11))
    monkeypatch.setattr("studies.running.progress.time.monotonic", lambda: next(now))
    with Bars().task("train", 100) as tell:
        for k in range(100):
            tell(k + 1, f"return -{k}")
    shown = capsys.readouterr().err
    assert "\r" not in shown
    *_, last = shown.splitlines()
    assert "train" in last and "100%" in last and "return -99" in last
