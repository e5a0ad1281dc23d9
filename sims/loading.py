"""Simulators by name: from import paths and YAML files, and back."""

from __future__ import annotations

import copy
import difflib
import importlib.util
import inspect
import pydoc
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import jsonargparse
import yaml

from simgap_files import safe_yaml
from sims.effects.base import Effect
from sims.host import HostSimulator
from sims.model_files import MODEL_FILES, model_settings, names_model
from sims.simulator import Hold, Simulator
from sims.trust import check_file, trusting


def load_simulator(
    source: str | Path | Mapping[str, Any], trusted: Sequence[str] = ()
) -> Simulator:
    """A simulator by its import path, its YAML file, or its ``class_path`` and ``init_args``.

    Args:
        source: ``"sims.pendulum.Pendulum"``, a file such as ``"corrected.yaml"``, what such a
            file holds, or a robot's ``.xml`` (MJCF) or ``.urdf``.
        trusted: Packages whose classes a file may name beside ours: loading runs their code.

    Raises:
        ValueError: There is no such class or file, it is no simulator, the settings are wrong, or
            a file names classes of a package that is not trusted.
    """
    with trusting(trusted):
        return _parser().instantiate(_parsed(source)).simulator


def simulator_settings(
    source: str | Path | Mapping[str, Any], trusted: Sequence[str] = ()
) -> dict[str, Any]:
    """``class_path`` and ``init_args`` of what ``load_simulator`` makes, defaults filled in."""
    with trusting(trusted):
        text = _parser().dump(_parsed(source), format="yaml", skip_unset=False)
    return yaml.safe_load(text)["simulator"]


def with_effects(
    simulator: HostSimulator,
    effects: list[Effect] | None = None,
    hold: dict[str, Hold] | None = None,
    substeps: int | None = None,
) -> HostSimulator:
    """A copy with these effects beside its own; for YAML, whatever arguments its class takes.

    Args:
        simulator: What is changed.
        effects: What acts beside its own effects.
        hold: How inputs run between samples, by channel; see ``HostSimulator.with_hold``.
        substeps: Sub-steps per control period, if not the simulator's own.
    """
    changed = simulator.with_effects([*simulator.effects, *(effects or ())]).with_hold(hold or {})
    changed.substeps = substeps or changed.substeps
    return changed


def corrected_settings(
    settings: Mapping[str, Any],
    effects: Sequence[Effect],
    hold: Mapping[str, Hold] | None = None,
    substeps: int | None = None,
) -> dict[str, Any]:
    """Settings of a simulator with effects beside its own, for ``load_simulator``.

    Args:
        settings: Of the simulator without them, see ``simulator_settings``.
        effects: With scalar values; they come back bit for bit.
        hold, substeps: As for ``with_effects``.
    """
    added = [effect_settings(effect) for effect in effects]
    arguments = dict(settings.get("init_args") or {})
    changed: dict[str, Any] = {}
    if hold:
        changed["hold"] = dict(hold)
    if substeps:
        changed["substeps"] = substeps
    own = f"{__name__}.{with_effects.__name__}"
    # A function that makes the simulator, such as with_effects, may have effects of its own.
    if isinstance(arguments.get("effects"), list) and (
        settings["class_path"] == own or not changed
    ):
        arguments["effects"] = [*arguments["effects"], *added]
        if hold:
            changed["hold"] = {**(arguments.get("hold") or {}), **hold}
        return {"class_path": settings["class_path"], "init_args": {**arguments, **changed}}
    if not added and not changed:
        return dict(settings)
    changed = {"effects": added, **changed}
    return {"class_path": own, "init_args": {"simulator": dict(settings), **changed}}


def effect_settings(effect: Effect) -> dict[str, Any]:
    """``class_path`` and ``init_args`` of an effect."""
    kind = type(effect)
    # The shortest path that is public: sims.effects.Delay rather than the module behind it.
    module = "sims.effects" if kind.__module__.startswith("sims.effects.") else kind.__module__
    values = {name: getattr(effect, name) for name in inspect.signature(kind).parameters}
    numbers = {name: float(value) for name, value in values.items() if name in kind.numbers()}
    return {"class_path": f"{module}.{kind.__qualname__}", "init_args": values | numbers}


