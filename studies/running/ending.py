"""How every command ends: done, stopped, or with one line that says what was wrong."""

from __future__ import annotations

import _thread
import atexit
import contextlib
import functools
import importlib
import os
import signal
import sys
import sysconfig
import tempfile
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from sims.trust import named_packages, trusting
from sims.unsound import Unsound

DEBUG, DEBUG_VARIABLE, TRUST = "--debug", "SIMGAP_DEBUG", "--trust"
# What a check of a disk writes before the work: less would fit on a disk that is full.
_PROBE = bytes(2**16)
# As of a process that SIGPIPE ended.
_UNREAD = 141
_HOME = Path(__file__).parents[2]
_LIBRARIES = [Path(sysconfig.get_paths()[name]) for name in ("stdlib", "purelib", "platlib")]


def _trusted(arguments: list[str]) -> tuple[list[str], set[str]]:
    """The arguments without ``--trust``, and the packages that the user trusts by naming them."""
    given: list[str] = []
    trusted: set[str] = set()
    waiting = iter(arguments)
    for text in waiting:
        name, equals, value = text.partition("=")
        if name == TRUST:
            trusted.update((value if equals else next(waiting, "")).strip("[]").split(","))
        else:
            given.append(text)
    values = [text.partition("=")[2] if text.startswith("--") else text for text in given]
    return given, trusted - {""} | named_packages(values)


def fail(message: str) -> NoReturn:
    """End the command with one line on stderr and exit code 2: the user can mend it."""
    sys.stderr.write(f"error: {' '.join(message.split())}\n")
    raise SystemExit(2)


@contextlib.contextmanager
def passing_on_interrupts() -> Iterator[None]:
    """Within, a Ctrl-C that lands in a library's callback is passed on, not printed and lost.

    No exception can come out of the callbacks in which Pymunk frees its bodies and LLVM hands over
    what it compiled. What fails because a callback was cut short is an interrupt as well.
    """
    usual = sys.unraisablehook
    passed: list[threading.Timer] = []

    def pass_on(told: Any) -> None:
        if told.exc_type is KeyboardInterrupt:
            passed.append(threading.Timer(0.05, _thread.interrupt_main))
            passed[-1].start()
        else:
            usual(told)

    sys.unraisablehook = pass_on
    try:
        yield
    except Exception as error:
        if not passed:
            raise
        for timer in passed:
            timer.cancel()
        raise KeyboardInterrupt from error
    finally:
        sys.unraisablehook = usual


def guarded(
    resumes: bool = True,
) -> Callable[[Callable[[Sequence[str] | None], None]], Callable[..., None]]:
    """Let a command end in one way, whatever happens.

    Bad input, which any code may refuse with a ``ValueError``, and disks that fail end it with one
    line and exit code 2, Ctrl-C with 130, a reader that has read enough, such as ``head``, with
    141, a fault of ours with one line, a file that keeps the traceback, and exit code 1.
    ``--debug`` or ``SIMGAP_DEBUG=1`` shows tracebacks. Files of simulators may name classes of
    ours, of packages after ``--trust``, and of those whose classes stand beside it on the command
    line.

    Args:
        resumes: Whether the same command continues what was stopped.
    """

    def decorate(main: Callable[[Sequence[str] | None], None]) -> Callable[..., None]:
        @functools.wraps(main)
        def run(arguments: Sequence[str] | None = None) -> None:
            given = list(sys.argv[1:] if arguments is None else arguments)
            debug = DEBUG in given or os.environ.get(DEBUG_VARIABLE, "") not in ("", "0")
            try:
                rest, trusted = _trusted([argument for argument in given if argument != DEBUG])
                with trusting(trusted), passing_on_interrupts():
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
            except Exception as error:
                if isinstance(error, BrokenPipeError) and _nobody_reads():
                    raise SystemExit(_UNREAD) from None
                if debug:
                    traceback.print_exc()
                # One that names a file tells enough.
                named = isinstance(error, OSError) and error.filename
                place = "" if named else users_code(error)
                then = "; the same command goes on with what was finished" if resumes else ""
                if isinstance(error, OSError | ValueError) and on_purpose(error):
                    fail(f"{error} ({place}{then})" if place else str(error))
                if place:
                    fail(f"{place} raised {typed(error)} (mend it, or see {DEBUG}{then})")
                sys.stderr.write(_internal(error))
                raise SystemExit(1) from error

        return run

    return decorate


def _nobody_reads() -> bool:
    """Whether what is printed goes to a program that has ended, such as ``head``; then no more is
    printed, at the end of Python neither."""
    try:
        print(flush=True)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return True
    return False


def on_purpose(error: Exception) -> bool:
    """Whether an error tells the user something: a library's, or one that our code raised so.

    What happens inside a line of ours, as where a sequence has another length than that line
    takes for granted, is a fault of ours, and so is linear algebra that fails.
    """
    if isinstance(error, np.linalg.LinAlgError):
        return False
    frames = traceback.extract_tb(error.__traceback__)
    # An operating system names the file, and tells enough.
    told = isinstance(error, OSError | Unsound)
    if told or not frames or not Path(frames[-1].filename).is_file():
        return True
    last = frames[-1]
    return not _ours(Path(last.filename)) or (last.line or "").lstrip().startswith("raise")


def run_as_imported(module: str) -> None:
    """Run the command of a module by its name, so that worker processes find the same classes."""
    importlib.import_module(module).main()


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
        if frame.name == "__getattr__":  # of ours, for a name that the user wrote
            continue
        if not _ours(path):
            return f"{path}, line {frame.lineno}, in {frame.name}"
        break
    return users_code(error.__cause__) if error.__cause__ else ""


def _ours(path: Path) -> bool:
    """Whether a file is this project's, beside whatever else may be installed."""
    if not path.is_relative_to(_HOME):
        return False
    first = path.relative_to(_HOME).parts[0]
    return path.parent == _HOME or first in ("sims", "policy", "residual", "studies")


def typed(error: BaseException) -> str:
    """Kind and words of an error."""
    return f"{type(error).__name__}: {error}"


def _internal(error: Exception) -> str:
    """Keep the traceback of a fault in a file, and say where."""
    told = " ".join(typed(error).split())[:200]
    text = traceback.format_exc()
    try:
        handle, path = tempfile.mkstemp(prefix="simgap-error-", suffix=".txt")
        with open(handle, "w", encoding="utf-8") as file:
            file.write(text)
    except OSError:
        return f"{text}error: internal fault: {told}\n"
    return f"error: internal fault: {told} (please report it with {path}, or see {DEBUG})\n"


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
