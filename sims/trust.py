"""Whose classes a settings file may name. To name a class is to run its code.

Files of settings such as ``corrected.yaml`` are handed around, so only classes of ours and of the
packages that the reader allows are taken from them. What is named is judged as text, before
anything is imported.
"""

from __future__ import annotations

import contextlib
import contextvars
import re
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

from simgap_files import safe_yaml
from sims.model_files import located

OURS = ("sims", "policy", "residual", "studies", "simgap")
_IMPORT = re.compile(r"\w+(\.\w+)+")
_SETTINGS = (".yaml", ".yml", ".json", ".toml")
_allowed: contextvars.ContextVar[frozenset[str]] = contextvars.ContextVar(
    "allowed", default=frozenset()
)


@contextlib.contextmanager
def trusting(packages: Collection[str]) -> Iterator[None]:
    """Within it, files may name classes of these packages too."""
    token = _allowed.set(_allowed.get() | frozenset(packages))
    try:
        yield
    finally:
        _allowed.reset(token)


def check_file(path: str | Path) -> Any:
    """Refuse a file of settings that names classes of anybody else.

    Args:
        path: YAML or JSON.

    Returns:
        The settings, with the paths of robot models in full.

    Raises:
        ValueError: It does, is no YAML, or names a model that is not there; the message says what
            to do.
    """
    settings = located(safe_yaml.read(path), path)
    strange = foreign(settings)
    if strange:
        raise ValueError(
            f"{path} names {strange!r:.80}, and whoever loads it runs that code: if you trust it, "
            f"say so with --trust {strange.partition('.')[0]:.40} or, in Python, trusted=[...]"
        )
    return settings


def foreign(settings: Any) -> str:
    """The first import path in plain values that is not allowed; empty if all are.

    Text that looks like one counts wherever it stands, since what it means depends on where it
    goes; a file name with a folder, ``./robot.xml``, does not look like one.
    """
    if isinstance(settings, Mapping):
        parts = list(settings.values())
    elif isinstance(settings, list | tuple):
        parts = list(settings)
    elif isinstance(settings, str):
        return _foreign_text(settings.strip())
    else:
        return ""
    return next((found for part in parts if (found := foreign(part))), "")


def needs_trust(settings: Any) -> str:
    """The first import path that a file with these settings is refused for where nobody is trusted
    beside this project; empty if there is none."""
    token = _allowed.set(frozenset())
    try:
        return foreign(settings)
    finally:
        _allowed.reset(token)


def named_packages(settings: Any) -> set[str]:
    """Packages of the import paths in plain values that the user wrote: those are trusted."""
    if isinstance(settings, str):
        return {settings.partition(".")[0]} if _IMPORT.fullmatch(settings) else set()
    if isinstance(settings, Mapping):
        settings = list(settings.values())
    if not isinstance(settings, list | tuple):
        return set()
    return set().union(*map(named_packages, settings))


def _foreign_text(text: str) -> str:
    # Settings may stand in text too: jsonargparse reads them as YAML.
    with contextlib.suppress(yaml.YAMLError):
        inside = safe_yaml.load(text)
        if isinstance(inside, Mapping | list):
            return foreign(inside)
    if text.lower().endswith(_SETTINGS):
        return text
    if not _IMPORT.fullmatch(text) or text.replace(".", "").isdigit():
        return ""
    allowed = {*OURS, *_allowed.get()}
    return "" if any(text == name or text.startswith(f"{name}.") for name in allowed) else text
