"""The report of one Leo trial: verdict, films, tables."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from studies.learning.outcome import record_key
from studies.learning.records import (
    Results,
    accuracy_line,
    by_name,
    last_difference,
    load_rollouts,
    policies_section,
    policy_name,
    provenance,
)
from studies.leo.figures import (
    CONTROL_PERIOD,
    FILM_SECONDS,
    curves_figure,
    film,
    torso_figure,
    updates_figure,
)
from studies.leo.groups import GROUPS, grouped, overall
from studies.reporting import (
    Animation,
    Figure,
    Gallery,
    KeyValues,
    Prose,
    Report,
    Section,
    Table,
    Verdict,
)
from studies.reporting.sections import Cell

NEAR = 0.9  # the share of the true-model policy's return that counts as closing the gap


def averaged(record: Mapping[str, Any]) -> dict[str, float]:
    """The mean of a policy's tests on the true system, by measure."""
    return {str(name): float(value) for name, value in pd.DataFrame(record["tests"]).mean().items()}


def policy_table(results: Results) -> str:
    """The policies as text for the terminal."""
    rows = []
    for record in results["policies"]:
        row = {
            "policy": policy_name(record),
            "true samples": record["true_samples"],
            "return on its model": round(record["return_model"]),
            "return on the truth": round(record["return_true"]),
        }
        if "tests" in record:
            tests = averaged(record)
            row |= {
                "distance m": round(tests["distance"], 1),
                "falls": f"{sum(test['fell'] for test in record['tests']):.0f} of "
                f"{len(record['tests'])}",
            }
        rows.append(row)
    lines = [pd.DataFrame(rows).to_string(index=False, na_rep="")]
    lines += [
        accuracy_line(record, grouped(record["visited"]["one_step"]), 2)
        for record in results["accuracy"]
    ]
    return "\n".join(lines)


def write_report(results: Results, folder: Path) -> Path:
    """Figures as PNG with their numbers as CSV, and ``report.html``, into ``folder``.

    Args:
        results: What ``results.json`` holds.
        folder: The trial's folder, with ``rollouts/``.
    """
    titles = {record_key(record): policy_name(record) for record in results["policies"]}
    rollouts = load_rollouts(results, folder)
    learnt = last_difference(results)
    shown = ["idealised", *([record_key(learnt)] if learnt else []), "corrected", "true"]
    shown = [key for key in shown if key in rollouts]
    figures = folder / "figures"
    sections: list[Section] = [
        verdict(results),
        tiles(results),
        Gallery(
            [
                Animation(
                    film(rollouts[key]["states"]),
                    alt=f"Leo on the true system under the policy: {titles[key]}.",
                    caption=titles[key],
                )
                for key in shown
            ],
            caption=f"The first {FILM_SECONDS:g} s on the **true** Leo.",
            heading="Walking",
        ),
        Figure(
            torso_figure({titles[key]: rollouts[key] for key in shown}, figures / "torso.png"),
            "Distance, height and pitch of the torso over time for each policy.",
            "On the true Leo, from one start (paper, figures 7 and 9). A line ends where "
            "the robot falls.",
            heading="The torso's way",
        ),
        *updates_section(results, figures),
        Figure(
            curves_figure(results, figures / "curves.png"),
            "Return on the training model against simulated steps.",
            "Tests on the model that each policy learns on; the best of them is kept.",
            heading="Learning curves",
        ),
        policies_section(results),
        walking_section(results),
        accuracy_section(results),
        *provenance(results),
    ]
    return Report(
        "Leo: walking across the simulation gap",
        f"{results['label']}, seed {results['seed']}",
        sections,
    ).write(folder / "report.html")


