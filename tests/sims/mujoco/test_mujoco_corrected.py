"""The corrected model file: plain MuJoCo moves as our simulator does, the text stays as it was."""

import functools

import mujoco
import numpy as np
import pytest

from sims.effects import (
    ActuatorBias,
    ActuatorGain,
    ActuatorLag,
    Cogging,
    ConstantLoad,
    CoulombFriction,
    CouplingSpring,
    CubicSpring,
    DeadZone,
    Delay,
    DirectionalFriction,
    LinearSpring,
    QuadraticDrag,
    Saturation,
    SensorOffset,
    StribeckFriction,
    ViscousFriction,
    typical,
)
from sims.mujoco import AttributeChange, MujocoSimulator
from sims.mujoco.corrected import corrected_files
from tests.sims.mujoco.agreement import agreement
from tests.sims.mujoco.robots import MODELS, robot


def saved(simulator, folder):
    corrected = corrected_files(simulator)
    for name, text in corrected.files.items():
        (folder / name).write_bytes(text)
    return corrected, folder / "corrected.xml"


def at_a_usual_size(effect, simulator):
    if isinstance(effect, Delay):
        return effect.with_values(time=0.0123)
    if isinstance(effect, ActuatorLag):
        return effect.with_values(time_constant=0.0123)
    if isinstance(effect, Saturation):
        return effect.with_values(level=0.3 * effect.quantities(simulator)["level"].scale)
    return typical(effect, simulator, 0.1)


#: Joints and links of the large arm that are further cases of what others show.
FURTHER = ("shoulder_lift", "elbow", "wrist", "upper_arm", "forearm")
CASES = [
    pytest.param(name, str(effect), integrator, marks=[pytest.mark.long] * further)
    for name, integrator in (
        ("cart_pole", None),
        ("arm2", "implicitfast"),
        ("arm6", "implicitfast"),
    )
    for effect in robot(name).offered_effects()
    if effect.enters != "sensor" and not isinstance(effect, DeadZone)
    for further in [name == "arm6" and any(part in str(effect) for part in FURTHER)]
]


@functools.cache
def built(name, integrator):
    return robot(name, integrator=integrator)


@pytest.mark.parametrize(("name", "label", "integrator"), CASES)
def test_plain_mujoco_gives_the_same_rollout(name, label, integrator, tmp_path):
    simulator = built(name, integrator)
    (effect,) = [e for e in simulator.offered_effects() if str(e) == label]
    changed = simulator.with_effects([at_a_usual_size(effect, simulator)])
    corrected, path = saved(changed, tmp_path)
    if corrected.missing:
        assert isinstance(effect, ConstantLoad)  # on a joint without a motor, or a limited one
        return
    assert agreement(simulator, path) > 1e-7
    assert agreement(changed, path) < 1e-9


def test_effects_of_the_usual_library_are_written_too(tmp_path):
    simulator = robot("arm2", integrator="implicitfast")
    changed = simulator.with_effects(
        [
            ViscousFriction("shoulder", 0.1),
            CoulombFriction("elbow", 0.05),
            QuadraticDrag("elbow", 0.02),
            LinearSpring("shoulder", 2.0, 0.3),
            LinearSpring("elbow", 0.5),
            CubicSpring("elbow", 0.4),
            DirectionalFriction("shoulder", 0.1, 0.3),
            ActuatorGain("elbow_motor", 0.1),
            ActuatorBias("elbow_motor", 0.05),
            Delay("shoulder_motor", 0.006),
            AttributeChange("mass of body fore", 0.1),
            AttributeChange("gain of actuator shoulder_motor", 0.1),
            AttributeChange("gravity x", 0.2),
        ]
    )
    corrected, path = saved(changed, tmp_path)
    assert not corrected.missing
    assert not corrected.rough
    assert agreement(changed, path) < 1e-9


