"""A model file, compiled as a nominal: what is refused, and what is set so that rows are pure."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.parsers import expat

import numpy as np

try:
    import mujoco
    import mujoco.batch
except ImportError as missing:  # pragma: no cover - depends on what is installed
    raise ImportError(
        "MuJoCo models need the package mujoco, 3.17 or newer: "
        "`pip install 'mujoco>=3.17'` (extra `mujoco`)"
    ) from missing

from sims.mujoco.contacts import touching_geoms
from sims.mujoco.missing import missing_asset, missing_include

#: Dry friction in MuJoCo is soft: held, a joint creeps. With these impedances it creeps ten times
#: less than by default; they count only where frictionloss is above zero.
HARD_FRICTION = (0.99, 0.999, 0.001)
DEFAULT_FRICTION = (0.9, 0.95, 0.001)

#: ``interp`` of an actuator's delay.
LINEAR = 1

INTEGRATORS = {
    "Euler": mujoco.mjtIntegrator.mjINT_EULER,
    "RK4": mujoco.mjtIntegrator.mjINT_RK4,
    "implicit": mujoco.mjtIntegrator.mjINT_IMPLICIT,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
}


@dataclasses.dataclass(frozen=True)
class Source:
    """A model file and what is changed in it before it is compiled.

    Args:
        path: MJCF (``.xml``) or URDF (``.urdf``); includes and meshes are looked up beside it.
        timestep: In s, if not the file's own.
        integrator: ``"Euler"``, ``"RK4"``, ``"implicit"`` or ``"implicitfast"``, likewise.
        motors: Joints that get a torque motor, or ``("all",)``: for URDF, which has no actuators.
    """

    path: Path
    timestep: float | None = None
    integrator: str | None = None
    motors: tuple[str, ...] | None = None

    @property
    def urdf(self) -> bool:
        """Whether it is a URDF."""
        return self.path.suffix.lower() == ".urdf"


def specification(source: Source) -> Any:
    """The ``mujoco.MjSpec`` of a source, with its changes.

    Raises:
        ValueError: The file is missing, broken, or lacks a mesh; the message is one line.
    """
    text = model_text(source)
    spec = _read(source.path) if text is None else mujoco.MjSpec.from_string(text.decode())
    if source.timestep is not None:
        spec.option.timestep = source.timestep
    if source.integrator is not None:
        if source.integrator not in INTEGRATORS:
            known = ", ".join(INTEGRATORS)
            raise ValueError(f"there is no integrator {source.integrator!r}; give one of {known}")
        spec.option.integrator = INTEGRATORS[source.integrator]
    return spec


def model_text(source: Source) -> bytes | None:
    """MJCF that MuJoCo writes for a URDF or a model with added motors; None if the file is used.

    Raises:
        ValueError: The file cannot be used, has no joint of a given name, or is a URDF without
            motors.
    """
    if not source.urdf and source.motors is None:
        return None
    spec = _read(source.path)
    if source.motors is not None:
        _add_motors(spec, source.motors, source.path)
    elif not spec.actuators:
        raise ValueError(
            f"{source.path}: a URDF has no actuators: say which joints have a torque motor, "
            "in a YAML file with class_path: sims.mujoco.MujocoSimulator and init_args: "
            f"{{model: {source.path.name}, motors: [all]}}; motors: [] for none. "
            f"Its joints: {', '.join(joint.name for joint in spec.joints) or 'none'}"
        )
    # MuJoCo writes six digits, so what it wrote is the nominal, not what it read.
    folder = source.path.parent.resolve()
    spec.compiler.meshdir = str(folder / spec.compiler.meshdir)
    spec.compiler.texturedir = str(folder / spec.compiler.texturedir)
    _compile(spec, source.path)
    return str(spec.to_xml()).encode()


def _read(path: Path) -> Any:
    if not path.is_file():
        raise ValueError(f"there is no model file {path}")
    try:
        expat.ParserCreate().Parse(path.read_bytes(), True)
    except expat.ExpatError as error:
        raise ValueError(f"{path}: not well-formed XML: {error}") from None
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise ValueError(f"{path}: {_one_line(error)}{missing_include(path)}") from None
    for mesh in spec.meshes:
        mesh.file = _in_package(mesh.file, path)
    return spec


def _in_package(file: str, path: Path) -> str:
    """The file behind ROS's ``package://name/...``: under a folder of that name around the model.

    As it was, if it is no such name or the file is not there.
    """
    scheme, _, inside = file.partition("://")
    if scheme != "package":
        return file
    name, _, rest = inside.partition("/")
    for folder in path.resolve().parents:
        places = [folder / name / rest, *([folder / rest] if folder.name == name else [])]
        for place in places:
            if place.is_file():
                return str(place)
    return file


def compiled(source: Source) -> tuple[Any, dict[int, float]]:
    """The ``mujoco.MjModel`` that is stepped, and the delays in s that actuators have in the file.

    It differs from the file in ways that leave the motion alone: a diverged state is not reset,
    controls are not clamped (the simulator has clipped them to the same range, and effects come
    after that), friction that is not there yet would be hard, and no body takes the short cut that
    forbids its centre of mass to move. Delays are left to the simulator, which hosts them as
    effects: MuJoCo would keep the commands on their way in a state that no row carries.

    Raises:
        ValueError: The file cannot be compiled, or has hidden state that no row carries.
    """
    spec = specification(source)
    for body in spec.bodies:
        body.simple = False
    late = _without_delays(spec, source.path)
    model = _compile(spec, source.path)
    _refuse_hidden_state(model, source.path)
    flags = mujoco.mjtDisableBit
    model.opt.disableflags |= int(flags.mjDSBL_AUTORESET) | int(flags.mjDSBL_CLAMPCTRL)
    if not touching_geoms(model):  # a fifth of the time goes into looking for contacts
        model.opt.disableflags |= int(flags.mjDSBL_CONTACT)
    soft = np.isclose(model.dof_solimp[:, :3], DEFAULT_FRICTION).all(axis=1)
    model.dof_solimp[soft & (model.dof_frictionloss == 0), :3] = HARD_FRICTION
    return model, late


def _compile(spec: Any, path: Path) -> Any:
    """The ``mujoco.MjModel``; what is not there is said with what was expected.

    Raises:
        ValueError: It cannot be compiled; the message is one line.
    """
    joints = [joint.name for joint in spec.joints]
    for actuator in spec.actuators:
        on = actuator.trntype in (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)
        if on and actuator.target not in joints:
            raise ValueError(
                f"{path}: actuator {actuator.name!r} drives joint {actuator.target!r}, which is "
                f"not there; expected one of {', '.join(filter(None, joints)) or 'none'}"
            )
    try:
        return spec.compile()
    except ValueError as error:
        raise ValueError(f"{path}: {_one_line(error)}{missing_asset(spec, path)}") from None


def _without_delays(spec: Any, path: Path) -> dict[int, float]:
    """Takes the delays out of a specification; by index of the actuator, in s."""
    step = float(spec.option.timestep)
    # RK4 reads the record of commands inside a step too, half a step early on average.
    early = 0.5 * step if spec.option.integrator == INTEGRATORS["RK4"] else 0.0
    found = {}
    for index, actuator in enumerate(spec.actuators):
        delay, samples = float(actuator.delay), int(actuator.nsample)
        actuator.delay, actuator.nsample = 0.0, 0
        if not samples or not delay:
            continue
        steps = delay / step
        if actuator.interp != LINEAR and abs(steps - round(steps)) > 1e-6:
            raise ValueError(
                f"{path}: actuator {actuator.name!r} has a delay of {delay:g} s, no multiple of "
                'the time step; write it with interp="linear"'
            )
        found[index] = max(delay - early, 0.0)
    for sensor in spec.sensors:  # what sensors show is not looked at
        sensor.delay, sensor.nsample = 0.0, 0
    return found


def control_period(model: Any, dt: float | None, path: Path) -> tuple[int, float]:
    """Time steps in a control period, and its length in s.

    Raises:
        ValueError: ``dt`` is no multiple of the time step.
    """
    step = float(model.opt.timestep)
    if dt is None:
        count = max(1, round(0.01 / step))
        return count, count * step
    count = round(dt / step)
    if count < 1 or abs(count * step - dt) > 1e-6 * dt:
        raise ValueError(
            f"{path}: the control period {dt:g} s is no multiple of the model's time step "
            f"{step:g} s; give dt as a multiple, or a timestep that divides it"
        )
    return count, float(dt)


def _add_motors(spec: Any, motors: Sequence[str], path: Path) -> None:
    joints = {joint.name: joint for joint in spec.joints}
    moving = [mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE]
    if list(motors) == ["all"]:
        motors = [name for name, joint in joints.items() if joint.type in moving]
    for name in motors:
        if name not in joints:
            raise ValueError(f"{path}: there is no joint {name!r}; it has: {', '.join(joints)}")
        actuator = spec.add_actuator(name=name, target=name)
        actuator.trntype = mujoco.mjtTrn.mjTRN_JOINT
        actuator.set_to_motor()
        effort = np.asarray(joints[name].actfrcrange, float)
        if effort[1] > effort[0]:
            actuator.ctrllimited = mujoco.mjtLimited.mjLIMITED_TRUE
            actuator.ctrlrange = effort


def _refuse_hidden_state(model: Any, path: Path) -> None:
    """What would make a step depend on more than its row."""
    hidden = {
        "sleep (option flag sleep)": model.opt.enableflags & int(mujoco.mjtEnableBit.mjENBL_SLEEP),
        "engine plugins": model.nplugin,
        "a history of its own": model.nhistory,
        "flexible bodies (flex)": model.nflex,
        "mocap bodies": model.nmocap,
    }
    for what, count in hidden.items():
        if count:
            raise ValueError(
                f"{path}: the model has {what}, whose state is not part of positions, velocities "
                "and activations: remove it to use the model as a simulator here"
            )
    if not model.nv:
        raise ValueError(f"{path}: no joint moves in this model")


def _one_line(error: Exception) -> str:
    """MuJoCo's message without its line breaks."""
    text = re.sub(r"\s+", " ", str(error)).strip()
    return re.sub(r"^(XML )?Error: ", "", text)
