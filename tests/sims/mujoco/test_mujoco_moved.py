"""Settings that name a model file load after both were moved or sent, and say what they lack."""

import shutil

import numpy as np
import pytest
import yaml

from sims.loading import corrected_settings, load_simulator
from sims.model_files import model_settings, relative
from sims.mujoco import AttributeChange
from studies.find_gap import build_parser
from tests.sims.mujoco.robots import MODELS

CHANGE = AttributeChange("mass of body fore", 0.1)


def corrected(model, folder):
    """Written as find_gap writes it."""
    folder.mkdir(parents=True, exist_ok=True)
    settings = corrected_settings(model_settings(model), [CHANGE], {"elbow_motor": "zero"})
    (folder / "corrected.yaml").write_text(yaml.safe_dump(relative(settings, folder)))
    return folder / "corrected.yaml"


@pytest.mark.parametrize(
    ("model", "output"),
    [
        ("gap/arm2.xml", "gap"),
        ("gap/models/arm2.xml", "gap"),
        ("arm2.xml", "gap"),
        ("arm2.xml", "results/gap"),
        ("models/arm2.xml", "results/gap"),
    ],
)
def test_a_project_moves_as_a_whole(model, output, tmp_path, monkeypatch):
    old, new = tmp_path / "old", tmp_path / "new"
    (old / model).parent.mkdir(parents=True)
    shutil.copy(MODELS / "arm2.xml", old / model)
    written = corrected(old / model, old / output)
    assert str(old) not in written.read_text()
    states, actions = np.zeros((1, 4)), np.ones((1, 2))
    before = load_simulator(written).step(states, actions)
    old.rename(new)
    monkeypatch.chdir(tmp_path)
    loaded = load_simulator(new / output / "corrected.yaml")
    assert loaded.source.path == (new / model).resolve()
    assert np.array_equal(loaded.step(states, actions), before)
    chosen = ["--simulator", str(new / output / "corrected.yaml"), "--logs", "a", "--output", "b"]
    made = build_parser().instantiate(build_parser().parse_args(chosen)).simulator
    assert np.array_equal(made.step(states, actions), before)


def test_a_model_elsewhere_is_found_where_it_is_or_beside_the_settings(tmp_path):
    here = corrected(MODELS / "arm2.xml", tmp_path / "far" / "from" / "it")
    assert load_simulator(here).source.path == (MODELS / "arm2.xml").resolve()
    settings = yaml.safe_load(here.read_text())
    settings["init_args"]["simulator"]["init_args"]["model"] = "/another/machine/arm2.xml"
    here.write_text(yaml.safe_dump(settings))
    with pytest.raises(ValueError, match=r"corrected.yaml: there is no model file .*arm2.xml; put"):
        load_simulator(here)
    shutil.copy(MODELS / "arm2.xml", here.parent)
    assert load_simulator(here).source.path == (here.parent / "arm2.xml").resolve()


def test_a_model_that_is_not_there_is_one_line_on_the_command_line(tmp_path, capsys):
    written = corrected(tmp_path / "arm2.xml", tmp_path / "gap")
    with pytest.raises(SystemExit) as caught:
        build_parser().parse_args(["--simulator", str(written), "--logs", "a", "--output", "b"])
    assert caught.value.code == 2
    error = capsys.readouterr().err
    assert len(error.splitlines()) == 1 and "../arm2.xml" in error


def test_settings_written_by_hand_name_the_model_beside_them(tmp_path):
    shutil.copy(MODELS / "arm2.xml", tmp_path)
    text = "class_path: sims.mujoco.MujocoSimulator\ninit_args: {model: arm2.xml, dt: 0.02}\n"
    (tmp_path / "nominal.yaml").write_text(text)
    assert load_simulator(tmp_path / "nominal.yaml").dt == 0.02
    nested = "".join(f"  {line}\n" for line in text.splitlines())
    (tmp_path / "ask.yaml").write_text(f"simulator:\n{nested}logs: [a.csv]\noutput: out\n")
    chosen = build_parser().parse_args(["--config", str(tmp_path / "ask.yaml")])
    assert build_parser().instantiate(chosen).simulator.source.path == tmp_path / "arm2.xml"


def test_other_simulators_keep_their_settings(tmp_path):
    plain = {"class_path": "my_file.Arm", "init_args": {"model": "/a/b.xml", "more": [1, {"x": 2}]}}
    assert relative(plain, tmp_path) == plain
