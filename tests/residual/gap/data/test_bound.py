"""Positions that an equality binds to each other: one that was not logged is told."""

import numpy as np
import pytest

from residual.gap.data.examine import findings
from residual.trajectories import Trajectory

pytest.importorskip("mujoco")

FINGERS = """
<mujoco>
  <worldbody>
    <body><joint name="left" type="hinge" axis="0 1 0"/><geom size="0.1" contype="0"/></body>
    <body><joint name="right" type="hinge" axis="0 1 0"/><geom size="0.1" contype="0"/></body>
  </worldbody>
  <equality><joint joint1="left" joint2="right" active="{active}"/></equality>
  <actuator><motor joint="left" name="motor"/></actuator>
</mujoco>
"""


@pytest.mark.parametrize(
    ("active", "logged", "told"),
    [("true", ["left"], ["right_qpos"]), ("true", ["left", "right"], []), ("false", ["left"], [])],
)
def test_what_was_not_logged_of_them_is_told(tmp_path, active, logged, told):
    from sims.mujoco import MujocoSimulator

    model = tmp_path / "fingers.xml"
    model.write_text(FINGERS.format(active=active))
    simulator = MujocoSimulator(model)
    names = [channel.name for channel in simulator.physical_channels]
    states = np.full((50, len(names)), np.nan)
    for joint in logged:
        states[:, names.index(f"{joint}_qpos")] = 0.1 * np.sin(np.arange(50))
    run = Trajectory("run", simulator.dt * np.arange(50), states, np.zeros((49, 1)))
    found = [one for one in findings(simulator, [run]) if one.kind == "bound"]
    assert [one.where for one in found] == told
