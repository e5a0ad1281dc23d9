"""The tutorial runs as it is written, and finds what it hides."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from scripts import blocks, script, write_examples

TUTORIAL = Path(__file__).parents[2] / "docs" / "tutorial-equation-of-motion.md"


def run(command, folder):
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def worked(tmp_path_factory):
    """A folder in which the tutorial's files were written and its steps 2 to 4 run."""
    folder = tmp_path_factory.mktemp("tutorial")
    write_examples(TUTORIAL, folder)
    script("measure.py", folder)
    (command,) = blocks(TUTORIAL, "bash")
    words = command.split()
    assert words[0] == "python"
    at = words.index("records/*.csv")
    words[at : at + 1] = sorted(
        f"records/{path.name}" for path in (folder / "records").glob("*.csv")
    )
    told = run([sys.executable, *words[1:]], folder)
    used = script("use.py", folder)
    return json.loads((folder / "gap" / "gap.json").read_text()), told, used


@pytest.mark.long
@pytest.mark.parametrize(
    ("effect", "where", "truth"),
    [("coulomb_friction", "cart", 0.8), ("viscous_friction", "hinge", 0.01)],
)
def test_both_frictions_are_named_within_their_intervals(worked, effect, where, truth):
    found = {(v["effect"], v["where"]): v for v in worked[0]["verdicts"] if v["effect"]}
    assert (effect, where) in found
    (number,) = found[effect, where]["parameters"].values()
    assert number["low"] <= truth <= number["high"]


@pytest.mark.long
def test_nothing_else_is_claimed_and_the_gap_closes(worked):
    gap, told, used = worked
    assert len([v for v in gap["verdicts"] if v["effect"]]) == 2
    assert gap["gap"]["after"]["value"] <= 1.1 * gap["gap"]["noise_floor"]["value"]
    assert "Coulomb friction at cart" in told and "Viscous friction at hinge" in told
    assert used.count("[") == 2


def test_the_heater_has_a_longer_time_constant_and_a_delay(tmp_path):
    for code in blocks(TUTORIAL, "python"):
        name = code.splitlines()[0].removeprefix("# ")
        if "heater" in name:
            (tmp_path / name).write_text(code)
    says = script("ask_heater.py", tmp_path)
    assert re.search(r"CONFIRMED +time constant: \+(29|30)[.\d]* s", says)
    assert re.search(r"CONFIRMED +Delay at power: time (5\.9|6\.[01])\d* s", says)
