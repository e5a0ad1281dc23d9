"""Candidate effects: which of their numbers are fitted, in what bounds, from which start values."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples
from residual.gap.model.reach import (
    BEYOND,
    full_command,
    greatest_rate,
    measured_range,
    runs_into,
    turns_enough,
    within_reach,
)
from sims.effects.actuator import ActuatorEffect
from sims.effects.base import Effect, Quantity
from sims.effects.coupling import Coupling
from sims.effects.curve import Curve
from sims.effects.exchange import BetweenStates
from sims.effects.flexible import FlexiblePart
from sims.effects.friction import ConstantLoss
from sims.effects.joint import AsymmetricDamping, JointEffect
from sims.effects.library import typical
from sims.effects.limit import RateLimit
from sims.effects.link import Link
from sims.effects.loss import PowerLoss
from sims.effects.pull import ELSEWHERE
from sims.effects.sensor import SensorEffect
from sims.effects.stop import Stop
from sims.effects.store import SecondStore
from sims.host import HostSimulator
from sims.simulator import Joint

Array = NDArray[np.float64]

#: Part of the samples above zero, and below it, from which on what goes by the sign shows.
EITHER = 0.05


@dataclasses.dataclass(frozen=True)
class Knob:
    """One fitted number of an effect.

    Attributes:
        field: Its name in the effect.
        unit: SI unit.
        low, high: Bounds.
        step: A small change.
        strength: Whether the effect is absent where it is zero.
        known: Standard deviation with which it is known to be zero beforehand.
        above: Name of another number of the effect, below which this one does nothing more.
    """

    field: str
    unit: str
    low: float
    high: float
    step: float
    strength: bool
    known: float = np.inf
    above: str = ""


@dataclasses.dataclass(frozen=True)
class Trial:
    """Trial values of a candidate's knobs, one row for each signature column.

    Attributes:
        values: shape (k, number of knobs).
        one_sided: Whether each column's coefficient may not be negative, (k,).
    """

    values: Array
    one_sided: NDArray[np.bool_]


@dataclasses.dataclass(frozen=True)
class Candidate:
    """An effect that may be missing.

    Attributes:
        effect: The effect at zero strength, numbers that are not fitted at their value.
        knobs: The fitted numbers.
        trials: What its signatures are computed at.
        rough: True if its signature depends on its size (dead zone, delay ...), so that several
            trials are worth a refit.
        bold: Numbers from which it is fitted alone whatever the screen says, or None.
        less: True if it only takes away what the simulator has too much of.
    """

    effect: Effect
    knobs: tuple[Knob, ...]
    trials: tuple[Trial, ...]
    rough: bool
    bold: Array | None = None
    less: bool = False

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.effect.name

    @property
    def label(self) -> str:
        """Name and place."""
        return str(self.effect)

    @property
    def fixed_level(self) -> bool:
        """True if the effect vanishes at infinity (saturation), so that trials do not scale."""
        return not any(k.strength for k in self.knobs)

    def one_way(self, sign: float) -> Candidate:
        """The same with numbers that are not positive, or not negative."""
        knobs = tuple(
            dataclasses.replace(knob, high=0.0) if sign < 0 else dataclasses.replace(knob, low=0.0)
            for knob in self.knobs
        )
        trials = tuple(
            Trial(sign * np.abs(t.values), np.ones_like(t.one_sided)) for t in self.trials
        )
        return dataclasses.replace(self, knobs=knobs, trials=trials, bold=None, less=True)

    @property
    def linear(self) -> NDArray[np.bool_]:
        """Which knobs scale with the coefficient of a signature column."""
        return np.array([knob.strength for knob in self.knobs])

    def bind(self, values: Sequence[float | Array]) -> Effect:
        """The effect with these numbers: scalars, or arrays with one entry per row."""
        names = [knob.field for knob in self.knobs]
        return self.effect.with_values(**dict(zip(names, values, strict=True)))


def candidates(
    simulator: HostSimulator,
    effects: Iterable[Effect],
    samples: Samples,
    seconds: float = np.inf,
) -> list[Candidate]:
    """All candidates: effects on channels that were measured, whole numbers spelt out.

    An effect with a whole-numbered shape (the order of cogging) becomes one candidate for each
    of its start values.

    Args:
        simulator: Hosts the effects.
        effects: That may be missing.
        samples: The measured table.
        seconds: How long windows are in which their states go on by themselves.
    """
    measured = {simulator.state_channels[i].name for i in samples.measured}
    inputs = [channel.name for channel in simulator.action_channels]
    columns = {channel.name: c for c, channel in enumerate(simulator.physical_channels)}
    found = []
    for effect in effects:
        if isinstance(effect, SensorEffect):
            if not measured.issuperset(effect.read_from(simulator)):
                continue
            effect = effect.suited_to(*measured_range(samples, columns[effect.where]))
        reach = 0.0
        if isinstance(effect, ActuatorEffect):
            acting = [inputs.index(name) for name in effect.actuators]
            reach = float(np.abs(samples.actions[:, acting]).max())
            full = full_command(simulator.action_channels[acting[0]], reach)
            # A curve comes with its points where the log moves.
            effect = effect if isinstance(effect, Curve) else effect.suited_to(-full, full)
        if isinstance(effect, RateLimit):
            reach = BEYOND * greatest_rate(effect, simulator, samples)
        if _follows_unseen(effect, simulator, measured):
            continue
        if isinstance(effect, PowerLoss) and effect.joint in measured:
            effect = effect.suited_to(*measured_range(samples, columns[effect.joint]))
        if isinstance(effect, ConstantLoss | AsymmetricDamping):
            joint = next(j for j in simulator.joints if j.name == effect.joint)
            if not _both_ways(samples, columns[joint.position], columns.get(str(joint.rate))):
                continue
        if not turns_enough(effect, simulator, samples):
            continue
        if isinstance(effect, Stop) and not runs_into(effect, simulator, samples):
            continue
        known = within_reach(effect, simulator, samples, seconds)
        whole = {n: q for n, q in known.items() if q.integer and q.role == "shape"}
        for values in itertools.product(*(q.starts for q in whole.values())):
            fixed = effect.with_values(**dict(zip(whole, values, strict=True)))
            found.append(_candidate(fixed, known, reach))
    return found


def one_way(
    simulator: HostSimulator, changes: Iterable[tuple[Effect, float]], samples: Samples
) -> list[Candidate]:
    """Candidates of which only one sign is asked for, given with each, -1.0 or 1.0."""
    return [
        candidate.one_way(sign)
        for effect, sign in changes
        for candidate in candidates(simulator, [effect], samples)
    ]


def _both_ways(samples: Samples, position: int, rate: int | None) -> bool:
    """Whether a joint moves forward for a part of the time and back for another; a state of a
    first-order system: whether it is above zero and below."""
    seen = samples.seen[:, position if rate is None else rate]
    if not np.isfinite(seen).any():
        seen = np.diff(samples.seen[:, position])
    return bool(min(np.mean(seen > 0), np.mean(seen < 0)) > EITHER)


def _follows_unseen(effect: Effect, simulator: HostSimulator, measured: set[str]) -> bool:
    """Whether a force depends on a position that nobody measured.

    The start state of every window is free, so that such a force has a free size in each of them,
    and would explain anything.
    """
    if isinstance(effect, BetweenStates):
        return not set(effect.pair) <= measured
    if isinstance(effect, SecondStore):
        return effect.joint not in measured
    if isinstance(effect, Link):
        linked = [joint for joint in simulator.joints if joint.name in effect.pair]
        return any(_unseen(joint, measured, effect.by_position) for joint in linked)
    where = effect.pair[1] if isinstance(effect, Coupling) else effect.where
    joint = next((j for j in simulator.joints if j.name == where), None)
    if isinstance(effect, (FlexiblePart, Coupling)) and joint is not None:
        return _unseen(joint, measured)
    if not isinstance(effect, JointEffect) or joint is None or joint.position in measured:
        return False
    if joint.position == joint.rate:  # a speed, which shows in what it moves
        return False
    if isinstance(effect, Curve):
        return effect.along == "position"
    there = typical(effect, simulator)
    assert isinstance(there, JointEffect)
    size = effect.measures(simulator)["position"][1] if joint.rate else 1.0
    places = size * np.array(ELSEWHERE)
    # The state of a first-order system counts as a rate.
    rates = np.zeros(4) if joint.rate else places
    return bool(np.ptp(there.force(places, rates)) > 0)


def _unseen(joint: Joint, measured: set[str], by_position: bool = False) -> bool:
    """Whether nothing of a joint was measured, or not the position that something goes by."""
    seen = joint.position in measured
    return not seen and (by_position or joint.rate not in measured)


def _candidate(effect: Effect, known: dict[str, Quantity], reach: float) -> Candidate:
    free = {name: quantity for name, quantity in known.items() if quantity.fitted}
    knobs = tuple(
        Knob(
            n, q.unit, q.low, q.high, 0.1 * q.scale,
            q.role == "strength" and np.isfinite(q.nominal), above=q.above,
        )
        for n, q in free.items()
    )  # fmt: skip
    strengths = [i for i, knob in enumerate(knobs) if knob.strength]
    shapes = [i for i, knob in enumerate(knobs) if not knob.strength]
    quantities = list(free.values())
    starts = [quantities[i].starts or (quantities[i].scale,) for i in shapes]
    if not strengths and reach > 0:
        # A level is searched where the recorded input, or the motion, reaches; beyond, it does
        # nothing, and no slope leads back.
        starts = [tuple(s / quantities[i].scale * reach for s in starts[0]) for i in shapes]
        knobs = tuple(dataclasses.replace(knob, high=min(knob.high, reach)) for knob in knobs)
    trials = []
    for shape in itertools.product(*starts):
        sizes = [list(quantities[i].starts) or [0.1 * quantities[i].scale] for i in strengths] or [
            [0.0]
        ]
        if len(strengths) > 1:
            sizes = [[size[0]] for size in sizes]
        for chosen in sizes[0] if len(strengths) <= 1 else [None]:
            rows = np.zeros((max(len(strengths), 1), len(knobs)))
            rows[:, shapes] = shape
            for row, i in enumerate(strengths):
                rows[row, i] = chosen if chosen is not None else sizes[row][0]
            sided = [knobs[i].low == 0 for i in strengths] or [True]
            trials.append(Trial(rows, np.array(sided)))
    full = [quantity.bold for quantity in quantities if quantity.bold is not None]
    bold = np.array(full) if len(full) == len(knobs) else None
    return Candidate(effect, knobs, tuple(trials), len(trials) > 1, bold)
