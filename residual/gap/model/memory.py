"""The memory of effects that moves with a state: places in plays, stores, parts on springs.

It follows the physical states in columns of its own, in the order of ``sims.actuation``.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from residual.gap.data.samples import Samples
from residual.gap.model.following import filled, swung
from sims.effects.backlash import Backlash
from sims.effects.base import Effect
from sims.effects.flexible import FlexiblePart
from sims.effects.parameter import ParameterChange
from sims.effects.store import SecondStore
from sims.host import HostSimulator

Array = NDArray[np.float64]

#: Columns of an effect of each kind.
COLUMNS: dict[type[Effect], int] = {Backlash: 1, SecondStore: 1, FlexiblePart: 2}
#: Typical variation of a place in a play, as a share of half its width.
PLAY = 0.1
#: Part of a control period in which a rate shows what pulls at rest.
SHORT = 1e-3


class Memory:
    """Columns of a simulator's own effects and of chosen ones, at zero strength, too.

    Args:
        simulator: With its own effects.
        chosen: Beside these.

    Attributes:
        width: Columns of a state with its memory.
        swinging: Columns of flexible parts: noise makes their swing along a measured path large, so
            that their start value is free in every window.
    """

    def __init__(self, simulator: HostSimulator, chosen: Sequence[Effect]) -> None:
        self.simulator = simulator
        self.physical = len(simulator.physical_channels)
        self.effects = self._remembering(chosen)
        self.width = self.physical + sum(_columns(effect) for effect in self.effects)
        parts = sum(_columns(e) for e in self.effects if isinstance(e, FlexiblePart))
        self.swinging = range(self.width - parts, self.width)

    def of(self, host: HostSimulator) -> list[int]:
        """Columns that the simulator bound to some numbers has: those of absent effects are none.

        Args:
            host: With its own effects first, then those that are chosen.
        """
        columns, at = list(range(self.physical)), self.physical
        for effect in self._bound(host):
            width = _columns(effect)
            columns += [] if effect.absent else range(at, at + width)
            at += width
        return columns

    def scales(self, physical: Array) -> Array:
        """Typical variation of every column, from that of the physical ones."""
        sizes = list(physical)
        for effect in self.effects:
            if isinstance(effect, Backlash):
                sizes.append(PLAY)
            elif isinstance(effect, SecondStore):
                sizes.append(physical[self._place(effect.joint)])
            elif isinstance(effect, FlexiblePart):
                rate = physical[self._rate(effect)]
                sizes += [rate / (2 * np.pi * float(effect.frequency)), rate]
        return np.array(sizes)

    def beside(self, host: HostSimulator, samples: Samples, states: Array, without: bool) -> Array:
        """Physical states (n, n_physical) with their memory, see ``Model.widen``.

        Args:
            host: With its own effects first, then those that are chosen.
            samples: Whose states they are.
            states: Physical ones, (n, n_physical).
            without: Whether they are of a motion without the parts.

        Returns:
            shape (n, width).
        """
        full = np.zeros((len(states), self.width))
        full[:, : self.physical] = states
        if host.plays():
            # The play lies where the input before the sample has pushed it.
            before = np.vstack([samples.actions[:1], samples.actions[:-1]])
            for (start, _), recorded in zip(samples.runs, samples.recorded, strict=True):
                before[start] = recorded.first
            columns = self.of(host)[self.physical :]
            pushed = host.augment(states, before)[:, self.physical :][:, : len(columns)]
            full[:, columns] = pushed / half_plays(host, 1)
        at = self.physical
        for effect in self._bound(host):
            if isinstance(effect, SecondStore):
                column = full[:, self._place(effect.joint)]
                full[:, at] = filled(samples, column, float(effect.time))
            elif isinstance(effect, FlexiblePart):
                rate = self._rate(effect)
                pulled = effect.carried * self._by_position(host, states)[:, rate]
                full[:, at : at + 2] = swung(samples, full[:, rate], pulled, effect, without)
            at += _columns(effect)
        return full

    def _remembering(self, chosen: Sequence[Effect]) -> list[Effect]:
        there = [*(e for e in self.simulator.effects if not e.absent), *chosen]
        return [e for kind in COLUMNS for e in there if isinstance(e, kind)]

    def _bound(self, host: HostSimulator) -> list[Effect]:
        return self._remembering(host.effects[len(self.simulator.effects) :])

    def _by_position(self, host: HostSimulator, states: Array) -> Array:
        """Rates of change of physical states (n, n_physical) by forces of position alone."""
        kinds = [channel.kind for channel in self.simulator.physical_channels]
        if "position" not in kinds:
            return np.zeros_like(states)
        changes = [e for e in host.effects if isinstance(e, ParameterChange)]
        plain = self.simulator.with_effects(changes)
        rest = np.where([kind == "rate" for kind in kinds], 0.0, states)
        short = np.full(len(states), SHORT * plain.dt)
        still = np.zeros((len(states), 1, len(plain.action_channels)))
        return (plain.integrate(rest, still, short) - rest) / short[:, None]

    def _place(self, channel: str) -> int:
        names = [one.name for one in self.simulator.physical_channels]
        return names.index(channel)

    def _rate(self, part: FlexiblePart) -> int:
        rates = {joint.name: joint.rate for joint in self.simulator.joints}
        return self._place(str(rates[part.joint]))


def half_plays(host: HostSimulator, rows: int) -> Array:
    """Half the width of every play, (rows, n_memory); 1 in rows without play, and of the rest."""
    widths = [np.broadcast_to(play.width, rows) for play in host.plays()]
    others = len(host.integrated_channels) - len(host.physical_channels) - len(widths)
    widths += [np.full(rows, 2.0) for _ in range(others)]
    return np.stack([np.where(width > 0, 0.5 * width, 1.0) for width in widths], axis=1)


def _columns(effect: Effect) -> int:
    return next(count for kind, count in COLUMNS.items() if isinstance(effect, kind))
