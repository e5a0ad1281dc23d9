"""The report of one trial of any system: verdict, pictures, tables."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from simgap_npz import read_npz
from studies.learning.outcome import record_key
from studies.learnt.figures import (
    SECONDS,
    Drawn,
    accuracy_figure,
    curves_figure,
    episodes_figure,
    returns_figure,
)
from studies.learnt.words import (
    NEAR,
    Results,
    accuracy_line,
    by_name,
    duration,
    grouped,
    last_difference,
    measures_of,
    overall,
    policy_name,
    provenance,
)
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
from studies.reporting.figures import save_figure
from studies.reporting.sections import Cell

Episodes = Mapping[str, Mapping[str, np.ndarray]]


def policy_table(results: Results) -> str:
    """The policies as text for the terminal."""
    dt = results["about"]["dt"]
    rows = [
        {
            "policy": policy_name(record),
            "true samples": record["true_samples"],
            "of truth": duration(record["true_samples"] * dt),
            "return on its model": f"{record['return_model']:.5g}",
            "return on the truth": f"{record['return_true']:.5g}",
            **{name.replace("_", " "): f"{v:.3g}" for name, v in measures_of(record).items()},
            "note": record.get("note", ""),
        }
        for record in results["policies"]
    ]
    table = pd.DataFrame(rows)
    if not table["note"].any():
        table = table.drop(columns="note")
    lines = [table.to_string(index=False, na_rep="")]
    lines += [accuracy_line(r, results["about"]["groups"]) for r in results["accuracy"]]
    return "\n".join(lines)


def read_episodes(results: Results, folder: Path) -> dict[str, dict[str, np.ndarray]]:
    """The episode of every policy that left one in ``folder/rollouts``, by ``record_key``."""
    found = {}
    for record in results["policies"]:
        path = folder / "rollouts" / f"{record_key(record)}.npz"
        if path.exists():
            found[record_key(record)] = read_npz(path)
    return found


def write_report(
    results: Results,
    folder: Path,
    episodes: Episodes,
    films: Mapping[str, Path],
    name: str = "report.html",
) -> Path:
    """Figures as PNG with their numbers as CSV, and one page, into ``folder``.

    Args:
        results: What ``results.json`` holds.
        folder: The trial's folder.
        episodes: One of each policy on the true system, by ``record_key``.
        films: GIF files of some of them.
        name: Of the page.

    Returns:
        The page.
    """
    about, figures = results["about"], folder / "figures"
    titles = {record_key(record): policy_name(record) for record in results["policies"]}
    learnt = last_difference(results)
    shown = ["idealised", *([record_key(learnt)] if learnt else []), "corrected", "true"]
    drawn = {titles[key]: episodes[key] for key in shown if key in episodes}

    def figure(file: str, made: Drawn, alt: str, caption: str, heading: str) -> Figure:
        save_figure(made[0], figures / f"{file}.png", made[1])
        return Figure(made[0], alt, caption, heading=heading)

    sections: list[Section] = [verdict(results), tiles(results)]
    if moving := [(titles[key], films[key]) for key in shown if key in films]:
        pictures = [
            Animation(path, alt=f"The true system under the policy: {title}.", caption=title)
            for title, path in moving
        ]
        caption = "The first seconds on the **true** system."
        sections.append(Gallery(pictures, caption, heading="Before and after"))
    sections.append(
        figure(
            "trajectories", episodes_figure(results, drawn),
            "State and action over time for each policy on the true system.",
            f"The first {SECONDS:g} s on the true system; a line ends where its episode ends.",
            "Episodes on the true system",
        )
    )  # fmt: skip
    if results["accuracy"]:
        sections += [
            figure(
                "returns", returns_figure(results),
                "Return on the true system against the number of true samples.",
                "Mean of the tests on the true system, which are not counted as samples.",
                "Return by true samples",
            ),
            figure(
                "accuracy", accuracy_figure(results),
                "One-step error of the difference model along visited states, by update.",
                "RMS error of one step over the RMS of the gap, along the first seconds of fresh "
                "rollouts of the policy that was trained on this model. 1 is as bad as no model.",
                "Where the difference model is right",
            ),
        ]  # fmt: skip
    sections += [
        figure(
            "curves", curves_figure(results),
            "Return while learning against steps.",
            "Tests in what each policy learns in; the best of them is kept.",
            "Learning curves",
        ),
        policies_section(results), accuracy_section(results), *provenance(results),
    ]  # fmt: skip
    title = f"{about['name'].replace('_', ' ').capitalize()}: closing the simulation gap"
    subtitle = ", ".join(
        [*([results["label"]] if "label" in results else []),
         *([f"seed {results['seed']}"] if "seed" in results else [])]
    )  # fmt: skip
    return Report(title, subtitle, sections).write(folder / name)


def verdict(results: Results) -> Verdict:
    """Did it work, in one sentence, and was it the difference model's doing?"""
    about, before = results["about"], results["policies"][0]["return_true"]
    target, learnt = about["target"], last_difference(results)
    named, control = by_name(results, "corrected"), by_name(results, "control")
    if learnt is None and named:
        after = named[0]["return_true"]
        return Verdict(
            f"On the true system the return went from {before:.5g} to {after:.5g}, without a "
            "true sample.",
            "The policy was trained on the simulator with what find_gap named.",
            tone="good" if after > before else "warning",
            label="gap closed" if after > before else "not settled",
        )
    if learnt is None:
        good = target is not None and before >= target
        return Verdict(
            f"Trained on the simulator alone, the policy returns {before:.5g} on the true system.",
            tone="neutral" if target is None else "good" if good else "bad",
        )
    after, samples = learnt["return_true"], learnt["true_samples"]
    parts = [f"It took {samples} true samples, {duration(samples * about['dt'])} of interaction."]
    closed = after > before
    if target is not None and before < target:
        passed = [r for r in by_name(results, "difference") if r["return_true"] >= target]
        closed = after >= target
        parts.append(
            f"The target of {target:g} was passed after {passed[0]['true_samples']}."
            if passed
            else f"The target of {target:g} is not reached: more samples, another update or "
            "another estimator may close the rest; the accuracy below says where the model errs."
        )
    if control:
        alone = control[-1]["return_true"]
        # One run each: less than half of the gain is no contest.
        earned = alone - before < (after - before) / 2
        parts.append(
            f"As much training without the difference model ends at {alone:.5g}: the gain is "
            + ("the model's doing." if earned else "not shown to be the model's doing.")
        )
        closed = closed and earned
    for record in by_name(results, "true"):
        best = record["return_true"]
        parts.append(f"A policy learnt on the true system returns {best:.5g}.")
        closed = closed and after - before >= NEAR * (best - before)
    if learnt.get("note"):
        parts.append(f"Of the last training: {learnt['note']}.")
    return Verdict(
        f"On the true system the return went from {before:.5g} to {after:.5g}.",
        " ".join(parts),
        tone="good" if closed else "warning" if after > before else "bad",
        label="gap closed" if closed else "not settled" if after > before else "gap remains",
    )


