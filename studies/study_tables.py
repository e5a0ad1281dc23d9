"""The tidy tables of a gap study: one row per policy, and one per measurement of accuracy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from studies.files import atomic_path, atomic_write_json, atomic_write_text


def write_tables(
    results: Sequence[Mapping[str, Any]], folder: Path
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """``results`` and ``accuracy`` as CSV and Parquet, and ``results.json`` with all trials.

    Args:
        results: Of every finished trial.
        folder: Where to write.

    Returns:
        The two tables.
    """
    rows, errors = policy_rows(results), accuracy_rows(results)
    for name, table in (("results", rows), ("accuracy", errors)):
        atomic_write_text(folder / f"{name}.csv", table.to_csv(index=False))
        with atomic_path(folder / f"{name}.parquet") as path:
            table.to_parquet(path, index=False)
    atomic_write_json(folder / "results.json", {"trials": list(results)})
    return rows, errors


def policy_rows(results: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """One row per policy of every trial."""
    return pd.DataFrame(
        [_trial(trial) | _policy(policy) for trial in results for policy in trial["policies"]]
    )


def _policy(record: Mapping[str, Any]) -> dict[str, Any]:
    """A policy's record without its curve, and with the means of its tests by measure."""
    flat = {name: value for name, value in record.items() if name not in ("curve", "tests")}
    tests = pd.DataFrame(record.get("tests", [])).drop(columns="return", errors="ignore")
    return flat | tests.mean().to_dict()


def accuracy_rows(results: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """One row per trial, update and place where accuracy was measured."""
    return pd.DataFrame(
        [
            _trial(trial)
            | {
                "iteration": record["iteration"],
                "where": where,
                "fit_seconds": record["fit_seconds"],
                "coverage90": record[where]["coverage90"],
                **{f"one_step_{k}": v for k, v in record[where]["one_step"].items()},
                **{
                    f"{horizon.replace(' ', '')}_{k}": v
                    for horizon, errors in record[where]["multi_step"].items()
                    for k, v in errors.items()
                },
            }
            for trial in results
            for record in trial["accuracy"]
            for where in ("visited", "uniform")
        ]
    )


def _trial(trial: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "estimator": trial["label"],
        "seed": trial["seed"],
        "samples_per_update": trial["config"]["budget"]["true_samples"],
    }
