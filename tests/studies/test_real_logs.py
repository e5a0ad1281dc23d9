"""Measured logs of real systems, whose data are not part of the project (docs/find-gap.md)."""

import os
from pathlib import Path

import pytest
import yaml

from studies import find_gap
from studies.real.prepare import sum_accelerations

ROOT = Path(__file__).parents[2]
DATA = Path(os.environ.get("SIMGAP_DATA", ROOT.parent / "shared" / "data"))
CONFIGS = Path(find_gap.__file__).parent / "configs" / "find_gap"

pytestmark = pytest.mark.skipif(
    not DATA.is_dir(), reason="no data: set SIMGAP_DATA to the folder described in docs/find-gap.md"
)


def ask(name, logs, folder):
    settings = yaml.safe_load((CONFIGS / f"{name}.yaml").read_text())
    if isinstance(settings["columns"], str):
        settings["columns"] = str(CONFIGS / settings["columns"])
    return find_gap.run({**settings, "logs": [str(log) for log in logs]}, folder)


def named(result, kinds=("confirmed", "ambiguous")):
    """Every effect that an answer names, alternatives included."""
    return {
        label.split("@")[0]
        for v in result.verdicts
        if v.kind in kinds and v.effect
        for label in (v.effect, *v.alternatives)
    }


def test_the_cart_hangs_on_a_spring_and_is_damped_weakly(tmp_path):
    result = ask("airtrack", [DATA / "airtrack" / "real_linear_h_1.txt"], tmp_path / "gap")
    spring, *rest = [v for v in result.verdicts if v.effect]
    assert (spring.kind, spring.effect) == ("confirmed", "linear_spring")
    assert spring.parameters["stiffness"].value == pytest.approx(6.22, rel=0.01)
    damping = {"viscous_friction", "coulomb_friction", "stribeck_friction", "quadratic_drag"}
    assert all(v.effect in damping for v in rest)
    assert result.gap.horizon_s == pytest.approx(1, rel=0.05)
    # Half a unit is what the reading is rounded to; 0.9 is what the key's repair leaves.
    assert result.gap.after.value <= 1.5 * 0.9


def test_the_heater_is_late(tmp_path):
    result = ask("heater", [DATA / "heater" / "data_step_test.csv"], tmp_path / "gap")
    assert result.verdicts[0].effect in ("delay", "actuator_lag")
    assert all("provisional" in v.says for v in result.verdicts if v.effect)
    # A step of the input lies in the held-out end; 0.39 K is what the key's repair leaves.
    assert result.gap.before.value > 1
    assert result.gap.after.value <= 1.5 * 0.39


def test_the_falling_phone_meets_drag(tmp_path):
    source = DATA / "phone-drop" / "phone_drop.csv"
    sum_accelerations(source, tmp_path / "velocity.csv")
    result = ask("phone_drop", [tmp_path / "velocity.csv"], tmp_path / "gap")
    (drag,) = [v for v in result.verdicts if v.effect]
    assert drag.effect == "quadratic_drag"
    assert 0.03 < drag.parameters["coefficient"].value < 0.07
    assert result.gap.horizon_s > 0.15
    assert result.gap.after.value < 0.4 * result.gap.before.value


@pytest.mark.long
def test_the_second_pendulum_may_carry_more_mass(tmp_path):
    result = ask("pendulum_pair", [DATA / "pendulum-pair" / "run_b.csv"], tmp_path / "gap")
    assert {"payload", "actuator_gain"} <= named(result)
    assert result.gap.after.value < 0.5 * result.gap.before.value


@pytest.mark.long
def test_the_swing_ups_are_not_blamed_on_friction_alone(tmp_path):
    logs = [DATA / "pendulum-swingup" / name for name in ("run_ddp.csv", "run_dircol.csv")]
    result = ask("pendulum_swingup", logs, tmp_path / "gap")
    confident = named(result, ("confirmed",))
    assert not confident or confident - {
        "viscous_friction", "coulomb_friction", "stribeck_friction", "quadratic_drag",
    }  # fmt: skip
