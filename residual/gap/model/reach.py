"""How far a log reaches: where numbers of effects are looked for, and in which steps."""

from __future__ import annotations

import dataclasses

import numpy as np

from residual.gap.data.samples import Samples
from sims.effects.base import Effect, Quantity
from sims.effects.flexible import FlexiblePart
from sims.effects.limit import RateLimit
from sims.effects.link import CouplingSpring
from sims.effects.stop import Stop
from sims.effects.store import SecondStore
from sims.host import HostSimulator
from sims.simulator import Channel

#: Part of an input's bound that a log has to reach to tell of full commands.
NEAR_FULL = 0.5
#: Part of a way that is near its end, and times that a log comes there if it is stopped.
NEAR_END, AGAIN = 0.05, 3
#: A limit of a rate is looked for up to so many times the fastest motion over so many rows.
BEYOND, SPAN = 1.2, 5
#: Time constants of a store that are tried, as parts of the longest record.
STORED = (0.01, 0.03, 0.1, 0.3)
#: Frequencies of a part that are tried: swings in the longest record and in a window at least, and
#: in a sample at most; from one to the next by so much at the most, which a damping to begin with
#: makes up for.
SWINGS, IN_A_WINDOW, IN_A_SAMPLE, FURTHER = 3.0, 0.25, 0.4, 1.35


def full_command(channel: Channel, reach: float) -> float:
    """Full command of an input, where its strength is known: its bound, if the log comes near."""
    bound = max(abs(channel.low), abs(channel.high))
    return bound if reach >= NEAR_FULL * bound else reach


def measured_range(samples: Samples, column: int) -> tuple[float, float]:
    """Least and greatest measured value of a channel."""
    seen = samples.seen[:, column]
    return float(np.nanmin(seen)), float(np.nanmax(seen))


def greatest_rate(effect: RateLimit, simulator: HostSimulator, samples: Samples) -> float:
    """Greatest measured rate where a limit acts; zero if nothing of it was measured."""
    joint = next(j for j in simulator.joints if j.name == effect.joint)
    names = [channel.name for channel in simulator.physical_channels]
    if joint.rate not in (None, joint.position):
        rate = samples.seen[:, names.index(str(joint.rate))]
        if np.isfinite(rate).any():
            return float(np.nanmax(np.abs(rate)))
    place = samples.seen[:, names.index(joint.position)]
    fastest = 0.0
    for a, b in samples.runs:
        span = min(SPAN, b - a - 1)
        way = np.abs(place[a + span : b] - place[a : b - span])
        rates = way / (samples.times[a + span : b] - samples.times[a : b - span])
        fastest = max(fastest, float(np.nanmax(rates, initial=0.0)))
    return fastest


def turns_enough(effect: Effect, simulator: HostSimulator, samples: Samples) -> bool:
    """Whether a joint turned so far that a weight off its axis is told from a spring, or an
    encoder's error once per turn from a scale; true of what asks for no turn."""
    if not effect.turns:
        return True
    joint = next((j for j in simulator.joints if j.name == effect.where), None)
    names = [channel.name for channel in simulator.physical_channels]
    column = names.index(effect.where if joint is None else joint.position)
    if column not in samples.measured:
        return False
    low, high = measured_range(samples, column)
    return high - low >= effect.turns * (simulator.physical_channels[column].turn or np.inf)


def runs_into(stop: Stop, simulator: HostSimulator, samples: Samples) -> bool:
    """Whether a joint came near the end of the way that was measured again and again, as where it
    is stopped; what turns on and on is there once."""
    joint = next(j for j in simulator.joints if j.name == stop.joint)
    names = [channel.name for channel in simulator.physical_channels]
    column = names.index(joint.position)
    if column not in samples.measured:
        return False
    place = samples.seen[:, column]
    low, high = measured_range(samples, column)
    farthest = stop.places(low, high)[0]
    near = stop.side * (place - farthest) > -NEAR_END * (high - low)
    comings = sum(int(np.sum(np.diff(near[a:b].astype(int)) > 0)) for a, b in samples.runs)
    return comings >= AGAIN


def _longest(samples: Samples) -> float:
    """How long the longest record lasts, in s."""
    return max(float(run.durations.sum()) for run in samples.recorded)


