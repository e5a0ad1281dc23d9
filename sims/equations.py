"""Bring your own system: a simulator from its equation of motion, in about ten lines."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any, ClassVar, Self

import numpy as np

from sims import authored
from sims.authored import beyond_rest, by_joint, force_is_added, joint_of, push_of_inputs
from sims.declared import refuse_declarations, refuse_period
from sims.effects.base import Effect
from sims.effects.pull import ELSEWHERE
from sims.host import HostSimulator
from sims.hosted import kept_motion, kept_scale, motion_of
from sims.motion import Motion, substep_ends
from sims.rows import State
from sims.simulator import Array, Joint, Parameter
from sims.sliding import move
from sims.unsound import cannot_call
from sims.values import Values


class _Equations(HostSimulator):
    """What systems that are written out as equations have in common.

    Attributes:
        written, takes: Name of the method that a subclass writes, and what it is given.
    """

    written: ClassVar[str]
    takes: ClassVar[tuple[str, ...]]
    parameters: Mapping[str, Parameter] = {}
    advances_rows_at_once = True
    written_out = True
    hosts_links = True

    def __init__(
        self,
        dt: float | None = None,
        substeps: int | None = None,
        effects: Sequence[Effect] = (),
    ) -> None:
        cls = type(self)
        refuse_declarations(self)
        self.name = getattr(cls, "name", cls.__name__)
        self.dt = cls.dt if dt is None else dt
        refuse_period(self, self.dt)
        self.substeps = cls.substeps if substeps is None else substeps
        if problem := cannot_call(getattr(self, cls.written), *cls.takes):
            wanted = f"{cls.written}(self, {', '.join(cls.takes)})"
            raise ValueError(f"{cls.__name__}.{cls.written}: {problem}; expected {wanted}")
        if not hasattr(cls, "joints"):
            self.joints = self._own_joints()
        self._arrange()
        self.effects = ()
        if effects:
            hosted = self.with_effects(effects)
            self.effects, self.state_channels = hosted.effects, hosted.state_channels

    def with_scales(self, scales: Mapping[str, float]) -> Self:
        """See ``HostSimulator``; joints that are not named go with their states."""
        changed = super().with_scales(scales)
        if not hasattr(type(self), "joints"):
            changed.joints = changed._own_joints()
        return changed

    @abc.abstractmethod
    def _own_joints(self) -> tuple[Joint, ...]:
        """The joints of a class that names none."""

    def _arrange(self) -> None:
        """Where joints stand among the state channels."""


class EquationOfMotion(_Equations):
    """A mechanical system q'' = f(q, v, u, force); it hosts every effect.

    A subclass gives ``state_channels`` (each position and its rate, in any order),
    ``action_channels``, ``dt``, ``parameters`` and ``acceleration``. It needs ``joints`` only if
    forces are not to be called after the positions, or not in N m (angles) and N (the rest), or in
    the unit of an acceleration where ``force`` is added to it as it is.

    Runge-Kutta 4 over ``substeps`` equal sub-steps advances all rows at once. With dry
    friction a rate that reaches zero is located in the sub-step and held exactly.

    Args:
        dt: Control period in seconds, if not the class's own.
        substeps: Sub-steps per control period, if not the class's own.
        effects: What acts beside the equation.
    """

    dt = 0.02
    substeps = 10
    written = "acceleration"
    takes = ("q", "v", "u", "force", "p")

    def _own_joints(self) -> tuple[Joint, ...]:
        rates = [channel for channel in self.physical_channels if channel.kind == "rate"]
        joints = tuple(joint_of(rate, self.physical_channels) for rate in rates)
        values = [{n: k * np.mean(p.value) for n, p in self.parameters.items()} for k in (1, 1.1)]
        added = [
            force_is_added(self.acceleration, len(joints), len(self.action_channels), one)
            for one in values
        ]
        return tuple(
            dataclasses.replace(joint, unit=f"{rate.unit}/s") if as_it_is else joint
            for joint, rate, as_it_is in zip(joints, rates, np.all(added, axis=0), strict=True)
        )

    def _arrange(self) -> None:
        self.has_drive_force = type(self).drive_force is not EquationOfMotion.drive_force
        names = [channel.name for channel in self.state_channels]
        self._positions = [names.index(str(joint.position)) for joint in self.joints]
        self._rates = [names.index(str(joint.rate)) for joint in self.joints]
        if len(names) != 2 * len(self.joints):
            raise ValueError(
                f"{self.name} has {len(self.joints)} joints and state channels "
                f"{', '.join(names)}; an equation of motion has one position and one rate for "
                "each joint (for anything else use FirstOrderSystem)"
            )

    @abc.abstractmethod
    def acceleration(self, q: Array, v: Array, u: Array, force: Array, p: Any) -> Array:
        """Accelerations of the joints, by row, from elementwise NumPy operations.

        Args:
            q, v: positions and rates, shape (n, n_joints), in the order of ``joints``.
            u: inputs, shape (n, n_a).
            force: further generalized force on each joint, shape (n, n_joints); the
                acceleration has to be linear in it.
            p: parameters as attributes, ``p.mass``; scalars or shape (n,).

        Returns:
            shape (n, n_joints).
        """

    def drive_force(self, q: Array, v: Array, u: Array, p: Any) -> Array:
        """Force of the actuators on the joints, part of ``acceleration``; for backlash, and for
        friction by load, which goes by the inputs alone where it is not told."""
        raise NotImplementedError(f"{type(self).__name__} does not tell its drive force")

    def drive_forces(self, states: Array, inputs: Array) -> Array:
        """See ``HostSimulator.drive_forces``."""
        q, v = states[:, self._positions], states[:, self._rates]
        return self.drive_force(q, v, inputs, Values(**self.parameter_values()))

    def force_scale(self, joint: Joint) -> float:
        """The joint's own scale, or the force that sets up a typical rate in ten periods."""
        if joint.scale is not None:
            return joint.scale
        j = self.joints.index(joint)

        def after_ten_periods() -> float:
            slope = self.state_channels[self._rates[j]].scale / (10 * self.dt)
            at_zero = self._mobility(j, np.zeros((1, len(self.joints))))
            return authored.force_of(slope, at_zero[:, j], self.moved_by(joint)[:, j])

        return kept_scale(self, joint.name, after_ten_periods)

    def moved_by(self, joint: Joint) -> Array:
        """See ``HostSimulator.moved_by``; at rest, at some places."""
        scales = np.array([self.state_channels[column].scale for column in self._positions])
        # Not all at the same share of their scale, where a coupling may vanish.
        shares = np.array([np.roll(ELSEWHERE, k) for k in range(len(scales))]).T
        return self._mobility(self.joints.index(joint), shares * scales)

    def _mobility(self, j: int, places: Array) -> Array:
        """Acceleration of every joint per unit force on joint ``j`` at rest, (n, n_joints)."""
        values = {name: np.mean(p.value) for name, p in self.parameters.items()}
        return authored.mobility(self.acceleration, j, places, len(self.action_channels), values)

    def integrate(self, states: Array, inputs: Array, durations: Array) -> Array:
        """See ``HostSimulator.integrate``."""
        states, inputs = np.asarray(states, float), np.asarray(inputs, float)
        h = np.asarray(durations, float) / inputs.shape[1]
        motion = dataclasses.replace(kept_motion(self, self._motion), span=h)
        begun = 2 * len(self.joints) + len(motion.plays)
        plays, width = slice(2 * len(self.joints), begun), states.shape[1]
        positions = [*self._positions, *range(begun, width, 2)]
        rates = [*self._rates, *range(begun + 1, width, 2)]
        state = State(
            np.ascontiguousarray(states[:, positions].T),
            np.ascontiguousarray(states[:, rates].T),
            np.ascontiguousarray(states[:, plays].T),
        )
        for i, (_, play) in enumerate(motion.plays):
            edge = 0.5 * np.asarray(play.width)
            state.x[i] = np.clip(state.x[i], -edge, edge)
        state = move(motion, state, substep_ends(inputs), h)
        after = np.empty_like(states)
        after[:, positions], after[:, rates], after[:, plays] = state.q.T, state.v.T, state.x.T
        return after

    def _motion(self) -> Motion:
        # The system's author sees rows first.
        def acceleration(q: Array, v: Array, u: Array, f: Array, p: SimpleNamespace) -> Array:
            found = self.acceleration(q.T, v.T, u.T, f.T, p)
            return by_joint(found, q.shape, "acceleration")

        def drive_force(q: Array, v: Array, u: Array, p: SimpleNamespace) -> Array:
            found = self.drive_force(q.T, v.T, u.T, p)
            return by_joint(found, q.shape, "drive_force")

        names = [joint.name for joint in self.joints]
        places = {str(joint.position): (0, j) for j, joint in enumerate(self.joints)}
        places |= {str(joint.rate): (1, j) for j, joint in enumerate(self.joints)}
        drive = drive_force if self.has_drive_force else push_of_inputs(acceleration)
        return motion_of(self, names, places, acceleration, drive)


