"""Settings that have to be numbers, refused in plain words before the parser says so in many."""

from __future__ import annotations

import typing
from collections.abc import Mapping
from typing import Any

from jsonargparse.typing import NonNegativeFloat, PositiveFloat, PositiveInt

#: What numbers of these types are, in words.
NUMBERS: dict[Any, str] = {
    PositiveFloat: "a number above 0",
    NonNegativeFloat: "a number, 0 or more",
    PositiveInt: "a whole number, 1 or more",
}


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
