"""What the loop leaves behind: policies and models, and a record of each."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from studies.running.files import read_json

Record = dict[str, Any]


@dataclasses.dataclass(frozen=True)
class Outcome:
    """What the loop leaves behind.

    Attributes:
        policies: One record per policy, in the order learnt (docs/results.md).
        accuracy: One record per update of the difference model.
        folders: Folder of each policy, by a name such as ``"idealised"``, ``"difference-1"``.
        models: Folder of each difference model, one per update.
    """

    policies: list[Record]
    accuracy: list[Record]
    folders: dict[str, Path]
    models: list[Path]


def policy_record(folder: Path, name: str, within: int | None = None) -> Record:
    """The record of a policy for ``results.json``.

    Args:
        folder: Of the policy.
        name: ``"idealised"``, ``"difference"``, ``"control"``, ``"corrected"``, ``"true"``,
            ``"cold"`` or ``"warm"``.
        within: For policies learnt on the true system: read the experiment as if it had
            ended after so many true samples.
    """
    summary = read_json(folder / "summary.json")
    curve = read_json(folder / "curve.json")
    if within is not None:
        curve = [point for point in curve if point["step"] <= within]
    common = {
        "name": name,
        "iteration": 0,
        "true_samples": within or 0,
        "curve": [[point["step"], point["deterministic"]] for point in curve],
    }
    if within is None:
        return common | summary
    best = max(curve, key=lambda point: point["score"])["deterministic"]
    share = within / summary["simulated_steps"]
    # At the full length the policy itself is there, and was tested as all others.
    whole = {k: summary[k] for k in ("return_true", "tests") if k in summary and share == 1}
    return {
        **common,
        "simulated_steps": 0,
        "return_true": best,
        **whole,
        "return_model": best,
        "seconds": summary["seconds"] * share,
    }


def record_key(record: Mapping[str, Any]) -> str:
    """Name of a policy's files."""
    name = record["name"]
    return f"{name}-{record['iteration']}" if name in ("difference", "control") else name
