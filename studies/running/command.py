"""What every study's command line shares: typed settings, one way to end."""

from __future__ import annotations

import atexit
import contextlib
import functools
import json
import os
import re
import signal
import sys
import sysconfig
import tempfile
import traceback
import typing
from argparse import RawDescriptionHelpFormatter
from collections.abc import Callable, Container, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

import jsonargparse
import yaml

import simgap_yaml
from sims.loading import in_file, not_found
from sims.model_files import located, model_settings, names_model
from sims.trust import check_file, named_packages, trusting
from sims.unsound import Unsound

_DEBUG, _DEBUG_VARIABLE, _TRUST = "--debug", "SIMGAP_DEBUG", "--trust"
_SIMULATORS = ("--simulator", "--corrected")
_CLASSES = (*_SIMULATORS, "--estimator")
# What a check of a disk writes before the work: less would fit on a disk that is full.
_PROBE = bytes(2**16)
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_IMPORT_PATH = re.compile(r"\w+(\.\w+)+")
_HOME = Path(__file__).parents[2]
_LIBRARIES = [Path(sysconfig.get_paths()[name]) for name in ("stdlib", "purelib", "platlib")]


class HelpFormatter(jsonargparse.DefaultHelpFormatter, RawDescriptionHelpFormatter):
    """Keeps the line breaks of the description."""


class Parser(jsonargparse.ArgumentParser):
    """An argument parser whose errors are one line on stderr, with exit code 2."""

    def __init__(self, *given: Any, **options: Any) -> None:
        says = (
            f"{_DEBUG}, or {_DEBUG_VARIABLE}=1, shows where errors arise. {_TRUST} PACKAGE: files "
            "of simulators, such as corrected.yaml, may name classes of that package."
        )
        if Path(sys.argv[0]).stem == "simgap" and "prog" in options:
            # The command simgap calls itself what the user typed.
            name = options["prog"].removeprefix("python -m studies.").replace("_", "-")
            options["prog"] = f"simgap {name}"
        options.setdefault("formatter_class", HelpFormatter)
        options.setdefault("epilog", says)
        super().__init__(*given, **options)

    def parse_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, *rest: Any, **options: Any
    ) -> Any:
        """As usual; a model file may stand for a simulator, and words in a row for a list."""
        kinds = {o: getattr(a, "_typehint", None) for a in self._actions for o in a.option_strings}
        lists = {name for name, kind in kinds.items() if typing.get_origin(kind) in (list, tuple)}
        given = _with_lists(list(sys.argv[1:] if args is None else args), lists)
        try:
            for i, text in enumerate(given):
                name, equals, value = text.partition("=")
                _check_given(name, value if equals else "".join(given[i + 1 : i + 2]))
                if name in _SIMULATORS and equals:
                    given[i] = f"{name}={_simulator(value)}"
                elif name in _SIMULATORS and i + 1 < len(given):
                    given[i + 1] = _simulator(given[i + 1])
            return super().parse_args(given, *rest, **options)
        except ValueError as error:
            self.error(str(error), error)

    def parse_object(self, cfg_obj: Any, *rest: Any, **options: Any) -> Any:
        """As usual; a robot's model file may stand where a simulator is expected."""
        for key in ("simulator", "corrected"):
            value = cfg_obj.get(key) if isinstance(cfg_obj, Mapping) else None
            if isinstance(value, str):
                cfg_obj = {**cfg_obj, key: _settings(value) or value}
        return super().parse_object(cfg_obj, *rest, **options)

    def parse_string(self, content: str, path: Any = "", *rest: Any, **options: Any) -> Any:
        """As usual; a robot's model file, also one beside the config, may be the simulator."""
        try:
            given = simgap_yaml.load(content)
        except yaml.YAMLError as error:
            raise ValueError(f"{path} is no YAML: {simgap_yaml.problem(error)}") from None
        # What a config names is the user's own choice, as what stands on the command line is.
        with trusting(named_packages(given)):
            if path and names_model(given):
                given = located(given, str(path))
                content = yaml.safe_dump(given)
            for key in ("simulator", "corrected") if isinstance(given, dict) else ():
                value = given.get(key)
                if isinstance(value, str):
                    beside = Path(str(path)).parent / value
                    if settings := _settings(beside if path and beside.is_file() else value):
                        given = {**given, key: settings}
                        content = yaml.safe_dump(given)
        return super().parse_string(content, path, *rest, **options)

    def instantiate(self, namespace: Any, *rest: Any, **options: Any) -> Any:
        """As usual; whatever a class of the user's does not like of its settings is one line."""
        try:
            return super().instantiate(namespace, *rest, **options)
        except Exception as error:
            said = str(error) if isinstance(error, ValueError) else _typed(error)
            self.error(f"the settings do not make what they name: {said}", error)

    def error(self, message: str, ex: Exception | None = None) -> NoReturn:
        """Say what is wrong and how to learn more, in one line."""
        reason = re.sub(r"\s*\n\s*-?\s*", " ", str(message).strip())
        sys.stderr.write(f"error: {reason} (see --help)\n")
        raise SystemExit(2)


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
    lacking = ""
    if value.endswith((".yaml", ".yml")):
        try:
            simgap_yaml.read(value)
        except ValueError as error:
            raise ValueError(f"{name} {error}") from None
    elif name in _CLASSES:
        path = _IMPORT_PATH.fullmatch(value) and not Path(value).exists()
        lacking = in_file(value) or (not_found(value) if path else "")
    if lacking:
        raise ValueError(f"{name}: {lacking}")


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


