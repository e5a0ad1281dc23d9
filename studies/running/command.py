"""What every study's command line shares: typed settings."""

from __future__ import annotations

import contextlib
import copy
import difflib
import json
import re
import sys
import typing
from argparse import RawDescriptionHelpFormatter
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

import jsonargparse
import yaml

from simgap_files import safe_yaml
from sims.loading import in_file, not_found
from sims.model_files import located, model_settings, names_model
from sims.trust import check_file, named_packages, trusting
from studies.running.classes import (
    CLASSES,
    FILES,
    IMPORT_PATH,
    SIMULATORS,
    class_of_word,
    no_class,
    no_simulator,
    unfinished,
    without_replaced,
)
from studies.running.counted import check_number, check_numbers, check_settings
from studies.running.ending import DEBUG, DEBUG_VARIABLE, TRUST, typed
from studies.running.spelling import spelled

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
#: Why settings of earlier versions are no more.
GONE = {"allow_constant_action": "leave it out, an input that never changes is read and told"}
# How jsonargparse begins a list of all classes that it knows.
_LISTED = ", known subclasses: "

# Files of settings that were given, by path with their option, to say where something is wrong.
_READ: dict[str, tuple[str, Any]] = {}


class HelpFormatter(jsonargparse.DefaultHelpFormatter, RawDescriptionHelpFormatter):
    """Keeps the line breaks of the description, and lists no classes that happen to be imported."""

    def _expand_help(self, action: Any) -> str:
        before, listed, _ = super()._expand_help(action).partition(_LISTED)
        return f"{before})" if listed else before


