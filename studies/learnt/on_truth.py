"""What the true system was run for beside the samples, and what it warned of."""

from __future__ import annotations

from collections.abc import Sequence

from studies.learnt.words import Results, duration
from studies.reporting.sections import Section, Verdict


def beside_samples(results: Sequence[Results]) -> str:
    """How long the true system ran in tests and for accuracy, mean of the trials, in words.

    No policy learns from that, but somebody has to run it; empty if an earlier version did not
    count it.
    """
    taken = [
        sum(policy.get("tested_steps", 0) for policy in trial["policies"])
        + sum(record.get("rollout_steps", 0) for record in trial["accuracy"])
        for trial in results
    ]
    mean = sum(taken) / max(len(taken), 1)
    return duration(mean * results[0]["about"]["dt"]) if mean else ""


def warnings_section(results: Sequence[Results]) -> list[Section]:
    """What the true system warned of while policies were tested on it, if anything."""
    told = [
        warning
        for trial in results
        for policy in trial["policies"]
        for warning in policy.get("warnings", [])
    ]
    if not told:
        return []
    first, *more = dict.fromkeys(told)
    return [Verdict(_sentence(first), " ".join(map(_sentence, more)), "warning", "mind")]


def _sentence(warning: str) -> str:
    return f"{warning[0].upper()}{warning[1:]}."
