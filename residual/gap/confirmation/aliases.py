"""Effects that no data could tell apart, and effects that this log could hide."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from residual.gap.beside import Blind
from residual.gap.fitting.screening import Signatures
from residual.gap.model.candidates import Candidate
from residual.trajectories import Trajectory
from sims.effects.actuator import ActuatorGain
from sims.effects.aliases import exact_aliases, linear_columns, probes
from sims.effects.base import Effect
from sims.effects.combinations import made_by
from sims.effects.joint import ConstantLoad
from sims.effects.loss import ProportionalLoss
from sims.effects.parameter import ParameterChange
from sims.host import HostSimulator
from sims.simulator import Array

#: Rows of a log on which twins are compared.
ROWS = 96


def aliases(
    simulator: HostSimulator, offered: Sequence[Effect], runs: Sequence[Trajectory] = ()
) -> tuple[dict[str, tuple[str, ...]], tuple[tuple[str, ...], ...]]:
    """Exact aliases among the offered effects: twins by name, and dependent sets.

    A law with more numbers, as a spring with a free rest, does what its twin does and more: it is
    the twin's alias, and the twin is not its.

    Args:
        simulator: The nominal simulator.
        offered: The effects.
        runs: Where twins have to move alike, too.
    """
    effects = {str(effect): effect for effect in offered}
    groups: dict[str, tuple[str, ...]] = {}
    sets = []
    for alias in exact_aliases(simulator, seen=_rows_of(simulator, runs), among=effects):
        inside = tuple(name for name in alias.effects if name in effects)
        if len(inside) < 2:
            continue
        if alias.combination:
            if len(inside) == len(alias.effects):
                sets.append(inside)
        else:
            width = {name: numbers(effects[name], simulator) for name in inside}
            for name in inside:
                groups[name] = tuple(other for other in inside if width[other] >= width[name])
    return groups, tuple(sets)


def _rows_of(simulator: HostSimulator, runs: Sequence[Trajectory]) -> tuple[Array, Array] | None:
    """Rows from all over the runs, with random values for what was not measured.

    None without runs, and for what touches: small changes have large effects there.
    """
    if not runs or simulator.has_contacts:
        return None
    states = np.concatenate([run.states[:-1] for run in runs])
    actions = np.concatenate([run.actions for run in runs])
    rows = np.linspace(0, len(states) - 1, ROWS).round().astype(int)
    plain = simulator.with_effects(())
    drawn, _ = probes(plain, np.random.default_rng(0))
    drawn = drawn[np.arange(ROWS) % len(drawn)]
    picked = states[rows]
    return np.where(np.isfinite(picked), picked, drawn), actions[rows]


def numbers(effect: Effect, simulator: HostSimulator) -> int:
    """How many numbers of an effect are fitted."""
    return sum(quantity.fitted for quantity in effect.quantities(simulator).values())


def beyond_parameters(simulator: HostSimulator, offered: Sequence[Effect]) -> tuple[Effect, ...]:
    """The offered effects without losses that the simulator's own parameters make already.

    With gains and loads, a time constant and a temperature of the surroundings make any loss in
    proportion: a law for it would only be another name for them.
    """
    if not any(isinstance(effect, ProportionalLoss) for effect in offered):
        return tuple(offered)
    own = [str(e) for e in offered if isinstance(e, ParameterChange | ActuatorGain | ConstantLoad)]
    made = made_by(simulator, own)
    return tuple(e for e in offered if not (isinstance(e, ProportionalLoss) and str(e) in made))


def representatives(
    simulator: HostSimulator, offered: Sequence[Effect], groups: Mapping[str, tuple[str, ...]]
) -> tuple[list[Effect], list[tuple[Effect, float]]]:
    """The offered effects without those that the first of their twins stands for.

    Returns:
        Those, and parameters of which a simulator may have too much while the twin that stands for
        them cannot be negative, with the sign of the change that takes it away: damping that is
        too large is no friction. Of several the first that acts as its twin does.
    """
    width = {str(effect): numbers(effect, simulator) for effect in offered}
    either = {str(effect): _goes_either_way(effect, simulator) for effect in offered}
    kept: list[Effect] = []
    too_much: dict[str, list[Effect]] = {}
    for effect in offered:
        name = str(effect)
        first = next(n for n in groups.get(name, (name,)) if width[n] == width[name])
        if first == name:
            kept.append(effect)
        elif isinstance(effect, ParameterChange) and either[name] and not either[first]:
            too_much.setdefault(first, []).append(effect)
    return kept, [_taking_away(simulator, first, found) for first, found in too_much.items()]


def _taking_away(
    simulator: HostSimulator, twin: str, parameters: Sequence[Effect]
) -> tuple[Effect, float]:
    """The parameter that undoes a twin, and the sign of its change that does."""
    plain = simulator.with_effects(())
    names = [twin, *map(str, parameters)]
    columns, _ = linear_columns(plain, *probes(plain, np.random.default_rng(0)), names)
    alike = [one for one in parameters if float(columns[twin] @ columns[str(one)]) > 0]
    return (alike[0], -1.0) if alike else (parameters[0], 1.0)


def _goes_either_way(effect: Effect, simulator: HostSimulator) -> bool:
    """Whether all strengths of an effect may be negative, too."""
    known = effect.quantities(simulator).values()
    return all(quantity.low < 0 for quantity in known if quantity.role == "strength")


def hidden(
    around: Signatures, pool: Sequence[Candidate], chosen: Sequence[int], threshold: float
) -> tuple[Blind, ...]:
    """Effects that could be there at a size that matters without this log showing it.

    Args:
        around: Signatures around the chosen set, in units of the noise.
        pool: The candidates.
        chosen: Numbers of the chosen ones.
        threshold: Fall of the cost that would have been noticed.
    """
    smallest: dict[int, tuple[float, str, float]] = {}
    for variant in around.variants:
        candidate = pool[variant.candidate]
        if candidate.fixed_level or candidate.less or variant.candidate in chosen:
            continue
        for row, column in enumerate(variant.columns):
            knob = next(i for i in np.flatnonzero(variant.linear) if variant.trial.values[row, i])
            size = variant.trial.values[row, knob]
            strength = max(around.strengths[column], 1e-300)
            visible = float(size * np.sqrt(threshold / strength))
            limit = 10 * candidate.knobs[knob].step
            known = smallest.get(variant.candidate)
            if known is None or visible < known[0]:
                smallest[variant.candidate] = (visible, candidate.knobs[knob].unit, limit)
    return tuple(
        Blind(pool[number].label, visible, unit, pool[number].effect.needs)
        for number, (visible, unit, limit) in smallest.items()
        if visible > limit
    )