class Parser(jsonargparse.ArgumentParser):
    """An argument parser whose errors are one line on stderr, with exit code 2."""

    def __init__(self, *given: Any, **options: Any) -> None:
        says = (
            f"{DEBUG}, or {DEBUG_VARIABLE}=1, shows where errors arise. {TRUST} PACKAGE, or A,B: "
            "files of simulators, such as corrected.yaml, may name classes of these packages."
        )
        if Path(sys.argv[0]).stem == "simgap" and "prog" in options:
            # The command simgap calls itself what the user typed.
            name = options["prog"].removeprefix("python -m studies.").replace("_", "-")
            options["prog"] = f"simgap {name}"
        options.setdefault("formatter_class", HelpFormatter)
        options.setdefault("allow_abbrev", False)
        options.setdefault("epilog", says)
        super().__init__(*given, **options)
        self._given: Any = None
        self._words: list[str] = []
        self._lists: set[str] = set()

    def parse_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, *rest: Any, **options: Any
    ) -> Any:
        """As usual; a model file may stand for a simulator, and words in a row for a list."""
        _READ.clear()
        kinds = {o: getattr(a, "_typehint", None) for a in self._actions for o in a.option_strings}
        lists = {name for name, kind in kinds.items() if typing.get_origin(kind) in (list, tuple)}
        self._lists = {action.dest for action in self._actions if action.nargs == "+"}
        given = _with_lists(spelled(sys.argv[1:] if args is None else args, kinds), lists)
        self._words = given
        try:
            for i, text in enumerate(given):
                name, equals, value = text.partition("=")
                if not equals:
                    value = "".join(given[i + 1 : i + 2])
                _check_given(name, value)
                check_number(name, value, kinds.get(name))
                if name in SIMULATORS and equals:
                    given[i] = f"{name}={_simulator(value)}"
                elif name in SIMULATORS and i + 1 < len(given):
                    given[i + 1] = _simulator(given[i + 1])
            configs = {
                path: inside for path, (option, inside) in _READ.items() if option == "config"
            }
            check_numbers(configs, kinds)
            for path, (option, inside) in _READ.items():
                if option == "columns":
                    check_settings(path, inside, kinds, f"--{option}.")
            contents = list(configs.values())
            self._without_usual([*map(class_of_word, given), *contents])
            return super().parse_args(given, *rest, **options)
        except ValueError as error:
            self.error(str(error), error)

    def parse_object(self, cfg_obj: Any, *rest: Any, **options: Any) -> Any:
        """As usual; a robot's model file may stand where a simulator is expected."""
        given = cfg_obj
        if isinstance(given, Mapping):
            # A copy, since the parser changes nested lists of what it is given.
            given = _with_models(copy.deepcopy(dict(given)))
        self._given = given
        self._without_usual([given])
        return super().parse_object(given, *rest, **options)

    def parse_string(self, content: str, path: Any = "", *rest: Any, **options: Any) -> Any:
        """As usual; a robot's model file, also one beside the config, may be the simulator."""
        try:
            given = safe_yaml.load(content)
        except yaml.YAMLError as error:
            raise ValueError(f"{path} is no YAML: {safe_yaml.problem(error)}") from None
        # What a config names is the user's own choice, as what stands on the command line is.
        with trusting(named_packages(given)):
            found = located(given, str(path)) if path and names_model(given) else given
            if isinstance(found, dict):
                found = _with_models(found, Path(str(path)).parent if path else None)
                found = without_replaced(found, self._words)
                # One file, `logs: log.csv`, is a list of one, as on the command line.
                for key in self._lists & set(found):
                    if isinstance(found[key], str | int | float):
                        found[key] = [found[key]]
        content = content if found == given else yaml.safe_dump(found)
        return super().parse_string(content, path, *rest, **options)

    def _without_usual(self, contents: Iterable[Any]) -> None:
        """Forget the usual class of an option for which one was given; see ``classes``."""
        for content in contents:
            for option in CLASSES:
                name = option.removeprefix("--")
                chosen = content.get(name) if isinstance(content, Mapping) else None
                if chosen is not None and self.get_defaults().get(name) is not None:
                    self.set_defaults(**{name: None})

    def plain(self, given: Any) -> dict[str, Any]:
        """What was parsed as plain values, every default filled in: as a config file would say."""
        found: dict[str, Any] = json.loads(self.dump(given, format="json", skip_unset=False))
        return found

    def instantiate(self, namespace: Any, *rest: Any, **options: Any) -> Any:
        """As usual; whatever a class of the user's does not like of its settings is one line."""
        try:
            return super().instantiate(namespace, *rest, **options)
        except Exception as error:
            if isinstance(error, ValueError):  # which says whose it is
                self.error(str(error), error)
            self.error(f"the settings do not make what they name: {typed(error)}", error)

    def error(self, message: str, ex: Exception | None = None) -> NoReturn:
        """Say what is wrong and how to learn more, in one line."""
        unknown = self._unknown() if isinstance(ex, KeyError) else ""
        for action in self._actions if isinstance(ex, TypeError) else ():
            if action.required and action.option_strings:  # an option is known by its dashes
                message = re.sub(rf"(?<= ){action.dest}\b", action.option_strings[0], message)
        reason = unknown or re.sub(r"\s*\n\s*-?\s*", " ", str(message).strip())
        if ex is None:  # of the words that were given, not of what one of them means
            reason += self._likely(message)
        reason = unfinished(self._words, (inside for _, inside in _READ.values())) or reason
        sys.stderr.write(f"error: {reason} (see --help)\n")
        raise SystemExit(2)

    def _likely(self, message: str) -> str:
        """The option that is likely meant by a word that is none and that an error tells."""
        known = [option for action in self._actions for option in action.option_strings]
        for word in self._words:
            name = word.partition("=")[0]
            if name.startswith("--") and name not in known and name in message:
                if why := GONE.get(name.rpartition(".")[2]):
                    return f"; {why}"
                near = difflib.get_close_matches(name, known, 1)
                return f"; did you mean {near[0]}?" if near else ""
        return ""

    def _unknown(self) -> str:
        """The first setting given that there is not, with its place; empty if there is none."""
        given = self._given
        if isinstance(given, jsonargparse.Namespace):  # of a part of the settings
            found = _not_among(given.as_dict(), self._settings_below(""))
            return found and _place(given.as_dict()) + found
        for path, (option, content) in _READ.items():
            for keys, inside in _mappings(content, () if option == "config" else (option,)):
                settings = self._settings_below("".join(f"{k}." for k in keys))
                if found := _not_among(inside, settings):
                    below = keys if option == "config" else keys[1:]
                    return f"{': '.join([path, *below])}: {found}"
        return ""

    def _settings_below(self, group: str) -> list[str]:
        names = [action.dest for action in self._actions if action.dest.startswith(group)]
        tops = dict.fromkeys(n.removeprefix(group).partition(".")[0] for n in names)
        return [name for name in tops if name != "help"]


