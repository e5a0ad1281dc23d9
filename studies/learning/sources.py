"""The source of code: what a result was computed with, module by module.

Code counts by the text of its module and of all modules of ours or the user's that it imports,
libraries by their version. What values modules hold, ``described.py`` tells.
"""

from __future__ import annotations

import ast
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

_OURS = ("sims", "policy", "residual", "studies", "simgap", "simgap_files")
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


def is_users(module: str | None) -> bool:
    """Whether a module is the user's: a file of theirs, a notebook or a script, no library."""
    if not isinstance(module, str):  # of a class that was made while the program ran
        return False
    if module == "__main__":
        return True
    return module.split(".")[0] not in _OURS and _source(module) is not None


def is_ours(module: str | None) -> bool:
    """Whether a module is of this toolkit, where the text of the module is enough."""
    return isinstance(module, str) and module.split(".")[0] in _OURS


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
    file = _resolved(str(path))
    return file if top in _OURS or not str(file).startswith(_LIBRARIES) else None


@functools.lru_cache(maxsize=4096)
def _resolved(path: str) -> Path:
    """Without links, which every step of a run would follow anew for every module."""
    return Path(path).resolve()


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
