"""The report over many Leo trials: Tables III and IV and figure 8 of the paper beside ours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Drawing

from studies.learning.records import POLICY_WORDS, failures_section
from studies.learning.statistics import Mean, mean
from studies.learning.tables import write_tables
from studies.leo.groups import GROUPS, grouped
from studies.leo.report import NEAR
from studies.reporting import Figure, KeyValues, Report, Section, Table, Verdict
from studies.reporting.figures import PALETTE, new_figure, save_figure, styled
from studies.reporting.sections import Cell

# Tables III and IV of the paper.
PAPER_WALKS = (
    "The paper: idealised 9.2 ± 2.4 m and 111.4 ± 11.1 J/m, difference model 14.9 ± 0.5 m and "
    "106.0 ± 3.8 J/m, true 14.8 ± 0.5 m and 98.2 ± 6.7 J/m."
)
PAPER_TARGET = 2300.0
PAPER_SAMPLES = {
    "cold": "309 766 ± 35 282",
    "warm": "84 326 ± 6 287",
    "difference": "15 750 ± 7 648",
}


def write_grid_report(
    results: Sequence[Mapping[str, Any]], failures: Mapping[Path, str], folder: Path
) -> str:
    """The tidy tables (``studies.learning.tables``), figures and ``report.html``.

    Args:
        results: Of every finished trial.
        failures: Traceback of every failed trial, by folder.
        folder: Where to write.

    Returns:
        The main table as text.
    """
    rows, errors = write_tables(results, folder)
    summary = summarise(rows)
    sections: list[Section] = [headline(rows)]
    sections += failures_section(failures)
    sections += [
        Table.of(
            summary,
            caption="On the true Leo: mean over seeds with its 95 % interval, each seed the mean "
            "of its starts. Above control: seed by seed, less what as much training without a "
            "difference model returns. E is the motor work per metre, with the motor constant at "
            "the joint and with that of the bare motor, the reading that fits the paper's "
            f"numbers. {PAPER_WALKS}",
            heading="All policies (Table III)",
        ),
    ]
    if rows["iteration"].max() > 0:
        sections.append(
            Figure(
                updates_figure(rows, folder / "figures" / "updates.png"),
                "Return on the true Leo after each update, with and without a difference model.",
                "Mean over seeds and its 95 % interval (paper, figure 8); "
                "dashed, learnt on the true Leo.",
                heading="Return by update",
            )
        )
    sections += [
        *accuracy_section(errors),
        samples_section(rows, results),
        KeyValues(dict(results[0]["versions"]), heading="Versions"),
    ]
    Report(
        "Leo: many trials", f"{len(results)} trials, {len(set(rows['seed']))} seeds", sections
    ).write(folder / "report.html")
    return summary.to_string(index=False, na_rep="")


def summarise(rows: pd.DataFrame) -> pd.DataFrame:
    """One row per kind of policy: return, distance, work, falls."""
    rows = policies_once(rows)
    control = rows[rows["name"] == "control"]
    table = []
    keys = ["name", "estimator", "iteration", "true_samples"]
    for _, part in rows.groupby(keys, sort=False):
        name, estimator, iteration, samples = part.iloc[0][keys]
        words = POLICY_WORDS[name].format(iteration=iteration)
        returned = mean(part["return_true"].tolist())
        row: dict[str, Any] = {
            "policy": f"{estimator}, update {iteration}" if estimator else words,
            "true samples": int(samples),
            "return": str(returned),
            "worst seed": round(returned.worst),
            "seeds": returned.count,
        }
        if len(control):
            pairs = above(part, control[control["iteration"] == iteration]) if estimator else []
            row["above control"] = str(mean(pairs)) if pairs else ""
        if part["distance"].notna().all():
            row |= {
                "distance m": str(mean(part["distance"].tolist())),
                "E J/m": str(_finite(part["work_per_metre"])),
                "E J/m, bare motor": str(_finite(part["bare_work_per_metre"])),
                "falls %": round(100 * part["fell"].mean()),
            }
        table.append(row)
    return pd.DataFrame(table)


def policies_once(rows: pd.DataFrame) -> pd.DataFrame:
    """Policies of many trials, those that they share once, in the order of ``POLICY_WORDS``."""
    rows = rows.copy()
    # Only the policies of the loop depend on the estimator.
    rows.loc[rows["name"] != "difference", "estimator"] = ""
    rows = rows.drop_duplicates(["name", "estimator", "iteration", "true_samples", "seed"])
    order = rows["name"].map(list(POLICY_WORDS).index)
    rows = rows.assign(order=order).sort_values(["order", "estimator", "iteration"], kind="stable")
    return rows.drop(columns="order")


def above(learnt: pd.DataFrame, control: pd.DataFrame) -> list[float]:
    """Return less that of the control, for every seed that has both."""
    one, other = (part.set_index("seed")["return_true"] for part in (learnt, control))
    return [float(value) for value in (one - other).dropna()]


def _finite(values: pd.Series) -> Mean:
    """The mean over walks that led anywhere."""
    finite = values[np.isfinite(values)].tolist()
    return mean(finite or [np.nan])


def headline(rows: pd.DataFrame) -> Verdict:
    """Did the last update close the gap, and was it the difference model's doing?"""
    rows = policies_once(rows)
    kinds = {name: part for name, part in rows.groupby("name")}
    idealised = kinds["idealised"]["return_true"].mean()
    if "difference" not in kinds and "corrected" in kinds:
        named = kinds["corrected"]["return_true"].mean()
        return Verdict(
            f"On the simulator with what find_gap named policies come to {named:.0f} on the true "
            f"Leo, from {idealised:.0f}.",
            tone="good" if named > idealised else "warning",
        )
    if "difference" not in kinds:
        return Verdict(f"The idealised policy returns {idealised:.0f} on the true Leo.")
    last = {
        str(estimator): part[part["iteration"] == part["iteration"].max()]
        for estimator, part in kinds["difference"].groupby("estimator")
    }
    ranked = sorted(last, key=lambda estimator: -last[estimator]["return_true"].mean())
    best = last[ranked[0]]
    value, updates = best["return_true"].mean(), int(best["iteration"].iloc[0])
    text, closed = [], value > idealised
    if "control" in kinds:
        control = kinds["control"]
        control = control[control["iteration"] == updates]
        alone = control["return_true"].mean()
        text.append(f"As much training without a difference model ends at {alone:.0f}.")
        closed = closed and value > alone
        if len(pairs := above(best, control)) > 1:
            text.append(f"Seed by seed it is {mean(pairs)} better than that.")
    if "true" in kinds:
        true = kinds["true"]["return_true"].mean()
        text.append(f"Learnt on the true system: {true:.0f}; that is {value / true:.0%} of it.")
        closed = closed and value >= NEAR * true
    others = [f"{name} {last[name]['return_true'].mean():.0f}" for name in ranked[1:]]
    if others:
        text.append(f"The other estimators: {', '.join(others)}.")
    return Verdict(
        f"After {updates} update{'s' * (updates > 1)} {ranked[0]} returns {value:.0f} on the true "
        f"Leo, from {idealised:.0f}.",
        " ".join(text),
        tone="good" if closed else "warning",
        label="gap closed" if closed else "gap remains",
    )