def _not_among(given: Any, known: Sequence[str]) -> str:
    """What is to be said of the first setting that is not known, if there is one."""
    for name in given if isinstance(given, Mapping) and known else ():
        if name not in known:
            if why := GONE.get(name):
                return f"no setting {name!r}: {why}"
            near = difflib.get_close_matches(str(name), known, 1)
            hint = f"did you mean {near[0]!r}?" if near else f"there is {', '.join(known)}"
            return f"no setting {name!r}, {hint}"
    return ""


def _place(settings: Mapping[str, Any]) -> str:
    """Where settings stand in the files that were given, as a beginning of a sentence."""
    for path, (_, content) in _READ.items():
        for keys, inside in _mappings(content):
            if inside == settings:
                return f"{': '.join([path, *keys])}: "
    return ""


def _mappings(content: Any, keys: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    if isinstance(content, Mapping):
        yield keys, content
        for key, value in content.items():
            yield from _mappings(value, (*keys, str(key)))


def _with_lists(arguments: Sequence[str], lists: Container[str]) -> list[str]:
    """The arguments, what follows an option that takes a list, ``--a.b 1 2``, as one list."""
    found: list[str] = []
    after = ""
    for text in arguments:
        if text.startswith("-") and not _NUMBER.fullmatch(text):
            after = text if text in lists else ""
        elif after and not text.startswith("["):
            begun = [] if found[-1] == after else [found.pop().strip("[]")]
            text = f"[{', '.join([*begun, text])}]"
        found.append(text)
    return found


def _with_models(given: Mapping[str, Any], folder: Path | None = None) -> dict[str, Any]:
    """Settings with a simulator where a robot's model file, maybe in a folder, stood for one."""
    found = dict(given)
    for option in SIMULATORS:
        key = option.removeprefix("--")
        value = found.get(key)
        if isinstance(value, str):
            beside = folder / value if folder else Path(value)
            found[key] = _settings(beside if beside.is_file() else value) or value
    return found


def _simulator(value: str) -> str:
    settings = _settings(value)
    return json.dumps(settings) if settings else value


def _check_given(name: str, value: str) -> None:
    """Refuse files of settings, and classes, that are not there, before the parser tries them.

    Raises:
        ValueError: The message names the option, and the file or the class.
    """
    if not name.startswith("--") or name == "--output":
        return
    if value.endswith((".yaml", ".yml")):
        try:
            _READ[value] = (name.removeprefix("--"), safe_yaml.read(value))
        except ValueError as error:
            raise ValueError(f"{name} {error}") from None
    elif name in FILES and Path(value).is_dir():
        raise ValueError(f"{name} {value} is a folder, expected a YAML file of settings")
    elif name in CLASSES:
        path = Path(value).is_dir() or (IMPORT_PATH.fullmatch(value) and not Path(value).exists())
        if lacking := in_file(value) or (not_found(value) if path else ""):
            raise ValueError(f"{name}: {lacking}")
        if name in SIMULATORS and (other := no_simulator(value) if path else no_class(value)):
            raise ValueError(f"{name}: {other}")


def _settings(source: str | Path) -> dict[str, Any] | None:
    """What a robot's model file means, or a file that names one.

    None for all else; a file of settings is looked at first.
    """
    if settings := model_settings(source):
        return settings
    with contextlib.suppress(OSError):  # a name too long is no file
        if Path(source).is_file() and names_model(inside := check_file(source)):
            return dict(inside)
    return None