def test_a_delay_of_commands_that_are_cut_is_said_to_be_near(tmp_path):
    simulator = robot("arm2", integrator="implicitfast")
    cut, late = Saturation("shoulder_motor", 1.5), Delay("shoulder_motor", 0.006)
    changed = simulator.with_effects([cut, late])
    corrected, path = saved(changed, tmp_path)
    assert "after their delay" in corrected.rough[0]
    assert agreement(changed, path) < 0.02 * agreement(simulator, path)


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
def test_a_delay_in_the_file_is_a_delay_of_the_simulator(integrator, tmp_path):
    simulator = robot("arm2", integrator=integrator)
    late = simulator.with_effects([Delay("elbow_motor", 0.0123)])
    _, path = saved(late, tmp_path)
    again = MujocoSimulator(str(path))
    (delay,) = again.effects
    assert delay.time == pytest.approx(0.0123)
    start = late.augment(np.array([[0.3, -0.2, 1.0, 0.5]]))
    actions = np.random.default_rng(0).uniform(-1, 1, (1, 50, 2))
    found, expected = again.rollout(start, actions), late.rollout(start, actions)
    assert np.allclose(found, expected, rtol=0, atol=1e-9)
    # And one that is found on top of it is written as the sum.
    (tmp_path / "more").mkdir()
    later = again.with_effects([*again.effects, Delay("elbow_motor", 0.004)])
    _, path = saved(later, tmp_path / "more")
    (delay,) = MujocoSimulator(str(path)).effects
    assert delay.time == pytest.approx(0.0163)


def test_with_runge_kutta_a_delay_is_said_to_be_near(tmp_path):
    simulator = robot("arm2")
    for effect in (Delay("elbow_motor", 0.0123), ActuatorLag("elbow_motor", 0.0123)):
        changed = simulator.with_effects([effect])
        corrected, path = saved(changed, tmp_path)
        assert "RK4" in corrected.rough[0]
        without = agreement(simulator, path)
        assert agreement(changed, path) < 0.01 * without


def test_what_mjcf_cannot_express_is_said():
    simulator = robot("arm2")
    effects = [
        StribeckFriction("elbow", 0.1, 0.2),
        Cogging("elbow", 0.1),
        DeadZone("elbow_motor", 0.1),
        SensorOffset("elbow_qpos", 0.1),
        Delay("elbow_motor", 0.001),
    ]
    for effect in effects:
        missing = corrected_files(simulator.with_effects([effect])).missing
        assert len(missing) == 1
        assert missing[0].startswith(str(effect))


def test_only_the_named_attributes_change_in_the_text(tmp_path):
    simulator = robot("arm6")
    changed = simulator.with_effects(
        [
            AttributeChange("frictionloss of joint elbow", 1 / 3),
            AttributeChange("mass of body forearm", 0.061),
        ]
    )
    corrected, _ = saved(changed, tmp_path)
    before = (MODELS / "arm6.xml").read_text().splitlines()
    after = corrected.files["corrected.xml"].decode().splitlines()
    different = [new for old, new in zip(before, after, strict=True) if old != new]
    assert len(different) == 2
    assert 'frictionloss="0.3333333333333333"' in different[0]
    assert 'mass="2.336"' in different[1]


NESTED = """<mujoco>
  <!-- kept -->
  <compiler angle="degree"/>
  <include file="parts/arm.xml"/>
  <worldbody/>
</mujoco>
"""
PART = """<mujocoinclude>
  <asset><mesh name="link" file="parts/link.obj"/></asset>
  <worldbody>
    <body name="link">
      <joint name="hinge" axis="0 1 0" springref="20" stiffness="1"/>
      <geom type="mesh" mesh="link" mass="1"/>
      <geom type="capsule" fromto="0 0 0 0 0 -.3" size=".02" mass=".5"/>
    </body>
  </worldbody>
  <actuator><position joint="hinge" kp="3" kv="0.2" name="servo"></position></actuator>
</mujocoinclude>
"""
TETRAHEDRON = "v 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def test_includes_and_meshes(tmp_path):
    (tmp_path / "robot" / "parts").mkdir(parents=True)
    (tmp_path / "robot" / "robot.xml").write_text(NESTED)
    (tmp_path / "robot" / "parts" / "arm.xml").write_text(PART)
    (tmp_path / "robot" / "parts" / "link.obj").write_text(TETRAHEDRON)
    simulator = MujocoSimulator(str(tmp_path / "robot" / "robot.xml"))
    changed = simulator.with_effects(
        [
            LinearSpring("hinge", 0.7, 0.4),
            AttributeChange("mass of body link", 0.2),
            AttributeChange("center of mass z of body link", 0.01),
            ActuatorBias("servo", 0.1),
            ActuatorLag("servo", 0.02),
        ]
    )
    (tmp_path / "elsewhere").mkdir()
    corrected, path = saved(changed, tmp_path / "elsewhere")
    assert not corrected.missing
    assert set(corrected.files) == {"corrected.xml", "corrected-arm.xml"}
    assert b"<!-- kept -->" in corrected.files["corrected.xml"]
    assert agreement(changed, path) < 1e-9
    # The corrected file is a simulator again.
    again = MujocoSimulator(str(path))
    assert again.model.nq == 1


