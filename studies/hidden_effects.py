"""Hide physical effects in a pendulum's data and see whether find_gap names them.

Logs come from SciPy's integration of written-out equations, with noise, and in them an effect is
hidden (or two, or none, or one that no library holds). find_gap sees the logs and the nominal
simulator only. Beside it stand one-step regression and pysindy on the same logs.

  python -m studies.hidden_effects --config studies/configs/hidden_effects/fast.yaml
  python -m studies.hidden_effects --config studies/configs/hidden_effects/standard.yaml --jobs 2
  python -m studies.hidden_effects --config studies/configs/hidden_effects/pairs.yaml

Every set of logs is one trial with a folder of its own. A killed run continues where it stopped
when the same command is given again; the tables count what is finished. pysindy takes part if it
is installed (pip install simgap[bench]).
"""

from __future__ import annotations

import dataclasses
import importlib.util
import itertools
import json
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
import threadpoolctl
from jsonargparse.typing import PositiveInt

from residual.gap import find_gap
from sims.effects.base import Effect
from sims.effects.library import library
from sims.pendulum_equation import PendulumEquation
from studies.hidden.data import Excitation, make_logs
from studies.hidden.report import summary, write_report
from studies.hidden.rivals import one_step, regression, sparse
from studies.hidden.scores import alike, replaceable, score, score_names
from studies.hidden.strengths import HIDDEN, draw, strength, truth
from studies.running.command import HelpFormatter, Parser, fail
from studies.running.files import atomic_write_json, read_json
from studies.running.progress import Progress
from studies.running.trials import Execution, read_trials, run_trials, trial_folder

RESULTS = Path("results/hidden_effects")
#: Effects that no library holds, as fields of ``Truth`` at a size that is seen.
OUTSIDE: Mapping[str, Mapping[str, float]] = {
    "resonance": {"resonance": 2e-3},
    "wind": {"wind": 2e-3},
}
METHODS = ("find_gap", "one_step", "pysindy")


@dataclasses.dataclass(frozen=True)
class Block:
    """Sets of logs of one kind: the product of all lists, ``sets`` of them or all.

    Args:
        name: Of the block, for tables.
        hidden: What is hidden, one list of names for each kind of set; ``[any]`` stands for every
            effect alone, ``[any, any]`` for a random pair, an empty list for no gap.
        size: Gaps in units of the noise floor, for each effect alone.
        excitation: ``strong``, ``weak`` or ``policy``.
        noise: ``A``, ``B`` or ``C``.
        runs: Trajectories in a set.
        remove: Take what is hidden, and what can replace it exactly, out of the library.
        repeats: Sets for every combination.
        sets: Draw so many sets at random, every effect about equally often; all by default.
    """

    name: str
    hidden: list[list[str]]
    size: list[float] = dataclasses.field(default_factory=lambda: [3.0])
    excitation: list[Excitation] = dataclasses.field(default_factory=lambda: ["strong"])
    noise: list[Literal["A", "B", "C"]] = dataclasses.field(default_factory=lambda: ["A"])
    runs: list[int] = dataclasses.field(default_factory=lambda: [15])
    remove: bool = False
    repeats: PositiveInt = 1
    sets: PositiveInt | None = None


@dataclasses.dataclass(frozen=True)
class HiddenStudy:
    """What is run.

    Args:
        blocks: The kinds of sets.
        methods: Who is asked.
        steps: Control steps of every trajectory.
        seed: Of everything random.
    """

    blocks: list[Block]
    methods: list[Literal["find_gap", "one_step", "pysindy"]] = dataclasses.field(
        default_factory=lambda: list(METHODS)  # type: ignore[arg-type]
    )
    steps: PositiveInt = 250
    seed: int = 0


def build_parser() -> Parser:
    """The command line of this study."""
    parser = Parser(
        prog="python -m studies.hidden_effects",
        description=__doc__,
        formatter_class=HelpFormatter,
    )
    parser.add_argument("--config", action="config", help="YAML file with any of the settings.")
    parser.add_argument(
        "--output", type=Path | None, default=None, help="Folder; default: results/hidden_effects."
    )
    parser.add_argument("--jobs", type=PositiveInt, default=1, help="Processes.")
    parser.add_class_arguments(HiddenStudy)
    return parser


def trials_of(study: HiddenStudy) -> list[dict[str, Any]]:
    """Plain settings of every set of logs, shuffled so that any part of them is balanced.

    Raises:
        ValueError: A name of an effect, an excitation or a noise is not known.
    """
    rng = np.random.default_rng(study.seed)
    found = []
    for block in study.blocks:
        cells = []
        for names, size, excitation, noise, runs, repeat in itertools.product(
            block.hidden, block.size, block.excitation, block.noise, block.runs,
            range(block.repeats),
        ):  # fmt: skip
            for hidden in _spelt_out(names, rng):
                if not _possible(hidden, size, excitation, noise):
                    continue
                cells.append(
                    {
                        "block": block.name, "hidden": hidden, "size": size if hidden else 1.0,
                        "excitation": excitation, "noise": noise, "runs": runs,
                        "remove": block.remove, "repeat": repeat, "steps": study.steps,
                        "methods": list(study.methods),
                    }
                )  # fmt: skip
        order = rng.permutation(len(cells)).tolist()
        if block.sets is not None:
            order = _balanced([cells[i]["hidden"] for i in order], order)[: block.sets]
        found += [cells[i] for i in order]
    mixed = [found[i] for i in rng.permutation(len(found))]
    return [{**cell, "seed": 100_000 * study.seed + number} for number, cell in enumerate(mixed)]


