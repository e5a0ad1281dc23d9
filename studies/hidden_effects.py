"""Hide physical effects in a pendulum's data and see whether find_gap names them.

Logs come from SciPy's integration of written-out equations, with noise, and in them an effect is
hidden (or two, or none, or one that no library holds). find_gap sees the logs and the nominal
simulator only. Beside it stand one-step regression and pysindy on the same logs. In the dirty world
the effect is hidden among things that no library holds, in four systems, and beside every answer
stands the oracle: the nominal simulator with the hidden effect, its strength fitted.

  python -m studies.hidden_effects --config studies/configs/hidden_effects/fast.yaml
  python -m studies.hidden_effects --config studies/configs/hidden_effects/standard.yaml --jobs 2
  python -m studies.hidden_effects --config studies/configs/hidden_effects/pairs.yaml
  python -m studies.hidden_effects --config studies/configs/hidden_effects/dirty.yaml --jobs 2

Every set of logs is one trial with a folder of its own. A killed run continues where it stopped
when the same command is given again; the tables count what is finished. pysindy takes part if it
is installed (`pip install pysindy`).
"""

from __future__ import annotations

import dataclasses
import importlib.util
import json
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import threadpoolctl
from jsonargparse.typing import PositiveInt

from residual.gap import find_gap
from simgap_files.atomic import read_sealed, write_sealed
from sims.effects.library import library
from sims.pendulum_equation import PendulumEquation
from studies.hidden.data import make_logs
from studies.hidden.dirty.report import write_dirty
from studies.hidden.dirty.score import run_dirty
from studies.hidden.grid import OUTSIDE, HiddenStudy, trials_of
from studies.hidden.report import write_report
from studies.hidden.rivals import one_step, regression, sparse
from studies.hidden.scores import replaceable, score, score_names
from studies.hidden.strengths import draw, truth
from studies.running.command import Parser
from studies.running.ending import check_output, fail, guarded, run_as_imported
from studies.running.progress import Progress
from studies.running.trials import Execution, read_trials, run_trials, tell_failures, trial_folder

RESULTS = Path("results/hidden_effects")


def build_parser() -> Parser:
    """The command line of this study."""
    parser = Parser(prog="python -m studies.hidden_effects", description=__doc__)
    parser.add_argument("--config", action="config", help="YAML file with any of the settings.")
    parser.add_argument(
        "--output", type=Path | None, default=None, help="Folder; default: results/hidden_effects."
    )
    parser.add_argument("--jobs", type=PositiveInt, default=1, help="Processes.")
    parser.add_class_arguments(HiddenStudy)
    return parser


def run_set(config: Mapping[str, Any], folder: Path, progress: Progress) -> dict[str, Any]:
    """Make one set of logs, ask every method, score what they say."""
    if "system" in config:
        with threadpoolctl.threadpool_limits(1):
            return {"config": dict(config), "answers": {"find_gap": run_dirty(config)}}
    rng = np.random.default_rng(config["seed"])
    drawn = (config["size"], config["excitation"], config["noise"], rng)
    strengths = {name: draw(name, *drawn) for name in config["hidden"] if name not in OUTSIDE}
    outside: dict[str, float] = {}
    for name in config["hidden"]:
        outside |= OUTSIDE.get(name, {})
    simulator = PendulumEquation()
    with threadpoolctl.threadpool_limits(1), progress.task("set", 2) as tell:
        how = (config[key] for key in ("seed", "excitation", "noise", "runs", "steps"))
        logs = make_logs(truth(strengths | outside), *how)
        tell(1)
        gone = [replaceable(name) for name in config["hidden"]] if config["remove"] else []
        removed = frozenset().union(*gone)
        offered = [effect for effect in library(simulator) if effect.name not in removed]
        answers: dict[str, Any] = {}
        if "find_gap" in config["methods"]:
            begin = time.process_time()
            # All that is not hidden is as the simulator says, to the last digit.
            result = find_gap(simulator, logs, effects=offered, parameter_tolerance=0.0)
            used = {"processor_seconds": time.process_time() - begin}
            answers["find_gap"] = score(result, strengths, bool(outside)) | used
        for method, ask in {"one_step": one_step, "pysindy": sparse}.items():
            known = method != "pysindy" or importlib.util.find_spec("pysindy")
            if method in config["methods"] and known:
                said = ask(regression(simulator, offered, logs, method == "pysindy"))
                names = [*strengths, *outside]
                answers[method] = {"named": said} | score_names(said, names)
        tell(2)
    return {"config": dict(config), "strengths": strengths, "answers": answers}


def _title(cell: Mapping[str, Any]) -> str:
    hidden = [cell["hidden"]] if isinstance(cell["hidden"], str) else cell["hidden"]
    parts = [cell["block"], cell.get("system", ""), *hidden]
    return "-".join(part for part in parts if part).replace(" ", "_")


def rebuild(folder: Path) -> None:
    """Write the report again from the finished sets, for ``studies.report``.

    Args:
        folder: Where the sets are: ``sets`` in the output folder.
    """
    results, _ = read_trials(folder)
    _report(results, folder.parent, read_sealed(folder.parent / "settings.json"))


def _report(
    results: Sequence[Mapping[str, Any]], output: Path, settings: Mapping[str, Any]
) -> None:
    """Tables on disk and a few lines on the terminal, for each of the two worlds."""
    dirty = [result for result in results if "system" in result["config"]]
    clean = [result for result in results if "system" not in result["config"]]
    if clean:
        short = write_report(clean, output, settings)
        print(f"\n{short}\n\nreport: {output / 'report.html'}")
    if dirty:
        print(f"\n{write_dirty(dirty, output)}\n\nreport: {output / 'dirty.md'}")


@guarded()
def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    parser = build_parser()
    given = parser.parse_args(arguments)
    made = parser.instantiate(given)
    study = HiddenStudy(**{f.name: made[f.name] for f in dataclasses.fields(HiddenStudy)})
    output = Path(given.output) if given.output else RESULTS
    check_output(output)
    cells = trials_of(study)
    if not cells:
        fail("nothing to run: expected blocks or dirty, as in studies/configs/hidden_effects/")
    folders = {trial_folder(output / "sets", _title(c), c): c for c in cells}
    settings = json.loads(parser.dump(given, format="json"))
    write_sealed(output / "settings.json", settings)
    results, failures = run_trials("hidden_effects", folders, run_set, Execution(jobs=given.jobs))
    if results:
        _report(results, output, settings)
    tell_failures(failures)
    if failures:
        raise SystemExit(1)


if __name__ == "__main__":
    run_as_imported("studies.hidden_effects")
