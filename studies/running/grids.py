"""Grids of trials: the product of the values that settings take."""

from __future__ import annotations

import copy
import importlib
import inspect
import itertools
import json
from collections.abc import Mapping, Sequence
from typing import Any


def expand_grid(
    config: Mapping[str, Any], grid: Sequence[Mapping[str, Sequence[Any]]]
) -> list[dict[str, Any]]:
    """The configurations of a grid: the product within each block, one block after another.

    Args:
        config: Settings that all trials share, nested as in the YAML file.
        grid: Blocks; each maps a setting (dots reach into groups) to the values it takes.

    Returns:
        One configuration per trial; duplicates are kept once.

    Raises:
        ValueError: A setting does not exist, or its values are no list, or an empty one; the
            message names it.
    """
    trials: list[dict[str, Any]] = []
    for number, block in enumerate(grid, start=1):
        for key, values in block.items():
            if not isinstance(values, list) or not values:
                raise ValueError(
                    f"grid block {number}: {key!r} needs a list of values, got {values!r}"
                )
        for values in itertools.product(*block.values()):
            trial = copy.deepcopy(dict(config))
            for key, value in zip(block, values, strict=True):
                _assign(trial, key, value, number)
            if trial not in trials:
                trials.append(trial)
    return trials


def _assign(config: dict[str, Any], key: str, value: Any, block: int) -> None:
    *groups, last = key.split(".")
    for group in groups:
        config = config.get(group, {})
    if not isinstance(config, dict) or last not in config:
        raise ValueError(f"grid block {block}: there is no setting {key!r}; see --help")
    config[last] = copy.deepcopy(value)


def class_label(chosen: Mapping[str, Any]) -> str:
    """A class and those of its settings that are not the default, such as ``Linear(alpha=1)``.

    Args:
        chosen: ``class_path`` and ``init_args``, as in a config file.
    """
    module, _, name = chosen["class_path"].rpartition(".")
    signature = inspect.signature(getattr(importlib.import_module(module), name))
    changed = [
        f"{key}={class_label(value) if _names_class(value) else value}"
        for key, value in (chosen.get("init_args") or {}).items()
        if key in signature.parameters
        and json.dumps(value) != json.dumps(signature.parameters[key].default, default=str)
    ]
    return f"{name}({', '.join(changed)})" if changed else name


def _names_class(value: Any) -> bool:
    return isinstance(value, Mapping) and "class_path" in value
