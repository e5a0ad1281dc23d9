"""The tutorial on MuJoCo runs as it is written: it names what is hidden, and the policy holds."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import mujoco
import pytest
from scripts import blocks, inside, script

from studies import learn

ROOT = Path(__file__).parents[2]
TUTORIAL = ROOT / "docs" / "tutorial-mujoco.md"

pytestmark = pytest.mark.long


def run(words, folder):
    paths = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": paths}
    done = subprocess.run(
        [sys.executable, *words], cwd=folder, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def worked(tmp_path_factory):
    """A folder in which steps 1 to 3 of the tutorial were done."""
    folder = tmp_path_factory.mktemp("lever")
    (model,) = blocks(TUTORIAL, "xml")
    (folder / "lever.xml").write_text(model)
    for code in (*blocks(TUTORIAL, "python"), *blocks(TUTORIAL, "yaml")):
        (folder / code.splitlines()[0].removeprefix("# ")).write_text(code)
    script("measure.py", folder)
    command, _ = blocks(TUTORIAL, "bash")
    told = run(command.split()[1:], folder)
    return folder, json.loads((folder / "gap" / "gap.json").read_text()), told


def test_the_payload_and_the_friction_are_named(worked):
    _, gap, told = worked
    named = {v["effect"]: v for v in gap["verdicts"] if v["kind"] == "confirmed"}
    friction = named["frictionloss of joint pivot"]["parameters"]["change"]
    assert friction["value"] == pytest.approx(0.08, rel=0.05)
    (other,) = [v for name, v in named.items() if name != "frictionloss of joint pivot"]
    assert "mass of body beam" in (other["effect"], *other["alternatives"])
    assert "corrected.xml" in told


def test_the_corrected_model_is_the_file_with_two_attributes_changed(worked):
    folder, _, _ = worked
    changed = script("compare.py", folder)
    assert "<!-- hangs down at zero -->" not in changed
    assert 'frictionloss="0.0' in changed
    model = mujoco.MjModel.from_xml_path(str(folder / "gap" / "corrected.xml"))
    assert model.dof_frictionloss[0] == pytest.approx(0.08, rel=0.05)


def test_the_policy_holds_the_robot(worked):
    folder, _, _ = worked
    told = script("train.py", folder)
    angle = float(re.search(r"holds ([\d.-]+) rad", told)[1])
    assert angle == pytest.approx(1.0, abs=0.15)


def test_the_loop_runs_on_it(worked):
    folder, _, _ = worked
    _, command = blocks(TUTORIAL, "bash")
    less = ["--budget.idealised_steps", "400", "--budget.difference_steps", "300"]
    small = ["--ddpg.hidden", "[32, 32]", "--ddpg.warm_up", "200"]
    words = command.split()
    assert words[:3] == ["python", "-m", "studies.learn"]
    with inside(folder):
        learn.main([*words[3:], *less, *small])
    found = json.loads((folder / "learnt" / "results.json").read_text())
    assert [policy["name"] for policy in found["policies"]] == ["idealised", "difference"]
