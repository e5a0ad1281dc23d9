"""Faulty simulators: ``check_simulator`` finds the fault, and find_gap says so or is not misled."""

from __future__ import annotations

import contextlib
import io
import shutil
import sys
from pathlib import Path
from unittest import mock

import numpy as np
from damage import OTHER, REFUSED, SAME, TOLD, Defect
from faulty_simulators import FAULTY, HARMLESS
from one_log import one_log

from sims.checks import check_simulator
from studies import find_gap

sys.path.append(str(Path(__file__).parent))
KINDS = (*(f"{name}, checked" for name in FAULTY), *(f"{name}, find_gap" for name in FAULTY))


class Begun(BaseException):
    """The search would begin."""


def attempt(kind: str, rng: np.random.Generator, folder: Path, whole: bool = False) -> str:
    """Check a faulty simulator, or look for a gap with it; how it ended.

    Args:
        kind: Which one, and what is done with it.
        rng: Not used: every fault is tried as it is.
        folder: For files.
        whole: Whether to search in earnest, which takes seconds.

    Raises:
        Defect: In a way that is not promised.
    """
    name, what = kind.split(", ")
    if what == "checked":
        findings = check_simulator(FAULTY[name]())
        if all(finding.ok for finding in findings):
            if name not in HARMLESS:
                raise Defect(f"{name} passes check_simulator")
            return SAME
        if "FAIL" not in str(findings):
            raise Defect(f"no table: {findings}")
        return TOLD
    arguments = ["--simulator", f"faulty_simulators.{name}", "--minutes", "0.02"]
    arguments += ["--logs", str(one_log(folder)), "--output", str(folder / "gap")]
    said = io.StringIO()
    with contextlib.ExitStack() as stack:
        if not whole:
            stack.enter_context(mock.patch("residual.gap.log.prepare", side_effect=Begun))
        stack.enter_context(contextlib.redirect_stderr(said))
        stack.enter_context(contextlib.redirect_stdout(io.StringIO()))
        try:
            find_gap.main(arguments)
        except Begun:
            return OTHER
        except SystemExit as ended:
            error = said.getvalue().splitlines()[-1]
            if ended.code != 2 or not error.startswith("error: ") or "Traceback" in said.getvalue():
                raise Defect(f"exit code {ended.code}: {error}") from ended.__context__
            return REFUSED
        finally:
            shutil.rmtree(folder / "gap", ignore_errors=True)
    return OTHER
