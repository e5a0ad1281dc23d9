"""A folder of results holds one run: nothing stale stays, and no other one's is written over."""

import sys
from types import ModuleType

import pytest

from sims import EvaluationProtocol, SwingUp, System
from sims.pendulum_equation import PendulumEquation
from studies.learn import main

QUICK = [
    "--estimator", "residual.Linear", "--budget.true_samples", "40", "--budget.iterations", "2",
    "--budget.idealised_steps", "200", "--budget.difference_steps", "150",
    "--ddpg.hidden", "[8, 8]", "--ddpg.warm_up", "100",
]  # fmt: skip


@pytest.fixture
def systems(monkeypatch):
    module = ModuleType("brought")
    for name in ("ONE", "OTHER"):
        tests = EvaluationProtocol(every=100, true_episodes=1, visited_rollouts=1)
        setattr(
            module,
            name,
            System(name, PendulumEquation(), PendulumEquation.true(), SwingUp(horizon=40), tests),
        )
    monkeypatch.setitem(sys.modules, "brought", module)


def names(folder):
    return {
        kind: sorted(path.stem for path in (folder / kind).iterdir())
        for kind in ("policies", "models", "rollouts")
    }


def ended(capsys, *arguments):
    with pytest.raises(SystemExit) as end:
        main([*arguments])
    return end.value.code, capsys.readouterr().err.strip().splitlines()[-1]


@pytest.mark.long
def test_a_folder_holds_one_run(tmp_path, systems, capsys):
    out = tmp_path / "out"
    one = ["--system", "brought.ONE", *QUICK, "--output", str(out)]
    main([*one, "--budget.control_steps", "150"])
    assert "difference-2" in names(out)["models"] and "control-2" in names(out)["policies"]
    main([*one, "--budget.iterations", "1"])
    assert names(out) == {
        "policies": ["difference-1", "idealised"],
        "models": ["difference-1"],
        "rollouts": ["difference-1", "idealised"],
    }
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    other = ["--system", "brought.OTHER", *QUICK, "--output", str(out)]
    code, says = ended(capsys, *other)
    assert code == 2 and "holds the results of brought.ONE: give another --output" in says
    grid = tmp_path / "grid.yaml"
    grid.write_text("grid:\n- seed: [0, 1]\n")
    code, says = ended(capsys, *one, "--config", str(grid))
    assert code == 2 and "holds the results of a single trial" in says
    assert before == {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}


def test_a_single_trial_is_not_written_into_a_grid(tmp_path, systems, capsys):
    out, grid = tmp_path / "out", tmp_path / "grid.yaml"
    grid.write_text("grid:\n- seed: [0]\n")
    one = ["--system", "brought.ONE", *QUICK, "--budget.iterations", "0", "--output", str(out)]
    main([*one, "--config", str(grid)])
    code, says = ended(capsys, *one)
    assert code == 2 and "holds the trials of a grid" in says
