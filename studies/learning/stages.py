"""Stages: steps of a study that are computed once, kept on disk and never half-written.

A stage is a pure function of its configuration and of earlier stages. Its folder is named by
a hash of both, so changed settings never meet old results, trials share what they have in
common, and a killed study continues where it stopped.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

import filelock


class Stages:
    """A folder of finished stages.

    Args:
        root: Where the stages are kept; made if absent.
    """

    def __init__(self, root: Path) -> None:
        self.root = root
        root.mkdir(parents=True, exist_ok=True)

    def run(self, name: str, config: Mapping[str, Any], compute: Callable[[Path], None]) -> Path:
        """The folder of a stage, computed now if no finished one exists.

        Args:
            name: What the stage does, for the folder's name.
            config: All that its result depends on: plain values, and folders of earlier
                stages (only their names count, which carry their own hash).
            compute: Writes the result into the folder it is given.

        Returns:
            The finished folder.
        """
        described = json.dumps(
            {"version": metadata.version("simgap"), **config},
            sort_keys=True,
            default=_stage_name,
            indent=1,
        )
        digest = hashlib.sha256(described.encode()).hexdigest()[:12]
        folder = self.root / f"{name}-{digest}"
        if folder.exists():
            return folder
        with filelock.FileLock(self.root / f".{folder.name}.lock"):
            if folder.exists():  # another process finished it while this one waited
                return folder
            self._remove_abandoned(folder.name)
            partial = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=self.root))
            compute(partial)
            (partial / "stage.json").write_text(described)
            os.replace(partial, folder)
        return folder

    def _remove_abandoned(self, name: str) -> None:
        """Clear what a killed process left; the lock says that nobody is working on it."""
        for left in self.root.glob(f".{name}.*"):
            if left.is_dir():
                shutil.rmtree(left)


def _stage_name(value: object) -> str:
    if isinstance(value, Path):
        return value.name
    raise TypeError(f"{value!r} cannot be part of a stage's configuration")
