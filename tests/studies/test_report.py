"""A report is rebuilt from what trials left, and nothing is computed."""

import json
import shutil
from types import SimpleNamespace

import pandas as pd
import pytest
import quick_gap

from studies import report
from studies.learnt.run_report import rebuild
from studies.report import main, study_of

TINY = (
    "budget: {iterations: 1, true_samples: 40, idealised_steps: 1050, difference_steps: 300}\n"
    "ddpg: {hidden: [16, 16], warm_up: 200}\n"
    "estimator: {class_path: residual.Linear}\n"
)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("finished")
    (folder / "grid.yaml").write_text(TINY + "grid:\n- seed: [0, 1]\n")
    quick_gap.main(["--config", str(folder / "grid.yaml"), "--output", str(folder / "out")])
    return folder / "out"


def test_a_study_leaves_one_tidy_table_as_csv_and_parquet(finished):
    for name in ("results", "accuracy"):
        text = pd.read_csv(finished / f"{name}.csv")
        binary = pd.read_parquet(finished / f"{name}.parquet")
        pd.testing.assert_frame_equal(text, binary, check_dtype=False)
    assert len(pd.read_csv(finished / "results.csv")) == 2 * 2


def test_tables_come_back_from_the_trials_alone(finished, monkeypatch):
    tables = ["results.csv", "results.parquet", "accuracy.csv", "accuracy.parquet", "results.json"]
    before = {name: (finished / name).read_bytes() for name in tables}
    for name in tables:
        (finished / name).unlink()
    monkeypatch.setattr("studies.learning.trial.run_loop", None)
    rebuild(finished)
    assert {name: (finished / name).read_bytes() for name in tables} == before


def test_an_unfinished_study_shows_what_is_finished(finished, tmp_path, capsys):
    plan = json.loads((finished / "study.json").read_text())
    (tmp_path / "study.json").write_text(json.dumps(plan))
    first, second = plan["trials"]
    for name in (first, second):
        (tmp_path / name).mkdir()
    kept = (finished / first / "results.json").read_text()
    (tmp_path / first / "results.json").write_text(kept)
    (tmp_path / second / "error.txt").write_text("Traceback\nRuntimeError: deliberate\n")
    rebuild(tmp_path)
    assert len(pd.read_csv(tmp_path / "results.csv")) == 2
    assert "RuntimeError: deliberate" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("file", "content", "name"),
    [
        ("study.json", {"study": "leo_gap", "trials": {}}, "leo_gap"),
        ("results.json", {"study": "hidden_effects"}, "hidden_effects"),
        ("results.json", {"study": "learn", "system": "cart"}, "learn"),
    ],
)
def test_the_folder_says_which_study_made_it(tmp_path, file, content, name):
    (tmp_path / file).write_text(json.dumps(content))
    assert study_of(tmp_path) == name


def test_only_studies_are_imported(tmp_path):
    for name in ("os", "../evil", "no_such_study"):
        (tmp_path / "study.json").write_text(json.dumps({"study": name}))
        with pytest.raises(ValueError, match="there is no study"):
            study_of(tmp_path)


@pytest.mark.parametrize("content", [None, {"study": "pendulum_gap", "trials": {}}])
def test_nothing_to_report_is_one_line_and_exit_code_2(tmp_path, capsys, content):
    if content:
        (tmp_path / "study.json").write_text(json.dumps(content))
    with pytest.raises(SystemExit) as stopped:
        main([str(tmp_path)])
    said = capsys.readouterr().err
    assert stopped.value.code == 2 and said.count("\n") == 1 and str(tmp_path) in said


def test_a_study_of_its_own_rebuilds_itself(tmp_path, monkeypatch):
    rebuilt = []
    own = SimpleNamespace(rebuild=rebuilt.append)
    (tmp_path / "results.json").write_text(json.dumps({"study": "hidden_effects"}))
    monkeypatch.setattr(report.importlib, "import_module", lambda name: own)
    main([str(tmp_path)])
    assert rebuilt == [tmp_path]


def test_a_report_imports_nothing_that_a_file_names(finished, tmp_path, capsys):
    """Estimators and systems are named in the files; rebuilding does not look them up."""
    shutil.copytree(finished, tmp_path / "out")
    for path in (tmp_path / "out").glob("*/results.json"):
        results = json.loads(path.read_text())
        results["config"] |= {"system": "evil.SYSTEM", "estimator": {"class_path": "evil.Code"}}
        del results["checksum"], results["format"]
        path.write_text(json.dumps(results))
    (tmp_path / "out" / "results.json").unlink()
    rebuild(tmp_path / "out")
    assert "report:" in capsys.readouterr().out


DROPPED = object()
WORDS = ("expected", "again", "there is no study", "is finished")
WRONG = [DROPPED, None, 7, "text", [], {}, [None], {"x": None}]


def places(node):
    """Every key and index of nested JSON, outer ones first, few of long lists."""
    for key in list(node)[:40] if isinstance(node, dict) else range(min(len(node), 2)):
        yield node, key
        if isinstance(node[key], dict | list):
            yield from places(node[key])


@pytest.fixture(scope="module")
def single(tmp_path_factory):
    folder = tmp_path_factory.mktemp("single")
    (folder / "one.yaml").write_text(TINY)
    quick_gap.main(["--config", str(folder / "one.yaml"), "--output", str(folder / "out")])
    return folder / "out"


def check_one_line(folder, capsys):
    """A report, or one line that names a file there and exit code 2."""
    try:
        main([str(folder)])
    except SystemExit as stopped:
        said = capsys.readouterr().err
        assert stopped.code == 2, said
        *others, last = said.splitlines()
        assert last.startswith("error: ") and all(line.startswith("failed: ") for line in others)
        assert "Traceback" not in said
        capsys.readouterr()


@pytest.mark.parametrize("file", ["results.json", "study.json", "a trial"])
def test_damaged_results_are_one_line(file, single, finished, tmp_path, capsys):
    source = single if file == "results.json" else finished
    shutil.copytree(source, tmp_path / "out")
    path = tmp_path / "out" / file
    if file == "a trial":
        path = next((tmp_path / "out").glob("*/results.json"))
    # The little study of these tests is none that a file may name.
    for written in (tmp_path / "out").rglob("*.json"):
        plain = json.loads(written.read_text().replace("quick_gap", "pendulum_gap"))
        if isinstance(plain, dict):
            plain.pop("checksum", None)
        written.write_text(json.dumps(plain))
    text = path.read_text()
    for share in (0, 0.3, 0.7, 0.99):
        path.write_text(text[: int(share * len(text))])
        check_one_line(tmp_path / "out", capsys)
    for whole in ("[]", "null", "3", '"x"', "{}", '{"trials": []}', '{"trials": [3]}', "[" * 9999):
        path.write_text(whole)
        check_one_line(tmp_path / "out", capsys)
    # A report that comes out well all the same draws its pictures, for seconds.
    count = len(list(places(json.loads(text))))
    chosen = range(0, count, max(1, count // (6 if file == "results.json" else 12)))
    for turn, index in enumerate(chosen):
        damaged = json.loads(text)
        damaged.pop("checksum", None)
        node, key = list(places(damaged))[index % len(list(places(damaged)))]
        value = WRONG[turn % len(WRONG)]
        if value is DROPPED:
            del node[key]
        else:
            node[key] = value
        path.write_text(json.dumps(damaged))
        check_one_line(tmp_path / "out", capsys)
