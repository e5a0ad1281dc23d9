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

from sims import drive as path
from sims.effects.actuator import ActuatorEffect
from sims.effects.backlash import Backlash
from sims.effects.base import Effect, place
from sims.effects.joint import JointEffect
from sims.effects.parameter import ParameterChange
from sims.effects.sensor import SensorEffect
from sims.simulator import Array, Channel, Hold, Simulator, random_values


@dataclasses.dataclass(frozen=True)
class Joint:
    """A generalized coordinate that a force can act on.

    Args:
        name: Its name in effects and reports.
        position: State channel of its position.
        rate: State channel of its rate; None for a state of a first-order system, where a
            "force" is a rate of change.
        unit: Unit of the force, ``"N m"`` or ``"N"``.
        scale: A typical force, or None to leave it to the simulator.
        driven: False if no actuator acts on it, so that it cannot have backlash.
    """

    name: str
    position: str
    rate: str | None
    unit: str
    scale: float | None = None
    driven: bool = True


class HostSimulator(Simulator):
    """A simulator that hosts effects. At strength zero each changes no bit of the output.

    Values of effects and parameters are scalars or arrays with one entry per row of a batch.
    Effects with memory (delay, lag, backlash) append ``memory`` channels to the state;
    without them the channels are the physical ones.

    Attributes:
        effects: The effects, in any order.
        joints: Where generalized forces can act.
        substeps: Sub-steps in one control period.
        has_drive_force: True if ``drive_forces`` is known, so that backlash can be hosted.
        has_contacts: True if motion jumps at impacts, so that it can be compared with logs over
            short windows only (``residual.gap.contact``).
        advances_rows_at_once: True if ``integrate`` advances all rows together, each with its own
            values of effects and parameters, so that a batch costs little more than a row.
    """

    effects: tuple[Effect, ...] = ()
    joints: tuple[Joint, ...]
    substeps: int
    has_drive_force: bool = False
    has_contacts: bool = False
    advances_rows_at_once: bool = False

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

    def smooth_states(self, n: int, rng: np.random.Generator) -> Array:
        """Random physical states where a small change has a small effect, (n, n_physical).

        By default within the scales of the channels, angles anywhere; a simulator with contacts
        keeps away from them.
        """
        return np.stack([random_values(c, n, rng) for c in self.physical_channels], axis=1)

    # -- what it is made of ---------------------------------------------------------------

    @property
    def physical_channels(self) -> tuple[Channel, ...]:
        """State channels without the memory of effects."""
        return tuple(c for c in self.state_channels if c.kind != "memory")

    @property
    def integrated_channels(self) -> tuple[Channel, ...]:
        """Columns of ``integrate``: the physical channels, then a gap for each backlash."""
        return self.state_channels[: len(self.physical_channels) + len(self.plays())]

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
        changed.state_channels += tuple(changed._memory_channels())
        return changed

    def with_parameters(self, **values: float | Array) -> Self:
        """A copy with some parameters changed; ``KeyError`` names an unknown one."""
        unknown = ", ".join(sorted(set(values) - set(self.parameters)))
        if unknown:
            raise KeyError(f"no parameter {unknown}; there are {', '.join(self.parameters)}")
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
        changed = copy.copy(self)
        changed.effects = tuple(effect.take(index) for effect in self.effects)
        changed.parameters = {
            name: dataclasses.replace(parameter, value=np.asarray(parameter.value)[index])
            if np.ndim(parameter.value)
            else parameter
            for name, parameter in self.parameters.items()
        }
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
        """The effects on one input that are not at zero strength."""
        return [
            e
            for e in self.effects
            if isinstance(e, ActuatorEffect) and e.actuator == actuator and not e.absent
        ]

    # -- one control period ---------------------------------------------------------------

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
            now = self.check_rows(states[:, k], actions[:, k])
            upcoming = self._clip(actions[:, min(k + 1, last)])
            states[:, k + 1] = self._step(*now, upcoming)
        return states[0] if single else states

    def _step(self, states: Array, actions: Array, upcoming: Array | None = None) -> Array:
        if not self.effects and upcoming is None:
            inputs = np.repeat(actions[:, None, :], self.substeps, axis=1)
            return self.integrate(states, inputs, np.full(len(states), self.dt))
        own = len(self.integrated_channels)
        following = np.empty_like(states)
        inputs, following[:, own:] = self._inputs(states[:, own:], actions, upcoming)
        durations = np.full(len(states), self.dt)
        true = self.integrate(self.unsense(states[:, :own]), inputs, durations)
        following[:, :own] = self.sense(true)
        return following

    def drive(
        self,
        actions: ArrayLike,
        durations: ArrayLike,
        substeps: int | None = None,
        hold: Hold | Sequence[Hold] | None = None,
        before: ArrayLike | None = None,
        rises: bool = False,
    ) -> Array:
        """Effective inputs of a recorded trajectory: its commands through the actuator path.

        Args:
            actions: shape (T, n_a), the command at the start of each sample interval.
            durations: shape (T,), lengths of the intervals in seconds.
            substeps: Sub-steps per interval; by default the simulator's own.
            hold: Whether a command is held over its interval (``"zero"``) or runs straight to
                the next (``"linear"``): one for all inputs or one for each; by default what
                every channel says.
            before: shape (k, n_a), earlier commands, as far apart as the first interval is
                long; without them the input is taken to have had its first value.
            rises: Whether to tell how the input runs within sub-steps too. ``integrate`` is
                then more accurate after jumps between sub-steps, with lags, and with
                ``hold="linear"``.

        Returns:
            Mean input of each sub-step, shape (T, substeps, n_a), or, if values of actuator
            effects are arrays of length V, (V, T, substeps, n_a); with ``rises`` a last
            axis of 2 is added, for mean and rise.

        Raises:
            ValueError: The shapes do not fit, or a duration is not positive.
        """
        actions, durations = np.asarray(actions, float), np.asarray(durations, float)
        expected = (len(durations), len(self.action_channels))
        if actions.shape != expected or not (durations > 0).all():
            raise ValueError(
                f"actions have shape {actions.shape}, expected {expected}: a row for each of "
                "the durations, which must be positive, and a column for each input"
            )
        substeps = substeps or self.substeps
        holds = self._holds(hold)
        earlier = np.empty((0, actions.shape[1])) if before is None else np.asarray(before, float)
        k = len(earlier)
        durations = np.concatenate([np.full(k, durations[:1]), durations])
        commands = self._clip(np.concatenate([earlier, actions]))
        columns = []
        for j, channel in enumerate(self.action_channels):
            effects = self.actuator_effects(channel.name)
            samples = path.shaped(commands[None, :, j], effects)
            late = path.total_delay(effects)
            if np.ndim(late):
                samples = np.broadcast_to(samples, (len(np.asarray(late)), samples.shape[1]))
            means, rise = path.substep_inputs(samples, durations, substeps, late, holds[j])
            for lag in path.lags(effects):
                shape = (lag.rows or len(means), *means.shape[1:])
                means, rise = np.broadcast_to(means, shape), np.broadcast_to(rise, shape)
                start = np.broadcast_to(samples[:, 0], len(means))
                means, rise, _ = path.lagged(means, rise, durations, lag.time_constant, start)
            columns.append((np.stack([means, rise], axis=-1) if rises else means)[:, k:])
        rows = {e.rows for e in self.effects if isinstance(e, ActuatorEffect)} - {None}
        if not columns:
            shape = (len(actions), substeps, 0)
            return np.empty((*shape, 2) if rises else shape)
        inputs = np.stack(np.broadcast_arrays(*columns), axis=3)
        if not rows:
            return inputs[0]
        return np.broadcast_to(inputs, (rows.pop() or 1, *inputs.shape[1:]))

    def sense(self, states: Array) -> Array:
        """What the sensors read of true states, (n, n_i) -> (n, n_i)."""
        return self._sensors(states, forward=True)

    def unsense(self, states: Array) -> Array:
        """True states from what the sensors read: the inverse of ``sense``."""
        return self._sensors(states, forward=False)

    def augment(self, states: ArrayLike, actions: ArrayLike | None = None) -> Array:
        """Physical states with a sensible memory of the effects appended.

        Args:
            states: shape (n, n_physical).
            actions: shape (n, n_a): the command that has been applied so far; zero if None.

        Returns:
            shape (n, n_s). Delays hold that command, lags have reached it, and every play is
            closed on the side that the drive pushes to.
        """
        states = np.asarray(states, float)
        n, physical = states.shape
        actions = np.zeros((n, len(self.action_channels))) if actions is None else actions
        actions = self._clip(np.asarray(actions, float))
        full = np.zeros((n, len(self.state_channels)))
        full[:, :physical] = states
        received = np.empty_like(actions)
        at = physical + len(self.plays())
        for j, channel in enumerate(self.action_channels):
            effects = self.actuator_effects(channel.name)
            received[:, j] = path.shaped(actions[:, j : j + 1], effects)[:, 0]
            kept = self._history(channel.name)
            full[:, at : at + kept] = actions[:, j : j + 1]
            at += kept
            count = len(path.lags(effects))
            full[:, at : at + count] = received[:, j : j + 1]
            at += count
        if self.plays():
            names = [joint.name for joint in self.joints]
            sides = np.sign(self.drive_forces(states, received))
            for i, play in enumerate(self.plays()):
                full[:, physical + i] = 0.5 * play.width * sides[:, names.index(play.joint)]
        return full

    # -- details --------------------------------------------------------------------------

    def _clip(self, actions: Array) -> Array:
        low = [channel.low for channel in self.action_channels]
        return np.clip(actions, low, [channel.high for channel in self.action_channels])

    def _holds(self, hold: Hold | Sequence[Hold] | None) -> list[Hold]:
        """How each input runs between samples."""
        if hold is None:
            return [channel.hold for channel in self.action_channels]
        if isinstance(hold, str):
            return [hold] * len(self.action_channels)
        if len(hold) != len(self.action_channels):
            raise ValueError(f"hold has {len(hold)} entries for {len(self.action_channels)} inputs")
        return list(hold)

    def _history(self, actuator: str) -> int:
        """Past commands that the delays of an input reach back to."""
        late = path.total_delay(self.actuator_effects(actuator))
        return int(np.ceil(np.max(late) / self.dt - 1e-9))

    def _memory_channels(self) -> Iterable[Channel]:
        channels = {channel.name: channel for channel in self.state_channels}
        joints = {joint.name: joint for joint in self.joints}
        for play in self.plays():
            position = channels[joints[play.joint].position]
            yield Channel(f"{play.joint} play", position.unit, "memory", scale=position.scale)
        for channel in self.action_channels:
            for k in range(self._history(channel.name), 0, -1):
                past = f"{channel.name} {k} ago"
                yield Channel(past, channel.unit, "memory", scale=channel.scale)
            for i, _ in enumerate(path.lags(self.actuator_effects(channel.name))):
                name = f"{channel.name} lagged" + (f" {i + 1}" if i else "")
                yield Channel(name, channel.unit, "memory", scale=channel.scale)

    def _inputs(self, memory: Array, actions: Array, upcoming: Array | None) -> tuple[Array, Array]:
        """Effective inputs of one control period and the memory after it.

        The upcoming actions matter for inputs that run straight to them.
        """
        inputs = np.repeat(actions[:, None, :], self.substeps, axis=1)
        acting = any(isinstance(effect, ActuatorEffect) for effect in self.effects)
        if not acting and upcoming is None:
            return inputs, memory
        inputs = np.stack([inputs, np.zeros_like(inputs)], axis=-1)
        after = np.empty_like(memory)
        at = 0
        for j, channel in enumerate(self.action_channels):
            effects = self.actuator_effects(channel.name)
            straight = upcoming is not None and channel.hold == "linear"
            if not effects and not straight:
                continue
            kept = self._history(channel.name)
            commands = np.concatenate([memory[:, at : at + kept], actions[:, j : j + 1]], axis=1)
            after[:, at : at + kept] = commands[:, 1:]
            at += kept
            if upcoming is not None and straight:
                commands = np.concatenate([commands, upcoming[:, j : j + 1]], axis=1)
            means, rises = path.substep_inputs(
                path.shaped(commands, effects),
                np.full(commands.shape[1], self.dt),
                self.substeps,
                path.total_delay(effects),
                "linear" if straight else "zero",
            )
            means, rises = means[:, kept : kept + 1], rises[:, kept : kept + 1]
            for lag in path.lags(effects):
                means, rises, after[:, at] = path.lagged(
                    means, rises, np.array([self.dt]), lag.time_constant, memory[:, at]
                )
                at += 1
            inputs[:, :, j] = np.stack([means[:, 0], rises[:, 0]], axis=-1)
        return inputs, after

    def _sensors(self, states: Array, forward: bool) -> Array:
        effects = [e for e in self.effects if isinstance(e, SensorEffect) and not e.absent]
        if not effects:
            return states
        states = np.array(states, float)
        names = [channel.name for channel in self.physical_channels]
        for effect in sorted(effects, key=lambda effect: effect.stage, reverse=not forward):
            column = names.index(effect.channel)
            change = effect.read if forward else effect.undo
            states[:, column] = change(states[:, column])
        return states
