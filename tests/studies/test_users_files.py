"""Files of one's own that fail while they run end in one line."""

from pathlib import Path

import pytest

from studies import learn


def test_a_sensor_that_drops_out_ends_the_run_and_leaves_no_step(tmp_path, monkeypatch, capsys):
    (tmp_path / "flaky.py").write_text(
        "import os\n"
        "import numpy as np\n"
        "from sims import EvaluationProtocol, Pendulum, SwingUp, System\n"
        "from sims.environment import SimulatorEnv\n\n\n"
        "class Robot(SimulatorEnv):\n"
        "    def step(self, action):\n"
        "        told = super().step(action)\n"
        "        if os.path.exists('FLAKY') and self._steps == 30:\n"
        "            told[-1]['state'][1] = np.nan\n"
        "        return told\n\n\n"
        "def true():\n"
        "    return Robot(Pendulum.true(), SwingUp(60))\n\n\n"
        "TESTS = EvaluationProtocol(every=200)\n"
        "SYSTEM = System('flaky', Pendulum(), true, SwingUp(60), TESTS)\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)
    Path("FLAKY").touch()
    command = [
        "--system", "flaky.SYSTEM", "--output", "out", "--estimator", "residual.Linear",
        "--budget.true_samples", "60", "--budget.iterations", "1",
        "--budget.idealised_steps", "200", "--budget.difference_steps", "200",
        "--ddpg.hidden", "[8, 8]", "--ddpg.warm_up", "100",
    ]  # fmt: skip
    with pytest.raises(SystemExit, match="2"):
        learn.main(command)
    assert "gave rate = nan rad/s after step" in capsys.readouterr().err
    assert not list(Path("out/stages").glob("collect-*"))
    Path("FLAKY").unlink()
    learn.main(command)
    assert "report:" in capsys.readouterr().out


def test_a_value_error_of_the_users_task_says_where(tmp_path, monkeypatch, capsys):
    (tmp_path / "my_swing.py").write_text(
        "from sims import Pendulum, SwingUp, System\n\n"
        "class Mine(SwingUp):\n"
        "    def reward(self, states, actions, next_states):\n"
        "        angle, = next_states.T\n"
        "        return -angle\n\n"
        "SYSTEM = System('mine', Pendulum(), Pendulum.true(), Mine())\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(SystemExit, match="2"):
        learn.main(["--system", "my_swing.SYSTEM", "--output", str(tmp_path / "out")])
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "too many values to unpack" in said
    assert f"{tmp_path / 'my_swing.py'}, line 5, in reward" in said
