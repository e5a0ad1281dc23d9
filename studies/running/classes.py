"""Options that name a class, and what another class that is named for one takes the place of.

A parser takes settings of the class that stood there for settings of the new one, wherever that has
some of the same name (https://github.com/mauvilsa/jsonargparse/issues/460): a network of
scikit-learn had the 60 iterations of a Gaussian process.
"""

from __future__ import annotations

import importlib.util
import pydoc
import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from sims.simulator import Simulator

SIMULATORS = ("--simulator", "--corrected")
CLASSES = (*SIMULATORS, "--estimator")
FILES = ("--columns", "--config")
IMPORT_PATH = re.compile(r"\w+(\.\w+)+")


def class_of_word(word: str) -> dict[str, str]:
    """The option by which a word of the command line names a class, if it does."""
    name = word.partition("=")[0]
    return {name.removeprefix("--"): word} if name in CLASSES else {}


def no_class(word: str) -> str:
    """What is to be said of the name of a module where a class of it was expected; or nothing."""
    if not word.isidentifier() or importlib.util.find_spec(word) is None:
        return ""
    return f"{word} is a module, expected a class in it: {word}.CLASS"


def no_simulator(path: str) -> str:
    """What is to be said of an import path that leads to what is no class of a simulator."""
    try:
        found = pydoc.locate(path)
    except pydoc.ErrorDuringImport:
        return ""  # which is told by whoever loads it
    if found is None or (isinstance(found, type) and issubclass(found, Simulator)):
        return ""
    what = "no Simulator" if isinstance(found, type) else f"a {type(found).__name__}"
    return (
        f"{path} is {what}, expected a class that derives from sims.EquationOfMotion, "
        "sims.FirstOrderSystem or sims.Simulator"
    )


def unfinished(words: Sequence[str], contents: Iterable[Any]) -> str:
    """What a class that words or settings name does not define yet, as a line."""
    named: list[Any] = [path for i in range(len(words)) for path in _chosen(words, i).values()]
    for content in contents:
        if isinstance(content, Mapping):
            named += [content.get(option.removeprefix("--")) for option in CLASSES]
    for given in named:
        path = given.get("class_path") if isinstance(given, Mapping) else given
        module, _, name = str(path).rpartition(".")
        kind = getattr(sys.modules.get(module), name, None)
        if missing := getattr(kind, "__abstractmethods__", None):
            lacking = " and ".join(sorted(missing))
            return f"{path}: {name} does not define {lacking}, which what it derives from asks for"
    return ""


def _chosen(words: Sequence[str], i: int) -> dict[str, str]:
    """The import path that a word gives an option for, by that option; empty if it gives none."""
    name, equals, value = words[i].partition("=")
    chosen = value if equals else "".join(words[i + 1 : i + 2])
    return {name: chosen} if name in CLASSES and IMPORT_PATH.fullmatch(chosen) else {}


def without_replaced(settings: Mapping[str, Any], words: Sequence[str]) -> dict[str, Any]:
    """Settings of a file without the classes that the command line names another one for."""
    found = dict(settings)
    for i in range(len(words)):
        for option, chosen in _chosen(words, i).items():
            inside = found.get(option.removeprefix("--"))
            known = inside.get("class_path") if isinstance(inside, Mapping) else inside
            if known != chosen:
                found.pop(option.removeprefix("--"), None)
    return found
