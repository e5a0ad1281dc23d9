"""Numbers too large to be believed: effects that switch the system off instead of explaining it.

Where the nominal simulator is far off, whatever stops the motion takes most of the error away: a
gain of a hundredth, a dead zone wider than the input, an inertia a thousand times too large.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples
from residual.gap.fitting.commands import by_commands
from residual.gap.fitting.contract import Fit, Fitter
from residual.gap.fitting.intervals import at_bound, deviations
from residual.gap.fitting.screening import flatten
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.model.model import Model
from sims.effects.actuator import ActuatorEffect, ActuatorGain, StaticActuatorEffect
from sims.effects.aliases import probes, shortly_after
from sims.effects.base import Effect
from sims.effects.curve import Curve
from sims.effects.parameter import ParameterChange
from sims.effects.sensor import ScaledSensor, SensorOffset
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Largest factor between a parameter and its nominal value, either way.
FACTOR = 10.0
#: Part of the motion that hangs on a parameter, below which that hardly matters as it is.
MINOR = 0.1
#: Least part of the input's variation that its way to the actuator leaves.
THROUGH = 0.1
#: Residual over noise of the nominal simulator that has to be explained, and of what explains it;
#: or the residual of that as a part of the motion itself.
FAR, CLOSE, UNMOVED = 3.0, 1.5, 0.2
#: Part of the measured variation below which a forecast stands still.
STILL = 0.3
#: Part of the largest command by which an input is negative by chance, and of the time.
SLIGHTLY, SELDOM = 0.02, 0.05
#: Part of two effects that is left of both together, below which they undo each other.
UNDONE = 0.25
#: Part of all that a sensor showed by which its zero is seldom wrong.
FAR_OFF = 0.2


def absurd(model: Model, theta: Array, samples: Samples) -> tuple[int, str]:
    """Which of a set of effects cannot be right, and why; an empty string if each can.

    Args:
        model: Simulator with the effects.
        theta: Their numbers, (p,).
        samples: The measured table.

    Returns:
        Its position among the model's effects, their number if it is none of them, and why.
    """
    host, given = model.bind(theta), model.simulator.with_effects(())
    chosen = model.added(theta)
    for number, ratio in ratios(host, chosen).items():
        name = chosen[number].where
        small = ratio > FACTOR and _minor(given, name, ratio)
        if not 1 / FACTOR <= ratio <= FACTOR and not small:
            return number, f"{name} would be {ratio:.3g} times its nominal value"
    for number, effect in enumerate(chosen):
        read = 1 + float(effect.scale) if isinstance(effect, ScaledSensor) else 1.0
        if not 1 / FACTOR <= read <= FACTOR:
            return number, f"{effect.where} would be read as {read:.3g} times what is there"
    unsupported = by_commands(host, samples, len(model.simulator.effects))
    if unsupported is not None:
        return unsupported
    before = Model(given).inputs(samples, np.zeros((1, 0)))[0]
    after = model.inputs(samples, theta[None])[0]
    for j, channel in enumerate(host.action_channels):
        usual = float(before[..., j, 0].std())
        left = float(after[..., j, 0].std())
        acting = [_acts_on(one.effect, channel.name) for one in model.chosen]
        number = acting.index(True) if any(acting) else len(acting)
        if usual > 0 and not THROUGH <= left / usual <= 1 / THROUGH:
            return number, f"{channel.name} would have {left / usual:.2g} of its strength"
        if turned_round(host.effects, channel.name):
            return number, f"{channel.name} would act the other way"
        curve = _turned_by_a_curve(chosen, channel.name, samples.actions[:, j])
        if curve is not None:
            return curve, f"{channel.name} would act the other way in a part of its range"
    return len(model.chosen), ""


def turned_round(effects: Sequence[Effect], actuator: str) -> bool:
    """Whether effects make an input act the other way."""
    gains = [one for one in effects if isinstance(one, ActuatorGain) and actuator in one.actuators]
    return sum(gain.turns_round for gain in gains) % 2 == 1


def _turned_by_a_curve(effects: Sequence[Effect], actuator: str, commands: Array) -> int | None:
    """Position of a curve that turns commands round, more than a bias of a tenth does."""
    most = float(np.abs(commands).max(initial=0.0))
    for place, one in enumerate(effects):
        if not (isinstance(one, StaticActuatorEffect) and isinstance(one, Curve)):
            continue
        if actuator in one.actuators and most > 0:
            against = one.shape(commands) * np.sign(commands) < -THROUGH * most
            if float(against.mean()) > SELDOM:
                return place
    return None


def ratios(host: HostSimulator, chosen: Sequence[Effect]) -> dict[int, float]:
    """Parameters over their nominal values, by the position of their change among those chosen."""
    found = {}
    for number, effect in enumerate(chosen):
        if isinstance(effect, ParameterChange):
            nominal = float(np.mean(host.parameters[effect.parameter].value))
            if nominal:
                found[number] = (nominal + float(effect.change)) / nominal
    return found


def nearly(fit: Fit, number: int, fitter: Fitter) -> bool:
    """Whether numbers that can be believed are as likely as the absurd ones of a fit.

    What is known badly may be nine times its nominal value as well as eleven.

    Args:
        fit: With absurd numbers.
        number: Whose they are, by position among the model's effects.
        fitter: Of the fit.
    """
    half = 1.96 * deviations(fit, fitter.blocks)
    reach = np.where(fit.model.owner == number, half, 0.0)
    nearer = fit.theta - np.clip(fit.theta, -reach, reach)
    return not absurd(fit.model, nearer, fitter.samples)[1]


def told_by_data(fit: Fit, nominal: Fit, fitter: Fitter, noise: Array | None) -> bool:
    """Whether numbers out of all proportion explain what moved, of a gap far above the noise.

    What only switches the motion off does not: the motion is left. A parameter of the other sign is
    another law, unless it leaves only noise: then a sign is wrong, in the simulator or in the log.
    Of what commands tell nothing of nothing can be told.

    Args:
        fit: With such numbers.
        nominal: The fit of the nominal simulator.
        fitter: Of both.
        noise: Of every measured channel, (m,); None if it is not known.
    """
    if noise is None or not isinstance(fitter, SmoothFitter):
        return False
    host, own = fit.model.bind(fit.theta), len(fit.model.simulator.effects)
    turned = min(ratios(host, fit.model.added(fit.theta)).values(), default=1.0) < 0
    if by_commands(host, fitter.samples, own) is not None:
        return False
    far, left = (fitter.over_noise(one, noise) for one in (nominal, fit))
    little = np.maximum(CLOSE, 0.0 if turned else UNMOVED * _motion(fitter) / noise)
    return bool((far > FAR).any() and (left < little).all())


def _motion(fitter: SmoothFitter) -> Array:
    """How far every measured channel departs from straight lines through each window, (m,)."""
    samples, windows, valid = fitter.samples, fitter.blocks.windows, fitter.valid
    seen = np.where(valid, samples.seen[windows.index][..., samples.measured], 0.0)
    weights = valid.astype(float)
    times = (samples.times[windows.index] - samples.times[windows.index[:, :1]])[..., None]
    count = np.maximum(weights.sum(axis=1, keepdims=True), 1.0)
    t = weights * (times - (weights * times).sum(axis=1, keepdims=True) / count)
    x = weights * (seen - seen.sum(axis=1, keepdims=True) / count)
    square = np.maximum((t**2).sum(axis=1, keepdims=True), 1e-300)
    bends = x - t * (t * x).sum(axis=1, keepdims=True) / square
    return np.sqrt((bends**2).sum(axis=(0, 1)) / np.maximum(valid.sum(axis=(0, 1)), 1))


def stands_still(fit: Fit, fitter: Fitter) -> bool:
    """Whether what a fit foretells hardly moves where the measured does, within the windows.

    Args:
        fit: Of a set of effects.
        fitter: Of the fit.
    """
    if not isinstance(fitter, SmoothFitter):
        return False
    samples, windows, valid = fitter.samples, fitter.blocks.windows, fitter.valid
    seen = np.where(valid, samples.seen[windows.index][..., samples.measured], 0.0)
    left = fit.projected.reshape(seen.shape) * fitter.sigma
    moved, foretold = (_within(one, valid) for one in (seen, seen - left))
    return bool((foretold < STILL * moved).all())


def _within(paths: Array, valid: NDArray[np.bool_]) -> Array:
    """How far paths (W, L, m) vary around their mean in each window, (m,)."""
    count = np.maximum(valid.sum(axis=1, keepdims=True), 1)
    around = np.where(valid, paths - (paths * valid).sum(axis=1, keepdims=True) / count, 0.0)
    return np.sqrt((around**2).sum(axis=(0, 1)) / np.maximum(valid.sum(axis=(0, 1)), 1))


def doubtful_sensor(effect: Effect, simulator: HostSimulator, samples: Samples) -> bool:
    """Whether a sensor would be wrong as sensors seldom are: in its scale, or its zero by a fifth.

    Scales are calibrated, and what the simulator lacks elsewhere looks like one much more often
    than one is wrong.
    Where an encoder's zero lies is a matter of mounting, so that of positions any size is likely.
    Of what else is measured, an equilibrium or a loss that the simulator lacks looks like a zero
    far off, by a fifth of all that the sensor showed.

    Args:
        effect: With its numbers.
        simulator: Has the channels.
        samples: The measured table.
    """
    if not isinstance(effect, SensorOffset):
        return isinstance(effect, ScaledSensor)
    names = [channel.name for channel in simulator.physical_channels]
    place = names.index(effect.channel)
    if simulator.physical_channels[place].kind == "position":
        return False
    shown = samples.seen[:, place]
    span = float(np.ptp(shown[np.isfinite(shown)])) if np.isfinite(shown).any() else 0.0
    return bool(np.max(np.abs(effect.offset)) > FAR_OFF * span)


def surprises(fit: Fit, samples: Samples) -> int:
    """Effects of a fitted set that are larger than their kind usually is, end at a bound, undo
    nearly all of another, or make an input negative that never is.

    What a bound has stopped is no optimum: the data would have it elsewhere.
    """
    ended = {int(fit.model.owner[j]) for j in range(len(fit.theta)) if at_bound(fit, j)}
    own = fit.model.added(fit.theta)
    return sum(effect.surprising or i in ended for i, effect in enumerate(own)) + (
        undone(fit) + _pulling(fit, samples)
    )


def _pulling(fit: Fit, samples: Samples) -> int:
    """Inputs that a fitted set makes negative where their bounds say that they cannot be.

    No heater cools, and no propeller on one side pulls: what looks so is a dead zone, or a load.
    """
    actions = fit.model.simulator.action_channels
    one_sided = [j for j, channel in enumerate(actions) if channel.low == 0]
    if not one_sided or not any(isinstance(c.effect, ActuatorEffect) for c in fit.model.chosen):
        return 0
    means = fit.model.inputs(samples, fit.theta[None])[0][..., one_sided, 0]
    negative = means < -SLIGHTLY * samples.actions[:, one_sided].max(axis=0)
    return int((negative.mean(axis=(0, 1)) > SELDOM).sum())


def unlikely(fit: Fit, samples: Samples) -> int:
    """Pairs of a fitted set that undo each other, and sensors that are wrong as they seldom are."""
    own = fit.model.added(fit.theta)
    sensors = sum(doubtful_sensor(effect, fit.model.simulator, samples) for effect in own)
    return undone(fit) + sensors


def undone(fit: Fit) -> int:
    """Pairs of a fitted set that undo all but a quarter of each other: a zero that is far off and
    the load that holds it there bend a motion a bit, and so does much less of something else."""
    moved = flatten(fit.by_knob * fit.theta, fit.weights)
    of_effect = [moved[:, fit.model.owner == i].sum(axis=1) for i in range(len(fit.model.chosen))]
    return sum(
        bool(np.linalg.norm(a + b) < UNDONE * max(np.linalg.norm(a), np.linalg.norm(b)))
        for a, b in itertools.combinations(of_effect, 2)
    )


def _acts_on(effect: Effect, actuator: str) -> bool:
    return isinstance(effect, ActuatorEffect) and actuator in effect.actuators


def _minor(simulator: HostSimulator, parameter: str, ratio: float) -> bool:
    """Whether a parameter hardly matters, and does not take over if it is so much larger.

    A rotor that weighs a fiftieth of the arm may well weigh twenty times as much.
    """
    states, inputs = probes(simulator, np.random.default_rng(0))
    value = float(np.mean(simulator.parameters[parameter].value))
    hosts = [simulator.with_parameters(**{parameter: scale * value}) for scale in (1.0, 1.001)]
    moves = [shortly_after(host, states, inputs) - states for host in hosts]
    whole = np.linalg.norm(moves[0], axis=0)
    part = np.linalg.norm(moves[1] - moves[0], axis=0) / 0.001
    matters = float(np.max(part[whole > 0] / whole[whole > 0], initial=0.0))
    return matters < MINOR and matters * ratio < 1.0
