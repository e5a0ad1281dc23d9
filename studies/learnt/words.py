"""What a study left, in words: policies by name, times."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

Results = Mapping[str, Any]
Record = Mapping[str, Any]
#: A state, and which of the tests from it.
Start = tuple[tuple[float, ...], int]

POLICY_WORDS = {
    "idealised": "idealised policy",
    "difference": "difference model, update {iteration}",
    "control": "no difference model, update {iteration}",
    "corrected": "simulator corrected by name",
    "true": "learnt on the true system",
    "cold": "cold start",
    "warm": "warm start",
}
# The share of the way from the idealised to the true policy's return that counts as all of it.
NEAR = 0.9


def policy_name(record: Record) -> str:
    """A policy in words."""
    return POLICY_WORDS[record["name"]].format(**record)


def measures_of(record: Record) -> dict[str, float]:
    """The mean of a policy's tests on the true system, by measure."""
    table = pd.DataFrame(record.get("tests", []))
    table = table.drop(columns=["return", "start"], errors="ignore")
    return {str(name): float(value) for name, value in table.mean().items()}


def returns_by_start(record: Record) -> dict[Start, float]:
    """The returns of a policy's tests on the true system by the state that they began in.

    A test that was the same as another one in all counts once; where chance gave another return
    from the same state, each is told apart by its number. An earlier version did not keep states.
    """
    found: dict[Start, float] = {}
    for test in record.get("tests", []):
        again = [key for key in found if key[0] == tuple(test.get("start", ()))]
        if "start" in test and test["return"] not in [found[key] for key in again]:
            found[tuple(test["start"]), len(again)] = test["return"]
    return found


def duration(seconds: float) -> str:
    """A time that a reader can grasp."""
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.1f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"


def shown(results: Results) -> dict[str, str]:
    """The policies that pictures and films show: name of their files, and in words."""
    names = ("idealised", "difference", "corrected", "true")
    last = {record["name"]: record for record in results["policies"]}
    return {record_key(last[name]): policy_name(last[name]) for name in names if name in last}


def record_key(record: Record) -> str:
    """Name of a policy's files."""
    name = record["name"]
    return f"{name}-{record['iteration']}" if name in ("difference", "control") else name


def counted(count: int, what: str) -> str:
    """So many of something: ``"1 trial"``, ``"3 trials"``."""
    return f"{count} {what}{'s' * (count != 1)}"
