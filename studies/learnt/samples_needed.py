"""How many true samples each method needs until a return."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from studies.learnt.statistics import mean
from studies.learnt.words import NEAR, POLICY_WORDS, Results
from studies.reporting.sections import Section, Table


def samples_section(
    once: pd.DataFrame, results: Sequence[Results], about: Mapping[str, Any]
) -> list[Section]:
    """True samples until the target, and until most of what the true policy gains.

    Args:
        once: Every policy once.
        results: Of every trial.
        about: The system.
    """
    returns = once.groupby("name")["return_true"].mean()
    targets = {f"{about['target']:g}": about["target"]} if about["target"] is not None else {}
    if "true" in returns:
        near = float(returns["idealised"] + NEAR * (returns["true"] - returns["idealised"]))
        targets[f"{near:.4g} ({NEAR:.0%} of what learning on the true system gains)"] = near
    table = []
    for words, target in targets.items():
        for method, reached in samples_to(target, results).items():
            values = [value for value in reached.values() if value is not None]
            table.append([
                words, POLICY_WORDS.get(method, method), str(mean(values)) if values else None,
                f"{len(values)} of {len(reached)}",
            ])  # fmt: skip
    if not table:
        return []
    return [
        Table(
            ["return", "method", "true samples", "seeds that reached it"],
            table,
            caption="Cold and warm start are tested as they learn without being charged for it; "
            "the first test at or above the return counts. For a difference model the fewest "
            "samples count after which it got there. Zero: the idealised policy is there already.",
            heading="Samples to a return",
        )
    ]


def samples_to(target: float, results: Sequence[Results]) -> dict[str, dict[int, int | None]]:
    """By method and seed, the true samples after which ``target`` was first reached."""
    reached: dict[str, dict[int, list[int]]] = {}
    for trial in results:
        at: dict[str, list[int]] = {f"difference model, {trial['label']}": []}
        for record in trial["policies"]:
            if record["name"] in ("cold", "warm"):
                steps = [step for step, value in record["curve"] if value >= target]
                at.setdefault(record["name"], []).extend(steps)
            elif record["name"] in ("idealised", "difference") and record["return_true"] >= target:
                next(iter(at.values())).append(record["true_samples"])
        for method, values in at.items():
            reached.setdefault(method, {}).setdefault(trial["seed"], []).extend(values)
    return {
        method: {seed: min(values, default=None) for seed, values in by_seed.items()}
        for method, by_seed in reached.items()
    }
