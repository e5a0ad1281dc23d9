"""What noise alone reaches in find_gap's tests: the ground that its thresholds stand on.

Logs in which nothing is hidden, made by SciPy and measured with noise, go through the same noise
estimate, windows, signatures and tests as any other; the largest values seen say where the
thresholds have to lie. The gain of the best effect is a maximum over the whole library, so its
quantiles allow for the number of effects that were offered.

  python -m studies.hidden.calibration --sets 20 --output results/hidden_calibration
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
import threadpoolctl
from jsonargparse.typing import PositiveInt

from residual.gap.confirmation.aliases import aliases, representatives
from residual.gap.fitting.adequacy import remainder
from residual.gap.fitting.noise import Floor
from residual.gap.fitting.screening import gains
from residual.gap.fitting.smooth import SmoothFitter
from residual.gap.model.candidates import candidates
from residual.gap.preparation.horizon import usual_horizon
from residual.gap.preparation.prepare import prepare
from residual.gap.search.sets import Search
from simgap_files.atomic import atomic_write_text
from sims.effects.library import library
from sims.pendulum_equation import PendulumEquation
from studies.hidden.data import Truth, make_logs
from studies.running.command import Parser
from studies.running.ending import check_output, guarded, run_as_imported
from studies.running.progress import Progress
from studies.running.trials import Execution, run_trials, trial_folder


def run_set(config: Mapping[str, Any], folder: Path, progress: Progress) -> dict[str, Any]:
    """Test statistics of one set of logs without a gap."""
    simulator = PendulumEquation()
    with threadpoolctl.threadpool_limits(1):
        logs = make_logs(
            Truth(), config["seed"], config["excitation"], config["noise"], config["runs"]
        )
        offered = library(simulator)
        groups, _ = aliases(simulator, offered)
        kept, _ = representatives(simulator, offered, groups)
        ready = prepare(simulator, logs, usual_horizon(simulator, logs))
        assert isinstance(ready.fitter, SmoothFitter)
        assert isinstance(ready.floor, Floor)
        fitter = ready.fitter
        pool = candidates(simulator, kept, fitter.samples)
        search = Search(simulator, pool, fitter)
        nominal = search.tried[()]
        left = remainder(
            nominal.inner, fitter.samples, fitter.blocks.windows, fitter.sigma, ready.floor,
            fitter.scale,
        )  # fmt: skip
        around = search.signatures(())
        best = gains(around)[0].value
        needed = fitter.needed(lambda: around, nominal)
        count = int(fitter.valid.sum())
    return {
        **{key: config[key] for key in ("excitation", "noise", "runs", "seed")},
        "chosen": int(best > needed),
        "gain": best,
        "gain_share": best / count,
        "threshold": needed,
        "ratio": float(left.ratio.max()),
        "ratio_in_errors": float(((left.ratio - 1) / left.error).max()),
        "chance": left.chance,
    }


def table(results: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Largest values by condition, and over all."""
    told: dict[str, Any] = {
        "sets": ("seed", "size"),
        "chosen": ("chosen", "sum"),
        "gain median": ("gain", "median"),
        "gain 99 %": ("gain", lambda gain: gain.quantile(0.99)),
        "gain worst": ("gain", "max"),
        "threshold median": ("threshold", "median"),
        "ratio worst": ("ratio", "max"),
        "ratio worst, errors": ("ratio_in_errors", "max"),
        "chance smallest": ("chance", "min"),
    }
    data, keys = pd.DataFrame(results), ["excitation", "noise", "runs"]
    everything = data.assign(excitation="all", noise="", runs="")
    parts = [part.groupby(keys).agg(**told) for part in (data, everything)]
    return pd.concat([part.reset_index() for part in parts], ignore_index=True)


@guarded()
def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    parser = Parser(prog="python -m studies.hidden.calibration", description=__doc__)
    parser.add_argument("--sets", type=PositiveInt, default=20, help="Sets for each condition.")
    parser.add_argument("--runs", type=PositiveInt, nargs="+", default=[5, 15], help="Sizes.")
    parser.add_argument("--seed", type=int, default=0, help="Of the first set.")
    parser.add_argument("--output", type=Path, default=Path("results/hidden_calibration"))
    parser.add_argument("--jobs", type=PositiveInt, default=1, help="Processes.")
    given = parser.parse_args(arguments)
    check_output(given.output)
    cells = itertools.product(range(given.sets), ("strong", "weak", "policy"), "ABC", given.runs)
    folders = {}
    for number, (_, excitation, noise, runs) in enumerate(cells):
        config = {"excitation": excitation, "noise": noise, "runs": runs}
        config["seed"] = 1_000_000 * (given.seed + 1) + number
        name = f"{excitation}-{noise}-{runs}"
        folders[trial_folder(given.output / "sets", name, config)] = config
    execution = Execution(jobs=given.jobs)
    results, failures = run_trials("hidden_calibration", folders, run_set, execution)
    if failures:
        raise SystemExit(f"{len(failures)} sets failed, see error.txt in {given.output / 'sets'}")
    found = table(results)
    atomic_write_text(given.output / "calibration.csv", found.to_csv(index=False))
    print(found.to_string(index=False, float_format=lambda v: f"{v:.4g}"))


if __name__ == "__main__":
    run_as_imported("studies.hidden.calibration")
