"""Rebuild the tables, figures and report of a study from what its trials left on disk.

Nothing is computed again: of a study that is still running, or was killed, the finished trials
are shown.

  python -m studies.report results/pendulum_gap/budgets
  python -m studies.report results/hidden_effects/sets
"""

from __future__ import annotations

import importlib
import re
from collections.abc import Sequence
from pathlib import Path

from jinja2 import UndefinedError

from simgap_files.atomic import read_sealed
from studies.learnt.run_report import rebuild
from studies.running.command import Parser
from studies.running.ending import fail, guarded
from studies.running.trials import PLAN


def build_parser() -> Parser:
    """The command line."""
    parser = Parser(prog="python -m studies.report", description=__doc__)
    parser.add_argument("folder", type=Path, help="Output folder of a study.")
    return parser


def study_of(folder: Path) -> str:
    """Name of the study that wrote a folder: ``studies/<name>.py`` can rebuild it.

    ``study.json`` names it, or of a single trial ``results.json``.

    Raises:
        FileNotFoundError: The folder holds no results.
        ValueError: The name is none of a study, or the file is damaged.
    """
    path = _named_in(folder)
    if not path.exists():
        raise FileNotFoundError(
            f"{folder}: expected the output folder of a study, with {PLAN} or results.json in it"
        )
    found = read_sealed(path)
    if "study" not in found:
        raise ValueError(f"{path} is damaged: expected a JSON object with the name of its study")
    name = str(found["study"])
    # A name from a file is imported: it may only be that of a study.
    if not re.fullmatch(r"[a-z_]+", name) or not Path(__file__).with_name(f"{name}.py").exists():
        raise ValueError(f"{path}: there is no study {name!r}, expected one of studies/")
    return name


def _named_in(folder: Path) -> Path:
    """The file that names the study of a folder."""
    return folder / (PLAN if (folder / PLAN).exists() else "results.json")


def _told(folder: Path, error: Exception) -> str:
    """What is wrong with the files that a report was to be made from."""
    if str(folder) in str(error):
        return str(error)
    wrong = f"a key {error}" if isinstance(error, KeyError) else f"values as written ({error})"
    return (
        f"{_named_in(folder)}, or the results.json of a trial that it names, is damaged or of "
        f"another version: expected {wrong}; give the command of the study again"
    )


@guarded(resumes=False)
def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    folder: Path = build_parser().parse_args(arguments).folder
    try:
        module = importlib.import_module(f"studies.{study_of(folder)}")
        # Other studies than those of a gap have a function of their own.
        if hasattr(module, "STUDY"):
            rebuild(folder)
        else:
            module.rebuild(folder)
    except (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, OSError,
            UndefinedError) as error:  # fmt: skip
        fail(_told(folder, error))


if __name__ == "__main__":
    main()
