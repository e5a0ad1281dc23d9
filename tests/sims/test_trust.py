"""Files that are handed around name only classes that their reader trusts; nothing else is run."""

from __future__ import annotations

import json
import sys

import pytest
import yaml

from sims.loading import load_simulator
from studies.find_gap import main as find_gap
from studies.make_log import main as make_log
from studies.pendulum_gap import main as pendulum_gap

EVIL = """
from pathlib import Path
Path({trap!r}).touch()  # whoever imports this runs it
from sims.pendulum_equation import PendulumEquation
from sims.effects import ViscousFriction
class Mine(PendulumEquation):
    def __init__(self, *given, **options):
        Path({trap!r}).touch()
        super().__init__(*given, **options)
def make() -> PendulumEquation:
    Path({trap!r}).touch()
    return PendulumEquation()
class Drag(ViscousFriction):
    pass
"""
SOUND = {"class_path": "sims.PendulumEquation".replace("sims.", "sims.pendulum_equation.")}


def around(inner):
    arguments = {"simulator": inner, "effects": []}
    return {"class_path": "sims.loading.with_effects", "init_args": arguments}


FILES = {
    "class": {"class_path": "evil_package.Mine"},
    "function": {"class_path": "evil_package.make"},
    "module inside": {"class_path": "evil_package.inner.Mine"},
    "nested": around({"class_path": "evil_package.Mine"}),
    "nested by name alone": around("evil_package.Mine"),
    "nested in text": around('{"class_path": "evil_package.Mine"}'),
    "nested in YAML in text": around("class_path: evil_package.Mine\ninit_args: {}\n"),
    "effect": {
        "class_path": "sims.loading.with_effects",
        "init_args": {"simulator": SOUND, "effects": [
            {"class_path": "evil_package.Drag", "init_args": {"joint": "pivot"}}]},
    },
    "effect by name alone": {
        "class_path": "sims.loading.with_effects",
        "init_args": {"simulator": SOUND, "effects": ["evil_package.Drag"]},
    },
    "loader of ours": {
        "class_path": "sims.loading.load_simulator", "init_args": {"source": "evil_package.Mine"},
    },
    "loader of ours, trusting": {
        "class_path": "sims.loading.load_simulator",
        "init_args": {"source": "evil_package.Mine", "trusted": ["evil_package"]},
    },
    "another file": around("other.yaml"),
    "a system function": {"class_path": "os.system", "init_args": {"command": "touch {trap}"}},
    "a process": {"class_path": "subprocess.Popen", "init_args": {"args": ["touch", "{trap}"]}},
    "no string": {"class_path": ["evil_package.Mine"]},
}  # fmt: skip


@pytest.fixture
def trap(tmp_path, monkeypatch):
    folder = tmp_path / "evil_package"
    folder.mkdir()
    trap = tmp_path / "trap"
    for name in ("__init__.py", "inner.py"):
        (folder / name).write_text(EVIL.format(trap=str(trap)))
    (tmp_path / "other.yaml").write_text("class_path: evil_package.Mine\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    yield trap
    for name in [name for name in sys.modules if name.startswith("evil_package")]:
        del sys.modules[name]


def written(settings, folder, trap):
    text = yaml.safe_dump(settings).replace("{trap}", str(trap))
    (folder / "corrected.yaml").write_text(text)
    return folder / "corrected.yaml"


@pytest.mark.parametrize("kind", FILES)
def test_a_file_runs_no_code_of_anybody_else(kind, tmp_path, trap):
    path = written(FILES[kind], tmp_path, trap)
    with pytest.raises(ValueError, match=r"corrected\.yaml"):
        load_simulator(path)
    assert not trap.exists() and "evil_package" not in sys.modules


@pytest.mark.parametrize("kind", ["class", "nested", "effect"])
def test_a_package_that_is_trusted_is_loaded(kind, tmp_path, trap):
    path = written(FILES[kind], tmp_path, trap)
    assert load_simulator(path, trusted=["evil_package"]).dt == 0.05
    assert trap.exists()
    with pytest.raises(ValueError, match="--trust evil_package"):
        load_simulator(path)


def test_what_the_caller_names_needs_no_permission(trap):
    assert load_simulator("evil_package.Mine").dt == 0.05
    assert load_simulator({"class_path": "evil_package.Mine"}).dt == 0.05


def test_tags_make_no_objects(tmp_path, trap):
    path = tmp_path / "corrected.yaml"
    path.write_text(f"!!python/object/apply:os.system ['touch {trap}']\n")
    with pytest.raises(ValueError, match=r"corrected\.yaml"):
        load_simulator(path)
    assert not trap.exists()


def refused(main, arguments, capsys):
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    said = capsys.readouterr().err
    assert ended.value.code == 2 and said.count("\n") == 1, said
    return said


@pytest.mark.parametrize("kind", FILES)
@pytest.mark.parametrize("by", ["option", "option with =", "config", "corrected"])
def test_no_command_runs_code_from_a_file_of_a_simulator(kind, by, tmp_path, trap, capsys):
    path = written(FILES[kind], tmp_path, trap)
    (tmp_path / "run.yaml").write_text("simulator: corrected.yaml\n")
    arguments = {
        "option": ["--simulator", str(path)], "option with =": [f"--simulator={path}"],
        "config": ["--config", "run.yaml"], "corrected": ["--corrected", str(path)],
    }[by]  # fmt: skip
    said = refused(pendulum_gap, [*arguments, "--output", "out"], capsys)
    assert "corrected.yaml" in said
    assert not trap.exists() and not (tmp_path / "out").exists()


def test_the_command_line_says_whom_it_trusts(tmp_path, trap, capsys):
    make_log(["--output", "logs"])
    log = str(sorted((tmp_path / "logs").glob("*.csv"))[0])
    path = written(FILES["class"], tmp_path, trap)
    given = ["--simulator", str(path), "--logs", log, "--output", "gap", "--held-out", log]
    assert "--trust evil_package" in refused(find_gap, given, capsys)
    assert not trap.exists()
    # Trusted, by name or by a class named beside it, it is loaded: the next mistake is told.
    for more in (["--trust", "evil_package"], ["--effects", "evil_package.Drag"]):
        assert "--held-out" in refused(find_gap, [*given, *more], capsys)
        assert trap.exists()
        trap.unlink()


def test_settings_of_a_cluster_come_from_no_file_that_is_handed_around(tmp_path, trap, capsys):
    settings = {**SOUND, "scheduler": "tcp://evil:8786", "backend": "dask"}
    path = written(settings, tmp_path, trap)
    refused(pendulum_gap, ["--simulator", str(path), "--output", "out"], capsys)
    text = json.dumps({**SOUND, "init_args": {"scheduler": "tcp://evil:8786"}})
    path.write_text(text)
    refused(pendulum_gap, ["--simulator", str(path), "--output", "out"], capsys)
