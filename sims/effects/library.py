"""Which effects a simulator can host, and which of them no data could ever tell apart."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sims.effects.actuator import (
    AND,
    ActuatorBias,
    ActuatorGain,
    ActuatorLag,
    DeadZone,
    Delay,
    Saturation,
)
from sims.effects.backlash import Backlash
from sims.effects.base import Effect
from sims.effects.friction import (
    CoulombFriction,
    DirectionalFriction,
    DryFriction,
    StribeckFriction,
)
from sims.effects.joint import (
    Cogging,
    ConstantLoad,
    CubicSpring,
    JointEffect,
    LinearSpring,
    QuadraticDrag,
    ViscousFriction,
)
from sims.effects.parameter import ParameterChange
from sims.effects.sensor import SensorOffset, SensorScale
from sims.simulator import Array, random_values

if TYPE_CHECKING:
    from sims.host import HostSimulator

JOINT_EFFECTS: tuple[type[Effect], ...] = (
    ViscousFriction,
    CoulombFriction,
    StribeckFriction,
    DirectionalFriction,
    QuadraticDrag,
    LinearSpring,
    CubicSpring,
    ConstantLoad,
    Cogging,
    Backlash,
)
ACTUATOR_EFFECTS = (ActuatorGain, ActuatorBias, DeadZone, Saturation, Delay, ActuatorLag)
#: What inputs of one kind have in common: amplifiers, motors and links of one make.
SHARED_EFFECTS = (ActuatorGain, DeadZone, Saturation, Delay, ActuatorLag)
#: Most inputs that have something in common.
ROTORS = 4
SENSOR_EFFECTS = (SensorOffset, SensorScale)


def library(simulator: HostSimulator) -> tuple[Effect, ...]:
    """Every effect that the simulator offers, at zero strength and with typical shapes."""
    own = simulator.offered_effects()
    if own is not None:
        return own
    places: list[tuple[type[Effect], str]] = []
    for joint in simulator.joints:
        places += [(effect, joint.name) for effect in JOINT_EFFECTS]
    for channel in simulator.action_channels:
        places += [(effect, channel.name) for effect in ACTUATOR_EFFECTS]
    for names in like_inputs(simulator):
        places += [(effect, AND.join(names)) for effect in SHARED_EFFECTS]
    for channel in simulator.physical_channels:
        places += [(effect, channel.name) for effect in SENSOR_EFFECTS]
    places += [(ParameterChange, name) for name in simulator.parameters]
    found = []
    for kind, where in places:
        effect = kind(where)  # type: ignore[call-arg]
        try:
            known = effect.quantities(simulator)
        except ValueError:
            continue
        typical = {
            name: quantity.starts[len(quantity.starts) // 2]
            for name, quantity in known.items()
            if quantity.role == "shape" and quantity.starts
        }
        found.append(effect.with_values(**typical))
    return tuple(found)


def like_inputs(simulator: HostSimulator) -> list[tuple[str, ...]]:
    """Names of two to four inputs with the same unit, finite bounds, scale and hold, by kind.

    So many wheels, thrusters or rotors are of one make. Without bounds nothing says so, and more
    inputs are the joints of a robot, of which each has an actuator and a load of its own.
    """
    kinds: dict[tuple[object, ...], list[str]] = {}
    for c in simulator.action_channels:
        if np.isfinite([c.low, c.high]).all():
            kinds.setdefault((c.unit, c.low, c.high, c.scale, c.hold), []).append(c.name)
    return [tuple(names) for names in kinds.values() if 1 < len(names) <= ROTORS]


def typical(effect: Effect, simulator: HostSimulator, share: float = 1.0) -> Effect:
    """The effect at a strength comparable to what the simulator does already.

    A saturation, which is absent at an infinite level, gets a level that cuts half.
    """
    values = {}
    for name, quantity in effect.quantities(simulator).items():
        if quantity.role == "strength":
            usual = share * quantity.scale
            values[name] = usual if np.isfinite(quantity.nominal) else 0.5 * quantity.scale
    return effect.with_values(**values)


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
    simulator: HostSimulator, rng: np.random.Generator | None = None, most: int = 4
) -> tuple[Alias, ...]:
    """Sets of effects that are exactly dependent in the simulator's own equations.

    Found by probing: the change of the motion per strength is compared over random states and
    inputs. It covers changes of parameters, gains, biases and the forces that are linear in
    one strength; pairs first, then one representative of each pair in larger sets.

    Args:
        simulator: A host, with or without effects.
        rng: Source of the random states; a fixed seed by default.
        most: Largest set that is looked for.
    """
    columns, blurs = _linear(simulator, rng or np.random.default_rng(0))
    found: list[Alias] = []
    alike: dict[str, list[str]] = {}
    for name in columns:
        twin = next((n for n in alike if _dependent([n, name], columns, blurs)), None)
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
        for names in itertools.combinations(involved, size):
            if any(known <= set(names) for known in sets):
                continue
            if _dependent(names, columns, blurs):
                sets.append(set(names))
                rest = ", ".join(names)
                found.append(Alias(names, f"{rest}: any one is a combination of the others", True))
    return tuple(found)


def near_combinations(
    simulator: HostSimulator,
    names: Sequence[str],
    share: float = 0.03,
    rng: np.random.Generator | None = None,
) -> tuple[str, ...]:
    """Single effects that some effects imitate together, all but a small share of the motion.

    A pendulum's mass, for example, is its inertia and its motor's resistance but for the
    damping of the bearing, which is little beside the motor's.

    Args:
        simulator: A host, with or without effects.
        names: The effects that act together, ``name@where``.
        share: Part of the motion that may differ.
        rng: As for ``exact_aliases``, like the effects that are compared.
    """
    columns, _ = _linear(simulator, rng or np.random.default_rng(0))
    if not all(name in columns for name in names):
        return ()
    size = min(len(column) for column in columns.values())
    matrix = np.stack([columns[name][:size] for name in names], axis=1)
    found = []
    for name, column in columns.items():
        rest = column - matrix @ np.linalg.lstsq(matrix, column, rcond=None)[0]
        if name not in names and np.linalg.norm(rest) < share:
            found.append(name)
    return tuple(found)


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


def _linear(
    simulator: HostSimulator, rng: np.random.Generator
) -> tuple[dict[str, Array], dict[str, float]]:
    """Change of the motion per strength of every effect that is linear in one, of unit length."""
    plain = simulator.with_effects(())
    states, inputs = probes(plain, rng)
    near: dict[str, Array] = {}
    far: dict[str, Array] = {}
    for effect in library(plain):
        linear = isinstance(effect, JointEffect) and not isinstance(effect, DryFriction)
        if linear or isinstance(effect, ParameterChange | ActuatorGain | ActuatorBias):
            if len(effect.strengths()) != 1:
                continue
            response = _response(plain, effect, states, inputs, 1e-4)
            if np.any(response):
                near[str(effect)] = response
                far[str(effect)] = _response(plain, effect, states, inputs, 3e-4)
    return _columns(near, far)


def _columns(
    near: dict[str, Array], far: dict[str, Array]
) -> tuple[dict[str, Array], dict[str, float]]:
    """Responses as vectors of unit length, and how far each is known.

    A response to a change three times as large tells: states in which they differ, such as one
    where a motor in a solver is just about to saturate, are left out.
    """
    smooth = np.ones(len(next(iter(near.values()))), dtype=bool) if near else np.empty(0, bool)
    for name, response in near.items():
        off = np.linalg.norm(response - far[name], axis=1)
        smooth &= off < 1e-3 * np.sqrt(np.mean(response**2) * response.shape[1])
    columns, blurs = {}, {}
    for name, response in near.items():
        size = np.linalg.norm(response[smooth])
        if size > 0:
            columns[name] = response[smooth].ravel() / size
            blurs[name] = float(np.linalg.norm((response - far[name])[smooth]) / size)
    return columns, blurs


def _in_null_space(columns: dict[str, Array], blurs: dict[str, float]) -> list[str]:
    """Those that can be part of a dependent set: they have a share in some null vector of all."""
    if not columns:
        return []
    matrix = np.stack(list(columns.values()), axis=1)
    _, sizes, vectors = np.linalg.svd(matrix, full_matrices=False)
    shares = np.abs(vectors[sizes < max(1e-3, 10 * max(blurs.values()))])
    return [name for name, share in zip(columns, shares.T, strict=True) if (share > 1e-2).any()]


def _dependent(names: Sequence[str], columns: dict[str, Array], blurs: dict[str, float]) -> bool:
    matrix = np.stack([columns[name] for name in names])
    known = max(1e-6, 2 * max(blurs[name] for name in names))
    return bool(np.linalg.svd(matrix, compute_uv=False)[-1] < known)


def _response(
    simulator: HostSimulator, effect: Effect, states: Array, inputs: Array, share: float
) -> Array:
    """Change of the motion over a tenth of a control period per strength, (n, n_s)."""
    (name,) = effect.strengths()
    change = share * effect.quantities(simulator)[name].scale
    ends = []
    for value in (change, -change):
        changed = simulator.with_effects([effect.with_values(**{name: value})])
        ends.append(shortly_after(changed, states, inputs))
    scale = np.array([channel.scale for channel in simulator.physical_channels])
    return (ends[0] - ends[1]) / (scale * change)
