"""Which effects a simulator can host."""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from sims.effects.actuator import (
    AND,
    ActuatorBias,
    ActuatorGain,
    ActuatorLag,
    AsymmetricActuator,
    DeadZone,
    Delay,
    QuadraticActuator,
    Saturation,
)
from sims.effects.backlash import Backlash
from sims.effects.base import Effect
from sims.effects.coupling import BY, Coupling, coupled_states
from sims.effects.curve import Curve
from sims.effects.curves import CURVES
from sims.effects.drive_limit import DriveLimit
from sims.effects.encoder_error import EncoderError
from sims.effects.exchange import Exchange, like_states, meeting_states
from sims.effects.flexible import FlexibleJoint, FlexiblePart
from sims.effects.flow import AmbientFlow
from sims.effects.friction import (
    ConstantLoss,
    CoulombFriction,
    DirectionalFriction,
    LoadDependentFriction,
    StribeckFriction,
)
from sims.effects.hysteresis import Hysteresis
from sims.effects.inertia import AddedInertia, CrankInertia
from sims.effects.joint import (
    AsymmetricDamping,
    Cogging,
    ConstantLoad,
    CubicSpring,
    JointEffect,
    LinearSpring,
    NegativeStiffness,
    QuadraticDrag,
    Unbalance,
    ViscousFriction,
)
from sims.effects.limit import RateLimit, follows_command, goals
from sims.effects.link import (
    AsymmetricCouplingDamping,
    CouplingDamper,
    CouplingSpring,
    CouplingUnbalance,
    linked_joints,
)
from sims.effects.loss import PowerLoss, ProportionalLoss
from sims.effects.parameter import ParameterChange
from sims.effects.pull import pulled_by_position, pulled_by_turn
from sims.effects.reaction import Reaction
from sims.effects.response import AsymmetricResponse
from sims.effects.sensor import EncoderScale, SensorOffset, SensorScale
from sims.effects.slew import SlewLimit
from sims.effects.stop import LowerStop, UpperStop
from sims.effects.store import SecondStore
from sims.simulator import random_values

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
    ProportionalLoss,
    SecondStore,
    Cogging,
    Unbalance,
    Backlash,
)
ACTUATOR_EFFECTS: tuple[type[Effect], ...] = (
    ActuatorGain,
    QuadraticActuator,
    ActuatorBias,
    DeadZone,
    Saturation,
    Delay,
    ActuatorLag,
)
#: What inputs of one kind have in common: amplifiers, motors and links of one make.
SHARED_EFFECTS = (ActuatorGain, QuadraticActuator, DeadZone, Saturation, Delay, ActuatorLag)
#: Places where it is tried whether inputs move a joint.
PLACES = 8
#: Most inputs that have something in common.
ROTORS = 4
SENSOR_EFFECTS = (SensorOffset, SensorScale, EncoderScale)


