"""What can touch, what does along a motion, and what only shows where something is held."""

import numpy as np
import pytest

from residual.gap import find_gap
from residual.step_check import check_step
from residual.trajectories import Trajectory
from sims.effects import exact_aliases
from sims.mujoco import AttributeChange, MujocoSimulator

#: A mass on a rail between the ground and a motor, and a pendulum that swings free of both.
LIFT = """
<mujoco>
  <option timestep="0.005" integrator="RK4">{flag}</option>
  <worldbody>
    <geom name="ground" type="plane" size="5 5 .1"/>
    <body name="load" pos="0 0 {height}">
      <joint name="lift" type="slide" axis="0 0 1" damping="2"/>
      <geom name="box" type="sphere" size=".1" mass="1"/>
      <body name="rod" pos=".5 0 0">
        <joint name="swing" axis="0 1 0" damping=".05"/>
        <geom type="capsule" size=".02" fromto="0 0 0 0 0 -.3" mass=".2"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="pull" joint="lift" ctrlrange="-40 40"/></actuator>
</mujoco>
"""


def model(tmp_path, text, **options):
    path = tmp_path / "robot.xml"
    path.write_text(text)
    return MujocoSimulator(str(path), **options)


def lift(tmp_path, height=2.0, flag=""):
    return model(tmp_path, LIFT.format(height=height, flag=flag))


def log(simulator, seed=0, seconds=6.0, weight=11.76):
    """Its own motion with a pull that about holds it, and encoders that err by 0.1 mm."""
    rng = np.random.default_rng(seed)
    times = simulator.dt * np.arange(round(seconds / simulator.dt) + 1)
    pull = weight + 4 * np.sin(4 * times[:-1]) + 2 * np.sin(9.1 * times[:-1] + 1)
    start = np.zeros(4)
    start[1] = 0.8
    states = simulator.rollout(start, pull[:, None])
    states[:, :2] += 1e-4 * rng.standard_normal((len(states), 2))
    states[:, 2:] = np.nan
    return Trajectory("run", times, states, pull[:, None])


@pytest.mark.parametrize("flag", ["contact", "constraint"])
def test_a_model_whose_file_turns_contacts_off_has_none(tmp_path, flag):
    assert lift(tmp_path).has_contacts
    assert not lift(tmp_path, flag=f'<flag {flag}="disable"/>').has_contacts


def test_a_motion_that_touches_nothing_has_no_impacts_and_is_still_stepped_with_them(tmp_path):
    simulator = lift(tmp_path)
    free = simulator.for_motion([log(simulator).states])
    assert simulator.has_contacts and not free.has_contacts
    assert not free.with_effects([AttributeChange("damping of joint lift")]).has_contacts
    assert all(not finer.has_contacts for _, finer in free.finer())
    drop = np.zeros((400, 1))
    down = simulator.rollout(np.zeros(4), drop)
    assert np.array_equal(down, free.rollout(np.zeros(4), drop))
    assert down[-1, 0] == pytest.approx(-1.68, abs=0.02)  # the rod stands on the ground
    assert simulator.for_motion([down]).has_contacts


def test_an_impact_between_two_samples_is_not_missed(tmp_path):
    simulator = lift(tmp_path)
    # Down to one centimetre above the ground at 4 m/s, and up again from there.
    height = np.concatenate([np.arange(0.09, 0, -0.04), np.arange(0.01, 0.1, 0.04)])
    states = np.zeros((len(height), 4))
    states[:, 0] = height - 1.68
    assert simulator.for_motion([states]).has_contacts
    states[:, 0] += 0.1
    assert not simulator.for_motion([states]).has_contacts


def test_where_positions_are_unknown_it_may_touch(tmp_path):
    simulator = lift(tmp_path)
    states = log(simulator).states
    states[:, 1] = np.nan
    assert simulator.for_motion([states]).has_contacts
    assert simulator.for_motion([]).has_contacts


@pytest.mark.long
def test_a_gap_of_a_motion_that_touches_nothing_is_found_as_of_one_without_contacts(tmp_path):
    simulator = lift(tmp_path)
    true = simulator.with_effects([AttributeChange("damping of joint lift", change=1.0)])
    assert true.has_contacts
    runs = [log(true, seconds=4.0)]
    named = find_gap(simulator, runs, effects=["damping of joint lift"], parameter_tolerance=0)
    assert not named.corrected.has_contacts
    (verdict,) = named.verdicts
    assert (verdict.kind, verdict.effect) == ("confirmed", "damping of joint lift")
    assert verdict.parameters["change"].value == pytest.approx(1.0, abs=0.1)
    # What no effect explains is said to be left, as of every system without impacts.
    friction = ["frictionloss of joint swing"]
    other = find_gap(simulator, runs, effects=friction, parameter_tolerance=0)
    assert "unexplained" in [verdict.kind for verdict in other.verdicts]
    assert not check_step(simulator, runs).visible


#: Two balls on strings: their masses show where the strings are taut.
HELD = """
<mujoco>
  <worldbody>
    <geom type="plane" size="5 5 .1"/>
    <body name="cup" pos="0 0 2">
      <joint name="cup" type="slide" axis="1 0 0"/>
      <geom size=".05" mass=".5" contype="0" conaffinity="0"/><site name="hook"/>
    </body>
    <body name="ball" pos="0 0 2">
      <joint name="ball_x" type="slide" axis="1 0 0"/>
      <joint name="ball_z" type="slide" axis="0 0 1"/>
      <geom size=".02" mass=".1" contype="0" conaffinity="0"/><site name="eye"/>
    </body>
    <body name="bob" pos="0 .1 2">
      <freejoint/><geom size=".02" mass=".1" contype="0" conaffinity="0"/><site name="ring"/>
    </body>
  </worldbody>
  <tendon>
    <spatial limited="true" range="0 .3"><site site="hook"/><site site="eye"/></spatial>
    <spatial limited="true" range="0 .4"><site site="hook"/><site site="ring"/></spatial>
  </tendon>
  <actuator><motor name="push" joint="cup"/></actuator>
</mujoco>
"""


def test_the_mass_of_what_hangs_may_be_wrong(tmp_path):
    masses = {name for name in model(tmp_path, HELD).parameters if name.startswith("mass of")}
    assert masses == {"mass of body cup", "mass of body ball", "mass of body bob"}


def test_dry_friction_leaves_probes_their_poses_and_aliases_their_truth(tmp_path):
    text = LIFT.format(height=2.0, flag="").replace(
        'damping=".05"', 'damping=".05" frictionloss=".01"'
    )
    rough, smooth = model(tmp_path, text), lift(tmp_path)
    poses = rough.smooth_states(20, np.random.default_rng(0))
    assert np.ptp(poses[:, 1]) > 1
    found = {frozenset(alias.effects) for alias in exact_aliases(rough)}
    assert found <= {frozenset(alias.effects) for alias in exact_aliases(smooth)}
    assert frozenset({"constant_load@lift", "actuator_bias@pull"}) in found
