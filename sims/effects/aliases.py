"""Effects of a simulator that no data could ever tell apart, found by probing its equations."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sims.effects.actuator import AND, ActuatorBias, ActuatorGain
from sims.effects.base import Effect
from sims.effects.friction import DryFriction
from sims.effects.inertia import AddedInertia
from sims.effects.joint import JointEffect
from sims.effects.library import library
from sims.effects.parameter import ParameterChange
from sims.effects.sensor import EncoderScale, ScaledSensor, SensorEffect, SensorOffset
from sims.simulator import Array, random_values

if TYPE_CHECKING:
    from sims.host import HostSimulator

#: Part of the states in which an effect's response is not proportional, from which on nothing is
#: known of it: of a change that drowns in a solver's tolerance, nowhere.
ROUGH = 0.25
#: Numbers that have to be left for each effect: in as many as there are effects, everything
#: depends on everything.
NUMBERS = 2
#: Most sets of one size that are looked at; larger sets are then left out.
SETS = 400_000
#: Sets looked at in one go.
AT_ONCE = 20_000


@dataclasses.dataclass(frozen=True)
class Alias:
    """Effects of which each can be replaced by the others, in any data.

    Args:
        effects: Two that have the same consequence, or three or four of which any one
            equals a combination of the rest; written ``name@where``.
        says: The same in words.
        combination: True if one equals a combination of the rest, False if each equals any other.
    """

    effects: tuple[str, ...]
    says: str
    combination: bool = False


def exact_aliases(
    simulator: HostSimulator,
    rng: np.random.Generator | None = None,
    most: int = 4,
    seen: tuple[Array, Array] | None = None,
    among: Collection[str] | None = None,
) -> tuple[Alias, ...]:
    """Sets of effects that are exactly dependent in the simulator's own equations.

    Found by probing: the change of the motion per strength is compared over random states and
    inputs. It covers changes of parameters, gains, biases and the forces that are linear in
    one strength; pairs first, then one representative of each pair in larger sets. Of effects
    whose response is not proportional to their strength nothing is said, nor of large sets where
    there are too many of them.

    Args:
        simulator: A host, with or without effects.
        rng: Source of the random states; a fixed seed by default.
        most: Largest set that is looked for.
        seen: States (n, n_s) and inputs (n, n_a) of a log, where what is alike has to be so, too:
            random states are as large as channels' scales, and equations may change beyond.
        among: Labels of the effects that are compared; by default all of the library.
    """
    plain = simulator.with_effects(())
    drawn = probes(plain, rng or np.random.default_rng(0))
    columns, blurs = linear_columns(plain, *drawn, among)
    there = linear_columns(plain, *seen, among) if seen is not None else ({}, {})

    def alike_there(names: Sequence[str]) -> bool:
        return not all(name in there[0] for name in names) or _dependent(names, *there)

    found: list[Alias] = []
    alike: dict[str, list[str]] = {}
    for name in columns:
        twin = next(
            (n for n in alike if _dependent([n, name], columns, blurs) and alike_there([n, name])),
            None,
        )
        alike.setdefault(twin or name, []).append(name)
    for twins in alike.values():
        if len(twins) > 1:
            says = f"{', '.join(twins)}: the same motion, no data tells which"
            found.append(Alias(tuple(twins), says))
    sets: list[set[str]] = []
    # What acts on several inputs alike is no news as the sum of what acts on each.
    single = [name for name in alike if AND not in name]
    involved = _in_null_space({name: columns[name] for name in single}, blurs)
    for size in range(3, most + 1):
        for names in _perhaps_dependent(involved, size, columns, blurs):
            if any(known <= set(names) for known in sets):
                continue
            if _dependent(names, columns, blurs) and alike_there(names):
                sets.append(set(names))
                rest = ", ".join(names)
                found.append(Alias(names, f"{rest}: any one is a combination of the others", True))
    return tuple(found)


def exact_twins(simulator: HostSimulator) -> dict[str, frozenset[str]]:
    """By label of an effect all labels of the same motion, its own included; see ``Alias``.

    Effects without a twin are left out.
    """
    pairs = [alias.effects for alias in exact_aliases(simulator) if not alias.combination]
    return {name: frozenset(twins) for twins in pairs for name in twins}


def probes(simulator: HostSimulator, rng: np.random.Generator) -> tuple[Array, Array]:
    """Random states (96, n_s) and inputs (96, n_a) where a small change has a small effect."""
    states = simulator.smooth_states(96, rng)
    inputs = np.empty((96, len(simulator.action_channels)))  # a system may have none
    for column, channel in enumerate(simulator.action_channels):
        inputs[:, column] = random_values(channel, 96, rng)
    return states, inputs


def shortly_after(simulator: HostSimulator, states: Array, inputs: Array) -> Array:
    """States a tenth of a control period later, (n, n_s)."""
    # The actuator path is applied to the input here, where it has no memory.
    commands = simulator.drive(inputs, np.ones(len(inputs)), 2, hold="zero")
    return simulator.integrate(states, commands, np.full(len(states), 0.1 * simulator.dt))


def _alone(simulator: HostSimulator, channel: str) -> bool:
    """Whether a state has neither a rate nor a position that its readings would contradict."""
    return not any(
        c.kind == "rate" and c.rate_of is not None and channel in (c.name, c.rate_of)
        for c in simulator.state_channels
    )


def _read_after(
    simulator: HostSimulator, sensor: SensorEffect, states: Array, inputs: Array
) -> Array:
    """Readings a tenth of a control period after readings of ``states``, (n, n_s)."""
    true = states.copy()
    sensor.through(simulator, true, forward=False)
    after = shortly_after(simulator, true, inputs)
    sensor.through(simulator, after, forward=True)
    return after


def linear_columns(
    plain: HostSimulator, states: Array, inputs: Array, among: Collection[str] | None = None
) -> tuple[dict[str, Array], dict[str, float]]:
    """Change of the motion per strength of every effect that is linear in one, of unit length;
    ``among``: of these labels only."""
    near: dict[str, Array] = {}
    far: dict[str, Array] = {}
    # Of twins the first is named: what moves is more often off than what reads it.
    for effect in sorted(library(plain), key=lambda e: isinstance(e, SensorEffect)):
        if not _is_linear(plain, effect) or (among is not None and str(effect) not in among):
            continue
        (strength,) = effect.strengths()
        response = change(plain, effect, strength, states, inputs, 1e-4)
        if np.any(response):
            near[str(effect)] = response
            far[str(effect)] = change(plain, effect, strength, states, inputs, 3e-4)
    return _columns(near, far)


def _is_linear(simulator: HostSimulator, effect: Effect) -> bool:
    """Whether a small effect changes the motion, or its readings, in proportion to one strength."""
    if isinstance(effect, SensorOffset | ScaledSensor):
        return isinstance(effect, EncoderScale) or _alone(simulator, effect.channel)
    force = isinstance(effect, JointEffect) and not isinstance(effect, DryFriction)
    proportional = ParameterChange | ActuatorGain | ActuatorBias | AddedInertia
    return (force or isinstance(effect, proportional)) and len(effect.strengths()) == 1


def _columns(
    near: dict[str, Array], far: dict[str, Array]
) -> tuple[dict[str, Array], dict[str, float]]:
    """Responses as vectors of unit length, and how far each is known.

    A response to a change three times as large tells: states in which they differ, such as one
    where a motor in a solver is just about to saturate, are left out, and so are effects that
    would leave hardly any.
    """
    rough = {}
    for name, response in near.items():
        off = np.linalg.norm(response - far[name], axis=1)
        rough[name] = off >= 1e-3 * np.sqrt(np.mean(response**2) * response.shape[1])
    known = [name for name, where in rough.items() if where.mean() <= ROUGH]
    columns: dict[str, Array] = {}
    blurs: dict[str, float] = {}
    if not known:
        return columns, blurs
    smooth = ~np.any([rough[name] for name in known], axis=0)
    if near[known[0]][smooth].size < NUMBERS * len(known):
        return columns, blurs
    for name in known:
        size = np.linalg.norm(near[name][smooth])
        if size > 0:
            columns[name] = near[name][smooth].ravel() / size
            blurs[name] = float(np.linalg.norm((near[name] - far[name])[smooth]) / size)
    return columns, blurs


def _in_null_space(columns: dict[str, Array], blurs: dict[str, float]) -> list[str]:
    """Those that can be part of a dependent set: they have a share in some null vector of all."""
    if not columns:
        return []
    matrix = np.stack(list(columns.values()), axis=1)
    _, sizes, vectors = np.linalg.svd(matrix, full_matrices=False)
    shares = np.abs(vectors[sizes < max(1e-3, 10 * max(blurs.values()))])
    return [name for name, share in zip(columns, shares.T, strict=True) if (share > 1e-2).any()]


def _perhaps_dependent(
    names: Sequence[str], size: int, columns: dict[str, Array], blurs: dict[str, float]
) -> list[tuple[str, ...]]:
    """The sets of a size that may be dependent, by the products of their responses.

    None if there are more than ``SETS`` to look at.
    """
    if not math.comb(len(names), size) <= SETS or len(names) < size:
        return []
    matrix = np.stack([columns[name] for name in names])
    products, blur = matrix @ matrix.T, np.array([blurs[name] for name in names])
    every = np.array(list(itertools.combinations(range(len(names)), size)))
    found: list[tuple[str, ...]] = []
    for first in range(0, len(every), AT_ONCE):
        sets = every[first : first + AT_ONCE]
        least = np.linalg.eigvalsh(products[sets[:, :, None], sets[:, None, :]])[:, 0]
        # Products are rounded in their last digits, and these are squares.
        limit = _limit(blur[sets].max(axis=1)) ** 2 + 1e-13
        found += [tuple(names[i] for i in numbers) for numbers in sets[least < limit]]
    return found


def _dependent(names: Sequence[str], columns: dict[str, Array], blurs: dict[str, float]) -> bool:
    matrix = np.stack([columns[name] for name in names])
    limit = _limit(np.array([blurs[name] for name in names]).max())
    return bool(np.linalg.svd(matrix, compute_uv=False)[-1] < limit)


def _limit(blur: Array) -> Array:
    """Length of a combination below which it is none, by the blur of the least known response."""
    return np.maximum(1e-6, 2 * blur)


def change(
    simulator: HostSimulator,
    effect: Effect,
    strength: str,
    states: Array,
    inputs: Array,
    share: float,
) -> Array:
    """Change of the motion over a tenth of a control period per strength of an effect, (n, n_s);
    none where the motion is not defined.

    Args:
        simulator: Without effects.
        effect: One whose other strengths are zero.
        strength: The one that is changed.
        states, inputs: Where, (n, n_s) and (n, n_a).
        share: How far, in scales of the strength.
    """
    size = share * effect.quantities(simulator)[strength].scale
    ends = []
    scale = np.array([channel.scale for channel in simulator.physical_channels])
    with np.errstate(all="ignore"):
        for value in (size, -size):
            changed = effect.with_values(**{strength: value})
            if isinstance(changed, SensorEffect):
                ends.append(_read_after(simulator, changed, states, inputs))
            else:
                ends.append(shortly_after(simulator.with_effects([changed]), states, inputs))
        found = (ends[0] - ends[1]) / (scale * size)
    return np.where(np.isfinite(found).all(axis=1, keepdims=True), found, 0.0)
