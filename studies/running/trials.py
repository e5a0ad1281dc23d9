"""Trials: independent cells of a study, each a pure function of its configuration.

A trial's folder is named by what it computes and a hash of its configuration. Finished trials
are read, not run again; a failed one leaves its traceback and is reported, never averaged.
``study.json`` beside the folders names those that the last command asked for.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
import logging
import sys
import traceback
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from jsonargparse.typing import PositiveInt

from simgap_files.atomic import atomic_write_text, read_sealed, write_sealed
from studies.running.progress import Curves, Progress, Several
from studies.running.watching import STATUS, StatusFile, TrialsView
from studies.running.workers import Backend, Config, workers

Work = Callable[[Config, Path, Progress], dict[str, Any]]
Failures = dict[Path, str]
PLAN = "study.json"
RESULTS = "results.json"
_log = logging.getLogger("simgap")


@dataclasses.dataclass(frozen=True)
class Execution:
    """How trials are run; nothing here changes what they compute.

    Args:
        backend: Where many trials run: in local processes or on a cluster (docs/scaling.md).
        jobs: Local processes for many trials.
        scheduler: Address of the cluster's scheduler, such as tcp://host:8786.
        tensorboard: Folder for training curves; tensorboard --logdir shows them.
    """

    backend: Backend = "local"
    jobs: PositiveInt = 1
    scheduler: str | None = None
    tensorboard: Path | None = None


def trial_folder(root: Path, label: str, config: Config) -> Path:
    """Where a trial keeps its result."""
    text = json.dumps(config, sort_keys=True, default=str)
    return root / f"{label}-{hashlib.sha256(text.encode()).hexdigest()[:8]}"


def run_trials(
    study: str,
    trials: Mapping[Path, Config],
    work: Work,
    execution: Execution,
    made_by: Mapping[Path, str] | None = None,
) -> tuple[list[dict[str, Any]], Failures]:
    """Run what is not finished yet.

    Args:
        study: Name of the study, for ``study.json``.
        trials: Configuration by folder, all in one folder.
        work: Computes one trial into its folder and returns its results; importable by name.
        execution: Where to run them.
        made_by: By folder, what its result should say under ``made_by``; one of other code does
            not count as finished.

    Returns:
        See ``read_trials``.

    Raises:
        WorkersError: The cluster cannot be used.
    """
    # Workers of a cluster may have another working directory.
    trials = {folder.resolve(): config for folder, config in trials.items()}
    codes = {folder.resolve(): code for folder, code in (made_by or {}).items()}
    for folder in trials:
        _set_aside_damaged(folder)
    waiting = {
        folder: config
        for folder, config in trials.items()
        if not _finished(folder, codes.get(folder))
    }
    for folder in waiting:
        (folder / RESULTS).unlink(missing_ok=True)
    root = next(iter(trials)).parent
    attempt = functools.partial(attempt_trial, work, execution.tensorboard)
    with workers(execution.backend, execution.jobs, execution.scheduler) as run:
        plan = {"study": study, "trials": {path.name: config for path, config in trials.items()}}
        write_sealed(root / PLAN, plan)
        for folder in waiting:
            for left in (STATUS, "error.txt"):
                (folder / left).unlink(missing_ok=True)
        with TrialsView(waiting, len(trials)) as view:
            for folder, failure in run(attempt, spread_seeds(waiting)):
                if failure and not _finished(folder):
                    # Its worker could not say so.
                    atomic_write_text(folder / "error.txt", failure)
                    (folder / STATUS).unlink(missing_ok=True)
                view.ended(folder, bool(failure))
    return read_trials(root)


def read_trials(root: Path) -> tuple[list[dict[str, Any]], Failures]:
    """What the trials of a study left, without running anything.

    Args:
        root: The study's folder; ``study.json`` there names the trials that count.

    Returns:
        The results of all finished trials in the order of the plan, and the tracebacks of
        those that failed by folder.

    Raises:
        FileNotFoundError: There is no such file.
    """
    results: list[dict[str, Any]] = []
    failures: Failures = {}
    for folder in [root / name for name in read_sealed(root / PLAN)["trials"]]:
        path, error = folder / RESULTS, folder / "error.txt"
        if _finished(folder):
            results.append(read_sealed(path))
        elif path.exists():
            failures[folder] = f"{path} is damaged: give the command of the study again\n"
        elif error.exists():
            failures[folder] = error.read_text(encoding="utf-8")
    return results, failures


def tell_failures(failures: Failures) -> None:
    """A line on stderr for each trial that failed: what went wrong, and where all of it stands."""
    for folder, failure in failures.items():
        reason = failure.strip().splitlines()[-1]
        print(f"failed: {folder}: {reason} (see error.txt there)", file=sys.stderr)


def attempt_trial(work: Work, tensorboard: Path | None, config: Config, folder: Path) -> str | None:
    """Compute one trial into its folder: ``results.json``, or ``error.txt`` if it fails.

    Returns:
        The traceback if it failed.
    """
    if _finished(folder):  # clusters repeat what a lost worker had just finished
        return None
    status = StatusFile(folder)
    curves = [Curves(tensorboard / folder.name)] if tensorboard else []
    try:
        results = work(config, folder, Several(status, *curves))
        write_sealed(folder / RESULTS, results)
    except (Exception, SystemExit):  # SystemExit would take a cluster's worker with it
        atomic_write_text(folder / "error.txt", failure := traceback.format_exc())
        return failure
    finally:
        status.remove()
    (folder / "error.txt").unlink(missing_ok=True)
    return None


def spread_seeds(trials: Mapping[Path, Config]) -> dict[Path, Config]:
    """The same trials, those of one seed apart from one another.

    Trials of one seed begin with the same stages. Started together, all but one would wait.
    """
    seen: Counter[Any] = Counter()
    turns = {}
    for folder, config in trials.items():
        turns[folder] = seen[config.get("seed")]
        seen[config.get("seed")] += 1
    return {folder: trials[folder] for folder in sorted(trials, key=turns.__getitem__)}


def _finished(folder: Path, code: str | None = None) -> bool:
    """Whether results are there, whole and, if a hash is given, of this code."""
    try:
        made_by = read_sealed(folder / RESULTS).get("made_by")
    except (OSError, ValueError):
        return False
    return not code or made_by == code


def _set_aside_damaged(folder: Path) -> None:
    path = folder / RESULTS
    if path.exists() and not _finished(folder):
        aside = path.with_suffix(".damaged")
        path.replace(aside)
        _log.warning("%s is damaged: set aside as %s, computed anew", path, aside)