def accuracy_section(errors: pd.DataFrame) -> list[Section]:
    """One-step error where the policies go, by estimator, update and group of channels."""
    if errors.empty:
        return []
    table: list[list[Cell]] = []
    visited = errors[errors["where"] == "visited"]
    for _, part in visited.groupby(["estimator", "iteration"]):
        seeds = [
            grouped({
                name.removeprefix("one_step_"): row[name]
                for name in part.columns
                if name.startswith("one_step_")
            })
            for _, row in part.iterrows()
        ]  # fmt: skip
        table.append([
            str(part["estimator"].iloc[0]), int(part["iteration"].iloc[0]),
            *(mean([seed[name] for seed in seeds if name in seed]).text(2) for name in GROUPS),
            float(part["coverage90"].mean()), float(part["fit_seconds"].median()),
        ])  # fmt: skip
    return [
        Table(
            ["estimator", "update", *GROUPS, "90 % coverage", "fit s"],
            table,
            caption="One-step error as a share of the gap without the model, along the first "
            "seconds of fresh rollouts of the policy trained on it: mean over seeds with its 95 % "
            "interval.",
            heading="Accuracy where the policies go",
        )
    ]


def samples_section(rows: pd.DataFrame, results: Sequence[Mapping[str, Any]]) -> Table:
    """True samples until a return of 2300 (Table IV), or until 90 % of the true policy's."""
    true = rows[rows["name"] == "true"].drop_duplicates("seed")["return_true"]
    targets = {f"{PAPER_TARGET:.0f}": PAPER_TARGET}
    if len(true):
        targets[f"{NEAR:.0%} of the true policy's {true.mean():.0f}"] = NEAR * float(true.mean())
    table = []
    for words, target in targets.items():
        for method, reached in samples_to(target, rows, results).items():
            values = [value for value in reached if value is not None]
            kind = method if method in PAPER_SAMPLES else "difference"
            table.append([
                words,
                POLICY_WORDS.get(method, method),
                str(mean(values)) if values else None,
                f"{len(values)} of {len(reached)}",
                PAPER_SAMPLES[kind] if target == PAPER_TARGET else None,
            ])  # fmt: skip
    return Table(
        ["return", "method", "true samples", "seeds that reached it", "paper"],
        table,
        caption="Cold and warm start are tested every 2500 samples without being charged for it; "
        "the first test at or above the return counts. Zero means that the idealised policy "
        "is there already.",
        heading="Samples to a return (Table IV)",
    )


