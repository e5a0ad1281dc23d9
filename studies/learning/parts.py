"""What objects are put together from, and what compiled code is and names."""

from __future__ import annotations

import functools
import hashlib
import json
import types
from pathlib import Path
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


# Longer texts are no names of files.
_LONGEST = 1024


def code_hash(code: types.CodeType) -> str:
    """A hash of what a function does: its instructions, names and constants, not its place."""
    return hash_of(_told(code))


def hash_of(told: Any) -> str:
    """A short hash of plain values."""
    return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()[:16]


def named_in(code: types.CodeType) -> tuple[set[str], set[str]]:
    """Names that code and the functions within it use, and texts that stand in it."""
    names, texts = set(code.co_names), set[str]()
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            more = named_in(constant)
            names, texts = names | more[0], texts | more[1]
        elif isinstance(constant, str):
            texts.add(constant)
    return names, texts


def file_content(text: str, near: Path | None = None) -> dict[str, str] | None:
    """The file that a text names, by name and content.

    Args:
        text: Maybe a path.
        near: A folder to look in beside the present one: that of the code which holds the text.

    Returns:
        None if there is no such file.
    """
    if not 0 < len(text) < _LONGEST or "\n" in text:
        return None
    for path in (Path(text), near / text if near else Path(text)):
        try:
            if path.is_file():
                state = path.stat()
                content = _read(path.resolve(), state.st_mtime_ns, state.st_size)
                return {"file": path.name, "content": content}
        except (OSError, ValueError):
            continue
    return None


@functools.lru_cache(maxsize=4096)
def _read(path: Path, _changed: int, _size: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:16]


def _told(code: types.CodeType) -> list[Any]:
    names = [*code.co_names, "|", *code.co_freevars]
    constants = [_constant(constant) for constant in code.co_consts]
    return [code.co_code.hex(), code.co_exceptiontable.hex(), names, constants]


def _constant(value: Any) -> Any:
    """A constant without the order of sets, which differs between processes."""
    if isinstance(value, types.CodeType):
        return _told(value)
    if isinstance(value, frozenset):
        return ["set", sorted(json.dumps(_constant(item)) for item in value)]
    return [_constant(item) for item in value] if isinstance(value, tuple) else repr(value)