def library(simulator: HostSimulator) -> tuple[Effect, ...]:
    """Every effect that the simulator offers, at zero strength and with typical shapes."""
    own = simulator.offered_effects()
    if own is not None:
        return own
    places: list[tuple[type[Effect], str]] = []
    for joint in simulator.joints:
        places += [(effect, joint.name) for effect in JOINT_EFFECTS]
        if follows_command(simulator, joint.name):
            places.append((RateLimit, joint.name))
    places += [(Exchange, AND.join(names)) for names in like_states(simulator)]
    for channel in simulator.action_channels:
        places += [(effect, channel.name) for effect in ACTUATOR_EFFECTS]
    places += [(SlewLimit, name) for name in goals(simulator)]
    for names in like_inputs(simulator):
        places += [(effect, AND.join(names)) for effect in SHARED_EFFECTS]
    for channel in simulator.physical_channels:
        places += [(effect, channel.name) for effect in SENSOR_EFFECTS]
    places += [(ParameterChange, name) for name in simulator.parameters]
    # After parameters, which many a system has for it.
    places += [(AddedInertia, joint.name) for joint in simulator.joints]
    found = []
    for kind, where in places:
        effect = kind(where)  # type: ignore[call-arg]
        try:
            known = effect.quantities(simulator)
        except ValueError:
            continue
        if kind is Unbalance and pulled_by_turn(simulator, where):
            continue  # what pulls by direction has parameters of its own
        typical = {
            name: quantity.starts[len(quantity.starts) // 2]
            for name, quantity in known.items()
            if quantity.role != "strength" and quantity.starts
        }
        found.append(effect.with_values(**typical))
    return tuple(found)


def curves_in(simulator: HostSimulator) -> tuple[Curve, ...]:
    """Every curve by points that a simulator can host, at zero strength and over no range yet."""
    joints = [joint.name for joint in simulator.joints]
    inputs = [channel.name for channel in simulator.action_channels]
    inputs += [AND.join(names) for names in like_inputs(simulator)]
    found = []
    for kind in CURVES:
        for where in joints if issubclass(kind, JointEffect) else inputs:
            curve = kind(where)
            try:
                curve.quantities(simulator)
            except ValueError:
                continue
            found.append(curve)
    return tuple(found)


def parts_in(simulator: HostSimulator) -> tuple[FlexiblePart, ...]:
    """Flexible parts, at zero strength, of every joint that can have one, and flexible joints."""
    found: list[FlexiblePart] = []
    for joint in simulator.joints:
        part = FlexiblePart(joint.name)
        with contextlib.suppress(ValueError):
            part.quantities(simulator)
            found.append(part)
            if pulled_by_position(simulator, joint.name):
                found.append(FlexibleJoint(joint.name))
    return tuple(found)


def further_in(simulator: HostSimulator) -> tuple[Effect, ...]:
    """What is rarer than the library, at zero strength.

    Friction by load and a limited drive of every joint that the inputs move by themselves; states
    that fall at another pace than they rise, rub otherwise backwards, are pushed away from their
    balance, lose a constant or by a power, have an inertia by their angle, run into stops, act on
    others, react with them or are linked to them; what moves in a medium that does, too; inputs
    that act otherwise below zero or through a play, and, but for goals, that are followed at a
    limited pace; encoders off their axis.
    """
    found: list[Effect] = [*_geared(simulator), *_in_mediums(simulator)]
    inputs = [channel.name for channel in simulator.action_channels]
    inputs += [AND.join(names) for names in like_inputs(simulator)]
    kinds = (
        AsymmetricResponse, AsymmetricDamping, NegativeStiffness, ConstantLoss, PowerLoss,
        CrankInertia, UpperStop, LowerStop,
    )  # fmt: skip
    both: list[Effect] = [kind(joint.name) for kind in kinds for joint in simulator.joints]
    both += [Coupling(BY.join(names)) for names in coupled_states(simulator)]
    both += [Reaction(AND.join(names)) for names in meeting_states(simulator)]
    joined = CouplingSpring, CouplingDamper, AsymmetricCouplingDamping, CouplingUnbalance
    links = itertools.product(joined, linked_joints(simulator))
    both += [kind(AND.join(names)) for kind, names in links]
    slow = [name for name in inputs if name not in goals(simulator)]
    at_inputs = [kind(name) for kind in (AsymmetricActuator, Hysteresis) for name in inputs]
    discs = [EncoderError(channel.name) for channel in simulator.physical_channels]
    for effect in (*both, *at_inputs, *map(SlewLimit, slow), *discs):
        with contextlib.suppress(ValueError):
            effect.quantities(simulator)
            found.append(effect)
    return tuple(found)


def _geared(simulator: HostSimulator) -> list[Effect]:
    """Friction by load, and limits of the drive, of what the inputs move by themselves."""
    if not simulator.action_channels:
        return []
    known = simulator.has_drive_force
    pushed = known or all(channel.pushes for channel in simulator.action_channels)
    # Of a motor's speed all is known that it makes, of other joints what is said to push them.
    gears = [LoadDependentFriction(j.name) for j in simulator.joints if pushed or j.first_order]
    moved = [joint for joint in simulator.joints if joint.rate is not None]
    limits = [DriveLimit(joint.name) for joint in moved if known or joint.first_order]
    return _acting(simulator, [*gears, *limits])


def _in_mediums(simulator: HostSimulator) -> list[Effect]:
    """A medium that moves along each joint that slides, where its rate does something."""
    turn = {channel.name: channel.turn for channel in simulator.physical_channels}
    sliding = [joint.name for joint in simulator.joints if turn[joint.position] is None]
    return _acting(simulator, map(AmbientFlow, sliding))


def _acting(simulator: HostSimulator, effects: Iterable[Effect]) -> list[Effect]:
    """The effects that a simulator can host, and that do something there."""
    found = []
    for effect in effects:
        with contextlib.suppress(ValueError):
            if _does_something(simulator, effect):
                found.append(effect)
    return found


def _does_something(simulator: HostSimulator, effect: Effect) -> bool:
    """Whether an effect changes a control period from some states, beside none of the others."""
    plain, rng = simulator.with_effects(()), np.random.default_rng(0)
    there = plain.with_effects([typical(effect, simulator)])
    states = plain.smooth_states(PLACES, rng)
    inputs = np.zeros((PLACES, len(plain.action_channels)))
    for column, channel in enumerate(plain.action_channels):
        inputs[:, column] = random_values(channel, PLACES, rng)
    return not np.allclose(there.step(states, inputs), plain.step(states, inputs), rtol=1e-9)


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
