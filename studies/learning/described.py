"""Objects in plain values: what they hold, and the code behind them with what it reads.

Numbers and texts stay as they are, arrays and files count by their content. Of the user's functions
and classes the compiled code counts, with all that it names: globals, closures, defaults, class
attributes, base classes. Of ours the text of the module is enough (``sources.py``), of libraries
the version. Nothing here depends on addresses, on the order of sets or on the clock, so that the
same objects say the same in another process.
"""

from __future__ import annotations

import contextlib
import dataclasses
import enum
import functools
import hashlib
import json
import types
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import RecordConstructorArgs

from studies.learning.parts import (
    attributes_of,
    cell_content,
    code_hash,
    file_content,
    hash_of,
    layers_of,
    named,
    named_in,
    written,
)
from studies.learning.sources import is_ours, is_users

#: Objects within objects are followed so far, and lists of plain values written out so far.
_DEEP, _LONG = 40, 100
# What a class holds that its author did not write, and what Gymnasium keeps of a run.
_OF_PYTHON = ("__dict__", "__weakref__", "__module__", "__qualname__", "__doc__", "_abc_impl")
_SLOTS = (types.MemberDescriptorType, types.GetSetDescriptorType)
_OF_GYMNASIUM = ("env", "_np_random", "_np_random_seed", "_cached_spec", "_metadata")
_CONTAINERS = (Mapping, list, tuple, type, types.FunctionType, types.MethodType, functools.partial)

#: An attribute of environments of a class, as (module:class, attribute).
Attribute = tuple[str, str]


def settings_of(value: Any, state: frozenset[Attribute] = frozenset()) -> Any:
    """An object in plain values.

    Args:
        value: Any object. Of a library's objects the public data count, not what these hold
            behind other objects, such as the model in an engine's handle.
        state: Attributes of environments that are no settings.

    Returns:
        What JSON can hold: the ``value``, and the ``code`` of the user's that it leads to, by name.
        ``"class"`` and ``"function"`` name classes and functions as ``module:name``.
    """
    walk = _Walk(state)
    told = walk.value(value, ())
    return {"value": told, "code": walk.code}


def modules_in(settings: Any) -> set[str]:
    """The modules of all classes and functions that ``settings_of`` has met."""
    if isinstance(settings, Mapping):
        names = (settings.get(key) for key in ("class", "function"))
        found = {name.partition(":")[0] for name in names if isinstance(name, str)}
        return found.union(*(modules_in(value) for value in settings.values()))
    inside = settings if isinstance(settings, list) else []
    return set[str]().union(*(modules_in(one) for one in inside))


