"""The actuator path of a simulator: inputs of recorded runs and of one period, and its memory."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from sims import drive as path
from sims import followers as follow
from sims.effects.actuator import ActuatorEffect
from sims.effects.dimensions import product
from sims.effects.flexible import flexible_parts
from sims.effects.hysteresis import Hysteresis
from sims.effects.slew import SlewLimit
from sims.effects.store import stores
from sims.simulator import Array, Channel, Hold

if TYPE_CHECKING:
    from sims.host import HostSimulator


def history(simulator: HostSimulator, actuator: str) -> int:
    """Past commands that the delays of an input reach back to."""
    late = path.total_delay(simulator.actuator_effects(actuator))
    return int(np.ceil(np.max(late) / simulator.dt - 1e-9))


def moving_memory(simulator: HostSimulator) -> int:
    """Memory channels that move with the physical ones: plays, then stores, then parts."""
    return len(simulator.plays()) + len(stores(simulator)) + 2 * len(flexible_parts(simulator))


def memory_channels(simulator: HostSimulator) -> Iterator[Channel]:
    """Channels of plays, stores, flexible parts, past commands, lagged inputs, in this order."""
    channels = {channel.name: channel for channel in simulator.state_channels}
    joints = {joint.name: joint for joint in simulator.joints}
    for play in simulator.plays():
        position = channels[joints[play.joint].position]
        yield Channel(f"{play.joint} play", position.unit, "memory", scale=position.scale)
    for store in stores(simulator):
        filled = channels[joints[store.joint].position]
        yield Channel(f"{store.joint} store", filled.unit, "memory", scale=filled.scale)
    for part in flexible_parts(simulator):
        rate = channels[str(joints[part.joint].rate)]
        place = product({"rate": 1, "time": 1}, {"rate": (rate.unit, 1.0), "time": ("s", 1.0)})
        swing = 2 * np.pi * float(np.max(part.frequency))
        yield Channel(f"{part.joint} part", place, "memory", scale=rate.scale / swing)
        yield Channel(f"{part.joint} part rate", rate.unit, "memory", scale=rate.scale)
    for channel in simulator.action_channels:
        for k in range(history(simulator, channel.name), 0, -1):
            past = f"{channel.name} {k} ago"
            yield Channel(past, channel.unit, "memory", scale=channel.scale)
        for i, _ in enumerate(follow.followers(simulator.actuator_effects(channel.name))):
            name = f"{channel.name} lagged" + (f" {i + 1}" if i else "")
            yield Channel(name, channel.unit, "memory", scale=channel.scale)


def clipped(simulator: HostSimulator, actions: Array) -> Array:
    """Commands within the bounds of their channels."""
    low = [channel.low for channel in simulator.action_channels]
    return np.clip(actions, low, [channel.high for channel in simulator.action_channels])


def driven(
    simulator: HostSimulator,
    actions: ArrayLike,
    durations: ArrayLike,
    substeps: int | None,
    hold: Hold | Sequence[Hold] | None,
    before: ArrayLike | None,
    rises: bool,
    begins: Sequence[int],
) -> Array:
    """Effective inputs of a recorded trajectory; see ``HostSimulator.drive``."""
    actions, durations = np.asarray(actions, float), np.asarray(durations, float)
    expected = (len(durations), len(simulator.action_channels))
    if actions.shape != expected or not (durations > 0).all():
        raise ValueError(
            f"actions have shape {actions.shape}, expected {expected}: a row for each of "
            "the durations, which must be positive, and a column for each input"
        )
    if hold is None or isinstance(hold, str):
        hold = [hold or channel.hold for channel in simulator.action_channels]
    if len(hold) != len(simulator.action_channels):
        count = len(simulator.action_channels)
        raise ValueError(f"hold has {len(hold)} entries for {count} inputs")
    earlier = np.empty((0, actions.shape[1])) if before is None else np.asarray(before, float)
    k = len(earlier)
    durations = np.concatenate([np.full(k, durations[:1]), durations])
    commands = clipped(simulator, np.concatenate([earlier, actions]))
    bounds = [0, *(k + begin for begin in begins), len(commands)]
    fine = substeps or simulator.substeps
    inputs = recorded_inputs(simulator, commands, durations, fine, hold, bounds)
    inputs = inputs[:, k:] if rises else inputs[:, k:, ..., 0]
    rows = {e.rows for e in simulator.effects if isinstance(e, ActuatorEffect)} - {None}
    return np.broadcast_to(inputs, (rows.pop() or 1, *inputs.shape[1:])) if rows else inputs[0]


def with_memory(simulator: HostSimulator, states: Array, actions: Array) -> Array:
    """Physical states with the memory that a command has left which was applied for long.

    Args:
        simulator: Gives effects and joints.
        states: (n, n_physical).
        actions: (n, n_a) within their bounds.

    Returns:
        (n, n_s), see ``HostSimulator.augment``.
    """
    n, physical = states.shape
    full = np.zeros((n, len(simulator.state_channels)))
    full[:, :physical] = states
    received = np.empty_like(actions)
    at = physical + len(simulator.plays())
    for store in stores(simulator):
        full[:, at] = states[:, [joint.name for joint in simulator.joints].index(store.joint)]
        at += 1
    at += 2 * len(flexible_parts(simulator))
    for j, channel in enumerate(simulator.action_channels):
        effects = simulator.actuator_effects(channel.name)
        received[:, j] = path.shaped(actions[:, j : j + 1], effects)[:, 0]
        kept = history(simulator, channel.name)
        full[:, at : at + kept] = actions[:, j : j + 1]
        at += kept
        count = len(follow.followers(effects))
        full[:, at : at + count] = received[:, j : j + 1]
        at += count
    if simulator.plays():
        names = [joint.name for joint in simulator.joints]
        sides = np.sign(simulator.drive_forces(states, received))
        for i, play in enumerate(simulator.plays()):
            full[:, physical + i] = 0.5 * play.width * sides[:, names.index(play.joint)]
    return full


def recorded_inputs(
    simulator: HostSimulator,
    commands: Array,
    durations: Array,
    substeps: int,
    holds: Sequence[Hold],
    bounds: Sequence[int],
) -> Array:
    """Mean and rise of every input in every sub-step of records, (V, T, substeps, n_a, 2).

    Args:
        simulator: Gives the effects on the inputs.
        commands: (T, n_a) within their bounds.
        durations: (T,) seconds.
        substeps: In each interval.
        holds: How each input runs between samples.
        bounds: Where each record begins, and T.
    """
    columns = []
    for j, channel in enumerate(simulator.action_channels):
        effects = simulator.actuator_effects(channel.name)
        samples = path.shaped(commands[None, :, j], effects)
        late = path.total_delay(effects)
        if np.ndim(late):
            samples = np.broadcast_to(samples, (len(np.asarray(late)), samples.shape[1]))
        means, rises = path.substep_inputs(samples, durations, substeps, late, holds[j], bounds)
        for one in follow.followers(effects):
            shape = (one.rows or len(means), *means.shape[1:])
            means, rises = np.broadcast_to(means, shape), np.broadcast_to(rises, shape)
            start = np.broadcast_to(samples[:, bounds[:-1]], (len(means), len(bounds) - 1))
            means, rises, _ = followed(simulator, one, means, rises, durations, start, bounds)
        columns.append(np.stack([means, rises], axis=-1))
    if not columns:
        return np.empty((1, len(commands), substeps, 0, 2))
    return np.stack(np.broadcast_arrays(*columns), axis=3)


def followed(
    simulator: HostSimulator,
    effect: follow.Follower,
    means: Array,
    rises: Array,
    durations: Array,
    start: Array,
    bounds: Sequence[int],
) -> tuple[Array, Array, Array]:
    """What comes out of a lag, as the simulator filters, of a limit of pace, or of a play; see
    ``sims.followers.lagged``."""
    if isinstance(effect, SlewLimit):
        slow = effect.seconds_per_unit
        return follow.limited(means, rises, durations, slow, start, bounds)
    if isinstance(effect, Hysteresis):
        return follow.dragged(means, rises, durations, effect.width, start, bounds)
    return simulator.lagged(means, rises, durations, effect.time_constant, start, bounds)


def next_inputs(
    simulator: HostSimulator, memory: Array, actions: Array, upcoming: Array | None
) -> tuple[Array, Array]:
    """Effective inputs of one control period and the memory after it.

    Args:
        simulator: Gives the effects on the inputs.
        memory: (n, n_memory) past commands and lagged inputs.
        actions: (n, n_a) within their bounds.
        upcoming: The actions after them, for inputs that run straight to these; None to hold.

    Returns:
        Inputs as ``HostSimulator.integrate`` wants them, and the memory after the period.
    """
    inputs = np.repeat(actions[:, None, :], simulator.substeps, axis=1)
    acting = any(isinstance(effect, ActuatorEffect) for effect in simulator.effects)
    if not acting and upcoming is None:
        return inputs, memory
    inputs = np.stack([inputs, np.zeros_like(inputs)], axis=-1)
    after = np.empty_like(memory)
    at = 0
    for j, channel in enumerate(simulator.action_channels):
        effects = simulator.actuator_effects(channel.name)
        straight = upcoming is not None and channel.hold == "linear"
        if not effects and not straight:
            continue
        kept = history(simulator, channel.name)
        commands = np.concatenate([memory[:, at : at + kept], actions[:, j : j + 1]], axis=1)
        after[:, at : at + kept] = commands[:, 1:]
        at += kept
        if upcoming is not None and straight:
            commands = np.concatenate([commands, upcoming[:, j : j + 1]], axis=1)
        means, rises = path.substep_inputs(
            path.shaped(commands, effects),
            np.full(commands.shape[1], simulator.dt),
            simulator.substeps,
            path.total_delay(effects),
            "linear" if straight else "zero",
            (0, commands.shape[1]),
        )
        means, rises = means[:, kept : kept + 1], rises[:, kept : kept + 1]
        for one in follow.followers(effects):
            means, rises, after[:, at] = followed(
                simulator, one, means, rises, np.array([simulator.dt]), memory[:, at, None], (0, 1)
            )
            at += 1
        inputs[:, :, j] = np.stack([means[:, 0], rises[:, 0]], axis=-1)
    return inputs, after
