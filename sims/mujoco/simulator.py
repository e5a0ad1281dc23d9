"""A MuJoCo model as a simulator that hosts effects."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Self

import numpy as np

from sims.effects.actuator import (
    ActuatorBias,
    ActuatorLag,
    DeadZone,
    Delay,
    Saturation,
)
from sims.effects.base import Effect
from sims.effects.joint import ConstantLoad, LinearSpring
from sims.effects.link import Link
from sims.effects.sensor import SensorOffset
from sims.followers import lagged
from sims.host import HostSimulator
from sims.mujoco import elements
from sims.mujoco.attributes import Attribute, attributes, row_fields
from sims.mujoco.bonds import MujocoBonds
from sims.mujoco.compiled import INTEGRATORS, Source, compiled, control_period
from sims.mujoco.contacts import touches, touching_geoms
from sims.mujoco.corrected import corrected_files
from sims.mujoco.effects import AttributeChange
from sims.mujoco.forces import Linked, Placed, place
from sims.mujoco.lag import lagged_at_ends
from sims.mujoco.poses import any_states, free_states
from sims.mujoco.render import MujocoRenderer
from sims.mujoco.rows import BLOCK, Rows
from sims.simulator import Array, random_values

#: A sub-step this near to the model's own is the model's own: times in logs are rounded.
SAME = 1e-6
#: Part of a log's rows with every position from which on it shows whether anything touches.
KNOWN = 0.9
#: Part of a motion that is more than what a solver of contacts leaves undone.
SOLVED = 1e-6
#: Seconds in which what is left alone comes to hang or lie.
FALL = 1.0


class MujocoSimulator(HostSimulator):
    """A robot described by an MJCF or URDF file, stepped by MuJoCo itself.

    The state is what MuJoCo integrates: positions (``elbow_qpos``) and velocities
    (``elbow_qvel``) of hinge, slide, ball and free joints, then activations. Actions are the
    controls, by actuator. Integrator, solver and contacts are those of the file.

    Every attribute that may be wrong is a parameter by its MJCF name ("frictionloss of joint
    elbow", "mass of body forearm"); rows of a batch may differ in all of them at no cost. A row
    that diverges is NaN.

    Args:
        model: The ``.xml`` or ``.urdf`` file; includes and meshes are looked up beside it.
        dt: Control period in s, a multiple of the time step; by default the multiple nearest to
            10 ms.
        timestep: Time step in s, if not the file's.
        integrator: ``"Euler"``, ``"RK4"``, ``"implicit"`` or ``"implicitfast"``, if not the file's.
        motors: For a URDF: joints with a torque motor, or ``["all"]``.
        effects: What acts beside the model.

    Raises:
        ValueError: The file cannot be used, or ``dt`` is no multiple of the time step.
    """

    #: One call of ``integrate`` with many rows is efficient, each with its own numbers.
    advances_rows_at_once = True
    hosts_links = True

    def __init__(
        self,
        model: str,
        dt: float | None = None,
        timestep: float | None = None,
        integrator: str | None = None,
        motors: list[str] | None = None,
        effects: Sequence[Effect] = (),
    ) -> None:
        path = Path(model).expanduser()
        self.source = Source(path, timestep, integrator, None if motors is None else tuple(motors))
        self.model, late = compiled(self.source)
        self.name = path.stem
        self.substeps, self.dt = control_period(self.model, dt, path)
        self.attributes: dict[str, Attribute] = attributes(self.model)
        self.parameters = {name: known.parameter for name, known in self.attributes.items()}
        self.joints = elements.joints(self.model)
        self.state_channels = elements.state_channels(self.model)
        self.action_channels = elements.action_channels(self.model)
        self.has_contacts = bool(touching_geoms(self.model))
        self.bonds = MujocoBonds(self.model) if self.model.eq_active0.any() else None
        # Within a step only Runge-Kutta asks again what the actuators do.
        self.lagged = lagged if self.runge_kutta else lagged_at_ends
        self._rows = Rows(self.model)
        self._dofs = {
            joint.name: (j, int(self.model.jnt_dofadr[j]))
            for joint in self.joints
            for j in range(self.model.njnt)
            if elements.name_of("joint", self.model, j) == joint.name
        }
        self.effects = ()
        self._forget_what_shows_nowhere()
        self._added = tuple(effects)
        delays = [
            Delay(drive.name, late[drive.actuator])
            for drive in elements.drives(self.model)
            if late.get(drive.actuator)
        ]
        if effects or delays:
            hosted = self.with_effects([*delays, *effects])
            self.effects, self.state_channels = hosted.effects, hosted.state_channels

    def offered_effects(self) -> tuple[Effect, ...]:
        """What may be missing in a robot: the default library of ``sims.effects.library``.

        Attributes by joint, body, actuator and contact, a load and a spring on each joint, bias,
        delay and lag of each actuator (and dead zone and saturation of motors), and offsets of
        the encoders.
        """
        found: list[Effect] = [
            AttributeChange(name) for name, known in self.attributes.items() if known.offered
        ]
        for joint in self.joints:
            j, _ = self._dofs[joint.name]
            found.append(ConstantLoad(joint.name))
            if not self.model.jnt_stiffness[j]:
                found.append(LinearSpring(joint.name))
        for column, drive in enumerate(elements.drives(self.model)):
            name = self.action_channels[column].name
            found += [ActuatorBias(name), Delay(name), ActuatorLag(name)]
            if not elements.is_servo(self.model, drive.actuator):
                found += [DeadZone(name), Saturation(name)]
        found += [SensorOffset(joint.position) for joint in self.joints]
        hosted = []
        for effect in found:
            try:
                effect.quantities(self)
            except ValueError:
                continue
            hosted.append(effect)
        return tuple(hosted)

    def integrate(self, states: Array, inputs: Array, durations: Array) -> Array:
        """See ``HostSimulator.integrate``; an input is held at its mean over every sub-step."""
        states, inputs = np.asarray(states, float), np.asarray(inputs, float)
        durations = np.asarray(durations, float)
        if len(states) > BLOCK:
            blocks = [slice(i, i + BLOCK) for i in range(0, len(states), BLOCK)]
            return np.concatenate(
                [self.take(b).integrate(states[b], inputs[b], durations[b]) for b in blocks]
            )
        controls = inputs[..., 0] if inputs.ndim == 4 else inputs
        n, steps = controls.shape[:2]
        if n == 0:
            return states.copy()
        fields = row_fields(self.model, self.attributes, self.parameter_values(), n)
        applied, law = place(self.model, self._placed(), self._linked(), fields, n)
        own = float(self.model.opt.timestep)
        h = durations / steps
        h = np.where(np.abs(h - own) < SAME * own, own, h)
        if (h != own).any():
            fields["opt.timestep"] = h
        return self._rows.advance(states, controls, fields, applied, law)

    def for_motion(self, paths: Sequence[Array]) -> Self:
        """See ``HostSimulator.for_motion``: most arms could touch themselves, few logs show it.

        Where too few rows hold every position, nothing is known of what touches.
        """
        nq = self.model.nq
        known = [path[np.isfinite(path[:, :nq]).all(axis=1), :nq] for path in paths]
        enough = sum(map(len, known)) >= KNOWN * max(sum(map(len, paths)), 1)
        if not self.has_contacts or not enough or any(touches(self.model, q) for q in known):
            return self
        apart = copy.copy(self)
        apart.has_contacts = False
        return apart

    def _forget_what_shows_nowhere(self) -> None:
        """Attributes that no motion depends on are no parameters.

        Such as the centre of mass along the axis of a single joint. What hangs or lies shows its
        mass only where it is held. Friction of contacts stays: random poses have few.
        """
        names = [name for name in self.attributes if "friction of" not in name]
        rng, n = np.random.default_rng(0), 12
        poses, inputs = self.smooth_states(n, rng), np.empty((n, len(self.action_channels)))
        for column, channel in enumerate(self.action_channels):
            inputs[:, column] = random_values(channel, n, rng)
        # Half of the rows stay near the reference pose, where servos are within their forces.
        nq = self.model.nq
        poses[::2, :nq] = self.model.qpos0 + 0.05 * (poses[::2, :nq] - self.model.qpos0)
        poses[::2, nq:] *= 0.05
        inputs[::2] *= 0.05
        held = [any_states(self.model, self.physical_channels, n, rng), self._fall(n)]
        shown = self._shown(names, poses, inputs, 1e-12)
        shown |= self._shown(names, np.concatenate(held), np.tile(inputs, (2, 1)), SOLVED)
        for name in set(names) - shown:
            del self.attributes[name], self.parameters[name]

    def _shown(self, names: Sequence[str], poses: Array, inputs: Array, least: float) -> set[str]:
        """Attributes that change motion from these poses by so much of its size."""
        n = len(poses)
        states = np.tile(poses, (len(names) + 1, 1))
        controls = np.repeat(np.tile(inputs, (len(names) + 1, 1))[:, None], 2, axis=1)
        values = {}
        for i, name in enumerate(names):
            known = self.parameters[name]
            values[name] = np.full(len(states), float(known.value))
            values[name][n * (i + 1) : n * (i + 2)] += 0.1 * known.scale
        changed = self.with_parameters(**values)
        durations = np.full(len(states), 2 * float(self.model.opt.timestep))
        after = changed.integrate(states, controls, durations).reshape(len(names) + 1, n, -1)
        after = after[:, np.isfinite(after[0]).all(axis=1)]
        size = np.maximum(np.max(np.abs(after[0]), axis=0, initial=0.0), 1e-9)
        # A row that diverges with an attribute and not without it shows it, too.
        alike = [(np.abs(moved - after[0]) < least * size).all() for moved in after[1:]]
        return {name for name, same in zip(names, alike, strict=True) if not same}

    def _fall(self, n: int) -> Array:
        """States on the way from the reference pose, left alone for a second, (n, n_physical)."""
        steps = max(1, round(FALL / n / float(self.model.opt.timestep)))
        state = np.zeros((1, len(self.physical_channels)))
        state[:, : self.model.nq] = self.model.qpos0
        controls = np.zeros((1, steps, len(self.action_channels)))
        path = []
        for _ in range(n):
            state = self.integrate(state, controls, np.full(1, FALL / n))
            path.append(state)
        return np.concatenate(path)

    @property
    def timestep(self) -> float:
        """Time step in s."""
        own, step = float(self.model.opt.timestep), self.dt / self.substeps
        return own if abs(step - own) < SAME * own else step

    def finer(self) -> Iterator[tuple[str, HostSimulator]]:
        """The same model with RK4, then with shorter steps too, cheapest first.

        Yields:
            The option that makes it, as on the command line, and the simulator.
        """
        settings = self.source
        for parts in (1, 2, 4):
            step = float(self.model.opt.timestep) / parts
            if parts == 1 and self.runge_kutta:
                continue
            option = "--simulator.integrator RK4"
            if parts > 1:
                option += f" --simulator.timestep {step:g}"
            motors = None if settings.motors is None else list(settings.motors)
            finer = type(self)(str(settings.path), self.dt, step, "RK4", motors, self._added)
            finer.has_contacts = self.has_contacts
            yield option, finer

    @property
    def runge_kutta(self) -> bool:
        """Whether the model is integrated by RK4, which is of fourth order; all others of first."""
        return int(self.model.opt.integrator) == int(INTEGRATORS["RK4"])

    def renderer(self) -> MujocoRenderer:
        """Draws states; see ``sims.render``."""
        return MujocoRenderer(self.model)

    def joint_index(self, name: str) -> int:
        """Index of a joint in the model."""
        return self._dofs[name][0]

    def own_files(self) -> dict[str, bytes]:
        """``corrected.xml`` and what it includes; see ``sims.mujoco.corrected``."""
        return corrected_files(self).files

    def not_in_own_files(self) -> tuple[str, ...]:
        """Effects that MJCF cannot express, or not exactly."""
        corrected = corrected_files(self)
        return (*corrected.missing, *(f"{line} (nearly)" for line in corrected.rough))

    def row_fields(self, rows: int) -> dict[str, Array]:
        """Fields of the model that attributes and effects on joints change, (rows, ...)."""
        fields = row_fields(self.model, self.attributes, self.parameter_values(), rows)
        place(self.model, self._placed(), (), fields, rows)
        return fields

    def _placed(self) -> list[Placed]:
        return [(effect, *self._dofs[effect.joint]) for effect in self.joint_effects()]

    def _linked(self) -> list[Linked]:
        links = [e for e in self.effects if isinstance(e, Link) and not e.absent]
        return [(e, self._dofs[e.pair[0]], self._dofs[e.pair[1]]) for e in links]

    def smooth_states(self, n: int, rng: np.random.Generator) -> Array:
        """Random physical states without contact, (n, n_physical), about the reference pose."""
        return free_states(self.model, self.physical_channels, n, rng)