def _parser() -> jsonargparse.ArgumentParser:
    parser = jsonargparse.ArgumentParser(exit_on_error=False)
    parser.add_argument("--simulator", type=Simulator, sub_configs=True, required=True)
    return parser


def _parsed(source: str | Path | Mapping[str, Any]) -> jsonargparse.Namespace:
    # A copy, since the parser changes nested lists of what it is given.
    value: Any = copy.deepcopy(dict(source)) if isinstance(source, Mapping) else str(source)
    if isinstance(value, str):
        value = model_settings(value) or value
    if isinstance(value, str) and Path(value).is_file():
        inside = check_file(value)
        value = inside if names_model(inside) else value
    try:
        return _parser().parse_object({"simulator": value})
    except (jsonargparse.ArgumentError, TypeError) as error:
        lacking = not_found(value)
        raise ValueError(f"simulator {source}: {lacking or one_line(error)}") from None


def in_file(source: str) -> str:
    """How to write what names a class by its file, ``arm.py:Arm``, or calls it; or nothing."""
    if called := re.fullmatch(r"([\w.]+)\(.*\)", source):
        return (
            f"{source!r} is a call, expected the class alone: {called[1]}; its settings are "
            "options of their own, as in --simulator.NAME VALUE"
        )
    found = re.fullmatch(r"(.*[/\\])?(\w+)(?:\.py(?::(\w+))?|:(\w+))", source)
    if not found:
        return ""
    folder, module, *kinds = found.groups()
    start = f" and start Python in {folder}" if folder else ""
    kind = next((kind for kind in kinds if kind), "CLASS")
    return f"{source!r} is no import path; write {module}.{kind}{start}"


def not_found(source: str | Mapping[str, Any]) -> str:
    """Which class of an import path, or of a YAML file of them, Python cannot find; or nothing.

    What a file names has to be trusted already: to look for a class is to import its module.
    """
    settings: Any = source
    if isinstance(source, str) and Path(source).is_dir():
        return (
            f"{source} is a folder; expected MODULE.CLASS, as import would find it, or a file that "
            "names one"
        )
    kind = Path(source).suffix.lower() if isinstance(source, str) else ""
    if kind in (".yaml", ".yml", *MODEL_FILES) and not Path(str(source)).is_file():
        return f"there is no file {source}"
    if isinstance(source, str) and kind in (".yaml", ".yml"):
        try:
            settings = safe_yaml.read(source)
        except ValueError as error:
            return str(error)
    for path in _class_paths(settings):
        module, _, inside = path.partition(".")
        if module and importlib.util.find_spec(module) is None:
            return (
                f"there is no module {module!r} for {path}; start Python in the folder that "
                "holds it, or name that folder in PYTHONPATH"
            )
        try:
            if inside and pydoc.locate(path) is None:
                hint = _near(path) or "expected MODULE.CLASS, as import would find it"
                return f"there is no class {path}; {hint}"
        except pydoc.ErrorDuringImport as error:
            # Parsers take these for a value of another kind; all else is told by whoever loads it.
            if isinstance(error.value, ValueError | TypeError | ImportError):
                return f"{error.filename} cannot be imported: {error.value}"
    return ""


def _near(path: str) -> str:
    """What may have been meant by a name that a module does not have; or nothing."""
    module, _, name = path.rpartition(".")
    held = getattr(pydoc.locate(module), "__dict__", {})
    names = sorted({*held, *held.get("__all__", ())})  # what is imported when it is asked for, too
    there = [other for other in names if not inspect.ismodule(held.get(other))]
    near = difflib.get_close_matches(name, there, 1)
    return f"did you mean {module}.{near[0]}?" if near else ""


def _class_paths(settings: Any) -> list[str]:
    """Every import path of a class in settings, from the outside in."""
    if isinstance(settings, str):
        return [settings]
    if isinstance(settings, list):
        return [
            path for entry in settings if not isinstance(entry, str) for path in _class_paths(entry)
        ]
    if not isinstance(settings, Mapping):
        return []
    found = [str(settings["class_path"])] if "class_path" in settings else []
    nested = [v for v in settings.values() if isinstance(v, Mapping | list)]
    return found + [path for entry in nested for path in _class_paths(entry)]


def one_line(error: Exception) -> str:
    """What an error says, in one line."""
    return " ".join(str(error).split())