class _Walk:
    """One walk over objects; ``code`` holds each function and class of the user's once."""

    def __init__(self, state: frozenset[Attribute]) -> None:
        self.code: dict[str, Any] = {}
        self._state = state
        self._met: dict[int, tuple[Any, str]] = {}

    def value(self, value: Any, around: tuple[Any, ...], near: Path | None = None) -> Any:
        """In plain values.

        Args:
            value: Any object.
            around: The objects that hold it.
            near: A folder in which files may be named, beside the present one.
        """
        if value is None or type(value) in (bool, int, float):
            return value
        if isinstance(value, str | Path):
            return file_content(str(value), near) or str(value)
        if isinstance(value, bytes | bytearray):
            return ["bytes", hash_of(value.hex())]
        if isinstance(value, np.ndarray | np.generic):
            return self._array(np.asarray(value), around)
        if any(value is one for one in around) or len(around) > _DEEP:
            return "..."
        inside = (*around, value)
        if isinstance(value, enum.Enum):
            return {"class": named(type(value)), "name": value.name}
        if isinstance(value, Mapping):
            keys = {k if isinstance(k, str) else _text(settings_of(k)): k for k in value}
            return {name: self.value(value[keys[name]], inside, near) for name in sorted(keys)}
        if isinstance(value, list | tuple):
            return _short([self.value(item, inside, near) for item in value])
        if isinstance(value, set | frozenset):
            # Each by itself: sets have another order in every process.
            return _short(sorted((settings_of(item) for item in value), key=_text))
        if isinstance(value, functools.partial):
            return [self.value(p, inside) for p in (value.func, value.args, value.keywords)]
        if isinstance(value, types.MethodType):
            return [self.value(part, inside) for part in (value.__self__, value.__func__)]
        if isinstance(value, types.ModuleType):
            return {"class": f"{value.__name__}:"}
        if isinstance(value, types.FunctionType):
            return {"function": named(value), **self._function(value, inside)}
        if isinstance(value, type):
            return {"class": named(value), **self._class(value, inside)}
        if isinstance(value, gymnasium.Env):
            return [self._layer(layer, inside) for layer in layers_of(value)]
        return self._object(value, around)

    def _object(self, value: Any, around: tuple[Any, ...]) -> Any:
        kind, inside = type(value), (*around, value)
        told = {"class": named(kind), **self._class(kind, inside)}
        if hasattr(kind, "get_params") and hasattr(kind, "set_params"):  # an estimator
            fitted = {k: v for k, v in attributes_of(value).items() if k.endswith("_")}
            return told | self.value({**value.get_params(deep=False), **fitted}, inside)
        if dataclasses.is_dataclass(value):
            fields = {f.name: getattr(value, f.name, None) for f in dataclasses.fields(value)}
            return told | self.value(fields, inside)
        if is_users(kind.__module__) or is_ours(kind.__module__):
            # What it is pickled by leaves out what it only keeps for speed.
            own = any("__getstate__" in vars(base) for base in kind.__mro__[:-1])
            held = attributes_of(value)
            if own:
                with contextlib.suppress(Exception):  # what cannot be pickled has attributes
                    held = value.__getstate__()
            return told | {"held": self.value(held, inside)}
        # From here on it is a library's: a decorated function, an array, or any other object.
        behind = [getattr(value, n, None) for n in ("__wrapped__", "__func__", "func", "fget")]
        if of := [one for one in behind if isinstance(one, types.FunctionType)]:
            of += [one for n in ("fset", "fdel") if (one := getattr(value, n, None))]
            return told | {"of": self.value(of, inside)}
        if hasattr(value, "__array__"):
            try:
                plain = value.detach() if hasattr(value, "detach") else value
                return told | {"array": self._array(np.asarray(plain), inside)}
            except Exception:
                return told
        if callable(value) and hasattr(value, "__name__"):
            return told | {"function": named(value)}
        if around and not _followed(around[-1]):
            return told
        public = {k: v for k, v in attributes_of(value).items() if not k.startswith("_")}
        return told | (self.value(public, inside) if public else written(value))

    def _layer(self, env: gymnasium.Env[Any, Any], inside: tuple[Any, ...]) -> Any:
        """One environment of a chain: what it was made with, and the attributes it has now."""
        kind = named(type(env))
        told = {"class": kind, **self._class(type(env), inside)}
        if isinstance(env, RecordConstructorArgs):
            given = getattr(env, "_saved_kwargs", {})
            told["made with"] = self.value(given, inside)
            if not is_users(type(env).__module__):
                return told
        kept = {
            name: value
            for name, value in attributes_of(env).items()
            if name not in _OF_GYMNASIUM and (kind, name) not in self._state
        }
        return told | self.value(kept, (*inside, env))

    def _array(self, array: np.ndarray, around: tuple[Any, ...]) -> Any:
        if array.dtype.hasobject:
            return ["objects", list(array.shape), self.value(array.ravel().tolist(), around)]
        content = np.ascontiguousarray(array).tobytes()
        return [str(array.dtype), list(array.shape), hashlib.sha256(content).hexdigest()]

    def _function(self, function: types.FunctionType, inside: tuple[Any, ...]) -> dict[str, Any]:
        """What a function was given, and by what name its code is told."""
        module = function.__module__ or ""
        if not (is_users(module) or is_ours(module)):
            return {}
        if id(function) in self._met:
            return {"as": self._met[id(function)][1]}
        code = function.__code__
        key = self._meet(function, f"{named(function)} {code_hash(code)}")
        told: dict[str, Any] = {
            "defaults": [function.__defaults__, function.__kwdefaults__],
            "closure": [cell_content(cell) for cell in function.__closure__ or ()],
        }
        told = {name: self.value(given, inside) for name, given in told.items()}
        if is_users(module):
            told["reads"] = self._reads(code, function.__globals__, inside)
        self.code[key] = told
        return {"as": key}

    def _class(self, kind: type, inside: tuple[Any, ...]) -> dict[str, Any]:
        """By what name the code of a class is told; nothing for ours and a library's."""
        if not is_users(kind.__module__):
            return {}
        if id(kind) in self._met:
            return {"as": self._met[id(kind)][1]}
        key = self._meet(kind, named(kind))
        told: dict[str, Any] = {"bases": [self.value(base, inside) for base in kind.__bases__]}
        methods = [v for v in vars(kind).values() if isinstance(v, types.FunctionType)]
        near = Path(methods[0].__code__.co_filename).parent if methods else None
        for name in sorted(vars(kind)):
            value = vars(kind)[name]
            # Of what Python keeps under such names, only methods are the author's.
            if name in _OF_PYTHON or isinstance(value, _SLOTS):
                continue
            if not _reserved(name) or isinstance(value, types.FunctionType):
                told[name] = self.value(value, inside, near)
        self.code[key] = told
        return {"as": key}

    def _meet(self, thing: Any, name: str) -> str:
        taken = {key for _, key in self._met.values()}
        key = next(k for k in (name, *(f"{name} {n}" for n in range(2, 9999))) if k not in taken)
        self._met[id(thing)] = thing, key
        return key

    def _reads(
        self, code: types.CodeType, places: Mapping[str, Any], inside: tuple[Any, ...]
    ) -> dict[str, Any]:
        """What code reads: globals, names in the user's modules, and files that it names."""
        names, texts = named_in(code)
        near = Path(code.co_filename).parent
        found = self._globals(names, places, inside)
        files = {text: file_content(text, near) for text in sorted(texts)}
        return found | {text: content for text, content in files.items() if content}

    def _globals(
        self, names: set[str], places: Mapping[str, Any], inside: tuple[Any, ...]
    ) -> dict[str, Any]:
        """Values by name, and by the same names in the user's modules among them."""
        found: dict[str, Any] = {}
        for name in sorted(names & places.keys()):
            value = places[name]
            if _reserved(name) or any(value is one for one in inside):
                continue
            found[name] = self.value(value, inside)
            if isinstance(value, types.ModuleType) and is_users(value.__name__):
                found[name] |= self._globals(names, vars(value), (*inside, value))
        return found


def _followed(holder: Any) -> bool:
    """Whether a library's object in it counts: in ours, in the user's and in containers."""
    module = type(holder).__module__
    return isinstance(holder, _CONTAINERS) or is_users(module) or is_ours(module)


def _reserved(name: str) -> bool:
    return name.startswith("__") and name.endswith("__")


def _short(values: list[Any]) -> Any:
    """A list as it is, or a long one of plain values by its hash."""
    if len(values) <= _LONG or any(isinstance(value, dict | list) for value in values):
        return values
    return [f"{len(values)} values", hash_of(values)]


def _text(told: Any) -> str:
    return json.dumps(told, sort_keys=True)
