"""Effects by name: those of the library, curves, parts, and classes of the user's own."""

from __future__ import annotations

import copy
import difflib
import importlib
from collections.abc import Mapping, Sequence
from typing import Any

import jsonargparse

from sims.effects.base import Effect
from sims.effects.library import curves_in, further_in, library, parts_in
from sims.effects.parameter import ParameterChange
from sims.effects.parameter_curve import FOLLOWING
from sims.host import HostSimulator
from sims.loading import one_line

#: In a list of effects: all that the simulator can host.
LIBRARY = "library"


def chosen_effects(
    simulator: HostSimulator, wanted: Sequence[Effect | str | Mapping[str, Any]]
) -> tuple[Effect, ...]:
    """The effects that a list names.

    Args:
        simulator: What hosts them.
        wanted: ``"library"``; effects of the library by name, ``"viscous_friction"`` or, at one
            place, ``"viscous_friction@pivot"``, parameters as ``"mass"``; a curve by points, as
            ``"friction_curve"`` or ``"parameter_curve@resistance over temp"``, or a
            ``"flexible_part"``; a class of your own by import path, ``"my_file.FanTorque"``, at
            every place that can host it or at one; or ``class_path`` and ``init_args``; or an
            effect itself.

    Raises:
        ValueError: Something is not known, or cannot act in this simulator.
    """
    known = {str(effect): effect for effect in library(simulator)}
    reserve = (*curves_in(simulator), *parts_in(simulator), *further_in(simulator))
    found: dict[str, Effect] = {}
    for entry in wanted:
        if isinstance(entry, Effect):
            own = [entry]
        elif isinstance(entry, Mapping):
            own = [_effect(entry)]
            own[0].measures(simulator)
        elif entry == LIBRARY:
            own = list(known.values())
        else:
            name, _, where = entry.partition("@")
            own = [e for e in (*known.values(), *reserve) if entry in (e.name, str(e))]
            if not own and entry in simulator.parameters:
                own = [ParameterChange(entry)]
            if name in FOLLOWING:
                own = [FOLLOWING[name].named(where)]
                own[0].measures(simulator)
            if not own and "." in name:
                own = _placed(simulator, name, where)
        if not own:
            there = [*known, *map(str, reserve)]
            near = difflib.get_close_matches(str(entry), there, 1)
            hint = f"did you mean {near[0]!r}? " if near else ""
            places = [e.where for e in (*known.values(), *reserve) if e.name == name and where]
            says = "Else give" if near else "give"
            says += " the import path of a class of your own, or name@place of "
            says += _by_place(there)
            if places:
                at = " or ".join(dict.fromkeys(places))
                says = f"there is no {where!r}, and {name} acts at {at}"
            raise ValueError(f"no effect {entry!r} for {simulator.name}: {hint}{says}")
        found.update({str(effect): effect for effect in own})
    return tuple(found.values())


def _placed(simulator: HostSimulator, path: str, where: str) -> list[Effect]:
    """An effect class at one place, or at every place that can host it."""
    if where:
        places = [where]
    else:
        places = [joint.name for joint in simulator.joints]
        places += [channel.name for channel in simulator.action_channels]
        places += [channel.name for channel in simulator.physical_channels]
    kind = _class(path)
    found, refused = [], ""
    for place in dict.fromkeys(places):
        try:
            effect = kind(place)  # type: ignore[call-arg]
            effect.quantities(simulator)
        except (ValueError, TypeError) as error:  # no such place, or it wants more than that
            refused = str(error)
            continue
        found.append(effect)
    if not found:
        raise ValueError(f"effect {path!r} cannot act in {simulator.name}: {refused}")
    return found


def _class(path: str) -> type[Effect]:
    module, _, name = path.rpartition(".")
    try:
        kind = getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError) as error:
        raise ValueError(f"no effect {path!r}: {error}") from None
    if not (isinstance(kind, type) and issubclass(kind, Effect)):
        raise ValueError(f"{path!r} is no effect; derive it from a class of sims.effects")
    return kind


def _effect(settings: Mapping[str, Any]) -> Effect:
    parser = jsonargparse.ArgumentParser(exit_on_error=False)
    parser.add_argument("--effect", type=Effect)
    try:
        chosen = parser.parse_object({"effect": copy.deepcopy(dict(settings))})
        return parser.instantiate(chosen).effect
    except jsonargparse.ArgumentError as error:
        raise ValueError(f"effect {settings}: {one_line(error)}") from None


def _by_place(labels: Sequence[str]) -> str:
    """``name@place`` of many in short: the names of each place, those of several places once."""
    places: dict[str, list[str]] = {}
    for label in labels:
        name, _, place = label.partition("@")
        places.setdefault(name, []).append(place)
    names: dict[str, list[str]] = {}
    for name, found in places.items():
        names.setdefault(" or ".join(filter(None, found)), []).append(name)
    told = [f"{', '.join(own)} @ {place}" for place, own in names.items() if place]
    return "; ".join([*told, *([", ".join(names[""])] if "" in names else [])])
