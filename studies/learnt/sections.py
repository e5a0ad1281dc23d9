"""Verdict and tables over one trial or many, of any system."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from studies.learnt.statistics import Mean, mean
from studies.learnt.words import NEAR, POLICY_WORDS, duration, grouped
from studies.reporting import KeyValues, Section, Table, Verdict

About = Mapping[str, Any]
_PLACE = ["true_samples", "estimator", "iteration"]


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
                "error": float(_by_group(seen, "one_step", about).mean(axis=1).mean()),
                "in 90 %": round(seen["coverage90"].astype(float).mean(), 3),
                "fit s": round(float(seen["fit_seconds"].mean()), 2),
            }
        if published:
            row["published"] = published.get(name, "")
        if "note" in part and part["note"].notna().any():
            row["note"] = "; ".join(sorted(set(part["note"].dropna()))[:3])
        table.append(row)
    return pd.DataFrame(table)


def model_errors(errors: pd.DataFrame, estimator: str, samples: int, update: int) -> pd.DataFrame:
    """The errors of one difference model where the policy goes, one row for each seed."""
    if errors.empty:
        return errors
    wanted = {"where": "visited", "estimator": estimator, "true_samples": samples,
              "iteration": update}  # fmt: skip
    return errors[(errors[list(wanted)] == pd.Series(wanted)).all(axis=1)]


def policies_section(summary: pd.DataFrame, about: About, best: float | None) -> Table:
    """What ``summarise`` found."""
    seeds = "mean over seeds with its 95 % interval" if "seeds" in summary else "of one seed"
    starts = f", each the mean of {about['starts']} starts" if about["starts"] > 1 else ""
    known = f" The best return that is possible is {best:.0f}." if best is not None else ""
    caption = f"Returns: {seeds}{starts}.{known}"
    if "above control" in summary:
        caption += (
            " Above control: seed by seed, less what as much training without a difference model "
            "returns."
        )
    if "error" in summary:
        caption += (
            " Error: of one step where the policy goes, as a share of the gap, mean over the "
            "groups of channels; in 90 %: share of the truth inside the predicted 90 % interval."
        )
    return Table.of(summary, heading="Policies", caption=caption, digits=2)


def above(learnt: pd.DataFrame, control: pd.DataFrame) -> list[float]:
    """Return less that of the control, for every seed that has both."""
    one, other = (part.set_index("seed")["return_true"] for part in (learnt, control))
    return [float(value) for value in (one - other).dropna()]


def headline(
    once: pd.DataFrame, errors: pd.DataFrame, about: About, best: float | None
) -> list[Section]:
    """Did it work on every seed, was it the difference model's doing, and in which numbers?"""
    kinds = {str(name): part for name, part in once.groupby("name")}
    before = kinds["idealised"].groupby("seed")["return_true"].mean()
    target, learnt = about["target"], kinds.get("difference", kinds.get("corrected"))
    if learnt is None:
        good = target is not None and before.min() >= target
        says = f"Trained on the simulator alone, the policy returns {before.mean():.5g} on the "
        tone: Any = "neutral" if target is None else "good" if good else "bad"
        return [Verdict(f"{says}true system.", tone=tone)]
    chosen, reached = _chosen(learnt, target)
    value, start = chosen["return_true"].mean(), before.mean()
    samples, estimator, update = chosen.iloc[0][_PLACE]
    text, closed = [], bool(value > start)
    if target is not None and start < target:
        seeds = " on every seed" if len(chosen) > 1 else ""
        closed = reached
        text.append(
            f"The target of {target:g} is passed{seeds}."
            if reached
            else f"The target of {target:g} is not reached{seeds}: more samples, another update or "
            "another estimator may close the rest; the accuracy below says where the model errs."
        )
    if "control" in kinds:
        control = kinds["control"][kinds["control"]["iteration"] == update]
        if pairs := above(chosen, control):
            text.append(
                "As much training without a difference model ends at "
                f"{control['return_true'].mean():.5g}; seed by seed the model is worth "
                f"{mean(pairs)}."
            )
            # A single run each: less than half of the gain is no contest.
            least = (value - start) / 2 if len(pairs) == 1 else 0.0
            closed = closed and mean(pairs).value > least
    if "true" in kinds:
        true = kinds["true"]["return_true"].mean()
        text.append(f"Learnt on the true system: {true:.5g}.")
        closed = closed and value - start >= NEAR * (true - start)
    if best is not None:
        text.append(f"The best that is possible is {best:.0f}.")
    by = f"{estimator}, update {update}" if "difference" in kinds else POLICY_WORDS["corrected"]
    needed = f"{samples} true samples, {duration(samples * about['dt'])}"
    better = bool(value > start)
    tiles: dict[str, Any] = {
        "idealised policy": f"{start:.5g}", f"after update {update}": f"{value:.5g}",
        "true interaction": duration(samples * about["dt"]),
    }  # fmt: skip
    seen = model_errors(errors, estimator, samples, update)
    if len(seen) and len(worst := _by_group(seen, "one_step", about).mean().dropna()):
        tiles["one-step error, share of gap"] = f"{worst.max():.2g}"
    return [
        Verdict(
            f"On the true system the return went from {start:.5g} to {value:.5g} ({by}, {needed}).",
            " ".join(text),
            tone="good" if closed else "warning" if better else "bad",
            label="gap closed" if closed else "not settled" if better else "gap remains",
        ),
        KeyValues(tiles, style="tiles"),
    ]


