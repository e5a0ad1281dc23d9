"""The tables of a report over one trial or many, of any system."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from studies.learnt.errors import by_group, model_errors, over_rollouts
from studies.learnt.statistics import Mean, above, common_starts, mean, starts
from studies.learnt.words import POLICY_WORDS, duration
from studies.reporting.sections import Section, Table

About = Mapping[str, Any]


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
    once: pd.DataFrame, errors: pd.DataFrame, about: About, measures: Sequence[str]
) -> pd.DataFrame:
    """One row per kind of policy: returns over seeds, measures, accuracy and fit time."""
    control, published = once[once["name"] == "control"], about["published"]
    several = once["seed"].nunique() > 1
    table = []
    keys = ["name", "estimator", "iteration", "true_samples"]
    for _, part in once.groupby(keys, sort=False):
        name, estimator, update, samples = part.iloc[0][keys]
        returned = mean(part["return_true"].tolist())
        words = POLICY_WORDS[name].format(iteration=update)
        row: dict[str, Any] = {
            "policy": f"{estimator}, update {update}"
            if name == "difference"
            else ", ".join(filter(None, [words, estimator])),
            "true samples": int(samples),
            "of truth": duration(samples * about["dt"]),
            **({"steps": int(part["simulated_steps"].mean())} if "simulated_steps" in part else {}),
            "return on its model": str(mean(part["return_model"].tolist())),
            "return on the truth": str(returned),
        }
        if several:
            row |= {"worst seed": round(returned.worst), "seeds": returned.count}
        if len(control):
            pairs = above(part, control[control["iteration"] == update])
            row["above control"] = str(mean(pairs)) if pairs and name == "difference" else ""
        for measure in measures:
            row[measure.replace("_", " ")] = _finite(part[measure]).text(3)
        if name == "difference" and len(errors):
            seen = model_errors(errors, estimator, samples, update)
            row |= {
                "error": float(by_group(seen, "one_step", about).mean(axis=1).mean()),
                "in 90 %": float(seen["coverage90"].astype(float).mean()),
                "fit s": float(seen["fit_seconds"].mean()),
            }
        if published:
            row["published"] = published.get(name, "")
        if "note" in part and part["note"].notna().any():
            row["note"] = "; ".join(sorted(set(part["note"].dropna()))[:3])
        table.append(row)
    return pd.DataFrame(table)


def legend(summary: pd.DataFrame, once: pd.DataFrame) -> list[str]:
    """What the columns of ``summarise`` mean, a sentence for each that needs one.

    Args:
        summary: What it found.
        once: The policies that it was given.
    """
    several, tested = "seeds" in summary, starts(once)
    seeds = "mean over seeds with its 95 % interval" if several else "of one seed"
    same = (
        "the same for all policies"
        if common_starts(once)
        else "others for every policy, since the true system begins elsewhere under the same seed"
    )
    each = f", each the mean of {tested} starts, {same}" if tested > 1 else ""
    says = [f"Returns: {seeds}{each}."]
    if "steps" in summary:
        says.append("Steps: of training in simulation for this policy alone.")
    if "above control" in summary:
        pairs = "seed by seed" if several else "start by start" if tested > 1 else "the return"
        says.append(
            f"Above control: {pairs}, less what as much training without a difference model "
            "returns."
        )
    if "error" in summary:
        says += [
            "Error: of one step where the policy goes, as a share of the gap (1 is as bad as no "
            "model), mean over the groups of channels.",
            "In 90 %: share of the truth inside the predicted 90 % interval.",
        ]
    return says


def policies_section(summary: pd.DataFrame, once: pd.DataFrame, about: About) -> Table:
    """What ``summarise`` found."""
    best = about.get("best")
    known = [f"The best return that is possible is {best:.0f}."] if best is not None else []
    caption = " ".join([*legend(summary, once), *known])
    return Table.of(summary, heading="Policies", caption=caption, digits=2)


def says_section(results: Sequence[Mapping[str, Any]]) -> list[Table]:
    """What estimators say of what they learnt, one row for each update of each trial."""
    rows = [
        [f"{trial.get('label', 'model')}, update {record['iteration']}", record["true_samples"],
         trial.get("seed", 0), record["says"]]
        for trial in results
        for record in trial["accuracy"]
        if "says" in record
    ]  # fmt: skip
    columns = ["model", "true samples", "seed", "what it learnt"]
    return [Table(columns, rows, heading="What the difference model says")] if rows else []


def accuracy_section(errors: pd.DataFrame, about: About) -> list[Section]:
    """One-step and multi-step error, by estimator, samples, place and group of channels."""
    if errors.empty:
        return []
    found = (re.match(r"([\d.e+-]+s)_", str(name)) for name in errors.columns)
    horizons = list(dict.fromkeys(match[1] for match in found if match))
    groups, table = list(about["groups"]), []
    # An earlier version did not keep how many seconds, and never measured whole rollouts.
    seconds = about.get("visited_seconds", "")
    told = f"{seconds:g} s" if seconds else "seconds"
    first = "" if seconds is None else f"the first {told} of "
    keys = ["estimator", "true_samples", "iteration", "where"]
    for _, part in errors.groupby(keys, sort=False):
        estimator, samples, update, where = part.iloc[0][keys]
        one_step = by_group(part, "one_step", about)
        table.append([
            f"{estimator}, update {update}", int(samples),
            "where it goes" if where == "visited" else "anywhere",
            *(_with_interval(part, one_step[name], about) for name in groups),
            *(_finite(by_group(part, h, about).mean(axis=1)).text(3) or None for h in horizons),
            float(part["coverage90"].astype(float).mean()),
            float(part["fit_seconds"].median()),
        ])  # fmt: skip
    return [
        Table(
            ["model", "true samples", "states", *(f"{name}, 1 step" for name in groups),
             *(f"all, {h.replace('s', ' s')}" for h in horizons), "90 % coverage", "fit s"],
            table,
            "Errors as shares of the gap without the model (1 is as bad as no model), with several "
            "seeds their mean and its 95 % interval, of one step by one seed in brackets that over "
            f"its rollouts: along {first}fresh rollouts of the policy "
            "that was trained on the model, and from states drawn anywhere where the true system "
            "can be set; coverage of the predicted 90 % interval.",
            heading="Where the difference model is right",
        )
    ]  # fmt: skip


def _with_interval(part: pd.DataFrame, errors: pd.Series, about: About) -> str:
    """A group's one-step error with its interval over seeds, or over the rollouts of one."""
    text = _finite(errors).text(3)
    ends = over_rollouts(part, str(errors.name), about)
    return f"{text} ({ends[0]:.2g} to {ends[1]:.2g})" if text and ends else text


def _finite(values: pd.Series) -> Mean:
    """The mean over what has a value."""
    return mean(values.astype(float).replace(np.inf, np.nan).dropna().tolist() or [np.nan])