def verdict(results: Results) -> Verdict:
    """Did it work, in one sentence, and was it the difference model's doing?"""
    idealised = results["policies"][0]["return_true"]
    learnt, true, control = last_difference(results), by_name(results, "true"), by_name(
        results, "control"
    )  # fmt: skip
    named = by_name(results, "corrected")
    if learnt is None and named:
        after = named[0]["return_true"]
        return Verdict(
            f"On the true Leo the return went from {idealised:.0f} to {after:.0f}, without a "
            "true sample.",
            "The policy was trained on the simulator with what find_gap named.",
            tone="good" if after > idealised else "warning",
            label="gap closed" if after > idealised else "not settled",
        )
    if learnt is None:
        return Verdict(
            f"Trained on the simulator alone, the policy returns {idealised:.0f} on the true Leo.",
            tone="neutral",
        )
    after = learnt["return_true"]
    parts = [f"It took {learnt['true_samples']} true samples, "
             f"{learnt['true_samples'] * CONTROL_PERIOD / 60:.1f} min."]  # fmt: skip
    closed = after > idealised
    if control:
        alone = control[-1]["return_true"]
        # One run each: less than half of the gain is no contest.
        earned = alone - idealised < (after - idealised) / 2
        parts.append(
            f"As much training without the difference model ends at {alone:.0f}: the gain is "
            + ("the model's doing." if earned else "not shown to be the model's doing.")
        )
        closed = closed and earned
    if true:
        best = true[-1]["return_true"]
        parts.append(f"A policy learnt on the true system returns {best:.0f}.")
        closed = closed and after >= NEAR * best
    return Verdict(
        f"On the true Leo the return went from {idealised:.0f} to {after:.0f}.",
        " ".join(parts),
        tone="good" if closed else "warning",
        label="gap closed" if closed else "not settled",
    )


def updates_section(results: Results, figures: Path) -> list[Section]:
    """The return per update, if there were any."""
    if not (by_name(results, "difference") or by_name(results, "control")):
        return []
    return [
        Figure(
            updates_figure(results, figures / "updates.png"),
            "Return on the true Leo after each update, with and without the difference model.",
            "Mean of the tests on the true Leo. The control has trained as long, without the "
            "difference model.",
            heading="Return by update",
        )
    ]


def tiles(results: Results) -> KeyValues:
    """The headline numbers."""
    items: dict[str, Any] = {}
    learnt = last_difference(results)
    for record in (results["policies"][0], learnt, *by_name(results, "corrected")):
        if record:
            tests = averaged(record)
            items[f"{policy_name(record)}, distance"] = f"{tests['distance']:.1f} m"
            items[f"{policy_name(record)}, falls"] = (
                f"{sum(test['fell'] for test in record['tests']):.0f} of {len(record['tests'])}"
            )
    return KeyValues(items, style="tiles")


def walking_section(results: Results) -> Table:
    """Distance, work and falls on the true system (the paper's Table III)."""
    rows: list[list[Cell]] = []
    for record in results["policies"]:
        if "tests" in record:
            tests = averaged(record)
            rows.append([
                policy_name(record), tests["return"], tests["distance"], tests["work_per_metre"],
                tests["bare_work_per_metre"], tests["seconds"],
                sum(int(test["fell"]) for test in record["tests"]),
            ])  # fmt: skip
    count = len(results["policies"][0]["tests"])
    return Table(
        ["policy", "return", "distance m", "E J/m", "E J/m, bare motor constant", "seconds",
         "falls"],
        rows,
        caption=f"Means over {count} starts on the true Leo. E is the motor work per metre, with "
        "the motor constant at the joint, and with that of the bare motor as the paper's numbers "
        "suggest (docs/deviations.md).",
        heading="How it walks",
    )  # fmt: skip


def accuracy_section(results: Results) -> Table | Prose:
    """One-step and multi-step error by channel group."""
    if not results["accuracy"]:
        return Prose("No difference model was learnt.", heading="Accuracy")
    rows: list[list[Cell]] = []
    horizons = list(results["accuracy"][0]["visited"]["multi_step"])
    for record in results["accuracy"]:
        for where in ("visited", "uniform"):
            measured = record[where]
            rows.append([
                record["iteration"], where,
                *(grouped(measured["one_step"]).get(name) for name in GROUPS),
                *(overall(measured["multi_step"].get(horizon, {})) for horizon in horizons),
                measured["coverage90"],
                record["fit_seconds"],
            ])  # fmt: skip
    return Table(
        ["update", "states", *GROUPS, *(f"all, {h}" for h in horizons), "90 % coverage", "fit s"],
        rows,
        caption="Errors as shares of the gap without the model, along the first seconds of fresh "
        "rollouts of the policy trained on the model, and from random poses.",
        heading="Accuracy",
    )
