"""Settings of the wrong kind, refused in plain words before the parser says so in many."""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Mapping
from typing import Any

from jsonargparse.typing import (
    ClosedUnitInterval,
    NonNegativeFloat,
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
)

#: What numbers of these types are, in words.
NUMBERS: dict[Any, str] = {
    PositiveFloat: "a number above 0",
    NonNegativeFloat: "a number, 0 or more",
    ClosedUnitInterval: "a share from 0 to 1, as 0.03 for 3 %",
    NonNegativeInt: "a whole number, 0 or more",
    PositiveInt: "a whole number, 1 or more",
}
UNIONS = (typing.Union, types.UnionType)


def check_number(name: str, value: str, kind: Any) -> None:
    """Refuse what is no number, or beyond its bounds.

    Args:
        name: The option, or the place of the setting.
        value: As it was typed.
        kind: Its type; all that is no number passes.

    Raises:
        ValueError: The message names the option and what was expected.
    """
    kinds = typing.get_args(kind) or (kind,)
    number = next((one for one in kinds if one in NUMBERS), None)
    if number is None or (type(None) in kinds and value in ("null", "None")):
        return
    try:
        number(value)
    except (TypeError, ValueError):
        raise ValueError(f"{name} {value}: expected {NUMBERS[number]}") from None


def check_numbers(configs: Mapping[str, Any], kinds: Mapping[str, Any]) -> None:
    """The same of configs, by file; ``kinds`` by option."""
    for path, inside in configs.items():
        for key, value in inside.items() if isinstance(inside, Mapping) else ():
            if isinstance(value, str):
                check_number(f"{path}: {key}", value, kinds.get(f"--{key}"))


def check_settings(path: str, inside: Any, kinds: Mapping[str, Any], start: str) -> None:
    """Refuse what stands in a file of settings where numbers, or names with values, have to.

    Args:
        path: The file.
        inside: What it holds.
        kinds: The type of every option.
        start: How the options of its settings begin.

    Raises:
        ValueError: The message names the file and the key, what stands there, what was expected.
    """
    if not isinstance(inside, Mapping):
        raise ValueError(f"{path}: expected names with values, as in `time: t`, not {inside!r:.60}")
    for name, value in inside.items():
        _check_kind(f"{path}: {name}", value, kinds.get(f"{start}{name}"))


def _check_kind(place: str, inside: Any, kind: Any) -> None:
    """Refuse what stands at a place of a file for its type; types of other kinds pass."""
    kinds = typing.get_args(kind) if typing.get_origin(kind) in UNIONS else (kind,)
    settings = next((one for one in kinds if dataclasses.is_dataclass(one)), None)
    values = next((one for one in kinds if typing.get_origin(one) is dict), None)
    if isinstance(inside, Mapping) and (settings or values):
        known = typing.get_type_hints(settings) if settings else {}
        for name, value in inside.items():
            below = known.get(name) if settings else typing.get_args(values)[1]
            _check_kind(f"{place}: {name}", value, below)
    elif isinstance(inside, str) and set(kinds) <= {float, int, type(None)}:
        try:
            float(inside)
        except ValueError:
            number = "a number" if float in kinds else "a whole number"
            raise ValueError(f"{place}: {inside!r}, expected {number}") from None
