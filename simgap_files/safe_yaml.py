"""YAML settings that end: text that refers to itself or unfolds without bound is refused.

Importing this module makes jsonargparse, and so every command, read YAML this way.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jsonargparse
import yaml

#: Far more entries than any settings have, aliases written out.
_MOST = 100_000


def load(text: str) -> Any:
    """Plain values from YAML; no tag makes an object.

    Raises:
        yaml.YAMLError: It is no YAML, nested too deep, or refers to itself.
    """
    return _ending(yaml.safe_load, text)


def read(path: str | Path) -> Any:
    """Plain values from a file of settings.

    Raises:
        ValueError: There is no such file, or it is no YAML; the message names file and place.
    """
    try:
        return load(Path(path).read_text(encoding="utf-8"))
    except (FileNotFoundError, IsADirectoryError):
        raise ValueError(f"{path}: there is no such file, expected one of settings") from None
    except UnicodeDecodeError as error:
        told = f"byte {error.object[error.start]:#x} at {error.start} is not UTF-8"
        raise ValueError(f"{path} is no YAML: {told}; save it as UTF-8 text") from None
    except yaml.YAMLError as error:
        raise ValueError(f"{path} is no YAML: {problem(error)}") from None


def problem(error: yaml.YAMLError) -> str:
    """What is wrong with a text, and where, in one line."""
    mark = getattr(error, "problem_mark", None)
    if isinstance(error, yaml.MarkedYAMLError) and mark is not None:
        said = " ".join(filter(None, (error.context, error.problem)))
        return f"line {mark.line + 1}, column {mark.column + 1}: {said}"
    if isinstance(error, yaml.reader.ReaderError):
        return f"character {error.position + 1}: {error.reason}"
    return " ".join(str(error).split())


def _load_option(text: str) -> Any:
    """As ``load``, with jsonargparse's rules for the values of options."""
    return _ending(_PLAIN, text)


def _ending(read: Any, text: str) -> Any:
    try:
        value = read(text)
    except RecursionError:
        raise yaml.YAMLError("it is nested too deep") from None
    waiting, count = [value], 0
    while waiting:
        node = waiting.pop()
        if isinstance(node, dict | list):
            waiting += node.values() if isinstance(node, dict) else node
            count += len(node)
        if count > _MOST:
            raise yaml.YAMLError(f"it refers to itself, or has more than {_MOST} entries")
    return value


_PLAIN = jsonargparse.get_loader("yaml")
jsonargparse.set_loader("yaml", _load_option, (yaml.YAMLError,))
