"""One trial of a study: the loop, and the files that it leaves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import threadpoolctl
import torch

from studies.learning.loop import learn_by_difference
from studies.learning.settings import instantiate
from studies.learning.stages import Stages
from studies.learning.study import Config, GapStudy
from studies.running.command import class_label, versions
from studies.running.files import copy_file
from studies.running.progress import Progress


def run_trial(
    study: GapStudy, config: Config, folder: Path, stages: Stages, progress: Progress
) -> dict[str, Any]:
    """One trial of a study.

    Args:
        study: Which one.
        config: The settings of the study's trial as plain values, as the parser dumps them.
        folder: For policies, models and rollouts.
        stages: Where finished steps are kept and found again.
        progress: Told of every step.

    Returns:
        What ``results.json`` holds (docs/results.md).
    """
    # One thread is fastest at these sizes and leaves the other cores to other trials.
    torch.set_num_threads(1)
    threadpoolctl.threadpool_limits(1)
    trial = instantiate(study, config)
    outcome = learn_by_difference(
        study.problem(trial, study.describe(config)),
        trial.estimator,
        trial.budget,
        trial.ddpg,
        trial.seed,
        stages,
        progress,
        trial.caution,
        trial.replay,
        config["corrected"],
    )
    for name, source in outcome.folders.items():
        copy_file(source / "agent.safetensors", folder / "policies" / f"{name}.safetensors")
        copy_file(source / "rollout.npz", folder / "rollouts" / f"{name}.npz")
    for number, source in enumerate(outcome.models, start=1):
        if (saved := source / "difference.safetensors").exists():
            copy_file(saved, folder / "models" / f"difference-{number}.safetensors")
    return {
        "system": study.system,
        "estimator": config["estimator"]["class_path"],
        "label": class_label(config["estimator"]),
        "seed": trial.seed,
        "policies": outcome.policies,
        "accuracy": outcome.accuracy,
        "config": config,
        "versions": versions(),
    }
