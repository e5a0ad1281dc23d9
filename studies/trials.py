"""Trials: independent cells of a study, each a pure function of its configuration.

A trial's folder is named by what it computes and a hash of its configuration. Finished trials
are read, not run again; a failed one leaves its traceback and is reported, never averaged.
"""

from __future__ import annotations

import hashlib
import json
import traceback
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed

from studies.files import atomic_write_json, atomic_write_text, read_json
from studies.progress import Progress

Config = Mapping[str, Any]
Work = Callable[[Config, Path], dict[str, Any]]


def trial_folder(root: Path, label: str, config: Config) -> Path:
    """Where a trial keeps its result."""
    text = json.dumps(config, sort_keys=True, default=str)
    return root / f"{label}-{hashlib.sha256(text.encode()).hexdigest()[:8]}"


def run_trials(
    trials: Mapping[Path, Config], work: Work, jobs: int, progress: Progress
) -> tuple[list[dict[str, Any]], dict[Path, str]]:
    """Run what is not finished yet, in ``jobs`` local processes.

    Args:
        trials: Configuration by folder.
        work: Computes one trial into its folder and returns its results; importable by name.
        jobs: Worker processes, each with one thread.
        progress: Told how many are done.

    Returns:
        The results of all finished trials in the order given, and the tracebacks of those
        that failed by folder.
    """
    waiting = {folder: config for folder, config in trials.items() if not _finished(folder)}
    failures: dict[Path, str] = {}
    with progress.task(f"{len(trials)} trials", len(trials)) as tell:
        done = len(trials) - len(waiting)
        tell(done, "")
        # Ready results come back at once, so that the bar moves and failures are seen early.
        finished = Parallel(n_jobs=jobs, return_as="generator_unordered")(
            delayed(_attempt)(work, config, folder) for folder, config in waiting.items()
        )
        for folder, failure in finished:
            if failure:
                failures[folder] = failure
            done += 1
            tell(done, f"{len(failures)} failed" if failures else "")
    results = [read_json(folder / "results.json") for folder in trials if _finished(folder)]
    return results, failures


def _attempt(work: Work, config: Config, folder: Path) -> tuple[Path, str | None]:
    error = folder / "error.txt"
    try:
        results = work(config, folder)
    except Exception:
        atomic_write_text(error, failure := traceback.format_exc())
        return folder, failure
    atomic_write_json(folder / "results.json", results)
    error.unlink(missing_ok=True)
    return folder, None


def _finished(folder: Path) -> bool:
    return (folder / "results.json").exists()


def tidy(results: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """One flat row per policy of every trial, for a table or a data frame."""
    return [
        {
            "estimator": trial["label"],
            "seed": trial["seed"],
            "samples_per_update": trial["config"]["budget"]["true_samples"],
            **{name: value for name, value in policy.items() if name != "curve"},
        }
        for trial in results
        for policy in trial["policies"]
    ]