def tiles(results: Results) -> KeyValues:
    """The headline numbers."""
    learnt = last_difference(results)
    items: dict[str, Cell] = {"idealised policy": f"{results['policies'][0]['return_true']:.5g}"}
    if learnt:
        items["after the last update"] = f"{learnt['return_true']:.5g}"
        items["true interaction"] = duration(learnt["true_samples"] * results["about"]["dt"])
    if results["accuracy"]:
        one_step = results["accuracy"][-1]["visited"]["one_step"]
        errors = grouped(one_step, results["about"]["groups"])
        if errors:
            items["one-step error, share of gap"] = f"{max(errors.values()):.2g}"
    return KeyValues(items, style="tiles")


def policies_section(results: Results) -> Table:
    """All policies."""
    measures = list(dict.fromkeys(m for r in results["policies"] for m in measures_of(r)))
    noted = any("note" in record for record in results["policies"])
    rows: list[list[Any]] = []
    for record in results["policies"]:
        found = measures_of(record)
        rows.append([
            policy_name(record), record["true_samples"], record["simulated_steps"],
            record["return_model"], record["return_true"], *(found.get(m) for m in measures),
            round(record["seconds"], 1), *([record.get("note", "")] if noted else []),
        ])  # fmt: skip
    starts = results["about"]["starts"]
    return Table(
        ["policy", "true samples", "simulated steps", "return on its model",
         "return on the truth", *(m.replace("_", " ") for m in measures), "seconds of training",
         *(["note"] if noted else [])],
        rows,
        caption=f"Means over {starts} episodes on the true system." if starts > 1 else "",
        digits=5,
        heading="Policies",
    )  # fmt: skip


def accuracy_section(results: Results) -> Table | Prose:
    """One-step and multi-step error by group of channels."""
    if not results["accuracy"]:
        return Prose("No difference model was learnt.", heading="Accuracy")
    groups = results["about"]["groups"]
    horizons = list(results["accuracy"][0]["visited"]["multi_step"])
    rows: list[list[Cell]] = []
    for record in results["accuracy"]:
        for where, words in (("visited", "visited"), ("uniform", "anywhere")):
            if where not in record:
                continue
            measured = record[where]
            errors = grouped(measured["one_step"], groups)
            rows.append([
                f"{record['iteration']}, {words}", *(errors.get(name) for name in groups),
                *(overall(measured["multi_step"].get(h, {}), groups) for h in horizons),
                measured["coverage90"], record["fit_seconds"],
            ])  # fmt: skip
    return Table(
        ["update, states", *(f"{name}, 1 step" for name in groups),
         *(f"all, {horizon}" for horizon in horizons), "90 % coverage", "fit s"],
        rows,
        caption="Errors as shares of the gap without the model, along the first seconds of fresh "
        "rollouts of the policy trained on the model, and from states drawn anywhere where the "
        "true system can be set; coverage of the predicted 90 % interval.",
        heading="Accuracy",
    )  # fmt: skip
