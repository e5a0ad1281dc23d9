"""Laws of an actuator whose input rests at few levels: others pass through these as well."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.at_rest import STILL
from residual.gap.search.pool import Key
from residual.gap.search.sets import Search
from sims.effects.actuator import ActuatorBias, StaticActuatorEffect
from sims.effects.base import Effect
from sims.effects.curve import Curve

Array = NDArray[np.float64]

#: Step between sorted readings that parts two levels, and how wide a level is, as parts of the
#: input's range.
APART, WIDE = 0.03, 0.06
#: Part of the samples that a level holds at least, and that all levels hold together.
HELD, MOST = 0.03, 0.9


def by_few_levels(search: Search, key: Key, number: int) -> bool:
    """Whether a member is of laws of one input that have as many numbers as it rests at levels.

    A gain and a dead zone are then as good as a gain and a square: only what happens between
    levels, where clocks and lags count, parts them. A law of one number needs no such rule, as
    others are tried in its place, unless it adds to one of two directions what it takes from the
    other: a push is a gain that differs by direction then. Nor does a curve by points, which
    stands for any law.

    Args:
        search: With the fitted set.
        key: The set.
        number: Its member.
    """
    fit = search.tried[key]
    if isinstance(search.candidates[number].effect, Curve):
        return False
    for name in _inputs(search, number):
        together = [n for n in key if name in _inputs(search, n)]
        numbers = sum(knob.strength for n in together for knob in search.candidates[n].knobs)
        column = [c.name for c in search.simulator.action_channels].index(name)
        given = search.fitter.samples.actions[:, column]
        added = fit.model.added(fit.theta)
        if all(_odd(added[key.index(n)], given) for n in together):
            given = np.abs(given)
            given = given[given > STILL * given.max(initial=0.0)]
        elif given.min() < 0 < given.max():
            numbers = max(numbers, 2)
        if numbers < 2:
            continue
        count = resting_levels(given)
        if count is not None and count <= numbers:
            return True
    return False


def resting_levels(given: Array) -> int | None:
    """How many values an input rests at, None if it takes others, too."""
    if not given.size:
        return None
    ordered = np.sort(given)
    reach = float(np.ptp(np.append(ordered, 0.0)))
    groups = np.split(ordered, np.flatnonzero(np.diff(ordered) > APART * reach) + 1)
    held = [g for g in groups if len(g) >= HELD * len(given) and np.ptp(g) <= WIDE * reach]
    return len(held) if sum(map(len, held)) >= MOST * len(given) else None


def _inputs(search: Search, number: int) -> set[str]:
    """Inputs on which a candidate, or what moves exactly as it does, acts without memory."""
    alike = [search.candidates[number], *search.twins_of(number)]
    effects = [one.effect for one in alike if isinstance(one.effect, StaticActuatorEffect)]
    return {name for effect in effects for name in effect.actuators}


def _odd(effect: Effect, given: Array) -> bool:
    """Whether an effect does the same to commands of both directions."""
    if not isinstance(effect, StaticActuatorEffect):
        # A push that moves as a bias does, or a parameter that moves as a gain does.
        return effect.family != ActuatorBias.family
    return bool(np.allclose(effect.shape(-given), -np.asarray(effect.shape(given))))
