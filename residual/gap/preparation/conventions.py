"""Signs, zeros and units that a log counts in, and the simulator does not: no effect of physics.

A reversed input, an angle counted from elsewhere or a speed in km/h makes every forecast wrong, and
no effect of the library undoes it, or one that is not there. So it is asked beforehand whether the
nominal simulator forecasts far better with one of them changed.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.beside import Conventions
from residual.gap.data.samples import Samples
from residual.gap.fitting.contract import Fitter
from residual.gap.fitting.plausible import turned_round
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.model import paths
from residual.gap.model.model import Model
from residual.logs.units import Unit, find_unit, units_of
from sims.effects.base import Effect
from sims.host import HostSimulator
from sims.simulator import Channel

Array = NDArray[np.float64]

#: Error, in units of the way that windows usually go, from which on forecasts are poor enough to
#: ask, and up to which another convention's are good: to stay where one is errs by about 1.
POOR, GOOD = 0.3, 0.5
#: Times that forecasts have to be better with another convention, and other conventions that do
#: as well.
BETTER, ALIKE = 2.0, 1.2
#: Error from which on a sign is asked after that makes it so many times smaller: what swings by
#: itself hides a reversed input.
HIDDEN, CLEARLY = 0.1, 4.0
#: Times the declared scale of an input from which on it is asked whether it is in another unit, and
#: how near to that scale it has to be then; what is declared if nothing is.
BEYOND, NEAR, UNDECLARED = 100.0, 10.0, 1.0
#: Zeros from which angles are counted.
QUARTERS = (0.0, np.pi / 2, np.pi, -np.pi / 2)
#: Windows that are looked at: all rows at once, and row by row.
AT_ONCE, BY_ROW = 120, 20
#: Error of a window in those units beyond which it is just wrong.
WRONG = 5.0


@dataclasses.dataclass(frozen=True)
class Convention:
    """How columns may count in place of how they are said to.

    Attributes:
        says: What to change in the column map.
        states: Factor and offset of every state, (2, n_s).
        inputs: The same of every input, (2, n_a).
    """

    says: str
    states: Array
    inputs: Array

    @property
    def sign(self) -> bool:
        """Whether nothing but signs is another one."""
        factors, offsets = np.hstack([self.states, self.inputs])
        return bool((np.abs(factors) == 1).all() and not offsets.any())


def otherwise(simulator: HostSimulator, fitter: Fitter) -> Conventions | None:
    """Conventions with which the nominal simulator forecasts far better.

    Not asked of systems that strike the ground, whose forecasts are too short for it.

    Args:
        simulator: The nominal simulator.
        fitter: With the windows to forecast.

    Returns:
        The best of them and what is as good; None where none is.
    """
    if not isinstance(fitter, SmoothFitter):
        return None
    own = _error(simulator, fitter, _as_said(simulator))
    if own < HIDDEN:
        return None
    poor = own >= POOR
    times = BETTER if poor else CLEARLY
    asked = [one for one in _conventions(simulator, fitter) if poor or one.sign]
    errors = [(_error(simulator, fitter, one), one) for one in asked]
    least, best = min(errors, key=lambda pair: pair[0], default=(own, _as_said(simulator)))
    if times * least > own or least > GOOD:
        return None
    beyond = _beyond(best)
    if beyond is not None and BETTER * least > _error(simulator, fitter, beyond):
        return None
    alike = tuple(one.says for error, one in errors if error < ALIKE * least)
    return Conventions(alike, own / least)


def other_sign(simulator: HostSimulator, found: Sequence[Effect]) -> Conventions | None:
    """Inputs that act the other way in what was found; None where none does.

    Where an input is weaker or stronger, too, or measured start states are poor, no sign alone
    makes the nominal simulator much better.
    """
    names = [c.name for c in simulator.action_channels if turned_round(found, c.name)]
    changes = tuple(_reversed(name) for name in names)
    return Conventions(changes, 1.0, "sign") if changes else None


def beyond_scale(simulator: HostSimulator, samples: Samples) -> Conventions | None:
    """Units of an input that is far beyond the scale that its channel declares, and would be near
    it in another unit; None if there is none."""
    for channel, values in zip(simulator.action_channels, samples.actions.T, strict=True):
        times = float(np.abs(values).max()) / channel.scale
        if channel.scale == UNDECLARED or times < BEYOND:
            continue
        units = [(name, times * unit.factor) for name, unit in _other_units(channel)]
        near = [name for name, then in units if 1 / NEAR <= then <= NEAR]
        if near:
            changes = tuple(f"`unit: {name}` for {channel.name}" for name in near)
            return Conventions(changes, times, "scale")
    return None


def _reversed(name: str) -> str:
    return f"`scale: -1` for {name}"


def _conventions(simulator: HostSimulator, fitter: SmoothFitter) -> list[Convention]:
    """What a column map may have to say: signs, zeros of angles, units."""
    found = []
    for place, action in enumerate(simulator.action_channels):
        if action.low < 0 < action.high:
            found.append(_of_input(simulator, _reversed(action.name), place, -1.0))
        for name, unit in _other_units(action):
            says = f"`unit: {name}` for {action.name} ({_beside_a_unit(unit)})"
            found.append(_of_input(simulator, says, place, unit.factor, unit.offset))
    channels = simulator.physical_channels
    measured = set(fitter.samples.measured.tolist())
    for place, channel in enumerate(channels):
        if channel.rate_of in {other.name for other in channels}:
            continue
        joint = [place, *(i for i, other in enumerate(channels) if other.rate_of == channel.name)]
        seen = [i for i in joint if i in measured]
        if seen:
            found += _turned(simulator, seen) + _in_other_units(simulator, seen)
    return found


def _turned(simulator: HostSimulator, joint: Sequence[int]) -> list[Convention]:
    """Counted the other way round, or from a quarter or half turn away."""
    channels = [simulator.physical_channels[i] for i in joint]
    first = channels[0]
    turns = (first.angle or first.unit == "rad") and first.kind == "position"
    found = []
    for sign, zero in itertools.product((1.0, -1.0), QUARTERS if turns else QUARTERS[:1]):
        changes = [f"`offset: {zero:.6g}`"] if zero else []
        changes += ["`scale: -1`"] if sign < 0 else []
        names = [channel.name for channel in (channels if sign < 0 else channels[:1])]
        if changes:
            says = f"{' and '.join(changes)} for {' and '.join(names)}"
            found.append(_of_states(simulator, says, joint, sign, zero))
    return found


def _in_other_units(simulator: HostSimulator, joint: Sequence[int]) -> list[Convention]:
    """A position and its rate in units that go together."""
    channels = [simulator.physical_channels[i] for i in joint]
    found = []
    for name, unit in _other_units(channels[0]):
        said = [f"`unit: {name}` for {channels[0].name}"]
        for rate in channels[1:]:
            alike = [n for n, u in _other_units(rate) if np.isclose(u.factor, unit.factor)]
            said += [f"`unit: {one}` for {rate.name}" for one in alike]
        if len(said) == len(channels):
            says = f"{' and '.join(said)} ({_beside_a_unit(unit)})"
            found.append(_of_states(simulator, says, joint, unit.factor, unit.offset))
    return found


def _beside_a_unit(unit: Unit) -> str:
    """The same change of a column whose unit is stated already, and is not what it should be."""
    lines = [f"`scale: {unit.factor:.6g}`"] if unit.factor != 1.0 else []
    lines += [f"`offset: {unit.offset:.6g}`"] if unit.offset else []
    return f"{' and '.join(lines)} if a unit is stated"


def _other_units(channel: Channel) -> list[tuple[str, Unit]]:
    units = [(name, find_unit(name, channel.unit)) for name in units_of(channel.unit)]
    return [(name, unit) for name, unit in units if unit != (1.0, 0.0)]


def _of_input(
    simulator: HostSimulator, says: str, place: int, factor: float, offset: float = 0.0
) -> Convention:
    plain = _as_said(simulator)
    plain.inputs[:, place] = factor, offset
    return dataclasses.replace(plain, says=says)


def _of_states(
    simulator: HostSimulator, says: str, joint: Sequence[int], factor: float, offset: float
) -> Convention:
    """A position and its rate count alike, but for its zero."""
    plain = _as_said(simulator)
    plain.states[0, joint] = factor
    plain.states[1, joint[0]] = offset
    return dataclasses.replace(plain, says=says)


def _beyond(convention: Convention) -> Convention | None:
    """With thrice its factors: as good only where they make a force too small to matter."""
    states, inputs = convention.states.copy(), convention.inputs.copy()
    for factors in (states[0], inputs[0]):
        factors[np.abs(factors) != 1.0] *= 3.0
    same = np.array_equal(states, convention.states) and np.array_equal(inputs, convention.inputs)
    return None if same else Convention(convention.says, states, inputs)


def _as_said(simulator: HostSimulator) -> Convention:
    sizes = len(simulator.physical_channels), len(simulator.action_channels)
    states, inputs = (np.vstack([np.ones(n), np.zeros(n)]) for n in sizes)
    return Convention("", states, inputs)


def _error(simulator: HostSimulator, fitter: SmoothFitter, convention: Convention) -> float:
    """Mean error of forecasts straight from what was measured, in units of the usual way."""
    samples, windows = fitter.samples, fitter.blocks.windows
    (factor, offset), (gain, bias) = convention.states, convention.inputs
    samples = dataclasses.replace(
        samples, seen=factor * samples.seen + offset, actions=gain * samples.actions + bias,
        recorded=tuple(
            dataclasses.replace(
                run, actions=gain * run.actions + bias,
                before=None if run.before is None else gain * run.before + bias,
            )
            for run in samples.recorded
        ),
    )  # fmt: skip
    model, none = Model(simulator), np.zeros((1, 0))
    nodes = paths.measured(model, samples, none[0])
    most = AT_ONCE if simulator.advances_rows_at_once else BY_ROW
    some = np.unique(np.linspace(0, len(windows) - 1, most).astype(int))
    index, inside = windows.index[some], windows.inside[some]
    asked = dataclasses.replace(fitter, samples=samples)
    shown = asked.shown(
        model, index[:, 0], nodes[index[:, 0]], index.shape[1] - 1, none,
        np.zeros(len(some), int),
    )  # fmt: skip
    seen = samples.seen[index][..., samples.measured]
    there = np.isfinite(seen) & inside[..., None]
    count = np.maximum(there.sum(axis=1), 1)
    way = np.where(there, seen - nodes[index[:, :1]][..., samples.measured], 0.0)
    usual = np.sqrt((way**2).sum(axis=(0, 1)) / np.maximum(there.sum(axis=(0, 1)), 1))
    miss = np.where(there, (shown - seen) / np.where(usual > 0, usual, 1.0), 0.0)
    with np.errstate(over="ignore"):  # what runs away is wrong, too
        squares = np.nan_to_num(miss, nan=np.inf) ** 2
    each = np.sqrt(squares.sum(axis=(1, 2)) / np.maximum(count.sum(axis=1), 1))
    return float(np.minimum(each, WRONG).mean())
