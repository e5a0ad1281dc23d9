"""Run the benchmarks and print how many times faster than their peers ours are.

``python -m studies.benchmarks`` runs ``tests/benchmarks`` on one thread and prints the tables of
``docs/benchmarks.md``; it needs a checkout of the project and its extras ``test`` and ``bench``.
``--mujoco`` measures the section on MuJoCo models. With ``--output docs/benchmarks.md`` each leaves
what the other measured.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from simgap_files.atomic import atomic_write_text, read_json
from studies.reporting.render import render
from studies.running.command import Parser
from studies.running.ending import check_output, fail, guarded
from studies.running.versions import own_version
from studies.running.workers import ONE_THREAD
from studies.timing.fit_scaling import write_figure
from studies.timing.tables import SCALING, mujoco_tables, records, tables

ROOT = Path(__file__).resolve().parents[1]
SUITE = Path("tests", "benchmarks")
FIGURE = Path("images", "fit_scaling.png")
MUJOCO = "## MuJoCo models\n"


def build_parser() -> Parser:
    """The command line."""
    parser = Parser(prog="python -m studies.benchmarks", description=__doc__)
    parser.add_argument(
        "--mujoco", action="store_true",
        help="MuJoCo models instead: speed beside mujoco.rollout, and find_gap beside MuJoCo's own "
        "system identification (extra mujoco[sysid])",
    )  # fmt: skip
    parser.add_argument(
        "--read",
        type=str | None,
        help="tables of what pytest --benchmark-json wrote; measure nothing",
    )
    parser.add_argument(
        "--output", type=str | None,
        help="write the Markdown to this file too, and its figure into images/ beside it",
    )  # fmt: skip
    return parser


def check_suite() -> None:
    """Raise ``FileNotFoundError`` if this is no checkout of the project."""
    if not (ROOT / SUITE).is_dir():
        raise FileNotFoundError(
            f"{ROOT / SUITE} does not exist: run the benchmarks in a checkout of the project"
        )


def document(data: Mapping[str, Any], figure: bool = False) -> str:
    """The page: the command that measured it, the tables, and how to read them.

    Args:
        data: The content of a file that ``pytest --benchmark-json`` wrote.
        figure: Show ``FIGURE``, which stands beside the page.
    """
    found = tables(data).rstrip()  # an error if the data are none
    if figure:
        picture = f"![Seconds, memory and error of a fit against the number of points]({FIGURE})"
        found = found.replace(f"{SCALING}\n", f"{SCALING}\n\n{picture}\n", 1)
    command = data.get("command", f"pytest {SUITE} -o addopts= --benchmark-only")
    return f"{render('benchmarks.md', command=command, tables=found)}\n"


@guarded(resumes=False)
def main(arguments: Sequence[str] | None = None) -> None:
    """The command; its exit code is 1 if a benchmark failed."""
    given = build_parser().parse_args(arguments)
    if given.output:
        check_output(Path(given.output).parent)
    if given.mujoco:
        robots(given.output)
        return
    data, complete = measure() if not given.read else (read_json(given.read), True)
    try:
        found = records(data)
    except ValueError as problem:
        fail(f"{given.read}: {problem}" if given.read else str(problem))
    picture = Path(given.output).parent / FIGURE if given.output else None
    page = document(data, picture is not None and write_figure(found, picture) is not None)
    page = joined(page, parts_of(given.output)[1])
    print(page)
    if given.output:
        atomic_write_text(given.output, page)
    if not complete:
        sys.stderr.write("error: some benchmarks failed: the tables hold the others\n")
        raise SystemExit(1)


def robots(output: str | None) -> None:
    """Measure MuJoCo models and print the page."""
    found = mujoco_tables(measure_mujoco())
    page = f"{render('benchmarks_mujoco.md', version=own_version(), **found)}\n"
    print(page)
    if output:
        atomic_write_text(output, joined(parts_of(output)[0] or "# Benchmarks", page))


def measure_mujoco() -> dict[str, Any]:
    """What ``tests/benchmarks/mujoco_models.py`` measured: ``speeds`` and ``rivals``.

    Raises:
        FileNotFoundError: This is no checkout of the project.
        ChildProcessError: Nothing was measured.
    """
    check_suite()
    command = [sys.executable, "-m", f"{'.'.join(SUITE.parts)}.mujoco_models"]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
    if done.returncode:
        raise ChildProcessError(
            "nothing was measured, see above; the comparison needs MuJoCo with its own "
            "identification: `pip install 'mujoco[sysid]'`"
        )
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def parts_of(output: str | None) -> tuple[str, str]:
    """The page that is there, and its last section, on MuJoCo models; empty if there is none."""
    there = Path(output) if output else None
    page = there.read_text(encoding="utf-8") if there and there.is_file() else ""
    rest, heading, section = f"\n{page}".partition(f"\n{MUJOCO}")
    return rest, heading + section


def joined(page: str, section: str) -> str:
    """A page with the section on MuJoCo models, if there is one, as its last."""
    return f"{page.strip()}\n\n{section.strip()}".rstrip() + "\n"


def measure() -> tuple[dict[str, Any], bool]:
    """Run the suite in a process of its own; progress goes to stderr.

    Returns:
        What it measured, and whether every benchmark passed.

    Raises:
        FileNotFoundError: This is no checkout of the project: the suite is not there.
        ChildProcessError: Nothing was measured.
    """
    check_suite()
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder, "benchmarks.json")
        command = [sys.executable, "-m", "pytest", str(SUITE), "-o", "addopts=", "--benchmark-only"]
        command += ["--benchmark-json", str(target), "-q", "-rs", "-p", "no:cacheprovider"]
        done = subprocess.run(command, cwd=ROOT, env=os.environ | ONE_THREAD, stdout=sys.stderr)
        if not target.is_file() or not target.stat().st_size:
            raise ChildProcessError(
                "nothing was measured, see above; the benchmarks need the extras: "
                "`pip install -e '.[test,bench]'`"
            )
        data = read_json(target)
    # What decides the figures; where they are written to does not.
    data["command"] = "python -m studies.benchmarks"
    return data, done.returncode == 0


if __name__ == "__main__":
    main()
