"""One trial of a study: its settings as options, the loop, and the files that it leaves."""

from __future__ import annotations

import hashlib
import importlib.util
import json
from pathlib import Path
from typing import Any

import threadpoolctl
from jsonargparse.typing import NonNegativeFloat

from policy.learner import other_name
from residual.logs.writing import write_log
from residual.persistence import is_ours, save
from simgap_files.npz import write_npz
from studies.learning.described import modules_in, settings_of
from studies.learning.fingerprint import fingerprint
from studies.learning.kept import OnDisk
from studies.learning.loop import run_loop
from studies.learning.output import keep_only
from studies.learning.sources import code_of
from studies.learning.steps import Steps
from studies.learning.study import Config, Study, Trial
from studies.running.command import Parser
from studies.running.grids import class_label
from studies.running.progress import Progress
from studies.running.trials import Execution
from studies.running.versions import versions

#: Settings under their earlier names.
ALIASES = {"caution": "uncertainty_penalty"}


def build_parser(study: Study) -> Parser:
    """The command line of a study."""
    parser = Parser(prog=f"python -m studies.{study.name}", description=study.description)
    parser.add_argument("--config", action="config", help="YAML file with any of the settings.")
    parser.add_argument(
        "--output",
        type=Path | None,
        default=None,
        help=f"Folder for the results; default: results/{study.name}/ and a name.",
    )
    parser.add_class_arguments(Execution)
    parser.add_argument(
        "--grid",
        type=list[dict[str, list[Any]]] | None,
        default=None,
        help="For config files: blocks of settings and the values they take; one trial for each "
        "combination within a block.",
    )
    penalty = "uncertainty_penalty"
    parser.add_class_arguments(study.trial, sub_configs=True, skip={penalty})
    parser.add_argument(
        f"--{penalty}",
        "--caution",
        type=NonNegativeFloat,
        default=0.0,
        help="Reward lost per step, on the corrected simulator, for each multiple of the "
        "difference model's typical standard deviation; 0 learns as in the paper.",
    )
    parser.set_defaults(estimator={"class_path": study.estimator})
    return parser


def instantiate(study: Study, config: Config) -> Trial:
    """The trial that plain settings describe; exits with one line if they are wrong."""
    parser = build_parser(study)
    chosen = parser.instantiate(parser.parse_object(config))
    return study.trial(**{name: chosen[name] for name in study.settings})


def resolve(study: Study, config: Config) -> dict[str, Any]:
    """``config`` with every default filled in, checked by the parser."""
    parser = build_parser(study)
    settings = parser.plain(parser.parse_object(config))
    return {name: settings[name] for name in study.settings}


def trial_label(config: Config) -> str:
    """A readable name for a trial's folder."""
    estimator = config["estimator"]["class_path"].rsplit(".", 1)[-1]
    samples = f"{estimator}-{config['budget']['true_samples']}-seed{config['seed']}"
    name = "-".join(filter(None, [other_name(config.get("learner")), samples]))
    # One file may hold several systems: arm.SYSTEM and arm.LAGGED.
    system = ".".join(str(config.get("system") or "").split(".")[-2:])
    return f"{system}-{name}" if system else name


def run_trial(
    study: Study, kept: Path, config: Config, folder: Path, progress: Progress
) -> dict[str, Any]:
    """One trial of a study.

    Args:
        study: Which one.
        kept: Where finished steps are kept and found again.
        config: The settings of the study's trial as plain values, as the parser dumps them.
        folder: For policies, models and rollouts.
        progress: Told of every step.

    Returns:
        What ``results.json`` holds (docs/results.md).
    """
    # One thread is fastest at these sizes and leaves the other cores to other trials.
    import torch  # seconds to load

    torch.set_num_threads(1)
    threadpoolctl.threadpool_limits(1)
    trial = instantiate(study, config)
    steps = Steps(
        study.system_of(trial),
        trial.estimator,
        trial.algorithm,
        trial.seed,
        OnDisk(kept),
        progress,
        trial.replay,
        trial.uncertainty_penalty,
        trial.smoothing,
        study.scaled,
        study.describe(config),
    )
    # What was there before anything ran, not what running may have changed.
    made_by = code_of_trial(study, config)
    learnt = run_loop(steps, trial.budget, trial.corrected)
    for name, training in learnt.trainings.items():
        training.learner.save(folder / "policies" / f"{name}.safetensors")
        write_npz(folder / "rollouts" / f"{name}.npz", training.episode)
    nominal = steps.system.nominal
    for run in learnt.runs:
        path = folder / "samples" / f"{run.name}.csv"
        write_log(path, run, nominal.state_channels, nominal.action_channels)
    saved = []
    for number, model in enumerate(learnt.models, start=1):
        # Another library's estimator needs skops, which may not be there.
        if is_ours(model.fitted()) or importlib.util.find_spec("skops"):
            saved.append(f"difference-{number}")
            save(model, folder / "models" / f"{saved[-1]}.safetensors")
    for kind in ("policies", "rollouts"):
        keep_only(folder / kind, learnt.trainings)
    keep_only(folder / "models", saved)
    keep_only(folder / "samples", [run.name for run in learnt.runs])
    return {
        "study": study.name,
        **learnt.results(),
        "estimator": config["estimator"]["class_path"],
        "label": class_label(config["estimator"]),
        "seed": trial.seed,
        "config": config,
        "versions": versions(),
        "made_by": made_by,
    }


def code_of_trial(study: Study, config: Config) -> str:
    """A hash of what a trial's result comes from: when it changes, the result is not right."""
    trial = instantiate(study, config)
    system = study.system_of(trial)
    corrected = [] if trial.corrected is None else [trial.corrected]
    settings = [fingerprint(system), settings_of(trial.estimator), settings_of(corrected)]
    roots = [run_trial, study.trial, study.system, *system.code(), trial.algorithm.kind()]
    code = code_of(*roots, *sorted(modules_in(settings)))
    told = json.dumps([settings, code], sort_keys=True)
    return hashlib.sha256(told.encode()).hexdigest()
