"""Tidy tables: one row per policy, and one per measurement of accuracy."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from simgap_files.atomic import atomic_path, atomic_write_text, write_sealed
from studies.learnt.errors import ENDS
from studies.learnt.words import measures_of, returns_by_start

#: The column with a policy's returns on the true system by where they began.
BY_START = "by_start"

# Policies of trials that differ in these only are the same, or stand in rows of their own.
_IN_COLUMNS = {
    "seed", "budget.true_samples", "budget.iterations", "budget.true_steps",
    "budget.baseline_steps", "budget.control_steps", "budget.corrected_steps",
}  # fmt: skip


def write_tables(results: Sequence[Mapping[str, Any]], folder: Path) -> None:
    """``results`` and ``accuracy`` as CSV and Parquet, and ``results.json`` with all trials.

    Args:
        results: Of every finished trial.
        folder: Where to write.
    """
    for name, table in zip(("results", "accuracy"), tables_of(results), strict=True):
        table = table.drop(columns=BY_START, errors="ignore")
        atomic_write_text(folder / f"{name}.csv", table.to_csv(index=False))
        with atomic_path(folder / f"{name}.parquet") as path:
            table.to_parquet(path, index=False)
    write_sealed(folder / "results.json", {"trials": list(results)})


def tables_of(results: Sequence[Mapping[str, Any]]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """One row per policy of every trial, and one per measurement of accuracy."""
    named = apart(results)
    return policy_rows(named), accuracy_rows(named)


def apart(results: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The trials, those with other settings told apart by their label.

    A mean over the trials of one label must not mix settings. Whatever differs between trials,
    beside what the tables have columns for, becomes part of the label and is kept as
    ``settings``. Those learnt from Python have neither label, seed nor settings.
    """
    plain: dict[str, Any] = {"label": "difference model", "seed": 0, "config": {}}
    trials = [plain | dict(trial) for trial in results]
    flat = [_flat(trial["config"]) for trial in trials]
    names = dict.fromkeys(name for settings in flat for name in settings)
    differing = [
        name
        for name in names
        if name.split(".")[0] not in ("estimator", "corrected")
        and name not in _IN_COLUMNS
        and len({json.dumps(settings.get(name)) for settings in flat}) > 1
    ]
    named = []
    for trial, settings in zip(trials, flat, strict=True):
        text = ", ".join(f"{name}={settings.get(name)}" for name in differing)
        more = {"label": f"{trial['label']}, {text}", "settings": text} if text else {}
        named.append(trial | more)
    return named


def _flat(settings: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in settings.items():
        nested = isinstance(value, Mapping)
        flat |= _flat(value, f"{prefix}{name}.") if nested else {f"{prefix}{name}": value}
    return flat


#: What a policy's record has lists of.
_LISTS = ("curve", "tests", "warnings")


def policy_rows(results: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """One row per policy of every trial, with its returns by start."""
    return pd.DataFrame(
        [
            _trial(trial) | _policy(policy) | {BY_START: returns_by_start(policy)}
            for trial in results
            for policy in trial["policies"]
        ]
    )


def policy_frame(policies: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """One row per policy of one trial."""
    return pd.DataFrame([_policy(policy) for policy in policies])


def _policy(record: Mapping[str, Any]) -> dict[str, Any]:
    """A policy's record without its curve, and with the means of its tests by measure."""
    flat = {name: value for name, value in record.items() if name not in _LISTS}
    return flat | measures_of(record)


def accuracy_rows(results: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """One row per trial, update and place where accuracy was measured."""
    return pd.DataFrame(
        [
            _trial(trial)
            | {
                "iteration": record["iteration"],
                "true_samples": record["true_samples"],
                "where": where,
                "fit_seconds": record["fit_seconds"],
                "coverage90": record[where]["coverage90"],
                **{f"one_step_{k}": v for k, v in record[where]["one_step"].items()},
                **{f"gap_{k}": v for k, v in record[where].get("gap", {}).items()},
                **{
                    f"{end}_{k}": ends[i]
                    for k, ends in record[where].get("one_step_95", {}).items()
                    for i, end in enumerate(ENDS)
                },
                **{
                    f"{horizon.replace(' ', '')}_{k}": v
                    for horizon, errors in record[where]["multi_step"].items()
                    for k, v in errors.items()
                },
            }
            for trial in results
            for record in trial["accuracy"]
            for where in ("visited", "uniform")
            if where in record
        ]
    )


def _trial(trial: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "estimator": trial["label"],
        "seed": trial["seed"],
        "samples_per_update": trial["config"].get("budget", {}).get("true_samples"),
        "made_by": trial.get("versions", {}).get("simgap", ""),
        **({"settings": trial["settings"]} if "settings" in trial else {}),
    }
