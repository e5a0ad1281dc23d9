"""The simulators of docs/wrap-your-simulator.md keep the contract, learn, and are asked."""

import json
from pathlib import Path

import pytest
from scripts import blocks, script, write_examples

from residual import NamedEffects
from sims import check_simulator
from sims.effects.library import library
from sims.loading import load_simulator
from studies import find_gap, learn

PAGE = Path(__file__).parents[2] / "docs" / "wrap-your-simulator.md"
LESS = [
    "--budget.idealised_steps", "400", "--budget.difference_steps", "300",
    "--budget.iterations", "1", "--budget.true_samples", "150",
    "--ddpg.hidden", "[32, 32]", "--ddpg.warm_up", "200",
]  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wrapped")
    write_examples(PAGE, folder)
    return folder


def test_a_wrapped_environment_keeps_the_contract_and_learns(here, capsys):
    from gym_pendulum import GymPendulum

    assert all(finding.ok for finding in check_simulator(GymPendulum()))
    command = blocks(PAGE, "bash")[0].split()
    assert command[:3] == ["python", "-m", "studies.learn"]
    given = [*command[3:], *LESS, "--output", "learnt"]
    learn.main(given)
    found = json.loads((here / "learnt" / "results.json").read_text())
    assert max(found["accuracy"][0]["visited"]["one_step"].values()) < 0.2
    # The engine's own state is no setting: what was computed is found again.
    stages = sorted((here / "learnt" / "stages").iterdir())
    learn.main(given)
    assert sorted((here / "learnt" / "stages").iterdir()) == stages


def test_named_effects_refuse_a_simulator_that_hosts_none(here, capsys):
    command = [*blocks(PAGE, "bash")[0].split()[3:], *LESS, "--estimator", "residual.NamedEffects"]
    with pytest.raises(SystemExit, match="2"):
        learn.main([*command, "--output", "refused"])
    assert NamedEffects.__name__ in capsys.readouterr().err


@pytest.mark.long
def test_a_wrapped_engine_hosts_effects_and_is_asked(here, capsys):
    from lever import Lever

    assert all(finding.ok for finding in check_simulator(Lever()))
    script("measure.py", here)
    _, asked = blocks(PAGE, "bash")[1].splitlines()
    words = asked.split()
    assert words[:3] == ["python", "-m", "studies.find_gap"]
    at = words.index("lever_logs/*.csv")
    words[at : at + 1] = sorted(map(str, Path("lever_logs").glob("*.csv")))
    few = ["quadratic_drag", "viscous_friction", "actuator_gain", "mass"]
    find_gap.main([*words[3:], "--minutes", "0.2", "--effects", *few])
    assert "Quadratic drag at hinge: coefficient 0.0" in capsys.readouterr().out
    corrected = load_simulator("lever_gap/corrected.yaml", trusted=["lever"])
    (drag,) = corrected.effects
    assert drag.coefficient == pytest.approx(0.05, rel=0.05)


def test_what_cannot_be_had_is_not_offered(here):
    from lever import Lever

    offered = {effect.name for effect in library(Lever())}
    lacking = {"rate_limit", "exchange", "second_store", "added_inertia", "backlash"}
    assert not offered & lacking and "coulomb_friction" in offered

    class Closed(Lever):
        """An engine that takes no outside force."""

        joints = ()

    assert {effect.family for effect in library(Closed())}
    assert not {effect.name for effect in library(Closed())} & {"coulomb_friction", "cubic_spring"}
