"""The user's model file with what was found: only the named attributes changed in its text."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

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
from sims.effects.link import CouplingDamper, CouplingSpring, Link
from sims.effects.sensor import SensorEffect
from sims.mujoco import elements, payload
from sims.mujoco.actuators import Circuit, written
from sims.mujoco.attributes import nominal_field
from sims.mujoco.compiled import HARD_FRICTION, INTEGRATORS, model_text
from sims.mujoco.forces import native
from sims.mujoco.markup import Document
from sims.mujoco.places import Places
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
    places = Places(Document.read(simulator.source.path, text), simulator.model)
    writer = _Writer(simulator, places)
    writer.write()
    return Corrected(places.files(name), tuple(writer.missing), tuple(writer.rough))


class _Writer:
    def __init__(self, simulator: MujocoSimulator, places: Places) -> None:
        self.simulator, self.places = simulator, places
        self.model = simulator.model
        self.missing = places.missing
        self.rough: list[str] = []

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
            elif isinstance(effect, Link):
                self._tendon(effect)
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
                if turns and self.places.degrees:
                    rest = float(np.degrees(rest))
                values["springref"] = written([rest])
            if values:
                self.places.set("joint", j, values)

    def _tendon(self, link: Link) -> None:
        """A link as a fixed tendon, whose length is the position of one joint to the other's."""
        if link.absent:
            return
        pulls = ""
        for name, arm in zip(link.pair, (1.0, -float(link.ratio)), strict=True):
            self.places.set("joint", self.simulator.joint_index(name), {"name": name})
            pulls += f"<joint joint={quoteattr(name)} coef={quoteattr(written([arm]))}/>"
        if isinstance(link, CouplingSpring):
            # MJCF takes -1 for a length that it finds out itself.
            rest = float(link.rest) if link.rest != -1.0 else np.nextafter(-1.0, 0.0)
            values = f'stiffness="{written([link.stiffness])}" springlength="{written([rest] * 2)}"'
        else:
            assert isinstance(link, CouplingDamper)
            values = f'damping="{written([link.coefficient])}"'
        if self.model.opt.integrator != INTEGRATORS["Euler"]:
            self.rough.append(f"{link}: MuJoCo follows a tendon inside a step too")
        name = quoteattr(f"{link.name} at {link.joint}")
        fixed = f"<fixed name={name} {values}>{pulls}</fixed>"
        self.places.root.insert(self.places.root.tags[0], f"\n  <tendon>{fixed}</tendon>")

    def _bodies(self, fields: dict[str, Array]) -> None:
        model = self.model
        for b in range(1, model.nbody):
            if not any(_changed(model, fields, field, b) for field in payload.FIELDS):
                continue
            inertial: dict[str, str | None] = {
                "pos": written(_value(model, fields, "body_ipos", b)),
                "quat": written(_value(model, fields, "body_iquat", b)),
                "mass": written([_value(model, fields, "body_mass", b)]),
                "diaginertia": written(_value(model, fields, "body_inertia", b)),
            }
            found = self.places.find("body", b)
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
        for markup, tag in self.places.document.tags:
            if tag.name != "compiler":
                continue
            name = elements.name_of("body", self.model, b)
            if float(tag.attributes.get("settotalmass", -1)) > 0:
                self.missing.append(f"mass of body {name}: the file scales masses to a total")
                return False
            if markup.now(tag, "inertiafromgeom") == "true":
                others = self.places.document.find(("inertial",), "worldbody")
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
                self.places.set("geom", g, {"friction": written(numbers)})

    def _actuators(self, fields: dict[str, Array]) -> None:
        model, simulator = self.model, self.simulator
        circuits = [Circuit(model, a, fields) for a in range(len(model.actuator_trntype))]
        for column, drive in enumerate(elements.drives(model)):
            name = simulator.action_channels[column].name
            effects = simulator.actuator_effects(name)
            late = [effect for effect in effects if isinstance(effect, Delay)]
            if late:  # that of the file and the one that was found
                whole = Delay(name, sum(float(effect.time) for effect in late))
                effects = [*(e for e in effects if not isinstance(e, Delay)), whole]
            for effect in sorted(effects, key=lambda e: e.stage):
                self._cannot(effect, self._put(circuits[drive.actuator], effect))
        for load in simulator.joint_effects():
            if type(load) is ConstantLoad:
                j = simulator.joint_index(load.joint)
                on = [c for a, c in enumerate(circuits) if elements.joint_of(model, a) == j]
                self._cannot(load, on[0].push(float(load.load)) if on else "nothing drives it")
        for a, circuit in enumerate(circuits):
            found = self.places.find("actuator", a) if circuit.changed else None
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
            for markup, tag in self.places.document.tags
            if tag.name == "option" and tag.parents == ("mujoco",)
        ]
        if last:
            markup, tag = last[-1]
            markup.set(tag, **values)
        else:
            text = " ".join(f'{key}="{value}"' for key, value in values.items())
            self.places.root.insert(self.places.root.tags[0], f"\n  <option {text}/>")


def _changed(model: Any, fields: dict[str, Array], field: str, index: int) -> bool:
    if field not in fields:
        return False
    return not np.array_equal(fields[field][0][index], nominal_field(model, field)[index])


def _value(model: Any, fields: dict[str, Array], field: str, index: int) -> Any:
    return (fields[field][0] if field in fields else nominal_field(model, field))[index]
