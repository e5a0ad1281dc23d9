"""What cannot be used gets one line that says what was found and what was expected."""

import numpy as np
import pytest

from sims.chosen import chosen_effects
from sims.effects import CoulombFriction
from sims.loading import load_simulator
from sims.mujoco import MujocoSimulator
from studies.find_gap import build_parser, main
from tests.sims.mujoco.robots import MODELS, robot


def refused(path, **options):
    with pytest.raises(ValueError) as caught:
        MujocoSimulator(str(path), **options)
    message = str(caught.value)
    assert "\n" not in message
    assert str(path) in message
    return message


def written(tmp_path, text, name="robot.xml"):
    (tmp_path / name).write_text(text)
    return tmp_path / name


def test_files_that_are_missing_broken_or_lack_a_mesh(tmp_path):
    assert "no model file" in refused(tmp_path / "nowhere.xml")
    broken = written(tmp_path, "<mujoco><worldbody><body></worldbody></mujoco>")
    assert "line 1" in refused(broken)
    unknown = written(tmp_path, "<mujoco><worldbody><body><jiont/></body></worldbody></mujoco>")
    assert "jiont" in refused(unknown)
    lacks = written(
        tmp_path,
        '<mujoco><asset><mesh name="arm" file="arm.stl"/></asset><worldbody><body><joint/>'
        '<geom type="mesh" mesh="arm"/></body></worldbody></mujoco>',
    )
    assert f"expected it at {tmp_path / 'arm.stl'}" in refused(lacks)
    lost = written(
        tmp_path,
        '<mujoco><worldbody><body><joint name="elbow"/><geom size="1"/></body></worldbody>'
        '<actuator><motor name="drive" joint="elbw"/></actuator></mujoco>',
    )
    assert "'drive' drives joint 'elbw', which is not there; expected one of elbow" in refused(lost)


def test_an_include_that_is_missing_is_said_with_its_place(tmp_path):
    whole = '<mujoco><include file="{}"/></mujoco>'
    main = written(tmp_path, whole.format("parts/arm.xml"))
    (tmp_path / "parts").mkdir()
    assert f"expected it at {tmp_path / 'parts/arm.xml'}" in refused(main)
    written(tmp_path, whole.format("hand.xml").replace("mujoco", "mujocoinclude"), "parts/arm.xml")
    assert f"expected it at {tmp_path / 'hand.xml'}" in refused(main)


def test_meshes_of_a_ros_package_are_found_around_the_urdf(tmp_path):
    urdf = tmp_path / "my_arm" / "urdf" / "arm.urdf"
    urdf.parent.mkdir(parents=True)
    urdf.write_text(
        '<robot name="arm"><link name="base"/><link name="link"><inertial><mass value="1"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial><collision><geometry>'
        '<mesh filename="package://my_arm/meshes/link.obj"/></geometry></collision></link>'
        '<joint name="elbow" type="continuous"><parent link="base"/><child link="link"/></joint>'
        "</robot>"
    )
    assert "expected my_arm/meshes/link.obj in a folder above" in refused(urdf, motors=["all"])
    mesh = tmp_path / "my_arm" / "meshes" / "link.obj"
    mesh.parent.mkdir()
    corners = ["v 0 0 0", "v 1 0 0", "v 0 1 0", "v 0 0 1"]
    mesh.write_text("\n".join([*corners, "f 1 3 2", "f 1 2 4", "f 1 4 3", "f 2 3 4"]))
    assert MujocoSimulator(str(urdf), motors=["all"]).model.nmesh == 1


def test_models_with_hidden_state_or_without_motion(tmp_path):
    text = (MODELS / "cart_pole.xml").read_text()
    late = written(tmp_path, text.replace('gear="10"', 'gear="10" nsample="3" delay="0.012"'))
    assert "delay" in refused(late)
    still = written(tmp_path, "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
    assert "no joint moves" in refused(still)


def test_periods_joints_and_integrators_that_do_not_fit():
    path = MODELS / "cart_pole.xml"
    assert "no multiple" in refused(path, dt=0.012)
    assert "slider, hinge" in refused(path, motors=["elbow"])
    with pytest.raises(ValueError, match="Euler, RK4"):
        robot("cart_pole", integrator="rk45")


def test_names_that_the_model_does_not_have():
    simulator = robot("arm2")
    with pytest.raises(ValueError, match=r"there is no joint 'wrist'.*shoulder, elbow"):
        simulator.with_effects([CoulombFriction("wrist", 0.1)])
    with pytest.raises(ValueError, match=r"frictionloss of joint elbow"):
        chosen_effects(simulator, ["frictionloss of joint elbw"])


def test_a_model_file_is_a_simulator_wherever_one_is_expected(tmp_path, monkeypatch):
    monkeypatch.chdir(MODELS)
    simulator = load_simulator("arm2.xml")
    assert isinstance(simulator, MujocoSimulator)
    monkeypatch.chdir(tmp_path)
    (effect,) = chosen_effects(simulator, ["mass of body fore"])
    assert str(effect) == "mass of body fore"
    # Not offered by default, but there.
    (effect,) = chosen_effects(robot("hopper"), ["friction of geom foot"])
    assert effect.quantities(robot("hopper"))["change"].unit == "1"


def test_a_model_file_in_a_config_may_lie_beside_it(tmp_path):
    for name in ("cart_pole.xml", "arm2.xml"):
        (tmp_path / name).write_text((MODELS / name).read_text())
    config = tmp_path / "ask.yaml"
    config.write_text("simulator: cart_pole.xml\nlogs: [a.csv]\noutput: out\n")
    chosen = build_parser().parse_args(["--config", str(config), "--simulator.integrator", "RK4"])
    made = build_parser().instantiate(chosen).simulator
    assert made.source.path == tmp_path / "cart_pole.xml"
    assert made.runge_kutta
    other = build_parser().parse_args(
        ["--config", str(config), "--simulator", str(MODELS / "arm2.xml")]
    )
    assert build_parser().instantiate(other).simulator.name == "arm2"


def test_a_log_of_another_robot_is_refused_by_the_command(tmp_path, capsys):
    log = tmp_path / "log.csv"
    rows = np.column_stack([np.arange(50) * 0.01, np.zeros((50, 3))])
    np.savetxt(log, rows, delimiter=",", header="time,hip_qpos,knee_qpos,hip_motor", comments="")
    with pytest.raises(SystemExit) as caught:
        main(
            ["--simulator", str(MODELS / "arm2.xml"), "--logs", str(log),
             "--output", str(tmp_path / "gap")]
        )  # fmt: skip
    error = capsys.readouterr().err
    assert caught.value.code == 2
    assert "hip_qpos" in error
    assert "shoulder_qpos" in error or "shoulder_motor" in error
    assert not (tmp_path / "gap").exists()


def test_a_broken_model_is_one_line_on_the_command_line(tmp_path, capsys):
    broken = written(tmp_path, "<mujoco>")
    with pytest.raises(SystemExit) as caught:
        main(["--simulator", str(broken), "--logs", "a.csv", "--output", str(tmp_path / "gap")])
    error = capsys.readouterr().err
    assert caught.value.code == 2
    assert len(error.strip().splitlines()) == 1
    assert str(broken) in error
