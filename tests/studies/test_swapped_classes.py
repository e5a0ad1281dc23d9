"""A class that is named in another's place has its own settings, however it is named."""

import pytest
import yaml

from studies import find_gap
from studies.learn import STUDY
from studies.learning.trial import build_parser, resolve
from studies.running.grids import expand_grid

MLP, SVR, GP = "sklearn.neural_network.MLPRegressor", "sklearn.svm.SVR", "residual.GaussianProcess"


def chosen(*arguments):
    parser = build_parser(STUDY)
    estimator = parser.plain(parser.parse_args(["--system", "my.SYSTEM", *arguments]))["estimator"]
    return estimator["class_path"], estimator["init_args"]["max_iter"]


@pytest.fixture
def config(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(
        yaml.safe_dump({"estimator": {"class_path": GP, "init_args": {"max_iter": 20}}})
    )
    return str(path)


def test_the_usual_class_leaves_nothing_behind():
    assert chosen() == (GP, 60)
    assert chosen("--estimator.max_iter", "33") == (GP, 33)
    assert chosen("--estimator", MLP) == (MLP, 200)
    assert chosen(f"--estimator={SVR}") == (SVR, -1)
    assert chosen("--estimator", MLP, "--estimator.max_iter", "7") == (MLP, 7)


def test_a_class_of_a_file_leaves_nothing_behind_unless_it_is_the_same(config):
    assert chosen("--config", config) == (GP, 20)
    assert chosen("--config", config, "--estimator.max_iter", "7") == (GP, 7)
    assert chosen("--config", config, "--estimator", GP) == (GP, 20)
    assert chosen("--config", config, "--estimator", MLP) == (MLP, 200)


def test_a_class_of_a_grid_has_its_own_settings():
    parser = build_parser(STUDY)
    settings = parser.plain(parser.parse_args(["--system", "my.SYSTEM"]))
    block = {"estimator": [{"class_path": MLP}, {"class_path": GP, "init_args": {"max_iter": 5}}]}
    found = [resolve(STUDY, one)["estimator"] for one in expand_grid(settings, [block])]
    assert [(e["class_path"], e["init_args"]["max_iter"]) for e in found] == [(MLP, 200), (GP, 5)]


def test_a_class_that_is_not_whole_is_told_what_it_lacks(tmp_path, monkeypatch, capsys):
    (tmp_path / "half_written.py").write_text(
        "from sims import FirstOrderSystem\n\n\nclass Half(FirstOrderSystem):\n    dt = 1.0\n"
    )
    (tmp_path / "mine.yaml").write_text("simulator: half_written.Half\nlogs: log.csv\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    for given in (
        ["--simulator", "half_written.Half", "--logs", "log.csv"],
        ["--config", "mine.yaml"],
    ):
        with pytest.raises(SystemExit) as ended:
            find_gap.main([*given, "--output", "out"])
        assert ended.value.code == 2
        assert "Half does not define derivative" in capsys.readouterr().err
