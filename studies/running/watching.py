"""One live view of many trials, wherever they run.

A running trial keeps a small file, ``status.json``, in its folder; the command that started the
trials reads these files now and then. Nothing else passes between them.
"""

from __future__ import annotations

import contextlib
import os
import socket
import sys
import threading
import time
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

from tqdm import tqdm

from simgap_files.atomic import atomic_write_json, read_json
from studies.running.progress import Advance, Numbers, stderr

STATUS = "status.json"
WRITE_EVERY = 10.0  # seconds; hundreds of trials share a file system
LOOK_EVERY = 2.0  # seconds
SHOWN = 8  # running trials with a line of their own


class StatusFile:
    """Progress kept in a trial's folder while the trial runs."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / STATUS
        self._write("starting", 0, 0, "")

    @contextlib.contextmanager
    def task(self, title: str, total: int) -> Iterator[Advance]:
        """A step of ``total`` units; written at its start and every ten seconds."""
        self._write(title, 0, total, "")

        def advance(done: int, note: str = "", values: Numbers = None) -> None:
            if time.monotonic() - self._written >= WRITE_EVERY:
                self._write(title, done, total, note)

        yield advance

    def remove(self) -> None:
        """The trial has ended."""
        self.path.unlink(missing_ok=True)

    def _write(self, title: str, done: int, total: int, note: str) -> None:
        place = {"host": socket.gethostname(), "process": os.getpid()}
        status = {"step": title, "done": done, "total": total, "note": note}
        atomic_write_json(self.path, status | place)
        self._written = time.monotonic()


def running(folders: Collection[Path]) -> dict[Path, dict[str, Any]]:
    """The status of those trials that run."""
    found = {}
    for folder in folders:
        # Not there: it waits or has ended.
        with contextlib.suppress(OSError, ValueError):
            found[folder] = read_json(folder / STATUS)
    return found


class TrialsView:
    """A bar over all trials, and on a terminal a line for each of the first that run.

    Args:
        folders: Of the trials that are not finished.
        total: Number of all trials, the finished ones included.
    """

    def __init__(self, folders: Collection[Path], total: int) -> None:
        self._waiting = set(folders)
        self._failed = 0
        self._bar = tqdm(
            total=total, initial=total - len(self._waiting), desc=f"{total} trials",
            file=stderr(), mininterval=0.5, smoothing=0, position=0,
            bar_format="{desc} |{bar:20}| {n} done{postfix}, {elapsed}<{remaining}",
        )  # fmt: skip
        self._lines: list[tqdm[Any]] = []
        self._ended = threading.Event()
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> TrialsView:
        self._show()
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._ended.set()
        self._thread.join()
        self._show()
        for line in self._lines:
            line.close()
        self._bar.close()

    def ended(self, folder: Path, failed: bool) -> None:
        """A trial is done, or has failed."""
        with self._lock:
            self._waiting.discard(folder)
            self._failed += failed
            self._bar.update()

    def _watch(self) -> None:
        # Looking at ten thousand folders every two seconds would load a network file system.
        while not self._ended.wait(max(LOOK_EVERY, len(self._waiting) / 100)):
            self._show()

    def _show(self) -> None:
        with self._lock:
            now = running(self._waiting)
            self._bar.set_postfix_str(f"{len(now)} running, {self._failed} failed", refresh=True)
            if sys.stderr.isatty():
                self._show_lines(now)

    def _show_lines(self, now: Mapping[Path, Mapping[str, Any]]) -> None:
        texts = []
        for folder, status in list(now.items())[:SHOWN]:
            share = f" {100 * status['done'] // status['total']} %" if status["total"] else ""
            texts.append(f"{folder.name}: {status['step']}{share} {status['note']}")
        for place in range(len(self._lines) + 1, len(texts) + 1):
            self._lines.append(
                tqdm(file=sys.stderr, position=place, leave=False, bar_format="  {desc}")
            )
        texts += [""] * (len(self._lines) - len(texts))
        for line, text in zip(self._lines, texts, strict=True):
            line.set_description_str(text)
