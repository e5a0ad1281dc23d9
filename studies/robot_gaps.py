"""How often find_gap is right about robots: MuJoCo models of known truth.

Hides effects of the default library in logs of the shipped models (MuJoCo at a finer step by
another integrator, encoders of 0.5 mrad, rates unmeasured), asks find_gap, and prints a line for
each answer and a table. Answers are kept in a file and not asked again.

  python -m studies.robot_gaps --robot arm2 --kind single --seeds 1 --output results/robots.jsonl
  python -m studies.robot_gaps --robot arm2 --kind none --seeds 10 --output results/robots.jsonl
  python -m studies.robot_gaps --robot hopper --hidden "mass of body torso" --output r.jsonl
"""

from __future__ import annotations

import dataclasses
import difflib
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from jsonargparse.typing import PositiveInt

from studies.reporting.markdown import frame_markdown
from studies.robots.cases import Case, Kind, ask, cases, nominal
from studies.robots.drives import ROBOTS
from studies.running.command import Parser
from studies.running.ending import check_output, fail, guarded

#: What ``ask`` returns, as its line of JSON holds it.
Kept = dict[str, Any]


def build_parser() -> Parser:
    """The command line."""
    parser = Parser(prog="python -m studies.robot_gaps", description=__doc__)
    parser.add_argument("--robot", choices=ROBOTS, default="arm2")
    parser.add_argument(
        "--kind", type=Kind, default="single",
        help="nothing, each effect of the library alone, or a friction and a payload",
    )  # fmt: skip
    parser.add_argument("--hidden", type=str, nargs="*", help="hide these in place of a kind")
    parser.add_argument("--seeds", type=PositiveInt, default=1, help="how many seeds")
    parser.add_argument("--sample", type=PositiveInt | None, help="only so many, drawn at random")
    parser.add_argument("--output", type=Path, required=True, help="JSON lines of answers")
    return parser


@guarded()
def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    given = build_parser().parse_args(arguments)
    check_output(given.output.parent)
    seeds = range(given.seeds)
    if given.hidden:
        offered = [str(effect) for effect in nominal(given.robot).offered_effects()]
        for name in set(given.hidden) - set(offered):
            near = difflib.get_close_matches(name, offered, 3, 0.0)
            fail(f"--hidden {name!r}: {given.robot} has no such effect; nearest: {', '.join(near)}")
        wanted = [Case(given.robot, tuple(given.hidden), seed) for seed in seeds]
    else:
        wanted = list(cases(given.robot, given.kind, seeds))
    if given.sample:
        order = np.random.default_rng(0).permutation(len(wanted))[: given.sample]
        wanted = [wanted[i] for i in sorted(order)]
    try:
        known = _read(given.output)
        given.output.parent.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        fail(f"{given.output}: {error}")
    answers = []
    for number, case in enumerate(wanted, start=1):
        answer = known.get(_key(case))
        if answer is None:
            answer = json.loads(json.dumps(ask(case)))
            with given.output.open("a", encoding="utf-8") as file:
                file.write(json.dumps(answer) + "\n")
        answers.append(answer)
        print(f"{number}/{len(wanted)}  {line(answer)}", file=sys.stderr, flush=True)
    print(table(answers))


def line(answer: Kept) -> str:
    """One answer in words."""
    named = ", ".join(f"{label} ({kind})" for label, kind, _ in answer["named"]) or "nothing"
    hidden = " + ".join(f"{name} {size:.3g}" for name, size in answer["sizes"].items()) or "nothing"
    mark = "ok " if answer["right"] else "MISS"
    return f"{mark} {answer['processor']:5.0f} s  hidden {hidden}; named {named}"


def table(answers: Sequence[Kept]) -> str:
    """Markdown over all answers."""
    groups: dict[tuple[str, int], list[Kept]] = {}
    for row in answers:
        groups.setdefault((row["case"]["robot"], len(row["case"]["hidden"])), []).append(row)
    found = []
    for (robot, count), own in groups.items():
        seconds = [row["processor"] for row in own]
        found.append(
            {
                "robot": robot,
                "hidden": ("nothing", "one effect", "two effects")[min(count, 2)],
                "sets": len(own),
                "right": sum(row["right"] for row in own),
                "of them by family": sum(bool(row.get("by_family")) for row in own),
                "confirmed wrong": sum(bool(row["confirmed_wrong"]) for row in own),
                "s, median, most": f"{np.median(seconds):.0f}, {max(seconds):.0f}",
            }
        )
    return frame_markdown(pd.DataFrame(found))


def _key(case: Case) -> str:
    return json.dumps(dataclasses.asdict(case), sort_keys=True)


def _read(path: Path) -> dict[str, Kept]:
    if not path.is_file():
        return {}
    found = [json.loads(text) for text in path.read_text(encoding="utf-8").splitlines()]
    return {json.dumps(answer["case"], sort_keys=True): answer for answer in found}


if __name__ == "__main__":
    main()
