"""The biped's study from command to report, with next to no training."""

import json

import numpy as np
import pytest

from studies import leo_gap
from studies.learnt.errors import by_group
from studies.learnt.report import write_report
from studies.learnt.statistics import mean
from studies.learnt.tables import tables_of
from studies.systems.leo import EVALUATION

TINY = [
    "--estimator", "residual.Linear",
    "--budget.true_samples", "40",
    "--budget.iterations", "1",
    "--budget.idealised_steps", "80",
    "--budget.difference_steps", "60",
    "--budget.control_steps", "60",
    "--budget.true_steps", "80",
    "--budget.baseline_steps", "60",
    "--ddpg.hidden", "[8, 8]",
    "--ddpg.warm_up", "20",
    "--ddpg.batch", "8",
]  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("leo") / "run"
    leo_gap.main([*TINY, "--output", str(folder)])
    return folder


@pytest.fixture(scope="module")
def results(folder):
    return json.loads((folder / "results.json").read_text())


def test_every_policy_is_walked_on_the_true_leo_from_several_starts(results):
    named = {(policy["name"], policy["iteration"]): policy for policy in results["policies"]}
    assert set(named) == {
        ("idealised", 0), ("difference", 1), ("control", 1), ("true", 0), ("cold", 0), ("warm", 0),
    }  # fmt: skip
    for key in (("idealised", 0), ("difference", 1), ("control", 1), ("true", 0)):
        tests = named[key]["tests"]
        assert len(tests) == EVALUATION.true_episodes
        assert named[key]["return_true"] == pytest.approx(np.mean([t["return"] for t in tests]))
        for test in tests:
            assert test["fell"] == (test["seconds"] < 20.0)
            walked = test["distance"] > 0
            assert (test["work_per_metre"] is not None) == walked
            assert (test["bare_work_per_metre"] is not None) == walked


def test_accuracy_is_told_by_group(results):
    errors = by_group(tables_of([results])[1], "one_step", results["about"])
    assert list(errors) == ["base", "joint angles", "base rates", "joint rates"]
    assert errors.loc[0].notna().all()


def test_the_report_shows_it_walking_and_carries_everything(folder):
    page = (folder / "report.html").read_text()
    assert page.count("data:image/gif") == 3
    assert "http://" not in page.replace("http://www.w3.org", "")
    for name in ("trajectories", "updates", "curves"):
        assert (folder / "figures" / f"{name}.png").stat().st_size > 1000
    assert (folder / "films" / "side_by_side.png").stat().st_size > 1000


def test_a_table_over_trials(results, tmp_path):
    other = json.loads(json.dumps(results)) | {"seed": 1}
    control = next(p for p in other["policies"] if p["name"] == "control")
    learnt = next(p for p in other["policies"] if p["name"] == "difference")
    control["return_true"] = learnt["return_true"] - 100.0
    mine = {p["name"]: p["return_true"] for p in results["policies"]}
    text = write_report([results, other], tmp_path)
    pairs = mean([mine["difference"] - mine["control"], 100.0])
    assert str(pairs) in text
    assert "Linear, update 1" in text and "no difference model, update 1" in text
    page = (tmp_path / "report.html").read_text()
    for words in ("309 766", "Samples to a return", "Linear, update 1"):
        assert words in page
    base = by_group(tables_of([results])[1], "one_step", results["about"])["base"][0]
    assert "Where the difference model is right" in page and f"{base:.3g}"[:4] in page


def test_a_wrong_budget_is_one_line(capsys, tmp_path):
    with pytest.raises(SystemExit) as stopped:
        leo_gap.main(["--budget.true_samples", "1", "--output", str(tmp_path / "run")])
    assert stopped.value.code == 2
    assert "true_samples" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()
