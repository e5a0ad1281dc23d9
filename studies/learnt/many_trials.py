"""The report over many trials of any system: every policy by estimator, with intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from studies.learnt.many_figures import budgets_figure, updates_figure
from studies.learnt.samples_needed import samples_section
from studies.learnt.statistics import Mean, mean
from studies.learnt.tables import write_tables
from studies.learnt.words import (
    NEAR,
    POLICY_WORDS,
    Results,
    duration,
    failures_section,
    grouped,
    measures_of,
)
from studies.reporting import Figure, KeyValues, Report, Section, Table, Verdict
from studies.reporting.figures import save_figure


def write_grid_report(
    results: Sequence[Results],
    failures: Mapping[Path, str],
    folder: Path,
    best: float | None = None,
) -> str:
    """The tidy tables (``studies.learnt.tables``), figures and ``report.html``.

    Args:
        results: Of every finished trial.
        failures: Traceback of every failed trial, by folder.
        folder: Where to write.
        best: The best return that is possible, if it is known.

    Returns:
        The main table as text.
    """
    rows, errors = write_tables(results, folder)
    about, figures = results[0]["about"], folder / "figures"
    measures = list(dict.fromkeys(m for p in results[0]["policies"] for m in measures_of(p)))
    summary = summarise(rows, errors, about, measures)
    sections: list[Section] = [headline(rows, about, best), *failures_section(failures)]
    # The subtitle tells the number of seeds; as a column it only matters if some failed.
    shown = summary if summary["seeds"].nunique() > 1 else summary.drop(columns="seeds")
    known = f" The best return that is possible is {best:.0f}." if best is not None else ""
    sections.append(
        Table.of(
            shown,
            caption="Return on the true system: mean over seeds with its 95 % interval, each seed "
            f"the mean of its {about['starts']} starts.{known} Above control: seed by seed, less "
            "what as much training without a difference model returns. Error: of one step where "
            "the policy goes, as a share of the gap, mean over the groups of channels; in 90 %: "
            "share of the truth inside the predicted 90 % interval.",
            digits=2,
            heading="All policies",
        )
    )
    learnt = rows[rows["name"] == "difference"]
    drawings = []
    if len(set(learnt["samples_per_update"])) > 1:
        drawings.append((
            "budgets", budgets_figure(rows, errors, about, best), "Return by sample budget",
            "Return and accuracy against the number of true samples for each estimator.",
            "After one update, mean and 95 % interval of the mean over seeds; below, the one-step "
            "error where the policy goes, as a share of the gap.",
        ))  # fmt: skip
    if rows["iteration"].max() > 1 or "control" in set(rows["name"]):
        drawings.append((
            "updates", updates_figure(policies_once(rows)), "Return by update",
            "Return on the true system after each update, with and without a difference model.",
            "Mean over seeds and its 95 % interval; dashed, learnt on the true system.",
        ))  # fmt: skip
    for name, (figure, numbers), heading, alt, caption in drawings:
        save_figure(figure, figures / f"{name}.png", numbers)
        sections.append(Figure(figure, alt, caption, heading=heading))
    sections += [
        *accuracy_section(errors, about),
        *samples_section(policies_once(rows), results, about),
    ]
    sections.append(KeyValues(dict(results[0]["versions"]), heading="Versions"))
    title = f"{about['name'].replace('_', ' ').capitalize()}: many trials"
    subtitle = f"{len(results)} trials, {len(set(rows['seed']))} seeds"
    Report(title, subtitle, sections).write(folder / "report.html")
    return summary.to_string(index=False, na_rep="", float_format=lambda value: f"{value:.3g}")


def policies_once(rows: pd.DataFrame) -> pd.DataFrame:
    """Policies of many trials, those that they share once, in the order of ``POLICY_WORDS``."""
    rows = rows.copy()
    # Only the policies of the loop depend on the estimator.
    settings = rows.get("settings", "")
    rows["estimator"] = rows["estimator"].where(rows["name"] == "difference", settings)
    keys = ["name", "estimator", "iteration", "true_samples", "seed"]
    rows = rows.drop_duplicates(keys)
    order = rows["name"].map(list(POLICY_WORDS).index)
    return (
        rows.assign(order=order)
        .sort_values(["order", "estimator", "true_samples", "iteration"], kind="stable")
        .drop(columns="order")
    )


def summarise(
    rows: pd.DataFrame, errors: pd.DataFrame, about: Mapping[str, Any], measures: Sequence[str]
) -> pd.DataFrame:
    """One row per kind of policy: returns over seeds, measures, accuracy and fit time."""
    rows = policies_once(rows)
    control, published = rows[rows["name"] == "control"], about["published"]
    table = []
    keys = ["name", "estimator", "iteration", "true_samples"]
    for _, part in rows.groupby(keys, sort=False):
        name, estimator, update, samples = part.iloc[0][keys]
        returned = mean(part["return_true"].tolist())
        words = POLICY_WORDS[name].format(iteration=update)
        row: dict[str, Any] = {
            "policy": f"{estimator}, update {update}"
            if name == "difference"
            else ", ".join(filter(None, [words, estimator])),
            "true samples": int(samples),
            "return": str(returned),
            "worst seed": round(returned.worst),
            "seeds": returned.count,
        }
        if len(control):
            pairs = above(part, control[control["iteration"] == update])
            row["above control"] = str(mean(pairs)) if pairs and name == "difference" else ""
        for measure in measures:
            row[measure.replace("_", " ")] = _finite(part[measure]).text(2)
        if name == "difference" and len(errors):
            seen = errors[
                (errors["estimator"] == estimator)
                & (errors["samples_per_update"] * errors["iteration"] == samples)
                & (errors["iteration"] == update)
                & (errors["where"] == "visited")
            ]
            row |= {
                "error": float(_errors(seen, about).mean(axis=1).mean()),
                "in 90 %": round(seen["coverage90"].astype(float).mean(), 3),
                "fit s": round(float(seen["fit_seconds"].mean()), 2),
            }
        if published:
            row["published"] = published.get(name, "")
        if "note" in part and part["note"].notna().any():
            row["note"] = "; ".join(sorted(set(part["note"].dropna()))[:3])
        table.append(row)
    return pd.DataFrame(table)


def above(learnt: pd.DataFrame, control: pd.DataFrame) -> list[float]:
    """Return less that of the control, for every seed that has both."""
    one, other = (part.set_index("seed")["return_true"] for part in (learnt, control))
    return [float(value) for value in (one - other).dropna()]


def _finite(values: pd.Series) -> Mean:
    """The mean over what has a value."""
    return mean(values.astype(float).replace(np.inf, np.nan).dropna().tolist() or [np.nan])


def _errors(errors: pd.DataFrame, about: Mapping[str, Any]) -> pd.DataFrame:
    """One-step errors by group of channels, one row per trial and update."""
    prefix = "one_step_"
    one_step = errors.filter(like=prefix).rename(columns=lambda name: name.removeprefix(prefix))
    return pd.DataFrame(
        [
            grouped({str(k): v for k, v in row.items()}, about["groups"])
            for _, row in one_step.iterrows()
        ],
        columns=list(about["groups"]),
        dtype=float,
    )


def headline(rows: pd.DataFrame, about: Mapping[str, Any], best: float | None) -> Verdict:
    """Did the last update close the gap on every seed, and was it the difference model's doing?"""
    rows = policies_once(rows)
    kinds = {str(name): part for name, part in rows.groupby("name")}
    before = kinds["idealised"].groupby("seed")["return_true"].mean()
    learnt = kinds.get("difference", kinds.get("corrected"))
    if learnt is None:
        return Verdict(f"The idealised policy returns {before.mean():.5g} on the true system.")
    target = about["target"]
    goal = before.max() if target is None or before.mean() >= target else target
    keys = ["true_samples", "estimator", "iteration"]
    found = learnt.groupby(keys)["return_true"].agg(["min", "mean"])
    works = found[found["min"] >= goal]
    chosen = works if len(works) and target is not None and goal == target else found
    # The fewest samples that reach the target, or else the best of all.
    place: Any = chosen.index[0] if chosen is works else found["mean"].idxmax()
    samples, estimator, update = place
    value = found.loc[place]
    text, closed = [], bool(value["mean"] > before.mean())
    if goal == target:
        closed = chosen is works
        text.append(f"{'Every' if closed else 'Not every'} seed passed the target of {target:g}.")
    if "control" in kinds:
        control = kinds["control"][kinds["control"]["iteration"] == update]
        chosen_rows = (learnt[keys] == pd.Series(place, index=keys)).all(axis=1)
        pairs = above(learnt[chosen_rows], control)
        if pairs:
            text.append(
                "As much training without a difference model ends at "
                f"{control['return_true'].mean():.5g}; seed by seed the model is worth "
                f"{mean(pairs)}."
            )
            closed = closed and mean(pairs).value > 0
    if "true" in kinds:
        true = kinds["true"]["return_true"].mean()
        text.append(f"Learnt on the true system: {true:.5g}.")
        closed = closed and value["mean"] - before.mean() >= NEAR * (true - before.mean())
    if best is not None:
        text.append(f"The best that is possible is {best:.0f}.")
    name = estimator if "difference" in kinds else "The simulator corrected by name"
    return Verdict(
        f"{name} returns {value['mean']:.5g} on the true system after {samples} true samples "
        f"({duration(samples * about['dt'])}), from {before.mean():.5g}.",
        " ".join(text),
        tone="good" if closed else "warning",
        label="gap closed" if closed else "gap remains",
    )


def accuracy_section(errors: pd.DataFrame, about: Mapping[str, Any]) -> list[Section]:
    """One-step error where the policies go, by estimator, samples and group of channels."""
    if errors.empty:
        return []
    table: list[list[Any]] = []
    visited = errors[errors["where"] == "visited"]
    keys = ["estimator", "samples_per_update", "iteration"]
    for _, part in visited.groupby(keys, sort=False):
        estimator, samples, update = part.iloc[0][keys]
        one_step = _errors(part, about)
        means = [_finite(one_step[name]).text(3) for name in about["groups"]]
        covered = part["coverage90"].astype(float).mean()
        table.append([
            estimator, int(samples * update), int(update), *means, float(covered),
            float(part["fit_seconds"].median()),
        ])  # fmt: skip
    return [
        Table(
            ["estimator", "true samples", "update", *about["groups"], "90 % coverage", "fit s"],
            table,
            caption="One-step error as a share of the gap without the model, along the first "
            "seconds of fresh rollouts of the policy trained on it: mean over seeds with its 95 % "
            "interval.",
            heading="Accuracy where the policies go",
        )
    ]
