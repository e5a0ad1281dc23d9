"""What acts in a system that is written out as equations: its effects beside what its author wrote.

States are joints first and rows last, as in ``sims.rows``.
"""

from __future__ import annotations

import math
import operator
import threading
from collections.abc import Callable, Mapping, Sequence
from types import SimpleNamespace
from typing import Any, TypeVar

from sims.altered import carrying, held_back, in_flows
from sims.effects.base import Effect
from sims.effects.coupling import Coupling
from sims.effects.drive_limit import DriveLimit
from sims.effects.exchange import BetweenStates
from sims.effects.flexible import flexible_parts
from sims.effects.flow import AmbientFlow
from sims.effects.friction import DryFriction
from sims.effects.inertia import InertiaEffect
from sims.effects.joint import JointEffect
from sims.effects.limit import RateLimit
from sims.effects.link import Link
from sims.effects.parameter_curve import ParameterCurve
from sims.effects.response import AsymmetricResponse
from sims.effects.store import stores
from sims.host import HostSimulator
from sims.motion import Acceleration, DriveForce, Flow, Motion
from sims.simulator import Array
from sims.values import Values

#: What a thread asked for last: a path asks for the same motion at every step.
_last = threading.local()

#: Effects that alter what an author wrote.
E = TypeVar("E", AmbientFlow, DriveLimit)
Numbered = dict[str, tuple[int, E]]
#: Where a channel stands: among positions (0), rates (1) or inputs (2), and its row there.
Places = Mapping[str, tuple[int, int]]


def kept_motion(host: HostSimulator, make: Callable[[], Motion]) -> Motion:
    """How a system moves: what it was made of last, if that is what it is made of now.

    Args:
        host: The system.
        make: Makes the motion anew.
    """
    own = (host, host.effects, host.joints, *host.parameters, *host.parameters.values())
    if not _same(getattr(_last, "of", ()), own):
        _last.of, _last.motion = own, make()
    motion: Motion = _last.motion
    return motion


def kept_scale(host: HostSimulator, joint: str, make: Callable[[], float]) -> float:
    """The typical force on a joint: what it was last, if the system is the same but for effects.

    Args:
        host: The system.
        joint: Which.
        make: Works it out anew.
    """
    rest = {**vars(host), "effects": None, "state_channels": None}
    own = (type(host), *host.physical_channels, *rest, *rest.values())
    if not _same(getattr(_last, "scales_of", ()), own):
        _last.scales_of, _last.scales = own, {}
    scales: dict[str, float] = _last.scales
    if joint not in scales:
        scales[joint] = make()
    return scales[joint]


def _same(known: tuple[object, ...], own: tuple[object, ...]) -> bool:
    """Whether a thing is made of the very objects that it was made of."""
    return len(known) == len(own) and all(map(operator.is_, known, own))


def motion_of(
    host: HostSimulator,
    names: Sequence[str],
    places: Places,
    acceleration: Acceleration,
    drive_force: DriveForce,
) -> Motion:
    """How a system moves with its effects, in no span of time yet.

    Args:
        host: The system.
        names: Its joints, in the order of rows.
        places: Where its state channels stand.
        acceleration, drive_force: See ``Motion``.
    """
    there = [effect for effect in host.effects if not effect.absent]
    forces = [(names.index(e.joint), e.where_turn_is(_turn(host, e))) for e in host.joint_effects()]
    flows: list[tuple[int, int, Flow]] = [
        (names.index(e.pair[0]), names.index(e.pair[1]), e)
        for e in there
        if isinstance(e, BetweenStates | Coupling | Link)
    ]
    flows += [(names.index(e.joint), len(names) + i, e) for i, e in enumerate(stores(host))]
    states = len(names) + len(stores(host))
    parts = [(names.index(e.joint), states + i, e) for i, e in enumerate(flexible_parts(host))]
    added = {
        f"{e} {i}": (names.index(e.joint), e.where_turn_is(_turn(host, e)))
        for i, e in enumerate(there)
        if isinstance(e, InertiaEffect)
    }
    mediums = _at_joints(there, names, AmbientFlow)
    limits = _at_joints(there, names, DriveLimit)
    altering = {
        f"{name} {field}": getattr(e, field)
        for name, (_, e) in {**added, **mediums, **limits}.items()
        for field in e.numbers()
    }
    speeds = {joint.name: joint.rate is not None for joint in host.joints}
    inputs = {channel.name: (2, k) for k, channel in enumerate(host.action_channels)}
    curves = [e for e in there if isinstance(e, ParameterCurve)]
    follow = _Following(host, curves, {**places, **inputs})
    written = follow.in_place(acceleration), follow.in_place(drive_force)
    acceleration, drive_force = held_back(*written, limits)
    return Motion(
        carrying(in_flows(acceleration, mediums), added),
        drive_force,
        Values(**host.parameter_values(), **altering, **follow.numbers()),
        smooth=tuple((j, e) for j, e in forces if not isinstance(e, DryFriction)),
        dry=tuple((j, e) for j, e in forces if isinstance(e, DryFriction)),
        plays=tuple((names.index(e.joint), e) for e in host.plays()),
        capped=tuple((names.index(e.joint), e) for e in there if isinstance(e, RateLimit)),
        returns=tuple(
            (names.index(e.joint), e, speeds[e.joint])
            for e in there
            if isinstance(e, AsymmetricResponse)
        ),
        flows=tuple(flows),
        parts=tuple(parts),
    )


def _at_joints(there: Sequence[Effect], names: Sequence[str], kind: type[E]) -> Numbered[E]:
    """The effects of one kind with the number of their joint, by a name of their own."""
    own = [(i, e) for i, e in enumerate(there) if isinstance(e, kind)]
    return {f"{e} {i}": (names.index(e.joint), e) for i, e in own}


def _turn(host: HostSimulator, effect: JointEffect | InertiaEffect) -> float:
    """A whole turn in the unit of the joint that an effect acts on."""
    positions = {joint.name: joint.position for joint in host.joints}
    there = next(c for c in host.state_channels if c.name == positions[effect.joint])
    return there.turn or math.tau


class _Following:
    """Parameters that follow a state or an input.

    The numbers of their curves are kept among the parameters, which are cut to rows as they are.
    """

    def __init__(
        self, host: HostSimulator, curves: Sequence[ParameterCurve], places: Places
    ) -> None:
        self._host, self._curves, self._places = host, curves, places

    def numbers(self) -> dict[str, Any]:
        """Numbers of the curves by a name of their own."""
        return {
            f"{i} {field}": getattr(curve, field)
            for i, curve in enumerate(self._curves)
            for field in curve.numbers()
        }

    def in_place(self, written: Callable[..., Array]) -> Callable[..., Array]:
        """What the author wrote, (q, v, u, ..., parameters), with parameters as they are there."""
        if not self._curves:
            return written

        def varied(q: Array, v: Array, u: Array, *rest: Any) -> Array:
            *given, p = rest
            return written(q, v, u, *given, self._there((q, v, u), p))

        return varied

    def _there(self, at: tuple[Array, Array, Array], p: SimpleNamespace) -> SimpleNamespace:
        values = dict(vars(p))
        for i, curve in enumerate(self._curves):
            own = {field: values[f"{i} {field}"] for field in curve.numbers()}
            kind, row = self._places[curve.over]
            values[curve.parameter] = curve.with_values(**own).changed(
                values[curve.parameter], at[kind][row], self._host
            )
        return Values(**values)
