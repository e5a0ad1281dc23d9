"""Simulators that host named effects: force, parameter, actuator path and sensor path.

One control period runs through four stages, each usable alone on measured logs:
``unsense`` (what was read -> what is there), ``drive`` (commands -> effective inputs),
``integrate`` (physics, with joint forces inside every sub-step), ``sense``.
"""

from __future__ import annotations

import abc
import copy
import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from sims.actuation import clipped, driven, memory_channels, moving_memory, next_inputs, with_memory
from sims.bonds import Bonds
from sims.effects.actuator import ActuatorEffect
from sims.effects.backlash import Backlash
from sims.effects.base import Effect, place
from sims.effects.joint import JointEffect
from sims.effects.parameter import ParameterChange
from sims.effects.sensor import through_sensors
from sims.followers import lagged
from sims.simulator import Array, Channel, Hold, Joint, Simulator, physical, random_values


class HostSimulator(Simulator):
    """A simulator that hosts effects. At strength zero each changes no bit of the output.

    Values of effects and parameters are scalars or arrays with one entry per row of a batch.
    Effects with memory (delay, lag, backlash) append ``memory`` channels to the physical ones.

    Attributes:
        effects, joints: The effects, in any order, and where generalized forces can act.
        substeps: Sub-steps in one control period.
        has_drive_force: True if ``drive_forces`` is known, so that backlash can be hosted.
        written_out, hosts_links: Whether equations give it; whether it hosts links between joints.
        has_contacts, bonds: Whether motion jumps at impacts (``for_motion``), what binds positions.
        advances_rows_at_once: True if ``integrate`` advances rows together, each its own values.
        lagged: How an input with a lag acts in sub-steps, see ``sims.followers.lagged``.
    """

    effects: tuple[Effect, ...] = ()
    joints: tuple[Joint, ...]
    substeps: int
    has_drive_force: bool = False
    written_out: bool = False
    hosts_links: bool = False
    has_contacts: bool = False
    bonds: Bonds | None = None
    advances_rows_at_once: bool = False
    lagged = staticmethod(lagged)

    def __repr__(self) -> str:
        return " + ".join([super().__repr__(), *map(str, self.effects)])

    @abc.abstractmethod
    def integrate(self, states: Array, inputs: Array, durations: Array) -> Array:
        """Advance true states under effective inputs; a pure function of its rows.

        Args:
            states: shape (n, n_i), columns ``integrated_channels``.
            inputs: shape (n, substeps, n_a), each held over one of equal sub-steps; how many
                sub-steps there are is read from the shape. Or (n, substeps, n_a, 2): mean
                and rise of an input that runs straight in each sub-step.
            durations: shape (n,) in seconds, one per row.

        Returns:
            States at the end, shape (n, n_i).
        """

    def drive_forces(self, states: Array, inputs: Array) -> Array:
        """Force of the actuators on each joint, shape (n, n_joints)."""
        raise NotImplementedError(f"{type(self).__name__} does not tell its drive force")

    def force_scale(self, joint: Joint) -> float:
        """A typical force on the joint, in its unit."""
        if joint.scale is None:
            raise NotImplementedError(f"joint {joint.name!r} has no scale")
        return joint.scale

    def moved_by(self, joint: Joint) -> Array | None:
        """Acceleration of all per unit force on a joint, (places, n_joints); None: not known."""
        return None

    def smooth_states(self, n: int, rng: np.random.Generator) -> Array:
        """Random physical states where a small change has a small effect, (n, n_physical); by
        default within the scales of the channels, angles anywhere; away from contacts."""
        return np.stack([random_values(c, n, rng) for c in self.physical_channels], axis=1)

    def for_motion(self, paths: Sequence[Array]) -> Self:
        """It, without ``has_contacts`` if nothing touches along such motion; it steps the same.

        Args:
            paths: Measured physical states of every run, (n, n_physical), NaN where unknown.
        """
        return self

    def offered_effects(self) -> tuple[Effect, ...] | None:
        """What may be missing by default (``sims.effects.library``); None for all it can host."""
        return None

    def own_files(self) -> dict[str, bytes]:
        """It as files of the format that it came from, by name, for tools that read that format."""
        return {}

    def not_in_own_files(self) -> tuple[str, ...]:
        """What those files cannot hold, or hold a little differently, one line each."""
        return ()

    @property
    def physical_channels(self) -> tuple[Channel, ...]:
        """State channels without the memory of effects."""
        return physical(self.state_channels)

    @property
    def integrated_channels(self) -> tuple[Channel, ...]:
        """Columns of ``integrate``: the physical ones, then of plays, stores and flexible parts."""
        return self.state_channels[: len(self.physical_channels) + moving_memory(self)]

    def with_effects(self, effects: Iterable[Effect]) -> Self:
        """A copy with these effects instead of its own.

        Raises:
            ValueError: An effect cannot act here; the message says where effects can.
        """
        changed = copy.copy(self)
        changed.effects = tuple(effects)
        changed.state_channels = self.physical_channels
        for effect in changed.effects:
            effect.measures(changed)
        changed.state_channels += tuple(memory_channels(changed))
        return changed

    def with_scales(self, scales: Mapping[str, float]) -> Self:
        """A copy whose physical states are of other typical sizes, by name."""
        changed = copy.copy(self)
        changed.state_channels = tuple(
            dataclasses.replace(channel, scale=scales.get(channel.name, channel.scale))
            for channel in self.physical_channels
        )
        return changed.with_effects(self.effects)

    def with_parameters(self, **values: float | Array) -> Self:
        """A copy with some parameters changed.

        Raises:
            ValueError: There is no such parameter.
        """
        unknown = ", ".join(sorted(set(values) - set(self.parameters)))
        if unknown:
            there = ", ".join(self.parameters) or "none"
            raise ValueError(f"{self.name} has no parameter {unknown}, it has {there}")
        changed = copy.copy(self)
        changed.parameters = {
            name: dataclasses.replace(parameter, value=values.get(name, parameter.value))
            for name, parameter in self.parameters.items()
        }
        return changed

    def with_hold(self, hold: Mapping[str, Hold]) -> Self:
        """A copy in which some inputs run otherwise between samples, ``{"torque": "linear"}``.

        Raises:
            ValueError: There is no such input, or no such hold.
        """
        inputs = {channel.name: channel for channel in self.action_channels}
        for name, kind in hold.items():
            channel = place("actuator", name, inputs)
            if kind not in ("zero", "linear"):
                raise ValueError(f"hold of {name!r} is {kind!r}, expected 'zero' or 'linear'")
            inputs[name] = dataclasses.replace(channel, hold=kind)
        changed = copy.copy(self)
        changed.action_channels = tuple(inputs.values())
        return changed

    def take(self, index: Any) -> Self:
        """A copy for some rows: values given per row are indexed, the others kept."""
        values = {name: np.asarray(p.value) for name, p in self.parameters.items()}
        changed = self.with_parameters(**{n: v[index] for n, v in values.items() if v.ndim})
        changed.effects = tuple(effect.take(index) for effect in self.effects)
        return changed

    def parameter_values(self) -> dict[str, float | Array]:
        """Parameters with the changes that effects make to them."""
        values: dict[str, Any] = {name: p.value for name, p in self.parameters.items()}
        for effect in self.effects:
            if isinstance(effect, ParameterChange) and not effect.absent:
                values[effect.parameter] = values[effect.parameter] + effect.change
        return values

    def joint_effects(self) -> list[JointEffect]:
        """The forces among the effects that are not at zero strength, in their simplest parts."""
        effects = [e for e in self.effects if isinstance(e, JointEffect) and not e.absent]
        return [part for effect in effects for part in effect.parts()]

    def plays(self) -> list[Backlash]:
        """The backlashes that are not at zero strength."""
        return [e for e in self.effects if isinstance(e, Backlash) and not e.absent]

    def actuator_effects(self, actuator: str) -> list[ActuatorEffect]:
        """The effects on one input, alone or with others, that are not at zero strength."""
        there = (e for e in self.effects if isinstance(e, ActuatorEffect) and not e.absent)
        return [effect for effect in there if actuator in effect.actuators]

    def step(self, states: ArrayLike, actions: ArrayLike) -> Array:
        """Advance every row by one control period; see ``Simulator.step``."""
        return self._step(*self.check_rows(states, actions))

    def rollout(self, start: ArrayLike, actions: ArrayLike) -> Array:
        """Step through a sequence of actions; see ``Simulator.rollout``.

        An input whose channel says ``hold="linear"`` runs straight from every action to the next
        and holds the last; ``step``, which knows no next action, holds it.
        """
        if all(channel.hold == "zero" for channel in self.action_channels):
            return super().rollout(start, actions)
        start, actions = np.asarray(start, float), np.asarray(actions, float)
        single = start.ndim == 1
        if single:
            start, actions = start[None], actions[None]
        states = np.empty((len(start), actions.shape[1] + 1, start.shape[1]))
        states[:, 0] = start
        last = actions.shape[1] - 1
        for k in range(last + 1):
            upcoming = clipped(self, actions[:, min(k + 1, last)])
            states[:, k + 1] = self._step(*self.check_rows(states[:, k], actions[:, k]), upcoming)
        return states[0] if single else states

    def _step(self, states: Array, actions: Array, upcoming: Array | None = None) -> Array:
        if not self.effects and upcoming is None:
            inputs = np.repeat(actions[:, None, :], self.substeps, axis=1)
            return self._move(states, inputs, np.full(len(states), self.dt))
        own = len(self.integrated_channels)
        following = np.empty_like(states)
        inputs, following[:, own:] = next_inputs(self, states[:, own:], actions, upcoming)
        durations = np.full(len(states), self.dt)
        true = self._move(self.unsense(states[:, :own]), inputs, durations)
        following[:, :own] = self.sense(true)
        return following

    def _move(self, states: Array, inputs: Array, durations: Array) -> Array:
        """What ``step`` integrates with; a subclass may have something slower of record."""
        return self.integrate(states, inputs, durations)

    def drive(
        self,
        actions: ArrayLike,
        durations: ArrayLike,
        substeps: int | None = None,
        hold: Hold | Sequence[Hold] | None = None,
        before: ArrayLike | None = None,
        rises: bool = False,
        begins: Sequence[int] = (),
    ) -> Array:
        """Effective inputs of a recorded trajectory: its commands through the actuator path.

        Args:
            actions: shape (T, n_a), the command at the start of each sample interval.
            durations: shape (T,), lengths of the intervals in seconds.
            substeps: Sub-steps per interval; by default the simulator's own.
            hold: How commands run between samples, see ``Channel``: one for all inputs or one
                for each; by default what every channel says.
            before: shape (k, n_a), earlier commands, as far apart as the first interval is
                long; without them the input is taken to have had its first value.
            rises: Whether to tell how the input runs within sub-steps, too: ``integrate`` is
                then more accurate after jumps, with lags, and with ``hold="linear"``.
            begins: Rows at which another record begins: nothing from before is remembered.

        Returns:
            Mean input of each sub-step, shape (T, substeps, n_a), with V values of actuator
            effects (V, T, substeps, n_a); with ``rises`` a last axis of 2, for mean and rise.

        Raises:
            ValueError: The shapes do not fit, or a duration is not positive.
        """
        return driven(self, actions, durations, substeps, hold, before, rises, begins)

    def sense(self, states: Array) -> Array:
        """What the sensors read of true states, (n, n_i) -> (n, n_i)."""
        return through_sensors(self, states, forward=True)

    def unsense(self, states: Array) -> Array:
        """True states from what the sensors read: the inverse of ``sense``."""
        return through_sensors(self, states, forward=False)

    def augment(self, states: ArrayLike, actions: ArrayLike | None = None) -> Array:
        """Physical states (n, n_physical) with a sensible memory of the effects appended, (n, n_s).

        Delays hold the command ``actions`` (n, n_a) that has been applied so far (None: zero), lags
        have reached it, and every play is closed on the side that the drive pushes to.
        """
        states = np.asarray(states, float)
        if actions is None:
            actions = np.zeros((len(states), len(self.action_channels)))
        return with_memory(self, states, clipped(self, np.asarray(actions, float)))
