"""What made a result, in plain values: the source of code, and the settings of objects.

A result that is kept is right only for the code and the settings that it came from. Code counts
by the text of its module and of all modules of ours or the user's that it imports, libraries by
their version.
"""

from __future__ import annotations

import ast
import dataclasses
import functools
import hashlib
import importlib.util
import sys
import sysconfig
import types
from collections.abc import Iterator, Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from sklearn.base import BaseEstimator

_OURS = (
    "sims",
    "policy",
    "residual",
    "studies",
    "simgap",
    "simgap_arrays",
    "simgap_files",
    "simgap_npz",
)
_LIBRARIES = tuple(
    str(Path(folder).resolve())
    for folder in {sysconfig.get_path(kind) for kind in ("stdlib", "purelib", "platlib")}
)


def code_of(*things: Any) -> dict[str, str]:
    """Hashes of the modules behind classes, functions and objects, and versions of libraries.

    Args:
        things: Classes and functions, instances of classes, or names of modules.

    Returns:
        By module the hash of its source; by library its version.
    """
    found: dict[str, str] = {}
    waiting = [name for thing in things for name in _modules_of(thing)]
    while waiting:
        name = waiting.pop()
        if name in found:
            continue
        file = _source(name)
        if file is None:
            found |= _library(name.split(".")[0])
            continue
        digest, imports = _read(file, name, file.stat().st_mtime_ns)
        found[name] = digest
        waiting += imports
    return dict(sorted(found.items()))


def modules_in(settings: Any) -> set[str]:
    """The modules of all classes that ``settings_of`` has met, such as those of effects."""
    if isinstance(settings, Mapping):
        kind = settings.get("class")
        found = {kind.partition(":")[0]} if isinstance(kind, str) else set()
        return found.union(*(modules_in(value) for value in settings.values()))
    inside = settings if isinstance(settings, list) else []
    return set[str]().union(*(modules_in(one) for one in inside))


def _modules_of(thing: Any) -> Iterator[str]:
    if isinstance(thing, str):
        yield thing
        return
    kind = thing if isinstance(thing, type | types.FunctionType) else type(thing)
    if isinstance(kind, type):
        yield from (base.__module__ for base in kind.__mro__[:-1])
    else:
        yield kind.__module__


def _source(name: str) -> Path | None:
    """The file of a module of ours or the user's; None for a library, a built-in or a notebook."""
    module, top = sys.modules.get(name), name.split(".")[0]
    # To look inside a package imports it, which libraries are spared.
    if top != name and _source(top) is None:
        return None
    path = getattr(module, "__file__", None) if module else _origin(name)
    if not path or not str(path).endswith(".py"):
        return None
    file = Path(path).resolve()
    return file if top in _OURS or not str(file).startswith(_LIBRARIES) else None


@functools.cache
def _origin(name: str) -> str | None:
    try:
        spec = importlib.util.find_spec(name)
    except (ImportError, ValueError):
        return None
    return spec.origin if spec else None


@functools.lru_cache(maxsize=4096)
def _read(file: Path, name: str, _changed: int) -> tuple[str, tuple[str, ...]]:
    """Hash of a source file, and the modules that it imports."""
    text = file.read_bytes()
    package = name if file.name == "__init__.py" else name.rpartition(".")[0]
    imports: dict[str, None] = {}
    for node in _statements(ast.parse(text)):
        if isinstance(node, ast.Import):
            imports |= dict.fromkeys(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                above = package.split(".")[: len(package.split(".")) - node.level + 1]
                base = ".".join([*above, *([node.module] if node.module else [])])
            imports[base] = None
            if _source(base):
                imports |= dict.fromkeys(_inside(base, alias.name) for alias in node.names)
    return hashlib.sha256(text).hexdigest()[:16], tuple(imports)


def _inside(package: str, name: str) -> str:
    """The module behind a name that is imported from a package: a module of it, or of the name."""
    if _source(f"{package}.{name}"):
        return f"{package}.{name}"
    # Public names of ours are loaded from modules that no import statement mentions.
    home = getattr(getattr(sys.modules.get(package), name, None), "__module__", None)
    return home if isinstance(home, str) and _source(home) else package


def _statements(tree: ast.AST) -> Iterator[ast.stmt]:
    """All statements but those that only type checkers see."""
    for field in ("body", "orelse", "handlers", "finalbody"):
        for node in getattr(tree, field, ()):
            if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
                continue
            if isinstance(node, ast.stmt):
                yield node
            yield from _statements(node)


@functools.cache
def _library(package: str) -> dict[str, str]:
    names = _distributions().get(package, [])
    return {name: metadata.version(name) for name in names[:1]}


@functools.cache
def _distributions() -> Mapping[str, list[str]]:
    return metadata.packages_distributions()


def settings_of(value: Any, seen: tuple[int, ...] = ()) -> Any:
    """An object in plain values: numbers and texts as they are, arrays by their hash.

    Args:
        value: Any object; of one that is neither data nor of ours or the user's, such as a handle
            of a library, only the class counts.
        seen: Objects around it.

    Returns:
        What JSON can hold.
    """
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, np.ndarray | np.generic):
        array = np.ascontiguousarray(value)
        return [str(array.dtype), list(array.shape), hashlib.sha256(array.tobytes()).hexdigest()]
    if id(value) in seen:
        return "..."
    seen = (*seen, id(value))
    if isinstance(value, Mapping):
        return {str(key): settings_of(item, seen) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [settings_of(item, seen) for item in value]
    if isinstance(value, set | frozenset):
        return sorted(str(settings_of(item, seen)) for item in value)
    if isinstance(value, type):
        return f"{value.__module__}.{value.__qualname__}"
    if isinstance(value, functools.partial):
        return [settings_of(part, seen) for part in (value.func, value.args, value.keywords)]
    if isinstance(value, types.FunctionType):
        return _function(value, seen)
    if isinstance(value, types.MethodType):
        return [settings_of(value.__self__, seen), value.__func__.__qualname__]
    kind = f"{type(value).__module__}:{type(value).__qualname__}"
    if isinstance(value, BaseEstimator):
        return {"class": kind, **settings_of(value.get_params(deep=False), seen)}
    spec = getattr(value, "spec", None)
    if hasattr(spec, "to_json") and spec is not None:
        return {"class": kind, "environment": repr(spec)}
    if dataclasses.is_dataclass(value):
        fields = {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
        return {"class": kind, **settings_of(fields, seen)}
    if _source(type(value).__module__) is None and type(value).__module__ != "__main__":
        return {"class": kind}
    return {"class": kind, **settings_of(vars(value), seen), **_main_code(type(value))}


def _function(function: types.FunctionType, seen: tuple[int, ...]) -> Any:
    code = function.__code__
    cells = [cell.cell_contents for cell in function.__closure__ or ()]
    constants = [c for c in code.co_consts if not isinstance(c, types.CodeType)]
    text = hashlib.sha256(code.co_code + repr((constants, code.co_names)).encode()).hexdigest()
    name = f"{function.__module__}.{function.__qualname__}"
    given = [settings_of(part, seen) for part in (function.__defaults__, cells)]
    return [name, text[:16], *given]


def _main_code(kind: type) -> dict[str, Any]:
    """The methods of a class that was written in a notebook, whose source is in no module."""
    if kind.__module__ != "__main__":
        return {}
    methods = {k: v for k, v in vars(kind).items() if isinstance(v, types.FunctionType)}
    return {f"{name}()": _function(method, ()) for name, method in methods.items()}