def within_reach(
    effect: Effect, simulator: HostSimulator, samples: Samples, seconds: float
) -> dict[str, Quantity]:
    """Numbers of an effect for the positions that were measured, and for how long.

    No command is later than the longest record lasts. A swing of which a window of so many
    ``seconds`` holds next to nothing is a free force in each of them, and would explain anything.

    An angle that counts turns goes far beyond its channel's scale, where a cubic spring of usual
    size would be a wall, and trial steps of that size would tell nothing. A place, such as where a
    spring rests, is looked for near the channel's zero and no farther beyond what was measured
    than that is wide: a spring that rests farther away is a constant load with another name.
    """
    known = effect.quantities(simulator)
    if effect.enters == "actuator":
        longest = _longest(samples)
        return {
            name: dataclasses.replace(q, high=min(q.high, longest)) if q.unit == "s" else q
            for name, q in known.items()
        }
    if isinstance(effect, FlexiblePart):
        slow = max(SWINGS / _longest(samples), IN_A_WINDOW / seconds)
        fast = IN_A_SAMPLE / float(np.median(samples.durations))
        count = max(1 + int(np.ceil(np.log(fast / slow) / np.log(FURTHER))), 2)
        starts = tuple(np.geomspace(slow, max(fast, slow), count).tolist())
        swing = dataclasses.replace(
            known["frequency"], low=slow, high=max(fast, slow), scale=starts[count // 2],
            starts=starts,
        )  # fmt: skip
        return {**known, "frequency": swing}
    if isinstance(effect, SecondStore):
        longest = _longest(samples)
        starts = tuple(part * longest for part in STORED)
        # What follows faster than samples come is a part of the state.
        fast = min(float(np.median(samples.durations)), starts[0])
        time = dataclasses.replace(known["time"], low=fast, high=longest, starts=starts)
        return {**known, "time": time}
    if isinstance(effect, CouplingSpring):
        return {**known, "rest": _between(effect, known["rest"], simulator, samples)}
    joint = next((j for j in simulator.joints if j.name == effect.where), None)
    if effect.enters != "joint" or joint is None:
        return known
    names = [channel.name for channel in simulator.physical_channels]
    column = names.index(joint.position)
    if column not in samples.measured:
        return known
    low, high = measured_range(samples, column)
    channel = simulator.physical_channels[column]
    scale, turn = channel.scale, channel.turn
    reach = max(1.0, max(abs(low), abs(high)) / scale)
    beyond = max(high - low, scale)
    if isinstance(effect, Stop):
        starts = effect.places(low, high)
        at = dataclasses.replace(known["at"], low=low, high=high, starts=starts)
        return {**known, "at": at}
    found = {}
    for field in dataclasses.fields(effect):
        quantity = known.get(field.name)
        if quantity is None:
            continue
        if turn is not None and field.metadata["dimension"] == {"turn": 1}:
            # Of less than a whole period no law is to be seen: it could pass for any force.
            whole = tuple(times for times in quantity.starts if times * (high - low) >= turn)
            quantity = dataclasses.replace(quantity, starts=whole)
        if quantity.role == "shape" and field.metadata["dimension"] == {"position": 1}:
            quantity = dataclasses.replace(
                quantity,
                low=max(quantity.low, min(low, 0.0) - beyond),
                high=min(quantity.high, max(high, 0.0) + beyond),
            )
        power = field.metadata["dimension"].get("position", 0)
        factor = reach**power if power < 0 else 1.0
        starts = tuple(factor * start for start in quantity.starts)
        found[field.name] = dataclasses.replace(
            quantity, scale=factor * quantity.scale, starts=starts
        )
    return found


def _between(
    effect: CouplingSpring, rest: Quantity, simulator: HostSimulator, samples: Samples
) -> Quantity:
    """Where a spring between two joints may rest: about as they lay to each other."""
    names = [channel.name for channel in simulator.physical_channels]
    places = {joint.name: names.index(joint.position) for joint in simulator.joints}
    first, second = (samples.seen[:, places[name]] for name in effect.pair)
    lay = np.concatenate([first - second, first + second])
    low, high = min(float(np.nanmin(lay)), 0.0), max(float(np.nanmax(lay)), 0.0)
    beyond = max(high - low, rest.scale)
    return dataclasses.replace(rest, low=low - beyond, high=high + beyond)
