"""The log that tries which are not about logs give to find_gap."""

from __future__ import annotations

import contextlib
import functools
import io
from pathlib import Path

from studies.make_log import main as make_log


@functools.cache
def one_log(folder: Path) -> Path:
    """One run of a pendulum, made below a folder."""
    with contextlib.redirect_stdout(io.StringIO()):
        make_log(["--output", str(folder / "logs")])
    return sorted((folder / "logs").glob("*.csv"))[0]
