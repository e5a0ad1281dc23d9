"""What may be missing: the library, or what a user asks for, less what no motion tells apart."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

from residual.gap.answer.curves import curves_for
from residual.gap.confirmation.aliases import aliases, beyond_parameters, representatives
from residual.gap.log import Log
from residual.gap.search.orders import higher_orders
from sims.chosen import LIBRARY, chosen_effects
from sims.effects.actuator import ActuatorEffect
from sims.effects.base import Effect
from sims.effects.curve import Curve
from sims.effects.flexible import FlexiblePart
from sims.effects.joint import Cogging
from sims.effects.library import curves_in, further_in, library, parts_in
from sims.effects.parameter_curve import ParameterCurve
from sims.host import HostSimulator


@dataclasses.dataclass(frozen=True)
class Offered:
    """Effects that may be missing.

    Attributes:
        by_label: All of them.
        kept: One of each group that no motion tells apart.
        less: Parameters that take away what there may be too much of, with the sign of the change
            that does, where what is kept cannot be negative.
        groups: Those groups by label.
        sets: Sets of which one is exactly made of the others.
        curves: Curves by points, for where laws of the library only come near.
        parts: Flexible parts, for where nothing of the library swings as the log does.
        further: Rarer effects, for where one of them takes much of what is left.
        asked: Curves by points that a user asks for.
        losses: That parameters, gains and loads make together, for where one stands for several.
        orders: Cogging of higher orders that the log shows, for where it takes much of what is
            left.
    """

    by_label: Mapping[str, Effect]
    kept: Sequence[Effect]
    less: Sequence[tuple[Effect, float]]
    groups: dict[str, tuple[str, ...]]
    sets: Sequence[tuple[str, ...]]
    curves: Sequence[Curve]
    parts: Sequence[FlexiblePart]
    further: Sequence[Effect]
    asked: Sequence[Curve] = ()
    losses: Sequence[Effect] = ()
    orders: Sequence[Cogging] = ()

    @classmethod
    def of(
        cls,
        log: Log,
        effects: Effect | str | Iterable[Effect | str | Mapping[str, Any]] | None,
        measured_input: bool | Collection[str],
    ) -> Offered:
        """Those that a user asks for, or the library, less what a measured input cannot show.

        Args:
            log: What was recorded.
            effects: As for ``find_gap``.
            measured_input: As for ``find_gap``.

        Raises:
            ValueError: One of them is not known, or cannot be looked for here, or there is no
                such input.
        """
        wanted = LIBRARY if effects is None else effects
        if isinstance(wanted, Effect | str | Mapping):
            wanted = [wanted]
        recorded = _measured(log.simulator, measured_input)
        offered = tuple(
            effect
            for effect in chosen_effects(log.simulator, list(wanted))
            if not (effect.upstream_of_sensor and recorded.intersection(_inputs(effect)))
        )
        # Those by name have no range yet: the log gives it.
        without_range = curves_in(log.simulator)
        asked = [
            e
            for e in offered
            if isinstance(e, Curve)
            and (e in without_range or (isinstance(e, ParameterCurve) and not e.ranged))
        ]
        if asked and log.simulator.has_contacts:
            raise ValueError(
                f"{asked[0]} is not looked for in what strikes the ground: leave it out of effects"
            )
        offered = tuple(effect for effect in offered if effect not in asked)
        there = {str(effect) for effect in offered}
        curves = curves_for(log.simulator, there)
        # Whoever asks for some effects does not ask for a part on a spring, or what is rarer.
        whole = {str(e) for e in library(log.simulator) if not e.upstream_of_sensor} <= there
        parts = [one for one in parts_in(log.simulator) if whole and str(one) not in there]
        further = [
            one
            for one in further_in(log.simulator)
            if whole and str(one) not in there and not recorded.intersection(_inputs(one))
        ]
        curves = tuple(curve for curve in curves if curve not in asked)
        named, offered = offered, beyond_parameters(log.simulator, offered)
        losses = [effect for effect in named if effect not in offered]
        groups, sets = aliases(log.simulator, offered, log.runs)
        kept, less = representatives(log.simulator, offered, groups)
        by_label = {str(effect): effect for effect in offered}
        orders = () if log.simulator.has_contacts else higher_orders(log.simulator, log.runs, kept)
        return cls(
            by_label, kept, less, groups, sets, curves, parts, further, asked, losses, orders
        )


def _inputs(effect: Effect) -> tuple[str, ...]:
    """The inputs that an effect acts on."""
    return effect.actuators if isinstance(effect, ActuatorEffect) else ()


def _measured(simulator: HostSimulator, given: bool | Collection[str]) -> frozenset[str]:
    """Names of the inputs that were measured at the actuator's output.

    Raises:
        ValueError: There is no such input.
    """
    names = [channel.name for channel in simulator.action_channels]
    if isinstance(given, bool):
        return frozenset(names if given else ())
    if unknown := sorted(set(given) - set(names)):
        there = ", ".join(names) or "none"
        raise ValueError(f"measured_input: no input {', '.join(unknown)}; there are {there}")
    return frozenset(given)
