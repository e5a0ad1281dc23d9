"""Options that name a class, and what another class that is named for one takes the place of.

A parser takes settings of the class that stood there for settings of the new one, wherever that has
some of the same name (https://github.com/mauvilsa/jsonargparse/issues/460): a network of
scikit-learn had the 60 iterations of a Gaussian process.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

SIMULATORS = ("--simulator", "--corrected")
CLASSES = (*SIMULATORS, "--estimator")
IMPORT_PATH = re.compile(r"\w+(\.\w+)+")


def class_of_word(word: str) -> dict[str, str]:
    """The option by which a word of the command line names a class, if it does."""
    name = word.partition("=")[0]
    return {name.removeprefix("--"): word} if name in CLASSES else {}


def without_replaced(settings: Mapping[str, Any], words: Sequence[str]) -> dict[str, Any]:
    """Settings of a file without the classes that the command line names another one for."""
    found = dict(settings)
    for i, word in enumerate(words):
        name, equals, value = word.partition("=")
        if name in CLASSES and IMPORT_PATH.fullmatch(
            chosen := value if equals else "".join(words[i + 1 : i + 2])
        ):
            inside = found.get(name.removeprefix("--"))
            known = inside.get("class_path") if isinstance(inside, Mapping) else inside
            if known != chosen:
                found.pop(name.removeprefix("--"), None)
    return found