def samples_to(
    target: float, rows: pd.DataFrame, results: Sequence[Mapping[str, Any]]
) -> dict[str, list[int | None]]:
    """By method, per seed the true samples after which ``target`` was first reached."""
    reached: dict[str, list[int | None]] = {}
    for trial in results:
        loop = [p for p in trial["policies"] if p["name"] in ("idealised", "difference")]
        at = [p["true_samples"] for p in loop if p["return_true"] >= target]
        label = f"difference model, {trial['label']}"
        reached.setdefault(label, []).append(at[0] if at else None)
        for record in trial["policies"]:
            if record["name"] in ("cold", "warm"):
                steps = [step for step, value in record["curve"] if value >= target]
                reached.setdefault(record["name"], []).append(steps[0] if steps else None)
    return reached


@styled()
def updates_figure(rows: pd.DataFrame, path: Path) -> Drawing:
    """Return per update by estimator, and of the control."""
    figure, axes = new_figure(height=3.8)
    axis = axes[0, 0]
    idealised = rows[rows["name"] == "idealised"].drop_duplicates("seed")["return_true"].tolist()
    numbers = []
    loops = [
        (label, part) for label, part in rows[rows["name"] == "difference"].groupby("estimator")
    ]
    control = rows[rows["name"] == "control"].drop_duplicates(["seed", "iteration"])
    if len(control):
        loops.append(("no difference model", control))
    for colour, (label, part) in zip(PALETTE, loops, strict=False):
        means = {0: mean(idealised)} | {
            int(group["iteration"].iloc[0]): mean(group["return_true"].tolist())
            for _, group in part.groupby("iteration")
        }
        values = list(means.values())
        axis.plot(list(means), [m.value for m in values], "o-", color=colour, label=label)
        axis.fill_between(list(means), [m.low for m in values], [m.high for m in values],
                          color=colour, alpha=0.15, linewidth=0)  # fmt: skip
        numbers += [
            {"method": label, "update": k, "return": m.value, "half_width": m.half_width}
            for k, m in means.items()
        ]
    true = rows[rows["name"] == "true"].drop_duplicates("seed")["return_true"]
    if len(true):
        axis.axhline(true.mean(), color="#6e7781", linestyle=(0, (4, 3)))
    axis.set(xlabel="update", ylabel="return on the true Leo")
    axis.xaxis.get_major_locator().set_params(integer=True)
    figure.legend(loc="outside upper left", ncols=3, handlelength=1.4)
    save_figure(figure, path, pd.DataFrame(numbers))
    return figure