def test_a_body_whose_inertia_comes_from_its_geoms(tmp_path):
    text = (MODELS / "arm2.xml").read_text()
    text = text.replace("<worldbody>", '<compiler inertiafromgeom="true"/><worldbody>')
    (tmp_path / "arm.xml").write_text(text)
    simulator = MujocoSimulator(str(tmp_path / "arm.xml"))
    changed = simulator.with_effects([AttributeChange("mass of body fore", 0.1)])
    corrected, path = saved(changed, tmp_path)
    assert not corrected.missing
    assert agreement(changed, path) < 1e-9


def test_elements_without_a_name_are_found_by_their_place(tmp_path):
    text = (MODELS / "arm2.xml").read_text().replace('<body name="fore"', "<body")
    (tmp_path / "arm.xml").write_text(text)
    simulator = MujocoSimulator(str(tmp_path / "arm.xml"))
    changed = simulator.with_effects([AttributeChange("mass of body body2", 0.1)])
    corrected, path = saved(changed, tmp_path)
    assert not corrected.missing
    assert agreement(changed, path) < 1e-9


def test_a_finer_nominal_is_written_with_its_step_and_integrator(tmp_path):
    simulator = robot("cart_pole", integrator="RK4", timestep=0.0025)
    changed = simulator.with_effects([AttributeChange("mass of body pole", 0.05)])
    _, path = saved(changed, tmp_path)
    model = mujoco.MjModel.from_xml_path(str(path))
    assert model.opt.timestep == 0.0025
    assert agreement(changed, path) < 1e-9


def test_a_urdf_comes_back_as_mjcf(tmp_path):
    (tmp_path / "arm.urdf").write_text(URDF)
    with pytest.raises(ValueError, match=r"no actuators.*Its joints: hinge"):
        MujocoSimulator(str(tmp_path / "arm.urdf"))
    simulator = MujocoSimulator(str(tmp_path / "arm.urdf"), motors=["all"])
    assert [c.name for c in simulator.action_channels] == ["hinge"]
    assert simulator.action_channels[0].high == 4.0
    changed = simulator.with_effects([AttributeChange("frictionloss of joint hinge", 0.1)])
    _, path = saved(changed, tmp_path)
    assert agreement(changed, path) < 1e-9


URDF = """<robot name="arm">
  <link name="base"/>
  <link name="link">
    <inertial><origin xyz="0 0 -0.2"/><mass value="1.3"/>
      <inertia ixx="0.02" iyy="0.02" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <joint name="hinge" type="revolute">
    <parent link="base"/><child link="link"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="4" velocity="10"/><dynamics damping="0.1"/>
  </joint>
</robot>
"""


def test_a_free_body_falls(tmp_path):
    text = """<mujoco><worldbody><body name="stone"><freejoint name="free"/>
      <geom type="box" size=".1 .2 .3" mass="2"/></body></worldbody></mujoco>"""
    (tmp_path / "stone.xml").write_text(text)
    simulator = MujocoSimulator(str(tmp_path / "stone.xml"))
    assert [c.name for c in simulator.state_channels][:4] == [
        "free_qpos_x", "free_qpos_y", "free_qpos_z", "free_qpos_qw",
    ]  # fmt: skip
    start = np.zeros((1, 13))
    start[0, 3], start[0, 7] = 1.0, 2.0
    after = simulator.step(start, np.empty((1, 0)))[0]
    fallen = -9.81 * simulator.dt
    assert np.allclose(after[[0, 7, 9]], [2 * simulator.dt, 2, fallen])


@pytest.mark.parametrize("rest", [0.3, -1.0])
@pytest.mark.parametrize(("integrator", "near"), [("Euler", 1e-12), ("RK4", 5e-3)])
def test_a_link_between_two_joints_is_a_tendon(tmp_path, integrator, near, rest):
    model = robot("arm2", integrator=integrator)
    first, second = (joint.name for joint in model.joints[:2])
    band = CouplingSpring(f"{first} and {second}", -0.7, 0.4, rest)
    linked = model.with_effects([band])
    corrected, path = saved(linked, tmp_path)
    assert not corrected.missing
    assert bool(corrected.rough) == (integrator == "RK4")
    plain = MujocoSimulator(str(path))
    inputs = np.zeros((40, len(model.action_channels)))
    start = model.smooth_states(1, np.random.default_rng(0))[0]
    moved = linked.rollout(start, inputs)
    assert moved == pytest.approx(plain.rollout(start, inputs), abs=near)
    assert np.abs(moved - model.rollout(start, inputs)).max() > 20 * near