def _trusted(arguments: list[str]) -> tuple[list[str], set[str]]:
    """The arguments without ``--trust``, and the packages that the user trusts by naming them."""
    given: list[str] = []
    trusted: set[str] = set()
    waiting = iter(arguments)
    for text in waiting:
        name, equals, value = text.partition("=")
        if name == _TRUST:
            trusted.update((value if equals else next(waiting, "")).split(","))
        else:
            given.append(text)
    values = [text.partition("=")[2] if text.startswith("--") else text for text in given]
    return given, trusted - {""} | named_packages(values)


def fail(message: str) -> NoReturn:
    """End the command with one line on stderr and exit code 2: the user can mend it."""
    sys.stderr.write(f"error: {' '.join(message.split())}\n")
    raise SystemExit(2)


def guarded(
    resumes: bool = True,
) -> Callable[[Callable[[Sequence[str] | None], None]], Callable[..., None]]:
    """Let a command end in one way, whatever happens.

    Bad input and disks that fail end it with one line and exit code 2, Ctrl-C with 130, a fault
    of ours with one line, a file that keeps the traceback, and exit code 1. ``--debug`` or
    ``SIMGAP_DEBUG=1`` shows tracebacks. Files of simulators may name classes of ours, of packages
    after ``--trust``, and of those whose classes stand beside it on the command line.

    Args:
        resumes: Whether the same command continues what was stopped.
    """

    def decorate(main: Callable[[Sequence[str] | None], None]) -> Callable[..., None]:
        @functools.wraps(main)
        def run(arguments: Sequence[str] | None = None) -> None:
            given = list(sys.argv[1:] if arguments is None else arguments)
            debug = _DEBUG in given or os.environ.get(_DEBUG_VARIABLE, "") not in ("", "0")
            try:
                rest, trusted = _trusted([argument for argument in given if argument != _DEBUG])
                with trusting(trusted):
                    main(rest)
            except KeyboardInterrupt:
                if debug:
                    traceback.print_exc()
                # Whoever presses twice shall not interrupt the end.
                atexit.register(signal.signal, signal.SIGINT, signal.SIG_IGN)
                then = "goes on" if resumes else "begins anew"
                sys.stderr.write(f"\nstopped; the same command {then}\n")
                raise SystemExit(130) from None
            except SystemExit as ended:
                if debug and isinstance(ended.__context__, Exception):
                    traceback.print_exception(ended.__context__)
                raise
            except (OSError, Unsound) as error:
                if debug:
                    traceback.print_exc()
                fail(str(error))
            except Exception as error:
                if debug:
                    traceback.print_exc()
                if place := users_code(error):
                    fail(f"{place} raised {_typed(error)} (mend it, or see {_DEBUG})")
                sys.stderr.write(_internal(error))
                raise SystemExit(1) from error

        return run

    return decorate


def users_code(error: BaseException) -> str:
    """File, line and function of the user's that an error comes from; empty if it is ours.

    Libraries in between, which only pass on what they were given, do not count. Where
    ours made the error of another one, that one tells.
    """
    if isinstance(error, SyntaxError) and error.filename:
        return f"{error.filename}, line {error.lineno},"
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        path = Path(frame.filename)
        if not path.is_file() or any(path.is_relative_to(place) for place in _LIBRARIES):
            continue
        ours = path.parent == _HOME or (path.is_relative_to(_HOME) and (
            path.relative_to(_HOME).parts[0] in ("sims", "policy", "residual", "studies")
        ))  # fmt: skip
        if not ours:
            return f"{path}, line {frame.lineno}, in {frame.name}"
        break
    return users_code(error.__cause__) if error.__cause__ else ""


def _typed(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}"


def _internal(error: Exception) -> str:
    """Keep the traceback of a fault in a file, and say where."""
    told = " ".join(_typed(error).split())[:200]
    text = traceback.format_exc()
    try:
        handle, path = tempfile.mkstemp(prefix="simgap-error-", suffix=".txt")
        with open(handle, "w", encoding="utf-8") as file:
            file.write(text)
    except OSError:
        return f"{text}error: internal fault: {told}\n"
    return f"error: internal fault: {told} (please report it with {path}, or see {_DEBUG})\n"


def check_output(output: str | Path) -> None:
    """End the command now if results cannot be written into a folder later; nothing is left.

    Args:
        output: A folder, there already or not.
    """
    folder = Path(output)
    try:
        there = next(path for path in (folder, *folder.absolute().parents) if path.exists())
        if not there.is_dir():
            fail(f"--output {folder}: {there} is a file, expected a folder")
        with tempfile.TemporaryFile(prefix=".partial-", dir=there) as file:
            file.write(_PROBE)
            file.flush()
            os.fsync(file.fileno())
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        fail(f"--output {folder} cannot be written: {reason}")
