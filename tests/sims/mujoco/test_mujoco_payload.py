"""A payload moves a robot as a point mass does that stands in the model's own file."""

import mujoco
import numpy as np
import pytest

from residual.gap import find_gap
from residual.trajectories import Trajectory
from sims.mujoco import AttributeChange, MujocoSimulator
from tests.sims.mujoco.agreement import agreement
from tests.sims.mujoco.robots import robot

ARM = """
<mujoco model="arm">
  <option timestep="0.005" integrator="RK4"/>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" axis="0 1 0" damping="0.1"/>
      <geom type="capsule" fromto="0 0 0 0.1 0 -0.3" size="0.03" mass="1.2"/>
      <site name="middle" pos="0 0 -0.1"/>
      <body name="fore" pos="0.1 0 -0.3">
        <joint name="elbow" axis="1 1 0" damping="0.05"/>
        <geom type="box" pos="0 0 -0.1" size="0.02 0.03 0.1" euler="EULER" mass="0.7"/>
        <site name="gripper" pos="0.02 -0.02 -0.2"/>
        POINT
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="shoulder" ctrlrange="-6 6"/><motor joint="elbow"/></actuator>
</mujoco>
"""
AT_GRIPPER = '<geom type="sphere" size="1e-4" pos="0.02 -0.02 -0.2" mass="0.3"/>'


@pytest.fixture(params=["0 0 0", "10 0 20"])
def arms(request, tmp_path):
    """The arm without a payload, and with a small heavy sphere in its file."""
    found = []
    for name, point in (("empty", ""), ("loaded", AT_GRIPPER)):
        path = tmp_path / f"{name}.xml"
        path.write_text(ARM.replace("POINT", point).replace("EULER", request.param))
        found.append(MujocoSimulator(str(path)))
    return found


def offered(simulator):
    return [name for name in simulator.parameters if name.startswith("payload")]


def test_it_moves_as_a_sphere_of_that_mass_does(arms, tmp_path):
    empty, loaded = arms
    carrying = empty.with_effects([AttributeChange("payload at site gripper", 0.3)])
    rng = np.random.default_rng(0)
    states, inputs = empty.smooth_states(20, rng), rng.uniform(-1.0, 1.0, (20, 2))
    assert np.allclose(carrying.step(states, inputs), loaded.step(states, inputs), atol=1e-9)
    assert not np.allclose(carrying.step(states, inputs), empty.step(states, inputs), atol=1e-3)
    path = tmp_path / "corrected.xml"
    path.write_bytes(carrying.own_files()["corrected.xml"])
    assert agreement(loaded, path) < 1e-6


def test_beside_a_mass_it_adds_to_what_the_mass_is(arms, tmp_path):
    empty, loaded = arms
    heavier = AttributeChange("mass of body fore", 0.2)
    both = empty.with_effects([heavier, AttributeChange("payload at site gripper", 0.3)])
    model, b = loaded.model, mujoco.mj_name2id(loaded.model, mujoco.mjtObj.mjOBJ_BODY, "fore")
    assert both.row_fields(1)["body_mass"][0, b] == pytest.approx(model.body_mass[b] + 0.2)
    # Its place in the list does not matter.
    again = empty.with_effects([AttributeChange("payload at site gripper", 0.3), heavier])
    states, inputs = empty.smooth_states(5, np.random.default_rng(1)), np.zeros((5, 2))
    assert np.array_equal(both.step(states, inputs), again.step(states, inputs))


def test_last_links_carry_it_at_their_sites_and_at_tips_without_one(arms):
    assert offered(arms[0])[0] == "payload at site gripper"
    assert offered(robot("arm2")) == ["payload at tip of body fore"]
    two = AttributeChange("payload at tip of body fore", 0.5)
    fields = robot("arm2").with_effects([two]).row_fields(1)
    assert fields["body_ipos"][0, 2, 2] == pytest.approx(-(0.7 * 0.125 + 0.5 * 0.25) / 1.2)


def test_a_body_balanced_in_its_frame_can_get_another_centre(tmp_path):
    """MuJoCo takes a short cut there, which held the centre where it was."""
    path = tmp_path / "wheel.xml"
    body = """<joint name="axle" axis="0 1 0"/>
      <geom type="cylinder" size="0.2 0.02" euler="90 0 0" mass="2"/>"""
    path.write_text(f'<mujoco><worldbody><body name="wheel">{body}</body></worldbody></mujoco>')
    wheel = MujocoSimulator(str(path))
    uneven = wheel.with_effects([AttributeChange("center of mass x of body wheel", 0.05)])
    (after,) = uneven.step(np.zeros((1, 2)), np.zeros((1, 0)))
    inertia = 0.5 * 2 * 0.2**2 + 2 * 0.05**2
    assert after[1] == pytest.approx(2 * 9.81 * 0.05 / inertia * wheel.dt, rel=1e-2)


@pytest.mark.long
@pytest.mark.parametrize("name", ["payload at tip of body fore", "mass of body fore"])
def test_a_weight_at_the_tip_and_a_heavier_link_are_told_apart(name):
    arm = robot("arm2")
    rng = np.random.default_rng(3)
    inputs = np.repeat(rng.uniform(-1, 1, (25, 2)) * [3.0, 0.8], 15, axis=0)
    states = arm.with_effects([AttributeChange(name, 0.2)]).rollout(np.zeros(4), inputs)
    states += rng.normal(0.0, [5e-4, 5e-4, np.inf, np.inf], states.shape)
    states[:, 2:] = np.nan
    run = Trajectory("run", arm.dt * np.arange(len(states)), states, inputs)
    offered = ["payload at tip of body fore", "mass of body fore", "damping of joint elbow"]
    found = find_gap(arm, [run], effects=[AttributeChange(one) for one in offered])
    (named,) = (v for v in found.verdicts if v.parameters)
    assert (named.kind, named.effect) == ("confirmed", name)
    assert named.parameters["change"].value == pytest.approx(0.2, abs=0.01)