class FirstOrderSystem(_Equations):
    """A system x' = f(x, u) without joints, such as a heater, a tank or a wheel's speed.

    It hosts changes of parameters, actuator and sensor effects, and on each state a constant
    load, which is a constant rate of change. A speed (a channel of kind ``"rate"``) hosts
    friction and drag, too, which count per unit of what is moved. A subclass gives
    ``state_channels`` (of kind ``"other"`` or ``"rate"``), ``action_channels``, ``dt``,
    ``parameters`` and ``derivative``.

    Args:
        dt, substeps, effects: As for ``EquationOfMotion``.
    """

    dt = 1.0
    substeps = 5
    written = "derivative"
    takes = ("x", "u", "p")

    def _own_joints(self) -> tuple[Joint, ...]:
        return tuple(
            Joint(
                c.name,
                c.name,
                c.name if c.kind == "rate" else None,
                f"{c.unit}/s",
                c.scale / (10 * self.dt),
            )
            for c in self.physical_channels
        )

    def _arrange(self) -> None:
        self.has_drive_force = type(self).drive_force is not FirstOrderSystem.drive_force

    @abc.abstractmethod
    def derivative(self, x: Array, u: Array, p: Any) -> Array:
        """Rates of change, by row: (n, n_s), (n, n_a) and parameters -> (n, n_s)."""

    def drive_force(self, x: Array, u: Array, p: Any) -> Array:
        """What the actuators make of each rate of change, part of ``derivative``; for friction by
        load, which goes by ``sims.authored.beyond_rest`` where it is not told."""
        raise NotImplementedError(f"{type(self).__name__} does not tell its drive force")

    def drive_forces(self, states: Array, inputs: Array) -> Array:
        """See ``HostSimulator.drive_forces``."""
        return self.drive_force(states, inputs, Values(**self.parameter_values()))

    def integrate(self, states: Array, inputs: Array, durations: Array) -> Array:
        """See ``HostSimulator.integrate``: the states are rates of positions that are not used."""
        motion = kept_motion(self, self._motion)
        x = np.asarray(states, float).T
        own, inputs = len(x) - 2 * len(motion.parts), np.asarray(inputs, float)
        state = State(
            np.concatenate([np.zeros_like(x[:own]), x[own::2]]),
            np.concatenate([x[:own], x[own + 1 :: 2]]),
            np.empty((0, x.shape[1])),
        )
        h = np.asarray(durations, float) / inputs.shape[1]
        state = move(motion, state, substep_ends(inputs), h)
        after = np.empty((x.shape[1], len(x)))
        after[:, :own], after[:, own::2] = state.v[:own].T, state.q[own:].T
        after[:, own + 1 :: 2] = state.v[own:].T
        return after

    def _motion(self) -> Motion:
        names = [channel.name for channel in self.physical_channels]
        pushes = all(channel.pushes for channel in self.action_channels)
        brakes = [name for name, p in self.parameters.items() if p.family == "dissipation"]

        def rates(q: Array, v: Array, u: Array, f: Array, p: SimpleNamespace) -> Array:
            own = v[: len(names)]
            change = by_joint(self.derivative(own.T, u.T, p), own.shape, "derivative", "x")
            if len(v) == len(names):
                return change + f
            return np.concatenate([change + f[: len(names)], f[len(names) :]])

        def drive(q: Array, v: Array, u: Array, p: SimpleNamespace) -> Array:
            if self.has_drive_force:
                own = v[: len(names)]
                found = by_joint(self.drive_force(own.T, u.T, p), own.shape, "drive_force", "x")
                return np.concatenate([found, np.zeros_like(v[len(names) :])])
            return beyond_rest(rates, pushes, brakes)(q, v, u, p)

        places = {name: (1, i) for i, name in enumerate(names)}
        return motion_of(self, names, places, rates, drive)
