"""Laws that only imitate the true one: when to ask for a curve by points itself.

Two laws of the library together, or one over the few speeds of a log, come near any friction. What
they leave is then the same at the same speed, and a curve of three sizes takes most of it off. So
it is with forces by position, and with what an actuator makes of a command.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from residual.gap.answer.confirmed import Answer
from residual.gap.answer.left import much_is_left
from residual.gap.data.levels import levels
from residual.gap.fitting.smooth import SmoothFitter
from sims.effects.actuator import ActuatorEffect, StaticActuatorEffect
from sims.effects.base import Effect
from sims.effects.curve import Curve
from sims.effects.curves import StateCurve
from sims.effects.library import curves_in, library
from sims.effects.parameter_curve import ParameterCurve
from sims.host import HostSimulator
from sims.simulator import TURNS

#: Part of the values of a log between which a curve lies, where they were not measured.
MOST = 0.99


def curves_for(simulator: HostSimulator, offered: Collection[str]) -> tuple[Curve, ...]:
    """Every curve that a simulator can host, at zero strength.

    Where a user leaves a law out that is a case of a curve, the curve is left out as well.

    Args:
        simulator: The nominal simulator.
        offered: Labels of the effects that may be missing.
    """
    left_out = {str(effect) for effect in library(simulator)} - set(offered)
    return tuple(
        curve
        for curve in curves_in(simulator)
        if not {f"{name}@{curve.where}" for name in curve.special_cases} & left_out
    )


def over_the_log(curve: Curve, fitter: SmoothFitter, simulator: HostSimulator) -> tuple[Curve, ...]:
    """A curve over the values that the log has, none if it has a single one."""
    low, high = _values(curve, fitter, simulator)
    return (curve.suited_to(low, high),) if high > low else ()


def worth_a_curve(answer: Answer, curves: Sequence[Curve]) -> list[Curve]:
    """The curves to ask for over what the log holds, if clearly more than noise is left.

    That is where a law of their kind was named, or does as well in place of one; if nothing was,
    everywhere. A state that settles follows its input, so that a law of the one may be one of the
    other.

    Args:
        answer: What was found with the effects on offer.
        curves: Those that may be missing, see ``curves_for``.
    """
    search, key = answer.found.search, answer.key
    fitter = search.fitter
    if not much_is_left(answer) or not isinstance(fitter, SmoothFitter):
        return []
    # A simulator's own damping moves like friction at its joint, and one way so does a load.
    alike = [one.effect for number in key for one in search.twins_of(number)]
    as_well = {name for claim in answer.claims for name in claim.stand_ins}
    alike += [one.effect for one in search.candidates if one.label in as_well]
    named = [search.candidates[number].effect for number in key]
    found = []
    for curve in curves:
        if named and not any(_worth(curve, effect) for effect in (*named, *alike)):
            continue
        low, high = _values(curve, fitter, search.simulator)
        if high > low and not _counts_turns(curve, search.simulator, high - low):
            found.append(curve.suited_to(low, high))
    return found


def _worth(curve: Curve, effect: Effect) -> bool:
    """Whether a curve is worth a look where an effect was named."""
    settles = isinstance(curve, StateCurve) and isinstance(effect, StaticActuatorEffect)
    return settles or of_its_kind(curve, effect)


def of_its_kind(curve: Curve, effect: Effect) -> bool:
    """Whether an effect may be an imitation of what follows a curve."""
    if isinstance(curve, StateCurve) and effect.enters == "parameter":
        return True  # a loss that parameters make already is not looked for
    if isinstance(curve, ActuatorEffect):
        if not isinstance(effect, StaticActuatorEffect):
            return False
        return effect.meets(curve)
    alike = curve.family and curve.family == effect.family
    return curve.contains(effect) or bool(alike and curve.where == effect.where)


def _counts_turns(curve: Curve, simulator: HostSimulator, width: float) -> bool:
    """Whether a force by angle spans more than one turn."""
    if curve.along != "position":
        return False
    turn = TURNS.get(curve.measures(simulator)["position"][0])
    return turn is not None and width > turn


def _values(curve: Curve, fitter: SmoothFitter, simulator: HostSimulator) -> tuple[float, float]:
    """Between which values the log moves along a curve."""
    if isinstance(curve, ActuatorEffect):
        inputs = [channel.name for channel in simulator.action_channels]
        acting = [inputs.index(name) for name in curve.actuators]
        commands = fitter.samples.actions[:, acting]
        return float(commands.min()), float(commands.max())
    if isinstance(curve, ParameterCurve):
        own = curve.over, curve.of_size
        reach = {(one.channel, one.of_size): one.reach for one in levels(simulator, fitter.samples)}
        return reach.get(own, (0.0, 0.0))
    joint = next(joint for joint in simulator.joints if joint.name == curve.where)
    names = [channel.name for channel in simulator.physical_channels]
    column = names.index(joint.rate if curve.along == "rate" and joint.rate else joint.position)
    values = fitter.nodes[:, column]
    part = 1.0 if column in fitter.samples.measured else MOST
    if curve.along == "rate":
        return 0.0, float(np.quantile(np.abs(values), part))
    return tuple(np.quantile(values, [1 - part, part]))
