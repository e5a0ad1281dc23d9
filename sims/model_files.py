"""Robot models as files: what their names mean, and where settings that name one look for it.

In memory and on the command line such a path is absolute. In a file of settings it may be relative
to that file, so that both can be moved and sent together.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

#: Files that are a simulator by themselves, and the class that reads them.
MODEL_FILES = {".xml": "sims.mujoco.MujocoSimulator", ".urdf": "sims.mujoco.MujocoSimulator"}
_CLASSES = {*MODEL_FILES.values(), "sims.mujoco.simulator.MujocoSimulator"}

#: A model this many folders above its settings, or fewer, belongs to them: they move together.
NEAR = 2


def model_settings(path: str | Path) -> dict[str, Any] | None:
    """``class_path`` and ``init_args`` for a robot's model file; None for any other.

    The path is made absolute, so that what is saved loads from any folder.
    """
    kind = MODEL_FILES.get(Path(path).suffix.lower())
    if kind is None:
        return None
    return {"class_path": kind, "init_args": {"model": str(Path(path).expanduser().resolve())}}


def names_model(settings: Any) -> bool:
    """Whether settings name a robot's model file somewhere."""
    seen: list[str] = []

    def see(model: str) -> str:
        seen.append(model)
        return model

    _mapped(settings, see)
    return bool(seen)


def located(settings: Any, file: str | Path) -> Any:
    """Settings with the paths of models in full.

    A path that is not absolute is looked for beside the file, then in the current folder. What is
    not there may lie beside the file under its name: it was sent along.

    Args:
        settings: What the file holds.
        file: The file, for its folder and for errors.

    Raises:
        ValueError: There is no such model; the message says where it was looked for.
    """
    return _mapped(settings, lambda model: _found(model, Path(file)))


def relative(settings: Any, folder: str | Path) -> Any:
    """Settings for a file in a folder: the paths of models near it are relative to it.

    Near is in the folder, below it, or no more than ``NEAR`` folders up. All other paths stay
    absolute.
    """
    return _mapped(settings, lambda model: _near(model, Path(folder).resolve()))


def _found(model: str, file: Path) -> str:
    path, folder = Path(model).expanduser(), file.resolve().parent
    for place in dict.fromkeys((folder / path, path.absolute(), folder / path.name)):
        if place.is_file():
            return str(place.resolve())
    raise ValueError(
        f"{file}: there is no model file {model}; put {path.name} beside {file.name}, or mend "
        "the path (relative ones begin in the folder of that file)"
    )


def _near(model: str, folder: Path) -> str:
    path = Path(model)
    try:
        short = Path(os.path.relpath(path, folder)) if path.is_absolute() else path
    except ValueError:  # another drive
        return model
    if short.parts.count(os.pardir) > NEAR:
        return model
    # A bare name would look like the import path of a class.
    return short.as_posix() if len(short.parts) > 1 else f"./{short.as_posix()}"


def _mapped(settings: Any, change: Callable[[str], str]) -> Any:
    """Settings with every path of a model changed; everything else is as it was."""
    if isinstance(settings, list):
        return [_mapped(entry, change) for entry in settings]
    if not isinstance(settings, Mapping):
        return settings
    whole = {key: _mapped(value, change) for key, value in settings.items()}
    kind, arguments = whole.get("class_path"), whole.get("init_args")
    if isinstance(kind, str) and kind in _CLASSES and isinstance(arguments, dict):
        model = arguments.get("model")
        if isinstance(model, str):
            whole["init_args"] = {**arguments, "model": change(model)}
    return whole
