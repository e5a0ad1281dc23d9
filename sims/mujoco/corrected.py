"""The user's model file with what was found: only the named attributes changed in its text."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np

from sims.effects.actuator import (
    ActuatorBias,
    ActuatorEffect,
    ActuatorGain,
    ActuatorLag,
    Delay,
    Saturation,
)
from sims.effects.backlash import Backlash
from sims.effects.base import Effect
from sims.effects.joint import ConstantLoad, JointEffect
from sims.effects.sensor import SensorEffect
from sims.mujoco import elements
from sims.mujoco.actuators import Circuit, written
from sims.mujoco.attributes import nominal_field
from sims.mujoco.compiled import HARD_FRICTION, model_text
from sims.mujoco.forces import native
from sims.mujoco.markup import Document, Markup, Tag
from sims.simulator import Array

if TYPE_CHECKING:
    from sims.mujoco.simulator import MujocoSimulator


@dataclasses.dataclass(frozen=True)
class Corrected:
    """A corrected model as text.

    Attributes:
        files: Text by file name: the model, and copies of included files that changed.
        missing: Effects that MJCF cannot express, with the reason, one line each.
        rough: Effects that it expresses a little differently, likewise.
    """

    files: dict[str, bytes]
    missing: tuple[str, ...]
    rough: tuple[str, ...]


def corrected_files(simulator: MujocoSimulator, name: str = "corrected.xml") -> Corrected:
    """The model file of a simulator with its effects and changed parameters written in.

    Numbers are written with all digits. Folders of meshes and includes are named in full, so that
    the files can lie anywhere.

    Args:
        simulator: With scalar values.
        name: File name of the model.
    """
    text = model_text(simulator.source)
    writer = _Writer(simulator, Document.read(simulator.source.path, text))
    writer.write()
    return Corrected(writer.files(name), tuple(writer.missing), tuple(writer.rough))


class _Writer:
    def __init__(self, simulator: MujocoSimulator, document: Document) -> None:
        self.simulator, self.document = simulator, document
        self.model = simulator.model
        self.missing: list[str] = []
        self.rough: list[str] = []
        self.root = document.files[next(iter(document.files))]
        angles = [
            tag.attributes["angle"]
            for _, tag in document.tags
            if tag.name == "compiler" and "angle" in tag.attributes
        ]
        self.degrees = not angles or angles[-1] == "degree"

    # -- what has changed -------------------------------------------------------------------

    def write(self) -> None:
        """Put everything into the text."""
        expressible: list[Effect] = []
        for effect in self.simulator.effects:
            if isinstance(effect, SensorEffect | Backlash) and not effect.absent:
                self._cannot(effect, "MJCF has no such element")
            elif isinstance(effect, JointEffect) and not effect.absent:
                parts = effect.parts()
                j = self.simulator.joint_index(effect.joint)
                if all(native(self.model, part, j) for part in parts):
                    expressible.append(effect)
                else:
                    self._cannot(effect, "MJCF has no such force")
            elif not isinstance(effect, ActuatorEffect):
                expressible.append(effect)
        fields = self.simulator.with_effects(expressible).row_fields(1)
        self._joints(fields)
        self._bodies(fields)
        self._geoms(fields)
        self._actuators(fields)
        self._option(fields)

    def _cannot(self, effect: Effect, why: str) -> None:
        if why:
            self.missing.append(f"{effect}: {why}")

    def _joints(self, fields: dict[str, Array]) -> None:
        model = self.model
        for joint in self.simulator.joints:
            j = self.simulator.joint_index(joint.name)
            d, at = int(model.jnt_dofadr[j]), int(model.jnt_qposadr[j])
            values: dict[str, str | None] = {}
            for attribute, first, more, index in (
                ("damping", "dof_damping", "dof_dampingpoly", d),
                ("stiffness", "jnt_stiffness", "jnt_stiffnesspoly", j),
            ):
                if _changed(model, fields, first, index) or _changed(model, fields, more, index):
                    numbers = [
                        _value(model, fields, first, index),
                        *_value(model, fields, more, index),
                    ]
                    values[attribute] = written(numbers)
            for attribute, field in (
                ("frictionloss", "dof_frictionloss"),
                ("armature", "dof_armature"),
            ):
                if _changed(model, fields, field, d):
                    values[attribute] = written([_value(model, fields, field, d)])
            if "frictionloss" in values and np.array_equal(model.dof_solimp[d, :3], HARD_FRICTION):
                values["solimpfriction"] = written(HARD_FRICTION)
            if _changed(model, fields, "qpos_spring", at):
                rest = float(_value(model, fields, "qpos_spring", at))
                turns = int(model.jnt_type[j]) == elements.HINGE
                if turns and self.degrees:
                    rest = float(np.degrees(rest))
                values["springref"] = written([rest])
            if values:
                self._set("joint", j, values)

    def _bodies(self, fields: dict[str, Array]) -> None:
        model = self.model
        for b in range(1, model.nbody):
            if not any(
                _changed(model, fields, field, b)
                for field in ("body_mass", "body_inertia", "body_ipos")
            ):
                continue
            inertial: dict[str, str | None] = {
                "pos": written(_value(model, fields, "body_ipos", b)),
                "quat": written(model.body_iquat[b]),
                "mass": written([_value(model, fields, "body_mass", b)]),
                "diaginertia": written(_value(model, fields, "body_inertia", b)),
            }
            found = self._find("body", b)
            if found is None:
                continue
            markup, tag = found
            own = markup.children(tag, "inertial")
            if not self._inertials_count(bool(own), b):
                continue
            if own:
                others = ("fullinertia", "axisangle", "euler", "xyaxes", "zaxis")
                markup.set(own[0], **inertial, **dict.fromkeys(others))
            else:
                text = " ".join(f'{key}="{value}"' for key, value in inertial.items())
                markup.insert(tag, f"<inertial {text}/>")

    def _inertials_count(self, own: bool, b: int) -> bool:
        """Whether the inertia written for a body is the one that MuJoCo takes."""
        for markup, tag in self.document.tags:
            if tag.name != "compiler":
                continue
            name = elements.name_of("body", self.model, b)
            if float(tag.attributes.get("settotalmass", -1)) > 0:
                self.missing.append(f"mass of body {name}: the file scales masses to a total")
                return False
            if markup.now(tag, "inertiafromgeom") == "true":
                others = self.document.find(("inertial",), "worldbody")
                if own or others:
                    self.missing.append(
                        f"mass of body {name}: compiler inertiafromgeom overrides inertial elements"
                    )
                    return False
                # No element is overridden so far, hence the other bodies stay as they are.
                markup.set(tag, inertiafromgeom="auto")
        return True

    def _geoms(self, fields: dict[str, Array]) -> None:
        for g in range(self.model.ngeom):
            if _changed(self.model, fields, "geom_friction", g):
                numbers = _value(self.model, fields, "geom_friction", g)
                self._set("geom", g, {"friction": written(numbers)})

    def _actuators(self, fields: dict[str, Array]) -> None:
        model, simulator = self.model, self.simulator
        circuits = [Circuit(model, a, fields) for a in range(len(model.actuator_trntype))]
        for column, drive in enumerate(elements.drives(model)):
            name = simulator.action_channels[column].name
            for effect in sorted(simulator.actuator_effects(name), key=lambda e: e.stage):
                self._cannot(effect, self._put(circuits[drive.actuator], effect))
        for load in simulator.joint_effects():
            if type(load) is ConstantLoad:
                j = simulator.joint_index(load.joint)
                on = [c for a, c in enumerate(circuits) if elements.joint_of(model, a) == j]
                self._cannot(load, on[0].push(float(load.load)) if on else "nothing drives it")
        for a, circuit in enumerate(circuits):
            found = self._find("actuator", a) if circuit.changed else None
            if found is not None:
                reason = circuit.write(*found)
                if reason:
                    self.missing.append(f"{elements.name_of('actuator', model, a)}: {reason}")

    def _put(self, circuit: Circuit, effect: ActuatorEffect) -> str:
        """Put an effect into an actuator; why it cannot be, or nothing."""
        if isinstance(effect, ActuatorGain):
            return circuit.scale(float(effect.gain))
        if isinstance(effect, ActuatorBias):
            return circuit.shift(float(effect.bias))
        if isinstance(effect, Saturation):
            return circuit.cut(float(effect.level))
        smooth = self.simulator.runge_kutta
        if isinstance(effect, Delay):
            reason = circuit.delay(float(effect.time), self.simulator.timestep, smooth)
        elif isinstance(effect, ActuatorLag):
            reason = circuit.lag(float(effect.time_constant), smooth)
        else:
            return "MJCF has no such element"
        if smooth and not reason:
            self.rough.append(f"{effect}: RK4 follows the command inside a step too")
        elif "ctrlrange" in circuit.plain and "delay" in circuit.plain and not reason:
            self.rough.append(f"{effect}: MuJoCo cuts commands after their delay")
        return reason

    def _option(self, fields: dict[str, Array]) -> None:
        values: dict[str, str] = {}
        source = self.simulator.source
        if source.integrator is not None:
            values["integrator"] = source.integrator
        own = float(self.model.opt.timestep)
        if source.timestep is not None or self.simulator.timestep != own:
            values["timestep"] = written([self.simulator.timestep])
        if "opt.gravity" in fields:
            values["gravity"] = written(fields["opt.gravity"][0])
        if not values:
            return
        last = [
            (markup, tag)
            for markup, tag in self.document.tags
            if tag.name == "option" and tag.parents == ("mujoco",)
        ]
        if last:
            markup, tag = last[-1]
            markup.set(tag, **values)
        else:
            text = " ".join(f'{key}="{value}"' for key, value in values.items())
            self.root.insert(self.root.tags[0], f"\n  <option {text}/>")

    # -- where it stands ----------------------------------------------------------------------

    def _set(self, kind: str, index: int, values: dict[str, str | None]) -> None:
        found = self._find(kind, index)
        if found is not None:
            markup, tag = found
            markup.set(tag, **values)

    def _find(self, kind: str, index: int) -> tuple[Markup, Tag] | None:
        """The tag of an element by its name, or by its place if it has none."""
        names, section = {
            "joint": (("joint", "freejoint"), "worldbody"),
            "body": (("body",), "worldbody"),
            "geom": (("geom",), "worldbody"),
            "actuator": ((), "actuator"),
        }[kind]
        tags = self.document.find(names, section)
        name = elements.name_of(kind, self.model, index)
        named = [found for found in tags if found[1].attributes.get("name") == name]
        if len(named) == 1:
            return named[0]
        counts = {
            "joint": self.model.njnt,
            "body": self.model.nbody - 1,
            "geom": self.model.ngeom,
            "actuator": len(self.model.actuator_trntype),
        }
        place = index - 1 if kind == "body" else index
        if len(tags) == counts[kind] and "name" not in tags[place][1].attributes:
            return tags[place]
        self.missing.append(f"{kind} {name}: not found in the text of the file")
        return None

    def files(self, name: str) -> dict[str, bytes]:
        """The text of every file that changed, by its new name."""
        main, *others = self.document.files
        self._name_folders(main)
        found = {}
        stem = Path(name).stem
        # An included file that changed is a new file, which the files around it have to name.
        for path in others:
            text = self.document.files[path].render()
            if text != self.document.files[path].text:
                found[f"{stem}-{path.name}"] = text
        for markup in self.document.files.values():
            for tag in markup.tags:
                if tag.name == "include":
                    file = main.parent / tag.attributes.get("file", "")
                    copied = f"{stem}-{file.name}"
                    markup.set(tag, file=copied if copied in found else str(file.resolve()))
        for path in others:
            if f"{stem}-{path.name}" in found:
                found[f"{stem}-{path.name}"] = self.document.files[path].render()
        return {name: self.document.files[main].render(), **found}

    def _name_folders(self, main: Path) -> None:
        """Folders of assets, in full."""
        model = self.model
        if not (model.nmesh or model.ntex or model.nhfield or model.nskin):
            return
        folder = main.parent.resolve()
        compilers = [(markup, tag) for markup, tag in self.document.tags if tag.name == "compiler"]
        if not compilers:
            self.root.insert(
                self.root.tags[0], f'\n  <compiler meshdir="{folder}" texturedir="{folder}"/>'
            )
            return
        named = set()
        for markup, tag in compilers:
            for attribute in ("assetdir", "meshdir", "texturedir"):
                if attribute in tag.attributes:
                    named.add(attribute)
                    full = str((folder / tag.attributes[attribute]).resolve())
                    markup.set(tag, **{attribute: full})
        if "assetdir" not in named:
            markup, tag = compilers[0]
            for attribute in {"meshdir", "texturedir"} - named:
                markup.set(tag, **{attribute: str(folder)})


def agreement(simulator: MujocoSimulator, path: str | Path, seconds: float = 1.0) -> float:
    """How far plain MuJoCo with a model file is from a simulator, over an open-loop rollout.

    From rest in the reference pose, with smoothly varying controls.

    Args:
        simulator: With scalar values.
        path: The model file.
        seconds: Length of the rollout.

    Returns:
        The largest difference of a position or velocity, in their SI units.
    """
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    count = max(1, round(seconds / simulator.dt))
    times = simulator.dt * np.arange(count)
    controls = (
        np.stack(
            [
                0.4 * c.scale * np.sin(2 * np.pi * (0.7 + 0.3 * k) * times)
                for k, c in enumerate(simulator.action_channels)
            ],
            axis=1,
        )
        if simulator.action_channels
        else np.empty((count, 0))
    )
    width = simulator.model.nq + simulator.model.nv
    start = np.concatenate([simulator.model.qpos0, np.zeros(simulator.model.nv)])
    start = np.append(start, np.zeros(len(simulator.physical_channels) - width))
    ours = simulator.rollout(simulator.augment(start[None])[0], controls)
    worst = 0.0
    for k, control in enumerate(controls):
        data.ctrl[:] = control
        mujoco.mj_step(model, data, simulator.substeps)
        theirs = np.concatenate([data.qpos, data.qvel])
        worst = max(worst, float(np.abs(ours[k + 1, :width] - theirs).max()))
    return worst


def _changed(model: Any, fields: dict[str, Array], field: str, index: int) -> bool:
    if field not in fields:
        return False
    return not np.array_equal(fields[field][0][index], nominal_field(model, field)[index])


def _value(model: Any, fields: dict[str, Array], field: str, index: int) -> Any:
    return (fields[field][0] if field in fields else nominal_field(model, field))[index]
