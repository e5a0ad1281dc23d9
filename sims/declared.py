"""What a simulator's class declares: refused in one line where it cannot be meant so."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence

import numpy as np

from sims import effects
from sims.simulator import Channel, Parameter


def refuse_declarations(simulator: object) -> None:
    """Refuse a simulator of which channels or parameters are not what they have to be.

    Raises:
        ValueError: The message names the class, what is wrong with it, and what was expected.
    """
    kind = type(simulator)
    for name, example in (
        ("state_channels", 'Channel("x", "m", "position")'),
        ("action_channels", 'Channel("push", "N", "input")'),
    ):
        expected = f"expected {name} = ({example}, ...)"
        if not hasattr(simulator, name):
            near = difflib.get_close_matches(name, vars(kind), 1)
            hint = f"; did you mean it by {near[0]}?" if near else ""
            raise ValueError(f"{kind.__name__} has no {name}, {expected}{hint}")
        channels = getattr(simulator, name)
        if isinstance(channels, Channel):
            raise ValueError(
                f"{kind.__name__}.{name} is one Channel, expected a tuple: ({example},) with a "
                "comma behind it"
            )
        if isinstance(channels, str) or not isinstance(channels, Sequence):
            raise ValueError(f"{kind.__name__}.{name} is {channels!r}, {expected}")
        for channel in channels:
            if not isinstance(channel, Channel):
                raise ValueError(f"{kind.__name__}.{name} holds {channel!r}, {expected}")
            if channel.kind == "memory":
                raise ValueError(
                    f"{kind.__name__}: channel {channel.name!r} is of kind 'memory', which effects "
                    "append; a state of its own is of kind 'other', 'position' or 'rate', logged "
                    "or not"
                )
    _refuse_parameters(kind.__name__, getattr(simulator, "parameters", {}))


def is_period(dt: object) -> bool:
    """Whether it is a finite number above zero."""
    return isinstance(dt, int | float | np.number) and bool(np.isfinite(dt) and dt > 0)


def refuse_period(simulator: object, dt: object) -> None:
    """Refuse a control period that is none.

    Raises:
        ValueError: The message names the class, and what was expected.
    """
    if not is_period(dt) or isinstance(dt, bool):
        name = type(simulator).__name__
        raise ValueError(f"{name}: dt is {dt!r}, expected the control period in s, above zero")


def _refuse_parameters(whose: str, parameters: object) -> None:
    if not isinstance(parameters, Mapping):
        expected = 'expected {"mass": Parameter(1.0, "kg", "what it is"), ...}'
        raise ValueError(f"{whose}.parameters is {parameters!r}, {expected}")
    for name, parameter in parameters.items():
        if not isinstance(parameter, Parameter):
            raise ValueError(
                f"{whose}.parameters: {name!r} is {parameter!r}, expected "
                f'Parameter({parameter!r}, "unit", "what it is")'
            )
        families = _families()
        near = difflib.get_close_matches(parameter.family, families, 1)
        if near and parameter.family not in families:
            raise ValueError(
                f"{whose}.parameters: {name!r} is of the family {parameter.family!r}; did you mean "
                f"{near[0]!r}?"
            )
        if not np.issubdtype(np.asarray(parameter.value).dtype, np.number):
            raise ValueError(
                f"{whose}.parameters: {name!r} has the value {parameter.value!r}, expected a number"
            )


def _families() -> set[str]:
    """What effects that differ in form more than in kind have in common, see ``Effect``."""
    kinds = (kind for kind in vars(effects).values() if isinstance(kind, type))
    return {kind.family for kind in kinds if issubclass(kind, effects.Effect) and kind.family}