def _spelt_out(names: Sequence[str], rng: np.random.Generator) -> list[list[str]]:
    wild = [name for name in names if name == "any"]
    unknown = [n for n in names if n not in HIDDEN and n not in OUTSIDE and n != "any"]
    if unknown:
        raise ValueError(
            f"nothing called {unknown[0]!r} can be hidden; there are {', '.join(HIDDEN)}, "
            f"{', '.join(OUTSIDE)} and 'any'"
        )
    if len(wild) == 1:
        rest = [name for name in names if name != "any"]
        return [[*rest, name] for name in HIDDEN if name not in rest]
    if len(wild) == 2:
        while True:
            pair = [str(name) for name in rng.choice(list(HIDDEN), 2, replace=False)]
            if pair[1] not in alike(pair[0]) | replaceable(pair[0]):
                return [pair]
    return [list(names)]


def _possible(hidden: Sequence[str], size: float, excitation: Excitation, noise: str) -> bool:
    """Whether every effect can make a gap of this size (inertia under feedback, say, cannot)."""
    try:
        for name in hidden:
            if name in HIDDEN:
                strength(name, size, excitation, noise)
    except ValueError:
        return False
    return True


def _balanced(names: Sequence[Sequence[str]], order: Sequence[int]) -> list[int]:
    """The order with every first name once before any comes a second time, and so on."""
    turns: dict[str, int] = {}
    keyed = []
    for place, (hidden, index) in enumerate(zip(names, order, strict=True)):
        first = hidden[0] if hidden else ""
        turns[first] = turns.get(first, 0) + 1
        keyed.append((turns[first], place, index))
    return [index for _, _, index in sorted(keyed)]


def run_set(config: Mapping[str, Any], folder: Path, progress: Progress) -> dict[str, Any]:
    """Make one set of logs, ask every method, score what they say."""
    rng = np.random.default_rng(config["seed"])
    strengths: dict[str, float] = {}
    outside: dict[str, float] = {}
    for name in config["hidden"]:
        if name in OUTSIDE:
            outside.update(OUTSIDE[name])
            continue
        strengths[name] = draw(name, config["size"], config["excitation"], config["noise"], rng)
    hidden_truth = truth(strengths | outside)
    simulator = PendulumEquation()
    with threadpoolctl.threadpool_limits(1), progress.task("set", 2) as tell:
        logs = make_logs(
            hidden_truth, config["seed"], config["excitation"], config["noise"], config["runs"],
            config["steps"],
        )  # fmt: skip
        tell(1)
        offered: list[Effect] = list(library(simulator))
        if config["remove"]:
            gone = frozenset().union(*(replaceable(name) for name in config["hidden"]))
            offered = [effect for effect in offered if effect.name not in gone]
        answers: dict[str, Any] = {}
        if "find_gap" in config["methods"]:
            begin = time.process_time()
            result = find_gap(simulator, logs, effects=offered)
            used = {"processor_seconds": time.process_time() - begin}
            answers["find_gap"] = score(result, strengths, bool(outside)) | used
        names = [*strengths, *outside]
        if "one_step" in config["methods"]:
            said = one_step(regression(simulator, offered, logs, differentiate=False))
            answers["one_step"] = {"named": said} | score_names(said, names)
        if "pysindy" in config["methods"] and importlib.util.find_spec("pysindy"):
            said = sparse(regression(simulator, offered, logs, differentiate=True))
            answers["pysindy"] = {"named": said} | score_names(said, names)
        tell(2)
    return {"config": dict(config), "strengths": strengths, "answers": answers}


def rebuild(folder: Path) -> None:
    """Write the report again from the finished sets, for ``studies.report``.

    Args:
        folder: Where the sets are: ``sets`` in the output folder.
    """
    results, _ = read_trials(folder)
    write_report(results, folder.parent, read_json(folder.parent / "settings.json"))
    print(f"{summary(results)}\n\nreport: {folder.parent / 'report.html'}")


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    parser = build_parser()
    given = parser.parse_args(arguments)
    made = parser.instantiate(given)
    fields = [field.name for field in dataclasses.fields(HiddenStudy)]
    study = HiddenStudy(**{name: made[name] for name in fields})
    output = Path(given.output) if given.output else RESULTS
    try:
        cells = trials_of(study)
    except ValueError as error:
        fail(str(error))
    folders = {
        trial_folder(output / "sets", "-".join([c["block"], *c["hidden"]]), c): c for c in cells
    }
    settings = json.loads(parser.dump(given, format="json"))
    atomic_write_json(output / "settings.json", settings)
    results, failures = run_trials("hidden_effects", folders, run_set, Execution(jobs=given.jobs))
    if results:
        write_report(results, output, settings)
        print(f"\n{summary(results)}\n\nreport: {output / 'report.html'}")
    for folder, failure in failures.items():
        reason = failure.strip().splitlines()[-1]
        print(f"failed: {folder}: {reason} (see error.txt there)", file=sys.stderr)
    if failures:
        raise SystemExit(1)


if __name__ == "__main__":
    # By its importable name, which worker processes need to find the same classes.
    from studies import hidden_effects

    hidden_effects.main()
