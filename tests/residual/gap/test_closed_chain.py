"""A mechanism that an equality closes, one of its angles not logged: what brakes it is named."""

import numpy as np
import pytest

from residual.gap import find_gap
from residual.gap.fitting.validation import validate
from residual.gap.model.model import Model
from residual.gap.preparation.prepare import prepare
from residual.trajectories import Trajectory

mujoco = pytest.importorskip("mujoco")

FRICTION = 3.0
PRESS = """
<mujoco model="press">
  <option timestep="0.002" integrator="implicitfast"/>
  <worldbody>
    <body>
      <joint name="crank" axis="0 1 0" damping="0.3"/>
      <geom type="capsule" fromto="0 0 0 0.1 0 0" size="0.015" mass="0.6" contype="0"
            conaffinity="0"/>
      <body pos="0.1 0 0">
        <joint name="rod" axis="0 1 0" damping="0.002"/>
        <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.01" mass="0.8" contype="0"
              conaffinity="0"/>
        <site name="pin" pos="0.3 0 0"/>
      </body>
    </body>
    <body pos="0.4 0 0">
      <joint name="ram" type="slide" axis="1 0 0" frictionloss="{friction}"/>
      <geom type="box" size="0.03 0.03 0.03" mass="2" contype="0" conaffinity="0"/>
      <site name="eye"/>
    </body>
  </worldbody>
  <equality><connect site1="pin" site2="eye"/></equality>
  <actuator><motor name="motor" joint="crank" ctrlrange="-8 8"/></actuator>
</mujoco>
"""


@pytest.fixture(scope="module")
def run():
    """Crank and ram of a press with friction, pushed at random; noise of encoders."""
    truth = mujoco.MjModel.from_xml_string(PRESS.format(friction=FRICTION))
    data, rng = mujoco.MjData(truth), np.random.default_rng(2)
    torque = np.repeat(rng.uniform(-2.0, 2.0, 30), 20)
    seen = []
    for push in torque:
        seen.append(np.array(data.qpos))
        data.ctrl[0] = push
        mujoco.mj_step(truth, data, nstep=5)
    places = np.array(seen)
    places += rng.normal(0.0, [5e-4, 5e-4, 2e-5], places.shape)
    states = np.full((len(places), 6), np.nan)
    states[:, [0, 2]] = places[:, [0, 2]]
    return Trajectory("run", 0.01 * np.arange(len(places)), states, torque[:-1, None])


def press(folder, friction):
    from sims.mujoco import MujocoSimulator

    file = folder / "press.xml"
    file.write_text(PRESS.format(friction=friction))
    return MujocoSimulator(file, dt=0.01)


def test_forecasts_of_the_true_press_begin_on_its_bond(run, tmp_path):
    simulator = press(tmp_path, FRICTION)
    ready = prepare(simulator, [run], 0.3)
    nominal = ready.fitter.fit(Model(simulator), np.zeros(0))
    errors = np.sqrt(np.nanmean(validate(ready.fitter, nominal).squares, axis=0))
    assert (errors < [3e-3, 3e-4]).all(), errors  # crank in rad, ram in m


@pytest.mark.long
def test_friction_of_the_ram_is_named_though_the_rod_was_not_logged(run, tmp_path):
    effects = ["frictionloss of joint crank", "frictionloss of joint ram"]
    found = find_gap(press(tmp_path, 0.0), [run], effects=effects)
    assert [one.where for one in found.quality if one.kind == "bound"] == ["rod_qpos"]
    (named,) = [v for v in found.verdicts if v.effect]
    assert named.label == "frictionloss of joint ram"
    assert named.parameters["change"].value == pytest.approx(FRICTION, rel=0.1)
