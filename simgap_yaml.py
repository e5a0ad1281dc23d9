"""YAML settings that end: text that refers to itself or unfolds without bound is refused.

Importing this module makes jsonargparse, and so every command, read YAML this way.
"""

from __future__ import annotations

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