def _chosen(learnt: pd.DataFrame, target: float | None) -> tuple[pd.DataFrame, bool]:
    """The policies with the fewest samples that reach the target on every seed, or the best.

    Returns:
        One policy for each seed, and whether all reach it.
    """
    found = learnt.groupby(_PLACE)["return_true"].agg(["min", "mean"])
    works: Any = found.index[found["min"] >= target] if target is not None else []
    place: Any = works[0] if len(works) else found["mean"].idxmax()
    chosen = (learnt[_PLACE] == pd.Series(place, index=_PLACE)).all(axis=1)
    return learnt[chosen], bool(len(works))


def accuracy_section(errors: pd.DataFrame, about: About) -> list[Section]:
    """One-step and multi-step error, by estimator, samples, place and group of channels."""
    if errors.empty:
        return []
    found = (re.match(r"([\d.]+s)_", str(name)) for name in errors.columns)
    horizons = list(dict.fromkeys(match[1] for match in found if match))
    groups, table = list(about["groups"]), []
    keys = ["estimator", "true_samples", "iteration", "where"]
    for _, part in errors.groupby(keys, sort=False):
        estimator, samples, update, where = part.iloc[0][keys]
        one_step = _by_group(part, "one_step", about)
        table.append([
            f"{estimator}, update {update}", int(samples),
            "where it goes" if where == "visited" else "anywhere",
            *(_finite(one_step[name]).text(3) for name in groups),
            *(_finite(_by_group(part, h, about).mean(axis=1)).text(3) or None for h in horizons),
            float(part["coverage90"].astype(float).mean()),
            float(part["fit_seconds"].median()),
        ])  # fmt: skip
    return [
        Table(
            ["model", "true samples", "states", *(f"{name}, 1 step" for name in groups),
             *(f"all, {h.replace('s', ' s')}" for h in horizons), "90 % coverage", "fit s"],
            table,
            "Errors as shares of the gap without the model (1 is as bad as no model), with several "
            "seeds their mean and its 95 % interval: along the first seconds of fresh rollouts of "
            "the policy that was trained on the model, and from states drawn anywhere where the "
            "true system can be set; coverage of the predicted 90 % interval.",
            heading="Where the difference model is right",
        )
    ]  # fmt: skip


def _by_group(errors: pd.DataFrame, prefix: str, about: About) -> pd.DataFrame:
    """Errors by group of channels, one row per trial and update."""
    part = errors.filter(regex=f"^{re.escape(prefix)}_")
    part = part.rename(columns=lambda name: name.removeprefix(f"{prefix}_"))
    found = [grouped({str(k): v for k, v in row.items()}, about["groups"])
             for _, row in part.iterrows()]  # fmt: skip
    return pd.DataFrame(found, columns=list(about["groups"]), dtype=float)


def _finite(values: pd.Series) -> Mean:
    """The mean over what has a value."""
    return mean(values.astype(float).replace(np.inf, np.nan).dropna().tolist() or [np.nan])
