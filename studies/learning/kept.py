"""Steps of a study that are computed once and kept on disk: right, or absent.

A step is named by a hash of its settings, of the steps before it, and of the code that makes it,
so whatever changes never meets an old result, trials share what they have in common, and a killed
study continues where it stopped. Its files appear together, flushed to disk, and are checked by
their checksums whenever they are read.
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol, TypeVar

import filelock

from simgap_files.atomic import flush_to_disk
from studies.learning.sources import code_of

_RECORD = "step.json"
_log = logging.getLogger("simgap")


class Result(Protocol):
    """What a step leaves: it can be written into a folder."""

    def save(self, folder: Path) -> None:
        """Write all of it."""
        ...


R = TypeVar("R", bound=Result)


class OnDisk:
    """A folder of finished steps.

    Args:
        root: Where they are kept; made if absent.
    """

    def __init__(self, root: str | Path) -> None:
        self.root = Path(root)
        self.root.mkdir(parents=True, exist_ok=True)

    def run(
        self,
        name: str,
        settings: Mapping[str, Any],
        code: Sequence[Any],
        compute: Callable[[], R],
        load: Callable[[Path, str], R],
    ) -> R:
        """The result of a step: read if it is there, whole and of this code, else computed.

        Args:
            name: What the step does, for its folder.
            settings: All that its result depends on, plain values; of earlier steps their keys.
            code: Classes and functions that make it.
            compute: Makes it.
            load: Reads it from its folder, and takes its key.
        """
        made_by = {"settings": settings, "code": code_of(*code)}
        try:
            described = json.dumps(made_by, sort_keys=True, indent=1)
        except TypeError as error:
            raise TypeError(f"step {name}: its settings are no plain values: {error}") from None
        key = f"{name}-{hashlib.sha256(described.encode()).hexdigest()[:12]}"
        folder = self.root / key
        # Whoever else needs it waits until it is there.
        with filelock.FileLock(self.root / f".{key}.lock"):
            if folder.exists() and (wrong := damage(folder, described)):
                aside = self._set_aside(folder)
                _log.warning("%s is damaged: set aside as %s, computed anew", wrong, aside)
            if not folder.exists():
                self._compute(folder, described, compute)
        return load(folder, key)

    def forget(self, keys: Sequence[str]) -> None:
        """Remove steps that a later one holds."""
        for key in keys:
            shutil.rmtree(self.root / key, ignore_errors=True)
            (self.root / f".{key}.lock").unlink(missing_ok=True)

    def _compute(self, folder: Path, described: str, compute: Callable[[], R]) -> None:
        # The lock says that nobody is working on what a killed process left.
        for left in self.root.glob(f".{folder.name}.*"):
            if left.is_dir():
                shutil.rmtree(left)
        partial = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=self.root))
        try:
            compute().save(partial)
            (partial / _RECORD).write_text(_record(described, _checksums(partial)))
            for file in partial.iterdir():
                flush_to_disk(file)
            flush_to_disk(partial)
            os.replace(partial, folder)
            flush_to_disk(self.root)
        finally:
            shutil.rmtree(partial, ignore_errors=True)

    def _set_aside(self, folder: Path) -> Path:
        place = self.root / "damaged"
        place.mkdir(exist_ok=True)
        aside = place / f"{folder.name}-{len(list(place.iterdir())) + 1}"
        os.replace(folder, aside)
        return aside


def damage(folder: Path, described: str) -> Path | None:
    """The first file of a step that is not as it was written; None if all are."""
    record = folder / _RECORD
    try:
        sums = json.loads(record.read_text())["files"]
        if record.read_text() != _record(described, sums):
            return record
        files = _checksums(folder)
    except (OSError, ValueError, KeyError, TypeError):
        return record
    wrong = [name for name in {**sums, **files} if sums.get(name) != files.get(name)]
    return folder / wrong[0] if wrong else None


def _record(described: str, checksums: Mapping[str, str]) -> str:
    content = {**json.loads(described), "files": dict(checksums)}
    return json.dumps(content, sort_keys=True, indent=1)


def _checksums(folder: Path) -> dict[str, str]:
    return {
        file.name: hashlib.sha256(file.read_bytes()).hexdigest()
        for file in sorted(folder.iterdir())
        if file.name != _RECORD
    }
