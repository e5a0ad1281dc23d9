"""Signs, zeros, units, columns, a clock that a log has otherwise than said: no effect of physics.

A reversed input, an angle counted from elsewhere, a speed in km/h, a period with a digit too many
or two columns in each other's place make every forecast wrong, and no effect of the library undoes
it, or one that is not there. So it is asked beforehand whether the nominal simulator forecasts far
better with one of them changed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from residual.gap.beside import Conventions
from residual.gap.data.samples import Samples
from residual.gap.fitting.contract import Fitter
from residual.gap.fitting.plausible import turned_round
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.preparation.alternatives import conventions
from residual.gap.preparation.convention import (
    Convention,
    as_said,
    beyond,
    plainest,
    reversed_sign,
)
from residual.gap.preparation.other_units import misread
from residual.gap.preparation.way import errors_of, mean_error
from residual.logs.units import other_units
from sims.effects.base import Effect
from sims.effects.parameter import ParameterChange
from sims.effects.sensor import SensorOffset
from sims.host import HostSimulator
from sims.simulator import UNDECLARED

Array = NDArray[np.float64]

#: Error, in units of the way that windows usually go, from which on forecasts are poor enough to
#: ask, and up to which another convention's are good: to stay where one is errs by about 1.
POOR, GOOD = 0.3, 0.5
#: Times that forecasts have to be better with another convention, and other conventions that do
#: as well.
BETTER, ALIKE = 2.0, 1.2
#: The same with two columns in each other's place, and how good they have to be then: no physics
#: comes near, so that in honest logs it makes forecasts worse.
EXCHANGED, FAIR = 1.5, 1.0
#: Error from which on forecasts go astray: what stays where it is errs by 1. Motion the other way
#: than they say need not be foretold well by a sign to be asked about.
ASTRAY = 1.0
#: The same where another convention is so much better that the log as it is said to be is absurd.
ABSURD = 1.25
#: Error from which on a sign or an exchange is asked after that makes it so many times smaller:
#: what swings by itself hides a reversed input.
HIDDEN, CLEARLY = 0.1, 4.0
#: Times the declared scale of a channel from which on another unit is asked after, and how near to
#: that scale it has to be then; times farther from it than the nearest that another may be.
BEYOND, NEAR, NEARLY_AS_NEAR = 100.0, 10.0, math.e
#: Offset of an angle, in turns, from which on another quarter turn is nearer than its zero.
NEXT = 0.125
#: Part of what was found makes forecasts better by, from which on another zero does so, too, and
#: times that it has to be: forecasts that run away are two to three times better where it hangs.
NEARLY, TENFOLD = 0.33, 10.0
#: Error from which on nearly every window is just wrong, and times that a unit with another zero,
#: such as K for degC, has to make it smaller, or the median window's: no physics is hundreds of
#: degrees off.
LOST, FOUND, FAR = 4.0, 3.0, 10.0


def otherwise(
    simulator: HostSimulator, fitter: Fitter, converted: Mapping[str, str] = MappingProxyType({})
) -> Conventions | None:
    """Conventions with which the nominal simulator forecasts far better.

    Not asked of systems that strike the ground, whose forecasts are too short for it.

    Args:
        simulator: The nominal simulator.
        fitter: With the windows to forecast.
        converted: Units that columns were in, by channel, where that is not its own: a header may
            say so wrongly.

    Returns:
        The best of them and what is as good; None where none is.
    """
    if not isinstance(fitter, SmoothFitter):
        return None
    own = mean_error(simulator, fitter, as_said(simulator))
    if own < HIDDEN:
        return None
    poor = own >= POOR
    possible = conventions(simulator, fitter.samples, converted)
    asked = [one for one in possible if poor or one.sign or one.exchanged]
    errors = [(mean_error(simulator, fitter, one), one) for one in asked]
    least, best = min(errors, key=lambda pair: pair[0], default=(own, as_said(simulator)))
    times, good = (EXCHANGED, FAIR) if best.exchanged else (BETTER, GOOD)
    if best.sign and own >= ASTRAY:
        good = max(good, FAIR)
    if CLEARLY * least <= own:
        good = ABSURD
    if best.shifted and own >= LOST:
        good = max(good, own / FOUND)
    if (times if poor else CLEARLY) * least > own or least > good:
        return _other_zero(simulator, fitter, asked) if own >= LOST else None
    further = None if _smaller_angle(simulator, fitter.samples, best) else beyond(best)
    if further is not None and BETTER * least > mean_error(simulator, fitter, further):
        return None
    reason: Literal["zero", "pace", "forecasts"] = (
        "zero" if best.turned else "pace" if best.meant else "forecasts"
    )
    return Conventions(_as_good(errors, least), own / least, reason)


def _other_zero(
    simulator: HostSimulator, fitter: SmoothFitter, possible: Sequence[Convention]
) -> Conventions | None:
    """Units with another zero in which the median window is far less wrong, where the simulator is
    poor in any: what counts as just wrong hides how wrong it is."""

    def median(one: Convention) -> float:
        return float(np.median(errors_of(simulator, fitter, one)))

    errors = [(median(one), one) for one in possible if one.shifted]
    least = min((error for error, _ in errors), default=np.inf)
    own = median(as_said(simulator))
    found = 0 < FAR * least <= own
    return Conventions(_as_good(errors, least), own / least, "forecasts") if found else None


def _as_good(errors: Sequence[tuple[float, Convention]], least: float) -> tuple[str, ...]:
    """What the conventions say that err about as little as the best, best first."""
    near = [(error, one) for error, one in errors if error < ALIKE * least]
    alike = plainest([one for _, one in sorted(near, key=lambda pair: pair[0])])
    return tuple(one.says for one in alike)


def without_sign(simulator: HostSimulator, fitter: Fitter) -> Conventions | None:
    """A speed of which the log may hold the size alone, as of a sensor that counts and does not
    tell which way: never below zero, though an input acts both ways; None if there is none.

    Args:
        simulator: The nominal simulator.
        fitter: With the windows to forecast.
    """
    if not isinstance(fitter, SmoothFitter):
        return None
    samples, channels = fitter.samples, simulator.physical_channels
    low, high = samples.actions.min(axis=0), samples.actions.max(axis=0)
    if not ((low < 0) & (high > 0)).any():
        return None
    measured = {channels[place].name for place in samples.measured}
    alone = [
        place
        for place in samples.measured
        if channels[place].kind == "rate"
        and channels[place].rate_of not in measured
        and np.nanmin(samples.seen[:, place]) >= 0
    ]
    said = as_said(simulator)
    own = mean_error(simulator, fitter, said) if alone else 0.0
    for place in alone if own >= POOR else ():
        so = mean_error(simulator, fitter, said, place)
        if so <= FAIR and BETTER * so <= own:
            return Conventions((f"the sign of {channels[place].name}",), own / so, "size")
    return None


def still_open(
    conventions: Conventions,
    simulator: HostSimulator,
    adequate: bool,
    found: Sequence[Effect],
    times: float,
) -> bool:
    """Whether conventions are to be asked for in spite of what was found.

    What stands upright in a loop runs away in every forecast that misses something, and would err
    less if it hung. What is explained down to the noise without a sensor's zero does not, unless
    another zero alone does nearly as much: effects are found that make up for it. And a single
    parameter that is off is likelier than times that were made up; several are not.

    Args:
        conventions: With which the nominal simulator forecasts better.
        simulator: The nominal simulator.
        adequate: Whether what was found leaves only noise.
        found: Its effects.
        times: That they make forecasts better.
    """
    if conventions.reason == "pace":
        return sum(isinstance(effect, ParameterChange) or effect.drives for effect in found) > 1
    zero = conventions.reason == "zero"
    turns = {channel.name: channel.turn for channel in simulator.physical_channels}
    zeros = [
        float(np.max(np.abs(e.offset))) / (turns.get(e.channel) or math.tau)
        for e in found
        if isinstance(e, SensorOffset)
    ]
    settled = zero and adequate and conventions.times < max(NEARLY * times, TENFOLD)
    return not settled or max(zeros, default=0.0) > NEXT


def other_sign(simulator: HostSimulator, found: Sequence[Effect]) -> Conventions | None:
    """Inputs that act the other way in what was found; None where none does.

    Where an input is weaker or stronger, too, or measured start states are poor, no sign alone
    makes the nominal simulator much better.
    """
    names = [c.name for c in simulator.action_channels if turned_round(found, c.name)]
    changes = tuple(reversed_sign(name) for name in names)
    return Conventions(changes, 1.0, "sign") if changes else None


def beyond_scale(
    simulator: HostSimulator, samples: Samples, converted: Mapping[str, str] = MappingProxyType({})
) -> Conventions | None:
    """Units of a channel that is far beyond the scale that it declares, and would be near it in
    another unit, or without the conversion of its column; None if there is none.

    Of states how far they range counts: a zero is no unit. What comes nearest to the scale is
    named, and what comes nearly as near.
    """
    states = simulator.physical_channels
    names = {states[i].name for i in samples.measured}
    ranged = [
        (states[i], np.ptp(samples.seen[np.isfinite(samples.seen[:, i]), i]))
        for i in samples.measured
        if not (states[i].angle or states[i].invariant or states[i].rate_of in names)
    ]
    acting = zip(simulator.action_channels, np.abs(samples.actions).max(axis=0), strict=True)
    for channel, size in (*acting, *ranged):
        times = float(size) / channel.scale
        if channel.scale == UNDECLARED or times < BEYOND:
            continue
        units = [(f"`unit: {name}` for {channel.name}", u) for name, u in other_units(channel.unit)]
        units += misread(channel, converted)
        then = {says: times * unit.factor for says, unit in units}
        off = {says: max(share, 1 / share) for says, share in then.items()}
        most = min(NEAR, NEARLY_AS_NEAR * min(off.values(), default=math.inf))
        near = sorted((says for says in off if off[says] <= most), key=off.__getitem__)
        if near:
            return Conventions(tuple(near), times, "scale")
    return None


def _smaller_angle(simulator: HostSimulator, samples: Samples, convention: Convention) -> bool:
    """Whether an angle that goes beyond a turn, as said, would be in degrees or a smaller unit yet.

    What swings by little swings alike in every unit that is small enough.
    """
    for column in samples.measured:
        seen, turn = samples.seen[:, column], simulator.physical_channels[column].turn
        beyond_a_turn = turn is not None and np.nanmax(seen) - np.nanmin(seen) > turn
        if beyond_a_turn and convention.states[0, column] < 1:
            return True
    return False
