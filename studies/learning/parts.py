"""What objects are put together from: attributes, wrapped environments, what a closure holds."""

from __future__ import annotations

import types
from typing import Any

import gymnasium


def named(thing: Any) -> str:
    """A class or function as ``module:name``."""
    name = getattr(thing, "__qualname__", None) or getattr(thing, "__name__", "")
    return f"{getattr(thing, '__module__', None) or 'builtins'}:{name}"


def attributes_of(value: Any) -> dict[str, Any]:
    """All attributes of an object by name, those in slots too."""
    found: dict[str, Any] = {}
    for kind in type(value).__mro__:
        names = kind.__dict__.get("__slots__", ())
        for name in (names,) if isinstance(names, str) else names:
            if hasattr(value, name):
                found[name] = getattr(value, name)
    return found | getattr(value, "__dict__", {})


def layers_of(env: gymnasium.Env[Any, Any]) -> list[gymnasium.Env[Any, Any]]:
    """An environment and all that it wraps, from outside."""
    found = [env]
    while isinstance(env, gymnasium.Wrapper):
        env = env.env
        found.append(env)
    return found


def cell_content(cell: types.CellType) -> Any:
    """What a closure holds there."""
    try:
        return cell.cell_contents
    except ValueError:  # of a function that is not complete yet
        return None


def written(value: Any) -> dict[str, str]:
    """What a value without attributes, such as a range or a fraction, says of itself."""
    hashed: Any = type(value).__hash__
    text = repr(value) if hashed and hashed != object.__hash__ else ""
    return {"value": text} if text and " at 0x" not in text else {}
